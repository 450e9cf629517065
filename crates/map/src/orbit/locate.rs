//! Locates the grazing orbit of a scene, from its guess or from the steady state.

use std::cell::RefCell;

use super::effort::Effort;
use super::free_flow::{Corners, Gaps, Minimum, each_step, gaps, watching};
use super::grazing_orbit::{Grazes, GrazingOrbit, Location, check_field};
use super::monodromy::orbit_multipliers;
use super::newton::NewtonFailure;
use super::outcome::{NamedValues, NotLocated, OrbitError, settled};
use super::passages::{SAME, describe, disorder, further_graze, in_order};
use super::search::{Search, clear_interval, next_minima, time_of_return};
use super::system::{ExtendedSystem, refine_either, solve_either};
use crate::model::{Scene, Section, StroboscopicPhase, Symmetry};
use crate::numeric::{Dd, converted};

/// Largest residual of an orbit called located, relative to the size of its unknowns.
const RESIDUAL: f64 = 1e-24;
/// Distance from the guess, relative to its size, within which Newton's root is accepted without a
/// further search.
const NEAR_GUESS: f64 = 0.5;
/// Largest error of a guess in the time of its graze, as a part of a forcing period.
const NEAR_GRAZE: f64 = 0.05;
/// Largest phase of the section, in periods: 16 digits are left then.
const MOST_PERIODS: f64 = 1e15;
/// Number of phases at which the model's symmetry is checked before an orbit is known.
const SYMMETRY_POINTS: usize = 8;

/// Unknowns of an extended system, or the reason why there are none.
type Found = Result<Vec<f64>, NotLocated>;

/// Locates the grazing orbit of a scene.
///
/// Newton's method on the extended system is tried from the scene's guess. If it fails or ends far
/// from the guess, or without a guess, the steady state of the free flow is shot to a periodic
/// orbit and followed in the adjusted parameter until it touches; of two orbits found, the one
/// nearer the guess is returned. With several independent grazes the first is found alone; the
/// minima along its orbit are starting points for the others. Without a phase, where Newton's
/// method fails, the cycle near the guess is followed to its nearest graze ([`clear_interval`]).
///
/// Passages without an adjusted parameter must touch to rounding, by themselves or by the symmetry.
///
/// # Errors
///
/// [`OrbitError`] for an inconsistent scene. A search that ends without an orbit is
/// [`Location::NotLocated`].
pub fn locate(scene: &Scene) -> Result<Location, OrbitError> {
    let location = located(scene)?;
    let Location::NotLocated(_) = location else { return Ok(location) };
    let along_cycle = match (&scene.model.phase, &scene.grazing.solve_for[..]) {
        (None, &[parameter]) => scene_at_graze(scene, parameter)?,
        _ => None,
    };
    match along_cycle.map(|there| located(&there)).transpose()? {
        Some(found @ Location::Located(_)) => Ok(found),
        _ => Ok(location),
    }
}

/// Locates the grazing orbit near a scene's guess, or along forced orbits.
fn located(scene: &Scene) -> Result<Location, OrbitError> {
    let locator = Locator::new(scene)?;
    let location = match locator.location() {
        Err(OrbitError::SearchTooLong) => Location::NotLocated(locator.too_slow()),
        location => location?,
    };
    locator.without_corners(location)
}

/// A scene at the nearest graze of the cycle near its guess, if it has one.
fn scene_at_graze(scene: &Scene, parameter: usize) -> Result<Option<Scene>, OrbitError> {
    let interval = match clear_interval(scene, parameter, None) {
        Ok(Ok(interval)) => interval,
        Ok(Err(_)) | Err(OrbitError::SearchTooLong) => return Ok(None),
        Err(error) => return Err(error),
    };
    Ok(interval.at_graze(scene))
}

/// The scene and its equations, shared by the stages of the search.
struct Locator<'a> {
    scene: &'a Scene,
    system: ExtendedSystem,
    effort: Effort,
    /// Values of the adjusted parameter at other grazes that the search met.
    others: RefCell<Vec<f64>>,
}

impl<'a> Locator<'a> {
    /// Checks a scene's request and sets up its equations.
    fn new(scene: &'a Scene) -> Result<Self, OrbitError> {
        let grazes = Grazes::of(scene)?;
        let guess = scene.grazing.guess.as_ref();
        let (expected, found) = (scene.model.dimension(), guess.map_or(0, Vec::len));
        if guess.is_some() && expected != found {
            return Err(OrbitError::GuessLength { expected, found });
        }
        let (base, free) = (scene.model.parameter_values(), &scene.grazing.solve_for);
        let system = ExtendedSystem::new(scene, grazes, &base, free);
        let effort = Effort::new(system.flow.field());
        let others = RefCell::default();
        let locator = Self { scene, system: system.limited(&effort), effort, others };
        locator.check_clock()?;
        locator.check_section()?;
        locator.check_symmetry()?;
        Ok(locator)
    }

    fn check_clock(&self) -> Result<(), OrbitError> {
        let state = vec![0.0; self.scene.model.dimension()];
        let geometry = self.system.geometry(0);
        match geometry.at(&state, &self.start_parameters()).clock() {
            Some((rate, _)) if !(rate > 0.0 && rate.is_finite()) => {
                Err(OrbitError::PhaseRate { rate })
            }
            _ => Ok(()),
        }
    }

    /// Checks that digits of the section's phase are left modulo its period.
    fn check_section(&self) -> Result<(), OrbitError> {
        let (Section::Stroboscopic(StroboscopicPhase::At(phase)), Some(clock)) =
            (self.scene.section, &self.scene.model.phase)
        else {
            return Ok(());
        };
        let (phase, period) = (phase.to_f64(), clock.period.to_f64());
        if phase.abs() > MOST_PERIODS * period.abs() {
            return Err(OrbitError::SectionPhase { phase, period });
        }
        Ok(())
    }

    /// Checks the requested symmetry at phases spread over the period, with the states of the
    /// guess.
    fn check_symmetry(&self) -> Result<(), OrbitError> {
        let model = &self.scene.model;
        let (Symmetry::HalfPeriod, Some(clock)) = (self.system.grazes.symmetry, &model.phase)
        else {
            return Ok(());
        };
        let start = self.start();
        let at_phase = |number: usize| {
            let share = (number as f64 + 0.5) / SYMMETRY_POINTS as f64;
            let states = start[..model.states.len()].iter().map(|&v| Dd::from(v));
            states.chain([clock.period * Dd::from(share)]).collect()
        };
        let points: Vec<Vec<Dd>> = (0..SYMMETRY_POINTS).map(at_phase).collect();
        let parameters = model.parameter_values();
        check_field(model, self.system.geometry(0), &points, &parameters)
    }

    fn start_parameters(&self) -> Vec<f64> {
        converted(&self.scene.model.parameter_values())
    }

    /// The guess, or the state of rest.
    fn start(&self) -> Vec<f64> {
        let rest = || vec![0.0; self.scene.model.dimension()];
        self.scene.grazing.guess.clone().unwrap_or_else(rest)
    }

    /// The orbit, or the reason why there is none.
    fn location(&self) -> Result<Location, OrbitError> {
        self.count_steps()?;
        match self.search()? {
            Ok(unknowns) => {
                self.effort.renew();
                self.finish(&unknowns)
            }
            // A failure that the work limit caused is no reason of its own.
            Err(_) if self.effort.is_spent() => Err(OrbitError::SearchTooLong),
            Err(reason) => Ok(Location::NotLocated(reason)),
        }
    }

    /// Searches for the unknowns of an orbit, to the roundoff of `f64`.
    fn search(&self) -> Result<Found, OrbitError> {
        let direct = match &self.scene.grazing.guess {
            Some(guess) => Some(self.direct(guess)?),
            None => None,
        };
        if let Some(Ok(unknowns)) = &direct
            && self.relative_distance(unknowns) <= NEAR_GUESS
        {
            return Ok(Ok(unknowns.clone()));
        }
        if self.scene.model.phase.is_none() {
            return direct.ok_or(OrbitError::AutonomousWithoutGuess);
        }
        let (start, values) = (self.start(), self.start_parameters());
        let others = RefCell::new(Vec::new());
        let searched = self.one_by_one(|alone, parameter| {
            let search = Search::new(self.scene, alone, parameter);
            let met = settled(search.run(&start, values[parameter]))?;
            Ok(met.map(|met| {
                others.replace(met.others);
                met.unknowns
            }))
        });
        let found = match (direct, searched) {
            (Some(Ok(unknowns)), Err(OrbitError::SearchTooLong)) => return Ok(Ok(unknowns)),
            (direct, searched) => {
                let searched = searched?;
                let found = self.better(direct, searched.clone());
                if self.system.grazes.independent == 1 && found == searched {
                    self.others.replace(others.into_inner());
                }
                found
            }
        };
        Ok(found)
    }

    /// Counts the steps of one period from the start.
    fn count_steps(&self) -> Result<(), OrbitError> {
        if self.scene.model.phase.is_none() {
            return Ok(());
        }
        let (start, parameters, period) = self.first_period();
        let (mut steps, mut flown, most) = (0, 0.0, self.effort.most_steps());
        let (flow, mut left) = (&self.system.flow, self.system.flow.most_steps());
        let whole = each_step(flow, &start, &parameters, period, &mut left, |elapsed, _, _, _| {
            (steps, flown) = (steps + 1, elapsed);
            (steps > most).then_some(())
        });
        // A flow that leaves the finite numbers from here may stay finite from another start.
        let duration = if matches!(whole, Ok(None)) { period } else { flown };
        self.effort.counted(steps, duration);
        self.effort.check()
    }

    /// Full state, parameters and period at the beginning of the search.
    fn first_period(&self) -> (Vec<f64>, Vec<f64>, f64) {
        let (start, parameters) = (self.start(), self.start_parameters());
        let period = self.system.period(&self.system.assemble(&start, 0.0, &[], &parameters));
        (start, parameters, period)
    }

    /// Reason to report when the search exceeds its work limit.
    fn too_slow(&self) -> NotLocated {
        let (_, _, period) = self.first_period();
        self.effort.too_slow(period)
    }

    /// Newton's method from the guess: all grazes at once, then one by one.
    fn direct(&self, guess: &[f64]) -> Result<Found, OrbitError> {
        let parameters = self.start_parameters();
        let start = self.start_unknowns(guess)?;
        let period = self.system.period(&start);
        let missed = NEAR_GRAZE * period / self.scene.grazing.periods as f64;
        let at_once = self.after_first(guess, period, &parameters, missed)?;
        if at_once.is_ok() || self.system.grazes.independent == 1 {
            return Ok(at_once);
        }
        self.one_by_one(|alone, _| {
            self.newton(alone, &alone.assemble(guess, period, &[], &parameters))
        })
    }

    /// Unknowns at a point near the first graze, with the times of the other grazes set to 0.
    fn start_unknowns(&self, guess: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let autonomous = self.scene.model.phase.is_none();
        let period = if autonomous { self.first_return(guess)? } else { 0.0 };
        let unknown_times = vec![0.0; self.system.grazes.independent - 1];
        let parameters = self.start_parameters();
        Ok(self.system.assemble(guess, period, &unknown_times, &parameters))
    }

    /// Finds the first graze alone in one of the parameters, then all grazes.
    fn one_by_one(
        &self,
        first: impl Fn(&ExtendedSystem, usize) -> Result<Found, OrbitError>,
    ) -> Result<Found, OrbitError> {
        let mut reason = None;
        for &parameter in &self.system.free {
            let alone = self.system.first_graze(parameter);
            let found = match first(&alone, parameter)? {
                Ok(root) if self.system.grazes.independent > 1 => {
                    let (state, period) = (&root[..alone.dimension], alone.period(&root));
                    self.after_first(state, period, &alone.parameters(&root), SAME * period)?
                }
                found => found,
            };
            match found {
                Ok(unknowns) => return Ok(Ok(unknowns)),
                Err(failure) => reason = reason.or(Some(failure)),
            }
        }
        // The locator has checked that at least one parameter is adjusted.
        reason.map(Err).ok_or(OrbitError::AdjustedParameters {
            named: 0,
            most: self.system.grazes.independent,
        })
    }

    /// Newton's method on all grazes, from a point near the first.
    fn after_first(
        &self,
        state: &[f64],
        period: f64,
        parameters: &[f64],
        missed: f64,
    ) -> Result<Found, OrbitError> {
        let times = match self.start_times(state, period, parameters, missed)? {
            Ok(times) => times,
            Err(reason) => return Ok(Err(reason)),
        };
        let start = self.system.assemble(state, period, &times, parameters);
        self.newton(&self.system, &start)
    }

    fn newton(&self, system: &ExtendedSystem, start: &[f64]) -> Result<Found, OrbitError> {
        Ok(match solve_either(system, start, 1e-9)? {
            Ok(unknowns) => {
                let degenerate = Diagnosis::new(self.scene, system, &unknowns).degeneracy();
                match degenerate.or_else(|| disorder(self.scene, system, &unknowns)) {
                    Some(reason) => Err(reason),
                    None => Ok(unknowns),
                }
            }
            Err(failure) => {
                Err(Diagnosis::new(self.scene, system, &failure.unknowns).failed(&failure))
            }
        })
    }

    /// Times of the lowest minima that follow a point near the first graze in the order named, one
    /// for each further independent graze. Minima of the first graze, or of its mirror image,
    /// within `missed` of the ends are left out.
    fn start_times(
        &self,
        state: &[f64],
        period: f64,
        parameters: &[f64],
        missed: f64,
    ) -> Result<Found, OrbitError> {
        let grazes = &self.system.grazes;
        if grazes.independent == 1 {
            return Ok(Ok(Vec::new()));
        }
        let span = period * grazes.share();
        let wanted = &grazes.surfaces[1..grazes.independent];
        let missing = |number: usize| NotLocated::NoMinimum {
            passage: number + 2,
            surface: self.scene.model.surfaces[wanted[number]].name.clone(),
        };
        let Ok(gaps) = gaps(&watching(self.scene), state, parameters, span) else {
            return Ok(Err(missing(0)));
        };
        let mirror = grazes.surfaces.get(grazes.unmirrored());
        let own = |minimum: &Minimum| {
            let near = minimum.time < missed || minimum.time > span - missed;
            near && (minimum.surface == grazes.surfaces[0] || Some(&minimum.surface) == mirror)
        };
        let candidates: Vec<&Minimum> = gaps.minima.iter().filter(|m| !own(m)).collect();
        let depth = |minimum: &Minimum| minimum.event / gaps.largest[minimum.surface].abs();
        Ok(match in_order(wanted, &candidates, depth) {
            Ok(chosen) => Ok(chosen.iter().map(|minimum| minimum.time).collect()),
            Err(number) => Err(missing(number)),
        })
    }

    /// Time after which the flow comes back to the guess, as a first estimate of the period without
    /// a clock.
    fn first_return(&self, guess: &[f64]) -> Result<f64, OrbitError> {
        let (flow, parameters) = (watching(self.scene), self.start_parameters());
        let minima = next_minima(&flow, &self.system, guess, &parameters)?;
        let times = vec![0.0; self.system.grazes.independent - 1];
        let unknowns = self.system.assemble(guess, 1.0, &times, &parameters);
        Ok(time_of_return(&minima, guess, self.system.length(&unknowns)).unwrap_or(1.0))
    }

    /// Chooses between a root of Newton's method and the outcome of a search.
    fn better(&self, direct: Option<Found>, searched: Found) -> Found {
        match (direct, searched) {
            (Some(Ok(a)), Ok(b)) => {
                Ok(if self.relative_distance(&a) <= self.relative_distance(&b) { a } else { b })
            }
            (_, Ok(unknowns)) | (Some(Ok(unknowns)), _) => Ok(unknowns),
            (
                Some(Err(
                    reason @ (NotLocated::DegenerateGraze { .. }
                    | NotLocated::Singular { .. }
                    | NotLocated::WrongSide { .. }),
                )),
                _,
            ) => Err(reason),
            (_, Err(reason)) => Err(reason),
        }
    }

    /// The location, unless the free flow has a corner at a graze or along the orbit; if no orbit
    /// was located, along one period from the start of the search.
    fn without_corners(&self, location: Location) -> Result<Location, OrbitError> {
        let Some(corners) = Corners::of(self.scene, &[]) else {
            return Ok(location);
        };
        let met = match &location {
            Location::Located(orbit) => {
                let passages = orbit.passages.iter();
                let grazes: Vec<(usize, Vec<f64>)> =
                    passages.map(|graze| (graze.surface, converted(&graze.state))).collect();
                corners.of_orbit(&grazes, &converted(orbit.parameters()), orbit.period.to_f64())?
            }
            // A flow that cannot be followed shows no corner; the known reason stands.
            Location::NotLocated(_) => self.corner_from_start(&corners).unwrap_or(None),
        };
        Ok(met.map_or(location, Location::NotLocated))
    }

    fn corner_from_start(&self, corners: &Corners) -> Result<Option<NotLocated>, OrbitError> {
        let start = self.start();
        let period = self.system.period(&self.start_unknowns(&start)?);
        let point = (self.system.grazes.surfaces[0], start);
        corners.of_orbit(&[point], &self.start_parameters(), period)
    }

    /// Distance from the guess in state and adjusted parameters, relative to the size of each.
    fn relative_distance(&self, unknowns: &[f64]) -> f64 {
        let (start, found) = (self.start_parameters(), self.system.parameters(unknowns));
        let guess = self.scene.grazing.guess.iter().flatten();
        let size = guess.map(|value| value * value).sum::<f64>().sqrt().max(1.0);
        let state = self.guess_distance(unknowns).unwrap_or(0.0) / size;
        let moved = self.system.free.iter();
        let moved = moved.map(|&at| (found[at] - start[at]).abs() / start[at].abs().max(0.1));
        moved.fold(state, f64::hypot)
    }

    /// Distance of a full state from the guess, with the phase taken modulo its period.
    fn guess_distance(&self, unknowns: &[f64]) -> Option<f64> {
        let guess = self.scene.grazing.guess.as_ref()?;
        let states = self.scene.model.states.len();
        let mut square: f64 =
            guess.iter().zip(unknowns).take(states).map(|(a, b)| (a - b).powi(2)).sum();
        if let Some(phase) = &self.scene.model.phase {
            let period = phase.period.to_f64();
            let difference = (unknowns[states] - guess[states]).rem_euclid(period);
            square += difference.min(period - difference).powi(2);
        }
        Some(square.sqrt())
    }

    /// Refines a root to the roundoff of double-double and describes the orbit.
    fn finish(&self, unknowns: &[f64]) -> Result<Location, OrbitError> {
        if let Some(reason) = Diagnosis::new(self.scene, &self.system, unknowns).degeneracy() {
            return Ok(Location::NotLocated(reason));
        }
        let root = match refine_either(&self.system, unknowns, RESIDUAL)? {
            Ok(root) => root,
            Err(failure) => {
                let diagnosis = Diagnosis::new(self.scene, &self.system, &failure.unknowns);
                return Ok(Location::NotLocated(diagnosis.failed(&failure)));
            }
        };
        self.effort.renew();
        let mut orbit = match settled(describe(self.scene, &self.system, &root))? {
            Ok(orbit) => orbit,
            Err(reason) => return Ok(Location::NotLocated(reason)),
        };
        if let Some(reason) = further_graze(self.scene, &orbit)? {
            return Ok(Location::NotLocated(reason));
        }
        if let Some(reason) = orbit.other_hits(self.scene) {
            return Ok(Location::NotLocated(reason));
        }
        self.check_symmetry_of(&orbit)?;
        orbit.other_grazes = self.others.take();
        orbit.guess_distance = self.guess_distance(&converted(&root.unknowns));
        Ok(Location::Located(Box::new(orbit)))
    }

    /// Checks the requested symmetry at the grazes and the section point of an orbit.
    fn check_symmetry_of(&self, orbit: &GrazingOrbit) -> Result<(), OrbitError> {
        if self.system.grazes.symmetry == Symmetry::None {
            return Ok(());
        }
        let grazes = orbit.passages.iter().map(|graze| graze.state.clone());
        let points: Vec<_> = grazes.chain([orbit.section_point.clone()]).collect();
        let (model, geometry) = (&self.scene.model, self.system.geometry(0));
        check_field(model, geometry, &points, orbit.parameters())
    }
}

/// A graze is degenerate if `h'' T² / max h` is below this.
const DEGENERATE: f64 = 1e-6;
/// Bound on `h'' T² / max h` after Newton's method has stalled, which it does near a degenerate
/// graze.
const NEARLY_DEGENERATE: f64 = 1e-2;

/// Examination of the unknowns of a system.
struct Diagnosis<'a> {
    scene: &'a Scene,
    system: &'a ExtendedSystem,
    unknowns: &'a [f64],
    parameters: Vec<f64>,
}

impl<'a> Diagnosis<'a> {
    /// Prepares the examination of unknowns of a system.
    pub(super) fn new(scene: &'a Scene, system: &'a ExtendedSystem, unknowns: &'a [f64]) -> Self {
        Self { scene, system, unknowns, parameters: system.parameters(unknowns) }
    }

    /// Reason why a root is not an orbit of simple grazes, if it is not.
    fn degeneracy(&self) -> Option<NotLocated> {
        self.degenerate_below(DEGENERATE)
    }

    /// Reason why Newton's method failed at these unknowns.
    pub(super) fn failed(&self, failure: &NewtonFailure) -> NotLocated {
        let last = failure.history.last().copied().unwrap_or(f64::NAN);
        if last < 1e-4
            && let Some(reason) = self.degenerate_below(NEARLY_DEGENERATE)
        {
            return reason;
        }
        let at = self.adjusted();
        if let Some(condition) = failure.singular {
            let [re, im] = self.multiplier_nearest_one();
            return NotLocated::Singular { at, condition, re, im };
        }
        NotLocated::NotConverged {
            at,
            first: failure.history.first().copied().unwrap_or(f64::NAN),
            last,
            history: failure.history.clone(),
        }
    }

    /// Names and values of the adjusted parameters.
    pub(super) fn adjusted(&self) -> NamedValues {
        let named = self.system.free.iter().map(|&parameter| {
            let name = self.scene.model.parameters[parameter].name.clone();
            (name, self.parameters[parameter])
        });
        NamedValues(named.collect())
    }

    /// The first degenerate graze: `h'' T² / max h` is below `bound`.
    fn degenerate_below(&self, bound: f64) -> Option<NotLocated> {
        let start = &self.unknowns[..self.system.dimension];
        let period = self.system.period(self.unknowns);
        let flow = watching(self.scene);
        let gaps = gaps(&flow, start, &self.parameters, period);
        let beyond = gaps.as_ref().ok().and_then(Gaps::beyond);
        let largest = gaps.as_ref().map(|gaps| &gaps.largest);
        let times = self.system.times(self.unknowns);
        times.into_iter().enumerate().find_map(|(passage, time)| {
            let there = self.system.flow.flow(start, &self.parameters, time);
            let geometry = self.system.geometry(passage);
            let normal_acceleration = there
                .map_or(f64::NAN, |state| geometry.at(&state, &self.parameters).acceleration());
            let surface = self.system.grazes.surfaces[passage];
            let range = largest.as_ref().map_or(1.0, |largest| largest[surface]);
            let relative =
                normal_acceleration * period * period / range.abs().max(f64::MIN_POSITIVE);
            (relative.is_nan() || relative < bound).then(|| match beyond {
                Some(beyond) => self.wrong_side(beyond),
                None => NotLocated::DegenerateGraze {
                    surface: self.scene.model.surfaces[surface].name.clone(),
                    at: self.adjusted(),
                    normal_acceleration,
                    relative,
                },
            })
        })
    }

    /// Reason to refuse an orbit that lies wholly beyond a surface.
    fn wrong_side(&self, (surface, largest): (usize, f64)) -> NotLocated {
        let surface = self.scene.model.surfaces[surface].name.clone();
        NotLocated::WrongSide { surface, at: self.adjusted(), largest }
    }

    fn multiplier_nearest_one(&self) -> [f64; 2] {
        let state = &self.unknowns[..self.system.dimension];
        let period = self.system.period(self.unknowns);
        let found = orbit_multipliers(self.system, state, &self.parameters, period);
        let distance = |value: &[f64; 2]| (value[0] - 1.0).hypot(value[1]);
        found
            .unwrap_or_default()
            .into_iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or([f64::NAN; 2])
    }
}
