//! Loci by direct simulation: the physical parts, begun at physical orbits of the map's loci and
//! followed as far as the orbits make their contacts.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::data::{LociRequest, Locus, LocusEnd, LocusKind, LocusPoint};
use super::equations::{CodimensionTwo, LocusEquations, OrbitEquations};
use super::trace::{Trace, TracePoint, condition_of, is_stable};
use crate::analysis::continuation::{Linearised, corrected};
use crate::analysis::direct_image::DirectImage;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::periodic::{
    ContactItinerary, finite_or_one, parameter_slopes, state_jacobian, window_scales,
};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Dd, Real};
use crate::orbit::{CurveOptions, CurveOutcome, GrazingOrbit, curve};

/// Orbits of a locus of the map that are solved for by direct simulation.
const POINTS: usize = 48;
/// Depth variables, in the window's, below which none are: differences of simulated images resolve
/// them no better.
const SHALLOWEST: f64 = 1e-3;
/// Most steps beyond the map at each end, and by how much each is longer than the one before.
const STEPS: usize = 60;
const GROWTH: f64 = 1.3;
/// A step that leads nowhere is halved so often.
const HALVINGS: usize = 5;

/// A period by direct simulation in the section's coordinates and two parameters.
struct DirectEquations<'a, S: Real> {
    image: DirectImage<'a, S>,
    itinerary: &'a ContactItinerary,
    plane: [usize; 2],
    at: Vec<S>,
    /// Lengths of the coordinates and all parameters.
    scales: Vec<f64>,
    /// Range of the first parameter in its unit.
    range: [f64; 2],
}

impl<S: Real> DirectEquations<'_, S> {
    fn units(&self) -> Vec<f64> {
        let d = self.image.dimension();
        let parameters = self.plane.map(|place| self.scales[d + place]);
        self.scales[..d].iter().copied().chain(parameters).collect()
    }

    /// The first point and all parameters, in offsets.
    fn offsets(&self, unknowns: &[S]) -> (Vec<S>, Vec<S>) {
        let values = unknowns.iter().zip(self.units());
        let mut values: Vec<S> = values.map(|(&value, unit)| value * S::from_f64(unit)).collect();
        let free = values.split_off(self.image.dimension());
        let mut parameters = self.at.clone();
        for (place, value) in self.plane.into_iter().zip(free) {
            parameters[place] = value;
        }
        (values, parameters)
    }
}

impl<S: Real> OrbitEquations<S> for DirectEquations<'_, S> {
    /// The section points.
    type Extra = Vec<Vec<S>>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Vec<Vec<S>>>> {
        let (mut state, parameters) = self.offsets(unknowns);
        let (d, first) = (state.len(), state.clone());
        let mut states = Vec::new();
        let mut jacobian = DMatrix::identity(d, d + 2);
        jacobian.columns_mut(d, 2).fill(S::zero());
        for made in self.itinerary.returns() {
            let (step, by_state) =
                state_jacobian(&mut self.image, &state, &parameters, &self.scales)?;
            if step.contacts != *made || step.extra_contacts > 0 {
                return None;
            }
            let slopes = parameter_slopes(
                &mut self.image,
                &step,
                &state,
                &parameters,
                &self.plane,
                &self.scales,
            )?;
            jacobian = by_state * jacobian;
            for (column, slope) in slopes.iter().enumerate() {
                let sum = jacobian.column(d + column) + slope;
                jacobian.set_column(d + column, &sum);
            }
            states.push(std::mem::replace(&mut state, step.offsets));
        }
        let units = self.units();
        for row in 0..d {
            jacobian[(row, row)] -= S::one();
            for (column, unit) in units.iter().enumerate() {
                jacobian[(row, column)] *= S::from_f64(unit / units[row]);
            }
        }
        let closing = state.iter().zip(&first).zip(&units);
        let closing = closing.map(|((&end, &start), &unit)| (end - start) / S::from_f64(unit));
        let residual = nalgebra::DVector::from_iterator(d, closing);
        let finite = residual.iter().chain(jacobian.iter()).all(|value| value.is_finite());
        finite.then_some(Linearised { residual, jacobian, extra: states })
    }

    /// Simulation knows no depth that a contact could have: none are unknowns.
    fn depth_variables(&self) -> std::ops::Range<usize> {
        let d = self.image.dimension();
        d..d
    }

    fn coordinates(&self) -> usize {
        self.image.dimension()
    }

    fn free_depths(_: &Vec<Vec<S>>) -> Vec<S> {
        Vec::new()
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        match unknown == self.image.dimension() {
            true => self.range,
            false => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}

/// The loci of direct simulation beside those of a map.
pub(super) struct DirectLoci<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    map: &'a LocalMap,
    request: &'a LociRequest,
    exact: DirectImage<'a, Dd>,
    depths: DepthEvaluation<f64>,
}

impl<'a> DirectLoci<'a> {
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        map: &'a LocalMap,
        request: &'a LociRequest,
    ) -> Result<Self, AnalysisError> {
        Ok(Self {
            scene,
            orbit,
            map,
            request,
            exact: DirectImage::new(system, scene, orbit)?,
            depths: MapEvaluation::depths(map),
        })
    }

    fn equations<'e, S: Real>(
        &'e self,
        image: &DirectImage<'e, S>,
        itinerary: &'e ContactItinerary,
    ) -> DirectEquations<'e, S>
    where
        'a: 'e,
    {
        let scales = window_scales(&self.map.window);
        let unit = scales[self.map.dimension() + self.request.plane[0]];
        let [from, to] = self.request.range;
        DirectEquations {
            image: image.clone(),
            itinerary,
            plane: self.request.plane,
            at: self.request.at.iter().map(|&value| S::from_f64(value)).collect(),
            scales,
            range: [from.min(to) / unit, from.max(to) / unit],
        }
    }

    /// The loci next to those of the map, and the grazing curve of the orbit without contact.
    pub(super) fn beside(&self, traces: &[Trace], described: &[Locus]) -> Vec<Locus> {
        let mut found: Vec<Trace> = Vec::new();
        for (trace, locus) in traces.iter().zip(described) {
            if trace.kind == LocusKind::Graze {
                continue;
            }
            for stretch in self.stretches(trace, locus) {
                found.extend(self.solved(trace, &stretch));
            }
        }
        let mut loci = self.graze().into_iter().collect::<Vec<_>>();
        loci.extend(found.iter().filter_map(|trace| self.described(trace)));
        loci
    }

    /// The physical stretches of a locus of the map, some orbits of each in units, in order.
    fn stretches(&self, trace: &Trace, locus: &Locus) -> Vec<Vec<Vec<f64>>> {
        let unit = finite_or_one(self.map.window.depth.sqrt());
        let is_deep =
            |point: &&LocusPoint| point.depth_variables.iter().all(|&y| y >= SHALLOWEST * unit);
        let d = self.map.dimension();
        let scales = window_scales(&self.map.window);
        let unknowns = |point: &LocusPoint| -> Vec<f64> {
            let state = point.states[0].iter().zip(&scales).map(|(value, unit)| value / unit);
            let plane = self.request.plane;
            let free = plane.map(|place| point.parameters[place] / scales[d + place]);
            let angle = match trace.kind {
                LocusKind::Torus => point.multipliers.first().map(|[re, im]| im.abs().atan2(*re)),
                _ => None,
            };
            state.chain(free).chain(angle).collect()
        };
        let stretches = locus.points.chunk_by(|a, b| a.physical == b.physical);
        let stretches = stretches.filter(|stretch| stretch[0].physical).map(|stretch| {
            let deep: Vec<&LocusPoint> = stretch.iter().filter(is_deep).collect();
            let apart = deep.len().div_ceil(POINTS).max(1);
            let last = deep.len().saturating_sub(1);
            let kept = deep.into_iter().enumerate();
            let kept = kept.filter(|(place, _)| place % apart == 0 || *place == last);
            kept.map(|(_, point)| unknowns(point)).collect::<Vec<_>>()
        });
        stretches.filter(|stretch| stretch.len() > 1).collect()
    }

    /// A physical stretch solved for by direct simulation, and followed on beyond its ends.
    fn solved(&self, trace: &Trace, stretch: &[Vec<f64>]) -> Option<Trace> {
        let solve = |place: usize| {
            let (before, after) = (place.saturating_sub(1), (place + 1).min(stretch.len() - 1));
            let along = between(&stretch[before], &stretch[after]);
            let found = self.orbit_near(trace, &stretch[place], &along)?;
            // Where the map errs more than its points are apart, what is found is another orbit's.
            let is_near = length(&between(&stretch[place], &found)) < 0.5 * length(&along);
            is_near.then_some(found)
        };
        let solved: Vec<Vec<f64>> = (0..stretch.len()).into_par_iter().filter_map(solve).collect();
        let (back, on) = rayon::join(
            || self.beyond(trace, solved.iter().rev().cloned().collect()),
            || self.beyond(trace, solved.clone()),
        );
        let (back, first) = back?;
        let (on, last) = on?;
        let unknowns = back.into_iter().rev().chain(solved).chain(on);
        let points = unknowns.map(|unknowns| TracePoint {
            tangent: vec![0.0; unknowns.len()],
            unknowns,
            label: None,
        });
        Some(Trace {
            kind: trace.kind,
            itinerary: trace.itinerary.clone(),
            points: points.collect(),
            ends: [first, last],
        })
    }

    /// The orbit of a locus on the plane through a point across a direction.
    fn orbit_near(&self, trace: &Trace, at: &[f64], along: &[f64]) -> Option<Vec<f64>> {
        let equations = self.equations(&self.exact, &trace.itinerary);
        let mut equations = LocusEquations::new(equations, condition_of(trace.kind), 0);
        let [at, along] =
            [at, along].map(|values| values.iter().map(|&v| Dd::from(v)).collect::<Vec<_>>());
        let (found, _) = corrected(&mut equations, &at, &at, &along)?;
        Some(found.iter().map(|value| value.to_f64()).collect())
    }

    /// Further points of a locus after its last ones, up to the end of the first parameter's range
    /// or as far as the orbits make their contacts.
    fn beyond(&self, trace: &Trace, known: Vec<Vec<f64>>) -> Option<(Vec<Vec<f64>>, LocusEnd)> {
        let [.., before, last] = &known[..] else { return None };
        let first = self.map.dimension();
        let range = self.equations(&self.exact, &trace.itinerary).range;
        let is_within = |point: &[f64]| (range[0]..=range[1]).contains(&point[first]);
        let (mut before, mut last) = (before.clone(), last.clone());
        let (mut points, mut share) = (Vec::new(), GROWTH);
        for _ in 0..STEPS {
            let step = between(&before, &last);
            let mut found = None;
            for _ in 0..HALVINGS {
                let at: Vec<f64> =
                    last.iter().zip(&step).map(|(value, step)| value + share * step).collect();
                found = self.orbit_near(trace, &at, &step).filter(|found| {
                    // A jump is to another locus.
                    let missed = length(&between(&at, found));
                    missed < 0.5 * share * length(&step)
                });
                if found.is_some() {
                    break;
                }
                share *= 0.5;
            }
            let Some(next) = found else { return Some((points, LocusEnd::Lost)) };
            if !is_within(&next) {
                return Some((points, LocusEnd::Border));
            }
            share = GROWTH;
            points.push(next.clone());
            before = std::mem::replace(&mut last, next);
        }
        Some((points, LocusEnd::StepLimit))
    }

    fn described(&self, trace: &Trace) -> Option<Locus> {
        let points: Vec<LocusPoint> =
            trace.points.par_iter().filter_map(|point| self.point(trace, point)).collect();
        (!points.is_empty()).then(|| Locus {
            kind: trace.kind,
            itinerary: trace.itinerary.clone(),
            grazing: None,
            points,
            ends: trace.ends,
        })
    }

    fn point(&self, trace: &Trace, point: &TracePoint) -> Option<LocusPoint> {
        let mut equations = self.equations(&self.exact, &trace.itinerary);
        let d = self.map.dimension();
        let at: Vec<Dd> = point.unknowns[..d + 2].iter().map(|&value| Dd::from(value)).collect();
        let (_, parameters) = equations.offsets(&at);
        let there = equations.linearised(&at)?;
        let mut jacobian = there.jacobian.columns(0, d).into_owned();
        for place in 0..d {
            jacobian[(place, place)] += Dd::ONE;
        }
        let multipliers = eigenvalues(&jacobian).ok()?;
        let round = |values: &[Dd]| values.iter().map(|value| value.to_f64()).collect::<Vec<_>>();
        let rounded = round(&parameters);
        let (mut speeds, mut states, mut inside) = (Vec::new(), Vec::new(), true);
        for state in &there.extra {
            let image = equations.image.image(state, &parameters).ok()?;
            speeds.extend(image.passages.iter().flatten().map(|speed| speed.to_f64()));
            let state = round(state);
            let depths = self.depths.at(&state, &rounded);
            inside &= self.map.window.holds(&state, &rounded, &depths);
            states.push(state);
        }
        Some(LocusPoint {
            parameters: rounded,
            states,
            depth_variables: speeds,
            stable: is_stable(trace.kind, &multipliers, point.unknowns.last().copied()),
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            physical: true,
            inside,
            label: point.label,
        })
    }

    /// The grazing curve of the orbit without contact, where the second parameter is the one that
    /// is adjusted so that it grazes.
    fn graze(&self) -> Option<Locus> {
        let active = &self.scene.expansion.active;
        let [first, second] = self.request.plane.map(|place| active[place]);
        let asked = self.request.kinds.contains(&LocusKind::Graze);
        let is_plane = self.scene.grazing.solve_for == [second];
        if !asked || !is_plane || self.request.at.iter().any(|&offset| offset != 0.0) {
            return None;
        }
        let centre: Vec<f64> =
            active.iter().map(|&place| self.orbit.parameters()[place].to_f64()).collect();
        let [from, to] = self.request.range.map(|end| centre[self.request.plane[0]] + end);
        let periods = self.request.itineraries.iter().map(ContactItinerary::period);
        let options =
            CurveOptions { xi_count: periods.max().unwrap_or(1), ..CurveOptions::default() };
        let Ok(CurveOutcome::Traced(curve)) = curve(self.scene, first, from, to, &options) else {
            return None;
        };
        let offsets = |values: &dyn Fn(usize) -> f64| -> Vec<f64> {
            active.iter().zip(&centre).map(|(&place, centre)| values(place) - centre).collect()
        };
        let mut points: Vec<LocusPoint> = curve
            .points
            .iter()
            .map(|point| graze_point(point, offsets(&|place| point.parameters[place]), None))
            .collect();
        for (n, _, special) in curve.codim2() {
            let values = offsets(&|place| special.parameters[place].to_f64());
            let label = Some(CodimensionTwo::Xi(n));
            let along = |point: &LocusPoint| point.parameters[self.request.plane[0]];
            let special = graze_point(&special.point, values, label);
            let place = points.iter().position(|point| {
                (along(point) > along(&special)) == (to > from) && along(point) != along(&special)
            });
            points.insert(place.unwrap_or(points.len()), special);
        }
        let passages = self.map.passages();
        let itinerary = ContactItinerary::new(passages, vec![Default::default()]);
        let window = &self.map.window;
        for point in &mut points {
            point.inside = window.holds(&[] as &[f64], &point.parameters, &[]);
        }
        let ends = [LocusEnd::Border, LocusEnd::Border];
        Some(Locus { kind: LocusKind::Graze, itinerary, grazing: Some([0, 0]), points, ends })
    }
}

fn between(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| b - a).collect()
}

fn length(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// A point of the grazing curve.
fn graze_point(
    point: &crate::orbit::CurvePoint,
    parameters: Vec<f64>,
    label: Option<CodimensionTwo>,
) -> LocusPoint {
    let modulus = |[re, im]: &[f64; 2]| re.hypot(*im);
    LocusPoint {
        parameters,
        states: Vec::new(),
        depth_variables: vec![0.0],
        multipliers: point.multipliers.clone(),
        stable: point.multipliers.iter().all(|value| modulus(value) < 1.0),
        physical: point.is_physical(),
        inside: true,
        label,
    }
}
