//! Results of diagrams, charts and basins: documents, tables, figures, files; and the keys of
//! `basin`.

use std::io::Write;
use std::{mem, slice};

use serde::{Deserialize, Serialize};

use super::keys::{ActiveParameters, COORDINATES, KeyError, named_offsets, place_of};
#[cfg(feature = "cli")]
use super::options::{CELLS, METHODS, one_of, positions, ranges};
use super::positions::{Counting, Ends, Origin, Position};
use super::{Ended, Error, Extent, Map, Results};
use crate::analysis::Progress;
use crate::analysis::basin::{Basin, BasinClass, BasinRequest};
use crate::analysis::chart::{Chart, ChartCell};
use crate::analysis::diagram::{Diagram, DiagramPoint, Timing};
use crate::convergence::MeasuredWindow;
use crate::expansion::WindowEdge;
use crate::iteration::parallel;
use crate::model::Method;
use crate::report::{
    DocumentKind, Figure, Named, OutputFolder, ReportError, Rows, SectionDocument, basin_array,
    basin_figure, basin_rows, basin_text, basin_warnings, chart_array, chart_computed_words,
    chart_figure, chart_overlay_words, chart_rows, chart_timing_table, chart_warnings,
    diagram_array, diagram_figures, diagram_rows, diagram_timing_table, diagram_warnings,
    manifold_rows, pictures, write_json,
};

/// JSON document of a result computed with a map.
#[derive(Serialize)]
struct ByMap<'a, T> {
    document: DocumentKind,
    format: u32,
    #[serde(flatten)]
    content: &'a T,
    /// Measured window of the map.
    window: &'a MeasuredWindow,
    /// Share that truncation omits at the edge of the window, one per passage.
    window_edges: &'a [WindowEdge],
    /// Section of the map.
    section: SectionDocument,
}

impl<'a, T> ByMap<'a, T> {
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

/// A diagram, a chart or a basin: a result of which a command may compute several with one map.
pub trait Drawable: Serialize + Send + Sync + Sized {
    /// Kind of the document.
    const KIND: DocumentKind;
    /// File name of the document, without extension.
    const STEM: &'static str;
    /// Whether one result has a document of its own, and not a list; no document holds times then.
    const ALONE: bool;
    /// Measured times, by default none.
    type Times: Default;
    /// Content of the rows, by default none.
    type Bulk: Default;

    /// Exchanges the measured times.
    fn swap_times(&mut self, times: &mut Self::Times);

    /// Exchanges the content of the rows.
    fn swap_bulk(&mut self, bulk: &mut Self::Bulk);

    /// Text about all results.
    fn text(results: &[Self]) -> String;

    /// Table of all results.
    fn rows(results: &[Self]) -> Rows<'_>;

    /// Numbers as an NPY file.
    ///
    /// # Errors
    ///
    /// [`ReportError`] if they are too many.
    fn array(&self) -> Result<Vec<u8>, ReportError>;

    /// Further tables as CSV, by file name without extension.
    fn more_rows(&self) -> Vec<(&'static str, Rows<'_>)> {
        Vec::new()
    }

    /// Figures, by what their file names add to that of the result.
    fn figures(&self) -> Vec<(&'static str, Figure)>;

    /// Warnings about all results.
    fn warnings(results: &[Self]) -> Vec<String>;
}

/// Diagrams, charts or basins, and the map that they were computed with.
#[derive(Clone, Debug)]
pub struct Drawn<T> {
    map: Map,
    /// The results.
    pub results: Vec<T>,
}

impl Map {
    /// Diagrams of the scene, to be laid out.
    ///
    /// # Errors
    ///
    /// As [`diagrams`](Self::diagrams).
    pub fn drawn_diagrams(&self, progress: &dyn Progress) -> Result<Drawn<Diagram>, Error> {
        Ok(Drawn { map: self.clone(), results: self.diagrams(progress)? })
    }

    /// Charts of the scene, to be laid out.
    ///
    /// # Errors
    ///
    /// As [`charts`](Self::charts).
    pub fn drawn_charts(&self, progress: &dyn Progress) -> Result<Drawn<Chart>, Error> {
        Ok(Drawn { map: self.clone(), results: self.charts(progress)? })
    }

    /// Basins, to be laid out.
    ///
    /// # Errors
    ///
    /// As [`basins`](Self::basins).
    pub fn drawn_basins(
        &self,
        requests: &[BasinRequest],
        progress: &dyn Progress,
    ) -> Result<Drawn<Basin>, Error> {
        Ok(Drawn { map: self.clone(), results: self.basins(requests, progress)? })
    }
}

impl<T: Drawable> Drawn<T> {
    fn documents(&self) -> Vec<ByMap<'_, T>> {
        let documents = self.results.iter();
        documents.map(|result| ByMap::new(T::KIND, result, &self.map)).collect()
    }

    fn write_whole(&self, out: &mut dyn Write) -> Result<(), ReportError> {
        match &self.documents()[..] {
            [alone] if T::ALONE => write_json(out, alone),
            listed => write_json(out, &listed),
        }
    }

    /// Results and their file names, without extension.
    fn named(&self, name: &str) -> impl Iterator<Item = (&T, String)> {
        self.results.iter().zip(stems(name, self.results.len()))
    }

    fn write_data(&self, folder: &OutputFolder) -> Result<(), Error> {
        if T::ALONE {
            for (result, stem) in self.named(T::STEM) {
                let document = ByMap::new(T::KIND, result, &self.map);
                folder.write_streamed(&format!("{stem}.json"), |out| write_json(out, &document))?;
                let rows = T::rows(slice::from_ref(result));
                folder.write_streamed(&format!("{stem}.csv"), |out| rows.write_csv(out))?;
            }
        } else {
            let (document, table) = (format!("{}.json", T::STEM), format!("{}.csv", T::STEM));
            folder.write_streamed(&document, |out| self.write_whole(out))?;
            folder.write_streamed(&table, |out| T::rows(&self.results).write_csv(out))?;
        }
        for (result, stem) in self.named(T::STEM) {
            folder.write(&format!("{stem}.npy"), result.array()?)?;
        }
        for (number, result) in self.results.iter().enumerate() {
            for (name, rows) in result.more_rows() {
                let stem = stems(name, self.results.len()).nth(number).unwrap_or_default();
                folder.write_streamed(&format!("{stem}.csv"), |out| rows.write_csv(out))?;
            }
        }
        Ok(())
    }

    /// Runs `work` on the results without a part of each, which `swap` exchanges.
    fn without<P: Default, R>(
        &mut self,
        swap: fn(&mut T, &mut P),
        work: impl FnOnce(&mut Self) -> R,
    ) -> R {
        let mut parts: Vec<P> = self.results.iter().map(|_| P::default()).collect();
        self.results.iter_mut().zip(&mut parts).for_each(|(result, part)| swap(result, part));
        let done = work(self);
        self.results.iter_mut().zip(&mut parts).for_each(|(result, part)| swap(result, part));
        done
    }

    /// Runs `work` on the results without their measured times.
    fn timeless<R>(&mut self, work: impl FnOnce(&mut Self) -> R) -> R {
        self.without(T::swap_times, work)
    }
}

impl<T: Drawable> Results for Drawn<T> {
    fn text(&self) -> Result<String, Error> {
        Ok(T::text(&self.results))
    }

    fn write_document(&mut self, extent: Extent, out: &mut dyn Write) -> Result<(), ReportError> {
        match extent {
            Extent::Whole if !T::ALONE => self.write_whole(out),
            Extent::Whole | Extent::Timeless => self.timeless(|drawn| drawn.write_whole(out)),
            Extent::Head => {
                self.timeless(|drawn| drawn.without(T::swap_bulk, |drawn| drawn.write_whole(out)))
            }
        }
    }

    fn rows(&self) -> Rows<'_> {
        T::rows(&self.results)
    }

    fn figures(&self) -> Vec<(String, Figure)> {
        let figures = self.named(T::STEM).flat_map(|(result, stem)| {
            let named = move |(end, figure)| (format!("{stem}{end}"), figure);
            result.figures().into_iter().map(named)
        });
        figures.collect()
    }

    fn write_files(&mut self, folder: &OutputFolder) -> Result<Vec<String>, Error> {
        let figures = self.figures();
        let drawn = || {
            let named = figures.iter().map(|(stem, figure)| (&**stem, figure));
            let (files, remarks) = pictures(named, folder.pictures());
            folder.write_all(files).map(|()| remarks)
        };
        self.timeless(|results| {
            let (data, drawn) = parallel::join(|| results.write_data(folder), drawn);
            data?;
            Ok(drawn?)
        })
    }

    fn remarks(&self) -> Vec<String> {
        self.map.remarks().chain(T::warnings(&self.results)).collect()
    }

    fn ended(&self) -> Option<Ended> {
        None
    }
}

impl Drawable for Diagram {
    const KIND: DocumentKind = DocumentKind::Diagram;
    const STEM: &'static str = "diagram";
    const ALONE: bool = false;
    type Times = (Option<f64>, Vec<Timing>);
    type Bulk = Vec<Vec<DiagramPoint>>;

    fn swap_times(&mut self, (ratio, times): &mut Self::Times) {
        mem::swap(&mut self.speed_ratio, ratio);
        times.resize_with(self.sweeps.len(), Timing::default);
        let sweeps = self.sweeps.iter_mut().zip(times);
        sweeps.for_each(|(sweep, time)| mem::swap(&mut sweep.timing, time));
    }

    fn swap_bulk(&mut self, bulk: &mut Self::Bulk) {
        bulk.resize_with(self.sweeps.len(), Vec::new);
        let sweeps = self.sweeps.iter_mut().zip(bulk);
        sweeps.for_each(|(sweep, points)| mem::swap(&mut sweep.points, points));
    }

    fn text(diagrams: &[Self]) -> String {
        diagram_timing_table(diagrams).to_text()
    }

    fn rows(diagrams: &[Self]) -> Rows<'_> {
        diagram_rows(diagrams)
    }

    fn array(&self) -> Result<Vec<u8>, ReportError> {
        diagram_array(self)
    }

    fn figures(&self) -> Vec<(&'static str, Figure)> {
        diagram_figures(self)
    }

    fn warnings(diagrams: &[Self]) -> Vec<String> {
        diagram_warnings(diagrams)
    }
}

impl Drawable for Chart {
    const KIND: DocumentKind = DocumentKind::Chart;
    const STEM: &'static str = "chart";
    const ALONE: bool = false;
    type Times = Timing;
    type Bulk = Vec<ChartCell>;

    fn swap_times(&mut self, times: &mut Timing) {
        mem::swap(&mut self.timing, times);
    }

    fn swap_bulk(&mut self, bulk: &mut Self::Bulk) {
        mem::swap(&mut self.cells, bulk);
    }

    fn text(charts: &[Self]) -> String {
        let computed = charts.iter().filter_map(chart_computed_words);
        let words = computed.chain(charts.iter().filter_map(chart_overlay_words));
        let lines: String = words.map(|words| format!("{words}\n")).collect();
        chart_timing_table(charts).to_text() + &lines
    }

    fn rows(charts: &[Self]) -> Rows<'_> {
        chart_rows(charts)
    }

    fn array(&self) -> Result<Vec<u8>, ReportError> {
        chart_array(self)
    }

    fn figures(&self) -> Vec<(&'static str, Figure)> {
        vec![("", chart_figure(self))]
    }

    fn warnings(charts: &[Self]) -> Vec<String> {
        chart_warnings(charts)
    }
}

impl Drawable for Basin {
    const KIND: DocumentKind = DocumentKind::Basin;
    const STEM: &'static str = "basin";
    const ALONE: bool = true;
    type Times = Timing;
    type Bulk = Vec<BasinClass>;

    fn swap_times(&mut self, times: &mut Timing) {
        mem::swap(&mut self.timing, times);
    }

    fn swap_bulk(&mut self, bulk: &mut Self::Bulk) {
        mem::swap(&mut self.cells, bulk);
    }

    fn text(basins: &[Self]) -> String {
        basins.iter().map(basin_text).collect::<Vec<_>>().join("\n")
    }

    fn rows(basins: &[Self]) -> Rows<'_> {
        let none = || Rows::new(Vec::new(), std::iter::empty());
        basins.first().map_or_else(none, basin_rows)
    }

    fn array(&self) -> Result<Vec<u8>, ReportError> {
        basin_array(self)
    }

    fn more_rows(&self) -> Vec<(&'static str, Rows<'_>)> {
        let manifolds = self.manifolds.iter();
        manifolds.map(|manifolds| ("manifolds", manifold_rows(self, manifolds))).collect()
    }

    fn figures(&self) -> Vec<(&'static str, Figure)> {
        vec![("", basin_figure(self))]
    }

    fn warnings(basins: &[Self]) -> Vec<String> {
        basin_warnings(basins)
    }
}

/// File names of `count` results, without extension.
fn stems(name: &str, count: usize) -> impl Iterator<Item = String> {
    (1..=count).map(move |number| match count {
        1 => name.to_owned(),
        _ => format!("{name}-{number}"),
    })
}

/// Keys of `basin`, instead of a table of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct BasinKeys {
    /// Offsets of active parameters from the graze (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=OFFSET,...",
            value_parser = positions,
        )
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Section coordinates that span the plane, the horizontal one first. Default: the first two.
    #[cfg_attr(
        feature = "cli",
        arg(long = "plane", alias = "axes", value_name = "A,B", value_delimiter = ',')
    )]
    pub axes: Vec<String>,
    /// First and last offset along an axis. Default: the window of the map.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=FROM:TO,...",
            value_parser = ranges,
        )
    )]
    pub range: Option<Named<Ends>>,
    /// Number of cells along both axes, or along each. Default: 400.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N[,M]",
            value_delimiter = ',',
            value_parser = clap::value_parser!(u32).range(1..=10_000)
        )
    )]
    pub points: Vec<u32>,
    /// Cells that are computed: `all`, or `borders` (those along borders and probes of the blocks
    /// between; the others are filled). Default: borders.
    #[cfg_attr(
        feature = "cli",
        arg(long = "cells", value_name = "CELLS", value_parser = one_of(CELLS))
    )]
    pub every_cell: Option<bool>,
    /// Offsets of the other section coordinates (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME=OFFSET,...",
            value_parser = positions,
        )
    )]
    pub start: Option<Named<Position>>,
    /// Method that iterates the states. Default: guarded.
    #[cfg_attr(
        feature = "cli",
        arg(
            long = "method",
            value_name = "METHOD",
            alias = "with",
            value_parser = one_of(METHODS)
        )
    )]
    pub with: Option<Method>,
    /// Also compute stable and unstable manifolds of saddles of up to N returns, as curves; needs a
    /// section of two coordinates.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            num_args = 0..=1,
            default_missing_value = "2",
            value_parser = clap::value_parser!(u8).range(1..=12)
        )
    )]
    pub manifolds: Option<u8>,
}

impl BasinKeys {
    /// Remarks on offsets that look like parameter values.
    pub fn offset_remarks(&self, map: &Map) -> Vec<String> {
        Origin::new(map.settled().graze(), self.values).remarks("at", self.at.as_ref())
    }

    /// Whether the keys ask for a basin of their own, in the place of the scene's.
    pub fn name_any(&self) -> bool {
        let values = self.values;
        *self != Self { values, ..Self::default() }
    }

    /// Request with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names and numbers that the map does not have.
    pub fn request(&self, map: &Map) -> Result<BasinRequest, KeyError> {
        let mut request = BasinRequest::over_the_window(map.local());
        let coordinates = &map.local().section.coordinates;
        let origin = Origin::new(map.settled().graze(), self.values);
        let at = origin.offsets(self.at.as_ref());
        if !at.is_empty() {
            request.parameters = ActiveParameters::of(map.scene(), map.local()).at(&at)?;
        }
        let start = origin.offsets(self.start.as_ref());
        if !start.is_empty() {
            request.origin = named_offsets("start", COORDINATES, &start, coordinates)?;
        }
        if let [first, second] = &self.axes[..] {
            let place = |name: &str| place_of("axes", COORDINATES, name, coordinates);
            request = request.over([place(first)?, place(second)?], map.local());
        } else if !self.axes.is_empty() {
            return Err(KeyError::NotTwoAxes { found: self.axes.len() });
        }
        let named =
            |place: usize| start.0.iter().any(|(name, _)| name.trim() == coordinates[place]);
        if let Some(place) = request.axes.into_iter().find(|&place| named(place)) {
            return Err(KeyError::Varies { key: "start", name: coordinates[place].clone() });
        }
        for (name, range) in &origin.ranges(self.range.as_ref()).0 {
            let place = place_of("range", COORDINATES, name, coordinates)?;
            let axis = request.axes.iter().position(|&axis| axis == place);
            let axis = axis.ok_or_else(|| KeyError::NoAxis { name: name.clone() })?;
            let [from, to] = *range;
            if from >= to {
                return Err(KeyError::Decreasing { name: name.clone(), from, to });
            }
            request.ranges[axis] = *range;
        }
        match self.points[..] {
            [] => {}
            [both] => request.points = [both as usize; 2],
            [first, second] => request.points = [first as usize, second as usize],
            _ => return Err(KeyError::NotTwoAxes { found: self.points.len() }),
        }
        request.every_cell = self.every_cell.unwrap_or_default();
        request.method = self.with.unwrap_or(request.method);
        request.manifolds = self.manifolds.map(usize::from);
        Ok(request)
    }
}
