//! The independent simulator of `xtask` itself, compared with closed forms and published numbers.

use grazemap::numeric::Dd;
use xtask::independent::{Mode, Number, Oscillator, Simulator, tangency_return};

use crate::support::reference::{exact, read};
use crate::support::scenes;

/// A ball on a table, by the speeds and times of its impacts.
#[test]
fn a_ball_bounces_as_the_geometric_series_says_and_rests() {
    let scene = r#"
[model]
states = ["x", "v"]
parameters = { g = 2.0, r = 0.5 }
[model.flow]
x = "v"
v = "-g"
[[model.surface]]
name = "table"
event = "x"
impact = { v = "-r*v" }
"#;
    let ball = Oscillator::read(scene, &[]).expect("a scene");
    let mut simulator = Simulator::<f64>::new(&ball, &ball.values(), 0.1);
    simulator.place(&[1.0, 0.0]);
    let happened = simulator.advance(4.0).expect("it ends");
    let speeds: Vec<f64> = happened.iter().filter_map(|event| event.kind.speed()).collect();
    for (number, speed) in speeds.iter().enumerate().take(12) {
        // Rounding of the height, over the speed.
        assert!((speed - 2.0 * 0.5f64.powi(number as i32)).abs() < 1e-11, "{number}: {speed}");
    }
    // It falls for 1, then hops for 1, 1/2, 1/4 ...: at rest at 3.
    let time = happened.last().expect("impacts").time;
    assert!((time - 3.0).abs() < 2e-5, "{time}");
    assert!(matches!(simulator.mode, Mode::Resting { .. }));
    assert!(simulator.state.iter().all(|value| value.abs() < 1e-12), "{:?}", simulator.state);
}

/// A spring at the stop alone: half a period of its own in contact.
#[test]
fn a_contact_lasts_half_a_period_of_its_spring() {
    let scene = r#"
[model]
states = ["x", "v"]
parameters = { k = 400.0 }
[model.flow]
x = "v"
v = "0"
[[model.surface]]
name = "buffer"
event = "1 - x"
contact = { v = "free - k*(x - 1)" }
"#;
    let mass = Oscillator::read(scene, &[]).expect("a scene");
    let mut simulator = Simulator::<Dd>::new(&mass, &mass.values(), 0.1);
    simulator.place(&[Dd::ZERO, Dd::from(2.0)]);
    let happened = simulator.advance(Dd::ONE).expect("it ends");
    let times: Vec<Dd> = happened.iter().map(|event| event.time).collect();
    let lasts = times[1] - times[0];
    // The method's order in double-double.
    assert!((lasts - Dd::PI / Dd::from(20.0)).size() < 1e-28, "{times:?}");
    assert!((simulator.state[1] + Dd::from(2.0)).size() < 1e-27, "{:?}", simulator.state);
}

/// Images of the tangency section, computed elsewhere with 30 digits and more.
fn largest_error<N: Number + PartialOrd>() -> f64 {
    let file = read("rigid/public_linear_w1.8.json");
    let base = |key: &str| N::exact(exact(&file["base"][key]));
    let linear = Oscillator::read(scenes::text("linear"), &[]).expect("a scene");
    let mut worst = 0.0f64;
    for row in file["rows"].as_array().expect("rows").iter().step_by(4) {
        let parameters: Vec<N> = linear
            .parameters
            .iter()
            .map(|(name, value)| {
                let offset = |column: usize| N::exact(exact(&row["param_offsets"][column]));
                match &name[..] {
                    "alpha" => base("alpha_star") + offset(0),
                    "omega" => base("omega_star") + offset(1),
                    "zeta" | "r" | "delta" => base(name),
                    _ => N::exact(*value),
                }
            })
            .collect();
        let wall = base("delta");
        let simulator = Simulator::new(&linear, &parameters, 0.02);
        let point = |value: &serde_json::Value| N::exact(exact(value));
        let x = wall + point(&row["x_minus_delta"]);
        let theta = base("theta_star") + point(&row["dtheta"]);
        let period = simulator.forcing_period().expect("a phase");
        let image = tangency_return(&simulator, 0, &[x, N::zero(), theta], period);
        let state = image.expect("an orbit").expect("a section point").state;
        let image = &row["images"][0];
        let found = [state[0] - wall, state[2] - base("theta_star") - N::exact(Dd::TWO_PI)];
        let expected = [point(&image["x_minus_delta"]), point(&image["dtheta"])];
        let errors = found.iter().zip(expected).map(|(&found, expected)| (found - expected).size());
        worst = errors.fold(worst, f64::max);
    }
    worst
}

#[test]
fn images_agree_with_numbers_computed_elsewhere() {
    // Rounding `eps` of a depth `y²` moves `y` by `eps/2y`, and the leg expands by up to 30.
    let worst = largest_error::<f64>();
    assert!(worst < 1e-11, "{worst:e}");
    let worst = largest_error::<Dd>();
    assert!(worst < 1e-27, "{worst:e}");
}
