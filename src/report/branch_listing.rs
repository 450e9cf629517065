//! Branches of periodic orbits: the fields of `branch --json`, the table of all points, the special
//! points in words, and the picture.

use serde::Serialize;

use super::figure::{Annotation, Axis, Figure, Marker, Series, Stroke, symbol};
use super::orbits_listing::{OrbitRecord, OrbitsListing, multipliers};
use super::{Cell, Column, Named, ReportError, SectionDocument, Table};
use crate::analysis::branches::{BranchEnd, BranchLabel, BranchPoint, Branches, Special};
use crate::analysis::orbits::{FoundOrbit, Orbits};
use crate::expansion::{LocalMap, WindowEdge};
use crate::iteration::Itinerary;

/// Branches, ready to be written as JSON; everything in offsets.
#[derive(Clone, Debug, Serialize)]
pub struct BranchListing {
    /// `map` or `direct`.
    pub using: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// The parameter that varies.
    pub along: String,
    /// Grazing values of the active parameters.
    pub grazing_parameters: Named<f64>,
    /// Surface of each passage of a return: what the digits of an itinerary stand for.
    pub passages: Vec<String>,
    /// What the contacts of the map leave out at the edge of the window, by passage.
    pub window_edges: Vec<WindowEdge>,
    /// The branches, shorter periods first.
    pub branches: Vec<BranchRecord>,
}

/// A branch.
#[derive(Clone, Debug, Serialize)]
pub struct BranchRecord {
    /// Its number, from 1.
    pub branch: usize,
    /// The itinerary, in digits.
    pub itinerary: String,
    /// Why it goes no further, at its first and last point.
    pub ends: [BranchEnd; 2],
    /// Stretches of the parameter in which more special points may lie than were found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unresolved: Vec<[f64; 2]>,
    /// Its orbits, in order along it.
    pub points: Vec<PointRecord>,
}

/// An orbit of a branch.
#[derive(Clone, Debug, Serialize)]
pub struct PointRecord {
    /// The orbit.
    #[serde(flatten)]
    pub orbit: OrbitRecord,
    /// What is special about it.
    #[serde(flatten)]
    pub special: Option<Special>,
}

impl BranchListing {
    /// The branches of a map, or of direct simulation, in the parameter `along`.
    pub fn new(
        section: SectionDocument,
        (map, edges): (&LocalMap, &[WindowEdge]),
        itinerary: &Itinerary,
        found: &Branches,
        (along, direct): (usize, bool),
    ) -> Self {
        let orbits: Vec<FoundOrbit> = found
            .branches
            .iter()
            .flat_map(|branch| branch.points.iter().map(|point| point.orbit.clone()))
            .collect();
        let all = Orbits { orbits, ..Orbits::default() };
        let listed = OrbitsListing::new(section, (map, edges), itinerary, &all, direct);
        let mut orbits = listed.orbits.into_iter();
        let branches = found.branches.iter().enumerate().map(|(number, branch)| BranchRecord {
            branch: number + 1,
            itinerary: branch.itinerary.to_string(),
            ends: branch.ends,
            unresolved: branch.unresolved.clone(),
            points: branch
                .points
                .iter()
                .zip(orbits.by_ref())
                .map(|(BranchPoint { special, .. }, orbit)| PointRecord {
                    orbit,
                    special: special.clone(),
                })
                .collect(),
        });
        Self {
            using: listed.using,
            along: map.parameters[along].name.clone(),
            branches: branches.collect(),
            section: listed.section,
            grazing_parameters: listed.grazing_parameters,
            passages: listed.passages,
            window_edges: listed.window_edges,
        }
    }

    /// The special points as a person reads them, one row each.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn special_table(&self) -> Result<Table, ReportError> {
        let mut columns = vec![Column::number("branch"), Column::text("itinerary")];
        columns.extend([Column::text("label"), Column::number(self.along.as_str())]);
        columns.push(Column::number(format!("{}_value", self.along)));
        columns.extend(self.section.coordinates.iter().map(Column::number));
        columns.extend(["multipliers", "impact speeds"].map(Column::text));
        columns.push(Column::number("coefficient"));
        columns.push(Column::text("window"));
        let mut table = Table::new(columns);
        for (branch, point) in self.points() {
            let Some(special) = &point.special else { continue };
            let (offset, value) = self.along(&point.orbit);
            let mut row = vec![
                Cell::Integer(branch.branch as i64),
                Cell::text(&branch.itinerary),
                Cell::text(special.label.letters()),
                Cell::number(offset, 10),
                Cell::number(value, 10),
            ];
            row.extend(point.orbit.state.0.iter().map(|(_, value)| Cell::number(*value, 5)));
            let speeds = point.orbit.contacts.iter();
            let speeds: Vec<String> =
                speeds.map(|contact| format!("{:.4e}", contact.speed)).collect();
            row.push(Cell::text(multipliers(&point.orbit.multipliers)));
            row.push(Cell::text(speeds.join(", ")));
            row.push(special.coefficient.map_or(Cell::Missing, |value| Cell::number(value, 5)));
            row.push(Cell::text(if point.orbit.inside { "inside" } else { "outside" }));
            table.push(row)?;
        }
        Ok(table)
    }

    /// All points with all digits, a column for each number.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn data_table(&self) -> Result<Table, ReportError> {
        let mut columns = vec![Column::number("branch"), Column::text("itinerary")];
        columns.push(Column::number("period"));
        columns.extend([self.along.clone(), format!("{}_value", self.along)].map(Column::number));
        columns.extend(self.section.coordinates.iter().map(Column::number));
        let count = self.section.coordinates.len();
        let parts = (1..=count).flat_map(|n| [format!("re{n}"), format!("im{n}")]);
        columns.extend(parts.map(Column::number));
        columns.extend(["stable", "physical", "inside"].map(Column::number));
        columns.extend(["speeds", "label"].map(Column::text));
        let mut table = Table::new(columns);
        for (branch, point) in self.points() {
            let orbit = &point.orbit;
            let (offset, value) = self.along(orbit);
            let mut row = vec![
                Cell::Integer(branch.branch as i64),
                Cell::text(&branch.itinerary),
                Cell::Integer(orbit.states.len() as i64),
                Cell::number(offset, 12),
                Cell::number(value, 12),
            ];
            row.extend(orbit.state.0.iter().map(|(_, value)| Cell::number(*value, 12)));
            let numbers = orbit.multipliers.iter().flatten();
            let numbers = numbers.map(|value| Cell::number(*value, 12));
            row.extend(numbers.chain(std::iter::repeat(Cell::Missing)).take(2 * count));
            // An orbit whose multipliers are not numbers is neither stable nor unstable.
            let known = !orbit.multipliers.is_empty();
            row.push(if known { Cell::Integer(orbit.stable.into()) } else { Cell::Missing });
            row.extend([orbit.physical, orbit.inside].map(|flag| Cell::Integer(flag.into())));
            let speeds = orbit.contacts.iter();
            let speeds: Vec<String> =
                speeds.map(|contact| format!("{:.16e}", contact.speed)).collect();
            row.push(Cell::text(speeds.join(" ")));
            let label = point.special.as_ref().map(|special| special.label.letters());
            row.push(label.map_or(Cell::Missing, Cell::text));
            table.push(row)?;
        }
        Ok(table)
    }

    fn points(&self) -> impl Iterator<Item = (&BranchRecord, &PointRecord)> {
        let branches = self.branches.iter();
        branches.flat_map(|branch| branch.points.iter().map(move |point| (branch, point)))
    }

    /// The offset of the parameter that varies, and its value.
    fn along(&self, orbit: &OrbitRecord) -> (f64, f64) {
        let named = |values: &Named<f64>| {
            let value = values.0.iter().find(|(name, _)| *name == self.along);
            value.map_or(f64::NAN, |(_, value)| *value)
        };
        let offset = named(&orbit.parameters);
        (offset, named(&self.grazing_parameters) + offset)
    }

    /// The branches over the parameter, by a coordinate of the section: stable ones solid, unstable
    /// ones dashed, physical ones alone; `under` are the iterates of a diagram, where there is one.
    pub fn figure(&self, coordinate: usize, under: Vec<[f64; 2]>) -> Figure {
        let letter = symbol(&self.along);
        let horizontal = Axis::linear(format!("{letter} − {letter}*"));
        let mut figure =
            Figure::new(horizontal, Axis::linear(&self.section.coordinates[coordinate]));
        if !under.is_empty() {
            figure.series.push(Series::dots("iterates", under).in_grey());
        }
        let mut named: Vec<(String, usize)> = Vec::new();
        for branch in &self.branches {
            let color = match named.iter().find(|(name, _)| *name == branch.itinerary) {
                Some((_, color)) => *color,
                None => {
                    named.push((branch.itinerary.clone(), named.len()));
                    named.len() - 1
                }
            };
            let fresh = figure.series.iter().all(|series| series.name != branch.itinerary);
            let name = if fresh { branch.itinerary.as_str() } else { "" };
            self.draw(&mut figure, branch, coordinate, (name, color));
        }
        figure
    }

    fn draw(
        &self,
        figure: &mut Figure,
        branch: &BranchRecord,
        coordinate: usize,
        (name, color): (&str, usize),
    ) {
        let returns = branch.points.first().map_or(0, |point| point.orbit.states.len());
        let mut name = name;
        for number in 0..returns {
            for (stroke, stable) in [(Stroke::Solid, true), (Stroke::Dashed, false)] {
                let line = self.line(branch, (number, coordinate), stable);
                if line.iter().any(|[x, y]| x.is_finite() && y.is_finite()) {
                    figure.series.push(Series::line(name, stroke, line).with_color(color));
                    name = "";
                }
            }
        }
        for point in &branch.points {
            let Some(special) = &point.special else { continue };
            let marker = match special.label {
                BranchLabel::Graze => Marker::Ring,
                BranchLabel::SaddleNode => Marker::Circle,
                BranchLabel::PeriodDoubling => Marker::Square,
                BranchLabel::NeimarkSacker => Marker::Diamond,
                BranchLabel::BranchPoint => Marker::Triangle,
            };
            let at = [self.along(&point.orbit).0, point.orbit.states[0][coordinate]];
            let text = special.label.letters().to_owned();
            figure.annotations.push(Annotation { at, text, marker: Some(marker) });
        }
    }

    /// The line of a branch where it is physical and of a stability; points that end such a stretch
    /// belong to both sides.
    fn line(
        &self,
        branch: &BranchRecord,
        (number, coordinate): (usize, usize),
        stable: bool,
    ) -> Vec<[f64; 2]> {
        let mut line: Vec<[f64; 2]> = Vec::new();
        let gap = [f64::NAN; 2];
        for pair in branch.points.windows(2) {
            let of_kind = |point: &PointRecord| {
                let known = !point.orbit.multipliers.is_empty() && point.special.is_none();
                (!known || point.orbit.stable == stable) && point.orbit.physical
            };
            let plain = pair.iter().any(|point| point.special.is_none());
            if plain && of_kind(&pair[0]) && of_kind(&pair[1]) {
                let at = |point: &PointRecord| {
                    [self.along(&point.orbit).0, point.orbit.states[number][coordinate]]
                };
                if line.last().is_none_or(|last| *last != at(&pair[0])) {
                    line.extend([gap, at(&pair[0])]);
                }
                line.push(at(&pair[1]));
            }
        }
        line
    }
}
