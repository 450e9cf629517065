//! End of a contact: the release time as a power of `y` times a series.
//!
//! Along the contact field the release function is `Σ_k ρ_k t^k` with jets `ρ_k(y; c, p)`. Near a
//! graze a root that vanishes with `y` behaves as `t = κ₀ y^q`. The Newton polygon of the lowest
//! powers of `y` in the `ρ_k` gives `q` and the polynomial whose smallest positive root is `κ₀`.
//! Divided by its lowest power of `y`, the equation for `κ = t/y^q` is then solved with jets.
//! Derivation: docs/mathematics/contact-laws.md.

use super::approach::{Approach, DepthVariable};
use super::error::{ContactLawError, ExpansionError};
use super::passage::Passage;
use super::routes::Graze;
use super::variables::shift_depth_power;
use crate::flow::{Field, LocalSeries, local_series, local_series_kept_to};
use crate::jet::{Jet, implicit_root, power_series_with_slope_at};
use crate::numeric::polynomial::{evaluate, roots_on_interval};
use crate::numeric::{Dd, Real, Scalar};

/// Weight, and highest power of time, used to find the balance.
const BALANCE_WEIGHT: u32 = 4;
/// Coefficients below this share of the largest of their series are zero; the balance is found in
/// double-double.
const VANISHING: f64 = 1e-22;
/// A relative slope below this at a root of the balance counts as zero.
const NO_SLOPE: f64 = 1e-8;

/// Leading behaviour `t = κ₀ y^q` of the contact time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ReleaseBalance {
    /// Powers of time divided out because the release function vanishes on entry.
    trivial: usize,
    /// Power `q`.
    pub(super) power: usize,
    /// Power of `y` by which the equation for `κ` is divided.
    divided: usize,
    /// Factor `κ₀`.
    pub(super) factor: Dd,
}

impl ReleaseBalance {
    /// Finds the leading balance of the release.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::ContactLaw`] if there is no simple release near the graze.
    pub(super) fn new(graze: &Graze, field: &Field) -> Result<Self, ExpansionError> {
        let kind = DepthVariable::Replacing;
        let approach = Approach::<Dd>::new(graze, BALANCE_WEIGHT, kind)?;
        let (entry, passage) = (approach.entry()?, &graze.passage);
        let parameters = passage.parameter_jets(&approach.space, approach.first_parameter);
        let series = local_series(field, &entry.state, &parameters, BALANCE_WEIGHT as usize);
        let polygon = Polygon::new(passage, &approach, &series);
        let balance = polygon.first_release()?;
        polygon.check_division(&balance)?;
        Ok(balance)
    }

    /// Number of weights by which the contact time is less exact than the state at the entry.
    pub(super) fn lost_weights(&self) -> u32 {
        self.divided.saturating_sub(self.power) as u32
    }

    /// Power of `y` that multiplies `κ^(k − trivial)` in the divided equation, for time power `k`.
    fn shift(&self, time_power: usize) -> i32 {
        (self.power * (time_power - self.trivial)) as i32 - self.divided as i32
    }

    /// Order to which the coefficient of each power of time is needed along the contact, for states
    /// and the release function.
    fn kept(&self, order: usize) -> Vec<usize> {
        let powers = 0..=order + self.trivial;
        let needed = |power: usize| match power.checked_sub(self.trivial) {
            Some(beyond) => (order + self.divided).saturating_sub(self.power * beyond),
            None => order,
        };
        powers.map(|power| needed(power).min(order)).collect()
    }

    /// Flies from the entry along the contact field to the release; returns the state there and the
    /// contact time. Solves, for `κ = t/y^q`,
    ///
    /// ```text
    /// 0 = Σ_{k≥z} y^{q(k−z)−m} ρ_k κ^{k−z}
    /// ```
    pub(super) fn exit<S: Real>(
        &self,
        field: &Field,
        entry: &[Jet<S>],
        parameters: &[Jet<S>],
    ) -> Result<(Vec<Jet<S>>, Jet<S>), ExpansionError> {
        let space = entry[0].space();
        let series = local_series_kept_to(field, entry, parameters, self.kept(space.order()));
        let release = series.watched(0).iter().enumerate().skip(self.trivial);
        let divided: Vec<_> =
            release.map(|(power, jet)| shift_depth_power(jet, self.shift(power))).collect();
        let start = Jet::constant(space, S::from_dd(self.factor));
        let factor = implicit_root(&start, |factor| power_series_with_slope_at(&divided, factor))?;
        let contact_time = shift_depth_power(&factor, self.power as i32);
        Ok((series.state_at(&contact_time), contact_time))
    }
}

/// Whether a polynomial has a nonzero slope at its root: rounding may split a double root into two
/// with almost none.
fn is_simple(coefficients: &[Dd], root: Dd) -> bool {
    let (_, slope) = evaluate(coefficients, root);
    let sizes: Vec<_> = coefficients.iter().map(|c| c.abs()).collect();
    let (size, _) = evaluate(&sizes, root);
    (slope * root).magnitude() > NO_SLOPE * size.magnitude()
}

/// Newton polygon: the lowest powers of `y` in the release function's coefficients along the
/// contact.
struct Polygon<'a> {
    surface: &'a str,
    release: &'a [Jet<Dd>],
    contact_acceleration: f64,
    free_acceleration: f64,
    /// Threshold below which a coefficient is zero, by power of time.
    zero: Vec<f64>,
    trivial: usize,
}

/// An edge of the polygon: the balance of the terms `t^i y^{n_i}` on it, with `i` from `first` to
/// `last`.
struct Edge {
    first: usize,
    last: usize,
    /// Drop of the power of `y` from the first to the last.
    drop: usize,
}

impl<'a> Polygon<'a> {
    fn new(passage: &'a Passage, approach: &Approach<Dd>, series: &'a LocalSeries<Dd>) -> Self {
        let release = series.watched(0);
        let mut largest = 0.0_f64;
        let scales = release.iter().map(|jet| {
            largest = largest.max(jet.max_abs());
            largest
        });
        let scales: Vec<f64> = scales.collect();
        let next = |power: usize| scales[(power + 1).min(scales.len() - 1)];
        let zero: Vec<_> = (0..release.len()).map(|power| VANISHING * next(power)).collect();
        let vanishes = |(jet, zero): &(&Jet<Dd>, &f64)| jet.max_abs() <= **zero;
        Self {
            surface: &passage.surface,
            release,
            contact_acceleration: 2.0 * series.watched(1)[2].head().to_f64(),
            free_acceleration: 2.0 * approach.gap[2].head().to_f64(),
            trivial: release.iter().zip(&zero).take_while(vanishes).count(),
            zero,
        }
    }

    /// Coefficient of `y^power` in `ρ_k` at the grazing point, with `k = time_power`.
    fn coefficient(&self, time_power: usize, power: usize) -> Dd {
        let jet = &self.release[time_power];
        let mut exponents = vec![0; jet.space().variables()];
        exponents[0] = power as u8;
        jet.coefficient(&exponents)
    }

    /// Lowest power of `y` in `ρ_k` at the grazing point, with `k = time_power`.
    fn lowest(&self, time_power: usize) -> Option<usize> {
        (0..=BALANCE_WEIGHT as usize)
            .find(|&power| self.coefficient(time_power, power).magnitude() > self.zero[time_power])
    }

    /// Balance of the earliest release: the steepest edge of the polygon whose polynomial has a
    /// positive root.
    fn first_release(&self) -> Result<ReleaseBalance, ContactLawError> {
        let mut first = (self.trivial..self.release.len()).find(|&k| self.lowest(k).is_some());
        while let Some(edge) = first.and_then(|first| self.edge_from(first)) {
            if let Some(factor) = self.smallest_root(&edge)? {
                return self.balance(&edge, factor);
            }
            first = Some(edge.last);
        }
        Err(self.no_release())
    }

    /// The steepest edge downwards from a vertex, to its last point.
    fn edge_from(&self, first: usize) -> Option<Edge> {
        let top = self.lowest(first)?;
        let lower = (first + 1..self.release.len()).filter_map(|last| {
            let drop = top.checked_sub(self.lowest(last)?)?;
            (drop > 0).then_some(Edge { first, last, drop })
        });
        lower.max_by(|a, b| {
            let steeper = (a.drop * (b.last - b.first)).cmp(&(b.drop * (a.last - a.first)));
            steeper.then(a.last.cmp(&b.last))
        })
    }

    /// Smallest positive root of the balance of an edge.
    fn smallest_root(&self, edge: &Edge) -> Result<Option<Dd>, ContactLawError> {
        let top = self.lowest(edge.first).unwrap_or(0);
        let length = edge.last - edge.first;
        let coefficients: Vec<Dd> = (0..=length)
            .map(|step| match (edge.drop * step) % length {
                0 => self.coefficient(edge.first + step, top - edge.drop * step / length),
                _ => Dd::ZERO,
            })
            .collect();
        let last = coefficients[length].magnitude();
        // Cauchy's bound on the magnitude of every root.
        let bound = coefficients.iter().map(|c| c.magnitude() / last);
        let bound = 1.0 + bound.fold(0.0, f64::max);
        let roots = roots_on_interval(&coefficients, Dd::from(bound));
        let Some(root) = roots.first().map(|root| root.time) else {
            return Ok(None);
        };
        if is_simple(&coefficients, root) {
            return Ok(Some(root));
        }
        Err(ContactLawError::NotSimple {
            surface: self.surface.to_owned(),
            factor: root.to_f64(),
            power: edge.drop / length,
        })
    }

    fn balance(&self, edge: &Edge, factor: Dd) -> Result<ReleaseBalance, ContactLawError> {
        let length = edge.last - edge.first;
        if !edge.drop.is_multiple_of(length) {
            return Err(ContactLawError::FractionalPower {
                surface: self.surface.to_owned(),
                numerator: edge.drop,
                denominator: length,
            });
        }
        let power = edge.drop / length;
        let top = self.lowest(edge.first).unwrap_or(0);
        Ok(ReleaseBalance {
            trivial: self.trivial,
            power,
            divided: top + power * (edge.first - self.trivial),
            factor,
        })
    }

    /// Checks that the divisor of the equation divides every term, also beside the grazing point.
    fn check_division(&self, balance: &ReleaseBalance) -> Result<(), ContactLawError> {
        for time_power in balance.trivial..self.release.len() {
            let kept = -balance.shift(time_power);
            let lower = self.release[time_power]
                .terms()
                .filter(|(exponents, _)| i32::from(exponents[0]) < kept);
            let worst = lower
                .map(|(exponents, value)| (usize::from(exponents[0]), value.to_f64()))
                .find(|(_, value)| value.abs() > self.zero[time_power]);
            if let Some((power, coefficient)) = worst {
                return Err(ContactLawError::NotUniform {
                    surface: self.surface.to_owned(),
                    time_power,
                    power,
                    coefficient,
                });
            }
        }
        Ok(())
    }

    fn no_release(&self) -> ContactLawError {
        let surface = self.surface.to_owned();
        let contact_acceleration = self.contact_acceleration;
        if contact_acceleration <= 0.0 {
            return ContactLawError::Acceleration {
                surface,
                contact_acceleration,
                free_acceleration: self.free_acceleration,
            };
        }
        ContactLawError::NoRelease {
            surface,
            release: self.release[0].head().to_f64(),
            contact_acceleration,
        }
    }
}
