//! Work of a search, counted in products of series, and its limit.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::outcome::{NotLocated, OrbitError};
use crate::flow::{Field, FlowError};
use crate::numeric::{Dd, Real, Scalar as _};

/// Work limit of a search, in products of series in `f64`: 2 to 5 s.
const MOST_PRODUCTS: u64 = 13_000_000;

/// Cost of a step of jets of degree one relative to a step of numbers; measured, for three to five
/// directions.
const OF_JETS: f64 = 16.0;

/// Number of steps of jets per step of numbers; measured.
const STEPS_OF_JETS: f64 = 2.5;

/// Cost of a step in double-double, with its longer series, relative to a step in `f64`; measured.
const IN_DOUBLE_DOUBLE: f64 = 20.0;

/// Quantity carried along a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flight {
    /// A state only.
    Numbers,
    /// A state with its derivatives, as jets of degree one.
    Jets,
}

/// Counter of the products of series that the flights of a search form.
///
/// A flight counts its steps and takes no more than are left: an iterate of Newton's method may
/// lead to a region where the flow is far slower than along the orbit, and derivatives, as of high
/// powers, may need far shorter steps than the state. Clones share one count.
#[derive(Clone, Debug)]
pub(super) struct Effort {
    /// Products of series in one step.
    products: u64,
    /// Limit on the products of all flights.
    most: u64,
    counts: Arc<Counts>,
}

/// Counts shared by clones.
#[derive(Debug, Default)]
struct Counts {
    /// Steps per unit of time in the last flight, as the bits of an `f64`.
    density: AtomicU64,
    /// Products formed so far.
    spent: AtomicU64,
}

impl Effort {
    /// A counter at zero, for flights along a field.
    pub(super) fn new(field: &Field) -> Self {
        let products = field.time_program().products().max(1) as u64;
        Self { products, most: MOST_PRODUCTS, counts: Arc::default() }
    }

    /// Sets the limit, in products of series.
    pub(super) fn within(self, most: u64) -> Self {
        Self { most, ..self }
    }

    /// Products formed so far.
    pub(super) fn spent(&self) -> u64 {
        self.counts.spent.load(Ordering::Relaxed)
    }

    /// Share of the limit used, from 0 to 1.
    pub(super) fn share(&self) -> f64 {
        (self.spent() as f64 / self.most as f64).min(1.0)
    }

    /// Estimated Taylor steps of a duration, from the density of the last flight.
    pub(super) fn steps(&self, duration: f64) -> u64 {
        (self.density() * duration).round() as u64
    }

    /// Largest number of steps of a period: with more, not even one flight with derivatives could
    /// end.
    pub(super) fn most_steps(&self) -> usize {
        (self.most as f64 / (OF_JETS * STEPS_OF_JETS)) as usize / self.products as usize
    }

    /// Counts a flight of numbers whose steps are known.
    pub(super) fn counted(&self, steps: usize, duration: f64) {
        self.count::<f64>(steps, duration, Flight::Numbers);
    }

    /// Runs a flight and counts its steps. `fly` receives the number of steps left, lowers it by
    /// the steps it takes, and may take no more.
    ///
    /// # Errors
    ///
    /// [`OrbitError::SearchTooLong`] if the limit is reached before the flight or during it;
    /// otherwise the error of `fly`.
    pub(super) fn fly<S: Real, T>(
        &self,
        duration: f64,
        of: Flight,
        fly: impl FnOnce(&mut usize) -> Result<T, OrbitError>,
    ) -> Result<T, OrbitError> {
        self.check()?;
        let most = (self.most - self.spent()) as f64 / self.products_of_step::<S>(of);
        let most = most.ceil() as usize;
        let mut steps_left = most;
        let flown = fly(&mut steps_left);
        let flown_time = match &flown {
            Err(OrbitError::Flow(FlowError::TooManySteps { remaining, .. })) => {
                duration.abs() - remaining.abs()
            }
            _ => duration.abs(),
        };
        self.count::<S>(most - steps_left, flown_time, of);
        match flown {
            Err(OrbitError::Flow(FlowError::TooManySteps { .. })) => Err(OrbitError::SearchTooLong),
            flown => flown,
        }
    }

    /// Checks the limit.
    ///
    /// # Errors
    ///
    /// [`OrbitError::SearchTooLong`] if the limit is reached.
    pub(super) fn check(&self) -> Result<(), OrbitError> {
        match self.is_spent() {
            true => Err(OrbitError::SearchTooLong),
            false => Ok(()),
        }
    }

    /// Whether the limit is reached.
    pub(super) fn is_spent(&self) -> bool {
        self.spent() >= self.most
    }

    /// Resets the count to zero.
    pub(super) fn renew(&self) {
        self.counts.spent.store(0, Ordering::Relaxed);
    }

    /// Reason to report for a search that reached its limit.
    pub(super) fn too_slow(&self, period: f64) -> NotLocated {
        NotLocated::TooSlow { steps: self.steps(period), products: self.products }
    }

    fn density(&self) -> f64 {
        f64::from_bits(self.counts.density.load(Ordering::Relaxed))
    }

    fn count<S: Real>(&self, steps: usize, duration: f64, of: Flight) {
        let density = steps as f64 / duration.abs();
        if density.is_finite() {
            self.counts.density.store(density.to_bits(), Ordering::Relaxed);
        }
        let products = steps as f64 * self.products_of_step::<S>(of);
        let products = products.min(self.most as f64 + 1.0);
        self.counts.spent.fetch_add(products as u64, Ordering::Relaxed);
    }

    /// Cost of a step, in products of numbers in `f64`.
    fn products_of_step<S: Real>(&self, of: Flight) -> f64 {
        let in_format = if S::ROUNDOFF <= Dd::ROUNDOFF { IN_DOUBLE_DOUBLE } else { 1.0 };
        let of_what = match of {
            Flight::Numbers => 1.0,
            Flight::Jets => OF_JETS,
        };
        self.products as f64 * in_format * of_what
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scene;

    fn mems() -> Field {
        let scene = Scene::of_catalogue("mems").expect("a valid scene");
        Field::free(&scene.model, &[])
    }

    /// Flies a number of steps.
    fn flight<S: Real>(effort: &Effort, steps: usize, of: Flight) -> Result<(), OrbitError> {
        effort.fly::<S, _>(1.0, of, |steps_left| {
            let (limit, taken) = (*steps_left, steps.min(*steps_left));
            *steps_left -= taken;
            match taken == steps {
                true => Ok(()),
                false => Err(FlowError::TooManySteps { limit, remaining: 0.5 }.into()),
            }
        })
    }

    /// Number of flights of a hundred steps before the limit.
    fn flights<S: Real>(of: Flight) -> usize {
        let effort = Effort::new(&mems());
        (0..).take_while(|_| flight::<S>(&effort, 100, of).is_ok()).count()
    }

    #[test]
    fn flights_of_jets_and_in_double_double_count_for_as_many_of_numbers_as_they_cost() {
        let (numbers, jets) = (flights::<f64>(Flight::Numbers), flights::<f64>(Flight::Jets));
        let precise = flights::<Dd>(Flight::Numbers);
        let ratio = |more: usize, less: usize| more as f64 / less as f64;
        assert!((ratio(numbers, jets) / OF_JETS - 1.0).abs() < 0.03, "{numbers} {jets}");
        let precision = ratio(numbers, precise) / IN_DOUBLE_DOUBLE;
        assert!((precision - 1.0).abs() < 0.03, "{numbers} {precise}");
    }

    #[test]
    fn clones_count_together_and_begin_anew_together() {
        let effort = Effort::new(&mems());
        while flight::<f64>(&effort.clone(), 1000, Flight::Jets).is_ok() {}
        assert!(effort.is_spent());
        assert_eq!(flight::<f64>(&effort, 0, Flight::Numbers), Err(OrbitError::SearchTooLong));
        effort.clone().renew();
        assert!(flight::<f64>(&effort, 1000, Flight::Jets).is_ok());
    }

    #[test]
    fn a_flight_that_needs_more_steps_than_are_left_ends_the_search_at_the_limit() {
        let effort = Effort::new(&mems());
        let endless = flight::<f64>(&effort, usize::MAX, Flight::Jets);
        assert_eq!(endless, Err(OrbitError::SearchTooLong));
        let most = MOST_PRODUCTS as f64 * 1.001;
        let spent = effort.counts.spent.load(Ordering::Relaxed) as f64;
        assert!(effort.is_spent() && spent < most, "{spent} {most}");
    }
}
