//! All grazing passages of an orbit (by its equations, by themselves, and by the symmetry), and the
//! description of the orbit.

use nalgebra::DMatrix;

use super::free_flow::{Gaps, Minimum, gaps, watching};
use super::grazing_orbit::{
    GrazingOrbit, GrazingPoint, OrbitHit, Penetration, Touch, mirrored, with_reduced_phase,
};
use super::monodromy::{
    ConditionFactors, Stretch, full_monodromy, legs, multipliers, on_section, round, section_point,
};
use super::newton::Root;
use super::outcome::{NotLocated, OrbitError, Stop};
use super::piecewise::PiecewiseFlow;
use super::section::PoincareSection;
use super::system::ExtendedSystem;
use crate::model::{Scene, Symmetry};
use crate::numeric::{Dd, Real, converted};

/// Passages of an orbit, and the largest gap of those without an equation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Touches<S> {
    pub(super) touches: Vec<Touch<S>>,
    /// Largest `|h|` of a passage without an equation.
    pub(super) residual: f64,
}

/// Minima of one surface within this part of the period are the same.
pub(super) const SAME: f64 = 1e-6;

/// Largest number of Newton steps in time to a minimum.
const STEPS: usize = 60;

/// The passages at a root of the extended system. Passages without an equation must touch to
/// `tolerance`, relative to the range of `h`.
pub(super) fn passages<S: Real>(
    scene: &Scene,
    system: &ExtendedSystem,
    unknowns: &[S],
    tolerance: f64,
) -> Result<Touches<S>, Stop<NotLocated>> {
    let orbit = Orbit::new(scene, system, unknowns);
    let mut touches = orbit.independent()?;
    if touches.len() == system.grazes.surfaces.len() {
        let residual = 0.0;
        return Ok(Touches { touches, residual });
    }
    let gaps = orbit.gaps()?;
    orbit.extend_by_minima(&mut touches, &gaps)?;
    orbit.extend_by_mirror(&mut touches);
    orbit.checked(touches, &gaps, tolerance).map_err(Stop::Ended)
}

/// The reason, if there is one, why the grazes of a root are not in the order named.
pub(super) fn disorder(
    scene: &Scene,
    system: &ExtendedSystem,
    unknowns: &[f64],
) -> Option<NotLocated> {
    Orbit::new(scene, system, unknowns).disorder()
}

/// A periodic orbit of the free flow, starting at its first graze.
struct Orbit<'a, S> {
    scene: &'a Scene,
    system: &'a ExtendedSystem,
    state: Vec<S>,
    parameters: Vec<S>,
    times: Vec<S>,
    period: S,
}

impl<'a, S: Real> Orbit<'a, S> {
    fn new(scene: &'a Scene, system: &'a ExtendedSystem, unknowns: &[S]) -> Self {
        let period = system.period(unknowns);
        let times = system.times(unknowns).into_iter();
        Self {
            scene,
            system,
            state: with_reduced_phase(scene, unknowns[..system.dimension].to_vec()),
            parameters: system.parameters(unknowns),
            times: times.map(|time| time - (time / period).floor() * period).collect(),
            period,
        }
    }

    /// Time after which the passages repeat or mirror each other.
    fn span(&self) -> S {
        self.period * S::from_f64(self.system.grazes.share())
    }

    fn touch(&self, surface: usize, time: S) -> Result<Touch<S>, OrbitError> {
        let flown = self.system.flow.flow(&self.state, &self.parameters, time)?;
        let state = with_reduced_phase(self.scene, flown);
        Ok(Touch { surface, time, state })
    }

    /// The first passage that is not between the one before it and the end of the span.
    fn disorder(&self) -> Option<NotLocated> {
        let apart = self.period * S::from_f64(SAME);
        let end = self.span() - apart;
        let ordered = |at: &usize| {
            let earliest = at.checked_sub(1).map_or(S::zero(), |before| self.times[before] + apart);
            earliest <= self.times[*at] && self.times[*at] <= end
        };
        let at = (0..self.times.len()).find(|at| !ordered(at))?;
        let before = at.checked_sub(1).map_or(0.0, |before| self.times[before].to_f64());
        Some(NotLocated::OutOfOrder {
            passage: at + 1,
            surface: self.name(at),
            time: self.times[at].to_f64(),
            after: before,
            before: self.span().to_f64(),
        })
    }

    /// Passages with an equation, in the order named.
    fn independent(&self) -> Result<Vec<Touch<S>>, Stop<NotLocated>> {
        if let Some(reason) = self.disorder() {
            return Err(Stop::Ended(reason));
        }
        let surfaces = &self.system.grazes.surfaces;
        let named = self.times.iter().zip(surfaces);
        let touches = named.map(|(&time, &surface)| Ok(self.touch(surface, time)?));
        touches.collect()
    }

    /// Minima over a whole period.
    fn gaps(&self) -> Result<Gaps, OrbitError> {
        let (flow, period) = (watching(self.scene), self.period.to_f64());
        gaps(&flow, &converted(&self.state), &converted(&self.parameters), period)
    }

    /// Adds the passages without an equation: of the minima after the last one with an equation,
    /// those nearest to touching.
    fn extend_by_minima(
        &self,
        touches: &mut Vec<Touch<S>>,
        gaps: &Gaps,
    ) -> Result<(), Stop<NotLocated>> {
        let grazes = &self.system.grazes;
        let wanted = &grazes.surfaces[touches.len()..grazes.unmirrored()];
        let apart = SAME * self.period.to_f64();
        let from = touches.last().map_or(0.0, |last| last.time.to_f64()) + apart;
        let within = from..self.span().to_f64() - apart;
        let candidates: Vec<&Minimum> = gaps.between(within).collect();
        let cost = |minimum: &Minimum| minimum.event.abs() / gaps.largest[minimum.surface].abs();
        let chosen = in_order(wanted, &candidates, cost)
            .map_err(|missing| Stop::Ended(self.missing(touches.len() + missing)))?;
        for minimum in chosen {
            let time = self.settled(touches.len(), minimum)?;
            touches.push(self.touch(minimum.surface, time)?);
        }
        Ok(())
    }

    /// Time of a minimum, by Newton's method on `h'` along the orbit.
    fn settled(&self, passage: usize, minimum: &Minimum) -> Result<S, OrbitError> {
        let flow = &self.system.flow;
        let mut time = S::from_f64(minimum.time);
        let mut state = flow.flow(&self.state, &self.parameters, time)?;
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let local = self.system.geometry(passage).at(&state, &self.parameters);
            let step = -local.velocity() / local.acceleration();
            let size = step.magnitude();
            if size.is_nan() || size >= 0.5 * last {
                break;
            }
            last = size;
            time += step;
            state = flow.flow(&state, &self.parameters, step)?;
        }
        Ok(time)
    }

    /// Appends the mirror images.
    fn extend_by_mirror(&self, touches: &mut Vec<Touch<S>>) {
        let grazes = &self.system.grazes;
        if grazes.symmetry == Symmetry::HalfPeriod {
            let surfaces = &grazes.surfaces[touches.len()..];
            let images: Vec<Touch<S>> = touches
                .iter()
                .zip(surfaces)
                .map(|(touch, &surface)| Touch {
                    surface,
                    time: touch.time + self.span(),
                    state: mirrored(&self.scene.model, &touch.state),
                })
                .collect();
            touches.extend(images);
        }
    }

    /// The passages, if all of those without an equation touch.
    fn checked(
        &self,
        touches: Vec<Touch<S>>,
        gaps: &Gaps,
        tolerance: f64,
    ) -> Result<Touches<S>, NotLocated> {
        let mut residual = 0.0_f64;
        for (passage, touch) in touches.iter().enumerate().skip(self.times.len()) {
            let local = self.system.geometry(passage).at(&touch.state, &self.parameters);
            let (event, velocity) = (local.event().to_f64(), local.velocity().to_f64());
            let range = gaps.largest[touch.surface].abs();
            let off = event.abs().max(velocity.abs() * self.period.to_f64());
            if off.is_nan() || off > tolerance * range {
                return Err(self.apart(passage, touch, event, velocity));
            }
            residual = residual.max(event.abs());
        }
        Ok(Touches { touches, residual })
    }

    fn name(&self, passage: usize) -> String {
        let surface = self.system.grazes.surfaces[passage];
        self.scene.model.surfaces[surface].name.clone()
    }

    fn missing(&self, passage: usize) -> NotLocated {
        NotLocated::NoMinimum { passage: passage + 1, surface: self.name(passage) }
    }

    /// Reason to report for a passage without an equation that does not touch.
    fn apart(&self, passage: usize, touch: &Touch<S>, event: f64, velocity: f64) -> NotLocated {
        let (surface, time) = (self.name(passage), touch.time.to_f64());
        let unmirrored = self.system.grazes.unmirrored();
        if passage < unmirrored {
            return NotLocated::DoesNotTouch {
                passage: passage + 1,
                surface,
                time,
                event,
                adjusted: self.system.grazes.independent,
            };
        }
        NotLocated::NotMirrored {
            passage: passage + 1,
            surface,
            of: passage - unmirrored + 1,
            event,
            velocity,
        }
    }
}

/// One minimum for every wanted surface, increasing in time, of the smallest total cost; or the
/// index of the first surface without one.
pub(super) fn in_order<'a>(
    wanted: &[usize],
    minima: &[&'a Minimum],
    cost: impl Fn(&Minimum) -> f64,
) -> Result<Vec<&'a Minimum>, usize> {
    // Best choices so far, by their last minimum: total cost, and indices of the minima chosen.
    let mut ending: Vec<(f64, Vec<usize>)> = vec![(0.0, Vec::new())];
    for (number, &surface) in wanted.iter().enumerate() {
        let mut next = Vec::new();
        let mut earlier = ending.iter().peekable();
        let mut cheapest: Option<&(f64, Vec<usize>)> = None;
        for (at, minimum) in minima.iter().enumerate() {
            while let Some(choice) =
                earlier.next_if(|(_, chosen)| chosen.last().is_none_or(|&last| last < at))
            {
                if cheapest.is_none_or(|(total, _)| choice.0 < *total) {
                    cheapest = Some(choice);
                }
            }
            if let (true, Some((total, chosen))) = (minimum.surface == surface, cheapest) {
                let longer = chosen.iter().copied().chain([at]).collect();
                next.push((total + cost(minimum), longer));
            }
        }
        if next.is_empty() {
            return Err(number);
        }
        ending = next;
    }
    let best = ending.into_iter().min_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(best.map_or_else(Vec::new, |(_, chosen)| chosen.into_iter().map(|at| minima[at]).collect()))
}

/// Number of conditions `xi_n` computed between every two passages.
const XI_COUNT: usize = 6;

/// Largest `|h|` of a passage without an equation, relative to the range of `h`.
const TOUCHING: f64 = 1e-20;

/// Description of the orbit at a root, without its distance from a guess.
pub(super) fn describe(
    scene: &Scene,
    system: &ExtendedSystem,
    root: &Root,
) -> Result<GrazingOrbit, Stop<NotLocated>> {
    let found = passages(scene, system, &root.unknowns, TOUCHING)?;
    let parameters = system.parameters(&root.unknowns);
    let period = system.period(&root.unknowns);
    let touches = &found.touches;
    let passages = points(scene, system, touches, &parameters)?;
    let legs = legs(system, touches, &parameters, period)?;
    let stretches = stretches(scene, system, &passages)?;
    let factors = ConditionFactors::new(system, &stretches, touches, &legs, &parameters)?;
    let conditions = factors.conditions(XI_COUNT);
    let graze = &passages[0];
    let geometry = system.geometry(0);
    let section = graze.section.clone();
    let forced = (&scene.model, scene.grazing.periods);
    let point = section_point(forced, &system.flow, geometry, &section, graze)?;
    if let Some(surface) = system.flow.rests_at(&point, &parameters) {
        let surface = scene.model.surfaces[surface].name.clone();
        return Err(Stop::Ended(NotLocated::SectionInContact { surface }));
    }
    let monodromy = if point == graze.state {
        on_section(&round(&legs), &section, &geometry.at(&point, &parameters))
    } else {
        let there = full_monodromy(system, &point, &parameters, period)?;
        on_section(&there, &section, &geometry.at(&point, &parameters))
    };
    let others = other_minima(scene, &passages, period)?.minima;
    Ok(GrazingOrbit {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        hits: hits(scene, &system.flow, graze, period)?,
        period,
        residual: root.residual.max(found.residual),
        multipliers: multipliers(&monodromy)?,
        monodromy: rows(&monodromy),
        xi: conditions[0].values.clone(),
        conditions,
        section,
        section_point: point,
        clearance: clearance(&others),
        penetration: Penetration::deepest(scene, &others),
        other_grazes: Vec::new(),
        guess_distance: None,
        passages,
    })
}

/// Hits of an orbit in one period from its first graze.
fn hits(
    scene: &Scene,
    flow: &PiecewiseFlow,
    graze: &GrazingPoint,
    period: Dd,
) -> Result<Vec<OrbitHit>, OrbitError> {
    if !flow.hits() {
        return Ok(Vec::new());
    }
    let events = flow.events(&graze.state, &graze.parameters, period)?.into_iter();
    let hits = events.filter(|event| event.meets).map(|event| OrbitHit {
        surface: event.surface,
        state: with_reduced_phase(scene, event.state),
        speed: event.speed,
        time: event.time,
        rests: event.rests,
    });
    Ok(hits.collect())
}

fn rows(matrix: &DMatrix<Dd>) -> Vec<Vec<Dd>> {
    let rows = matrix.row_iter();
    rows.map(|row| row.iter().copied().collect()).collect()
}

/// Cause of `β` at every passage.
pub(super) fn stretches(
    scene: &Scene,
    system: &ExtendedSystem,
    passages: &[GrazingPoint],
) -> Result<Vec<Stretch>, OrbitError> {
    let stretch = |(passage, point): (usize, &GrazingPoint)| {
        let (state, parameters) = (&point.state, &point.parameters);
        let local = system.geometry(passage).at(state, parameters);
        Stretch::of(&scene.model, point.surface, &local, state, parameters)
    };
    passages.iter().enumerate().map(stretch).collect()
}

/// Grazing points at all touches.
pub(super) fn points<S: Real>(
    scene: &Scene,
    system: &ExtendedSystem,
    touches: &[Touch<S>],
    parameters: &[Dd],
) -> Result<Vec<GrazingPoint>, OrbitError> {
    let point = |(passage, touch): (usize, &Touch<S>)| {
        let state: Vec<Dd> = converted(&touch.state);
        let local = system.geometry(passage).at(&state, parameters);
        Ok(GrazingPoint {
            surface: touch.surface,
            normal_acceleration: local.acceleration(),
            time: touch.time.to_dd(),
            section: PoincareSection::of(scene, touch.surface, &state, parameters)?,
            state,
            parameters: parameters.to_vec(),
        })
    };
    touches.iter().enumerate().map(point).collect()
}

/// Lowest of the given minima of event functions.
pub(super) fn clearance(minima: &[Minimum]) -> Option<f64> {
    minima.iter().map(|minimum| minimum.event).min_by(f64::total_cmp)
}

/// Reason why the passages are not all grazes of the orbit: it touches a surface elsewhere, or it
/// is a shorter orbit traversed several times.
pub(super) fn further_graze(
    scene: &Scene,
    orbit: &GrazingOrbit,
) -> Result<Option<NotLocated>, OrbitError> {
    let others = other_minima(scene, &orbit.passages, orbit.period)?.minima;
    let graze = orbit.grazing_point();
    let start = converted(&graze.state);
    let mut touches = others.iter().filter(|minimum| minimum.event == 0.0).collect::<Vec<_>>();
    touches.sort_by(|a, b| a.time.total_cmp(&b.time));
    let name = |surface: usize| scene.model.surfaces[surface].name.clone();
    let mut repeats = touches.iter();
    if let Some(next) =
        repeats.find(|next| next.surface == graze.surface && is_same(scene, &next.state, &start))
    {
        let times = (orbit.period.to_f64() / next.time).round() as usize;
        let periods = scene.model.phase.as_ref().map(|_| scene.grazing.periods);
        let (surface, time) = (name(next.surface), next.time);
        return Ok(Some(NotLocated::Repeats { surface, time, times, periods }));
    }
    let Some(next) = touches.first() else { return Ok(None) };
    let named = orbit.passages.iter().map(|graze| (graze.time.to_f64(), graze.surface));
    let touched = touches.iter().map(|minimum| (minimum.time, minimum.surface));
    let mut passages: Vec<(f64, usize)> = named.chain(touched).collect();
    passages.sort_by(|a, b| a.0.total_cmp(&b.0));
    let passages = passages.into_iter().map(|(_, surface)| name(surface)).collect();
    let (surface, time) = (name(next.surface), next.time);
    Ok(Some(NotLocated::TouchesElsewhere { surface, time, passages }))
}

/// Whether two full states are equal to rounding, with phases modulo their period.
fn is_same(scene: &Scene, there: &[f64], here: &[f64]) -> bool {
    let states = scene.model.states.len();
    let mut pairs = there.iter().zip(here).take(states);
    let close = pairs.all(|(there, here)| (there - here).abs() <= SAME * here.abs().max(1.0));
    let Some(clock) = &scene.model.phase else { return close };
    let period = clock.period.to_f64();
    let apart = (there[states] - here[states]).rem_euclid(period);
    close && apart.min(period - apart) <= SAME * period
}

/// Minima of the event functions along an orbit, except its grazes; a touch to rounding has the
/// event 0.
pub(super) fn other_minima(
    scene: &Scene,
    passages: &[GrazingPoint],
    period: Dd,
) -> Result<Gaps, OrbitError> {
    let Some(graze) = passages.first() else {
        return Ok(Gaps { minima: Vec::new(), largest: Vec::new(), steps: 0 });
    };
    let (state, parameters) = (converted(&graze.state), converted(&graze.parameters));
    let period = period.to_f64();
    let mut gaps = gaps(&watching(scene), &state, &parameters, period)?;
    let is_graze = |minimum: &Minimum| {
        let mine = passages.iter().filter(|at| at.surface == minimum.surface);
        let apart = |at: &GrazingPoint| (at.time.to_f64() - minimum.time).rem_euclid(period);
        mine.map(apart).any(|apart| apart.min(period - apart) < SAME * period)
    };
    gaps.minima.retain(|minimum| !is_graze(minimum));
    for minimum in &mut gaps.minima {
        if minimum.event.abs() <= 1e-10 * gaps.largest[minimum.surface].abs() {
            minimum.event = 0.0;
        }
    }
    Ok(gaps)
}
