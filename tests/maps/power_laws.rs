//! Contact forces that are powers of the penetration: against the analytic path where the exponent
//! is whole, against closed forms, and against direct simulation in double-double.

use grazemap::analysis::{DirectImage, MapEvaluation, NoProgress};
use grazemap::convergence::OrderResult;
use grazemap::expansion::{Contact, Expander, MapOrders};
use grazemap::hybrid::HybridSystem;
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Scalar};
use grazemap::pipeline::{FindGraze as _, Settled, StudyRequest};

use crate::support::scenes::orbit;

/// The oscillator of the scene `soft_a` with a contact law and a release of its own.
fn scene(contact: &str, release: &str, section: &str) -> Scene {
    scene_of_orders(contact, release, section, [5, 8])
}

fn scene_of_orders(contact: &str, release: &str, section: &str, orders: [u32; 2]) -> Scene {
    let [smooth_order, contact_weight] = orders;
    let release = match release {
        "" => String::new(),
        release => format!("release = \"{release}\"\n"),
    };
    let text = format!(
        "[model]\nstates = [\"u\", \"v\"]\n\
         [model.parameters]\nR1 = 0.03\nk1 = 1.0\nk2 = 2.0\nR2 = 0.5\nsigma = 1.0\nA = 0.3067\n\
         omega = \"2*sqrt(1 - 0.015^2)/2.4\"\np = 1.5\nc = 0.5\n\
         [model.phase]\nname = \"theta\"\nrate = \"omega\"\nperiod = \"2*pi\"\n\
         [model.flow]\nu = \"v\"\nv = \"A*cos(theta) - R1*v - k1*u\"\n\
         [[model.surface]]\nname = \"stop\"\nevent = \"sigma - u\"\n\
         contact = {{ v = \"free - {contact}\" }}\n{release}\
         [grazing]\nsurface = \"stop\"\nsolve_for = \"A\"\nperiods = 1\n\
         guess = {{ u = 1.0, v = 0.0, theta = 0.0816 }}\n\
         [section]\n{section}\n\
         [expansion]\nactive = [\"A\", \"omega\"]\nsmooth_order = {smooth_order}\n\
         contact_weight = {contact_weight}\n\
         [window]\ndepth = 1e-4\nstate = {{ u = 1e-4, theta = 0.05 }}\n\
         parameter = {{ A = 1e-4, omega = 1e-4 }}\n"
    );
    Scene::parse(&text, "power").unwrap_or_else(|error| panic!("{contact}: {error}"))
}

const TANGENCY: &str = "kind = \"tangency\"";
const AT_THE_GRAZE: &str = "kind = \"stroboscopic\"\nphase = \"grazing\"";

fn contact(scene: &Scene, weight: u32) -> Contact<Dd> {
    let orbit = orbit(scene);
    let expander = Expander::new(scene, &orbit).expect("a law with an expansion");
    expander.contact_in::<Dd>(0, weight).unwrap_or_else(|error| panic!("{error}"))
}

/// Largest difference of the coefficients of two mappings, relative to the largest of each degree.
fn difference(one: &Contact<Dd>, other: &Contact<Dd>) -> f64 {
    let pairs = one.linear.iter().chain(&one.quadratic);
    let pairs = pairs.zip(other.linear.iter().chain(&other.quadratic));
    let of_pair = |(a, b): (&grazemap::jet::Jet<Dd>, &grazemap::jet::Jet<Dd>)| {
        (0..=a.space().order())
            .map(|degree| {
                let size = b.max_abs_of_degree(degree).max(1e-6);
                let pairs = a.part(degree).iter().zip(b.part(degree));
                let errors = pairs.map(|(&a, &b)| (a - b).magnitude());
                errors.fold(0.0, f64::max) / size
            })
            .fold(0.0, f64::max)
    };
    pairs.map(of_pair).fold(0.0, f64::max)
}

#[test]
fn whole_exponents_give_what_the_analytic_path_gives() {
    // Each law with `d^p` as a power, then as an analytic expression; released at the surface, at
    // zero force, and with a prestress.
    let laws = [
        ("k2*d^p", "", "1", "k2*d", ""),
        ("k2*d^p", "", "2", "k2*d^2", ""),
        ("k2*d^p*(1 + c*v)", "", "2", "k2*d^2*(1 + c*v)", ""),
        ("k2*d^p*(1 + c*v) + R2*v", "", "3", "k2*d^3*(1 + c*v) + R2*v", ""),
        ("k2*d^p*(1 + c*v) - 0.1", "", "1", "k2*d*(1 + c*v) - 0.1", ""),
        ("k2*d + k1*max(d, 0)^p", "", "2", "k2*d + k1*d^2", ""),
        ("k2*d^p + R2*v", "k2*d^p + R2*v", "1", "k2*d + R2*v", "k2*d + R2*v"),
        ("k2*d^p + R2*v", "k2*d^p + R2*v", "2", "k2*d^2 + R2*v", "k2*d^2 + R2*v"),
    ];
    for section in [TANGENCY, AT_THE_GRAZE] {
        for (power, release, p, analytic, analytic_release) in laws {
            let text_of = |law: &str| law.replace("^p", &format!("^(p - 1.5 + {p})"));
            let by_power = contact(&scene(&text_of(power), &text_of(release), section), 8);
            let by_series = contact(&scene(analytic, analytic_release, section), 8);
            let error = difference(&by_power, &by_series);
            println!("{power} p = {p}: {error:.1e}");
            assert!(error < 1e-21, "{power} p = {p}: {error:e}");
        }
    }
}

/// `B(1/2, β + 1)` of an exponent, to 39 digits by another program (`3π/8` for 3/2, `5π/16` for 5/2),
/// and the power of `y` of the first correction.
const BETAS: [(&str, f64, &str); 5] = [
    ("1.1", 3.2, "1.297437049243471780583493692367391594551"),
    ("1.25", 3.5, "1.248598835377199909745161709471961625563"),
    ("1.5", 4.0, "1.178097245096172464423491268729813581574"),
    ("2.5", 6.0, "0.9817477042468103870195760572748446513116"),
    ("3.7", 8.4, "0.8395660959792011574976391937799799124794"),
];

#[test]
fn the_first_coefficient_is_a_beta_function() {
    for (exponent, power, beta) in BETAS {
        let scene = scene(&format!("k2*d^{exponent}*(1 + c*v)"), "", AT_THE_GRAZE);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("a law with an expansion");
        let series = expander.depth_series(0, 10).expect("a series");
        let law = series.leading_law(1).expect("a correction of the velocity");
        let acceleration = orbit.passages[0].normal_acceleration;
        let two = Dd::from(2.0);
        let beta: Dd = beta.parse().expect("a decimal number");
        let expected = -two * (two / acceleration).sqrt() * beta;
        assert!((law.exponent - power).abs() < 1e-12, "{exponent}: y^{}", law.exponent);
        let error = ((law.coefficient - expected) / expected).magnitude();
        assert!(error < 1e-25, "{exponent}: {error:e}");
    }
}

fn settled(scene: Scene) -> Settled {
    scene.graze().expect("an orbit").settle().expect("a section")
}

/// Measured rates of a law at weights up to 6 against those expected; returns how many there are.
fn check_rates([law, release]: [&str; 2], section: &str, orders: [u32; 2]) -> usize {
    let scene = scene_of_orders(law, release, section, orders);
    let request = StudyRequest { fresh: 0, sections: false, chosen: None };
    let study = settled(scene).study(&request, &NoProgress).expect("a study");
    let low = study.orders.iter().filter(|at| at.orders.contact_weight <= 6);
    let rates = low.filter_map(|result| Some((result, result.rate.measured?)));
    let check = |(result, measured): (&OrderResult, f64)| {
        let expected = result.rate.expected - 3.0 * result.rate.uncertainty.unwrap_or(0.0);
        assert!(measured > expected - 0.05, "{law} {:?}: {measured}", result.orders);
    };
    rates.map(check).count()
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn errors_fall_at_the_rate_of_the_orders() {
    let laws =
        [("k2*d^1.5*(1 + c*v)", ""), ("k2*sqrt(d)", ""), ("k2*d^1.5 + R2*v", "k2*d^1.5 + R2*v")];
    for (law, release) in laws {
        let count = check_rates([law, release], TANGENCY, [5, 8]);
        assert!(count >= 10, "{law}: {count} rates were measured");
    }
}

/// Laws with exponents that are not half whole, and their releases.
const ANY_EXPONENT: [[&str; 2]; 4] = [
    ["k2*d^1.1", ""],
    ["k2*d^1.25*(1 + c*v)", ""],
    ["k2*d^3.7 + k1*d^1.5", ""],
    ["k2*d^1.25 + R2*v", "k2*d^1.25 + R2*v"],
];

/// Errors of the map of a scene at depths 4e-6 and 1e-6, in double-double, with the composed form's
/// distance to the map at the smaller.
fn errors(scene: &Scene, weight: u32) -> ([Dd; 2], f64, f64) {
    let orbit = orbit(scene);
    let expander = Expander::new(scene, &orbit).expect("a law with an expansion");
    let legs = expander.legs_by_taylor::<Dd>(weight).expect("legs");
    let contact = expander.contact_in::<Dd>(0, weight).expect("a contact");
    let map = MapEvaluation::of_parts(legs, vec![contact]);
    let system = HybridSystem::new(&scene.model);
    let mut direct = DirectImage::<Dd>::new(&system, scene, &orbit).expect("a map");
    let point = |y: f64| {
        let size = y * y;
        [[2.0 * size, 0.3 * size].map(Dd::from), [0.2 * size, -0.1 * size].map(Dd::from)]
    };
    let errors = [2e-3, 1e-3].map(|y| {
        let [state, parameters] = point(y);
        let image = map.image(&state, &parameters);
        assert!(image.depths[0] > Dd::from(0.5 * y * y), "in contact");
        let exact = direct.lifted_image(&state, &parameters).expect("an image").offsets;
        let pairs = image.offsets.iter().zip(&exact);
        pairs.map(|(&found, &exact)| (found - exact).abs()).fold(Dd::ZERO, Dd::max)
    });
    let factored = expander.expand(MapOrders::new(weight, weight)).expect("a map");
    let composed = expander.compose(&factored).expect("a composed form");
    let [state, parameters] = point(1e-3).map(|values| values.map(|value| value.to_f64()));
    let [one, other] = [MapEvaluation::<f64>::new(&factored), MapEvaluation::composed(&composed)]
        .map(|map| map.image(&state, &parameters).offsets);
    let pairs = one.iter().zip(&other);
    let apart = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    (errors, map.omitted_exponent(weight), apart)
}

#[test]
fn errors_fall_by_the_first_power_left_out_for_any_exponent() {
    for section in [TANGENCY, AT_THE_GRAZE] {
        for [law, release] in ANY_EXPONENT {
            let scene = scene_of_orders(law, release, section, [4, 4]);
            let ([far, near], expected, apart) = errors(&scene, 4);
            let rate = (far / near).to_f64().log2();
            println!("{law}: error {:.1e} y^{rate:.3} (y^{expected:.1})", near.to_f64());
            assert!(rate > expected - 0.05, "{law}: y^{rate}, expected y^{expected}");
            assert!(near.to_f64() < 1e-10 && apart < 1e-11, "{law}: {near}, {apart:e}");
        }
    }
}

#[test]
#[ignore = "long: .ci/full runs it"]
fn errors_fall_at_the_rate_of_the_orders_for_any_exponent_to_weight_6() {
    for law in ANY_EXPONENT {
        let count = check_rates(law, TANGENCY, [5, 6]);
        assert!(count >= 10, "{law:?}: {count} rates were measured");
    }
}
