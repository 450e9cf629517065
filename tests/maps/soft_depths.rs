//! Soft impacts over a grid of 360 laws and nine depths against exact images at zero net time
//! (tests/data/soft/zdm_images.json; README there): exponents, leading coefficients, error against
//! order.
//!
//! `cargo test --release --test maps -- soft_depths:: --nocapture` prints the table.

use grazemap::expansion::{DepthSeries, Expander};
use grazemap::numeric::{Dd, Scalar};
use serde_json::Value;

use crate::support::reference::{read, text};
use crate::support::scenes::{orbit, scene_with};

/// Highest power of y expanded.
const ORDER: usize = 16;
/// Orders of the table.
const ORDERS: [usize; 7] = [1, 2, 3, 4, 6, 8, 12];
/// Depth variables up to which images are asked for to `EXACT`.
const SHALLOW: f64 = 1e-3;
const EXACT: f64 = 1e-11;

struct Case {
    system: String,
    k2: f64,
    damping: f64,
    prestress: f64,
    /// Normal acceleration of the free orbit.
    acceleration: f64,
    series: DepthSeries,
    /// y, and the jumps of u and v.
    images: Vec<[f64; 3]>,
}

fn number(value: &Value) -> f64 {
    value.as_str().map_or(0.0, |text| text.parse().expect("a number"))
}

fn case(row: &Value) -> Case {
    let omega = format!("2*sqrt(1 - 0.015^2)/{}", text(&row["m"]));
    let mut overrides = vec![
        ("section.kind", "stroboscopic"),
        ("expansion.active", "[]"),
        ("omega", &omega),
        ("A", text(&row["A_g"])),
        ("grazing.guess.theta", text(&row["phase_g"])),
    ];
    let given = ["k2", "R2", "d"].into_iter().filter(|&key| !row[key].is_null());
    overrides.extend(given.map(|key| (key, text(&row[key]))));
    let system = text(&row["system"]).to_owned();
    let name = format!("soft_{}", system.to_lowercase());
    let scene = scene_with(&name, &overrides);
    let orbit = orbit(&scene);
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let images = row["images"].as_array().expect("images").iter();
    Case {
        system,
        k2: number(&row["k2"]),
        damping: number(&row["R2"]),
        prestress: number(&row["d"]),
        acceleration: orbit.grazing_point().normal_acceleration.hi,
        series: expander.depth_series(0, ORDER as u32).expect("a release"),
        images: images.map(|image| [0, 1, 2].map(|column| number(&image[column]))).collect(),
    }
}

/// The cases of one system.
fn cases(system: &str) -> Vec<Case> {
    let file = read("soft/zdm_images.json");
    let rows = file["cases"].as_array().expect("cases").iter();
    rows.filter(|row| row["system"] == system).map(case).collect()
}

impl Case {
    /// Leading power and coefficient of the jump of v at zero net time, in closed form.
    fn velocity_law(&self) -> (u32, f64) {
        let a = self.acceleration;
        match self.system.as_str() {
            "A" => (3, -4.0 / 3.0 * self.k2 * (2.0 / a).sqrt()),
            "B" => (2, -self.damping),
            _ => {
                let pressed = self.k2 * self.prestress;
                (1, -2.0 * (2.0 * a).sqrt() * pressed / (a + pressed))
            }
        }
    }

    /// Leading power of the jump of u.
    fn position_exponent(&self) -> u32 {
        match self.system.as_str() {
            "A" => 5,
            "B" => 3,
            _ => 2,
        }
    }

    /// Error of the series cut at an order, at an image.
    fn error(&self, order: usize, image: &[f64; 3]) -> f64 {
        let y = Dd::from(image[0]);
        let cut = |coordinate: usize| {
            let terms = self.series.coefficients[coordinate][..=order].iter().rev();
            terms.fold(Dd::ZERO, |sum, &coefficient| sum * y + coefficient).hi
        };
        (cut(0) - image[1]).abs().max((cut(1) - image[2]).abs())
    }
}

/// Exponents and leading coefficients in closed form, and the images to `EXACT` at order 12.
fn check(system: &str, cases: &[Case]) {
    for case in cases {
        let law = case.series.leading_law(1).expect("a jump of v");
        let (exponent, coefficient) = case.velocity_law();
        assert_eq!(law.exponent, f64::from(exponent), "system {system}");
        let error = (law.coefficient - Dd::from(coefficient)).magnitude();
        assert!(error < 1e-12 * coefficient.abs(), "{system}: {error:e}");
        let position = case.series.leading_law(0).expect("a jump of u");
        assert_eq!(position.exponent, f64::from(case.position_exponent()), "system {system}");
    }
    println!(
        "\nsystem {system}: largest error of the jump for y ≤ 1e-3, within a quarter of the radius | beyond"
    );
    let errors = ORDERS.map(|order| largest_errors(cases, order));
    for (order, [inside, beyond]) in ORDERS.iter().zip(errors) {
        println!("  order {order:2}: {inside:.1e} | {beyond:.1e}");
    }
    let inside = errors[ORDERS.len() - 1][0];
    assert!(inside < EXACT, "system {system}: {inside:e}");
}

/// Largest error of shallow images within a quarter of the radius of convergence, and beyond.
fn largest_errors(cases: &[Case], order: usize) -> [f64; 2] {
    let mut largest = [0.0_f64; 2];
    for case in cases {
        let limit = 0.25 * case.series.radius().expect("an infinite series");
        for image in case.images.iter().filter(|image| image[0] <= SHALLOW) {
            let class = usize::from(image[0] > limit);
            largest[class] = largest[class].max(case.error(order, image));
        }
    }
    largest
}

#[test]
fn laws_and_images_of_forty_springs_agree_with_the_exact_ones() {
    let cases = cases("A");
    assert_eq!(cases.len(), 40);
    check("A", &cases);
}

#[test]
fn laws_and_images_of_eighty_damped_springs_agree_with_the_exact_ones() {
    let cases = cases("B");
    assert_eq!(cases.len(), 80);
    check("B", &cases);
}

#[test]
fn laws_and_images_of_eighty_prestressed_springs_agree_with_the_exact_ones() {
    let cases = cases("C");
    assert_eq!(cases.len(), 80);
    check("C", &cases);
}

#[test]
fn laws_and_images_of_prestressed_damped_springs_agree_with_the_exact_ones() {
    let cases = cases("D");
    assert_eq!(cases.len(), 160);
    check("D", &cases);
}
