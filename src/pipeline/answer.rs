//! What a command computed: words for people, a document, tables and figures.

use rayon::prelude::*;

use super::Ended;
use crate::report::{Figure, ReportError, Table, pictures};

/// What a command computed, laid out.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Name of its document's file, without its ending.
    pub stem: &'static str,
    /// For people.
    pub text: String,
    /// For programs: JSON.
    pub document: String,
    /// The same without times, where it has some: what is kept in a folder.
    pub timeless: Option<String>,
    /// Tables by the names of their files, without their endings; the last is the command's.
    pub tables: Vec<(&'static str, Table)>,
    /// Figures by the names of their files, without their endings.
    pub figures: Vec<(String, Figure)>,
    /// What may not be trusted, or not be all.
    pub remarks: Vec<String>,
    /// Why it is not what was asked for, where it is not.
    pub ended: Option<Ended>,
}

impl Answer {
    /// An answer with one table of the document's name.
    pub(super) fn new(stem: &'static str, text: String, document: String, table: Table) -> Self {
        Self {
            stem,
            text,
            document,
            timeless: None,
            tables: vec![(stem, table)],
            figures: Vec::new(),
            remarks: Vec::new(),
            ended: None,
        }
    }

    /// With figures by what follows the document's name in theirs.
    pub(super) fn with_figures(
        mut self,
        figures: impl IntoIterator<Item = (impl AsRef<str>, Figure)>,
    ) -> Self {
        let figures = figures.into_iter();
        let stem = self.stem;
        let named = figures.map(|(end, figure)| (format!("{stem}{}", end.as_ref()), figure));
        self.figures.extend(named);
        self
    }

    /// The command's table.
    pub fn table(&self) -> Option<&Table> {
        self.tables.last().map(|(_, table)| table)
    }

    /// Document, tables and pictures as files by name; a picture that cannot be drawn is a remark.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] for a table without columns.
    pub fn files(&mut self) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
        let document = self.timeless.as_ref().unwrap_or(&self.document);
        let mut files = vec![(format!("{}.json", self.stem), document.clone().into_bytes())];
        for (name, table) in &self.tables {
            files.push((format!("{name}.csv"), table.to_csv()?.into_bytes()));
        }
        let figures = self.figures.par_iter().map(|(name, figure)| (&**name, figure));
        let (drawn, remarks) = pictures(figures);
        files.extend(drawn);
        self.remarks.extend(remarks);
        Ok(files)
    }
}
