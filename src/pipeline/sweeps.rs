//! Diagrams, charts and basins as documents and as files.

use serde::Serialize;

use super::{Error, Map};
use crate::analysis::basin::Basin;
use crate::analysis::chart::Chart;
use crate::analysis::diagram::Diagram;
use crate::convergence::MeasuredWindow;
use crate::expansion::WindowEdge;
use crate::report::{
    DocumentKind, OutputFolder, SectionDocument, basin_array, basin_figure, basin_rows,
    chart_array, chart_figure, chart_rows, diagram_array, diagram_figures, diagram_rows,
    manifold_rows, pictures, write_json,
};

/// What a map was used for, as it is written to JSON.
#[derive(Serialize)]
pub struct ByMap<'a, T> {
    document: DocumentKind,
    format: u32,
    #[serde(flatten)]
    content: &'a T,
    /// The window of the map, measured.
    window: &'a MeasuredWindow,
    /// What the contacts of the map leave out at the edge of the window, by passage.
    window_edges: &'a [WindowEdge],
    /// The section that it is on.
    section: SectionDocument,
}

impl<'a, T> ByMap<'a, T> {
    /// All that one map was used for.
    fn each(document: DocumentKind, contents: &'a [T], map: &'a Map) -> Vec<Self> {
        contents.iter().map(|content| Self::new(document, content, map)).collect()
    }

    fn new(document: DocumentKind, content: &'a T, map: &'a Map) -> Self {
        Self {
            document,
            format: DocumentKind::FORMAT,
            content,
            window: map.window(),
            window_edges: map.window_edges(),
            section: map.section(),
        }
    }
}

impl Map {
    /// The documents of diagrams made with the map.
    pub fn diagram_documents<'a>(&'a self, diagrams: &'a [Diagram]) -> Vec<ByMap<'a, Diagram>> {
        ByMap::each(DocumentKind::Diagram, diagrams, self)
    }

    /// The documents of charts made with the map.
    pub fn chart_documents<'a>(&'a self, charts: &'a [Chart]) -> Vec<ByMap<'a, Chart>> {
        ByMap::each(DocumentKind::Chart, charts, self)
    }

    /// The document of a basin made with the map.
    pub fn basin_document<'a>(&'a self, basin: &'a Basin) -> ByMap<'a, Basin> {
        ByMap::new(DocumentKind::Basin, basin, self)
    }

    /// Writes data and pictures of diagrams, which hold no times; what is to be said of them.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    pub fn write_diagrams(
        &self,
        folder: &OutputFolder,
        diagrams: &[Diagram],
    ) -> Result<Vec<String>, Error> {
        let documents = self.diagram_documents(diagrams);
        folder.write_streamed("diagram.json", |out| write_json(out, &documents))?;
        folder.write_streamed("diagram.csv", |out| diagram_rows(diagrams).write_csv(out))?;
        let mut remarks = Vec::new();
        for (number, diagram) in diagrams.iter().enumerate() {
            let stem = stem("diagram", number, diagrams.len());
            folder.write(&format!("{stem}.npy"), diagram_array(diagram)?)?;
            for (suffix, figure) in diagram_figures(diagram) {
                folder.write_all(pictures(&format!("{stem}{suffix}"), &figure, &mut remarks))?;
            }
        }
        Ok(remarks)
    }

    /// Writes data and pictures of charts, which hold no times; what is to be said of them.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    pub fn write_charts(
        &self,
        folder: &OutputFolder,
        charts: &[Chart],
    ) -> Result<Vec<String>, Error> {
        let documents = self.chart_documents(charts);
        folder.write_streamed("chart.json", |out| write_json(out, &documents))?;
        folder.write_streamed("chart.csv", |out| chart_rows(charts).write_csv(out))?;
        let mut remarks = Vec::new();
        for (number, chart) in charts.iter().enumerate() {
            let stem = stem("chart", number, charts.len());
            folder.write(&format!("{stem}.npy"), chart_array(chart)?)?;
            folder.write_all(pictures(&stem, &chart_figure(chart), &mut remarks))?;
        }
        Ok(remarks)
    }

    /// Writes data and pictures of basins, which hold no times; what is to be said of them.
    ///
    /// # Errors
    ///
    /// [`Error::Report`] if a file cannot be written.
    pub fn write_basins(
        &self,
        folder: &OutputFolder,
        basins: &[Basin],
    ) -> Result<Vec<String>, Error> {
        let mut remarks = Vec::new();
        for (number, basin) in basins.iter().enumerate() {
            let named = |name: &str| stem(name, number, basins.len());
            let (stem, document) = (named("basin"), self.basin_document(basin));
            folder.write_streamed(&format!("{stem}.json"), |out| write_json(out, &document))?;
            folder
                .write_streamed(&format!("{stem}.csv"), |out| basin_rows(basin).write_csv(out))?;
            if let Some(manifolds) = &basin.manifolds {
                let rows = || manifold_rows(basin, manifolds);
                let name = format!("{}.csv", named("manifolds"));
                folder.write_streamed(&name, |out| rows().write_csv(out))?;
            }
            folder.write(&format!("{stem}.npy"), basin_array(basin)?)?;
            folder.write_all(pictures(&stem, &basin_figure(basin), &mut remarks))?;
        }
        Ok(remarks)
    }
}

/// The file name, without its ending, of one of several results, counted from 0.
fn stem(name: &str, number: usize, count: usize) -> String {
    match count {
        1 => name.to_owned(),
        _ => format!("{name}-{}", number + 1),
    }
}
