//! What a command computed: words for people, a document, tables and figures; and what is to be
//! said beside it, of the windows of maps and of the device that made orbits.

use super::{Ended, Map};
use crate::convergence::MeasuredWindow;
use crate::expansion::WindowEdge;
use crate::iteration::DeviceReport;
use crate::report::{Figure, ReportError, Table, edge_words, pictures, window_remark};

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
        let figures = self.figures.iter().map(|(name, figure)| (&**name, figure));
        let (drawn, remarks) = pictures(figures);
        files.extend(drawn);
        self.remarks.extend(remarks);
        Ok(files)
    }
}

impl Map {
    /// What is to be said of the map: where it errs on its window more than it should, and where
    /// the window is deeper than the series of the passage whose contact loses most; why there are
    /// no contacts; and what another device than this processor did so far.
    pub fn remarks(&self) -> impl Iterator<Item = String> + use<> {
        let missing = self.0.missing.as_ref().map(|reason| {
            let scene = &self.scene().identifier;
            format!("note: `{scene}`: direct simulation goes without a map: {reason}")
        });
        let device = self.device().map(|device| device_words(&device.report()));
        let remark = self.remark_on(self.window());
        remark.into_iter().chain(missing).chain(device.into_iter().flatten())
    }

    /// What is to be said of the map on its window, with the errors that were measured of it or of
    /// an [emitted form](Self::emitted).
    pub fn remark_on(&self, window: &MeasuredWindow) -> Option<String> {
        let edge = worst_edge(self.window_edges());
        let remark = window_remark(window, self.orders(), edge.as_ref());
        remark.map(|remark| remark.of(&self.scene().identifier))
    }

    /// The edge of the passage whose contact loses most, where that is too much.
    pub fn worst_edge(&self) -> Option<WindowEdge> {
        worst_edge(self.window_edges())
    }
}

/// What a truncation leaves out at the edge of a window, of the passage whose contact loses most,
/// where that is too much.
pub(super) fn edge_remark(edges: &[WindowEdge]) -> Option<String> {
    let words = |edge| format!("at the edge of the window {}", edge_words(&edge));
    worst_edge(edges).map(words)
}

/// What a device did, what is left to this processor, and how it failed.
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
