//! Tables: named columns with units, cells that know how precisely they are to be printed.
//!
//! A table is printed four ways: [`Table::to_text`] for a terminal, [`Table::to_markdown`],
//! [`Table::to_html`], and [`Table::to_csv`], which alone keeps every digit.

use super::ReportError;
use super::number::{exact, significant};

/// To which side a column's text is pushed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// Text begins at the left edge.
    Left,
    /// Numbers end at the right edge.
    Right,
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// What stands in the column.
    pub header: String,
    /// Unit of the numbers; empty where they have none.
    pub unit: String,
    /// Side to which the cells are pushed.
    pub alignment: Alignment,
}

impl Column {
    /// A column of numbers without a unit, pushed to the right.
    pub fn number(header: impl Into<String>) -> Self {
        Self {
            header: header.into(),
            unit: String::new(),
            alignment: Alignment::Right,
        }
    }

    /// A column of words, pushed to the left.
    pub fn text(header: impl Into<String>) -> Self {
        Self {
            alignment: Alignment::Left,
            ..Self::number(header)
        }
    }

    /// The same column with a unit.
    #[must_use]
    pub fn with_unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = unit.into();
        self
    }

    /// Header and unit as one heading, the unit in brackets.
    pub fn heading(&self) -> String {
        if self.unit.is_empty() {
            self.header.clone()
        } else {
            format!("{} [{}]", self.header, self.unit)
        }
    }
}

/// One cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A count or another whole number.
    Integer(i64),
    /// A number with the significant digits (1 to 17) that a person should see.
    Number {
        /// The value; CSV writes all of it.
        value: f64,
        /// Significant digits for people.
        digits: usize,
    },
    /// Nothing is known here; an empty cell in CSV, a dash elsewhere.
    Missing,
}

impl Cell {
    /// A cell of words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number to so many significant digits.
    pub fn number(value: f64, digits: usize) -> Self {
        Self::Number { value, digits }
    }

    /// The cell as a person reads it.
    pub fn for_people(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Integer(value) => value.to_string(),
            Self::Number { value, digits } => significant(*value, *digits),
            Self::Missing => "-".to_owned(),
        }
    }

    /// The cell as a program reads it: 17 significant digits, nothing where nothing is known.
    pub fn for_programs(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Integer(value) => value.to_string(),
            Self::Number { value, .. } => exact(*value),
            Self::Missing => String::new(),
        }
    }
}

/// Rows of cells under named columns; every row has one cell for every column.
///
/// ```
/// use grazemap::report::{Cell, Column, Table};
///
/// let mut table = Table::new(vec![Column::text("order"), Column::number("error")]);
/// table.push(vec![Cell::text("5, 6"), Cell::number(1.25e-9, 3)])?;
/// assert_eq!(table.to_csv()?, "order,error\n\"5, 6\",1.2500000000000000e-9\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table of these columns.
    pub fn new(columns: Vec<Column>) -> Self {
        Self {
            columns,
            rows: Vec::new(),
        }
    }

    /// The columns, left to right.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The rows, top to bottom.
    pub fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// Adds a row at the bottom.
    ///
    /// # Errors
    ///
    /// [`ReportError::RowWidth`] if the row has not one cell for every column.
    pub fn push(&mut self, row: Vec<Cell>) -> Result<(), ReportError> {
        if row.len() != self.columns.len() {
            return Err(ReportError::RowWidth {
                row: self.rows.len(),
                expected: self.columns.len(),
                found: row.len(),
            });
        }
        self.rows.push(row);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_the_wrong_width_is_refused_and_not_kept() {
        let mut table = Table::new(vec![Column::number("a"), Column::number("b")]);
        let refused = table.push(vec![Cell::Missing]);
        assert!(matches!(
            refused,
            Err(ReportError::RowWidth {
                row: 0,
                expected: 2,
                found: 1
            })
        ));
        assert!(table.rows().is_empty());
    }

    #[test]
    fn a_heading_names_the_unit() {
        let column = Column::number("step").with_unit("ns");
        assert_eq!(column.heading(), "step [ns]");
        assert_eq!(Column::text("scene").heading(), "scene");
    }
}
