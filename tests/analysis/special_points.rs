//! Special points of branches of direct simulation for random linear oscillators, against exact
//! flight between impacts and Foale's closed form of orbits with one impact.

use std::f64::consts::TAU;

use grazemap::analysis::NoProgress;
use grazemap::analysis::branches::{BranchLabel, BranchRequest};
use grazemap::analysis::periodic::{ContactItinerary, FoundOrbit};
use grazemap::numeric::Dd;
use grazemap::prelude::{FindGraze, Map};

use crate::support::exact_flight::{Motion, Oscillator, drawn};
use crate::support::foale::Foale;
use crate::support::scenes::scene_with;
use crate::support::tiers;

/// Number of oscillators compared: of a part, and of the whole list.
const OSCILLATORS: [usize; 2] = [3, 100];
/// Longest itinerary that is followed, in returns.
const LONGEST: usize = 2;
/// Forcing periods of the orbits with one impact that are compared.
const PERIODS: usize = 3;
/// Slowest impact of a special point that must be found. Orbits nearer to the graze have fewer
/// digits: exact flight divides rounding by the square of the speed.
const SLOWEST: f64 = 1e-3;

/// Oscillator with the scene's map about its graze.
struct Case {
    oscillator: Oscillator,
    section: &'static str,
    map: Map,
    /// Grazing amplitude of the forcing; the section point follows.
    alpha: f64,
    point: Motion,
    range: [f64; 2],
}

impl Case {
    fn new(number: usize) -> Self {
        let omega = drawn(number, 0, [0.5, 3.5]);
        let (zeta, r) = (drawn(number, 1, [0.01, 0.15]), drawn(number, 2, [0.5, 0.95]));
        let section = ["\"tangency\"", "\"stroboscopic\""][number % 2];
        let (stiff, damped) = (1.0 - omega * omega, 2.0 * zeta * omega);
        let [z, w, e, a] = [zeta, omega, r, stiff.hypot(damped)].map(|value| format!("{value:e}"));
        // The graze at a positive amplitude.
        let guess = format!("{{ x = 1.0, v = 0.0, theta = {:e} }}", damped.atan2(stiff));
        // Only the window of the map is used.
        let set = [
            ("alpha", &*a),
            ("grazing.guess", &*guess),
            ("zeta", &*z),
            ("omega", &*w),
            ("r", &*e),
            ("section.kind", section),
            ("expansion.smooth_order", "2"),
            ("expansion.contact_weight", "3"),
        ];
        let graze = scene_with("linear", &set).graze().expect("a graze");
        let point = graze.orbit().section_point.iter().map(|value| value.to_f64());
        let [x, v, theta] = point.collect::<Vec<_>>()[..] else { panic!("three states") };
        let map = graze.map().expect("a map");
        let alpha = map.parameter("alpha").expect("a parameter");
        let oscillator = Oscillator { zeta, alpha, omega, stop: 1.0, r };
        let range = [-0.5, 0.8].map(|share| share * alpha);
        Self { oscillator, section, map, alpha, point: [x, v, theta], range }
    }

    /// Special points of the branches in the amplitude of the forcing.
    fn found(&self) -> Vec<(BranchLabel, FoundOrbit)> {
        let request = BranchRequest {
            itineraries: ContactItinerary::all(1, LONGEST).expect("short"),
            longest: LONGEST,
            along: 0,
            range: self.range,
            at: vec![0.0; self.map.local().parameters.len()],
            direct: true,
            starts: Vec::new(),
        };
        let found = self.map.branches(&request, &NoProgress).expect("branches");
        let points = found.branches.into_iter().flat_map(|branch| branch.points);
        points.filter_map(|point| Some((point.special?.label, point.orbit))).collect()
    }

    /// Forcing periods of an orbit.
    fn periods(orbit: &FoundOrbit) -> usize {
        (orbit.itinerary.period() as i32 + orbit.turns) as usize
    }

    /// Trace and determinant of an orbit by exact flight from its section point, and its impacts.
    fn checked(&self, orbit: &FoundOrbit) -> ([f64; 2], f64, Vec<[f64; 2]>) {
        let here = Oscillator { alpha: self.alpha + orbit.parameters[0], ..self.oscillator };
        let state = &orbit.states[0];
        let [x, v, theta] = self.point;
        let start = match self.section {
            "\"tangency\"" => [x + state[0], 0.0, theta + state[1]],
            _ => [x + state[0], v + state[1], theta],
        };
        let period = TAU / here.omega;
        let time = Self::periods(orbit) as f64 * period;
        // The impact is ahead, or it was before the section, which is reached as if there were no
        // stop.
        let ahead = here.impact(start, time).map(|(_, state)| state);
        let starts = [ahead, behind(&here, start, period)].into_iter().flatten();
        let starts = starts.filter(|[_, speed, _]| *speed > 0.0);
        let all = starts.map(|[_, speed, theta]| here.periodic([theta, speed], time));
        all.min_by(|a, b| a.1.total_cmp(&b.1)).expect("an impact")
    }

    /// Special points of the closed form of orbits with one impact that are orbits of exact flight
    /// too, with at most the followed number of returns.
    fn expected(&self) -> Vec<(BranchLabel, usize, [f64; 2])> {
        let Oscillator { zeta, omega, r, .. } = self.oscillator;
        let mut all = Vec::new();
        for periods in 1..=PERIODS {
            let time = periods as f64 * TAU / omega;
            let form = Foale::new(Dd::from(omega), Dd::from(zeta), Dd::from(r), periods);
            let speeds = [form.fold_speed(), form.flip_speed()].map(|speed| speed.to_f64());
            let labels = [BranchLabel::SaddleNode, BranchLabel::PeriodDoubling];
            for (label, speed) in labels.into_iter().zip(speeds) {
                let [alpha, theta] = self.oscillator.one_impact(speed, time);
                let here = Oscillator { alpha, ..self.oscillator };
                let within = (self.range[0]..self.range[1]).contains(&(alpha - self.alpha));
                let (_, apart, impacts) = here.periodic([theta, speed], time);
                let returns = match self.section {
                    "\"tangency\"" => 1 + here.maxima([1.0, -r * speed, theta], time),
                    _ => periods,
                };
                let is_one = apart < 1e-9 && impacts.len() == 1 && returns <= LONGEST;
                if speed > SLOWEST && within && is_one {
                    all.push((label, periods, [alpha, speed]));
                }
            }
        }
        all
    }
}

/// State at which free flight would have met the stop in the past, within a time.
fn behind(oscillator: &Oscillator, from: Motion, within: f64) -> Option<Motion> {
    let beyond = |time: f64| oscillator.flown(from, -time)[0] > oscillator.stop;
    let steps = 4000;
    let at = |step: usize| within * step as f64 / f64::from(steps);
    let (first, mut last) = (0..steps as usize).find_map(|step| {
        (beyond(at(step)) && !beyond(at(step + 1))).then(|| (at(step), at(step + 1)))
    })?;
    let mut inside = first;
    for _ in 0..80 {
        let middle = 0.5 * (inside + last);
        if beyond(middle) { inside = middle } else { last = middle }
    }
    Some(oscillator.flown(from, -last))
}

#[test]
fn special_points_of_random_oscillators_have_the_multipliers_of_their_labels_and_none_is_missing() {
    let count = tiers::count(OSCILLATORS[0], OSCILLATORS[1]);
    let (mut looked_at, mut compared, mut wrong) = (0, 0, Vec::new());
    for number in 0..count {
        let case = Case::new(number);
        let at = format!("{number}: {:?} {}", case.oscillator, case.section);
        let found = case.found();
        for (label, orbit) in &found {
            let claim = match label {
                BranchLabel::SaddleNode => 1.0,
                BranchLabel::PeriodDoubling => -1.0,
                _ => continue,
            };
            let ([trace, determinant], apart, impacts) = case.checked(orbit);
            let root = (0.25 * trace * trace - determinant).max(0.0).sqrt();
            let multipliers = [0.5 * trace - root, 0.5 * trace + root];
            let error = multipliers.map(|multiplier| (multiplier - claim).abs());
            let error = error[0].min(error[1]);
            looked_at += 1;
            let slowest = impacts.iter().fold(SLOWEST, |slowest, [_, speed]| slowest.min(*speed));
            if apart > 1e-8 || error > 1e-6 * (SLOWEST / slowest).powi(2) {
                wrong.push(format!("{at}: {label:?} {error:e} {apart:e} {impacts:?} {orbit:?}"));
            }
        }
        for (label, periods, [alpha, speed]) in case.expected() {
            compared += 1;
            let is_there = found.iter().any(|(other, orbit)| {
                *other == label
                    && Case::periods(orbit) == periods
                    && (case.alpha + orbit.parameters[0] - alpha).abs() < 1e-10 * alpha
                    && orbit.contacts.iter().any(|met| (met.speed - speed).abs() < 1e-8)
            });
            if !is_there {
                wrong.push(format!("{at}: no {label:?} of {periods} at {alpha} {speed}"));
            }
        }
    }
    println!("{count} oscillators: {looked_at} special points, {compared} by closed form");
    for line in &wrong {
        println!("{line}");
    }
    assert!(wrong.is_empty(), "{} wrong, the first: {}", wrong.len(), wrong[0]);
    assert!(looked_at > count && 2 * compared > count, "{looked_at} {compared}");
}
