//! How much a search has computed, and the most it may.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::outcome::{NotLocated, OrbitError};
use crate::flow::{Field, Integrator};
use crate::numeric::{Dd, Real, Scalar as _};

/// Most products of series that a search forms, in units of one of numbers in `f64`: 2 to 5 s.
const MOST_PRODUCTS: u64 = 13_000_000;

/// What a product of jets of degree one costs beside one of numbers; measured, for three to five
/// directions.
const OF_JETS: f64 = 40.0;

/// What a product in double-double costs beside one in `f64`, the longer series counted; measured.
const IN_DOUBLE_DOUBLE: f64 = 40.0;

/// What is carried along a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flight {
    /// A state.
    Numbers,
    /// A state with its derivatives.
    Jets,
}

/// The products of series that the flights of a search have formed.
///
/// A flight takes as many Taylor steps in a unit of time as the last stretch whose steps were
/// counted. Clones count together.
#[derive(Clone, Debug)]
pub(super) struct Effort {
    /// Products of series in a step.
    products: u64,
    counts: Arc<Counts>,
}

/// What is counted.
#[derive(Debug, Default)]
struct Counts {
    /// Bits of the steps that a unit of time takes.
    density: AtomicU64,
    /// Products formed.
    spent: AtomicU64,
}

impl Effort {
    /// Nothing computed yet, along a field.
    pub(super) fn new(field: &Field) -> Self {
        let products = field.time_program().products().max(1) as u64;
        Self { products, counts: Arc::default() }
    }

    /// Most steps of a period: with more, not even one flight with its derivatives could end.
    pub(super) fn most_steps(&self) -> usize {
        (MOST_PRODUCTS as f64 / OF_JETS) as usize / self.products as usize
    }

    /// Counts a stretch whose steps are known.
    pub(super) fn counted(&self, steps: usize, duration: f64) {
        let density = steps as f64 / duration.abs();
        if density.is_finite() {
            self.counts.density.store(density.to_bits(), Ordering::Relaxed);
        }
        self.spend(steps as f64);
    }

    /// Counts the steps of a flight of either direction, by flying it in numbers: an iterate of
    /// Newton's method may lead to where the flow is far slower than along the orbit.
    pub(super) fn probe(&self, field: &Field, start: &[f64], parameters: &[f64], duration: f64) {
        let mut integrator = Integrator::<f64>::new(field);
        let (mut state, mut remaining, mut steps) = (start.to_vec(), duration.abs(), 0);
        while remaining > 0.0 && steps <= self.most_steps() {
            let Ok(step) = integrator.step(&state, parameters) else { break };
            let length = step.length.min(remaining);
            step.state_at(length * duration.signum(), &mut state);
            (remaining, steps) = (remaining - length, steps + 1);
        }
        self.counted(steps, duration.abs() - remaining);
    }

    /// Counts a flight, of jets where its derivatives are asked for.
    ///
    /// # Errors
    ///
    /// [`OrbitError::SearchTooLong`] where the search has formed all the products it may.
    pub(super) fn fly<S: Real>(&self, duration: f64, of: Flight) -> Result<(), OrbitError> {
        let in_format = if S::ROUNDOFF <= Dd::ROUNDOFF { IN_DOUBLE_DOUBLE } else { 1.0 };
        let of_what = match of {
            Flight::Numbers => 1.0,
            Flight::Jets => OF_JETS,
        };
        self.spend(self.density() * duration.abs() * in_format * of_what);
        match self.is_spent() {
            true => Err(OrbitError::SearchTooLong),
            false => Ok(()),
        }
    }

    /// Whether the search has formed all the products it may.
    pub(super) fn is_spent(&self) -> bool {
        self.counts.spent.load(Ordering::Relaxed) > MOST_PRODUCTS
    }

    /// Forgets what was computed so far.
    pub(super) fn renew(&self) {
        self.counts.spent.store(0, Ordering::Relaxed);
    }

    /// Why a search that formed all the products it may ended.
    pub(super) fn too_slow(&self, period: f64) -> NotLocated {
        let steps = (self.density() * period).round() as u64;
        NotLocated::TooSlow { steps, products: self.products }
    }

    fn density(&self) -> f64 {
        f64::from_bits(self.counts.density.load(Ordering::Relaxed))
    }

    fn spend(&self, steps: f64) {
        let products = (steps * self.products as f64).min(MOST_PRODUCTS as f64 + 1.0);
        self.counts.spent.fetch_add(products as u64, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scene;
    use crate::model::catalogue;

    fn effort() -> Effort {
        let text = catalogue::text("mems").expect("a scene of the catalogue");
        let scene = Scene::parse(text, "mems.toml").expect("a valid scene");
        let effort = Effort::new(&Field::free(&scene.model, &[]));
        effort.counted(100, 1.0);
        effort
    }

    /// Flights of one unit of time until the limit.
    fn flights<S: Real>(of: Flight) -> usize {
        let effort = effort();
        (0..).take_while(|_| effort.fly::<S>(1.0, of).is_ok()).count()
    }

    #[test]
    fn flights_of_jets_and_in_double_double_count_for_as_many_of_numbers_as_they_cost() {
        let (numbers, jets) = (flights::<f64>(Flight::Numbers), flights::<f64>(Flight::Jets));
        let precise = flights::<Dd>(Flight::Numbers);
        assert!(numbers / 41 < jets && jets < numbers / 39, "{numbers} {jets}");
        assert!(numbers / 41 < precise && precise < numbers / 39, "{numbers} {precise}");
    }

    #[test]
    fn clones_count_together_and_begin_anew_together() {
        let effort = effort();
        while effort.clone().fly::<f64>(1.0, Flight::Jets).is_ok() {}
        assert!(effort.is_spent());
        assert_eq!(effort.fly::<f64>(0.0, Flight::Numbers), Err(OrbitError::SearchTooLong));
        effort.clone().renew();
        assert!(effort.fly::<f64>(1.0, Flight::Jets).is_ok());
    }
}
