//! Taylor series in time about a jet-valued state, and their sums at a jet-valued time.

use super::Field;
use super::jet_transport::JetExpansion;
use crate::jet::{Jet, JetSeries, power_series_at};
use crate::numeric::Real;

/// Taylor coefficients in time, as jets, of every state component and watched function.
#[derive(Clone, Debug)]
pub struct LocalSeries<S: Real> {
    states: Vec<Vec<Jet<S>>>,
    watched: Vec<Vec<Jet<S>>>,
}

impl<S: Real> LocalSeries<S> {
    /// Coefficients of a state component, by power of time.
    pub fn state(&self, component: usize) -> &[Jet<S>] {
        &self.states[component]
    }

    /// Coefficients of a watched function, by power of time.
    pub fn watched(&self, watched: usize) -> &[Jet<S>] {
        &self.watched[watched]
    }

    /// The state at a jet-valued time, the series summed as in [`at_series_time`].
    pub fn state_at(&self, time: &Jet<S>) -> Vec<Jet<S>> {
        self.states.iter().map(|series| at_series_time(series, time)).collect()
    }
}

/// Expands the solution about a jet-valued state, up to a power of time.
///
/// `initial` holds one jet per state component, `parameters` one per parameter of the field (those
/// of bound ones are ignored), all of one space, with any content. Outside the domain of the field
/// the coefficients are not finite.
///
/// # Panics
///
/// If there is no state component, or the jets' spaces differ.
pub fn local_series<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    order: usize,
) -> LocalSeries<S> {
    let degree = initial[0].space().order();
    local_series_kept_to(field, initial, parameters, vec![degree; order + 1])
}

/// [`local_series`] with the coefficients of each power of time to a degree of its own; beyond it
/// they are 0.
///
/// What is to be summed at a time of lowest degree `l` is needed to the order less `l` times the
/// power: a small part of the work.
///
/// # Panics
///
/// As [`local_series`], if no power is kept, or a degree exceeds that of a lower power.
pub fn local_series_kept_to<S: Real>(
    field: &Field,
    initial: &[Jet<S>],
    parameters: &[Jet<S>],
    kept: Vec<usize>,
) -> LocalSeries<S> {
    let space = initial[0].space();
    let powers = 0..kept.len();
    let algebra = JetSeries::kept_to(space, kept);
    let mut expansion = JetExpansion::new(field, algebra.clone());
    expansion.expand(initial, parameters);
    let jets = |slot: usize| -> Vec<Jet<S>> {
        let jet = |power| {
            let coefficients = expansion.coefficients(slot, power).to_vec();
            let jet = Jet::from_coefficients(space, coefficients);
            jet.truncate(algebra.kept(power))
        };
        powers.clone().map(jet).collect()
    };
    let output = |watched| field.time_program().output(field.dimension() + watched);
    LocalSeries {
        states: (0..field.dimension()).map(&jets).collect(),
        watched: (0..field.watched()).map(|watched| jets(output(watched))).collect(),
    }
}

/// `Σ_k c_k τ^k` for a time `τ` without constant term, by Horner's rule.
///
/// Exact to the order of the space if `coefficients` reaches the power at which `τ^k` vanishes: the
/// order over the lowest degree of `τ`.
///
/// # Panics
///
/// If `coefficients` is empty, or the jets' spaces differ.
pub fn at_series_time<S: Real>(coefficients: &[Jet<S>], time: &Jet<S>) -> Jet<S> {
    assert!(!coefficients.is_empty(), "a series has its term of power 0");
    power_series_at(coefficients, time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::samples;
    use crate::jet::JetSpace;

    #[test]
    fn series_at_a_jet_time_is_the_closed_flow_of_the_square() {
        let space = JetSpace::uniform(2, 7).unwrap();
        let x = Jet::variable(&space, 0, 0.5_f64);
        let time = Jet::variable(&space, 1, 0.0);
        let series = local_series(&samples::quadratic(), std::slice::from_ref(&x), &[], 7);
        let sum = at_series_time(series.state(0), &time);
        let expected = &x / &(-&(&x * &time)).add_constant(1.0);
        for (value, exact) in sum.coefficients().iter().zip(expected.coefficients()) {
            assert!((value - exact).abs() < 1e-14 * exact.abs().max(1.0), "{value} {exact}");
        }
    }

    #[test]
    fn coefficients_kept_to_a_degree_are_those_of_the_whole_series_up_to_it() {
        let space = JetSpace::new(&[1, 2], 6).unwrap();
        let state = [Jet::variable(&space, 0, 0.7), Jet::variable(&space, 1, 0.4)];
        let whole = local_series(&samples::pendulum(), &state, &[], 6);
        let kept = |power: usize| 6 - power;
        let degrees = (0..=6).map(kept).collect();
        let series = local_series_kept_to(&samples::pendulum(), &state, &[], degrees);
        for component in 0..2 {
            for power in 0..=6 {
                let expected = whole.state(component)[power].truncate(kept(power));
                assert_eq!(series.state(component)[power], expected, "{power}");
            }
        }
    }

    #[test]
    fn watched_energy_of_the_pendulum_is_constant_as_a_jet() {
        let space = JetSpace::uniform(2, 4).unwrap();
        let state = [Jet::variable(&space, 0, 0.7_f64), Jet::variable(&space, 1, 0.4)];
        let series = local_series(&samples::pendulum(), &state, &[], 8);
        for power in 1..=8 {
            let largest =
                series.watched(0)[power].coefficients().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            assert!(largest < 1e-14, "power {power}: {largest:e}");
        }
    }
}
