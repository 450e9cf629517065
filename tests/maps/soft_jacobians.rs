//! Jacobians of period-1 orbits of soft impacts with one contact, from the map alone, against exact
//! traces and determinants (tests/data/soft/jacobian_trace_det.json; README there).
//!
//! The trace is singular at grazing (`1/y` for C and D), the determinant is not, and where `xi_1 =
//! 0` (m whole) the singular part is absent.

use grazemap::expansion::{Contact, Expander, Leg, LocalMap, MapOrders, Stage};
use grazemap::jet::Jet;
use serde_json::Value;

use crate::support::reference::{number, read, text};
use crate::support::scenes::{orbit, scene_with};

const ORDERS: MapOrders = MapOrders { smooth_order: 6, contact_weight: 12 };
/// Orbits with y below this are lost in the rounding of offsets in double precision.
const TOO_SHALLOW: f64 = 1e-6;

/// Phase offsets of section points beyond this are too far for legs of degree 6: 0.02^7 = 1e-12.
const FAR: f64 = 0.02;

type Matrix = [[f64; 2]; 2];

struct Case {
    name: String,
    whole_m: bool,
    /// Share of `y` of the singular part of the trace, from the composed form.
    singular: f64,
    radius: f64,
    map: LocalMap,
    /// h'' at the graze, and the phase there.
    acceleration: f64,
    phase: f64,
    omega: f64,
    /// A − A_g, y, phase and speed at the entry, trace, determinant.
    rows: Vec<[f64; 6]>,
}

fn case(row: &Value) -> Case {
    let m = text(&row["m"]);
    let omega = format!("2*sqrt(1 - 0.015^2)/{m}");
    let mut overrides = vec![
        ("omega", &omega[..]),
        ("A", text(&row["A_g"])),
        ("expansion.active", "[\"A\"]"),
        // The shallowest orbit enters next to the graze.
        ("grazing.guess.theta", text(&row["rows"][0][2])),
    ];
    let given = ["k2", "R2", "d"].into_iter().filter(|&key| !row[key].is_null());
    overrides.extend(given.map(|key| (key, text(&row[key]))));
    let name = format!("soft_{}", text(&row["system"]).to_lowercase());
    let scene = scene_with(&name, &overrides);
    let orbit = orbit(&scene);
    let expander = Expander::new(&scene, &orbit).expect("an analytic law");
    let map = expander.expand(ORDERS).expect("an expansion");
    let composed = expander.compose(&map).expect("a small space");
    let slope = |jet: &Jet<f64>, i: usize| {
        jet.coefficients()[jet.space().linear_monomial(i).expect("linear")]
    };
    let depth = &composed.depths[0].terms[0].coefficient;
    let kick = |i: usize| {
        let mut terms = composed.image[i].terms.iter();
        let linear = terms.find(|term| term.powers == [1]);
        linear.map_or(0.0, |term| term.coefficient.head())
    };
    let singular = (0..2).map(|i| kick(i) * slope(depth, i) / 2.0).sum();
    let rows = row["rows"].as_array().expect("rows").iter();
    Case {
        name: format!("{name}, m = {m}, k2 = {}", row["k2"]),
        whole_m: !m.contains('.'),
        singular,
        radius: expander.depth_radius(0).expect("a series").expect("infinite"),
        map,
        acceleration: orbit.grazing_point().normal_acceleration.hi,
        phase: orbit.grazing_point().state[2].hi,
        omega: std::f64::consts::TAU / orbit.period.hi,
        rows: rows.map(|row| [0, 1, 2, 3, 4, 5].map(|column| number(&row[column]))).collect(),
    }
}

fn gradient(jet: &Jet<f64>, point: &[f64]) -> (f64, [f64; 2]) {
    let mut slopes = vec![0.0; point.len()];
    let value = jet.evaluate_with_gradient(point, &mut slopes);
    (value, [slopes[0], slopes[1]])
}

fn fly(leg: &Leg, point: &[f64]) -> ([f64; 2], Matrix) {
    let rows = [0, 1].map(|i| gradient(&leg.image[i], point));
    (rows.map(|row| row.0), rows.map(|row| row.1))
}

fn touch(contact: &Contact, point: &[f64]) -> ([f64; 2], Matrix) {
    let (depth, slope) = gradient(&contact.depth, point);
    let y = depth.max(0.0).sqrt();
    let (mut image, mut matrix) = ([point[0], point[1]], [[1.0, 0.0], [0.0, 1.0]]);
    if y == 0.0 {
        return (image, matrix);
    }
    for i in 0..2 {
        let (linear, linear_slope) = gradient(&contact.linear[i], point);
        let (quadratic, quadratic_slope) = gradient(&contact.quadratic[i], point);
        image[i] += y * (linear + y * quadratic);
        for j in 0..2 {
            let through_depth = (linear / (2.0 * y) + quadratic) * slope[j];
            matrix[i][j] += through_depth + y * (linear_slope[j] + y * quadratic_slope[j]);
        }
    }
    (image, matrix)
}

/// The image of a section point and the Jacobian matrix there.
fn step(map: &LocalMap, start: [f64; 2], amplitude: f64) -> ([f64; 2], Matrix) {
    let (mut state, mut matrix) = (start, [[1.0, 0.0], [0.0, 1.0]]);
    for stage in &map.stages {
        let point = [state[0], state[1], amplitude];
        let (image, factor) = match stage {
            Stage::Leg(leg) => fly(leg, &point),
            Stage::Contact(contact) => touch(contact, &point),
            Stage::Flown(_) => unreachable!("the map of series is asked for"),
        };
        let product =
            |i: usize, j: usize| factor[i][0] * matrix[0][j] + factor[i][1] * matrix[1][j];
        matrix = [0, 1].map(|i: usize| [product(i, 0), product(i, 1)]);
        state = image;
    }
    (state, matrix)
}

/// The fixed point near `start` by Newton's method, and the Jacobian matrix there.
fn fixed_point(map: &LocalMap, start: [f64; 2], amplitude: f64) -> ([f64; 2], Matrix) {
    let mut state = start;
    for _ in 0..30 {
        let (image, m) = step(map, state, amplitude);
        let residual = [image[0] - state[0], image[1] - state[1]];
        let [a, b, c, d] = [m[0][0] - 1.0, m[0][1], m[1][0], m[1][1] - 1.0];
        let determinant = a * d - b * c;
        state[0] -= (d * residual[0] - b * residual[1]) / determinant;
        state[1] -= (a * residual[1] - c * residual[0]) / determinant;
    }
    (state, step(map, state, amplitude).1)
}

/// Largest relative error of y, the trace and the determinant over the orbits well inside the
/// radius.
fn errors(case: &Case) -> ([f64; 3], usize) {
    let (mut largest, mut count) = ([0.0_f64; 3], 0);
    let inside = |y: f64| y > TOO_SHALLOW && y < case.radius / 12.0;
    let rows = case.rows.iter().filter(|row| inside(row[1]));
    for &[amplitude, y, phase, speed, trace, determinant] in rows {
        // From the entry it takes v/h'' to the minimum of the gap, to first order.
        let to_minimum = case.omega * speed / case.acceleration;
        let start = [y * y, phase - case.phase + to_minimum];
        if start[1].abs().max(amplitude.abs()) > FAR {
            continue;
        }
        let (state, m) = fixed_point(&case.map, start, amplitude);
        let found = [
            (state[0].max(0.0).sqrt() - y) / y,
            (m[0][0] + m[1][1] - trace) / trace.abs().max(1.0),
            (m[0][0] * m[1][1] - m[0][1] * m[1][0] - determinant) / determinant,
        ];
        for (largest, error) in largest.iter_mut().zip(found) {
            *largest = largest.max(error.abs());
        }
        count += 1;
    }
    (largest, count)
}

#[test]
fn traces_and_determinants_of_one_contact_orbits_agree_with_the_exact_ones() {
    let file = read("soft/jacobian_trace_det.json");
    let (mut largest, mut count) = ([0.0_f64; 3], 0);
    for case in file["cases"].as_array().expect("cases").iter().map(case) {
        let (errors, orbits) = errors(&case);
        println!(
            "{:32} {orbits} orbits: y {:.1e}, trace {:.1e}, det {:.1e}; singular {:.1e}",
            case.name, errors[0], errors[1], errors[2], case.singular
        );
        // D stretches like y only where the contact accelerates at once, and along xi_1 unless that
        // is 0.
        let square_root = case.name.starts_with("soft_c") || case.name.starts_with("soft_d");
        if square_root && !case.whole_m {
            assert!(case.singular.abs() > 0.1, "{}: {:e}", case.name, case.singular);
        } else {
            assert!(case.singular.abs() < 1e-12, "{}: {:e}", case.name, case.singular);
        }
        count += orbits;
        for (largest, error) in largest.iter_mut().zip(errors) {
            *largest = largest.max(error);
        }
    }
    println!("{count} orbits: {largest:?}");
    assert!(count > 500, "{count}");
    // Truncation at phase offsets of 0.02, magnified by derivatives of the fixed point of up to
    // 1e3.
    assert!(largest.iter().all(|&error| error < 1e-8), "{largest:?}");
}
