//! Orbits of maps: transient, kept states, contacts, escape, periods and the largest Lyapunov
//! exponent.

use std::ops::Range;

use super::discrete_map::{DiscreteMap, StepInfo};
use super::phase_circle::PhaseCircle;
use crate::interruption::check_at;

/// Settings of an orbit: its length, its bounds and the tolerances of its period.
#[derive(Clone, Debug, PartialEq)]
pub struct OrbitRequest {
    /// Iterates dropped first.
    pub transient: usize,
    /// Iterates kept.
    pub keep: usize,
    /// Half-width of the window per coordinate. States are compared in these units, or in the
    /// extent of the orbit where that is larger.
    pub scales: Vec<f64>,
    /// Largest allowed size of each coordinate; an orbit that exceeds one has escaped.
    pub escape: Vec<f64>,
    /// Coordinate that is a phase: values a period apart are the same.
    pub circle: PhaseCircle,
    /// States agree if they differ by at most this many half-widths in every coordinate.
    pub period_tolerance: f64,
    /// An orbit that still approaches a period has that period if states a period apart differ by
    /// at most this, in half-widths, and come closer along the orbit; 0 turns this rule off.
    pub approach_tolerance: f64,
}

impl OrbitRequest {
    /// A request with the defaults: escape at 1000 half-widths, periods to 1e-8 of them.
    ///
    /// Half-widths that are not finite and positive count as 1. The attractor of an oscillator may
    /// be much larger than the window of its map: [`escaping_at`](Self::escaping_at) sets bounds in
    /// another scale.
    pub fn new(transient: usize, keep: usize, scales: &[f64]) -> Self {
        let scale = |&scale: &f64| {
            if scale.is_finite() && scale > 0.0 { scale } else { 1.0 }
        };
        let scales: Vec<f64> = scales.iter().map(scale).collect();
        Self {
            transient,
            keep,
            escape: scales.iter().map(|scale| 1e3 * scale).collect(),
            scales,
            circle: PhaseCircle::none(),
            period_tolerance: 1e-8,
            approach_tolerance: 0.0,
        }
    }

    /// Accepts a period that the orbit still approaches, once states a period apart are within
    /// 1e-5.
    pub fn approaching(self) -> Self {
        Self { approach_tolerance: 1e-5, ..self }
    }

    /// Request for an orbit of the polynomial map, which means nothing far from the window: bounds
    /// are at most 1000 half-widths, and the phase is not reduced.
    pub fn near_the_window(&self) -> Self {
        let pairs = self.escape.iter().zip(&self.scales);
        let escape = pairs.map(|(bound, scale)| bound.min(1e3 * scale)).collect();
        Self { escape, circle: PhaseCircle::none(), ..self.clone() }
    }

    /// Multiplies the numbers of dropped and of kept iterates.
    pub(crate) fn longer(&self, times: usize) -> Self {
        Self { transient: times * self.transient, keep: times * self.keep, ..self.clone() }
    }

    /// Sets the phase of the section.
    pub fn on_circle(self, circle: PhaseCircle) -> Self {
        Self { circle, ..self }
    }

    /// Sets the bounds of an escape, one per coordinate.
    pub fn escaping_at(self, escape: &[f64]) -> Self {
        Self { escape: escape.to_vec(), ..self }
    }
}

/// Reason why an orbit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OrbitEnd {
    /// All iterates were made.
    Completed,
    /// A coordinate exceeded its bound.
    Escaped {
        /// Number of the iterate that exceeded it, counted from the initial state.
        iterate: usize,
    },
    /// An iterate has no finite image.
    NoImage {
        /// Number of the iterate that could not be computed.
        iterate: usize,
    },
}

/// An orbit of a map after its transient.
#[derive(Clone, Debug, PartialEq)]
pub struct MapOrbit {
    dimension: usize,
    circle: PhaseCircle,
    states: Vec<f64>,
    /// State before the first kept one; empty where none was kept.
    entry: Vec<f64>,
    /// Contacts, depth and turns of the step that led to each kept state.
    pub steps: Vec<StepInfo>,
    /// Last state reached (finite), from which a sweep continues.
    pub last: Vec<f64>,
    /// Reason why the orbit ended.
    pub end: OrbitEnd,
    /// Period of the kept states.
    pub period: Period,
    /// Whether the kept states have no period yet but come steadily nearer to one; always `false`
    /// if [`OrbitRequest::approach_tolerance`] is 0.
    pub converges: bool,
}

impl MapOrbit {
    /// Iterates a map from a state.
    ///
    /// # Panics
    ///
    /// If the lengths of the state, the parameters or the scales are not the map's.
    pub fn of(
        map: &(impl DiscreteMap + ?Sized),
        initial: &[f64],
        parameters: &[f64],
        request: &OrbitRequest,
    ) -> Self {
        let dimension = map.dimension();
        assert_eq!(
            (initial.len(), request.scales.len()),
            (dimension, dimension),
            "lengths of state and scales"
        );
        let mut orbit = Self::begin(initial, request);
        let mut image = vec![0.0; dimension];
        for iterate in 1..=request.transient + request.keep {
            check_at(iterate);
            let info = map.step(&orbit.last, parameters, &mut image);
            orbit.arrive(&image, info, request, iterate);
            if orbit.end != OrbitEnd::Completed {
                break;
            }
        }
        orbit.settle(request);
        orbit
    }

    /// Iterates several maps in lockstep, each from its own state.
    ///
    /// `step` receives the flags of the orbits that continue and all states, one after another; it
    /// writes the images of those orbits and the information on each step.
    pub fn in_step(
        initial: &[&[f64]],
        request: &OrbitRequest,
        mut step: impl FnMut(&[bool], &[f64], &mut [f64], &mut [StepInfo]),
    ) -> Vec<Self> {
        let begin = |state: &&[f64]| Self::begin(state, request);
        let mut orbits: Vec<Self> = initial.iter().map(begin).collect();
        let mut states = initial.concat();
        let mut images = states.clone();
        let dimension = initial.first().map_or(1, |state| state.len().max(1));
        let mut going = vec![true; orbits.len()];
        let mut infos = vec![StepInfo::default(); orbits.len()];
        for iterate in 1..=request.transient + request.keep {
            check_at(iterate);
            step(&going, &states, &mut images, &mut infos);
            let arrivals = images.chunks_exact(dimension).zip(&infos);
            for ((orbit, (image, info)), going) in orbits.iter_mut().zip(arrivals).zip(&mut going) {
                if *going {
                    orbit.arrive(image, *info, request, iterate);
                    *going = orbit.end == OrbitEnd::Completed;
                }
            }
            if !going.contains(&true) {
                break;
            }
            std::mem::swap(&mut states, &mut images);
        }
        orbits.iter_mut().for_each(|orbit| orbit.settle(request));
        orbits
    }

    /// An orbit before its first iterate.
    pub(super) fn begin(initial: &[f64], request: &OrbitRequest) -> Self {
        let keep = request.keep;
        Self {
            dimension: initial.len(),
            circle: request.circle,
            states: Vec::with_capacity(keep * initial.len()),
            entry: Vec::new(),
            steps: Vec::with_capacity(keep),
            last: initial.to_vec(),
            end: OrbitEnd::Completed,
            period: Period::NotFound,
            converges: false,
        }
    }

    /// Appends an image of the last state, unless it ends the orbit.
    pub(super) fn arrive(
        &mut self,
        image: &[f64],
        info: StepInfo,
        request: &OrbitRequest,
        iterate: usize,
    ) {
        if let Some(end) = leaves(image, info, request, iterate) {
            self.end = end;
            return;
        }
        if iterate == request.transient + 1 {
            self.entry.clone_from(&self.last);
        }
        self.last.copy_from_slice(image);
        if iterate > request.transient {
            self.keep(image.iter().copied(), info);
        }
    }

    /// Stores the state before the first kept one.
    pub(super) fn enter(&mut self, state: impl Iterator<Item = f64>) {
        self.entry.extend(state);
    }

    /// Appends an image to the kept states.
    pub(super) fn keep(&mut self, image: impl Iterator<Item = f64>, info: StepInfo) {
        self.states.extend(image);
        self.steps.push(info);
    }

    /// Finds the period of a completed orbit. States are compared in half-widths of the window, or
    /// in the orbit's own extent where that is larger.
    pub(super) fn settle(&mut self, request: &OrbitRequest) {
        if self.end == OrbitEnd::Completed {
            let pairs = self.extent().into_iter().zip(&request.scales);
            let scales = pairs.map(|([least, greatest], &scale)| scale.max(greatest - least));
            let scales: Vec<f64> = scales.collect();
            let run = Run { states: &self.states, scales: &scales, circle: self.circle };
            self.period = run.period(request.period_tolerance);
            if self.period == Period::NotFound {
                self.period = run.approached(request.approach_tolerance);
            }
            let asked = self.period == Period::NotFound && request.approach_tolerance > 0.0;
            self.converges = asked && run.converges();
        }
    }

    /// Least and greatest value of every coordinate over the kept states, which are finite. For a
    /// phase, the ends of the shortest arc that holds all values; the first end lies within half a
    /// period of 0.
    pub fn extent(&self) -> Vec<[f64; 2]> {
        const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let wider = |[least, greatest]: [f64; 2], [low, high]: [f64; 2]| {
            [if low < least { low } else { least }, if high > greatest { high } else { greatest }]
        };
        // Four partial extents in turn: with one, each state would wait for the one before.
        let mut parts = vec![[NOTHING; 4]; self.dimension];
        for (number, state) in self.states().enumerate() {
            for (parts, &value) in parts.iter_mut().zip(state) {
                let part = &mut parts[number % 4];
                *part = wider(*part, [value, value]);
            }
        }
        let whole = |(place, parts): (usize, [[f64; 2]; 4])| {
            let extent = parts.into_iter().fold(NOTHING, wider);
            self.circle.arc(place, extent, self.states().map(|state| state[place]))
        };
        parts.into_iter().enumerate().map(whole).collect()
    }

    /// Coordinate that is a phase: values a period apart are the same.
    pub fn circle(&self) -> PhaseCircle {
        self.circle
    }

    /// Whole periods of the phase in one period of the orbit, beyond the nominal ones; 0 without a
    /// period.
    pub fn turns(&self) -> i32 {
        match self.period {
            // The step to the first state belongs to the period before.
            Period::Periodic(period) => {
                let own = self.steps.iter().skip(1).take(period);
                own.fold(0, |sum: i32, step| sum.saturating_add(step.turns))
            }
            Period::NotFound => 0,
        }
    }

    /// Kept states, in order.
    pub fn states(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.states.chunks_exact(self.dimension.max(1))
    }

    /// States from which the kept ones were reached, in order.
    pub fn origins(&self) -> impl Iterator<Item = &[f64]> {
        let first = (!self.entry.is_empty()).then_some(&self.entry[..]);
        first.into_iter().chain(self.states()).take(self.steps.len())
    }

    /// Contacts per period; `None` without a period.
    pub fn contacts_per_period(&self) -> Option<ContactsPerPeriod> {
        ContactsPerPeriod::of(self.period, &self.steps)
    }
}

/// End of an orbit at an image that is not finite or out of bounds; `None` if the orbit goes on.
fn leaves(
    image: &[f64],
    info: StepInfo,
    request: &OrbitRequest,
    iterate: usize,
) -> Option<OrbitEnd> {
    if !info.valid {
        return Some(OrbitEnd::NoImage { iterate });
    }
    let outside = image.iter().zip(&request.escape).any(|(value, &bound)| value.abs() > bound);
    outside.then_some(OrbitEnd::Escaped { iterate })
}

/// Period of an orbit, in iterates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Period {
    /// The states repeat after this many iterates, and after none fewer.
    Periodic(usize),
    /// No period up to half the number of states.
    NotFound,
}

impl Period {
    /// The period of a run of states (`dimension` numbers each, one state after another), one of
    /// whose coordinates may be a phase.
    ///
    /// States agree if every coordinate agrees to `tolerance` times its scale. A period is accepted
    /// if *all* states agree with those a period later, and the run holds it at least twice. States
    /// may agree less where rounding grows, if they agree to rounding once in every period. An
    /// orbit that approaches a period while it turns about it seems to have a multiple of that
    /// period: twice of it near a multiplier −1, `q` times near a `q`-th root of 1. The result is
    /// therefore the least divisor of the period by which states come closer along the run.
    pub fn of(states: &[f64], scales: &[f64], circle: PhaseCircle, tolerance: f64) -> Self {
        Run { states, scales, circle }.period(tolerance)
    }
}

/// A distance of states has shrunk if it is below this share of its first value.
const SHRUNK: f64 = 0.95;

/// Largest distance, in scales, of states a period apart in an orbit that converges.
const NEARBY: f64 = 0.1;

/// Largest distance, in scales, of states that agree to rounding, and of those to which it grows
/// within a period.
const ROUNDING: f64 = 1e-13;
const GROWN: f64 = 1e-4;

/// Fewest and most parts of a run; the distance of states has to fall from each part to the next.
const PARTS: [usize; 2] = [4, 8];

/// Consecutive states, with the scales of their coordinates and the phase among them.
struct Run<'a> {
    states: &'a [f64],
    scales: &'a [f64],
    circle: PhaseCircle,
}

impl Run<'_> {
    /// Period of the run, by the rules of [`Period::of`].
    fn period(&self, tolerance: f64) -> Period {
        let agree = |shift: usize| {
            let mut states = 0..self.count() - shift;
            let all = states.all(|number| self.apart(number, shift) <= tolerance);
            all || self.is_forgetful(shift)
        };
        self.without_approach((1..=self.count() / 2).find(|&shift| agree(shift)))
    }

    /// Whether states repeat after `shift` up to rounding that grows and is forgotten once in every
    /// period, as where a mass comes to rest against a stop: states agree to rounding in the first
    /// and in the last period of the run, and nearly agree everywhere.
    fn is_forgetful(&self, shift: usize) -> bool {
        let pairs = self.count() - shift;
        let repeats = |number: usize| self.apart(number, shift) <= ROUNDING;
        (0..pairs).all(|number| self.apart(number, shift) <= GROWN)
            && (0..shift).any(repeats)
            && (pairs - shift..pairs).any(repeats)
    }

    /// The period found, or its least divisor by which states come closer along the run. An
    /// approach that turns by `1/q` of a circle in each period nearly repeats after `q` periods
    /// (two if it alternates).
    fn without_approach(&self, found: Option<usize>) -> Period {
        let Some(period) = found else { return Period::NotFound };
        let is_approached = |&part: &usize| period % part == 0 && self.comes_closer(part, period);
        Period::Periodic((1..period).find(is_approached).unwrap_or(period))
    }

    /// Least period that the run approaches. States a period apart agree to `tolerance`, and come
    /// closer from the first half of the run to the second; each half holds the period at least
    /// once. If the run approaches a divisor of it too, the least such divisor is the result, as in
    /// [`period`](Self::period).
    fn approached(&self, tolerance: f64) -> Period {
        let approaches = |&shift: &usize| {
            let pairs = self.count() - shift;
            let first = self.distance(shift, 0..pairs / 2);
            first <= tolerance && self.distance(shift, pairs - pairs / 2..pairs) < SHRUNK * first
        };
        self.without_approach((1..=self.count() / 3).find(approaches))
    }

    /// Whether the distance of states some period apart falls along the whole run: in each of four
    /// to eight parts it is less than in the part before.
    fn converges(&self) -> bool {
        let comes_nearer = |&shift: &usize| {
            let pairs = self.count() - shift;
            let parts = (pairs / shift).min(PARTS[1]);
            let end = |part: usize| part * pairs / parts;
            let mut before = NEARBY;
            (0..parts).all(|part| {
                let distance = self.distance(shift, end(part)..end(part + 1));
                std::mem::replace(&mut before, distance) > distance
            })
        };
        (1..=self.count() / (PARTS[0] + 1)).any(|shift| comes_nearer(&shift))
    }

    fn count(&self) -> usize {
        self.states.len() / self.scales.len().max(1)
    }

    /// Distance, in scales, of a state from the one `shift` later; NaN if a coordinate is NaN.
    fn apart(&self, number: usize, shift: usize) -> f64 {
        let dimension = self.scales.len();
        let state = |number: usize| &self.states[number * dimension..(number + 1) * dimension];
        self.circle.apart(state(number), state(number + shift), self.scales)
    }

    /// Largest distance of these states from those `shift` later.
    fn distance(&self, shift: usize, states: Range<usize>) -> f64 {
        states.map(|number| self.apart(number, shift)).fold(0.0, f64::max)
    }

    /// Whether states `part` iterates apart come closer from the first period of the run to the
    /// last.
    fn comes_closer(&self, part: usize, period: usize) -> bool {
        let count = self.count();
        if count < part + 2 * period {
            return false;
        }
        let first = self.distance(part, 0..period);
        let last = self.distance(part, count - part - period..count - part);
        last < SHRUNK * first
    }
}

/// Contacts in one period, printed `contacts/period`, for instance `1/3`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub struct ContactsPerPeriod {
    /// Contacts in one period of the orbit.
    pub contacts: u32,
    /// Period in iterates.
    pub period: usize,
}

impl ContactsPerPeriod {
    /// Contacts of a periodic run; `None` without a period.
    pub fn of(period: Period, steps: &[StepInfo]) -> Option<Self> {
        match period {
            Period::Periodic(period) => {
                let contacts = steps.iter().take(period).map(StepInfo::contacts).sum();
                Some(Self { contacts, period })
            }
            Period::NotFound => None,
        }
    }
}

impl std::fmt::Display for ContactsPerPeriod {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.contacts, self.period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The logistic map `x ↦ p x (1 − x)`; a contact is counted where `x > 1/2`.
    struct Logistic;

    impl DiscreteMap for Logistic {
        fn dimension(&self) -> usize {
            1
        }
        fn parameters(&self) -> usize {
            1
        }
        fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
            let mut info = StepInfo::default();
            info.add_passage(0, state[0] - 0.5);
            image[0] = parameters[0] * state[0] * (1.0 - state[0]);
            info.checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            jacobian[0] = parameters[0] * (1.0 - 2.0 * state[0]);
            self.step(state, parameters, image)
        }
    }

    fn period_of(states: &[f64], scales: &[f64], tolerance: f64) -> Period {
        Period::of(states, scales, PhaseCircle::none(), tolerance)
    }

    #[test]
    fn the_logistic_map_doubles_its_period() {
        let request = OrbitRequest::new(5000, 64, &[1.0]);
        let period = |p: f64| MapOrbit::of(&Logistic, &[0.3], &[p], &request).period;
        assert_eq!([2.8, 3.2, 3.5, 3.83].map(period), [1, 2, 4, 3].map(Period::Periodic));
        assert_eq!(period(3.9), Period::NotFound);
    }

    #[test]
    fn contacts_are_counted_per_period() {
        let orbit = MapOrbit::of(&Logistic, &[0.3], &[3.2], &OrbitRequest::new(5000, 10, &[1.0]));
        let label = orbit.contacts_per_period().map(|label| label.to_string());
        assert_eq!(label.as_deref(), Some("2/2")); // both states, 0.513 and 0.799, exceed 1/2
        assert_eq!(orbit.states().len(), 10);
    }

    #[test]
    fn escapes_are_outcomes() {
        let request = OrbitRequest::new(10, 10, &[1.0]);
        assert_eq!(
            MapOrbit::of(&Logistic, &[-40.0], &[3.0], &request).end,
            OrbitEnd::Escaped { iterate: 1 }
        );
        let infinite = MapOrbit::of(&Logistic, &[f64::MAX], &[3.0], &request);
        assert_eq!(infinite.end, OrbitEnd::NoImage { iterate: 1 });
        assert_eq!(infinite.last, [f64::MAX]);
    }

    #[test]
    fn the_largest_lyapunov_exponent_of_the_full_logistic_map_is_log_two() {
        let exponent =
            super::super::largest_lyapunov_exponent(&Logistic, &[0.3], &[4.0], 100, 100_000);
        // The mean of ln|f'| over 1e5 iterates scatters by about 3e-3.
        let value = exponent.expect("a finite orbit").value;
        assert!((value - 2.0f64.ln()).abs() < 0.01, "{exponent:?}");
        let stable = super::super::largest_lyapunov_exponent(&Logistic, &[0.3], &[2.5], 1000, 100);
        // f' = 2 − p
        let value = stable.expect("a finite orbit").value;
        assert!((value - 0.5f64.ln()).abs() < 1e-10, "{stable:?}");
    }

    #[test]
    fn the_smallest_period_is_found() {
        let states: Vec<f64> = (0..12).flat_map(|n| [f64::from(n % 3), 1.0]).collect();
        assert_eq!(period_of(&states, &[1.0, 1.0], 1e-9), Period::Periodic(3));
        assert_eq!(period_of(&states, &[1e12, 1.0], 1e-9), Period::Periodic(1));
    }

    #[test]
    fn a_slow_alternating_approach_has_the_period_it_approaches() {
        // Period 3, approached by a factor of −0.99 every three iterates, from 1e-3 of its scale.
        let approach = |n: i32| 1e-3 * (-0.99_f64).powi(n / 3);
        let states: Vec<f64> = (0..200).map(|n| f64::from(n % 3) + approach(n)).collect();
        assert_eq!(period_of(&states, &[1.0], 1e-4), Period::Periodic(3));
    }

    #[test]
    fn an_approach_that_is_still_under_way_has_the_period_it_approaches() {
        // Period 3, approached by a factor of 0.9 and a turn in every iterate, from 1e-6.
        let spiral = |n: i32| 1e-6 * 0.9_f64.powi(n) * (1.3 * f64::from(n)).cos();
        let states: Vec<f64> = (0..64).map(|n| 1e-3 * f64::from(n % 3) + spiral(n)).collect();
        assert_eq!(period_of(&states, &[1.0], 1e-8), Period::NotFound);
        let approached = |states: &[f64], tolerance: f64| {
            Run { states, scales: &[1.0], circle: PhaseCircle::none() }.approached(tolerance)
        };
        assert_eq!(approached(&states, 1e-5), Period::Periodic(3));
        assert_eq!(approached(&states, 0.0), Period::NotFound);
        // States that do not come closer have no period, however small their distance is.
        let turns: Vec<f64> = (0..64).map(|n| 1e-6 * (1.3 * f64::from(n)).cos()).collect();
        assert_eq!(approached(&turns, 1e-5), Period::NotFound);
    }

    #[test]
    fn an_approach_that_turns_has_the_period_it_approaches() {
        // The distance falls by 0.98 in every period, with a part of a turn: states as many periods
        // apart as the turn takes differ by at most 1e-5, those one period apart by 1e-4.
        let turn = |n: i32, turns: i32| {
            let angle = std::f64::consts::TAU / f64::from(turns);
            1e-4 * 0.98_f64.powi(n) * (angle * f64::from(n)).cos()
        };
        for (period, turns) in [(1, 2), (2, 2), (3, 2), (1, 3), (1, 5), (2, 5)] {
            let run = |offset: &dyn Fn(i32) -> f64| {
                let states = (0..120).map(|n| f64::from(n % period) + offset(n / period));
                let states: Vec<f64> = states.collect();
                let run = Run { states: &states, scales: &[1.0], circle: PhaseCircle::none() };
                [run.period(1e-5), run.approached(1e-5)]
            };
            let approached = run(&|n| turn(n, turns));
            assert_eq!(approached, [Period::Periodic(period as usize); 2], "{period} {turns}");
            // An orbit of that multiple of the period does not come closer to the period itself.
            let multiple = run(&|n| 1e-3 * f64::from(n % turns) + 1e-6 * 0.9_f64.powi(n));
            let whole = (turns * period) as usize;
            assert_eq!(multiple[1], Period::Periodic(whole), "{period} {turns}");
        }
    }

    #[test]
    fn an_orbit_near_a_flip_converges_and_a_chaotic_one_does_not() {
        // The logistic map doubles its period at p = 3, where orbits approach it as n^(-1/2).
        let request = OrbitRequest::new(400, 64, &[1.0]).approaching();
        let orbit = |p: f64| MapOrbit::of(&Logistic, &[0.3], &[p], &request);
        for p in [2.995, 3.0] {
            assert_eq!((orbit(p).period, orbit(p).converges), (Period::NotFound, true), "{p}");
        }
        // Bands of chaos exist from 3.5699 on; at first they are many and narrow.
        let chaotic = (0..200).map(|number| 3.572 + 0.002 * f64::from(number)).map(orbit);
        let taken = chaotic.filter(|orbit| orbit.period == Period::NotFound);
        let taken: Vec<bool> = taken.map(|orbit| orbit.converges).collect();
        let wrong = taken.iter().filter(|&&converges| converges).count();
        assert!(taken.len() > 120 && wrong <= taken.len() / 50, "{wrong} of {}", taken.len());
    }

    #[test]
    fn rounding_that_is_forgotten_in_every_period_leaves_the_period() {
        let unit = |n: i32| f64::from(n % 5) + 0.3;
        // Rounding of another size in every period, which grows thirtyfold in every iterate of it.
        let grown = |n: i32| f64::from(1 + n / 5 % 3) * 3e-15 * 30_f64.powi(n % 5);
        let forgotten: Vec<f64> = (0..40).map(|n| unit(n) + grown(n)).collect();
        assert_eq!(period_of(&forgotten, &[1.0], 1e-10), Period::Periodic(5));
        // Rounding that is never forgotten: an orbit that begins on an unstable one and leaves it.
        let leaving: Vec<f64> = (0..40).map(|n| unit(n) + 3e-15 * 1.8_f64.powi(n)).collect();
        assert_eq!(period_of(&leaving, &[1.0], 1e-10), Period::NotFound);
        // An orbit that comes back to a state exactly, but by other ways.
        let other = |n: i32| if n % 5 == 2 && n / 5 % 2 == 0 { 0.01 } else { 0.0 };
        let ways: Vec<f64> = (0..20).map(|n| unit(n) + other(n)).collect();
        assert_eq!(period_of(&ways, &[1.0], 1e-10), Period::Periodic(10));
    }

    #[test]
    fn a_doubled_period_is_kept() {
        let states: Vec<f64> =
            (0..200).map(|n| f64::from(n % 3) + 1e-3 * f64::from(n / 3 % 2)).collect();
        assert_eq!(period_of(&states, &[1.0], 1e-4), Period::Periodic(6));
    }

    #[test]
    fn a_drift_has_no_period() {
        let states: Vec<f64> = (0..50).map(|n| f64::from(n) * 1e-3).collect();
        assert_eq!(period_of(&states, &[1.0], 1e-6), Period::NotFound);
        assert_eq!(period_of(&[], &[1.0], 1e-6), Period::NotFound);
    }
}
