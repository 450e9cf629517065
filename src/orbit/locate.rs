//! The grazing orbit of a scene: from its guess, or from the steady state.

use crate::model::{Scene, Symmetry};

use super::OrbitError;
use super::describe::describe;
use super::minima::{gaps, watching_field};
use super::monodromy::{full_monodromy, multipliers};
use super::newton::{NewtonFailure, Solve};
use super::outcome::{Location, NotLocated};
use super::search::Search;
use super::system::{ExtendedSystem, refine_either, solve_either};

/// Largest residual of an orbit called located, relative to the size of its state.
const RESIDUAL: f64 = 1e-24;
/// `h'' T² / max h` below which a graze is not simple.
const DEGENERATE: f64 = 1e-6;
/// The same where Newton's method has stalled, which it does near a degenerate graze.
const NEARLY_DEGENERATE: f64 = 1e-2;
/// Distance from the guess, relative to its size, within which Newton's root is taken without looking further.
const NEAR_GUESS: f64 = 0.5;

/// Locates the grazing orbit of a scene.
///
/// From the scene's guess Newton's method is tried on the extended system at once. Where that fails or ends far from
/// the guess, or where there is no guess, the steady state of the free flow is shot to a periodic orbit and followed in
/// the adjusted parameter until it touches; of two orbits found the one nearer the guess is taken.
///
/// # Errors
///
/// [`OrbitError`] for a scene that asks for what is not supported or contradicts itself. A search that ends without
/// an orbit is [`Location::NotLocated`].
pub fn locate(scene: &Scene) -> Result<Location, OrbitError> {
    let locator = Locator::new(scene)?;
    match locator.search()? {
        Ok(unknowns) => locator.finish(&unknowns),
        Err(reason) => Ok(Location::NotLocated(reason)),
    }
}

/// What the stages of a location share.
pub(super) struct Locator<'a> {
    pub(super) scene: &'a Scene,
    pub(super) surface: usize,
    pub(super) parameter: usize,
    pub(super) system: ExtendedSystem,
}

impl<'a> Locator<'a> {
    /// Checks what a scene asks for and sets up its equations.
    pub(super) fn new(scene: &'a Scene) -> Result<Self, OrbitError> {
        let grazing = &scene.grazing;
        let &[surface] = grazing.passages.as_slice() else {
            return Err(OrbitError::SeveralPassages {
                passages: grazing.passages.len(),
            });
        };
        let &[parameter] = grazing.solve_for.as_slice() else {
            return Err(OrbitError::AdjustedParameters {
                named: grazing.solve_for.len(),
            });
        };
        if grazing.symmetry == Symmetry::HalfPeriod {
            return Err(OrbitError::HalfPeriodSymmetry);
        }
        let (expected, found) = (
            scene.model.dimension(),
            grazing.guess.as_ref().map_or(0, Vec::len),
        );
        if grazing.guess.is_some() && expected != found {
            return Err(OrbitError::GuessLength { expected, found });
        }
        let system = ExtendedSystem::new(
            scene,
            surface,
            &scene.model.parameter_values(),
            &[parameter],
        );
        let locator = Self {
            scene,
            surface,
            parameter,
            system,
        };
        locator.check_clock()?;
        Ok(locator)
    }

    fn check_clock(&self) -> Result<(), OrbitError> {
        let state = vec![0.0; self.scene.model.dimension()];
        match self
            .system
            .geometry
            .at(&state, &self.start_parameters())
            .clock()
        {
            Some((rate, _)) if !(rate > 0.0 && rate.is_finite()) => {
                Err(OrbitError::PhaseRate { rate })
            }
            _ => Ok(()),
        }
    }

    fn start_parameters(&self) -> Vec<f64> {
        self.scene
            .model
            .parameter_values()
            .iter()
            .map(|value| value.to_f64())
            .collect()
    }

    /// Unknowns of a graze to the roundoff of `f64`.
    fn search(&self) -> Result<Result<Vec<f64>, NotLocated>, OrbitError> {
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
        let rest = vec![0.0; self.scene.model.dimension()];
        let start = self.scene.grazing.guess.as_ref().unwrap_or(&rest);
        let value = self.start_parameters()[self.parameter];
        let searched = Search::new(self.scene, &self.system, self.surface, self.parameter)
            .run(start, value)?;
        Ok(self.better(direct, searched))
    }

    /// Newton on the extended system from the guess.
    fn direct(&self, guess: &[f64]) -> Result<Result<Vec<f64>, NotLocated>, OrbitError> {
        let period = if self.scene.model.phase.is_none() {
            self.first_return(guess)?
        } else {
            0.0
        };
        let start = self
            .system
            .assemble(guess, period, &self.start_parameters());
        match solve_either(&self.system, &start, 1e-9)? {
            Solve::Root(unknowns) => Ok(match self.degeneracy(&unknowns) {
                Some(reason) => Err(reason),
                None => Ok(unknowns),
            }),
            Solve::Failed(failure) => Ok(Err(self.failed(failure))),
        }
    }

    /// Time from the guess to the next minimum of the event function: the period's guess without a clock.
    fn first_return(&self, guess: &[f64]) -> Result<f64, OrbitError> {
        let (field, parameters) = (watching_field(&self.scene.model), self.start_parameters());
        let mut horizon = 1.0;
        while horizon < 1e5 {
            let mut minima = gaps(&field, guess, &parameters, horizon)?
                .minima
                .into_iter();
            if let Some(next) = minima.find(|m| m.surface == self.surface && m.time > 0.1 * horizon)
            {
                return Ok(next.time);
            }
            horizon *= 2.0;
        }
        Ok(1.0)
    }

    /// Of a root of Newton's method and the outcome of a search, the one to go on with.
    fn better(
        &self,
        direct: Option<Result<Vec<f64>, NotLocated>>,
        searched: Result<Vec<f64>, NotLocated>,
    ) -> Result<Vec<f64>, NotLocated> {
        match (direct, searched) {
            (Some(Ok(a)), Ok(b)) => Ok(
                if self.relative_distance(&a) <= self.relative_distance(&b) {
                    a
                } else {
                    b
                },
            ),
            (_, Ok(unknowns)) | (Some(Ok(unknowns)), _) => Ok(unknowns),
            (
                Some(Err(
                    reason @ (NotLocated::DegenerateGraze { .. } | NotLocated::Singular { .. }),
                )),
                _,
            ) => Err(reason),
            (_, Err(reason)) => Err(reason),
        }
    }

    /// Distance from the guess in state and adjusted parameter, relative to the guess's size.
    fn relative_distance(&self, unknowns: &[f64]) -> f64 {
        let start = self.start_parameters()[self.parameter];
        let guess = self.scene.grazing.guess.iter().flatten();
        let size = guess
            .map(|value| value * value)
            .sum::<f64>()
            .sqrt()
            .max(1.0);
        let state = self.guess_distance(unknowns).unwrap_or(0.0) / size;
        let parameter =
            (self.system.parameters(unknowns)[self.parameter] - start).abs() / start.abs().max(0.1);
        state.hypot(parameter)
    }

    /// Distance of a full state from the guess, the phase modulo its period.
    fn guess_distance(&self, unknowns: &[f64]) -> Option<f64> {
        let guess = self.scene.grazing.guess.as_ref()?;
        let states = self.scene.model.states.len();
        let mut square: f64 = guess
            .iter()
            .zip(unknowns)
            .take(states)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        if let Some(phase) = &self.scene.model.phase {
            let period = phase.period.to_f64();
            let difference = (unknowns[states] - guess[states]).rem_euclid(period);
            square += difference.min(period - difference).powi(2);
        }
        Some(square.sqrt())
    }

    /// Why a root is not a simple graze.
    fn degeneracy(&self, unknowns: &[f64]) -> Option<NotLocated> {
        self.degenerate_below(unknowns, DEGENERATE)
    }

    /// A degenerate graze, `h'' T² / max h` being below a bound.
    fn degenerate_below(&self, unknowns: &[f64], bound: f64) -> Option<NotLocated> {
        let parameters = self.system.parameters(unknowns);
        let state = &unknowns[..self.system.dimension()];
        let normal_acceleration = self.system.geometry.at(state, &parameters).acceleration();
        let period = self.system.period(unknowns);
        let field = watching_field(&self.scene.model);
        let largest =
            gaps(&field, state, &parameters, period).map_or(1.0, |gaps| gaps.largest[self.surface]);
        let relative = normal_acceleration * period * period / largest.abs().max(f64::MIN_POSITIVE);
        (relative.is_nan() || relative < bound).then(|| NotLocated::DegenerateGraze {
            parameter: self.name(),
            value: parameters[self.parameter],
            normal_acceleration,
            relative,
        })
    }

    /// Why Newton's method failed.
    fn failed(&self, failure: NewtonFailure) -> NotLocated {
        let value = self.system.parameters(&failure.unknowns)[self.parameter];
        let last = failure.history.last().copied().unwrap_or(f64::NAN);
        if last < 1e-4
            && let Some(reason) = self.degenerate_below(&failure.unknowns, NEARLY_DEGENERATE)
        {
            return reason;
        }
        match failure.singular {
            Some(condition) => {
                let [re, im] = self.multiplier_nearest_one(&failure.unknowns);
                NotLocated::Singular {
                    parameter: self.name(),
                    value,
                    condition,
                    re,
                    im,
                }
            }
            None => {
                let first = failure.history.first().copied().unwrap_or(f64::NAN);
                NotLocated::NotConverged {
                    parameter: self.name(),
                    value,
                    first,
                    last,
                    history: failure.history,
                }
            }
        }
    }

    fn multiplier_nearest_one(&self, unknowns: &[f64]) -> [f64; 2] {
        let (state, parameters) = (
            &unknowns[..self.system.dimension()],
            self.system.parameters(unknowns),
        );
        let states = self.scene.model.states.len();
        let block = full_monodromy(
            &self.system.field,
            state,
            &parameters,
            self.system.period(unknowns),
        )
        .map(|rows| {
            rows[..states]
                .iter()
                .map(|row| row[..states].to_vec())
                .collect::<Vec<_>>()
        });
        let found = block.map_or_else(|_| Vec::new(), |block| multipliers(&block));
        let distance = |value: &[f64; 2]| (value[0] - 1.0).hypot(value[1]);
        found
            .into_iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or([f64::NAN; 2])
    }

    fn name(&self) -> String {
        self.scene.model.parameters[self.parameter].name.clone()
    }

    /// Refines a root to the roundoff of double-double and describes the orbit.
    fn finish(&self, unknowns: &[f64]) -> Result<Location, OrbitError> {
        if let Some(reason) = self.degeneracy(unknowns) {
            return Ok(Location::NotLocated(reason));
        }
        let size = unknowns
            .iter()
            .fold(1.0_f64, |size, value| size.max(value.abs()));
        match refine_either(&self.system, unknowns, RESIDUAL * size)? {
            Solve::Root(root) => {
                let rounded: Vec<f64> = root.unknowns.iter().map(|value| value.to_f64()).collect();
                let mut orbit = describe(self.scene, self.surface, &self.system, &root)?;
                orbit.guess_distance = self.guess_distance(&rounded);
                Ok(Location::Located(Box::new(orbit)))
            }
            Solve::Failed(failure) => Ok(Location::NotLocated(self.failed(failure))),
        }
    }
}
