//! Direct simulation against reference numbers of the literature's rigid-stop oscillators: images
//! of the tangency section's return map, computed elsewhere to at least 30 digits
//! (tests/data/rigid/README.md).

use grazemap::flow::{Field, Integrator};
use grazemap::hybrid::{DirectReturn, HybridSystem, NominalPassage, ReturnOutcome, ReturnSection};
use grazemap::model::Model;
use grazemap::numeric::{Dd, Real};
use serde_json::Value;

use crate::support::reference::{exact, read};
use crate::support::scenes::{self, index};

/// File of reference images, with the relation of its conventions to a scene's.
struct Case {
    model: Model,
    /// Whether the scene's states are minus those of the file (a stop below instead of above).
    mirrored: bool,
    /// Parameters by index, with the name of the value in the file, and the column and sign of its
    /// offset.
    parameters: Vec<(usize, &'static str, Option<usize>)>,
    /// The parameter that is the wall's position.
    wall: usize,
    file: Value,
}

fn case(
    name: &str,
    scene: &str,
    names: &[(&str, &'static str, Option<usize>)],
    wall: &str,
) -> Case {
    let scene = scenes::scene(scene);
    let index = |name: &str| index(&scene, name);
    let parameters =
        names.iter().map(|&(scene, file, offset)| (index(scene), file, offset)).collect();
    let mirrored = wall == "Q_star";
    let wall = index(if wall == "Q_star" { "Q" } else { "delta" });
    Case {
        mirrored,
        parameters,
        wall,
        file: read(&format!("rigid/public_{name}.json")),
        model: scene.model,
    }
}

fn cases() -> Vec<Case> {
    let linear = [
        ("zeta", "zeta", None),
        ("r", "r", None),
        ("delta", "delta", None),
        ("alpha", "alpha_star", Some(0)),
        ("omega", "omega_star", Some(1)),
    ];
    let mems = [
        ("zeta", "zeta", None),
        ("r", "r", None),
        ("delta", "delta", None),
        ("V", "V_star", Some(0)),
        ("omega", "omega_star", Some(1)),
    ];
    let beam = [
        ("zeta", "zeta", None),
        ("alpha", "alpha", None),
        ("r", "r", None),
        ("Q", "Q_star", Some(0)),
        ("beta", "beta_star", Some(1)),
    ];
    vec![
        case("linear_w1.8", "linear", &linear, "delta"),
        case("linear_codim2", "linear_codim2", &linear, "delta"),
        case("mems_w0.46", "mems", &mems, "delta"),
        case("mems_w0.4878_codim2", "mems_codim2", &mems, "delta"),
        case("mems_scenario3_codim2", "mems_scenario3", &mems, "delta"),
        case("cantilever_zeta1.7", "cantilever_1_7", &beam, "Q_star"),
        case("cantilever_zeta0.107", "cantilever_0_107", &beam, "Q_star"),
    ]
}

impl Case {
    fn name(&self) -> &str {
        self.file["case"].as_str().expect("a name")
    }

    fn rows(&self) -> &[Value] {
        self.file["rows"].as_array().expect("rows")
    }

    fn parameters<S: Real>(&self, row: &Value) -> Vec<S> {
        let mut values = self.model.parameter_values();
        for &(index, key, offset) in &self.parameters {
            let offset = offset.map_or(Dd::ZERO, |column| exact(&row["param_offsets"][column]));
            values[index] = exact(&self.file["base"][key]) + offset;
        }
        values.into_iter().map(S::from_dd).collect()
    }

    /// The full state of a section point: `x = delta + offset` in the file's convention.
    fn state<S: Real>(&self, point: &Value, parameters: &[S]) -> Vec<S> {
        let offset = S::from_dd(exact(&point["x_minus_delta"]));
        let wall = parameters[self.wall];
        let phase = exact(&self.file["base"]["theta_star"]) + exact(&point["dtheta"]);
        vec![
            if self.mirrored { wall - offset } else { wall + offset },
            S::zero(),
            S::from_dd(phase),
        ]
    }

    /// `(x − delta, theta − theta*)` of a full state, in double-double.
    fn offsets<S: Real>(&self, state: &[S], parameters: &[S]) -> [Dd; 2] {
        let gap = state[0].to_dd() - parameters[self.wall].to_dd();
        let phase = state[2].to_dd() - exact(&self.file["base"]["theta_star"]);
        [if self.mirrored { -gap } else { gap }, phase]
    }
}

/// Largest error of the offsets, of the impact speed, over rows and iterations whose images stay
/// small.
struct Errors {
    offset: f64,
    speed: f64,
    images: usize,
}

fn errors_in_double_double(case: &Case) -> Errors {
    let system = HybridSystem::new(&case.model);
    let mut errors = Errors { offset: 0.0, speed: 0.0, images: 0 };
    for row in case.rows() {
        let parameters = case.parameters::<Dd>(row);
        let section = ReturnSection::Tangency { surface: 0 };
        let mut map =
            DirectReturn::over_periods(&system, &parameters, section, 1).expect("a phase");
        let mut state = case.state(row, &parameters);
        for image in row["images"].as_array().expect("images") {
            if exact(&image["x_minus_delta"]).abs().to_f64() > 0.05 {
                break;
            }
            let found = map.image(&state).expect("a finite state");
            let place = format!("{} row {} iteration {}", case.name(), row["id"], image["n"]);
            assert_eq!(found.outcome, ReturnOutcome::Returned, "{place}");
            assert_eq!(found.contacts > 0, image["impact"].as_bool().expect("a flag"), "{place}");
            assert_eq!(found.extra_contacts, 0, "{place}");
            let [x, theta] = case.offsets(&found.state, &parameters);
            let expected = [exact(&image["x_minus_delta"]), exact(&image["dtheta"])];
            errors.offset = errors.offset.max((x - expected[0]).abs().to_f64());
            errors.offset = errors.offset.max((theta - expected[1]).abs().to_f64());
            let speed = found.impact_speeds.first().copied().unwrap_or(Dd::ZERO);
            errors.speed = errors.speed.max((speed - exact(&image["v_impact"])).abs().to_f64());
            errors.images += 1;
            state = found.state;
        }
    }
    errors
}

#[test]
fn images_in_double_double_agree_with_the_reference_to_1e_minus_27() {
    for case in cases() {
        let start = std::time::Instant::now();
        let errors = errors_in_double_double(&case);
        println!(
            "{:24} {:3} images: offsets {:.1e}, impact speeds {:.1e}, {:.0} us an image",
            case.name(),
            errors.images,
            errors.offset,
            errors.speed,
            start.elapsed().as_secs_f64() * 1e6 / errors.images as f64
        );
        // The roundoff of double-double, 1e-32, times the expansion of up to three images (up to
        // 2e3).
        assert!(errors.offset < 1e-27, "{}: {:e}", case.name(), errors.offset);
        // The reference gives speeds to 25 significant digits.
        assert!(errors.speed < 1e-24, "{}: {:e}", case.name(), errors.speed);
    }
}

/// Largest error of one image in `f64`, in units of `ε (1 + 1/y)` with `y² = x − delta`.
fn worst_error_in_double(case: &Case) -> (f64, f64) {
    let system = HybridSystem::new(&case.model);
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for row in case.rows() {
        let parameters = case.parameters::<f64>(row);
        let section = ReturnSection::Tangency { surface: 0 };
        let mut map =
            DirectReturn::over_periods(&system, &parameters, section, 1).expect("a phase");
        let found = map.image(&case.state(row, &parameters)).expect("a finite state");
        let image = &row["images"][0];
        assert_eq!(
            found.contacts > 0,
            image["impact"].as_bool().expect("a flag"),
            "{} {}",
            case.name(),
            row["id"]
        );
        let [x, theta] = case.offsets(&found.state, &parameters);
        let error = (x - exact(&image["x_minus_delta"])).abs().to_f64();
        let error = error.max((theta - exact(&image["dtheta"])).abs().to_f64());
        let depth = exact(&row["x_minus_delta"]).to_f64();
        let unit = f64::EPSILON * if depth > 0.0 { 1.0 + 1.0 / depth.sqrt() } else { 1.0 };
        (worst, largest) = (worst.max(error / unit), largest.max(error));
    }
    (worst, largest)
}

#[test]
fn images_in_double_obey_the_rounding_law_of_the_square_root() {
    for case in cases() {
        let (worst, largest) = worst_error_in_double(&case);
        println!("{:24} f64: at most {worst:.1} eps (1 + 1/y), {largest:.1e}", case.name());
        // Rounding of x − delta by eps moves y by eps/(2 y); the leg then expands by at most about
        // 30.
        assert!(worst < 100.0, "{}: {worst}", case.name());
    }
}

/// The state a tangency point `(x − delta, theta − theta*)` flows freely to at a phase offset from
/// `theta*`.
fn at_phase(case: &Case, free: &Field, point: &[Dd; 2], phase: Dd, parameters: &[Dd]) -> Vec<Dd> {
    let wall = parameters[case.wall];
    let start = exact(&case.file["base"]["theta_star"]) + point[1];
    let state = [if case.mirrored { wall - point[0] } else { wall + point[0] }, Dd::ZERO, start];
    let duration = graze_time(free, phase - point[1], parameters);
    let mut end = Integrator::new(free).flow(&state, parameters, duration).expect("smooth");
    end[2] = exact(&case.file["base"]["theta_star"]) + phase;
    end
}

/// Time in which the phase advances by an amount.
fn graze_time(free: &Field, advance: Dd, parameters: &[Dd]) -> Dd {
    let rest = [Dd::ZERO; 3];
    advance / Integrator::new(free).flow(&rest, parameters, Dd::ONE).expect("smooth")[2]
}

fn pair(image: &Value, keys: [&str; 2]) -> [Dd; 2] {
    keys.map(|key| exact(&image[key]))
}

fn distance(a: &[Dd], b: &[Dd]) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| (a - b).abs().to_f64()).fold(0.0, f64::max)
}

#[test]
fn stroboscopic_images_agree_with_the_reference_carried_along_the_free_flow() {
    const POINT: [&str; 2] = ["x_minus_delta", "dtheta"];
    for case in cases() {
        let (system, free) = (HybridSystem::new(&case.model), Field::free(&case.model, &[]));
        let mut worst = 0.0f64;
        for row in case.rows().iter().step_by(3) {
            let parameters = case.parameters::<Dd>(row);
            let image = &row["images"][0];
            let carry = |point: [Dd; 2]| at_phase(&case, &free, &point, Dd::ZERO, &parameters);
            let section = ReturnSection::GrazingPhase { surface: 0 };
            let mut map =
                DirectReturn::over_periods(&system, &parameters, section, 1).expect("a phase");
            let found = map.image(&carry(pair(row, POINT))).expect("finite");
            assert_eq!(
                found.contacts > 0,
                image["impact"] == true,
                "{} {}",
                case.name(),
                row["id"]
            );
            worst = worst.max(distance(&found.state, &carry(pair(image, POINT))));
        }
        println!("{:24} at the grazing phase {worst:.1e}", case.name());
        assert!(worst < 1e-27, "{}: {worst:e}", case.name());
    }
}

#[test]
fn images_at_another_phase_agree_with_the_reference_carried_along_the_free_flow() {
    const AFTER: [&str; 2] = ["D_x_minus_delta", "D_dtheta"];
    let ahead = Dd::from(0.4);
    for case in cases() {
        let (system, free) = (HybridSystem::new(&case.model), Field::free(&case.model, &[]));
        let mut worst = 0.0f64;
        for row in case.rows().iter().step_by(3) {
            let parameters = case.parameters::<Dd>(row);
            let images = &row["images"];
            let [before, after] = [pair(&images[0], AFTER), pair(&images[1], AFTER)];
            if images[1]["s_back"].as_str().expect("digits").parse::<f64>().expect("digits") > 0.1 {
                continue;
            }
            let carry = |point: [Dd; 2]| at_phase(&case, &free, &point, ahead, &parameters);
            let start = carry(before);
            let graze_time = graze_time(
                &free,
                case.model.phase.as_ref().expect("a phase").period - ahead,
                &parameters,
            );
            let graze =
                NominalPassage { surface: 0, time: graze_time.to_f64(), hit: false, rests: false };
            let mut map =
                DirectReturn::over_periods(&system, &parameters, ReturnSection::OtherPhase, 1)
                    .expect("a phase")
                    .with_passages(&[graze])
                    .expect("within the period");
            let found = map.image(&start).expect("finite");
            assert_eq!(
                found.contacts > 0,
                images[1]["impact"] == true,
                "{} {}",
                case.name(),
                row["id"]
            );
            assert_eq!(found.extra_contacts, 0, "{} {}", case.name(), row["id"]);
            worst = worst.max(distance(&found.state, &carry(after)));
        }
        println!("{:24} at another phase {worst:.1e}", case.name());
        assert!(worst < 1e-27, "{}: {worst:e}", case.name());
    }
}
