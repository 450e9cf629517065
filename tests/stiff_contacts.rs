//! One grazing passage is one contact, however stiff the stop: its events and its duration against closed forms
//! (tests/data/soft/soft_to_rigid.json; README there).

#[path = "../examples/soft_to_rigid/direct.rs"]
#[allow(dead_code, reason = "this test runs the simulator itself")]
mod direct;
#[path = "../examples/soft_to_rigid/family.rs"]
#[allow(dead_code, reason = "of the families only the spring is needed")]
mod family;

use family::Family;
use grazemap::flow::{Field, Integrator};
use grazemap::hybrid::{Event, EventKind, HybridSystem, Outcome, Simulator};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Real};
use serde_json::Value;

fn text(value: &Value) -> &str {
    value.as_str().expect("a decimal string")
}

fn number(value: &Value) -> Dd {
    Dd::from_decimal(text(value)).expect("a number")
}

fn cases() -> Vec<Value> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/soft/soft_to_rigid.json"
    );
    let file = std::fs::read_to_string(path).expect("the reference file");
    let file: Value = serde_json::from_str(&file).expect("JSON");
    file["system_A"].as_array().expect("cases").clone()
}

/// A free motion that would turn back at a depth `y²`, from three times as long before that as it takes from the stop.
struct Passage {
    system: HybridSystem,
    parameters: Vec<Dd>,
    start: Vec<Dd>,
    head_start: Dd,
    stiffness: f64,
}

impl Passage {
    fn new(k2: &str, m: &str, y: Dd) -> Self {
        let stop = Family::A.stop(k2, m);
        let graze = stop.orbit.grazing_point();
        let parameters = stop.orbit.parameters().to_vec();
        let mut state = graze.state.clone();
        (state[0], state[1]) = (y * y, Dd::ZERO);
        let fall = (Dd::from(2.0) / graze.normal_acceleration).sqrt() * y;
        let head_start = fall * Dd::from(3.0);
        let free = Field::free(&stop.scene.model, &[]);
        let start = Integrator::new(&free)
            .flow(&state, &parameters, -head_start)
            .expect("a linear field");
        Self {
            system: HybridSystem::new(&stop.scene.model),
            parameters,
            start,
            head_start,
            stiffness: k2.parse().expect("a number"),
        }
    }

    fn events<S: Real>(&self) -> Vec<Event<S>> {
        let [parameters, start] = [&self.parameters, &self.start]
            .map(|x| x.iter().map(|&x| S::from_dd(x)).collect::<Vec<S>>());
        let mut simulator = Simulator::new(&self.system, &parameters).expect("parameters");
        simulator.set_near_miss_limit(S::zero());
        simulator.set_state(&start).expect("a finite state");
        let duration = S::from_dd(self.head_start) * S::from_f64(2.0);
        let flown = simulator.run(duration).expect("a finite duration");
        assert_eq!(flown.outcome, Outcome::Completed);
        flown.events
    }

    /// One contact that lasts as long as the closed form says.
    ///
    /// Each end has the rounding of the time since the start, and that of the gap there over the speed: together some
    /// units in the last place of the head start; the closed form has 30 digits.
    fn is_one_contact<S: Real>(&self, expected: Dd) {
        let events = self.events::<S>();
        let [begin, end] = &events[..] else {
            panic!("k2 {:e}: {events:?}", self.stiffness)
        };
        assert!(matches!(begin.kind, EventKind::ContactBegin { speed } if speed > S::zero()));
        assert!(matches!(end.kind, EventKind::ContactEnd { speed } if speed > S::zero()));
        let time = end.time - begin.time;
        let error = (time - S::from_dd(expected)).magnitude();
        let rounding = S::ROUNDOFF * self.head_start.hi;
        assert!(
            error < 100.0 * rounding,
            "k2 {:e}: {error:e}",
            self.stiffness
        );
    }
}

#[test]
fn a_grazing_passage_is_one_contact_of_the_closed_forms_duration_at_every_stiffness() {
    for case in cases() {
        for row in case["rows"].as_array().expect("rows") {
            let passage = Passage::new(text(&row["k2"]), text(&case["m"]), number(&case["y"]));
            let expected = number(&row["contact_time"]);
            passage.is_one_contact::<f64>(expected);
            passage.is_one_contact::<Dd>(expected);
        }
    }
}

/// A mass under a constant force 1 that turns back at a depth `y²` behind a spring `k` at `u = 1`, or does not.
///
/// In contact `u − 1 = (v/ω) sin ωt − (1 − cos ωt)/k`, `ω² = k`, `v = √2 y`: it lasts `(2/ω) arctan(v ω)`.
fn spring_contact<S: Real>(k: f64, y: f64, law: &str) {
    let text = format!(
        "[model]\nname = \"spring\"\nstates = [\"u\", \"v\"]\nparameters = {{ p = 1.0, k = {k:e} }}\n[model.flow]\nu = \"v\"\nv = \"-1\"\n\
         [[model.surface]]\nname = \"stop\"\nevent = \"p - u\"\ncontact = {{ v = \"free - k*(u - p)\" }}\n{law}\n\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
    );
    let scene = Scene::parse(&text, "spring").unwrap_or_else(|error| panic!("{error}"));
    let system = HybridSystem::new(&scene.model);
    let (y, k) = (S::from_f64(y), S::from_f64(k));
    let speed = (y * y + y * y).sqrt();
    let before = speed * S::from_f64(3.0);
    let start = [
        S::one() + y * y - before * before * S::from_f64(0.5),
        before,
    ];
    let mut simulator = Simulator::new(&system, &[S::one(), k]).expect("parameters");
    simulator.set_near_miss_limit(S::zero());
    simulator.set_state(&start).expect("a finite state");
    let flown = simulator.run(before + before).expect("a finite duration");
    let named = format!("k {k:?} y {y:?} {law}: {flown:?}");
    assert_eq!(flown.outcome, Outcome::Completed, "{named}");
    let [begin, end] = &flown.events[..] else {
        panic!("{named}")
    };
    assert!(matches!(end.kind, EventKind::ContactEnd { speed } if speed > S::zero()));
    let rate = k.sqrt();
    let lasts = (speed * rate).to_f64().atan() * 2.0 / rate.to_f64();
    // The surface is met to the rounding of u = 1, over the speed; the closed form is evaluated in f64.
    let rounding = 16.0 * (S::ROUNDOFF / speed.to_f64() + f64::EPSILON * lasts);
    let error = ((end.time - begin.time).to_f64() - lasts).abs();
    assert!(error < rounding, "{error:e} {named}");
}

#[test]
fn a_release_at_the_surface_may_be_written_with_any_factor_at_every_stiffness() {
    for decade in 2..=20 {
        let k = 10f64.powi(decade);
        for y in [1e-1, 1e-2, 1e-3] {
            for law in ["", "release = \"u - p\"", "release = \"-7*k*(u - p)\""] {
                spring_contact::<f64>(k, y, law);
                spring_contact::<Dd>(k, y, law);
            }
        }
    }
}

/// `∫ dx / √(1 − x^{5/2})` over `[0, 1]`, twice: the beta function `4/5 B(2/5, 1/2)`.
const HERTZ: f64 = 2.943_275_184_324_704_7;

/// `x'' = −k x^{3/2}` behind `x = 0`: the force has no Taylor series where it begins.
///
/// The contact of speed `v` is `(5 v²/(4 k))^{2/5}` deep and lasts `HERTZ` times that over `v`.
#[test]
fn a_contact_without_a_series_at_the_surface_is_named_or_right() {
    let mut named = 0;
    for force in ["x^1.5", "abs(x)^1.5", "sqrt(max(x, 0))^3"] {
        let scene = format!(
            "[model]\nname = \"Hertz\"\nstates = [\"x\", \"v\"]\nparameters = {{ p = 33.0 }}\n[model.flow]\nx = \"v\"\nv = \"0\"\n\
             [[model.surface]]\nname = \"stop\"\nevent = \"-x\"\ncontact = {{ v = \"free - p*{force}\" }}\n\
             [grazing]\nsurface = \"stop\"\nsolve_for = \"p\"\n"
        );
        let scene = Scene::parse(&scene, "hertz").unwrap_or_else(|error| panic!("{error}"));
        let system = HybridSystem::new(&scene.model);
        for start in [[-1.0, 1.0], [-0.3, 0.7], [0.0, 1.0], [-0.1, 0.3]] {
            let mut simulator = Simulator::<f64>::new(&system, &[33.0]).expect("a parameter");
            simulator.set_state(&start).expect("a finite state");
            let flown = simulator.run(3.0).expect("a finite duration");
            let met: f64 = -start[0] / start[1];
            if let Outcome::ContactNotAnalytic { surface: 0, time } = flown.outcome {
                assert!((time - met).abs() < 1e-15, "{force}: {time}");
                named += 1;
                continue;
            }
            let [begin, end] = &flown.events[..] else {
                panic!("{force} {start:?}: {flown:?}")
            };
            let lasts = HERTZ * (1.25 * start[1] * start[1] / 33.0_f64).powf(0.4) / start[1];
            // Some hundred steps, each a seventh of the distance from the surface, of a unit of rounding in the time.
            assert!((end.time - begin.time - lasts).abs() < 1e-13, "{force}");
        }
    }
    assert!(named > 0);
}
