//! Predictions of the theory of grazing bifurcations for a graze, to leading order.
//!
//! All predictions follow from the multipliers of the orbit without contact and from `xi_n`. With
//! `κ = sqrt(2/h'')` and the gap `h₀` of that orbit at the next passage, an orbit of `n` returns
//! whose only contact has the depth variable `y` closes if
//!
//! ```text
//! h₀ = −κ y T_n(n) − y²,   T_k(n) = xi_k + xi_{k+n} + xi_{k+2n} + …
//! ```
//!
//! and stays clear at its other passages if `T_k(n) > T_n(n)` for `0 < k < n`. The largest of its
//! multipliers is `−κ xi_n/(2y)`. For two multipliers these are the `c_n`, `b_nk` and `Λ` of the
//! literature; here for any number. None of this holds for a stop whose contact begins with a
//! higher power of `y`. See docs/mathematics/dynamics.md.

use serde::{Serialize, Serializer};

use super::curve_context::{CurveContext, NOISE, reach, start};
use super::effort::Effort;
use super::grazing_orbit::{Grazes, GrazingOrbit, GrazingPoint, Touch};
use super::margin::gap_slopes;
use super::monodromy::{ConditionFactors, Stretch, legs};
use super::outcome::OrbitError;
use super::passages::stretches;
use super::system::ExtendedSystem;
use crate::continuation::{moved, unit_vector};
use crate::flow::Field;
use crate::model::{Response, Scene};
use crate::numeric::{Dd, Scalar as _, converted};

/// Longest one-contact orbits considered, in returns.
const LONGEST: usize = 8;
/// Number of conditions whose signs are examined.
const CONDITIONS: usize = 64;
/// Conditions smaller than this, relative to the largest, count as zero.
const DIED_OUT: f64 = 1e-13;
/// Largest number of terms in a sum of conditions.
const MOST_TERMS: usize = 100_000;

/// Multipliers and conditions of a graze, and the predictions that follow from them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GrazeTheory {
    /// Leading power of the depth variable `y` in the contact: 1 for a square root of the depth,
    /// `2p + 1` for a force `k d^p`; `None` if contact has no effect.
    #[serde(serialize_with = "whole_or_real")]
    pub contact_power: Option<f64>,
    /// Magnitude of the largest multiplier of the orbit without contact.
    pub largest_multiplier: f64,
    /// `xi_1, xi_2, …`, as many as the longest one-contact orbit considered has returns.
    pub xi: Vec<f64>,
    /// Rounding of each `xi_n`: a value not larger in magnitude has no sign.
    pub noise: Vec<f64>,
    /// Parameters that unfold a graze of codimension two; empty for any other graze.
    pub unfolding: Vec<Unfolding>,
    /// Name of the adjusted parameter.
    pub parameter: String,
    /// Derivative, in the adjusted parameter, of the lowest gap of the orbit without contact;
    /// contact begins on the side where the gap falls.
    pub gap_slope: f64,
    /// Orbits with one contact in `n` returns that exist near the graze to leading order; listed
    /// for a square root only.
    pub orbits: Vec<OneContactOrbit>,
    /// Predicted behaviour near the graze.
    pub expectation: Expectation,
}

impl GrazeTheory {
    /// Whether a multiplier of the orbit without contact is larger than 1 by more than rounding.
    pub fn is_unstable(&self) -> bool {
        self.largest_multiplier > 1.0 + NOISE
    }
}

/// A parameter along whose grazing curve a vanishing condition changes its sign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unfolding {
    /// Name of the parameter.
    pub parameter: String,
    /// Derivative of the condition along the grazing curve, on which the first adjusted parameter
    /// follows.
    pub slope: f64,
}

/// An orbit with one contact in `n` returns, near the graze.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OneContactOrbit {
    /// Returns in one period of the orbit.
    pub returns: usize,
    /// `xi_n`.
    pub xi: f64,
    /// Sum `T_n(n)`: if positive, the orbit exists on the side of contact; if negative, on the
    /// other.
    pub sum: f64,
    /// Distance of the parameter from the graze at which the largest multiplier has magnitude 1, to
    /// leading order; closer to the graze the orbit is unstable.
    pub unstable_within: f64,
}

/// Predicted behaviour near a graze.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Expectation {
    /// Several passages graze in one return; the conditions between them decide.
    SeveralPassages,
    /// The orbit without contact is unstable: no attractor is born near it.
    Unstable,
    /// A multiplier of the orbit without contact has modulus 1 to rounding.
    Neutral,
    /// Every condition is zero to rounding, and no parameter changes that: to leading order,
    /// contact only moves the state along the orbit.
    Undecided,
    /// A condition that decides is zero to rounding: codimension two.
    CodimensionTwo {
        /// Index of the first such condition.
        n: usize,
    },
    /// Contact and free flight do not differ at the graze.
    NoContact,
    /// The impact moves a state that touches with zero normal velocity: an orbit that grazes jumps,
    /// and there is no map near the graze.
    Displaced {
        /// Largest change of a component.
        displacement: f64,
    },
    /// The contact has no release near the graze: it does not push back, or lasts. There is no map
    /// near the graze.
    NoRelease,
    /// The orbit comes to rest against a stop, and its state there is the same with contact and
    /// without.
    Forgotten,
    /// The contact begins with a power of `y` between 1 and 2. The multipliers of the orbit with
    /// contact grow beyond all bounds next to the graze.
    Unbounded,
    /// The contact begins with a power of `y` of at least 2. Multipliers stay finite: they change
    /// abruptly for `y²`, gradually for higher powers.
    Finite,
    /// A condition is negative: the attractor near the graze is lost, and the motion jumps.
    Jump {
        /// Index of the first such condition.
        n: usize,
    },
    /// All conditions are positive: an attractor near the graze persists.
    Persists {
        /// Type of the attractor; `None` unless the multipliers are real and positive.
        route: Option<AttractorRoute>,
    },
}

/// Attractor born at a graze of an orbit with real and positive multipliers, by the largest of
/// them.
///
/// Reference: `Chin1994`, for one multiplier much smaller than the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AttractorRoute {
    /// Below 1/4: period adding, windows of neighbouring periods overlap.
    PeriodAdding,
    /// From 1/4 to 2/3: period adding, chaos between the windows.
    PeriodAddingWithChaos,
    /// Above 2/3: chaos at once.
    Chaos,
}

impl GrazeTheory {
    /// The theory of a graze whose contact has no release near it, which the graze alone does not
    /// show: nothing is predicted.
    pub fn without_release(self) -> Self {
        Self { orbits: Vec::new(), expectation: Expectation::NoRelease, ..self }
    }
}

/// Theory of the graze of an orbit.
///
/// # Errors
///
/// [`OrbitError`] if the flow of the orbit cannot be computed.
pub fn graze_theory(scene: &Scene, orbit: &GrazingOrbit) -> Result<GrazeTheory, OrbitError> {
    let graze = orbit.grazing_point();
    let parameter = scene.grazing.solve_for[0];
    let free = &scene.grazing.solve_for;
    let system = ExtendedSystem::new(scene, Grazes::of(scene)?, orbit.parameters(), free);
    let stretch = stretches(scene, &system, &orbit.passages)?;
    let contact_power = match stretch.first() {
        Some(Stretch::Reset | Stretch::Jump) => Some(1.0),
        Some(Stretch::Difference { power, .. }) => Some((power + 1) as f64),
        Some(Stretch::Rough { power, .. }) => Some(power + 1.0),
        Some(Stretch::None) | None => None,
    };
    let [re, im] = orbit.multipliers.first().copied().unwrap_or_default();
    let mut theory = GrazeTheory {
        contact_power,
        largest_multiplier: re.hypot(im),
        xi: converted(&orbit.xi),
        noise: Vec::new(),
        unfolding: Vec::new(),
        parameter: scene.model.parameters[parameter].name.clone(),
        gap_slope: f64::NAN,
        orbits: Vec::new(),
        expectation: Expectation::SeveralPassages,
    };
    if orbit.passages.len() > 1 {
        return Ok(theory);
    }
    theory.gap_slope =
        gap_slopes(scene, &graze.state, orbit.period, orbit.parameters())?[parameter];
    if let Some(displacement) = displacement(scene, graze) {
        theory.expectation = Expectation::Displaced { displacement };
        return Ok(theory);
    }
    theory.expectation = match contact_power {
        None => Expectation::NoContact,
        Some(_) if orbit.forgets() => Expectation::Forgotten,
        Some(_) if (theory.largest_multiplier - 1.0).abs() <= NOISE => Expectation::Neutral,
        Some(_) if theory.is_unstable() => Expectation::Unstable,
        Some(2.0..) => Expectation::Finite,
        Some(power) if power > 1.0 => Expectation::Unbounded,
        Some(_) => {
            let noise = condition_noise(&system, &stretch, orbit)?;
            let conditions = Conditions::new(&theory.xi, &noise, &orbit.multipliers);
            theory.xi = conditions.values.iter().copied().take(LONGEST).collect();
            theory.noise = conditions.noise.iter().copied().take(LONGEST).collect();
            let acceleration = graze.normal_acceleration.to_f64();
            theory.orbits = (1..=LONGEST)
                .filter_map(|returns| {
                    conditions.orbit(returns, acceleration * theory.gap_slope.abs())
                })
                .collect();
            conditions.expectation(&orbit.multipliers)
        }
    };
    if let Expectation::CodimensionTwo { n } = theory.expectation {
        theory.unfolding = unfolding(scene, orbit, n, theory.noise[n - 1] / NOISE)?;
        let mut conditions = theory.xi.iter().zip(&theory.noise);
        if theory.unfolding.is_empty() && conditions.all(|(xi, noise)| xi.abs() <= *noise) {
            theory.expectation = Expectation::Undecided;
        }
    }
    Ok(theory)
}

/// Largest change of a grazing state by an impact, relative to its size, that is rounding.
const UNMOVED: f64 = 1e-9;

/// Largest change of a component of the grazing state by an impact, if it is beyond rounding.
fn displacement(scene: &Scene, graze: &GrazingPoint) -> Option<f64> {
    let Response::Impact { reset } = &scene.model.surfaces[graze.surface].response else {
        return None;
    };
    let inputs: Vec<Dd> = graze.state.iter().chain(&graze.parameters).copied().collect();
    let mut values = Vec::new();
    scene.model.graph.evaluate(&inputs, &mut values);
    let pairs = reset.iter().zip(&graze.state);
    let moves = pairs.map(|(node, before)| (values[node.index()] - *before).magnitude());
    let farthest = moves.fold(0.0, f64::max);
    let size = graze.state.iter().fold(1.0_f64, |size, value| size.max(value.magnitude()));
    (farthest > UNMOVED * size).then_some(farthest)
}

/// Writes a power as a whole number if it is one.
fn whole_or_real<S: Serializer>(power: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    match *power {
        Some(power) if power.fract() == 0.0 => serializer.serialize_some(&(power as u64)),
        power => power.serialize(serializer),
    }
}

/// Rounding of each condition of the orbit: a value not larger in magnitude has no sign.
///
/// The bound covers the rounding of the flow's derivatives, the orbit's residual, and parameters
/// given to the precision of a double.
fn condition_noise(
    system: &ExtendedSystem,
    stretches: &[Stretch],
    orbit: &GrazingOrbit,
) -> Result<Vec<f64>, OrbitError> {
    let touch = |graze: &GrazingPoint| Touch {
        surface: graze.surface,
        time: graze.time.to_f64(),
        state: converted(&graze.state),
    };
    let touches: Vec<Touch<f64>> = orbit.passages.iter().map(touch).collect();
    let parameters: Vec<f64> = converted(orbit.parameters());
    let legs = legs(system, &touches, &parameters, orbit.period.to_f64())?;
    let factors = ConditionFactors::new(system, stretches, &touches, &legs, &parameters)?;
    let sizes = factors.sizes(orbit.xi.len(), &reach(system, &start(system, orbit))?);
    let sizes = sizes.into_iter().next().map_or_else(Vec::new, |first| first.values);
    Ok(sizes.into_iter().map(|size| (NOISE + orbit.residual) * size).collect())
}

/// Step along a grazing curve, in the units of its unknowns, for the slope of a condition.
const ALONG: f64 = 1e-4;

/// Smallest change of a condition over the size of a parameter, relative to the condition's size,
/// for the parameter to count as unfolding it.
const UNFOLDS: f64 = 1e-5;

/// Parameters along whose grazing curves condition `n` changes, in decreasing order of the change
/// over the parameter's size.
fn unfolding(
    scene: &Scene,
    orbit: &GrazingOrbit,
    n: usize,
    size: f64,
) -> Result<Vec<Unfolding>, OrbitError> {
    let field = Field::free(&scene.model, &[]);
    let mut found = Vec::new();
    for (number, parameter) in scene.model.parameters.iter().enumerate() {
        let value = orbit.parameters()[number].to_f64().abs();
        if scene.grazing.solve_for.contains(&number) {
            continue;
        }
        let effort = Effort::new(&field);
        let context = CurveContext::new(scene, orbit, (number, value), n, &effort)?;
        let here = context.start(orbit);
        let along: Vec<f64> = unit_vector(here.len(), here.len() - 1);
        let Some(tangent) = context.tangent(&here, &along) else { continue };
        let [before, after] = [-ALONG, ALONG].map(|step| moved(&here, &tangent, step));
        let change = context.condition(&after, 0, 0, n)? - context.condition(&before, 0, 0, n)?;
        let ends = [&before, &after].map(|ends| context.parameters(ends)[number]);
        let slope = change / (ends[1] - ends[0]);
        let over = slope.abs() * if value > 0.0 { value } else { 1.0 };
        if over > UNFOLDS * size {
            found.push((over, Unfolding { parameter: parameter.name.clone(), slope }));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(found.into_iter().map(|(_, unfolding)| unfolding).collect())
}

/// Conditions of a stable orbit, continued by the recurrence of its multipliers.
struct Conditions {
    /// Conditions from `xi_1` on, until they count as zero.
    values: Vec<f64>,
    /// Rounding of each condition.
    noise: Vec<f64>,
    /// Number of conditions computed along the orbit; the others follow by the recurrence.
    computed: usize,
}

impl Conditions {
    /// Extends the first conditions, at least as many as there are multipliers, and their noise.
    fn new(first: &[f64], first_noise: &[f64], multipliers: &[[f64; 2]]) -> Self {
        let recurrence = characteristic(multipliers);
        let [re, im] = multipliers.first().copied().unwrap_or_default();
        let terms = (DIED_OUT * 1e-3).ln() / re.hypot(im).ln();
        let terms = if terms > 0.0 { terms as usize + CONDITIONS } else { CONDITIONS };
        let mut values = first.to_vec();
        while values.len() < terms.min(MOST_TERMS) && recurrence.len() <= first.len() {
            let last = &values[values.len() - recurrence.len()..];
            let next = recurrence.iter().zip(last).map(|(a, b)| -a * b).sum();
            values.push(next);
        }
        let mut noise = first_noise.to_vec();
        while noise.len() < values.len() {
            // Rounding decays at the rate of the largest multiplier.
            noise.push(noise.last().copied().unwrap_or(0.0) * re.hypot(im));
        }
        Self { values, noise, computed: first.len() }
    }

    /// Sum `T_k(n)`, with `from = k` and `returns = n`.
    fn sum(&self, from: usize, returns: usize) -> f64 {
        self.values.iter().skip(from - 1).step_by(returns).sum()
    }

    /// Rounding of `T_k(n)`.
    fn sum_noise(&self, from: usize, returns: usize) -> f64 {
        self.noise.iter().skip(from - 1).step_by(returns).sum()
    }

    /// Whether `xi_n` is zero to rounding.
    fn vanishes(&self, n: usize) -> bool {
        self.values[n - 1].abs() <= self.noise[n - 1]
    }

    /// Orbit with one contact in a number of returns, if it exists; `scale` is `h''` times the
    /// slope of the gap.
    fn orbit(&self, returns: usize, scale: f64) -> Option<OneContactOrbit> {
        let (&xi, sum) = (self.values.get(returns - 1)?, self.sum(returns, returns));
        let noise = self.sum_noise(returns, returns);
        let clears = (1..returns).all(|passage| {
            self.sum(passage, returns) - sum > noise + self.sum_noise(passage, returns)
        });
        let has_sign = sum.abs() > noise && !self.vanishes(returns);
        // With y = −h₀/(κ T): |κ xi/(2y)| = |xi T|/(h'' |h₀|).
        let unstable_within = (xi * sum).abs() / scale;
        (clears && has_sign).then_some(OneContactOrbit { returns, xi, sum, unstable_within })
    }

    fn expectation(&self, multipliers: &[[f64; 2]]) -> Expectation {
        let vanishing = (1..=self.computed).filter(|&n| self.vanishes(n));
        let vanishing: Vec<usize> = vanishing.collect();
        if vanishing.first() == Some(&1) {
            return Expectation::CodimensionTwo { n: 1 };
        }
        let largest = self.values.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        let is_negative = |(&value, &noise): (&f64, &f64)| value < -noise.max(DIED_OUT * largest);
        let mut felt = self.values.iter().zip(&self.noise).take(CONDITIONS);
        if let Some(place) = felt.position(is_negative) {
            return Expectation::Jump { n: place + 1 };
        }
        if let Some(&n) = vanishing.first() {
            return Expectation::CodimensionTwo { n };
        }
        let is_real = multipliers.iter().all(|&[re, im]| im == 0.0 && re > 0.0);
        let route = || match multipliers.first().map_or(0.0, |&[re, _]| re) {
            largest if largest < 0.25 => AttractorRoute::PeriodAdding,
            largest if largest < 2.0 / 3.0 => AttractorRoute::PeriodAddingWithChaos,
            _ => AttractorRoute::Chaos,
        };
        Expectation::Persists { route: is_real.then(route) }
    }
}

/// Coefficients of the monic polynomial with these zeros (conjugate pairs, `[re, im]`), lowest
/// first, without the leading one.
fn characteristic(zeros: &[[f64; 2]]) -> Vec<f64> {
    let mut polynomial = vec![1.0];
    let times = |polynomial: &[f64], factor: &[f64]| {
        let mut product = vec![0.0; polynomial.len() + factor.len() - 1];
        for (i, a) in polynomial.iter().enumerate() {
            for (j, b) in factor.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        product
    };
    for &[re, im] in zeros {
        if im == 0.0 {
            polynomial = times(&polynomial, &[-re, 1.0]);
        } else if im > 0.0 {
            polynomial = times(&polynomial, &[re * re + im * im, -2.0 * re, 1.0]);
        }
    }
    polynomial.pop();
    polynomial
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `xi_n = a λ₁ⁿ + b λ₂ⁿ`.
    fn conditions(pairs: [[f64; 2]; 2]) -> Conditions {
        let xi = |n: i32| pairs.iter().map(|[weight, zero]| weight * zero.powi(n)).sum();
        let first: Vec<f64> = (1..=6).map(xi).collect();
        Conditions::new(&first, &[0.0; 6], &pairs.map(|[_, zero]| [zero, 0.0]))
    }

    #[test]
    fn sums_of_conditions_are_geometric() {
        let pairs = [[1.0, 0.6], [-1.0, 0.1]];
        let conditions = conditions(pairs);
        for n in 1..=5_usize {
            for k in 1..=n {
                let term = |[weight, zero]: [f64; 2]| {
                    weight * zero.powi(k as i32) / (1.0 - zero.powi(n as i32))
                };
                let exact: f64 = pairs.into_iter().map(term).sum();
                assert!((conditions.sum(k, n) - exact).abs() < 1e-13, "{k} of {n}");
            }
        }
    }

    /// `b_nk` and `c_n` of the cantilever paper, for `γ = A_12` of either sign.
    #[test]
    fn one_contact_orbits_exist_where_the_cantilever_paper_says() {
        for [one, two] in [[0.6, 0.1], [0.2, 0.05], [0.9, 0.3], [0.0574449, 6.07e-5]] {
            for sign in [1.0, -1.0] {
                // xi_n = sign (λ1ⁿ − λ2ⁿ)/(λ1 − λ2).
                let weight = sign / (one - two);
                let conditions = conditions([[weight, one], [-weight, two]]);
                for n in 1..=6_i32 {
                    let power = |k: i32| [one.powi(k), two.powi(k)];
                    let difference = |k: i32| power(k)[0] - power(k)[1];
                    let b = |k: i32| {
                        let product = power(k)[0] * power(k)[1];
                        (-product * difference(n - k) - difference(k) + difference(n))
                            / difference(n)
                    };
                    let clears = (1..n).all(|k| sign * b(k) < 0.0);
                    let found = conditions.orbit(n as usize, 1.0);
                    assert_eq!(found.is_some(), clears, "{n} of {one}, {two}, {sign}");
                    let c =
                        -(one - two) * (power(n)[0] - 1.0) * (power(n)[1] - 1.0) / difference(n);
                    // The orbit exists after the graze if sign(γ) c_n < 0.
                    assert!(found.is_none_or(|orbit| (orbit.sum > 0.0) == (sign * c < 0.0)));
                }
            }
        }
    }

    #[test]
    fn a_condition_that_turns_negative_is_found_and_routes_follow_the_largest_multiplier() {
        let jump = conditions([[1.0, 0.5], [-3.0, 0.4]]);
        assert_eq!(jump.expectation(&[[0.5, 0.0], [0.4, 0.0]]), Expectation::Jump { n: 1 });
        for (largest, route) in [
            (0.2, AttractorRoute::PeriodAdding),
            (0.5, AttractorRoute::PeriodAddingWithChaos),
            (0.7, AttractorRoute::Chaos),
        ] {
            let positive = conditions([[1.0, largest], [-1.0, 0.01]]);
            let expected = Expectation::Persists { route: Some(route) };
            assert_eq!(positive.expectation(&[[largest, 0.0], [0.01, 0.0]]), expected);
        }
    }
}
