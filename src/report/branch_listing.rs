//! Branches of periodic orbits: fields of `branch --json`, table of all points, special points as
//! text, and figures.

use std::iter::once;
use std::ops::RangeInclusive;

use serde::Serialize;

use super::diagram_figure::{
    NEAR_GRAZE, extent, near_graze, observable_words, offset_axis, value_scale,
};
use super::figure::{Annotation, Axis, Figure, Marker, Series, SeriesStyle, Stroke};
use super::orbits_listing::{
    OrbitRecord, OrbitsListing, multipliers, unfinished_remark, using_words,
};
use super::table::{counted, significant};
use super::{Cell, Column, Named, SectionDocument, Table};
use crate::analysis::branches::{
    BranchDiagram, BranchEnd, BranchLabel, BranchObservable, BranchPoint, Branches, Special,
};
use crate::analysis::orbits::{FoundOrbit, Orbits};
use crate::convergence::MeasuredWindow;
use crate::expansion::{LocalMap, WindowEdge};
use crate::iteration::Itinerary;

/// Digits of the ends of stable intervals in words.
const DIGITS_SAID: usize = 8;

/// Branches in offsets, for the JSON document.
#[derive(Clone, Debug, Serialize)]
pub struct BranchListing {
    /// `map` or `direct`.
    pub using: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// Parameter that varies.
    pub along: String,
    /// Grazing values of the active parameters.
    pub grazing_parameters: Named<f64>,
    /// Surface of each passage of a return, for the digits of an itinerary.
    pub passages: Vec<String>,
    /// Window of the map, to which `inside` refers.
    pub window: MeasuredWindow,
    /// Share that truncation omits at the edge of the window, one per passage.
    pub window_edges: Vec<WindowEdge>,
    /// Branches, shorter periods first.
    pub branches: Vec<BranchRecord>,
    /// Itineraries of which not all branches were followed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unfinished: Vec<String>,
}

/// Branch.
#[derive(Clone, Debug, Serialize)]
pub struct BranchRecord {
    /// Number of the branch, from 1.
    pub branch: usize,
    /// Itinerary, in digits.
    pub itinerary: String,
    /// Period, in returns.
    pub period: usize,
    /// Reasons why the branch ends at its first and last point.
    pub ends: [BranchEnd; 2],
    /// Intervals of the parameter in which special points may have been missed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unresolved: Vec<[f64; 2]>,
    /// Orbits, in order along the branch.
    pub points: Vec<PointRecord>,
}

/// Orbit of a branch.
#[derive(Clone, Debug, Serialize)]
pub struct PointRecord {
    /// Orbit.
    #[serde(flatten)]
    pub orbit: OrbitRecord,
    /// Special point at this orbit.
    #[serde(flatten)]
    pub special: Option<Special>,
    /// Observed quantities, by name.
    #[serde(skip_serializing_if = "Named::is_empty")]
    pub observed: Named<f64>,
}

impl BranchListing {
    /// Listing of the branches of a map, or of direct simulation, in the parameter `along`.
    pub fn new(
        section: SectionDocument,
        (map, window, edges): (&LocalMap, &MeasuredWindow, &[WindowEdge]),
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
        let listed = OrbitsListing::new(section, (map, window, edges), itinerary, &all, direct);
        let mut orbits = listed.orbits.into_iter();
        let branches = found.branches.iter().enumerate().map(|(number, branch)| BranchRecord {
            branch: number + 1,
            itinerary: branch.itinerary.to_string(),
            period: branch.itinerary.period(),
            ends: branch.ends,
            unresolved: branch.unresolved.clone(),
            points: branch
                .points
                .iter()
                .zip(orbits.by_ref())
                .map(|(BranchPoint { special, .. }, orbit)| PointRecord {
                    orbit,
                    special: special.clone(),
                    observed: Named(Vec::new()),
                })
                .collect(),
        });
        Self {
            using: listed.using,
            along: map.parameters[along].name.clone(),
            branches: branches.collect(),
            unfinished: found.unfinished.iter().map(ToString::to_string).collect(),
            section: listed.section,
            grazing_parameters: listed.grazing_parameters,
            passages: listed.passages,
            window: listed.window,
            window_edges: listed.window_edges,
        }
    }

    /// Adds observed quantities of the orbits, by branch and point.
    #[must_use]
    pub fn with_observed(mut self, observed: &[(BranchObservable, Vec<Vec<f64>>)]) -> Self {
        for (number, branch) in self.branches.iter_mut().enumerate() {
            for (place, point) in branch.points.iter_mut().enumerate() {
                let values = observed.iter();
                let values =
                    values.map(|(kind, values)| (kind.name().to_owned(), values[number][place]));
                point.observed = Named::new(values);
            }
        }
        self
    }

    /// Names of the observed quantities.
    fn observed(&self) -> Vec<String> {
        let first = self.branches.first().and_then(|branch| branch.points.first());
        let names = first.into_iter().flat_map(|point| &point.observed.0);
        names.map(|(name, _)| name.clone()).collect()
    }

    /// Table of the special points, for people: one row each, numbered from 1.
    pub fn special_table(&self) -> Table {
        let special = self.points().filter_map(|(branch, point)| {
            point.special.as_ref().map(|special| (branch, &point.orbit, special))
        });
        let value = format!("{}_value", self.along);
        Table::of(special.enumerate())
            .count("point", |(number, _)| number + 1)
            .count("branch", |(_, (branch, ..))| branch.branch)
            .text("itinerary", |(_, (branch, ..))| &branch.itinerary)
            .text("label", |(_, (.., special))| special_words(special))
            .number(&self.along, 10, |(_, (_, orbit, _))| self.along(orbit).0)
            .number(&value, 10, |(_, (_, orbit, _))| self.along(orbit).1)
            .numbers(&self.section.coordinates, 5, |(_, (_, orbit, _)), place| {
                orbit.state.0[place].1
            })
            .text("multipliers", |(_, (_, orbit, _))| multipliers(&orbit.multipliers))
            .text("impact speeds", |(_, (_, orbit, _))| orbit.speeds(4, ", "))
            .number("coefficient", 5, |(_, (.., special))| special.coefficient)
            .text("window", |(_, (_, orbit, _))| if orbit.inside { "inside" } else { "outside" })
            .made()
    }

    /// Table of all points with all digits, for programs: one column per number.
    pub fn data_table(&self) -> Table {
        let value = format!("{}_value", self.along);
        let count = self.section.coordinates.len();
        let parts = (1..=count).flat_map(|n| [format!("re{n}"), format!("im{n}")]);
        let label = |point: &PointRecord| {
            let label = point.special.as_ref().map(|special| special.label.letters());
            label.map_or(Cell::Missing, Cell::text)
        };
        Table::of(self.points())
            .count("branch", |(branch, _)| branch.branch)
            .text("itinerary", |(branch, _)| &branch.itinerary)
            .count("period", |(branch, _)| branch.period)
            .number(&self.along, 12, |(_, point)| self.along(&point.orbit).0)
            .number(&value, 12, |(_, point)| self.along(&point.orbit).1)
            .numbers(&self.section.coordinates, 12, |(_, point), place| {
                point.orbit.state.0[place].1
            })
            .numbers(parts, 12, |(_, point), place| {
                point.orbit.multipliers.as_flattened().get(place).copied()
            })
            .column(Column::number("stable"), |(_, PointRecord { orbit, .. })| {
                // NOTE: an orbit whose multipliers are not numbers is neither stable nor unstable.
                match orbit.multipliers.is_empty() {
                    true => Cell::Missing,
                    false => Cell::Integer(orbit.stable.into()),
                }
            })
            .flag("physical", |(_, point)| point.orbit.physical)
            .flag("inside", |(_, point)| point.orbit.inside)
            .text("speeds", |(_, point)| point.orbit.speeds(16, " "))
            .column(Column::text("label"), |(_, point)| label(point))
            .text("name", |(_, point)| &point.orbit.name)
            .numbers(self.observed(), 12, |(_, point), place| {
                Some(point.observed.0[place].1).filter(|value| value.is_finite())
            })
            .made()
    }

    /// Special points of the branches, as text.
    pub fn text(&self, scene: &str) -> String {
        let points = self.branches.iter().map(|branch| branch.points.len()).sum();
        format!(
            "branches of `{scene}` in {} by {}: {} with {}\n{}\noffsets on the {}\n\n{}",
            self.along,
            using_words(self.using),
            self.branches.len(),
            counted(points, "point"),
            self.stability_words(),
            self.section.words(),
            self.special_table().to_text()
        )
    }

    /// Lines that say where each branch is stable and physical.
    fn stability_words(&self) -> String {
        let mut words = String::new();
        let name = &self.along;
        for branch in &self.branches {
            let mut intervals: Vec<String> = self
                .stable_intervals(branch)
                .map(|ends| match ends {
                    [from, to] if from == to => format!("at {name} = {from}"),
                    [from, to] => format!("from {name} = {from} to {to}"),
                })
                .collect();
            intervals.dedup();
            if !intervals.is_empty() {
                let (number, itinerary) = (branch.branch, &branch.itinerary);
                let intervals = intervals.join(", ");
                words.push_str(&format!("branch {number} ({itinerary}) is stable {intervals}\n"));
            }
        }
        if words.is_empty() {
            "no branch is stable anywhere in the range\n".to_owned()
        } else {
            words
        }
    }

    /// Intervals of the parameter on which a branch is stable and physical, as words: those drawn
    /// solid in which some point is known to be stable, and stable points alone. A special point
    /// is the end of an interval or none.
    fn stable_intervals(&self, branch: &BranchRecord) -> impl Iterator<Item = [String; 2]> {
        let points = &branch.points;
        let is_stable = |place: usize| points[place].orbit.stable && points[place].orbit.physical;
        let mut runs = stretches(points, true);
        runs.retain(|places| places.clone().any(is_stable));
        let is_alone = |place: &usize| {
            let is_plain = points[*place].special.is_none();
            is_stable(*place) && is_plain && runs.iter().all(|places| !places.contains(place))
        };
        let alone: Vec<_> = (0..points.len()).filter(is_alone).map(|place| place..=place).collect();
        runs.extend(alone);
        runs.sort_by_key(|places| *places.start());
        runs.into_iter().map(|places| {
            let values = || points[places.clone()].iter().map(|point| self.along(&point.orbit).1);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
                .map(|end| significant(end, DIGITS_SAID))
        })
    }

    /// Warnings about accuracy or completeness.
    pub fn remarks(&self) -> Vec<String> {
        let points = self.branches.iter().flat_map(|branch| &branch.points);
        let physical: Vec<_> = points.filter(|point| point.orbit.physical).collect();
        let outside = physical.iter().filter(|point| !point.orbit.inside).count();
        let mut remarks = Vec::new();
        if outside > 0 && self.using == "map" {
            remarks.push(format!(
                "warning: {outside} of {} physical points are outside the window, where the map \
                 has not been measured; the method `direct` simulates them",
                physical.len()
            ));
        }
        let unresolved = self.branches.iter().filter(|branch| !branch.unresolved.is_empty());
        let unresolved = unresolved.count();
        if unresolved > 0 {
            remarks.push(format!(
                "warning: on {} more special points may lie than were found; \
                 `unresolved` in the JSON says where",
                counted(unresolved, "branch")
            ));
        }
        remarks.extend(self.early_ends());
        remarks.extend(unfinished_remark(&self.unfinished));
        if self.using == "direct" {
            remarks.push(STARTS_TRIED.to_owned());
        }
        remarks
    }

    /// Warning about branches that end although physical orbits continue; it names the first few.
    fn early_ends(&self) -> Option<String> {
        let ends = self.branches.iter().flat_map(|branch| {
            let last = branch.points.len().saturating_sub(1);
            [0, last].into_iter().zip(branch.ends).map(move |(place, end)| (branch, place, end))
        });
        let all: Vec<String> =
            ends.filter_map(|(branch, place, end)| self.early_end(branch, place, end)).collect();
        let more = match all.len().checked_sub(ENDS_SAID) {
            Some(more) if more > 0 => format!("; and {more} more, see `ends` in the JSON"),
            _ => String::new(),
        };
        let said = all[..all.len().min(ENDS_SAID)].join("; ");
        (!all.is_empty())
            .then(|| format!("note: not followed to the end of the range: {said}{more}"))
    }

    /// Warning about an end of a branch where the orbit is physical and no other branch continues.
    fn early_end(&self, branch: &BranchRecord, place: usize, end: BranchEnd) -> Option<String> {
        let why = match end {
            BranchEnd::Reach => "is as far from the graze as it is followed",
            BranchEnd::StepTooSmall => {
                "has no step short enough, as at a further graze or a lost section point,"
            }
            BranchEnd::SectionPoint => "loses a point of the tangency section, where h'' = 0,",
            BranchEnd::StepLimit => "has taken the most steps",
            BranchEnd::WorkLimit => "has taken the most work",
            _ => return None,
        };
        let point = branch.points.get(place).filter(|point| point.orbit.physical)?;
        let goes_on = |other: &BranchRecord| {
            let steps = other.points.windows(2);
            other.branch != branch.branch
                && other.itinerary == branch.itinerary
                && steps.into_iter().any(|step| self.is_beside(&point.orbit, step))
        };
        if self.branches.iter().any(goes_on) {
            return None;
        }
        let (offset, value) = self.along(&point.orbit);
        let (number, itinerary, along) = (branch.branch, &branch.itinerary, &self.along);
        Some(format!(
            "branch {number} ({itinerary}) {why} at {along} = {value:.6} (offset {offset:.3e})"
        ))
    }

    fn points(&self) -> impl Iterator<Item = (&BranchRecord, &PointRecord)> {
        let branches = self.branches.iter();
        branches.flat_map(|branch| branch.points.iter().map(move |point| (branch, point)))
    }

    /// Whether parameter and state of an orbit are no farther from those of a step of a branch than
    /// the step is long.
    fn is_beside(&self, orbit: &OrbitRecord, step: &[PointRecord]) -> bool {
        let at = |orbit: &OrbitRecord| -> Vec<f64> {
            let state = orbit.state.0.iter().map(|(_, value)| *value);
            once(self.along(orbit).0).chain(state).collect()
        };
        let ends: Vec<Vec<f64>> = step.iter().map(|point| at(&point.orbit)).collect();
        at(orbit).iter().enumerate().all(|(place, value)| {
            let values = || ends.iter().map(|end| end[place]);
            let low = values().fold(f64::INFINITY, f64::min);
            let high = values().fold(f64::NEG_INFINITY, f64::max);
            // A component that does not vary differs by rounding.
            let length = high - low + 1e-9 * (low.abs() + high.abs());
            (low - length..=high + length).contains(value)
        })
    }

    /// Offset and value of the parameter that varies.
    pub(super) fn along(&self, orbit: &OrbitRecord) -> (f64, f64) {
        let named = |values: &Named<f64>| {
            let value = values.0.iter().find(|(name, _)| *name == self.along);
            value.map_or(f64::NAN, |(_, value)| *value)
        };
        let offset = named(&orbit.parameters);
        (offset, named(&self.grazing_parameters) + offset)
    }

    /// Figures of the branches over the parameter, with the suffix of each file name: one per
    /// section coordinate, one with the iterates and observable of a diagram, one per observed
    /// quantity, and close-ups of the graze where a far orbit flattens it. Physical orbits only;
    /// stable ones solid, unstable ones dashed.
    pub fn figures(&self, diagram: Option<&BranchDiagram>) -> Vec<(String, Figure)> {
        let by_coordinate = |(coordinate, name): (usize, &String)| {
            let value =
                |(_, _, number): Place, point: &PointRecord| point.orbit.states[number][coordinate];
            let mut figure = self.figure(offset_axis(name), Vec::new(), &value);
            let at_graze = self.section.point.get(coordinate);
            figure.beside = at_graze.map(|at_graze| value_scale(name, *at_graze));
            (format!("-{name}"), figure)
        };
        let mut figures: Vec<_> =
            self.section.coordinates.iter().enumerate().map(by_coordinate).collect();
        if let Some(BranchDiagram { diagram, values }) = diagram {
            let points = diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
            let under = points
                .flat_map(|point| point.kept_values().map(|value| [point.offset, value]))
                .filter(|[_, value]| value.is_finite());
            let axis = Axis::linear(observable_words(&diagram.observable));
            let value =
                |(branch, point, number): Place, _: &PointRecord| values[branch][point][number];
            figures.insert(0, (String::new(), self.figure(axis, under.collect(), &value)));
        }
        for (place, name) in self.observed().into_iter().enumerate() {
            let value = |_: Place, point: &PointRecord| point.observed.0[place].1;
            let figure = self.figure(Axis::linear(name.replace('_', " ")), Vec::new(), &value);
            figures.push((format!("-{name}"), figure));
        }
        figures.retain(|(_, figure)| !figure.series.is_empty());
        figures.into_iter().flat_map(with_close_up).collect()
    }

    /// Name of an orbit in a figure: its itinerary. If there are several surfaces, extra contacts
    /// or additional phase turns, the name has the hits at each surface and the periods.
    fn name<'a>(&self, branch: &'a BranchRecord, point: &'a PointRecord) -> &'a str {
        let several = self.passages.iter().any(|surface| *surface != self.passages[0]);
        let extra = point.orbit.extra_contacts.is_some_and(|extra| extra > 0);
        match several || extra || point.orbit.turns.is_some_and(|turns| turns != 0) {
            true => &point.orbit.name,
            false => &branch.itinerary,
        }
    }

    /// Entry of the legend for a name from [`BranchListing::name`].
    fn entry(name: &str) -> String {
        match name.starts_with('(') {
            true => format!("orbit {name}"),
            false => format!("itinerary {name}"),
        }
    }

    /// Intervals of a branch from graze to graze, as ranges of points, with the names of their
    /// orbits.
    fn named_stretches(&self, number: usize) -> Vec<(&str, RangeInclusive<usize>)> {
        let branch = &self.branches[number];
        let mut stretches: Vec<(&str, RangeInclusive<usize>)> = Vec::new();
        for (place, point) in branch.points.iter().enumerate() {
            let name = self.name(branch, point);
            match stretches.last_mut() {
                Some((last, places)) if *last == name => *places = *places.start()..=place,
                _ => stretches.push((name, place.saturating_sub(1)..=place)),
            }
        }
        stretches
    }

    fn figure(&self, axis: Axis, under: Vec<[f64; 2]>, value: Values<'_>) -> Figure {
        let mut figure = Figure::new(offset_axis(&self.along), axis);
        let mut grazing = self.grazing_parameters.0.iter();
        let at_graze = grazing.find(|(name, _)| *name == self.along);
        figure.above = at_graze.map(|(name, value)| value_scale(name, *value));
        let mut named: Vec<&str> = Vec::new();
        for number in 0..self.branches.len() {
            for (name, places) in self.named_stretches(number) {
                let known = named.iter().position(|other| *other == name);
                let color = known.unwrap_or(named.len());
                if known.is_none() {
                    named.push(name);
                }
                let name = if known.is_none() { name } else { "" };
                self.draw(&mut figure, (number, places), value, (name, color));
            }
            self.mark(&mut figure, number, value);
        }
        let lines =
            |stroke| figure.series.iter().any(|series| series.style == SeriesStyle::Line(stroke));
        let meanings = [(Stroke::Solid, "stable"), (Stroke::Dashed, "unstable")];
        let drawn = meanings.into_iter().filter(|(stroke, _)| lines(*stroke));
        figure.strokes = drawn.map(|(stroke, words)| (stroke, words.to_owned())).collect();
        let under = beside(under, &figure.series);
        if !under.is_empty() {
            figure.series.insert(0, Series::dots("iterates", under).in_grey());
        }
        let points = figure.series.iter().flat_map(|series| series.points.iter().copied());
        join_labels(&mut figure.annotations, points);
        figure
    }

    fn draw(
        &self,
        figure: &mut Figure,
        (branch, places): (usize, RangeInclusive<usize>),
        value: Values<'_>,
        (name, color): (&str, usize),
    ) {
        let mut name = if name.is_empty() { String::new() } else { Self::entry(name) };
        let first = *places.start();
        let points = &self.branches[branch].points[places];
        let returns = points.first().map_or(0, |point| point.orbit.states.len());
        for number in 0..returns {
            let at = |place: usize| {
                let point = &points[place];
                [self.along(&point.orbit).0, value((branch, first + place, number), point)]
            };
            for (stroke, stable) in [(Stroke::Solid, true), (Stroke::Dashed, false)] {
                let line = line(points, stable, at);
                if !line.is_empty() {
                    let series = Series::line(std::mem::take(&mut name), stroke, line);
                    figure.series.push(series.with_color(color));
                }
            }
        }
    }

    /// Marks the special points of a branch in a figure.
    fn mark(&self, figure: &mut Figure, branch: usize, value: Values<'_>) {
        for (place, point) in self.branches[branch].points.iter().enumerate() {
            let Some(special) = &point.special else { continue };
            let marker = match special.label {
                BranchLabel::Graze => Marker::Ring,
                BranchLabel::SaddleNode => Marker::Circle,
                BranchLabel::PeriodDoubling => Marker::Square,
                BranchLabel::NeimarkSacker => Marker::Diamond,
                BranchLabel::BranchPoint => Marker::Triangle,
                BranchLabel::Hopf => Marker::Cross,
            };
            let at = [self.along(&point.orbit).0, value((branch, place, 0), point)];
            let text = special.label.letters().to_owned();
            figure.annotations.push(Annotation { at, text, marker: Some(marker) });
        }
    }
}

/// A figure and, where it has one, its close-up of the first graze.
fn with_close_up((ending, figure): (String, Figure)) -> Vec<(String, Figure)> {
    let graze = BranchLabel::Graze.letters();
    let mut marks = figure.annotations.iter();
    let graze = marks.find(|mark| mark.text.split(' ').any(|word| word == graze));
    let near = graze.and_then(|mark| near_graze(&figure, mark.at[1]));
    let near = near.map(|near| (format!("{ending}{NEAR_GRAZE}"), near));
    [(ending, figure)].into_iter().chain(near).collect()
}

/// Iterates no farther from the branches than the branches are high: a distant attractor would
/// leave them no room.
fn beside(mut iterates: Vec<[f64; 2]>, branches: &[Series]) -> Vec<[f64; 2]> {
    let values = branches.iter().flat_map(|series| &series.points).map(|point| point[1]);
    let values = values.filter(|value| value.is_finite());
    let (least, most) = extent(values);
    let height = most - least;
    if height > 0.0 {
        iterates.retain(|[_, value]| (least - height..=most + height).contains(value));
    }
    iterates
}

/// Note on the starts of branches of direct simulation.
const STARTS_TRIED: &str = "note: branches were begun at the graze, at orbits of the map whose \
    later passages make contact, at what 64 flights settled on, at every start given and where a \
    branch led; an unstable branch that none of these meets is not found";

/// Largest number of early ends that are named.
const ENDS_SAID: usize = 3;

/// Labels nearer than this share of the figure's extent are joined.
const ONE_LABEL: f64 = 0.03;

/// Kind of a special point, with the surface that grazes if it has no passage.
fn special_words(special: &Special) -> String {
    let letters = special.label.letters();
    special.surface.as_ref().map_or(letters.to_owned(), |surface| format!("{letters} {surface}"))
}

/// Joins labels that would overlap: their words move to the first of them, each word once.
fn join_labels(labels: &mut [Annotation], points: impl Iterator<Item = [f64; 2]> + Clone) {
    let width = |axis: usize| {
        let values = points.clone().map(|point| point[axis]).filter(|value| value.is_finite());
        let (least, most) = extent(values);
        most - least
    };
    let reach = [0, 1].map(|axis| ONE_LABEL * width(axis).max(f64::MIN_POSITIVE));
    for place in 1..labels.len() {
        let (before, rest) = labels.split_at_mut(place);
        let label = &mut rest[0];
        let near = |other: &&mut Annotation| {
            !other.text.is_empty()
                && (0..2).all(|axis| (other.at[axis] - label.at[axis]).abs() <= reach[axis])
        };
        let Some(first) = before.iter_mut().find(near) else { continue };
        let word = std::mem::take(&mut label.text);
        if !first.text.split(' ').any(|known| known == word) {
            first.text = format!("{} {word}", first.text);
        }
    }
}

/// Indices of branch, point and return.
type Place = (usize, usize, usize);

/// Function of the value drawn for an orbit.
type Values<'a> = &'a dyn Fn(Place, &PointRecord) -> f64;

/// Line through the physical points of a branch that are stable, or through those that are not;
/// `at` gives the place of a point by its index. A pair of NaN precedes each connected stretch.
fn line(points: &[PointRecord], stable: bool, at: impl Fn(usize) -> [f64; 2]) -> Vec<[f64; 2]> {
    let stretches = stretches(points, stable).into_iter();
    stretches.flat_map(|places| once([f64::NAN; 2]).chain(places.map(&at))).collect()
}

/// Ranges of points in which a branch is physical and of one stability. A point that ends such a
/// range belongs to both sides.
pub(super) fn stretches(points: &[PointRecord], stable: bool) -> Vec<RangeInclusive<usize>> {
    let belongs = |point: &PointRecord| {
        let known = !point.orbit.multipliers.is_empty() && point.special.is_none();
        (!known || point.orbit.stable == stable) && point.orbit.physical
    };
    let mut stretches: Vec<RangeInclusive<usize>> = Vec::new();
    for place in 1..points.len() {
        let pair = [&points[place - 1], &points[place]];
        let plain = pair.iter().any(|point| point.special.is_none());
        if !(plain && belongs(pair[0]) && belongs(pair[1])) {
            continue;
        }
        match stretches.last_mut() {
            Some(last) if *last.end() == place - 1 => *last = *last.start()..=place,
            _ => stretches.push(place - 1..=place),
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iterates_far_from_the_branches_are_not_drawn() {
        let branch = Series::line("1", Stroke::Solid, vec![[0.0, 1.0], [1.0, 3.0], [f64::NAN; 2]]);
        let iterates = vec![[0.0, -0.9], [0.5, 2.0], [0.5, 5.1], [1.0, 4.9]];
        let kept = beside(iterates.clone(), &[branch]);
        assert_eq!(kept, [[0.0, -0.9], [0.5, 2.0], [1.0, 4.9]]);
        let level = Series::line("0", Stroke::Solid, vec![[0.0, 1.0], [1.0, 1.0]]);
        assert_eq!(beside(iterates.clone(), &[level]), iterates);
    }

    #[test]
    fn labels_at_one_point_are_one_and_others_stay() {
        let label =
            |at: [f64; 2], text: &str| Annotation { at, text: text.to_owned(), marker: None };
        let mut labels = [
            label([0.0, 1.0], "GR"),
            label([1e-17, 1.0], "GR"),
            label([0.01, 1.01], "SN"),
            label([0.5, 1.0], "PD"),
        ];
        join_labels(&mut labels, [[-1.0, 0.0], [1.0, 2.0], [f64::NAN; 2]].into_iter());
        let texts: Vec<&str> = labels.iter().map(|label| label.text.as_str()).collect();
        assert_eq!(texts, ["GR SN", "", "", "PD"]);
    }
}
