//! Loci in two parameters: the fields of `loci --json`, tables and the figure.

use serde::Serialize;

use super::diagram_figure::offset_axis;
use super::figure::{Annotation, Axis, Figure, Marker, Series, Stroke, symbol};
use super::orbits_listing::{unfinished_remark, using_words};
use super::{Cell, Column, Named, ReportError, SectionDocument, Table};
use crate::analysis::loci::{
    CodimensionTwo, Loci, LociRequest, Locus, LocusEnd, LocusKind, LocusPoint, PlaneCurve,
    PlanePoint, Tangency,
};
use crate::expansion::LocalMap;

/// Loci, ready to be written as JSON; everything in offsets.
#[derive(Clone, Debug, Serialize)]
pub struct LociListing {
    /// `map` or `direct`.
    pub using: &'static str,
    /// The section.
    pub section: SectionDocument,
    /// Grazing values of the active parameters.
    pub grazing_parameters: Named<f64>,
    /// Surface of each passage of a return: what the digits of an itinerary stand for.
    pub passages: Vec<String>,
    /// The two parameters of the plane.
    pub plane: [String; 2],
    /// The loci.
    pub loci: Vec<LocusRecord>,
    /// How folds and flips leave the grazing curves.
    pub tangencies: Vec<TangencyRecord>,
    /// The surfaces whose contacts begin without a kick, as those of compliant stops do: theory has
    /// no tangency there.
    pub without_kick: Vec<String>,
    /// Itineraries of which direct simulation did not follow all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unfinished: Vec<String>,
    #[serde(skip)]
    places: [usize; 2],
}

/// A curve in the plane.
#[derive(Clone, Debug, Serialize)]
pub struct LocusRecord {
    /// What happens along it.
    pub kind: LocusKind,
    /// The contacts of its orbits, in digits; of a graze, those beside the grazing one.
    pub itinerary: String,
    /// The return and the passage that graze, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grazing: Option<[usize; 2]>,
    /// Of a crisis, the contacts from the saddle back to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excursion: Option<String>,
    /// Its points, in order along it.
    pub points: Vec<LocusPointRecord>,
    /// Why it ends at its first and at its last point.
    pub ends: [LocusEnd; 2],
}

/// A point of a locus.
#[derive(Clone, Debug, Serialize)]
pub struct LocusPointRecord {
    /// Offsets of the active parameters.
    pub parameters: Named<f64>,
    /// Offsets of the orbit's first point.
    pub state: Named<f64>,
    /// The depth variable `y` of each contact, the grazing one included.
    pub depth_variables: Vec<f64>,
    /// Multipliers, `[re, im]`, the largest first; of a graze those without the grazing contact.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether all multipliers but those of the locus lie inside the unit circle.
    pub stable: bool,
    /// Whether the contacts made are those of the itinerary.
    pub physical: bool,
    /// Whether it lies in the window.
    pub inside: bool,
    /// The label of a point of codimension two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    #[serde(skip)]
    at: [f64; 2],
}

/// The quadratic tangency of a locus with a grazing curve: with `t` the distance in the first
/// parameter, the second differs from the grazing curve by `coefficient t²`.
#[derive(Clone, Debug, Serialize)]
pub struct TangencyRecord {
    /// Fold or flip.
    pub kind: LocusKind,
    /// The contacts of its orbits, in digits, the grazing one included.
    pub itinerary: String,
    /// The point on the grazing curve.
    pub label: String,
    /// Offsets of the active parameters there.
    pub parameters: Named<f64>,
    /// From the jets of the map.
    pub coefficient: f64,
    /// Fitted to points of both curves.
    pub fitted: Option<f64>,
    /// Depth variable over `t`; the locus is physical where `slope t` is positive.
    pub slope: f64,
}

impl LociListing {
    /// The loci of a map in the plane of two of its active parameters, or of direct simulation.
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

    /// Whether there are grazes among the loci.
    pub fn has_grazes(&self) -> bool {
        self.loci.iter().any(|locus| locus.kind == LocusKind::Graze)
    }

    /// The crises, with their numbers from 1.
    pub fn crises(&self) -> impl Iterator<Item = (usize, &LocusRecord)> {
        let loci = self.loci.iter().enumerate();
        let crises = loci.filter(|(_, locus)| locus.kind == LocusKind::Crisis);
        crises.map(|(number, locus)| (number + 1, locus))
    }

    /// The points of codimension two: the locus that each lies on, and it.
    pub fn special(&self) -> impl Iterator<Item = (usize, &LocusRecord, &LocusPointRecord)> {
        let loci = self.loci.iter().enumerate();
        loci.flat_map(|(number, locus)| {
            let labelled = locus.points.iter().filter(|point| point.label.is_some());
            labelled.map(move |point| (number, locus, point))
        })
    }

    /// The loci as a person reads them: one row each.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn table(&self) -> Result<Table, ReportError> {
        let mut columns = vec![Column::number("locus")];
        columns.extend(["kind", "itinerary"].map(Column::text));
        columns.extend(["points", "physical", "inside"].map(Column::number));
        let ends = ["from", "to"].iter();
        columns.extend(ends.flat_map(|end| {
            self.plane.iter().map(move |name| Column::number(format!("{name} {end}")))
        }));
        let mut table = Table::new(columns);
        for (number, locus) in self.loci.iter().enumerate() {
            let count = |holds: &dyn Fn(&LocusPointRecord) -> bool| {
                Cell::Integer(locus.points.iter().filter(|point| holds(point)).count() as i64)
            };
            let mut row = vec![
                Cell::Integer(number as i64 + 1),
                Cell::text(locus.kind.word()),
                Cell::text(&locus.itinerary),
                Cell::Integer(locus.points.len() as i64),
                count(&|point| point.physical),
                count(&|point| point.inside),
            ];
            let ends = [locus.points.first(), locus.points.last()];
            for end in ends {
                let place = |value: f64| Cell::number(value, 6);
                row.extend(end.map_or([Cell::Missing, Cell::Missing], |end| end.at.map(place)));
            }
            table.push(row)?;
        }
        Ok(table)
    }

    /// The points of codimension two as a person reads them.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn special_table(&self) -> Result<Table, ReportError> {
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
        Ok(table.text("orbit", |(.., point)| word(point)).made())
    }

    /// The tangencies as a person reads them.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn tangency_table(&self) -> Result<Table, ReportError> {
        let table = Table::of(&self.tangencies)
            .text("point", |found| &found.label)
            .text("kind", |found| found.kind.word())
            .text("itinerary", |found| &found.itinerary)
            .number("from jets", 12, |found| found.coefficient)
            .number("fitted", 12, |found| found.fitted)
            .number("y over distance", 9, |found| found.slope);
        Ok(table.made())
    }

    /// The loci as a person reads them.
    ///
    /// # Errors
    ///
    /// As [`table`](Self::table).
    pub fn text(&self, scene: &str) -> Result<String, ReportError> {
        let [first, second] = &self.plane;
        let mut text = format!(
            "loci of `{scene}` in {first} and {second} by {}; offsets from the graze\n\n{}",
            using_words(self.using),
            self.table()?.to_text()
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
                 of the first parameter, and at the map's loci; tangencies are the map's\n",
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
                self.special_table()?.to_text()
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
                self.tangency_table()?.to_text()
            ));
        }
        Ok(text)
    }

    /// What may not be trusted, or not be all.
    pub fn remarks(&self) -> Vec<String> {
        self.outside_remark().into_iter().chain(unfinished_remark(&self.unfinished)).collect()
    }

    /// How many points are outside of the window.
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

    /// The points of all loci with all digits.
    ///
    /// # Errors
    ///
    /// Never in practice: every row has a cell per column.
    pub fn data_table(&self) -> Result<Table, ReportError> {
        let mut columns = vec![Column::number("locus")];
        columns.extend(["kind", "itinerary"].map(Column::text));
        for name in &self.plane {
            columns.extend([name.clone(), format!("{name}_value")].map(Column::number));
        }
        columns.extend(["stable", "physical", "inside"].map(Column::number));
        columns.push(Column::text("label"));
        let mut table = Table::new(columns);
        for (number, locus) in self.loci.iter().enumerate() {
            for point in &locus.points {
                let mut row = vec![
                    Cell::Integer(number as i64 + 1),
                    Cell::text(locus.kind.word()),
                    Cell::text(&locus.itinerary),
                ];
                for (offset, value) in point.at.iter().zip(self.values(point)) {
                    row.extend([Cell::number(*offset, 12), Cell::number(value, 17)]);
                }
                let flags = [point.stable, point.physical, point.inside];
                row.extend(flags.map(|flag| Cell::Integer(flag.into())));
                row.push(Cell::text(point.label.clone().unwrap_or_default()));
                table.push(row)?;
            }
        }
        Ok(table)
    }

    /// Physical values of the two parameters at a point.
    fn values(&self, point: &LocusPointRecord) -> [f64; 2] {
        let value =
            |place: usize| self.grazing_parameters.0[self.places[place]].1 + point.at[place];
        [value(0), value(1)]
    }

    /// The plane with all loci: the physical parts coloured by kind, solid where the other
    /// multipliers are stable and dashed where not, the rest dotted in grey; points of codimension
    /// two with their labels. `under` is drawn beneath, where it has these axes.
    pub fn figure(&self, under: Option<Figure>) -> Figure {
        let mut figure = under.unwrap_or_else(|| {
            let [horizontal, vertical] = self.plane.each_ref().map(|name| offset_axis(name));
            Figure::new(horizontal, vertical)
        });
        self.draw(&mut figure, &|at| Some(at));
        figure
    }

    /// The same with the distance from the grazing curve of the orbit without contact, in the
    /// second parameter, in the place of that parameter; `None` where there is no such curve.
    pub fn figure_from_graze(&self) -> Option<Figure> {
        let graze = self
            .loci
            .iter()
            .find(|locus| locus.kind == LocusKind::Graze && !locus.itinerary.contains('1'))?;
        let line: Vec<[f64; 2]> = graze.points.iter().map(|point| point.at).collect();
        let [horizontal, vertical] = &self.plane;
        let letter = symbol(vertical);
        let vertical = Axis::linear(format!("{letter} − {letter} of the graze"));
        let mut figure = Figure::new(offset_axis(horizontal), vertical);
        self.draw(&mut figure, &|[first, second]| Some([first, second - between(&line, first)?]));
        Some(figure)
    }

    /// Draws all loci, each point at the place that it has in the figure.
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

/// Draws curves in a plane, each point at the place that it has in the figure.
pub(super) fn draw_curves(
    figure: &mut Figure,
    curves: &[PlaneCurve],
    place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>,
) {
    for drawn in [Drawn::Virtual, Drawn::Stable, Drawn::Unstable] {
        for kind in LocusKind::ALL {
            let of_kind = curves.iter().filter(|curve| curve.kind == kind);
            let mut points = Vec::new();
            for curve in of_kind {
                for (_, stretch) in
                    stretches(curve).into_iter().filter(|(other, _)| *other == drawn)
                {
                    points.extend(stretch.into_iter().filter_map(place));
                    // A point that is no number interrupts the line.
                    points.push([f64::NAN; 2]);
                }
            }
            if points.is_empty() {
                continue;
            }
            let mark = mark(kind);
            let line = |name, stroke, points| Series::line(name, stroke, points);
            figure.series.push(match drawn {
                Drawn::Virtual => {
                    line(format!("{mark}, virtual"), Stroke::Dotted, points).in_grey()
                }
                Drawn::Stable => {
                    line(format!("{mark}, stable"), Stroke::Solid, points).with_color(kind as usize)
                }
                Drawn::Unstable => line(format!("{mark}, unstable"), Stroke::Dashed, points)
                    .with_color(kind as usize),
            });
        }
    }
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let extent: [f64; 2] = std::array::from_fn(|axis| {
        points().fold(0.0_f64, |most, point| most.max(point.at[axis].abs()))
    });
    // What lies at one place has one mark, with the names of all that it is.
    let mut marked: Vec<(&[f64; 2], Vec<String>)> = Vec::new();
    let special = points().filter(|point| point.physical);
    for (at, label) in special.filter_map(|point| Some((&point.at, point.label.as_ref()?))) {
        let label = symbol(label);
        let here = |other: &[f64; 2]| {
            (0..2).all(|axis| (other[axis] - at[axis]).abs() <= ONE_MARK * extent[axis])
        };
        match marked.iter_mut().find(|(at, _)| here(at)) {
            Some((_, labels)) if labels.contains(&label) => {}
            // The graze's own name says that loci end there.
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

/// Special points nearer than this share of the extent of all curves are one mark.
const ONE_MARK: f64 = 1e-6;

/// How a stretch of a curve is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Drawn {
    Stable,
    Unstable,
    Virtual,
}

/// The stretches of a curve that are drawn alike, each with the first point of the next.
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

/// The ordinate of a line, whose abscissas may run either way, at an abscissa.
fn between(line: &[[f64; 2]], abscissa: f64) -> Option<f64> {
    line.windows(2).find_map(|pair| {
        let [[a, low], [b, high]] = [pair[0], pair[1]];
        let within = (a.min(b)..=a.max(b)).contains(&abscissa) && a != b;
        within.then(|| low + (abscissa - a) / (b - a) * (high - low))
    })
}

/// The mark of the field.
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

/// What has been searched for loci, in words.
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
