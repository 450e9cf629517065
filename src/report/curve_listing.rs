//! Grazing curve as data and figures, and the smallest change of parameters that grazes: fields of
//! `curve --json` and `curve --nearest --json`.

use serde::Serialize;

use super::figure::{Axis, Figure, Guide, Marker, Series, Stroke, symbol};
use super::orbit_listing::{ConditionsListing, surface_of};
use super::table::{counted, quoted};
use super::{Named, Table};
use crate::model::Scene;
use crate::numeric::Shown;
use crate::orbit::{CurveEnd, CurvePoint, GrazingCurve, Margin, SpecialKind, SpecialPoint};

/// Largest number of unresolved intervals of one function that are listed one by one.
const SEVERAL: usize = 3;

/// Grazing curve in two parameters, for the JSON document.
#[derive(Clone, Debug, Serialize)]
pub struct CurveListing {
    /// Adjusted parameters, then the parameter along which the curve was followed.
    pub free: Vec<String>,
    /// Points, in order.
    pub points: Vec<CurvePointListing>,
    /// Points where a `xi_n` vanishes.
    pub codim2: Vec<Codimension2>,
    /// Points where a parameter turns back.
    pub folds: Vec<FoldListing>,
    /// Points where multipliers change between real and complex.
    pub multiplier_switches: Vec<SwitchListing>,
    /// Intervals on which special points may have been missed.
    pub unresolved: Vec<UnresolvedListing>,
    /// End of the curve, as text.
    pub end: String,
}

/// Grazing orbit of a curve.
#[derive(Clone, Debug, Serialize)]
pub struct CurvePointListing {
    /// All parameters.
    pub parameters: Named<f64>,
    /// Full state at the graze.
    pub state: Named<f64>,
    /// `h''`.
    pub normal_acceleration: f64,
    /// Multipliers, `[re, im]`, the largest first.
    pub multipliers: Vec<[f64; 2]>,
    /// `xi_1, xi_2, ...` from the first passage to itself.
    pub xi: Vec<f64>,
    /// `xi_n` from every passage to every passage.
    pub conditions: Vec<ConditionsListing>,
    /// Whether the orbit stays on the free side of every surface.
    pub physical: bool,
    /// Deepest penetration of a surface, if the orbit is not physical.
    pub penetration: Option<PenetrationListing>,
}

/// Penetration of a surface by an orbit of the free flow.
#[derive(Clone, Debug, Serialize)]
pub struct PenetrationListing {
    /// Name of the surface.
    pub surface: String,
    /// `-h` at the deepest point.
    pub depth: f64,
}

/// Zero of `xi_n` between two passages.
#[derive(Clone, Debug, Serialize)]
pub struct Codimension2 {
    /// `n`.
    pub n: usize,
    /// Index of the passage that stretches, from 0.
    pub from: usize,
    /// Index of the passage whose gap neither opens nor closes, from 0.
    pub to: usize,
    /// Names of their surfaces.
    pub surfaces: [String; 2],
    /// All parameters.
    pub parameters: Named<f64>,
}

/// Point at which the curve turns back in a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct FoldListing {
    /// Parameter that turns.
    pub parameter: String,
    /// All parameters.
    pub parameters: Named<f64>,
}

/// Point at which multipliers change between real and complex.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchListing {
    /// All parameters.
    pub parameters: Named<f64>,
    /// Multipliers.
    pub multipliers: Vec<[f64; 2]>,
}

/// Interval on which special points of one kind may have been missed.
#[derive(Clone, Debug, Serialize)]
pub struct UnresolvedListing {
    /// Function that vanishes at the special points, as text.
    pub of: String,
    /// All parameters at the start of the interval.
    pub from: Named<f64>,
    /// All parameters at its end.
    pub to: Named<f64>,
}

impl CurveListing {
    /// Listing of a scene's curve.
    pub fn new(scene: &Scene, curve: &GrazingCurve) -> Self {
        let name = |parameter: usize| scene.model.parameters[parameter].name.clone();
        let special = |point: &SpecialPoint| {
            named(scene, point.parameters.iter().map(|value| value.to_f64()))
        };
        Self {
            free: curve.free.iter().copied().map(name).collect(),
            points: curve.points.iter().map(|point| CurvePointListing::new(scene, point)).collect(),
            codim2: curve
                .codim2()
                .map(|(n, [from, to], point)| Codimension2 {
                    n,
                    from,
                    to,
                    surfaces: [from, to].map(|passage| surface_of(scene, passage)),
                    parameters: special(point),
                })
                .collect(),
            folds: curve
                .folds()
                .map(|(parameter, point)| FoldListing {
                    parameter: name(parameter),
                    parameters: special(point),
                })
                .collect(),
            multiplier_switches: curve
                .multiplier_switches()
                .map(|point| SwitchListing {
                    parameters: special(point),
                    multipliers: point.point.multipliers.clone(),
                })
                .collect(),
            unresolved: curve
                .unresolved
                .iter()
                .map(|stretch| {
                    let [from, to] =
                        [0, 1].map(|end| named(scene, stretch.ends[end].iter().copied()));
                    UnresolvedListing { of: function(scene, stretch.kind), from, to }
                })
                .collect(),
            end: curve.end.to_string(),
        }
    }

    /// Summary of the curve in the parameters that vary, as text.
    pub fn text(&self) -> String {
        let mut text = format!("{}; {}\n", counted(self.points.len(), "point"), self.end);
        let at = |parameters: &Named<f64>| varying(parameters, &self.free);
        let several = self.points.iter().any(|point| point.conditions.len() > 1);
        for point in &self.codim2 {
            let [from, to] = &point.surfaces;
            let ends = if several {
                let (first, second) = (point.from + 1, point.to + 1);
                format!(" from passage {first} ({from}) to passage {second} ({to})")
            } else {
                String::new()
            };
            text.push_str(&format!("xi_{}{ends} = 0 at {}\n", point.n, at(&point.parameters)));
        }
        for fold in &self.folds {
            text.push_str(&format!("fold in {} at {}\n", fold.parameter, at(&fold.parameters)));
        }
        for stretch in self.penetrating() {
            text.push_str(&format!(
                "warning: {stretch}: no orbits of the oscillator with its stops\n"
            ));
        }
        for switch in &self.multiplier_switches {
            text.push_str(&format!(
                "multipliers switch between real and complex at {}\n",
                at(&switch.parameters)
            ));
        }
        for (stretches, from, to) in self.unresolved_together() {
            let on = match stretches {
                1 => String::new(),
                several => format!("on {several} stretches "),
            };
            text.push_str(&format!(
                "warning: {} may vanish more often than listed {on}between {} and {}: its zeros \
                 there cannot be told apart\n",
                from.of,
                at(&from.from),
                at(&to.to)
            ));
        }
        text
    }

    /// Unresolved intervals as (count, first, last). Intervals of one function are joined if there
    /// are more than [`SEVERAL`].
    fn unresolved_together(&self) -> Vec<(usize, &UnresolvedListing, &UnresolvedListing)> {
        let mut together: Vec<(usize, &UnresolvedListing, &UnresolvedListing)> = Vec::new();
        for stretch in &self.unresolved {
            let alike = self.unresolved.iter().filter(|other| other.of == stretch.of).count();
            let mut known = together.iter_mut().filter(|_| alike > SEVERAL);
            match known.find(|(_, first, _)| first.of == stretch.of) {
                Some((count, _, last)) => (*count, *last) = (*count + 1, stretch),
                None => together.push((1, stretch, stretch)),
            }
        }
        together
    }

    /// Penetrations along the curve, if no orbit is physical, as text.
    pub fn never_physical(&self) -> Option<String> {
        let never = !self.points.is_empty() && self.points.iter().all(|point| !point.physical);
        never.then(|| self.penetrating().join("; "))
    }

    /// Intervals of the curve on which orbits penetrate one surface, as text.
    fn penetrating(&self) -> Vec<String> {
        let surface = |point: &CurvePointListing| {
            point.penetration.as_ref().map(|penetration| penetration.surface.clone())
        };
        let stretches = self.points.chunk_by(|a, b| surface(a) == surface(b));
        let words = stretches.filter_map(|points| {
            let (first, last) = (points.first()?, points.last()?);
            let depths = points.iter().filter_map(|point| point.penetration.as_ref());
            let deepest = depths.map(|penetration| penetration.depth).fold(0.0, f64::max);
            let at = |point: &CurvePointListing| varying(&point.parameters, &self.free);
            Some(format!(
                "between {} and {} the orbit passes through `{}` by up to {deepest:.6}",
                at(first),
                at(last),
                surface(first)?,
            ))
        });
        words.collect()
    }

    /// Table of the points: parameters, state, multipliers, `xi_n`.
    pub fn table(&self) -> Table {
        let headers = self.points.first().map_or_else(Vec::new, CurvePointListing::headers);
        let table = Table::of(&self.points);
        let table = table.numbers(headers, 12, |point, place| point.numbers().get(place).copied());
        match self.points.is_empty() {
            true => table.made(),
            false => table.flag("physical", |point| point.physical).made(),
        }
    }
}

impl CurvePointListing {
    /// Names of [`numbers`](Self::numbers).
    fn headers(&self) -> Vec<String> {
        let named = self.parameters.0.iter().chain(&self.state.0).map(|(name, _)| name.clone());
        let multipliers = (1..=self.multipliers.len())
            .flat_map(|n| [format!("multiplier_{n}_re"), format!("multiplier_{n}_im")]);
        let xi = (1..=self.xi.len()).map(|n| format!("xi_{n}"));
        let others = self.other_conditions().flat_map(|pair| {
            let ends = format!("from_{}_to_{}", pair.from, pair.to);
            (1..=pair.values.len()).map(move |n| format!("xi_{n}_{ends}"))
        });
        let acceleration = ["normal_acceleration".to_owned()];
        named.chain(acceleration).chain(multipliers).chain(xi).chain(others).collect()
    }

    fn numbers(&self) -> Vec<f64> {
        let named = self.parameters.0.iter().chain(&self.state.0).map(|(_, value)| value);
        let multipliers = self.multipliers.iter().flatten();
        let others = self.other_conditions().flat_map(|pair| &pair.values);
        let numbers = named.chain([&self.normal_acceleration]).chain(multipliers);
        numbers.chain(&self.xi).chain(others).copied().collect()
    }
}

impl CurvePointListing {
    fn new(scene: &Scene, point: &CurvePoint) -> Self {
        Self {
            parameters: named(scene, point.parameters.iter().copied()),
            state: Named::new(
                scene.model.full_state_names().into_iter().zip(point.state.iter().copied()),
            ),
            normal_acceleration: point.normal_acceleration,
            multipliers: point.multipliers.clone(),
            xi: point.xi.clone(),
            conditions: point
                .conditions
                .iter()
                .map(|pair| ConditionsListing::new(scene, pair.from, pair.to, pair.values.clone()))
                .collect(),
            physical: point.is_physical(),
            penetration: point.penetration.as_ref().map(|penetration| PenetrationListing {
                surface: scene.model.surfaces[penetration.surface].name.clone(),
                depth: penetration.depth,
            }),
        }
    }

    /// Conditions except those from the first passage to itself.
    fn other_conditions(&self) -> impl Iterator<Item = &ConditionsListing> {
        self.conditions.iter().skip(1)
    }
}

/// Function whose zeros are special points of a kind, as text.
fn function(scene: &Scene, kind: SpecialKind) -> String {
    match kind {
        SpecialKind::Codimension2 { n, .. } if scene.grazing.passages.len() == 1 => {
            format!("xi_{n}")
        }
        SpecialKind::Codimension2 { n, from, to } => {
            let (first, second) = (from + 1, to + 1);
            format!("xi_{n} from passage {first} to passage {second}")
        }
        SpecialKind::Fold { parameter } => {
            format!("the slope of {}", scene.model.parameters[parameter].name)
        }
        SpecialKind::MultiplierSwitch => "the discriminant of the multipliers".to_owned(),
        SpecialKind::Nearest => "the slope of the distance".to_owned(),
    }
}

fn named(scene: &Scene, values: impl Iterator<Item = f64>) -> Named<f64> {
    Named::new(scene.model.parameters.iter().map(|parameter| parameter.name.as_str()).zip(values))
}

fn varying(parameters: &Named<f64>, names: &[String]) -> String {
    let varying = parameters.0.iter().filter(|(name, _)| names.contains(name));
    let pairs: Vec<String> =
        varying.map(|(name, value)| format!("{name} = {:.12}", Shown(*value))).collect();
    pairs.join(", ")
}

/// Figures of a curve, each with the suffix of its file name: the curve in the plane of its last
/// two parameters, solid where the orbit without the stop is stable and dashed where it is not,
/// with rings at zeros of `xi_n`; every `xi_n` along it; the zeros of `xi_n` over `n`, if there are
/// several `n`.
pub fn curve_figures(curve: &CurveListing) -> Vec<(&'static str, Figure)> {
    let [.., vertical, horizontal] = curve.free.as_slice() else { return Vec::new() };
    let mut figures = vec![
        ("", plane_figure(curve, horizontal, vertical)),
        ("-xi", condition_figure(curve, horizontal)),
    ];
    let largest = curve.codim2.iter().map(|point| point.n).max().unwrap_or(0);
    if largest > 1 {
        figures.push(("-zeros", zero_figure(curve, horizontal)));
    }
    figures
}

fn plane_figure(curve: &CurveListing, horizontal: &str, vertical: &str) -> Figure {
    let mut figure = Figure::new(axis(horizontal), axis(vertical));
    let at = |parameters: &Named<f64>| [value(parameters, horizontal), value(parameters, vertical)];
    let strokes = [("stable without the stop", true), ("unstable without the stop", false)];
    for (name, stable) in strokes {
        let stroke = if stable { Stroke::Solid } else { Stroke::Dashed };
        let mut line: Vec<[f64; 2]> = Vec::new();
        for pair in curve.points.windows(2) {
            if is_stable(&pair[0]) == stable {
                let [from, to] = [0, 1].map(|end| at(&pair[end].parameters));
                if line.last() != Some(&from) {
                    line.extend([[f64::NAN; 2], from]);
                }
                line.push(to);
            }
        }
        if !line.is_empty() {
            figure.series.push(Series::line(name, stroke, line).with_color(0));
        }
    }
    let rings: Vec<_> = curve.codim2.iter().map(|point| at(&point.parameters)).collect();
    if !rings.is_empty() {
        let largest = curve.codim2.iter().map(|point| point.n).max().unwrap_or(0);
        let name = if largest > 1 { "ξ_{n} = 0" } else { "ξ_{1} = 0" };
        figure.series.push(Series::markers(name, Marker::Ring, rings).with_color(1));
    }
    let folds = curve.folds.iter().filter(|fold| fold.parameter == horizontal);
    let crosses: Vec<_> = folds.map(|fold| at(&fold.parameters)).collect();
    if !crosses.is_empty() {
        let name = format!("fold in {}", symbol(horizontal));
        figure.series.push(Series::markers(name, Marker::Cross, crosses).in_ink());
    }
    figure
}

fn condition_figure(curve: &CurveListing, horizontal: &str) -> Figure {
    let mut figure = Figure::new(axis(horizontal), Axis::linear("ξ_{n}"));
    let count = curve.points.first().map_or(0, |point| point.xi.len());
    for n in 0..count {
        let at = |point: &CurvePointListing| [value(&point.parameters, horizontal), point.xi[n]];
        let line = curve.points.iter().map(at).collect();
        figure.series.push(Series::line(format!("ξ_{{{}}}", n + 1), Stroke::Solid, line));
    }
    figure.guides.push(Guide::Horizontal { at: 0.0, label: String::new() });
    figure
}

fn zero_figure(curve: &CurveListing, horizontal: &str) -> Figure {
    let mut figure = Figure::new(Axis::linear("n"), axis(horizontal));
    let at = |point: &Codimension2| [point.n as f64, value(&point.parameters, horizontal)];
    let dots = curve.codim2.iter().map(at).collect();
    figure.series.push(Series::markers("ξ_{n} = 0", Marker::Circle, dots));
    for switch in &curve.multiplier_switches {
        figure.guides.push(Guide::Horizontal {
            at: value(&switch.parameters, horizontal),
            label: "multipliers real or complex".to_owned(),
        });
    }
    figure
}

fn axis(parameter: &str) -> Axis {
    Axis::linear(symbol(parameter))
}

fn value(parameters: &Named<f64>, name: &str) -> f64 {
    parameters.get(name).copied().unwrap_or(f64::NAN)
}

fn is_stable(point: &CurvePointListing) -> bool {
    point.multipliers.iter().all(|[re, im]| re.hypot(*im) < 1.0)
}

/// Nearest graze of a scene, for the JSON document.
#[derive(Clone, Debug, Serialize)]
pub struct MarginListing {
    /// Euclidean norm of the changes in units of their scales; negative if the free orbit passes
    /// the stop at the scene's values.
    pub margin: f64,
    /// Stop that is grazed.
    pub surface: String,
    /// Stops whose nearest graze was not found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<String>,
    /// Parameters that change.
    pub changes: Vec<MarginParameter>,
    /// All parameters at the nearest graze.
    pub parameters: Named<f64>,
    /// Full state at the graze.
    pub state: Named<f64>,
    /// Derivative of the margin by every parameter of the model.
    pub sensitivities: Named<f64>,
    /// Whether the free orbit stays clear of the surface at the scene's values.
    pub clears: bool,
    /// Whether the distance is stationary at the graze; otherwise the graze is an end of the curve.
    pub stationary: bool,
    /// Ends of the curve that was searched; empty for one parameter.
    pub searched: Vec<MarginEnd>,
}

/// Parameter that changes.
#[derive(Clone, Debug, Serialize)]
pub struct MarginParameter {
    /// Name.
    pub parameter: String,
    /// Value in the scene.
    pub value: f64,
    /// Value at the nearest graze.
    pub nearest: f64,
    /// Difference of the two values.
    pub change: f64,
    /// Unit of changes.
    pub scale: f64,
}

/// End of the curve that was searched.
#[derive(Clone, Debug, Serialize)]
pub struct MarginEnd {
    /// Parameter along which the curve was followed.
    pub parameter: String,
    /// Value of the parameter at this end.
    pub to: f64,
    /// Reason for the end, as text.
    pub end: String,
    /// Whether no point beyond this end can be nearer.
    pub reached: bool,
}

/// Size of a state, relative to the largest, that is rounding.
const ROUNDING: f64 = 1e-28;

impl MarginListing {
    /// Listing of a scene's margin from a stop; `lost` are the stops whose nearest graze was not
    /// found.
    pub fn new(scene: &Scene, margin: &Margin, stop: usize, lost: &[usize]) -> Self {
        let surface = |stop: usize| scene.model.surfaces[stop].name.clone();
        let names = scene.model.parameter_names();
        let change = |(number, &parameter): (usize, &usize)| MarginParameter {
            parameter: names[parameter].to_owned(),
            value: scene.model.parameters[parameter].value.to_f64(),
            nearest: margin.nearest[parameter].to_f64(),
            change: margin.changes[number],
            scale: margin.scales[number],
        };
        let with = margin.parameters.get(1).map_or("", |&parameter| names[parameter]);
        let end = |(to, end): &(f64, CurveEnd)| MarginEnd {
            parameter: with.to_owned(),
            to: *to,
            end: end.to_string(),
            reached: matches!(end, CurveEnd::Reached | CurveEnd::LeftRange | CurveEnd::Closed),
        };
        let states = scene.model.full_state_names().into_iter();
        let sign = if margin.clears { 1.0 } else { -1.0 };
        // NOTE: adding 0 turns -0 into 0.
        let sensitivities = margin.sensitivities.iter().map(|slope| sign * slope + 0.0);
        Self {
            margin: sign * margin.distance,
            surface: surface(stop),
            others: lost.iter().map(|&stop| surface(stop)).collect(),
            changes: margin.parameters.iter().enumerate().map(change).collect(),
            parameters: Named::new(
                names.iter().copied().zip(margin.nearest.iter().map(|value| value.to_f64())),
            ),
            state: Named::new(states.zip(margin.state.iter().copied())),
            sensitivities: Named::new(names.iter().copied().zip(sensitivities)),
            clears: margin.clears,
            stationary: margin.stationary,
            searched: margin.range.iter().flatten().map(end).collect(),
        }
    }

    /// Table of the changes, one row per parameter that changes.
    pub fn table(&self) -> Table {
        let sensitivity = |at: &MarginParameter| self.sensitivities.get(&at.parameter).copied();
        let table = Table::of(&self.changes)
            .text("parameter", |at| &at.parameter)
            .number("value", 15, |at| at.value)
            .number("nearest", 15, |at| at.nearest)
            .number("change", 12, |at| at.change)
            .number("scale", 6, |at| at.scale)
            .number("change/scale", 12, |at| at.change / at.scale)
            .number("sensitivity", 6, sensitivity);
        table.made()
    }

    /// Margin as text.
    pub fn text(&self) -> String {
        let pairs = |named: &Named<f64>, digits: usize| -> String {
            let pairs = named.0.iter();
            let pairs = pairs.map(|(name, value)| format!("{name} = {value:.digits$e}"));
            pairs.collect::<Vec<_>>().join(", ")
        };
        let surface = &self.surface;
        let side = if self.clears { "positive: clear of" } else { "negative: beyond" };
        let mut text = format!(
            "margin {:.12e}: the smallest change that grazes, in the scales below; {side} \
             `{surface}`\n\n{}\n",
            self.margin,
            self.table().to_text()
        );
        text.push_str(&match self.clears {
            true => format!("at the scene's values the free orbit stays clear of `{surface}`\n"),
            false => {
                format!("at the scene's values the free orbit would go beyond `{surface}`\n")
            }
        });
        if !self.others.is_empty() {
            let others = quoted(&self.others);
            text.push_str(&format!("no graze of {others} was found from this orbit\n"));
        }
        text.push_str(
            "other attractors are not looked for: one that hits the stop may exist beside this \
             orbit; `basin`, and `branch` by direct simulation, find those\n",
        );
        // The velocity at a graze is 0 to the rounding of double-double.
        let largest = self.state.0.iter().fold(0.0_f64, |most, (_, value)| most.max(value.abs()));
        let shown = |value: f64| if value.abs() <= ROUNDING * largest { 0.0 } else { value };
        let state = self.state.0.iter().map(|(name, value)| (name.clone(), shown(*value)));
        text.push_str(&format!("graze at {}\n", pairs(&Named(state.collect()), 9)));
        text.push_str(&format!("margin per change of a parameter: {}\n", {
            pairs(&self.sensitivities, 5)
        }));
        if !self.stationary {
            text.push_str("note: the nearest point is an end of the curve found, not a minimum\n");
        }
        for end in &self.searched {
            let (name, to) = (&end.parameter, Shown(end.to));
            text.push_str(&match end.reached {
                true => format!("searched along the curve to {name} = {to}\n"),
                false => format!(
                    "warning: the curve may come nearer beyond {name} = {to}, where it was lost: \
                     {}\n",
                    end.end
                ),
            });
        }
        text
    }
}
