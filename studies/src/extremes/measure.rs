//! Measurement of a case: the scene is located and expanded, and map and estimates are compared
//! with a reference.

use super::cases::{ExtremeCase, FLAT_TOP};
use super::closed_form::{LinearOscillator, grazing_force};
use super::data::{Coefficients, ExtremeOutcome, ExtremeRow, Measured};
use grazemap::analysis::{AnalysisError, DirectEnd, DirectImage, FreeFlight, MapEvaluation};
use grazemap::convergence::cut_legs;
use grazemap::expansion::{Contact, Expander, ExpansionError, Leg, Legs, RADIUS_ORDER, WindowEdge};
use grazemap::hybrid::HybridSystem;
use grazemap::jet::Jet;
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::{Dd, Real, Scalar};
use grazemap::orbit::{GrazingOrbit, locate};

/// Scene with two harmonics, whose graze can be made flat.
const FLAT_TOP_SCENE: &str = include_str!("flat_top.toml");

/// Digits of double-double, the most that are reported.
const MOST_DIGITS: f64 = 32.0;

/// Reason why a case has no map: the stage and the message.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
struct Refusal {
    stage: &'static str,
    message: String,
}

impl From<ExpansionError> for Refusal {
    fn from(error: ExpansionError) -> Self {
        refusal("expansion", error)
    }
}

impl From<AnalysisError> for Refusal {
    fn from(error: AnalysisError) -> Self {
        refusal("simulation", error)
    }
}

fn refusal(stage: &'static str, message: impl ToString) -> Refusal {
    let message = message.to_string();
    Refusal { stage, message }
}

/// Measures one case.
pub fn measure_extreme(case: &ExtremeCase) -> ExtremeRow {
    let outcome = match measured(case) {
        Ok(measured) => ExtremeOutcome::Measured(measured),
        Err(Refusal { stage, message }) => {
            ExtremeOutcome::Refused { stage: stage.to_owned(), message }
        }
    };
    ExtremeRow {
        axis: case.axis,
        value: case.value,
        scene: case.scene.to_owned(),
        orders: case.orders,
        depth: case.depth,
        coefficients: case.coefficients,
        outcome,
    }
}

fn measured(case: &ExtremeCase) -> Result<Measured, Refusal> {
    let scene = scene(case)?;
    let orbit = locate(&scene).map_err(|error| refusal("orbit", error))?;
    let orbit = orbit.into_result().map_err(|error| refusal("orbit", error))?;
    let located = LocatedCase {
        case,
        scene: &scene,
        orbit: &orbit,
        system: HybridSystem::new(&scene.model),
        expander: Expander::new(&scene, &orbit)?,
    };
    match case.coefficients {
        Coefficients::Single => {
            let parts = located.double()?;
            located.measure(rounded_to_single(&parts))
        }
        Coefficients::Double => located.measure(located.double()?),
        Coefficients::DoubleDouble => located.measure(located.double_double()?),
    }
}

fn scene(case: &ExtremeCase) -> Result<Scene, Refusal> {
    let text = match case.scene {
        FLAT_TOP => Some(FLAT_TOP_SCENE),
        name => catalogue::text(name),
    };
    let text = text.ok_or_else(|| refusal("scene", format!("no scene `{}`", case.scene)))?;
    let file = format!("{}.toml", case.scene);
    Scene::parse_with(text, &file, &case.overrides).map_err(|error| refusal("scene", error))
}

/// A case with its orbit.
struct LocatedCase<'a> {
    case: &'a ExtremeCase,
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    system: HybridSystem,
    expander: Expander<'a>,
}

/// Factors of a map.
struct Parts<S: Real> {
    legs: Legs<S>,
    contact: Contact<S>,
}

impl LocatedCase<'_> {
    fn double(&self) -> Result<Parts<f64>, Refusal> {
        Ok(Parts {
            legs: self.expander.legs(self.case.orders.smooth_order)?,
            contact: self.expander.contact(0, self.case.orders.contact_weight)?,
        })
    }

    fn double_double(&self) -> Result<Parts<Dd>, Refusal> {
        Ok(Parts {
            legs: self.expander.legs_by_taylor(self.case.orders.smooth_order)?,
            contact: self.expander.contact_in(0, self.case.orders.contact_weight)?,
        })
    }

    fn measure<S: Real>(&self, parts: Parts<S>) -> Result<Measured, Refusal> {
        let lost = self.expander.lost_digits(self.case.orders)?;
        let digits = |lost: &[f64]| self.digits_kept() - lost.iter().copied().fold(0.0, f64::max);
        let contact_truth = self.contact_truth()?;
        let whole = self.whole_map(&parts)?;
        Ok(Measured {
            grazing: self.grazing(),
            contact: self.contact(parts.contact, &contact_truth.correction)?,
            contact_truth: contact_truth.digits,
            map: whole.digits,
            map_truth: whole.truth,
            truncation: self.truncation()?,
            rounding: digits(&lost.discontinuity),
            leg_rounding: digits(&lost.smooth) - whole.over_kick,
            leg_truncation: whole.last_degree,
        })
    }

    /// Digits of the number format of the coefficients.
    fn digits_kept(&self) -> f64 {
        -match self.case.coefficients {
            Coefficients::Single => f64::from(0.5 * f32::EPSILON).log10(),
            Coefficients::Double => f64::ROUNDOFF.log10(),
            Coefficients::DoubleDouble => Dd::ROUNDOFF.log10(),
        }
    }

    /// Section point: beyond the stop by the depth, all other offsets zero.
    fn point<S: Real>(&self) -> (Vec<S>, Vec<S>) {
        let variables = self.expander.variables();
        let mut state = vec![S::zero(); variables.coordinates];
        // NOTE: every scene of the study has a stop `length - position`: on its tangency section
        // the depth is the first offset.
        state[0] = S::from_f64(self.case.depth);
        (state, vec![S::zero(); variables.len() - variables.coordinates])
    }

    /// Digits of the grazing parameter, if there is a closed form.
    fn grazing(&self) -> Option<f64> {
        let place = |name| self.scene.model.parameters.iter().position(|p| p.name == name);
        let exact = match self.case.scene {
            "linear" => grazing_force(self.scene)?,
            // NOTE: at a ratio below 0 the top has split in two, and the orbit grazes elsewhere.
            FLAT_TOP if self.case.value < 0.0 => return None,
            FLAT_TOP => {
                self.orbit.parameters()[place("delta")?] - self.orbit.parameters()[place("b")?]
            }
            _ => return None,
        };
        let found = self.orbit.parameters()[place("alpha")?];
        Some(digits_of((found - exact).magnitude(), exact.magnitude()))
    }

    /// Digits left by the truncation of the contact at the depth; 0 beyond the radius of its
    /// series.
    fn truncation(&self) -> Result<f64, Refusal> {
        let series = self.expander.depth_series(0, RADIUS_ORDER)?;
        let depth = self.case.depth;
        let edge = WindowEdge::new(&series, depth, self.case.orders.contact_weight);
        Ok(match edge {
            Some(edge) if depth >= edge.radius * edge.radius => 0.0,
            Some(edge) => digits_of(edge.omitted_share, 1.0).clamp(0.0, MOST_DIGITS),
            None => MOST_DIGITS,
        })
    }

    /// Fewest digits of the corrections that begin with the lowest power of `y`.
    fn contact<S: Real>(&self, contact: Contact<S>, exact: &[Dd]) -> Result<f64, Refusal> {
        let (state, parameters) = self.point::<S>();
        let image = MapEvaluation::contact(contact).image(&state, &parameters);
        let laws = self.expander.leading_laws(0)?;
        let exponents: Vec<_> = laws.iter().map(|law| law.map(|law| law.exponent)).collect();
        let leading = exponents.iter().flatten().copied().reduce(f64::min);
        let corrections = image.offsets.iter().zip(&state);
        let found = corrections.map(|(&image, &start)| image.to_dd() - start.to_dd());
        let compared = found.zip(exact).zip(&exponents);
        let compared = compared.filter(|(_, exponent)| **exponent == leading);
        let digits = compared
            .map(|((found, &exact), _)| digits_of((found - exact).magnitude(), exact.magnitude()));
        Ok(digits.fold(MOST_DIGITS, smaller))
    }

    /// Reference correction of the contact.
    fn contact_truth(&self) -> Result<ContactTruth, Refusal> {
        let (state, parameters) = self.point::<Dd>();
        if self.case.scene == "linear"
            && let Some(oscillator) = LinearOscillator::new(self.scene, self.orbit)
        {
            return Ok(ContactTruth {
                correction: oscillator.correction(self.orbit.section_point[0], state[0]).to_vec(),
                digits: MOST_DIGITS - 2.0,
            });
        }
        let mut flight = FreeFlight::<Dd>::new(&self.system, self.scene, self.orbit)?;
        let flown = flight.discontinuity(&state, &parameters)?;
        let (image, _) = flown
            .ok_or_else(|| refusal("simulation", "the flight through the contact has no image"))?;
        let correction: Vec<_> = image.iter().zip(&state).map(|(&a, &b)| a - b).collect();
        let size = correction.iter().map(|value| value.magnitude()).fold(0.0, f64::max);
        Ok(ContactTruth { digits: self.flown_digits(size), correction })
    }

    /// Digits of a flown correction: rounding of the state, relative to the depth and to the
    /// correction itself.
    fn flown_digits(&self, correction: f64) -> f64 {
        let states = self.orbit.section_point.iter();
        let size = states.map(|value| value.magnitude()).fold(0.0, f64::max);
        let smallest = self.case.depth.min(correction);
        digits_of(FLIGHT_ROUNDINGS * Dd::ROUNDOFF * size, smallest)
    }

    /// Comparison of the map with direct simulation.
    fn whole_map<S: Real>(&self, parts: &Parts<S>) -> Result<WholeMap, Refusal> {
        let (state, parameters) = self.point::<S>();
        let image = |legs: Legs<S>| {
            let map = MapEvaluation::of_parts(legs, vec![parts.contact.clone()]);
            let image = map.image(&state, &parameters).offsets;
            image.into_iter().map(Real::to_dd).collect::<Vec<_>>()
        };
        let found = image(parts.legs.clone());
        let mut flight = FreeFlight::<Dd>::new(&self.system, self.scene, self.orbit)?;
        let mut direct = DirectImage::<Dd>::new(&self.system, self.scene, self.orbit)?;
        let (state, parameters) = self.point::<Dd>();
        let free = flight.smooth(&state, &parameters)?;
        let exact = direct.image(&state, &parameters)?;
        let tells_order =
            exact.end == DirectEnd::Returned && exact.contacts > 0 && exact.extra_contacts == 0;
        let (Some(free), true) = (free, tells_order) else {
            return Ok(WholeMap::default());
        };
        let kick = distance(&exact.offsets, &free);
        let last_degree = match self.case.orders.smooth_order {
            0 | 1 => kick,
            order => distance(&found, &image(cut_legs(&self.expander, &parts.legs, order - 1)?)),
        };
        let size = distance(&exact.offsets, &vec![Dd::ZERO; exact.offsets.len()]);
        Ok(WholeMap {
            digits: Some(digits_of(distance(&found, &exact.offsets), kick)),
            truth: self.flown_digits(kick),
            last_degree: digits_of(last_degree, kick).max(0.0),
            over_kick: (size / kick).log10().max(0.0),
        })
    }
}

/// Comparison of a map with direct simulation; NaN or 0 if the point has no image to compare with.
#[derive(Default)]
struct WholeMap {
    /// Digits of the map, relative to the kick.
    digits: Option<f64>,
    /// Digits of the simulation, relative to the kick.
    truth: f64,
    /// Digits left by the truncation of the legs.
    last_degree: f64,
    /// Digits by which the image is larger than the kick.
    over_kick: f64,
}

/// Rounding errors that a flight accumulates, in units of the size of the state.
const FLIGHT_ROUNDINGS: f64 = 1e2;

/// Correction of a contact, with its digits.
struct ContactTruth {
    correction: Vec<Dd>,
    digits: f64,
}

/// `−log10` of a relative error, at most the digits of double-double; NaN if not a number.
fn digits_of(error: f64, size: f64) -> f64 {
    let share = error / size;
    if share.is_nan() { f64::NAN } else { (-share.log10()).min(MOST_DIGITS) }
}

/// Largest difference of a coordinate; NaN if one is not a number.
fn distance(a: &[Dd], b: &[Dd]) -> f64 {
    let differences = a.iter().zip(b).map(|(&a, &b)| (a - b).to_f64().abs());
    differences.fold(0.0, |max, value| if max.is_nan() || value <= max { max } else { value })
}

/// Smaller of two numbers; NaN if one is NaN.
fn smaller(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) }
}

fn rounded_to_single(parts: &Parts<f64>) -> Parts<f64> {
    let round = |jet: &Jet<f64>| jet.map_scalars(|value| f64::from(value as f32));
    let all = |jets: &[Jet<f64>]| jets.iter().map(round).collect();
    let leg = |leg: &Leg| Leg { image: all(&leg.image) };
    Parts {
        legs: Legs {
            before: parts.legs.before.as_ref().map(leg),
            after: parts.legs.after.iter().map(leg).collect(),
        },
        contact: Contact {
            depth: round(&parts.contact.depth),
            linear: all(&parts.contact.linear),
            quadratic: all(&parts.contact.quadratic),
            powers: parts.contact.powers.map(round),
            depth_form: None,
        },
    }
}
