//! Tables: named columns with units, and cells that know their printed precision. Also numbers as
//! text: short for people, exact for programs.
//!
//! A table is printed in four formats: [`Table::to_text`] for a terminal, [`Table::to_markdown`],
//! [`Table::to_html`], and [`Table::to_csv`], the only one that keeps every digit.

use std::fmt::Write as _;
use std::io;

use super::ReportError;
use grazemap_figure::escape_html;

/// Horizontal alignment of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// Text begins at the left edge.
    Left,
    /// Numbers end at the right edge.
    Right,
}

/// Column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name of the column.
    pub header: String,
    /// Unit of the numbers; empty without a unit.
    pub unit: String,
    /// Alignment of the cells.
    pub alignment: Alignment,
}

impl Column {
    /// Right-aligned column of numbers without a unit.
    pub fn number(header: impl Into<String>) -> Self {
        Self { header: header.into(), unit: String::new(), alignment: Alignment::Right }
    }

    /// Left-aligned column of text.
    pub fn text(header: impl Into<String>) -> Self {
        Self { alignment: Alignment::Left, ..Self::number(header) }
    }

    /// Adds a unit.
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

/// Cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A count or another whole number.
    Integer(i64),
    /// Number with the significant digits (1 to 17) shown to people.
    Number {
        /// Value; CSV writes all digits.
        value: f64,
        /// Significant digits for people.
        digits: usize,
    },
    /// Missing value: an empty cell in CSV, a dash elsewhere.
    Missing,
}

impl Cell {
    /// Cell of text.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// Number with this many significant digits.
    pub fn number(value: f64, digits: usize) -> Self {
        Self::Number { value, digits }
    }

    /// Value of the cell as a number, also if it is a count or text; NaN if it is no number.
    pub fn value(&self) -> f64 {
        match self {
            Self::Integer(value) => *value as f64,
            Self::Number { value, .. } => *value,
            Self::Text(text) => text.parse().unwrap_or(f64::NAN),
            Self::Missing => f64::NAN,
        }
    }

    /// Text of the cell for people.
    pub fn for_people(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Integer(value) => value.to_string(),
            Self::Number { value, digits } => significant(*value, *digits),
            Self::Missing => "-".to_owned(),
        }
    }

    /// Text of the cell for programs: 17 significant digits; empty if missing.
    pub fn for_programs(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Integer(value) => value.to_string(),
            Self::Number { value, .. } => exact(*value),
            Self::Missing => String::new(),
        }
    }
}

/// Writer of a table as CSV, row by row.
pub struct CsvStream<W: io::Write>(csv::Writer<W>);

impl<W: io::Write> CsvStream<W> {
    /// Creates the writer and writes the header.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] if there are no columns or the writer refuses.
    pub fn new(writer: W, columns: &[Column]) -> Result<Self, ReportError> {
        let mut writer = csv::Writer::from_writer(writer);
        writer.write_record(columns.iter().map(|column| &column.header))?;
        Ok(Self(writer))
    }

    /// Writes one row.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] if the number of cells differs from that of the columns, or the writer
    /// refuses.
    pub fn push(&mut self, row: &[Cell]) -> Result<(), ReportError> {
        Ok(self.0.write_record(row.iter().map(Cell::for_programs))?)
    }

    /// Flushes the buffer.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] if the writer refuses.
    pub fn finish(mut self) -> Result<(), ReportError> {
        Ok(self.0.flush().map_err(csv::Error::from)?)
    }
}

/// Rows of cells under named columns; every row has one cell for every column.
///
/// ```
/// use grazemap::report::{Cell, Column, Table};
///
/// let mut table = Table::new(vec![Column::text("order"), Column::number("error")]);
/// table.push(vec![Cell::text("5, 6"), Cell::number(1.25e-9, 3)]);
/// assert_eq!(table.to_csv()?, "order,error\n\"5, 6\",1.2500000000000000e-9\n");
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// Table of these columns, without rows.
    pub fn new(columns: Vec<Column>) -> Self {
        Self { columns, rows: Vec::new() }
    }

    /// Adds a row at the bottom.
    ///
    /// # Panics
    ///
    /// If the row has not one cell for every column.
    pub fn push(&mut self, row: Vec<Cell>) {
        assert_eq!(row.len(), self.columns.len(), "one cell for every column");
        self.rows.push(row);
    }

    /// The columns, left to right.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The rows, top to bottom.
    pub fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// Iterator of the rows.
    pub fn as_rows(&self) -> Rows<'_> {
        Rows::new(self.columns.clone(), self.rows.iter().cloned())
    }

    /// Turns the table into an iterator of rows.
    pub fn into_rows(self) -> Rows<'static> {
        Rows::new(self.columns, self.rows.into_iter())
    }
}

/// Table that is built column by column, with a function that computes the cells of each column.
pub(super) struct ByColumn<R> {
    of: Vec<R>,
    table: Table,
}

impl Table {
    /// Table with one row per item and no columns yet.
    pub(super) fn of<R: Copy>(rows: impl IntoIterator<Item = R>) -> ByColumn<R> {
        let of: Vec<R> = rows.into_iter().collect();
        let table = Self { columns: Vec::new(), rows: vec![Vec::new(); of.len()] };
        ByColumn { of, table }
    }
}

impl<R: Copy> ByColumn<R> {
    /// Adds a column of cells.
    pub(super) fn column(mut self, column: Column, cell: impl Fn(R) -> Cell) -> Self {
        self.table.columns.push(column);
        self.table.rows.iter_mut().zip(&self.of).for_each(|(row, &of)| row.push(cell(of)));
        self
    }

    /// Adds a column of text.
    pub(super) fn text<T: Into<String>>(self, header: &str, words: impl Fn(R) -> T) -> Self {
        self.column(Column::text(header), |of| Cell::text(words(of)))
    }

    /// Adds a column of counts.
    pub(super) fn count<T: TryInto<i64>>(self, header: &str, count: impl Fn(R) -> T) -> Self {
        let cell = |of| count(of).try_into().map_or(Cell::Missing, Cell::Integer);
        self.column(Column::number(header), cell)
    }

    /// Adds a column of numbers with this many significant digits; an unknown number is a missing
    /// cell.
    pub(super) fn number<T: Into<Option<f64>>>(
        self,
        header: &str,
        digits: usize,
        value: impl Fn(R) -> T,
    ) -> Self {
        let cell = |value| Cell::number(value, digits);
        self.column(Column::number(header), |of| value(of).into().map_or(Cell::Missing, cell))
    }

    /// Adds columns of numbers under these headers; a number is found by its place among them.
    pub(super) fn numbers<H: AsRef<str>, T: Into<Option<f64>>>(
        mut self,
        headers: impl IntoIterator<Item = H>,
        digits: usize,
        value: impl Fn(R, usize) -> T,
    ) -> Self {
        for (place, header) in headers.into_iter().enumerate() {
            self = self.number(header.as_ref(), digits, |of| value(of, place));
        }
        self
    }

    /// Adds a column of flags, 1 or 0.
    pub(super) fn flag(self, header: &str, holds: impl Fn(R) -> bool) -> Self {
        self.column(Column::number(header), |of| Cell::Integer(holds(of).into()))
    }

    /// Adds a column of numbers with as many digits as they need, and no more than this.
    pub(super) fn shortest(
        self,
        header: &str,
        most: usize,
        value: impl Fn(R) -> Option<f64>,
    ) -> Self {
        let cell = |value| Cell::number(value, digits_needed(value, most));
        self.column(Column::number(header), |of| value(of).map_or(Cell::Missing, cell))
    }

    /// Adds a unit to the last column.
    pub(super) fn unit(mut self, unit: &str) -> Self {
        if let Some(column) = self.table.columns.last_mut() {
            unit.clone_into(&mut column.unit);
        }
        self
    }

    /// Finished table.
    pub(super) fn made(self) -> Table {
        self.table
    }
}

impl Table {
    /// Aligned columns for a terminal, two spaces between them, a line under the headings.
    ///
    /// Control characters in cells are replaced by spaces, so that a cell never breaks its row or
    /// steers the terminal.
    pub fn to_text(&self) -> String {
        let lines = self.lines(|cell| plain(&cell.for_people()), plain);
        let widths = widths(&lines);
        let mut text = String::new();
        for (index, line) in lines.iter().enumerate() {
            text.push_str(self.aligned(line, &widths, "  ").trim_end());
            text.push('\n');
            if index == 0 {
                let rules: Vec<String> = widths.iter().map(|&width| "─".repeat(width)).collect();
                text.push_str(&rules.join("  "));
                text.push('\n');
            }
        }
        text
    }

    /// Markdown table, padded so that its source is aligned too.
    pub fn to_markdown(&self) -> String {
        let escape = |text: &str| plain(text).replace('\\', "\\\\").replace('|', "\\|");
        let lines = self.lines(|cell| escape(&cell.for_people()), escape);
        let widths: Vec<usize> = widths(&lines).iter().map(|&width| width.max(3)).collect();
        let mut text = String::new();
        for (index, line) in lines.iter().enumerate() {
            writeln!(text, "| {} |", self.aligned(line, &widths, " | "))
                .expect("a String takes all");
            if index == 0 {
                let rules: Vec<String> = self
                    .columns()
                    .iter()
                    .zip(&widths)
                    .map(|(column, &width)| match column.alignment {
                        Alignment::Left => "-".repeat(width),
                        Alignment::Right => format!("{}:", "-".repeat(width - 1)),
                    })
                    .collect();
                writeln!(text, "| {} |", rules.join(" | ")).expect("a String takes all");
            }
        }
        text
    }

    /// HTML `table` element with escaped content; numbers have the class `number`.
    pub fn to_html(&self) -> String {
        let mut html = String::from("<table>\n<thead><tr>");
        for column in self.columns() {
            let class = class_of(column.alignment);
            write!(html, "<th{class} scope=\"col\">{}", typeset(&column.header))
                .expect("a String takes all");
            if !column.unit.is_empty() {
                write!(html, " <span class=\"unit\">[{}]</span>", escape_html(&column.unit))
                    .expect("a String takes all");
            }
            html.push_str("</th>");
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in self.rows() {
            html.push_str("<tr>");
            for (cell, column) in row.iter().zip(self.columns()) {
                let class = class_of(column.alignment);
                write!(html, "<td{class}>{}</td>", cell_html(cell)).expect("a String takes all");
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody>\n</table>\n");
        html
    }

    /// CSV (RFC 4180 quoting, lines ended by a newline): header, then rows with every digit.
    ///
    /// Numbers have 17 significant digits; numbers that are not finite are `nan`, `inf` and `-inf`;
    /// a missing cell is empty. The header has the bare column names without units, so that a
    /// program can name a column.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] if the table has no columns.
    pub fn to_csv(&self) -> Result<String, ReportError> {
        let mut bytes = Vec::new();
        self.as_rows().write_csv(&mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Header and rows as text, the header first.
    fn lines(
        &self,
        cell: impl Fn(&Cell) -> String,
        heading: impl Fn(&str) -> String,
    ) -> Vec<Vec<String>> {
        let headings = self.columns().iter().map(|column| heading(&column.heading())).collect();
        let rows = self.rows().iter().map(|row| row.iter().map(&cell).collect());
        std::iter::once(headings).chain(rows).collect()
    }

    fn aligned(&self, line: &[String], widths: &[usize], between: &str) -> String {
        let cells: Vec<String> = line
            .iter()
            .zip(widths)
            .zip(self.columns())
            .map(|((text, &width), column)| match column.alignment {
                Alignment::Left => format!("{text:<width$}"),
                Alignment::Right => format!("{text:>width$}"),
            })
            .collect();
        cells.join(between)
    }
}

/// Rows of a table that is too long to be held in memory.
pub struct Rows<'a> {
    columns: Vec<Column>,
    rows: Box<dyn Iterator<Item = Vec<Cell>> + 'a>,
}

impl<'a> Rows<'a> {
    /// Rows under columns; every row has one cell for every column.
    pub fn new(columns: Vec<Column>, rows: impl Iterator<Item = Vec<Cell>> + 'a) -> Self {
        Self { columns, rows: Box::new(rows) }
    }

    /// The columns, left to right.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Collects the rows into a table.
    ///
    /// # Panics
    ///
    /// As [`Table::push`].
    pub fn into_table(self) -> Table {
        let mut table = Table::new(self.columns.clone());
        self.for_each(|row| table.push(row));
        table
    }

    /// Writes the rows as [`Table::to_csv`] does.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] for a row of wrong width, or if the writer refuses.
    pub fn write_csv(self, out: &mut dyn io::Write) -> Result<(), ReportError> {
        let mut stream = CsvStream::new(out, &self.columns)?;
        for row in self {
            stream.push(&row)?;
        }
        stream.finish()
    }
}

impl Iterator for Rows<'_> {
    type Item = Vec<Cell>;

    fn next(&mut self) -> Option<Vec<Cell>> {
        self.rows.next()
    }
}

fn widths(lines: &[Vec<String>]) -> Vec<usize> {
    let columns = lines.first().map_or(0, Vec::len);
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max();
    (0..columns).map(|column| width(column).unwrap_or(0)).collect()
}

fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn class_of(alignment: Alignment) -> &'static str {
    match alignment {
        Alignment::Left => "",
        Alignment::Right => " class=\"number\"",
    }
}

/// Cell as HTML. Scientific notation becomes a power of ten.
fn cell_html(cell: &Cell) -> String {
    let text = cell.for_people();
    match (cell, text.split_once('e')) {
        (Cell::Missing, _) => "<span class=\"missing\">–</span>".to_owned(),
        (Cell::Number { value, .. }, Some((mantissa, exponent))) if value.is_finite() => {
            format!("{}\u{2009}×\u{2009}10<sup>{}</sup>", minus(mantissa), minus(exponent))
        }
        (Cell::Number { .. } | Cell::Integer(_), _) => minus(&text),
        (Cell::Text(_), _) => typeset(&text),
    }
}

/// Text of a number with a proper minus.
pub(super) fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// Number with `digits` significant digits, for people.
///
/// Fixed notation if the exponent of ten lies between -4 and 5, else scientific; never more digits
/// than asked for; an ASCII minus sign, so that the text can be parsed back. `digits` is clamped to
/// 1 to 17.
pub(super) fn significant(value: f64, digits: usize) -> String {
    let digits = digits.clamp(1, 17);
    if !value.is_finite() {
        return non_finite(value).to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{:.*e}", digits - 1, value);
    let exponent = exponent_of(&scientific);
    if (-4..=5).contains(&exponent) {
        let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
        format!("{value:.decimals$}")
    } else {
        scientific
    }
}

/// Significant digits of a number rounded to `most` of them, without the zeros at its end.
pub(super) fn digits_needed(value: f64, most: usize) -> usize {
    let rounded = format!("{value:.*e}", most.clamp(1, 17) - 1);
    let mantissa = rounded.split('e').next().unwrap_or_default();
    let digits = mantissa.trim_end_matches('0').chars().filter(char::is_ascii_digit);
    digits.count().max(1)
}

/// Letters of the theory whose index, after an underscore, is set below the line.
const INDEXED: [(&str, &str); 4] = [("xi", "ξ"), ("P", "P"), ("dP", "dP"), ("h", "h")];

/// HTML of words: escaped, with the indices of the theory's letters (`xi_n`, `P_smooth`, `h_x`)
/// below and powers above the line.
pub(super) fn typeset(text: &str) -> String {
    let escaped = escape_html(text).replace("&lt;=", "≤");
    let mut html = String::with_capacity(escaped.len());
    let mut rest = escaped.as_str();
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    while let Some(mark) = rest.find(['_', '^']) {
        let (before, after) = (&rest[..mark], &rest[mark + 1..]);
        let length = after.find(|letter| !is_word(letter)).unwrap_or(after.len());
        let index = &after[..length];
        let base = before.rsplit(|letter| !is_word(letter)).next().unwrap_or_default();
        let letter = INDEXED.iter().find(|(name, _)| *name == base).map(|(_, letter)| letter);
        let is_power = rest[mark..].starts_with('^');
        match letter {
            _ if is_power && !index.is_empty() => {
                html.push_str(&format!("{before}<sup>{index}</sup>"));
            }
            Some(letter) if !index.is_empty() && !index.contains('_') => {
                let before = &before[..before.len() - base.len()];
                html.push_str(&format!("{before}<i>{letter}</i><sub>{index}</sub>"));
            }
            _ => html.push_str(&rest[..mark + 1 + length]),
        }
        rest = &after[length..];
    }
    html + rest
}

/// Number with 17 significant digits, which reads back as the same double.
pub(super) fn exact(value: f64) -> String {
    if value.is_finite() { format!("{value:.16e}") } else { non_finite(value).to_owned() }
}

fn non_finite(value: f64) -> &'static str {
    match (value.is_nan(), value > 0.0) {
        (true, _) => "nan",
        (false, true) => "inf",
        (false, false) => "-inf",
    }
}

fn exponent_of(scientific: &str) -> i32 {
    scientific.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// Names in quotes, in a sentence: "`a`", "`a` and `b`", "`a`, `b` and `c`".
pub(super) fn quoted(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

/// Count of things: `1 file`, `2 files`, `2 branches`.
pub fn counted(count: usize, thing: &str) -> String {
    let hisses = ["s", "x", "z", "ch", "sh"].iter().any(|end| thing.ends_with(end));
    let plural = match (count, hisses) {
        (1, _) => "",
        (_, true) => "es",
        (_, false) => "s",
    };
    format!("{count} {thing}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "one cell for every column")]
    fn a_row_has_one_cell_for_every_column() {
        Table::new(vec![Column::number("a"), Column::number("b")]).push(vec![Cell::Missing]);
    }

    #[test]
    fn columns_by_name_stand_where_their_place_says() {
        let rows = [[1.5, f64::NAN], [2.5, 3.5]];
        let finite =
            |row: &[f64; 2], place: usize| Some(row[place]).filter(|value| value.is_finite());
        let table = Table::of(&rows)
            .numbers(["a", "b"], 3, finite)
            .flag("is_whole", |row| row.iter().all(|value| value.is_finite()));
        let csv = table.made().to_csv().expect("columns");
        let expected =
            "a,b,is_whole\n1.5000000000000000e0,,0\n2.5000000000000000e0,3.5000000000000000e0,1\n";
        assert_eq!(csv, expected);
    }

    #[test]
    fn letters_of_the_theory_have_indices_and_powers() {
        for (words, html) in [
            ("xi_n < 0", "<i>ξ</i><sub>n</sub> &lt; 0"),
            (
                "h_x · (dP_smooth)^n",
                "<i>h</i><sub>x</sub> · (<i>dP</i><sub>smooth</sub>)<sup>n</sup>",
            ),
            ("y^2 <= 1e-5", "y<sup>2</sup> ≤ 1e-5"),
            ("mems_codim2, my_h_x, xi_1_left, a_", "mems_codim2, my_h_x, xi_1_left, a_"),
        ] {
            assert_eq!(typeset(words), html);
        }
    }

    #[test]
    fn a_number_has_no_more_digits_than_it_needs() {
        for (value, most, digits) in
            [(0.2, 12, 1), (0.0, 12, 1), (-2.25e-9, 12, 3), (1.0 / 3.0, 5, 5), (100.0, 12, 1)]
        {
            assert_eq!(digits_needed(value, most), digits, "{value}");
        }
    }

    #[test]
    fn a_heading_names_the_unit() {
        let column = Column::number("step").with_unit("ns");
        assert_eq!(column.heading(), "step [ns]");
        assert_eq!(Column::text("scene").heading(), "scene");
    }

    fn table() -> Table {
        let mut table = Table::new(vec![
            Column::text("orders <N, W>"),
            Column::number("step").with_unit("ns"),
            Column::number("error"),
        ]);
        let rows = [
            vec![Cell::text("5 | 6"), Cell::number(17.25, 3), Cell::number(-1.0 / 3.0e9, 3)],
            vec![Cell::text("a\n\"b\","), Cell::Integer(-2), Cell::Missing],
        ];
        for row in rows {
            table.push(row);
        }
        table
    }

    #[test]
    fn terminal_columns_line_up() {
        insta::assert_snapshot!(table().to_text());
    }

    #[test]
    fn markdown_escapes_what_would_end_a_cell() {
        insta::assert_snapshot!(table().to_markdown());
    }

    #[test]
    fn html_is_escaped_and_sets_powers_of_ten() {
        insta::assert_snapshot!(table().to_html());
    }

    #[test]
    fn csv_reads_back_exactly() {
        let text = table().to_csv().expect("three columns");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let rows: Vec<csv::StringRecord> =
            reader.records().map(|row| row.expect("a row")).collect();
        assert_eq!(rows[0][2].parse::<f64>(), Ok(-1.0 / 3.0e9));
        assert_eq!(&rows[1][0], "a\n\"b\",");
        assert_eq!(&rows[1][2], "");
    }

    #[test]
    fn things_are_counted_in_words() {
        assert_eq!(counted(1, "branch"), "1 branch");
        assert_eq!(counted(4, "branch"), "4 branches");
        assert_eq!(counted(0, "file"), "0 files");
    }

    #[test]
    fn numbers_for_people_keep_the_digits_asked_for() {
        assert_eq!(significant(0.1 + 0.2, 4), "0.3000");
        assert_eq!(significant(-1234.5678, 6), "-1234.57");
        assert_eq!(significant(9.9996e-5, 4), "0.0001000");
        assert_eq!(significant(1.25e-7, 3), "1.25e-7");
        assert_eq!(significant(999_999.9, 3), "1.00e6");
        assert_eq!(significant(123_456.0, 3), "123456");
        assert_eq!(significant(f64::NAN, 3), "nan");
    }

    #[test]
    fn exact_text_reads_back_as_the_same_double() {
        for value in [0.1, 1.0 / 3.0, -2.5e-308, f64::MAX, 5e-324, 0.0] {
            assert_eq!(exact(value).parse::<f64>(), Ok(value));
        }
    }
}
