//! Derivatives of states after impacts, against the closed form of linear free flight in jets.
//!
//! The closed form shares nothing with the program but the algebra of jets: no integrator, no
//! series in time, no event search.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::sync::Arc;

use grazemap::expansion::sides_of_graze;
use grazemap::hybrid::{HybridSystem, Simulator};
use grazemap::jet::{Jet, JetSpace};
use grazemap::model::Scene;
use grazemap::numeric::Dd;
use grazemap::orbit::{DerivativesError, PiecewiseFlow, jets_along, watched_jets_along};

use crate::support::scenes::{NONE, index, orbit, parsed};

/// Oscillator `x'' + 2 zeta x' + x = a cos(theta)` above a stop at `-dl`.
const ONE_STOP: &str = r#"
[model]
name = "oscillator with one stop"
states = ["x", "v"]
parameters = { zeta = 0.05, a = 1.0, w = 0.8, dl = 0.5, r = 0.7 }
[model.phase]
name = "theta"
rate = "w"
period = "2*pi"
[model.flow]
x = "v"
v = "a*cos(theta) - 2*zeta*v - x"
[[model.surface]]
name = "left"
event = "x + dl"
impact = { v = "-r*v" }
[grazing]
solve_for = "dl"
"#;

/// Closed form over jets; the parameters are `zeta`, `w`, `dl`, `r`, and `a` is 1.
struct ClosedForm {
    zeta: Jet<Dd>,
    w: Jet<Dd>,
    dl: Jet<Dd>,
    r: Jet<Dd>,
}

type Motion = [Jet<Dd>; 3];

impl ClosedForm {
    fn constant(&self, value: f64) -> Jet<Dd> {
        Jet::constant(self.w.space(), Dd::from(value))
    }

    fn forced(&self, theta: &Jet<Dd>) -> [Jet<Dd>; 2] {
        let one = self.constant(1.0);
        let (c, d) = (&one - &(&self.w * &self.w), (&self.zeta * &self.w).scale(Dd::from(2.0)));
        let size = &one / &(&(&c * &c) + &(&d * &d));
        let (sin, cos) = theta.sin_cos();
        let along = &size * &(&(&c * &cos) + &(&d * &sin));
        let across = &(&size * &self.w) * &(&(&d * &cos) - &(&c * &sin));
        [along, across]
    }

    fn fly(&self, [x, v, theta]: &Motion, time: &Jet<Dd>) -> Motion {
        let [px, pv] = self.forced(theta);
        let (x, v) = (x - &px, v - &pv);
        let rate = (&self.constant(1.0) - &(&self.zeta * &self.zeta)).sqrt();
        let (sin, cos) = (&rate * time).sin_cos();
        let decay = (-&(&self.zeta * time)).exp();
        let b = &(&v + &(&self.zeta * &x)) / &rate;
        let along = &decay * &(&(&x * &cos) + &(&b * &sin));
        let across = &(&decay * &rate) * &(&(&b * &cos) - &(&x * &sin));
        let across = &across - &(&self.zeta * &along);
        let theta = theta + &(&self.w * time);
        let [px, pv] = self.forced(&theta);
        [&along + &px, &across + &pv, theta]
    }

    /// Time of the first hit before `limit`: samples and bisection for its value, Newton's method
    /// for its jet.
    fn hit(&self, state: &Motion, limit: f64) -> Option<Jet<Dd>> {
        const SAMPLES: usize = 2000;
        let value = |time: f64| {
            let there = self.fly(state, &self.constant(time));
            (&there[0] + &self.dl).head().to_f64()
        };
        let at = |number: usize| limit * number as f64 / SAMPLES as f64;
        let place = (1..SAMPLES).find(|&n| value(at(n)) > 0.0 && value(at(n + 1)) <= 0.0)?;
        let (mut low, mut high) = (at(place), at(place + 1));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if value(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(self.hit_near(state, Dd::from(0.5 * (low + high))))
    }

    /// Time of a hit near a time, by Newton's method.
    fn hit_near(&self, state: &Motion, time: Dd) -> Jet<Dd> {
        let mut time = Jet::constant(self.w.space(), time);
        for _ in 0..10 {
            let there = self.fly(state, &time);
            time = &time - &(&(&there[0] + &self.dl) / &there[1]);
        }
        time
    }

    /// Flies for a time; returns the state and the times of the hits.
    fn through(&self, start: &Motion, time: &Jet<Dd>) -> (Motion, Vec<Jet<Dd>>) {
        let (mut state, mut elapsed, mut hits) = (start.clone(), self.constant(0.0), Vec::new());
        while let Some(wait) = self.hit(&state, (time - &elapsed).head().to_f64()) {
            state = self.fly(&state, &wait);
            state[1] = -&(&self.r * &state[1]);
            elapsed = &elapsed + &wait;
            hits.push(elapsed.clone());
        }
        (self.fly(&state, &(time - &elapsed)), hits)
    }
}

/// Closed form and start with the variables `x, v, theta, w, dl, r`, as the program orders them.
fn closed(space: &Arc<JetSpace>, start: [f64; 3]) -> (ClosedForm, Motion) {
    let decimal = |text: &str| text.parse::<Dd>().expect("a number");
    let variable = |number, text: &str| Jet::variable(space, number, decimal(text));
    let form = ClosedForm {
        zeta: Jet::constant(space, decimal("0.05")),
        w: variable(3, "0.8"),
        dl: variable(4, "0.5"),
        r: variable(5, "0.7"),
    };
    let mut numbers = start.into_iter().enumerate();
    let state = [(); 3].map(|()| {
        let (number, value) = numbers.next().expect("three components");
        Jet::variable(space, number, Dd::from(value))
    });
    (form, state)
}

fn scene() -> (Scene, Vec<usize>) {
    let scene = parsed(ONE_STOP, "one_stop", &NONE);
    let free = ["w", "dl", "r"].map(|name| index(&scene, name)).to_vec();
    (scene, free)
}

/// Largest difference of two jets, relative to the largest coefficient of their degree.
fn difference(a: &Jet<Dd>, b: &Jet<Dd>) -> f64 {
    let [a, b] = [a, b].map(std::slice::from_ref);
    differences(a, b).into_iter().fold(0.0, f64::max)
}

/// Largest difference of each degree of two lists of jets, relative to the largest coefficient of
/// the degree in the list.
fn differences(a: &[Jet<Dd>], b: &[Jet<Dd>]) -> Vec<f64> {
    let degrees = 0..=a[0].space().order();
    let of_degree = degrees.map(|degree| {
        let terms = a[0].space().degree_range(degree);
        let coefficients = |jets: &[Jet<Dd>]| -> Vec<Dd> {
            jets.iter().flat_map(|jet| jet.coefficients()[terms.clone()].to_vec()).collect()
        };
        let [a, b] = [a, b].map(coefficients);
        let size = a.iter().fold(1e-3_f64, |size, value| size.max(value.to_f64().abs()));
        let pairs = a.iter().zip(&b);
        pairs.fold(0.0_f64, |most, (a, b)| most.max((*a - *b).to_f64().abs())) / size
    });
    of_degree.collect()
}

#[test]
fn derivatives_after_five_impacts_are_those_of_the_closed_form() {
    let (scene, free) = scene();
    let space = JetSpace::uniform(6, 3).unwrap();
    let start = [0.0, 0.3, 0.0];
    let (form, state) = closed(&space, start);
    let time = 24.0;
    let (end, hits) = form.through(&state, &form.constant(time));
    assert_eq!(hits.len(), 5);
    let found = jets_along(&scene, &start.map(Dd::from), &free, (Some(Dd::from(time)), 0), 3);
    let found = found.expect("derivatives");
    assert_eq!(found.events.len(), hits.len());
    let times: Vec<Jet<Dd>> = found.events.iter().map(|event| event.time.clone()).collect();
    for (found, known) in [(&found.state[..], &end[..]), (&times, &hits)] {
        let differences = differences(found, known);
        assert!(differences.iter().all(|difference| *difference < 5e-29), "{differences:?}");
    }
}

#[test]
fn derivatives_of_a_return_know_that_its_time_depends_on_the_frequency() {
    let (scene, free) = scene();
    let space = JetSpace::uniform(6, 2).unwrap();
    let start = [0.2, 0.1, 0.4];
    let (form, state) = closed(&space, start);
    let periods = &Jet::constant(&space, Dd::PI * Dd::from(6.0)) / &form.w;
    let (end, _) = form.through(&state, &periods);
    let found = jets_along(&scene, &start.map(Dd::from), &free, (None, 3), 2).expect("derivatives");
    for (found, known) in found.state.iter().zip(&end) {
        assert!(difference(found, known) < 1e-25, "{:e}", difference(found, known));
    }
}

#[test]
fn a_shallow_contact_has_large_and_right_derivatives() {
    let (scene, free) = scene();
    let space = JetSpace::uniform(6, 3).unwrap();
    // A drop from rest beside the stop: the velocity there is chosen so that x goes 1e-10 beyond.
    let grazing = parsed(ONE_STOP, "one_stop", &NONE);
    let orbit = orbit(&grazing);
    let place = index(&grazing, "dl");
    let shallow = orbit.parameters()[place] - Dd::from(1e-10);
    let mut scene = scene;
    scene.model.parameters[place].value = shallow;
    let graze = &orbit.grazing_point().state;
    let start = [graze[0], graze[1], graze[2]];
    let (mut form, _) = closed(&space, [0.0; 3]);
    form.dl = Jet::variable(&space, 4, shallow);
    let start_jets = [0, 1, 2].map(|at| Jet::variable(&space, at, start[at]));
    // From half a period before the graze.
    let half = orbit.period * Dd::from(0.5);
    let before = form.fly(&start_jets, &Jet::constant(&space, half)).map(|jet| jet.head());
    let state = [0, 1, 2].map(|at| Jet::variable(&space, at, before[at]));
    let time = half + Dd::from(1.0);
    // The stay beyond the stop is far shorter than a sample of the closed form.
    let ahead = (Dd::from(2e-10) / orbit.grazing_point().normal_acceleration).sqrt();
    let wait = form.hit_near(&state, half - ahead);
    let mut met = form.fly(&state, &wait);
    met[1] = -&(&form.r * &met[1]);
    let end = form.fly(&met, &(&Jet::constant(&space, time) - &wait));
    let found = jets_along(&scene, &before, &free, (Some(time), 0), 3).expect("derivatives");
    assert_eq!(found.events.len(), 1);
    assert!(found.state[1].max_abs_of_degree(1) > 1e4, "a derivative grows as 1/y");
    for (found, known) in found.state.iter().zip(&end) {
        // Newton's method of the closed form divides by a speed of 1e-5, three orders deep.
        assert!(difference(found, known) < 1e-12, "{:e}", difference(found, known));
    }
}

#[test]
fn a_trajectory_that_grazes_or_starts_beyond_a_stop_has_no_derivatives() {
    let (_, free) = scene();
    let grazing = parsed(ONE_STOP, "one_stop", &NONE);
    let orbit = orbit(&grazing);
    let mut at_graze = grazing.clone();
    for (parameter, &value) in at_graze.model.parameters.iter_mut().zip(orbit.parameters()) {
        parameter.value = value;
    }
    let graze = &orbit.grazing_point().state;
    let span = (Some(orbit.period * Dd::from(1.5)), 0);
    let refused = jets_along(&at_graze, graze, &free, span, 1).unwrap_err();
    assert!(matches!(refused, DerivativesError::Grazes { .. }), "{refused}");
    let below = [-Dd::ONE, Dd::ZERO, Dd::ZERO];
    let refused = jets_along(&grazing, &below, &free, (Some(Dd::ONE), 0), 1).unwrap_err();
    assert!(matches!(refused, DerivativesError::StartsBeyond { .. }), "{refused}");
}

/// Compares the series on both sides of a graze with direct simulation: along a direction, `δ` and
/// `δ/4` before and beyond the graze, errors fall as `δ^{N+1}` without and `δ^{N+1/2}` with contact.
fn sides_agree(scene: &Scene, free: &[usize], start: &[Dd], time: Dd, order: u32) {
    let span = (Some(time), 0);
    let sides = sides_of_graze(scene, (start, free), span, order, &|_| {}).expect("sides");
    let sides = sides.expect("a graze");
    let along: Vec<f64> = [0.7, -0.4, 0.3, 0.5, -0.6, 0.2][..start.len() + free.len()].to_vec();
    let error = |size: f64| {
        let offsets: Vec<Dd> = along.iter().map(|way| Dd::from(size * way)).collect();
        let mut moved = scene.clone();
        for (&parameter, &offset) in free.iter().zip(&offsets[start.len()..]) {
            moved.model.parameters[parameter].value += offset;
        }
        let state: Vec<Dd> = start.iter().zip(&offsets).map(|(a, b)| *a + *b).collect();
        let system = HybridSystem::new(&moved.model);
        let simulator = Simulator::new(&system, &moved.model.parameter_values());
        let mut simulator = simulator.expect("finite parameters");
        simulator.set_state(&state).expect("a finite state");
        simulator.run(time).expect("a flight");
        let depth = sides.depth.evaluate(&offsets);
        let series = |place: usize| match depth > Dd::ZERO {
            true => {
                let [part, factor] = [&sides.regular, &sides.root].map(|jets| &jets[place]);
                part.evaluate(&offsets) + depth.sqrt() * factor.evaluate(&offsets)
            }
            false => sides.clear.state[place].evaluate(&offsets),
        };
        let turn = Dd::PI * Dd::from(2.0);
        let errors = simulator.state().iter().enumerate().map(|(place, &truth)| {
            let error = series(place) - truth;
            (error - turn * (error / turn + Dd::from(0.5)).floor()).to_f64().abs()
        });
        (depth > Dd::ZERO, errors.fold(0.0, f64::max))
    };
    let mut sides = BTreeSet::new();
    for way in [1.0, -1.0] {
        let [(contact, far), (_, near)] = [1e-5, 2.5e-6].map(|size| error(way * size));
        let rate = (far / near).log2() / 2.0;
        let least = f64::from(order) + if contact { 0.5 } else { 1.0 };
        assert!(rate > least - 0.05, "{contact} {order}: {far:e} {near:e} {rate} {least}");
        sides.insert(contact);
    }
    assert_eq!(sides.len(), 2);
}

/// Start and parameters of a grazing orbit, half a period before it grazes.
fn half_a_period_before(text: &str) -> (Scene, Vec<Dd>, Dd) {
    let mut scene = parsed(text, "one_stop", &NONE);
    let orbit = orbit(&scene);
    for (parameter, &value) in scene.model.parameters.iter_mut().zip(orbit.parameters()) {
        parameter.value = value;
    }
    let half = orbit.period * Dd::from(0.5);
    let flow = PiecewiseFlow::free(&scene, &[]);
    let graze = &orbit.grazing_point().state;
    // The orbit is periodic: half a period after the graze stands for half a period before it.
    let start = flow.flow(graze, orbit.parameters(), half).expect("free flight");
    (scene, start, half)
}

#[test]
fn a_graze_has_a_series_on_each_side_of_rigid_and_of_soft_stops() {
    let soft = |force: &str, release: &str| {
        let contact = format!("contact = {{ v = \"{force}\" }}\nrelease = \"{release}\"");
        ONE_STOP.replace("impact = { v = \"-r*v\" }", &contact)
    };
    let own = "a*cos(theta) - 2*zeta*v - x";
    let laws = [
        ONE_STOP.to_owned(),
        soft(&format!("{own} - 40*(x + dl) - 2*v"), "x + dl"),
        soft(&format!("{own} - 40*(x + dl) + 1 + r"), "x + dl"),
    ];
    for law in laws {
        let (scene, start, half) = half_a_period_before(&law);
        let free = ["w", "dl", "r"].map(|name| index(&scene, name));
        for order in 1..=3 {
            sides_agree(&scene, &free, &start, half + Dd::from(2.0), order);
        }
    }
}

#[test]
fn a_graze_between_two_hits_has_a_series_on_each_side() {
    let (scene, free) = scene();
    let space = JetSpace::uniform(6, 1).unwrap();
    let mut speed = Dd::from(0.12);
    // Newton's method for the speed at which the motion grazes after its first hit.
    for _ in 0..12 {
        let (form, mut state) = closed(&space, [0.3, 0.0, 1.0]);
        state[1] = Jet::variable(&space, 1, speed);
        let wait = form.hit(&state, 4.0).expect("a hit");
        let mut state = form.fly(&state, &wait);
        state[1] = -&(&form.r * &state[1]);
        let mut rest = form.constant(2.45);
        for _ in 0..8 {
            let [x, v, theta] = form.fly(&state, &rest);
            let (_, cos) = theta.sin_cos();
            let drag = (&form.zeta * &v).scale(Dd::from(2.0));
            rest = &rest - &(&v / &(&(&cos - &drag) - &x));
        }
        let gap = &form.fly(&state, &rest)[0] + &form.dl;
        speed -= gap.head() / gap.coefficient(&[0, 1, 0, 0, 0, 0]);
    }
    let start = [Dd::from(0.3), speed, Dd::ONE];
    for order in 1..=4 {
        sides_agree(&scene, &free, &start, Dd::from(11.0), order);
    }
}

/// Scene of [`ONE_STOP`] with a coefficient of restitution.
fn with_restitution(r: &str) -> (Scene, Vec<usize>) {
    let scene = parsed(&ONE_STOP.replace("r = 0.7", &format!("r = {r}")), "one_stop", &NONE);
    let free = ["w", "dl", "r"].map(|name| index(&scene, name)).to_vec();
    (scene, free)
}

#[test]
fn derivatives_through_a_rest_are_those_of_the_closed_form() {
    let space = JetSpace::uniform(6, 3).unwrap();
    let (start, time) = ([-0.49, -0.02, 2.9], Dd::from(4.0));
    let (form, state) = closed(&space, start);
    // The stop is met while the force presses against it, and left where the force turns.
    let hit = form.hit(&state, 3.0).expect("a hit");
    let met = form.fly(&state, &hit);
    let force = |theta: &Jet<Dd>| {
        let (sin, cos) = theta.sin_cos();
        (&cos + &form.dl, -&sin)
    };
    assert!(force(&met[2]).0.head() < Dd::ZERO);
    let mut theta = form.constant(4.2);
    for _ in 0..10 {
        let (value, slope) = force(&theta);
        theta = &theta - &(&value / &slope);
    }
    let release = &hit + &(&(&theta - &met[2]) / &form.w);
    assert!(hit.head() < release.head() && release.head() < time);
    let at_rest = [-&form.dl, form.constant(0.0), theta];
    let end = form.fly(&at_rest, &(&Jet::constant(&space, time) - &release));
    for r in ["0", "0.3", "0.5"] {
        let (scene, free) = with_restitution(r);
        let found = jets_along(&scene, &start.map(Dd::from), &free, (Some(time), 0), 3);
        let found = found.expect(r);
        let [first, last] = &found.events[..] else { panic!("{}", found.events.len()) };
        assert!(first.meets && first.rests && !last.meets);
        let times = [first.time.clone(), last.time.clone()];
        let expected = [hit.clone(), release.clone()];
        for (found, known) in [(&found.state[..], &end[..]), (&times, &expected)] {
            let differences = differences(found, known);
            assert!(differences.iter().all(|difference| *difference < 1e-28), "{differences:?}");
        }
    }
}

/// A mass that is always pressed on its table stays there, however long: the table's own series
/// tells the steps, for the motion has none.
#[test]
fn a_motion_that_rests_for_ever_has_the_derivatives_of_rest() {
    let table = ONE_STOP
        .replace("a*cos(theta) - 2*zeta*v - x", "a*cos(3*theta)/2 - 1")
        .replace("x + dl", "x")
        .replace("solve_for = \"dl\"", "solve_for = \"a\"");
    let scene = parsed(&table, "table", &NONE);
    let start = [0.8, 0.3, 0.5].map(Dd::from);
    for time in [20.0, 300.0] {
        let found = jets_along(&scene, &start, &[1, 4], (Some(Dd::from(time)), 0), 2);
        let found = found.expect("derivatives");
        assert_eq!(found.events.last().map(|event| event.rests), Some(true));
        let most = found.state[..2].iter().map(Jet::max_abs).fold(0.0, f64::max);
        assert!(most < 1e-25, "{time} {most:e}");
    }
}

#[test]
fn a_chatter_that_the_time_cuts_or_that_forgets_nothing_has_no_derivatives() {
    let start = [-0.49, -0.02, 2.9].map(Dd::from);
    let (scene, free) = with_restitution("0.5");
    let found = jets_along(&scene, &start, &free, (Some(Dd::from(4.0)), 0), 1).expect("rest");
    let first = found.events[0].time.head();
    // Before the last rebound the impacts are counted one by one.
    let soon = first + Dd::from(0.38);
    let found = jets_along(&scene, &start, &free, (Some(soon), 0), 1).expect("rebounds");
    assert!(found.events.len() > 1 && found.events.iter().all(|event| !event.rests));
    let at_rest = [-0.5, 0.0, 2.9].map(Dd::from);
    let refused = jets_along(&scene, &at_rest, &free, (Some(soon), 0), 1).unwrap_err();
    assert!(matches!(refused, DerivativesError::StartsAtRest { .. }), "{refused}");
    // A second motion goes on during the chatter, and the rest remembers how long it took.
    let two = ONE_STOP
        .replace("[\"x\", \"v\"]", "[\"x\", \"v\", \"u\"]")
        .replace("[[model.surface]]", "u = \"x - u\"\n[[model.surface]]");
    let scene = parsed(&two, "two_motions", &NONE);
    let start = [-0.49, -0.02, 0.1, 2.9].map(Dd::from);
    let refused = jets_along(&scene, &start, &free, (Some(Dd::from(4.0)), 0), 1).unwrap_err();
    assert!(matches!(refused, DerivativesError::ComesToRest { .. }), "{refused}");
}

#[test]
fn derivatives_end_at_their_work_limit_and_tell_the_share_that_is_done() {
    // A motion without hits: its number of events bounds nothing.
    let far = ONE_STOP.replace("a*cos(theta)", "1e-3*a*cos(theta)");
    let scene = parsed(&far, "far", &NONE);
    let start = [Dd::ZERO; 3];
    let refused = jets_along(&scene, &start, &[0, 1], (None, 200), 8).unwrap_err();
    let DerivativesError::TooLong { limit, needed, order: 8, variables: 5 } = refused else {
        panic!("{refused}")
    };
    assert!(0 < limit && limit < needed, "{limit} {needed}");
    let shares = RefCell::new(Vec::new());
    let watch = |share: f64| shares.borrow_mut().push(share);
    watched_jets_along(&scene, &start, &[0], (None, 3), 1, &watch).expect("derivatives");
    let shares = shares.into_inner();
    assert!(shares.is_sorted() && shares.len() > 15, "{shares:?}");
    assert!(shares[0] == 0.0 && *shares.last().expect("some") == 1.0, "{shares:?}");
}

#[test]
fn a_stop_that_is_met_during_a_contact_with_another_is_refused() {
    let contact = "contact = { v = \"a*cos(theta) - 2*zeta*v - x - 20*(x + dl)\" }";
    let soft = ONE_STOP.replace("impact = { v = \"-r*v\" }", contact);
    let wall = "[[model.surface]]\nname = \"wall\"\nevent = \"x + dl + 0.01\"\nimpact = { v = \"-r*v\" }\n";
    let text = soft.replace("[grazing]", &format!("{wall}[grazing]\nsurface = \"left\""));
    let scene = parsed(&text, "two_stops", &NONE);
    let start = [Dd::ZERO, Dd::from(-3.0), Dd::ZERO];
    let refused = jets_along(&scene, &start, &[], (Some(Dd::from(2.0)), 0), 1).unwrap_err();
    let DerivativesError::HeldTwice { first, second, .. } = &refused else { panic!("{refused}") };
    assert_eq!((first.as_str(), second.as_str()), ("left", "wall"));
}

/// Switching system of one motion `x' = 1` that stops where a threshold is reached.
fn switching(states: &str, flow: &str, event: &str, contact: &str, name: &str) -> String {
    format!(
        r#"
[model]
states = {states}
parameters = {{ {name} = 0.98 }}
[model.phase]
name = "theta"
rate = "1"
period = "10"
[model.flow]
{flow}
[[model.surface]]
name = "switch"
event = "{event}"
contact = {{ {contact} = "0" }}
[grazing]
solve_for = "{name}"
"#
    )
}

/// Jet of every variable of a switching system: its states, the phase, and the parameter.
fn variables(start: &[Dd], parameter: Dd, order: usize) -> Vec<Jet<Dd>> {
    let space = JetSpace::uniform(start.len() + 1, order).expect("a small space");
    let values = start.iter().copied().chain([parameter]).enumerate();
    values.map(|(number, value)| Jet::variable(&space, number, value)).collect()
}

/// System of OrdinaryDiffEq.jl#4388: `u' = 1` from `u = 0`, with an event at `u = q`. The event
/// takes place at `T = q`, so that `dT/dq = 1` for every `q`; the derivative reported there errs by
/// up to 1e-5 and jumps with `q`.
#[test]
fn the_time_of_an_event_has_the_slope_of_its_threshold() {
    let text = switching("[\"u\"]", "u = \"1\"", "q - u", "u", "q");
    for threshold in ["0.1", "0.37", "0.5", "0.73", "0.98"] {
        let scene = parsed(&text, "threshold", &[("q", threshold)]);
        let q = scene.model.parameters[0].value;
        let start = [Dd::ZERO, Dd::ZERO];
        let found = jets_along(&scene, &start, &[0], (Some(Dd::ONE), 0), 3).expect("derivatives");
        let known = variables(&start, q, 3);
        assert_eq!(found.events.len(), 1);
        let time = &known[2] - &known[0];
        assert!(difference(&found.events[0].time, &time) < 1e-30, "q = {threshold}");
        // The motion has stopped at the threshold.
        assert!(difference(&found.state[0], &known[2]) < 1e-30, "q = {threshold}");
    }
}

/// System of diffrax#729: `y' = 1` until the time `te` and `y' = 0` from there, `y(0) = 0`. After
/// the event `y = te`, so that `dy/dte = 1`; the gradient reported there is wrong.
#[test]
fn a_state_after_an_event_knows_when_the_event_took_place() {
    let text = switching("[\"y\", \"t\"]", "y = \"1\"\nt = \"1\"", "te - t", "y", "te");
    let scene = parsed(&text, "source", &NONE);
    let te = scene.model.parameters[0].value;
    let start = [Dd::ZERO; 3];
    let span = (Some(Dd::from(2.0)), 0);
    let found = jets_along(&scene, &start, &[0], span, 3).expect("derivatives");
    let known = variables(&start, te, 3);
    let wait = &known[3] - &known[1];
    assert_eq!(found.events.len(), 1);
    assert!(difference(&found.events[0].time, &wait) < 1e-30);
    assert!(difference(&found.state[0], &(&known[0] + &wait)) < 1e-30);
    let after = known[1].add_constant(Dd::from(2.0));
    assert!(difference(&found.state[1], &after) < 1e-30);
}

/// A contact that begins with a real power of the penetration has no series there.
#[test]
fn a_contact_with_a_power_law_is_named_where_derivatives_end() {
    let scene = crate::support::scenes::scene("hunt_crossley");
    let start = [0.0, 1.5, 0.0].map(Dd::from);
    let found = jets_along(&scene, &start, &[], (Some(Dd::from(4.0)), 0), 1);
    let Err(DerivativesError::RoughContact { surface, time }) = found else {
        panic!("{:?}", found.err());
    };
    assert_eq!(surface, scene.model.surfaces[0].name);
    assert!((0.1..4.0).contains(&time), "{time}");
    // Before that contact there are derivatives.
    let before = jets_along(&scene, &start, &[], (Some(Dd::from(0.9 * time)), 0), 1);
    assert!(before.is_ok());
}
