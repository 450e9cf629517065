//! Loci in two parameters: fields of `loci --json`, tables and figures.

use serde::Serialize;

use super::diagram_figure::{offset_axis, value_scale};
use super::figure::{Annotation, Axis, Figure, Marker, Series, ShiftedScale, Stroke, symbol};
use super::orbits_listing::{unfinished_remark, using_words};
use super::{Named, SectionDocument, Table};
use crate::analysis::loci::{
    CodimensionTwo, Loci, LociRequest, Locus, LocusEnd, LocusKind, LocusPoint, PlaneCurve,
    PlanePoint, Tangency,
};
use crate::expansion::LocalMap;

/// Loci in offsets, for the JSON document.
#[derive(Clone, Debug, Serialize)]
pub struct LociListing {
    /// `map` or `direct`.
    pub using: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// Grazing values of the active parameters.
    pub grazing_parameters: Named<f64>,
    /// Surface of each passage of a return, for the digits of an itinerary.
    pub passages: Vec<String>,
    /// Parameters of the plane.
    pub plane: [String; 2],
    /// The loci.
    pub loci: Vec<LocusRecord>,
    /// Tangencies of folds and flips with the grazing curves.
    pub tangencies: Vec<TangencyRecord>,
    /// Surfaces whose contacts begin without a jump of the force, as at compliant stops: theory has
    /// no tangency there.
    pub without_kick: Vec<String>,
    /// Itineraries whose loci direct simulation did not all follow.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unfinished: Vec<String>,
    #[serde(skip)]
    places: [usize; 2],
}

/// Curve in the plane.
#[derive(Clone, Debug, Serialize)]
pub struct LocusRecord {
    /// Kind of the locus.
    pub kind: LocusKind,
    /// Contacts of its orbits, in digits; for a graze, those besides the grazing one.
    pub itinerary: String,
    /// Return and passage that graze, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grazing: Option<[usize; 2]>,
    /// Contacts from the saddle back to it, for a crisis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excursion: Option<String>,
    /// Points, in order along the locus.
    pub points: Vec<LocusPointRecord>,
    /// Reasons why the locus ends at its first and last point.
    pub ends: [LocusEnd; 2],
}

/// Point of a locus.
#[derive(Clone, Debug, Serialize)]
pub struct LocusPointRecord {
    /// Offsets of the active parameters.
    pub parameters: Named<f64>,
    /// Offsets of the orbit's first point.
    pub state: Named<f64>,
    /// The depth variable `y` of each contact, the grazing one included.
    pub depth_variables: Vec<f64>,
    /// Multipliers, `[re, im]`, the largest first; for a graze, those without the grazing contact.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all multipliers except those of the locus lie inside the unit circle.
    pub stable: bool,
    /// Whether the contacts made are those of the itinerary.
    pub physical: bool,
    /// Whether the orbit lies in the window.
    pub inside: bool,
    /// Label of a point of codimension two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    #[serde(skip)]
    at: [f64; 2],
}

/// Quadratic tangency of a locus with a grazing curve. If `t` is the distance in the first
/// parameter, the second parameter differs from the grazing curve by `coefficient t²`.
#[derive(Clone, Debug, Serialize)]
pub struct TangencyRecord {
    /// Fold or flip.
    pub kind: LocusKind,
    /// Contacts of its orbits, in digits, the grazing one included.
    pub itinerary: String,
    /// Label of the point on the grazing curve.
    pub label: String,
    /// Offsets of the active parameters at that point.
    pub parameters: Named<f64>,
    /// Coefficient from the jets of the map.
    pub coefficient: f64,
    /// Coefficient fitted to points of both curves.
    pub fitted: Option<f64>,
    /// Depth variable over `t`; the locus is physical where `slope t` is positive.
    pub slope: f64,
}

impl LociListing {
    /// Listing of the loci of a map, or of direct simulation, in the plane of two active
    /// parameters.
    pub fn new(
        section: SectionDocument,
        map: &LocalMap,
        plane: [usize; 2],
        found: &Loci,
        direct: bool,
    ) -> Self {
        let name = |place: usize| map.parameters[place].name.clone();
        let values = map.parameters.iter();
        Self {
            using: if direct { "direct" } else { "map" },
            section,
            grazing_parameters: Named::new(
                values.map(|parameter| (parameter.name.clone(), parameter.value.to_f64())),
            ),
            passages: map.surfaces.clone(),
            plane: plane.map(name),
            loci: found.loci.iter().map(|locus| record(map, plane, locus)).collect(),
            tangencies: found.tangencies.iter().map(|found| tangency_record(map, found)).collect(),
            without_kick: found.without_kick.iter().map(|&n| map.surfaces[n].clone()).collect(),
            unfinished: found.unfinished.iter().map(ToString::to_string).collect(),
            places: plane,
        }
    }

    /// Whether the loci include grazes.
    pub fn has_grazes(&self) -> bool {
        self.loci.iter().any(|locus| locus.kind == LocusKind::Graze)
    }

    /// Crises, numbered from 1.
    pub fn crises(&self) -> impl Iterator<Item = (usize, &LocusRecord)> {
        let loci = self.loci.iter().enumerate();
        let crises = loci.filter(|(_, locus)| locus.kind == LocusKind::Crisis);
        crises.map(|(number, locus)| (number + 1, locus))
    }

    /// Points of codimension two, each with the index of its locus and the locus.
    pub fn special(&self) -> impl Iterator<Item = (usize, &LocusRecord, &LocusPointRecord)> {
        let loci = self.loci.iter().enumerate();
        loci.flat_map(|(number, locus)| {
            let labelled = locus.points.iter().filter(|point| point.label.is_some());
            labelled.map(move |point| (number, locus, point))
        })
    }

    /// Table of the loci, for people: one row each.
    pub fn table(&self) -> Table {
        let ends = ["from", "to"].iter();
        let ends = ends.flat_map(|end| self.plane.iter().map(move |name| format!("{name} {end}")));
        let end = |locus: &LocusRecord, place: usize| {
            let points = &locus.points;
            let point = if place < 2 { points.first() } else { points.last() };
            point.map(|point| point.at[place % 2])
        };
        let count = |locus: &LocusRecord, holds: fn(&&LocusPointRecord) -> bool| {
            locus.points.iter().filter(holds).count()
        };
        Table::of(self.loci.iter().enumerate())
            .count("locus", |(number, _)| number + 1)
            .text("kind", |(_, locus)| locus.kind.word())
            .text("itinerary", |(_, locus)| &locus.itinerary)
            .count("points", |(_, locus)| locus.points.len())
            .count("physical", |(_, locus)| count(locus, |point| point.physical))
            .count("inside", |(_, locus)| count(locus, |point| point.inside))
            .numbers(ends, 6, |(_, locus), place| end(locus, place))
            .made()
    }

    /// Table of the points of codimension two, for people.
    pub fn special_table(&self) -> Table {
        let mut table = Table::of(self.special())
            .text("point", |(.., point)| point.label.as_deref().unwrap_or_default())
            .count("locus", |(number, ..)| number + 1)
            .text("kind", |(_, locus, _)| locus.kind.word())
            .text("itinerary", |(_, locus, _)| &locus.itinerary);
        for (place, name) in self.plane.iter().enumerate() {
            let value = format!("value of {name}");
            table = table.number(name, 9, |(.., point)| point.at[place]);
            table = table.number(&value, 14, |(.., point)| self.values(point)[place]);
        }
        let word = |point: &LocusPointRecord| if point.physical { "physical" } else { "virtual" };
        table.text("orbit", |(.., point)| word(point)).made()
    }

    /// Table of the tangencies, for people.
    pub fn tangency_table(&self) -> Table {
        let table = Table::of(&self.tangencies)
            .text("point", |found| &found.label)
            .text("kind", |found| found.kind.word())
            .text("itinerary", |found| &found.itinerary)
            .number("from jets", 12, |found| found.coefficient)
            .number("fitted", 12, |found| found.fitted)
            .number("y over distance", 9, |found| found.slope);
        table.made()
    }

    /// Loci as text.
    pub fn text(&self, scene: &str) -> String {
        let [first, second] = &self.plane;
        let mut text = format!(
            "loci of `{scene}` in {first} and {second} by {}; offsets from the graze\n\n{}",
            using_words(self.using),
            self.table().to_text()
        );
        for (number, locus) in self.crises() {
            text.push_str(&format!(
                "\nlocus {number}: an attractor touches the stable manifold of the saddle {}; \
                 contacts from the saddle back to it: {}\n",
                locus.itinerary,
                locus.excursion.as_deref().unwrap_or_default()
            ));
        }
        if self.using == "direct" {
            text.push_str(
                "\nphysical parts, looked for along branches of direct simulation at five values \
                 of the first parameter and two of the second, and at the map's loci; tangencies \
                 are the map's\n",
            );
            if !self.has_grazes() {
                text.push_str(
                    "grazes are followed on a tangency section, those of its own passage\n",
                );
            }
        }
        if self.special().next().is_some() {
            text.push_str(&format!(
                "\npoints of codimension two\n\n{}",
                self.special_table().to_text()
            ));
        }
        for surface in &self.without_kick {
            text.push_str(&format!(
                "\nno tangencies at `{surface}`: its contact begins without a kick, so multipliers \
                 pass a graze without a jump, and folds and flips do not end there\n"
            ));
        }
        if !self.tangencies.is_empty() {
            text.push_str(&format!(
                "\ntangencies: {second} of the locus less {second} of the graze, over the square \
                 of the distance in {first}\n\n{}",
                self.tangency_table().to_text()
            ));
        }
        text
    }

    /// Warnings about accuracy or completeness.
    pub fn remarks(&self) -> Vec<String> {
        self.outside_remark().into_iter().chain(unfinished_remark(&self.unfinished)).collect()
    }

    /// Warning with the number of points outside the window.
    fn outside_remark(&self) -> Option<String> {
        let points = self.loci.iter().flat_map(|locus| &locus.points);
        let physical: Vec<_> = points.filter(|point| point.physical).collect();
        let outside = physical.iter().filter(|point| !point.inside).count();
        (outside > 0 && self.using == "map").then(|| {
            format!(
                "warning: {outside} of {} points are outside the window, where the map has not \
                 been measured; the method `direct` simulates them",
                physical.len()
            )
        })
    }

    /// Table of the points of all loci with all digits, for programs.
    pub fn data_table(&self) -> Table {
        let points = self.loci.iter().enumerate().flat_map(|(number, locus)| {
            locus.points.iter().map(move |point| (number, locus, point))
        });
        let mut table = Table::of(points)
            .count("locus", |(number, ..)| number + 1)
            .text("kind", |(_, locus, _)| locus.kind.word())
            .text("itinerary", |(_, locus, _)| &locus.itinerary);
        for (place, name) in self.plane.iter().enumerate() {
            let value = format!("{name}_value");
            table = table.number(name, 12, |(.., point)| point.at[place]).number(
                &value,
                17,
                |(.., point)| self.values(point)[place],
            );
        }
        table
            .flag("stable", |(.., point)| point.stable)
            .flag("physical", |(.., point)| point.physical)
            .flag("inside", |(.., point)| point.inside)
            .text("label", |(.., point)| point.label.as_deref().unwrap_or_default())
            .made()
    }

    /// Values of the two parameters at a point.
    fn values(&self, point: &LocusPointRecord) -> [f64; 2] {
        let value =
            |place: usize| self.grazing_parameters.0[self.places[place]].1 + point.at[place];
        [value(0), value(1)]
    }

    /// Figure of the plane with all loci. Physical parts are coloured by kind, solid where the
    /// other multipliers are stable and dashed where not; the rest is dotted grey. Points of
    /// codimension two are labelled. `under` is drawn below and must have the same axes.
    pub fn figure(&self, under: Option<Figure>) -> Figure {
        let mut figure = under.unwrap_or_else(|| {
            let [horizontal, vertical] = self.plane.each_ref().map(|name| offset_axis(name));
            let mut figure = Figure::new(horizontal, vertical);
            let [above, beside] = self.plane.each_ref().map(|name| self.value_scale(name));
            (figure.above, figure.beside) = (above, beside);
            figure
        });
        self.draw(&mut figure, &|at| Some(at));
        figure
    }

    /// Scale with the values of a parameter.
    fn value_scale(&self, name: &str) -> Option<ShiftedScale> {
        let mut values = self.grazing_parameters.0.iter();
        values.find(|(known, _)| known == name).map(|(_, value)| value_scale(name, *value))
    }

    /// Figure with the second parameter measured from the grazing curve of the orbit without
    /// contact; `None` if there is no such curve, or nothing but grazes to compare with it.
    pub fn figure_from_graze(&self) -> Option<Figure> {
        if self.loci.iter().all(|locus| locus.kind == LocusKind::Graze) {
            return None;
        }
        let graze = self
            .loci
            .iter()
            .find(|locus| locus.kind == LocusKind::Graze && !locus.itinerary.contains('1'))?;
        let line: Vec<[f64; 2]> = graze.points.iter().map(|point| point.at).collect();
        let [horizontal, vertical] = &self.plane;
        let letter = symbol(vertical);
        let vertical = Axis::linear(format!("{letter} − {letter} at GR"));
        let mut figure = Figure::new(offset_axis(horizontal), vertical);
        figure.above = self.value_scale(horizontal);
        self.draw(&mut figure, &|[first, second]| Some([first, second - between(&line, first)?]));
        Some(figure)
    }

    /// Draws all loci. `place` maps points of the plane into the figure.
    fn draw(&self, figure: &mut Figure, place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>) {
        let point = |point: &LocusPointRecord| PlanePoint {
            at: point.at,
            stable: point.stable,
            physical: point.physical,
            label: point.label.clone(),
        };
        let curves = self.loci.iter().map(|locus| PlaneCurve {
            kind: locus.kind,
            itinerary: locus.itinerary.clone(),
            points: locus.points.iter().map(point).collect(),
            whole: true,
        });
        draw_curves(figure, &curves.collect::<Vec<_>>(), place);
    }
}

/// Draws curves in a plane, coloured by kind, in the line patterns of their parts. `place` maps
/// points of the plane into the figure.
pub(super) fn draw_curves(
    figure: &mut Figure,
    curves: &[PlaneCurve],
    place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>,
) {
    for drawn in [Drawn::Virtual, Drawn::Stable, Drawn::Unstable] {
        let (stroke, meaning) = drawn.stroke();
        let mut any = false;
        for kind in LocusKind::ALL {
            let of_kind = curves.iter().filter(|curve| curve.kind == kind);
            let mut points = Vec::new();
            for curve in of_kind {
                for (_, stretch) in
                    stretches(curve).into_iter().filter(|(other, _)| *other == drawn)
                {
                    points.extend(stretch.into_iter().filter_map(place));
                    // NOTE: a point that is not a number interrupts the line.
                    points.push([f64::NAN; 2]);
                }
            }
            if points.iter().flatten().all(|value| value.is_nan()) {
                continue;
            }
            any = true;
            if drawn == Drawn::Virtual {
                figure.series.push(Series::line("", stroke, points).in_grey());
                continue;
            }
            let known = figure.series.iter().any(|series| series.name == mark(kind));
            let name = if known { "" } else { mark(kind) };
            figure.series.push(Series::line(name, stroke, points).with_color(kind as usize));
        }
        if any && figure.strokes.iter().all(|(known, _)| *known != stroke) {
            figure.strokes.push((stroke, meaning.to_owned()));
        }
    }
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let extent: [f64; 2] = std::array::from_fn(|axis| {
        points().fold(0.0_f64, |most, point| most.max(point.at[axis].abs()))
    });
    // Special points at one place share a mark with all their labels.
    let mut marked: Vec<(&[f64; 2], Vec<String>)> = Vec::new();
    let special = points().filter(|point| point.physical);
    for (at, label) in special.filter_map(|point| Some((&point.at, point.label.as_ref()?))) {
        let label = symbol(label);
        let here = |other: &[f64; 2]| {
            (0..2).all(|axis| (other[axis] - at[axis]).abs() <= ONE_MARK * extent[axis])
        };
        match marked.iter_mut().find(|(at, _)| here(at)) {
            Some((_, labels)) if labels.contains(&label) => {}
            // NOTE: a graze's own label implies that loci end there.
            Some((_, labels)) if labels[0].starts_with('ξ') && !label.starts_with('ξ') => {}
            Some((_, labels)) => labels.push(label),
            None => marked.push((at, vec![label])),
        }
    }
    figure.annotations.extend(marked.into_iter().filter_map(|(at, labels)| {
        let text = labels.join(", ");
        Some(Annotation { at: place(*at)?, text, marker: Some(Marker::Ring) })
    }));
}

/// Special points nearer than this share of the curves' extent share a mark.
const ONE_MARK: f64 = 1e-6;

/// Line style of a part of a curve.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Drawn {
    Stable,
    Unstable,
    Virtual,
}

impl Drawn {
    /// Line pattern, and its meaning.
    fn stroke(self) -> (Stroke, &'static str) {
        match self {
            Self::Stable => (Stroke::Solid, "stable"),
            Self::Unstable => (Stroke::Dashed, "unstable"),
            Self::Virtual => (Stroke::Dotted, "virtual"),
        }
    }
}

/// Parts of a curve of one line style, each including the first point of the next.
fn stretches(curve: &PlaneCurve) -> Vec<(Drawn, Vec<[f64; 2]>)> {
    let mut stretches: Vec<(Drawn, Vec<[f64; 2]>)> = Vec::new();
    for point in &curve.points {
        let drawn = match (point.physical, point.stable) {
            (false, _) => Drawn::Virtual,
            (true, true) => Drawn::Stable,
            (true, false) => Drawn::Unstable,
        };
        if let Some((_, points)) = stretches.last_mut() {
            points.push(point.at);
        }
        if stretches.last().is_none_or(|(last, _)| *last != drawn) {
            stretches.push((drawn, vec![point.at]));
        }
    }
    stretches
}

/// Ordinate of a line at an abscissa; the abscissas of the line may increase or decrease.
fn between(line: &[[f64; 2]], abscissa: f64) -> Option<f64> {
    line.windows(2).find_map(|pair| {
        let [[a, low], [b, high]] = [pair[0], pair[1]];
        let within = (a.min(b)..=a.max(b)).contains(&abscissa) && a != b;
        within.then(|| low + (abscissa - a) / (b - a) * (high - low))
    })
}

/// Usual abbreviation of a kind of locus.
fn mark(kind: LocusKind) -> &'static str {
    match kind {
        LocusKind::Graze => "GR",
        LocusKind::Fold => "SN",
        LocusKind::Flip => "PD",
        LocusKind::Torus => "NS",
        LocusKind::Crisis => "CR",
    }
}

fn tangency_record(map: &LocalMap, found: &Tangency) -> TangencyRecord {
    let names = map.parameters.iter().map(|parameter| parameter.name.clone());
    TangencyRecord {
        kind: found.kind,
        itinerary: found.itinerary.to_string(),
        label: found.label.label(),
        parameters: Named::new(names.zip(found.parameters.iter().copied())),
        coefficient: found.coefficient,
        fitted: found.fitted,
        slope: found.slope,
    }
}

fn record(map: &LocalMap, plane: [usize; 2], locus: &Locus) -> LocusRecord {
    LocusRecord {
        kind: locus.kind,
        itinerary: locus.itinerary.to_string(),
        grazing: locus.grazing,
        excursion: locus.excursion.as_ref().map(ToString::to_string),
        points: locus.points.iter().map(|point| point_record(map, plane, point)).collect(),
        ends: locus.ends,
    }
}

fn point_record(map: &LocalMap, plane: [usize; 2], point: &LocusPoint) -> LocusPointRecord {
    let names = map.parameters.iter().map(|parameter| parameter.name.clone());
    let coordinates = map.section.coordinates.iter().cloned();
    let first = point.states.first().into_iter().flatten().copied();
    LocusPointRecord {
        parameters: Named::new(names.zip(point.parameters.iter().copied())),
        state: Named::new(coordinates.zip(first)),
        depth_variables: point.depth_variables.clone(),
        multipliers: point.multipliers.clone(),
        stable: point.stable,
        physical: point.physical,
        inside: point.inside,
        label: point.label.map(CodimensionTwo::label),
        at: plane.map(|place| point.parameters[place]),
    }
}

/// Description of the search for loci.
pub fn loci_searched(request: &LociRequest) -> String {
    let itineraries: Vec<String> =
        request.itineraries.iter().map(|itinerary| itinerary.to_string()).collect();
    format!(
        "itineraries {}; branches at five offsets of the first parameter from {:e} to {:e}, depth \
         variables up to twice the window's",
        itineraries.join(", "),
        request.range[0],
        request.range[1]
    )
}
