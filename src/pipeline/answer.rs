//! Results of a command: text for people, document, tables, figures and warnings. Also the warnings
//! about the windows of maps and about the device that iterates.

use std::io::Write;
use std::iter;

use super::{Ended, Error, Map};
use crate::convergence::MeasuredWindow;
use crate::expansion::WindowEdge;
use crate::iteration::DeviceReport;
use crate::report::{
    Figure, OutputFolder, Page, PictureForm, ReportError, Rows, Table, edge_words, pictures,
    window_remark,
};

/// Part of a document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All of it.
    Whole,
    /// All but measured times: equal for equal requests on every machine.
    Timeless,
    /// As [`Timeless`](Self::Timeless), without what stands in the rows, where that is long.
    Head,
}

/// Results of a command, each of which is laid out when it is asked for.
pub trait Results: Send {
    /// Text for people.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if it cannot be laid out.
    fn text(&self) -> Result<String, Error>;

    /// Writes the JSON document.
    ///
    /// # Errors
    ///
    /// [`ReportError`] if it cannot be serialised or written.
    fn write_document(&mut self, extent: Extent, out: &mut dyn Write) -> Result<(), ReportError>;

    /// Table of the command; without columns for a command without one.
    fn rows(&self) -> Rows<'_>;

    /// Figures by file name, without extension.
    fn figures(&self) -> Vec<(String, Figure)>;

    /// Writes all files into a folder, without measured times. Returns remarks on the figures.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    fn write_files(&mut self, folder: &OutputFolder) -> Result<Vec<String>, Error>;

    /// Warnings about accuracy or completeness.
    fn remarks(&self) -> Vec<String>;

    /// Reason why the computation ended without the result that was asked for.
    fn ended(&self) -> Option<Ended>;

    /// JSON document as text.
    ///
    /// # Errors
    ///
    /// As [`write_document`](Self::write_document).
    fn document(&mut self, extent: Extent) -> Result<String, ReportError> {
        let mut bytes = Vec::new();
        self.write_document(extent, &mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

/// Results of a command that are small, and laid out at once.
#[derive(Clone, Debug)]
pub struct Answer {
    /// File name of the document, without extension.
    pub stem: &'static str,
    /// Text for people.
    pub text: String,
    /// JSON document for programs.
    pub document: String,
    /// Document without measured times, if it has any: the one that is written into a folder.
    pub timeless: Option<String>,
    /// Tables by file name, without extension; the last is the command's own.
    pub tables: Vec<(&'static str, Table)>,
    /// Figures by file name, without extension.
    pub figures: Vec<(String, Figure)>,
    /// Page with all of it, if the command has one.
    pub page: Option<Page>,
    /// Warnings about accuracy or completeness.
    pub remarks: Vec<String>,
    /// Reason why the computation ended without the result that was asked for.
    pub ended: Option<Ended>,
}

impl Answer {
    /// Answer with one table, which has the name of the document.
    pub fn new(stem: &'static str, text: String, document: String, table: Table) -> Self {
        Self { tables: vec![(stem, table)], ..Self::without_table(stem, text, document) }
    }

    /// Answer of a command without a table.
    pub fn without_table(stem: &'static str, text: String, document: String) -> Self {
        Self {
            stem,
            text,
            document,
            timeless: None,
            tables: Vec::new(),
            figures: Vec::new(),
            page: None,
            remarks: Vec::new(),
            ended: None,
        }
    }

    /// Adds figures, named by the suffix that their file names add to the document's.
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

    /// Table of the command.
    pub fn table(&self) -> Option<&Table> {
        self.tables.last().map(|(_, table)| table)
    }

    /// Document, tables, figures in a form and page as files by name. A figure that cannot be drawn
    /// becomes a remark.
    ///
    /// # Errors
    ///
    /// [`ReportError::Csv`] for a table without columns; errors of [`Page::to_html`].
    pub fn files(&mut self, form: &PictureForm) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
        let document = self.timeless.as_ref().unwrap_or(&self.document);
        let mut files = vec![(format!("{}.json", self.stem), document.clone().into_bytes())];
        for (name, table) in &self.tables {
            files.push((format!("{name}.csv"), table.to_csv()?.into_bytes()));
        }
        let figures = self.figures.iter().map(|(name, figure)| (&**name, figure));
        let (drawn, remarks) = pictures(figures, form);
        files.extend(drawn);
        if let Some(page) = &self.page {
            files.push((format!("{}.html", self.stem), page.to_html()?.into_bytes()));
        }
        self.remarks.extend(remarks);
        Ok(files)
    }
}

impl Results for Answer {
    fn text(&self) -> Result<String, Error> {
        Ok(self.text.clone())
    }

    fn write_document(&mut self, extent: Extent, out: &mut dyn Write) -> Result<(), ReportError> {
        let document = match (&self.timeless, extent) {
            (Some(timeless), Extent::Timeless | Extent::Head) => timeless,
            _ => &self.document,
        };
        Ok(out.write_all(document.as_bytes())?)
    }

    fn rows(&self) -> Rows<'_> {
        let none = || Rows::new(Vec::new(), iter::empty());
        self.table().map_or_else(none, Table::as_rows)
    }

    fn figures(&self) -> Vec<(String, Figure)> {
        self.figures.clone()
    }

    fn write_files(&mut self, folder: &OutputFolder) -> Result<Vec<String>, Error> {
        let remarks = std::mem::take(&mut self.remarks);
        folder.write_all(self.files(folder.pictures())?)?;
        Ok(std::mem::replace(&mut self.remarks, remarks))
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    fn ended(&self) -> Option<Ended> {
        self.ended.clone()
    }
}

impl Map {
    /// Warnings of the map: its error on the window is too large, the window exceeds a depth series
    /// (of the passage with the largest omitted share), contacts are missing; and a report of the
    /// device if that is not the CPU.
    pub fn remarks(&self) -> impl Iterator<Item = String> + use<> {
        let missing = self.0.missing.as_ref().map(|reason| {
            let scene = &self.scene().identifier;
            format!("note: `{scene}`: direct simulation goes without a map: {reason}")
        });
        let device = self.device().map(|device| device_words(&device.report()));
        let remark = self.remark_on(self.window());
        remark.into_iter().chain(missing).chain(device.into_iter().flatten())
    }

    /// Warning about the errors measured on a window, those of the map or of an [emitted
    /// form](Self::emitted), and about the edge of the window.
    pub fn remark_on(&self, window: &MeasuredWindow) -> Option<String> {
        let edge = worst_edge(self.window_edges());
        let remark = window_remark(window, self.orders(), edge.as_ref());
        remark.map(|remark| remark.of(&self.scene().identifier))
    }

    /// Edge of the passage with the largest omitted share, if that share is too large.
    pub fn worst_edge(&self) -> Option<WindowEdge> {
        worst_edge(self.window_edges())
    }
}

/// Warning about the truncation at the edge of a window, for the passage with the largest omitted
/// share; `None` if no share is too large.
pub(super) fn edge_remark(edges: &[WindowEdge]) -> Option<String> {
    let words = |edge| format!("at the edge of the window {}", edge_words(&edge));
    worst_edge(edges).map(words)
}

/// Report of a device: orbits computed, orbits handed back to the CPU, and failure.
fn device_words(report: &DeviceReport) -> Vec<String> {
    let DeviceReport { name, made, handed_back, .. } = report;
    let did = format!(
        "{name}: {made} orbits, and {handed_back} handed back to this processor, which left the \
         window of the map"
    );
    let direct = report
        .left_direct
        .then(|| format!("{name}: direct simulation is not there; this processor made its charts"));
    let failed = report.failure.as_ref().map(|failure| {
        format!("warning: {name} failed, and this processor made the other orbits: {failure}")
    });
    [(made + handed_back > 0).then_some(did), direct, failed].into_iter().flatten().collect()
}

fn worst_edge(edges: &[WindowEdge]) -> Option<WindowEdge> {
    let share = |edge: &WindowEdge| edge.omitted_share;
    let beyond = edges.iter().filter(|edge| !edge.is_within()).copied();
    beyond.max_by(|a, b| share(a).total_cmp(&share(b)))
}
