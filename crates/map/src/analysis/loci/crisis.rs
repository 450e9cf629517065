//! Crises: parameters at which an attractor touches the stable manifold of a saddle.
//!
//! One idea: the attractor lies on the closure of the unstable manifold of the saddle, so a crisis
//! is the first contact of both manifolds (`GrebogiOttYorke1983`). Near a graze the unstable
//! manifold reaches farthest at a corner, an image of the point where it first meets the graze. The
//! parameter at which an image of the corner lies on the stable manifold is found by iteration,
//! solved for as an orbit from the saddle back to it, and followed in two parameters.

use serde::{Deserialize, Serialize};

use super::connection::{Connection, Unstable, jacobian};
use super::data::{LociRequest, Locus, LocusEnd, LocusKind, LocusPoint};
use super::equations::{Condition, LocusEquations, OrbitEquations};
use super::trace::{TracedLocus, joined};
use crate::analysis::MapEvaluation;
use crate::analysis::periodic::{
    ContactItinerary, ItinerarySearch, MapOrbitEquations, MapReturns, PrescribedReturns,
};
use crate::analysis::progress::{Progress, resumed};
use crate::continuation::{CurveEquations, StepControl, searched};
use crate::expansion::LocalMap;
use crate::iteration::{
    DiscreteMap, FrozenMap, HornerMap, MapOrbit, OrbitRequest, PassageSet, Period,
};
use crate::numeric::converted;
use crate::numeric::linear::determinant;

/// Values of the first parameter at which crises are looked for, as shares of its range.
const SEEDED_AT: [f64; 3] = [0.5, 0.15, 0.85];
/// Values of the second parameter, over its window, at which manifolds are followed.
const SCANNED: usize = 161;
/// Values of the second parameter at which saddles are looked for, as shares of the window.
const LOOKED_AT: [f64; 6] = [-0.6, -0.3, -0.1, 0.1, 0.3, 0.6];
/// Points on the first piece of the unstable manifold, from which all of it is generated.
const PIECE: usize = 64;
/// Distance of that piece from the saddle, relative to the length scale of the map there.
const BESIDE: f64 = 1e-6;
/// Most periods of the saddle in an excursion.
const PERIODS: usize = 4;
/// Most returns of an orbit of the unstable manifold.
const MOST: usize = 400;
/// Largest distance of both ends of a connection from the saddle, relative to the length scale
/// there.
const NEAR: f64 = 1e-7;
/// Most returns added to a connection to come that near.
const TAIL: usize = 60;
/// Largest change of the second parameter from the scan to the solution, in half-widths.
const FOUND: f64 = 1e-4;
/// Orbits, returns of each, and distance from the crisis in half-widths of the second parameter, of
/// the test that no orbit passes the saddle on one side of the crisis.
const ORBITS: usize = 32;
const RETURNS: usize = 4000;
const BESIDE_IT: f64 = 1e-4;
/// Distances from the crisis, in those units, at which orbits are to wander, and iterates of each
/// that are dropped and kept.
const WANDERS_AT: [f64; 3] = [1e-4, 3e-5, 1e-5];
const WANDERING: [usize; 2] = [50_000, 256];
/// Resolution of the bisection in the second parameter, in half-widths.
const RESOLVED: f64 = 1e-12;
/// Largest depth that may be that of the corner, relative to the window's.
const CORNER: f64 = 1e-3;
/// Distance, in half-widths, beyond which an orbit has left for good.
const GONE: f64 = 1e3;

/// A crisis with the data for direct simulation.
#[derive(Serialize, Deserialize)]
pub(super) struct Crisis {
    pub(super) locus: Locus,
    /// Section points of the saddle at each point of the locus, in offsets.
    pub(super) saddles: Vec<Vec<Vec<f64>>>,
    /// Contacts of all returns, the saddle's first.
    pub(super) made: Vec<PassageSet>,
    /// Return and passage that graze, counted over all returns.
    pub(super) corner: Option<(usize, usize)>,
}

/// Step control along a crisis; no special points are looked for.
const STEPS: StepControl = StepControl { first: 0.05, longest: 1.0, ..StepControl::DEFAULT };

/// Crises of a map.
pub(super) struct MapCrises<'a> {
    map: &'a LocalMap,
    rounded: MapEvaluation<f64>,
    horner: HornerMap,
    search: ItinerarySearch<'a>,
    request: &'a LociRequest,
    /// Factor by which the range exceeds the window.
    wider: f64,
}

/// A saddle with one unstable direction, in units.
struct CrisisSaddle {
    /// Unknowns of its equations in the second parameter.
    unknowns: Vec<f64>,
    parameters: Vec<f64>,
    states: Vec<[f64; 2]>,
    unstable: Unstable<f64>,
    /// Magnitude of the stable multiplier.
    contraction: f64,
    /// Length scale of the map near the saddle.
    bend: f64,
}

/// Point at which an unstable manifold first meets a graze.
struct Corner {
    /// Orbit through it, starting near the saddle.
    path: Vec<[f64; 2]>,
    /// Index of the point on the orbit.
    at: usize,
    /// Coordinates across the stable manifold of the point and its images.
    across: Vec<f64>,
}

/// A section point and the depth variables of the contacts of its return.
type PointOfReturn = (Vec<f64>, Vec<f64>);

/// Contact of both manifolds near a value of the second parameter.
struct Touch {
    saddle: CrisisSaddle,
    path: Vec<[f64; 2]>,
}

impl CrisisSaddle {
    /// Distance from the saddle of the start of an orbit of the unstable manifold, at a share of
    /// the piece that generates one side.
    fn beside(&self, side: f64, share: f64) -> f64 {
        side * BESIDE * self.bend * (share * self.unstable.multiplier.ln()).exp()
    }

    /// Coordinate of a point across the stable manifold, positive on the given side.
    fn across(&self, side: f64, state: &[f64; 2]) -> f64 {
        let start = self.states[0];
        side * self.unstable.along([0, 1].map(|axis| state[axis] - start[axis]))
    }
}

impl<'a> MapCrises<'a> {
    pub(super) fn new(map: &'a LocalMap, request: &'a LociRequest) -> Self {
        Self {
            map,
            rounded: MapEvaluation::new(map),
            horner: HornerMap::new(map),
            search: ItinerarySearch::new(map),
            request,
            wider: request.wider(map.window.parameter[request.plane[0]]),
        }
    }

    /// Crises of all itineraries asked for.
    pub(super) fn all(&self, progress: &dyn Progress) -> Vec<Crisis> {
        let mut loci = Vec::new();
        progress.expect((self.request.itineraries.len() * SEEDED_AT.len()) as u64);
        for (number, itinerary) in self.request.itineraries.iter().enumerate() {
            let mut traces: Vec<(TracedLocus, Vec<PassageSet>)> = Vec::new();
            for (at, share) in SEEDED_AT.into_iter().enumerate() {
                let value = self.request.value(share);
                let (found, followed): (Vec<Crisis>, Vec<_>) =
                    resumed(progress, &[number as u64, at as u64], || {
                        let known = traces.len();
                        let touches = self.touches(itinerary, value);
                        let found = touches.iter();
                        let found = found
                            .filter_map(|touch| self.followed(itinerary, touch, &mut traces))
                            .collect();
                        (found, traces.split_off(known))
                    });
                loci.extend(found);
                traces.extend(followed);
                progress.advance(1);
            }
        }
        loci
    }

    fn returns(&self, made: Vec<PassageSet>) -> MapReturns<'_, f64> {
        let reach = [20.0, 2.0].map(|reach| reach * self.wider);
        let (window, at) = (&self.map.window, &self.request.at);
        let free = self.request.free(self.request.plane.map(|place| window.parameter[place]));
        MapReturns::new(&self.rounded, made, window, &free, at, reach)
    }

    /// Contacts of manifolds at a value of the first parameter.
    fn touches(&self, itinerary: &ContactItinerary, value: f64) -> Vec<Touch> {
        let [first, second] = self.request.plane;
        let width = self.map.window.parameter[second];
        if !width.is_finite() {
            return Vec::new();
        }
        let mut at = self.request.at.clone();
        at[first] = value;
        let window = &self.map.window;
        let reach = [20.0, 2.0];
        let mut equations =
            MapOrbitEquations::new(&self.rounded, itinerary, window, &[second], &at, reach);
        let place = |share: f64| ((share + 1.0) * 0.5 * (SCANNED - 1) as f64).round() as usize;
        let offset = |number: usize| 2.0 * number as f64 / (SCANNED - 1) as f64 - 1.0;
        let mut known: Vec<Vec<Option<CrisisSaddle>>> = Vec::new();
        for share in LOOKED_AT {
            let start = place(share);
            at[second] = offset(start) * width;
            for orbit in self.search.orbits(itinerary, &at) {
                let state = converted(&orbit.orbit.states[0]);
                let depths = converted(&orbit.depth_variables);
                let unknowns = equations.unknowns(&state, &depths, &at);
                let is_known = known.iter().any(|branch| {
                    branch[start].as_ref().is_some_and(|saddle| {
                        let mut pairs = saddle.unknowns.iter().zip(&unknowns);
                        pairs.all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs().max(1e-6))
                    })
                });
                if is_known {
                    continue;
                }
                let mut branch: Vec<Option<CrisisSaddle>> = (0..SCANNED).map(|_| None).collect();
                branch[start] = self.saddle(itinerary, &equations, unknowns);
                let up: Vec<usize> = (start + 1..SCANNED).collect();
                let down: Vec<usize> = (0..start).rev().collect();
                for way in [up, down] {
                    let mut last = start;
                    for number in way {
                        let Some(before) = &branch[last] else { break };
                        let mut next = before.unknowns.clone();
                        let held = next.len() - 1;
                        next[held] = offset(number);
                        branch[number] = self.saddle_near(itinerary, &mut equations, &next);
                        last = number;
                    }
                }
                known.push(branch);
            }
        }
        let mut touches = Vec::new();
        for branch in &known {
            for side in [1.0, -1.0] {
                touches.extend(self.scan(itinerary, &mut equations, branch, side));
            }
        }
        touches
    }

    /// Saddle at the second parameter of a nearby start.
    fn saddle_near(
        &self,
        itinerary: &ContactItinerary,
        equations: &mut MapOrbitEquations<'_, f64>,
        start: &[f64],
    ) -> Option<CrisisSaddle> {
        let (unknowns, _) = searched(equations, start, start.len() - 1)?;
        self.saddle(itinerary, equations, unknowns)
    }

    /// Saddle with the data of its manifolds; `None` if the orbit is virtual, or no saddle with a
    /// positive unstable multiplier.
    fn saddle(
        &self,
        itinerary: &ContactItinerary,
        equations: &MapOrbitEquations<'_, f64>,
        unknowns: Vec<f64>,
    ) -> Option<CrisisSaddle> {
        let there = equations.at(&unknowns)?;
        let (_, depths, parameters) = equations.offsets(&unknowns);
        let physical = depths.iter().all(|&y| y > 0.0)
            && there.extra.free.iter().all(|&(_, _, depth)| depth <= 0.0);
        if !physical {
            return None;
        }
        let made = itinerary.returns().to_vec();
        let mut returns = self.returns(made);
        let mut depths = depths.into_iter();
        let points = there.extra.states.iter().zip(itinerary.returns());
        let points: Vec<PointOfReturn> = points
            .map(|(state, made)| (state.clone(), depths.by_ref().take(made.len()).collect()))
            .collect();
        let all = returns.unknowns(&points, &parameters);
        let (mut product, mut first) = (None, 0);
        let mut bend = f64::INFINITY;
        for number in 0..returns.returns() {
            let flown = returns.at(number, first, &all)?;
            for (contact, _) in returns.depth_variables(number).iter().enumerate() {
                let y = all[first + 2 + contact];
                let row = flown.slopes.row(4 + contact);
                bend = bend.min(y * y / row[0].hypot(row[1]));
            }
            first += returns.variables(number);
            let own = jacobian(&flown, 2)?;
            product = Some(product.map_or(own.clone(), |before| own * before));
        }
        let matrix = product?;
        let unstable = Unstable::of(&matrix)?;
        let contraction = (determinant(&matrix).ok()? / unstable.multiplier).abs();
        let (units, _) = returns.units();
        let states = there.extra.states.iter().map(|state| [0, 1].map(|a| state[a] / units[a]));
        let is_saddle = unstable.multiplier > 1.0 && contraction < 1.0;
        is_saddle.then(|| CrisisSaddle {
            states: states.collect(),
            unknowns,
            parameters,
            unstable,
            contraction,
            bend: bend.min(1.0),
        })
    }

    /// Parameters along a branch of saddles at which an image of a corner lies on the stable
    /// manifold, if on one side of that parameter no orbit passes the manifold.
    fn scan(
        &self,
        itinerary: &ContactItinerary,
        equations: &mut MapOrbitEquations<'_, f64>,
        branch: &[Option<CrisisSaddle>],
        side: f64,
    ) -> Vec<Touch> {
        let corner = |saddle: &CrisisSaddle| self.corner(itinerary, saddle, side);
        let corners: Vec<Option<Corner>> =
            branch.iter().map(|saddle| corner(saddle.as_ref()?)).collect();
        let n = itinerary.period();
        let mut touches: Vec<Touch> = Vec::new();
        for number in 1..branch.len() {
            let (Some(a), Some(b)) = (&corners[number - 1], &corners[number]) else { continue };
            let (Some(first), Some(second)) = (&branch[number - 1], &branch[number]) else {
                continue;
            };
            // An attractor with as many bands as the saddle has points lies on one side of it in
            // each phase.
            let images = a.across.len().min(b.across.len());
            for later in (n - a.at % n..images).step_by(n) {
                if a.at % n != b.at % n || (a.across[later] > 0.0) == (b.across[later] > 0.0) {
                    continue;
                }
                let held = first.unknowns.len() - 1;
                let mut ends = [first.unknowns.clone(), second.unknowns.clone()];
                let mut last = None;
                while (ends[0][held] - ends[1][held]).abs() > RESOLVED {
                    let middle: Vec<f64> =
                        ends[0].iter().zip(&ends[1]).map(|(a, b)| 0.5 * (a + b)).collect();
                    let saddle = self.saddle_near(itinerary, equations, &middle);
                    let Some(saddle) = saddle else { break };
                    let Some(there) = corner(&saddle) else { break };
                    let Some(&across) = there.across.get(later) else { break };
                    let is_first = (across > 0.0) == (a.across[later] > 0.0);
                    ends[usize::from(!is_first)].clone_from(&saddle.unknowns);
                    last = Some((saddle, there));
                }
                let Some((saddle, found)) = last else { continue };
                if (ends[0][held] - ends[1][held]).abs() > RESOLVED {
                    continue;
                }
                let beside = |away: f64| {
                    let mut start = saddle.unknowns.clone();
                    start[held] += away;
                    self.saddle_near(itinerary, &mut equations.clone(), &start)
                };
                let holds = |away: f64| {
                    beside(away).is_some_and(|beside| self.holds(itinerary, &beside, side))
                };
                let [below, above] = [holds(-BESIDE_IT), holds(BESIDE_IT)];
                // Elsewhere the manifolds of the saddle touch, and no attractor is there.
                let wanders = |away: f64| {
                    let away = if above { away } else { -away };
                    beside(away).is_some_and(|beside| self.wanders(&beside, side))
                };
                if below != above && WANDERS_AT.into_iter().any(wanders) {
                    // Of contacts too close together to separate, the first is kept.
                    let at = |saddle: &CrisisSaddle| {
                        let offset = saddle.unknowns[held];
                        if above { offset } else { -offset }
                    };
                    let touch = Touch { path: found.path[..=found.at + later].to_vec(), saddle };
                    let near = |other: &Touch| {
                        (at(&other.saddle) - at(&touch.saddle)).abs() < 2.0 * BESIDE_IT
                    };
                    let known = touches.iter().position(near);
                    match known {
                        None => touches.push(touch),
                        Some(place) if at(&touches[place].saddle) < at(&touch.saddle) => {
                            touches[place] = touch;
                        }
                        Some(_) => {}
                    }
                }
            }
        }
        touches
    }

    /// Number of returns of an orbit of the unstable manifold.
    fn returns_of(&self, itinerary: &ContactItinerary, saddle: &CrisisSaddle) -> usize {
        let leaving = -BESIDE.ln() / saddle.unstable.multiplier.ln();
        let periods = leaving.ceil() as usize + PERIODS;
        (periods * itinerary.period()).min(MOST)
    }

    /// Orbit from a distance along the unstable direction, and the contacts of its returns.
    fn orbit(
        &self,
        frozen: &FrozenMap,
        saddle: &CrisisSaddle,
        length: f64,
        count: usize,
    ) -> (Vec<[f64; 2]>, Vec<PassageSet>) {
        let (unstable, start) = (&saddle.unstable, saddle.states[0]);
        let scales = &self.map.window.state;
        let mut path = vec![[0, 1].map(|axis| start[axis] + length * unstable.right[axis])];
        let mut made = Vec::new();
        for number in 0..count {
            let state = [0, 1].map(|axis| path[number][axis] * scales[axis]);
            let mut image = [f64::NAN; 2];
            let step = frozen.step(&state, &[], &mut image);
            let image = [0, 1].map(|axis| image[axis] / scales[axis]);
            if !step.valid || image.iter().any(|value| value.abs() > GONE) {
                break;
            }
            path.push(image);
            made.push(step.passages);
        }
        (path, made)
    }

    /// First corner on one side of the unstable manifold: the point at which it first meets a
    /// graze, and the coordinates of its images across the stable manifold.
    fn corner(
        &self,
        itinerary: &ContactItinerary,
        saddle: &CrisisSaddle,
        side: f64,
    ) -> Option<Corner> {
        let frozen = self.horner.freeze(&saddle.parameters);
        let count = self.returns_of(itinerary, saddle);
        let length = |share: f64| saddle.beside(side, share);
        let share = |number: usize| number as f64 / (PIECE - 1) as f64;
        let made = |share: f64, count: usize| self.orbit(&frozen, saddle, length(share), count).1;
        // An orbit that leaves the saddle meets the first graze within one more period.
        let leaving = count.saturating_sub((PERIODS - 1) * itinerary.period());
        let all: Vec<Vec<PassageSet>> =
            (0..PIECE).map(|number| made(share(number), leaving)).collect();
        let (at, number) = (0..leaving).find_map(|at| {
            let change = |number: &usize| {
                let pair = all[*number].get(at).zip(all[number + 1].get(at));
                pair.is_some_and(|(a, b)| a != b)
            };
            Some((at, (0..PIECE - 1).find(change)?))
        })?;
        let mut ends = [share(number), share(number + 1)];
        let first = all[number][at];
        loop {
            let middle = 0.5 * (ends[0] + ends[1]);
            if middle <= ends[0] || middle >= ends[1] {
                break;
            }
            let is_first = made(middle, at + 1).get(at) == Some(&first);
            ends[usize::from(!is_first)] = middle;
        }
        // The corner is taken without the contact, so that the root does not magnify errors.
        let contacts = ends.map(|end| made(end, at + 1).get(at).map_or(0, |made| made.len()));
        let without = usize::from(contacts[0] > contacts[1]);
        let (path, _) = self.orbit(&frozen, saddle, length(ends[without]), count);
        let across = path[at..].iter().map(|state| saddle.across(side, state));
        Some(Corner { at, across: across.collect(), path })
    }

    /// Whether every orbit of the unstable manifold stays on its side of the saddle, seen once per
    /// period of the saddle.
    fn holds(&self, itinerary: &ContactItinerary, saddle: &CrisisSaddle, side: f64) -> bool {
        let frozen = self.horner.freeze(&saddle.parameters);
        (0..ORBITS).all(|number| {
            let share = (number as f64 + 0.5) / ORBITS as f64;
            let (path, _) = self.orbit(&frozen, saddle, saddle.beside(side, share), RETURNS);
            let mut seen = path.iter().step_by(itinerary.period());
            path.len() > RETURNS && seen.all(|state| saddle.across(side, state) > 0.0)
        })
    }

    /// Whether an orbit of the unstable manifold settles on no periodic orbit: the manifold then
    /// lies on an attractor, or leads to one without a period.
    fn wanders(&self, saddle: &CrisisSaddle, side: f64) -> bool {
        let frozen = self.horner.freeze(&saddle.parameters);
        let (start, scales) = (saddle.states[0], &self.map.window.state);
        let length = saddle.beside(side, 0.5);
        let place =
            |axis: usize| (start[axis] + length * saddle.unstable.right[axis]) * scales[axis];
        let [dropped, kept] = WANDERING;
        let request = OrbitRequest::new(dropped, kept, scales).approaching();
        let orbit = MapOrbit::of(&frozen, &[0, 1].map(place), &[], &request);
        orbit.states().len() == kept && orbit.period == Period::NotFound && !orbit.converges
    }

    /// Solves for a contact of manifolds and follows it in both parameters; `None` if it is known.
    fn followed(
        &self,
        itinerary: &ContactItinerary,
        touch: &Touch,
        known: &mut Vec<(TracedLocus, Vec<PassageSet>)>,
    ) -> Option<Crisis> {
        let saddle = &touch.saddle;
        let (n, scales) = (itinerary.period(), &self.map.window.state);
        let offsets = |state: &[f64; 2]| [0, 1].map(|axis| state[axis] * scales[axis]).to_vec();
        // The orbit, followed by points of the saddle after its return.
        let mut states: Vec<[f64; 2]> = touch.path.clone();
        let end = states.len() - 1;
        let apart = |state: [f64; 2]| {
            (state[0] - saddle.states[0][0]).hypot(state[1] - saddle.states[0][1])
        };
        let periods = (NEAR * saddle.bend / apart(states[end])).ln() / saddle.contraction.ln();
        let periods = (periods.ceil().max(1.0) as usize).min(TAIL.div_ceil(n));
        let tail = (1..=periods * n).map(|later| saddle.states[later % n]);
        states.extend(tail);
        // The last image is the saddle's point.
        states.pop();
        let unit = self.returns(Vec::new()).units().1;
        let mut points: Vec<PointOfReturn> = Vec::new();
        let mut made: Vec<PassageSet> = Vec::new();
        let mut near: Vec<(f64, usize, usize)> = Vec::new();
        let all = saddle.states.iter().chain(&states);
        for (number, state) in all.enumerate() {
            let state = offsets(state);
            let depths = self.rounded.image(&state, &saddle.parameters).depths;
            let prescribed = match number {
                _ if number < n => Some(itinerary.returns()[number]),
                _ if number > n + end => Some(itinerary.returns()[(number - n - end) % n]),
                _ => None,
            };
            let holds = |(passage, depth): (usize, &f64)| match prescribed {
                Some(made) => made.contains(passage),
                None => *depth > 0.0,
            };
            let here: PassageSet =
                depths.iter().enumerate().filter(|&one| holds(one)).map(|(p, _)| p).collect();
            if prescribed.is_none() {
                let depths = depths.iter().enumerate();
                near.extend(depths.map(|(p, depth)| (depth.abs() / (unit * unit), number, p)));
            }
            let roots = here.iter().map(|passage| depths[passage].max(0.0).sqrt());
            points.push((state, roots.collect()));
            made.push(here);
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let corners = near.into_iter().take_while(|(depth, ..)| *depth < CORNER).take(3);
        let corners = corners.map(|(_, number, passage)| Some((number, passage)));
        for corner in corners.chain([None]) {
            let (mut points, mut made) = (points.clone(), made.clone());
            if let Some((number, passage)) = corner {
                let depths = &mut points[number].1;
                let place = made[number].iter().filter(|&other| other < passage).count();
                if made[number].contains(passage) {
                    depths[place] = 0.0;
                } else {
                    depths.insert(place, 0.0);
                    made[number].insert(passage);
                }
            }
            if let Some(locus) = self.traced(itinerary, saddle, (points, made), corner, known) {
                return locus;
            }
        }
        None
    }

    /// Locus through an approximate orbit, with or without its corner; `Some(None)` if it is known.
    fn traced(
        &self,
        itinerary: &ContactItinerary,
        saddle: &CrisisSaddle,
        (points, made): (Vec<PointOfReturn>, Vec<PassageSet>),
        corner: Option<(usize, usize)>,
        known: &mut Vec<(TracedLocus, Vec<PassageSet>)>,
    ) -> Option<Option<Crisis>> {
        let returns = self.returns(made.clone());
        let start = returns.unknowns(&points, &saddle.parameters);
        let orbits = Connection { returns, period: itinerary.period() };
        let condition = match corner {
            None => Condition::Multiplier(1.0),
            Some((number, passage)) => {
                let before: usize = made[..number].iter().map(|made| made.len()).sum();
                let own = made[number].iter().filter(|&other| other < passage).count();
                Condition::Graze(before + own)
            }
        };
        let mut locus = LocusEquations::new(orbits.clone(), condition, 0);
        let size = start.len();
        let (found, _) = searched(&mut locus, &start, size - 2)?;
        if (found[size - 1] - start[size - 1]).abs() > FOUND {
            return None;
        }
        let alike = known.iter().filter(|(_, other)| *other == made).map(|(trace, _)| trace);
        let Some((points, ends)) = joined(&mut locus, &found, alike, &STEPS) else {
            return Some(None);
        };
        let trace = TracedLocus {
            kind: LocusKind::Crisis,
            itinerary: itinerary.clone(),
            points: points.into_iter().map(|(point, _)| point).collect(),
            ends: ends.map(LocusEnd::of),
        };
        let described = self.described(&trace, orbits, &made, corner);
        known.push((trace, made));
        Some(described)
    }

    /// A crisis in offsets.
    fn described(
        &self,
        trace: &TracedLocus,
        mut orbits: Connection<MapReturns<'_, f64>>,
        made: &[PassageSet],
        corner: Option<(usize, usize)>,
    ) -> Option<Crisis> {
        let n = trace.itinerary.period();
        let grazing = corner.map(|(number, passage)| [number - n, passage]);
        let (units, depth_unit) = orbits.returns.units();
        let (units, mut points, mut saddles) = (units.to_vec(), Vec::new(), Vec::new());
        for point in &trace.points {
            let Some(there) = orbits.linearised(&point.unknowns) else { continue };
            let size = point.unknowns.len();
            let parameters = orbits.returns.parameters(&point.unknowns[size - 2..]);
            let flown = &there.extra.returns;
            let state = |point: &[f64]| -> Vec<f64> {
                point.iter().zip(&units).map(|(value, unit)| value * unit).collect()
            };
            let all = orbits.depth_variables();
            let values: Vec<f64> =
                all.iter().map(|&place| point.unknowns[place] * depth_unit).collect();
            let of_saddle: usize = made[..n].iter().map(|made| made.len()).sum();
            let contacts: Vec<usize> = (0..made.len())
                .flat_map(|number| made[number].iter().map(move |passage| (number, passage)))
                .enumerate()
                .filter(|(_, contact)| Some(*contact) != corner)
                .map(|(place, _)| place)
                .collect();
            let physical = contacts.iter().all(|&place| values[place] > 0.0)
                && flown.iter().flat_map(|one| &one.free).all(|&depth| depth <= 0.0);
            let depths: Vec<f64> = values.iter().map(|y| y * y).collect();
            let inside = flown
                .iter()
                .all(|one| self.map.window.holds(&state(&one.point), &parameters, &depths));
            saddles.push(flown[..n].iter().map(|one| state(&one.point)).collect());
            points.push(LocusPoint {
                parameters,
                states: flown[n..].iter().map(|one| state(&one.point)).collect(),
                depth_variables: values[of_saddle..].to_vec(),
                multipliers: vec![[there.extra.multiplier, 0.0]],
                stable: false,
                physical,
                inside,
                label: None,
            });
        }
        let excursion = ContactItinerary::new(trace.itinerary.passages(), made[n..].to_vec());
        let locus = Locus {
            kind: LocusKind::Crisis,
            itinerary: trace.itinerary.clone(),
            grazing,
            excursion: Some(excursion),
            points,
            ends: trace.ends,
        };
        let made = made.to_vec();
        (!locus.points.is_empty()).then_some(Crisis { locus, saddles, made, corner })
    }
}
