//! Random parameters at every return: densities compared with closed forms.

use grazemap::analysis::noise::{NoiseLaw, NoiseRequest, NoisyOrbits, noise};
use grazemap::analysis::{DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DifferentiableMap, DiscreteMap};
use grazemap::model::Method;
use nalgebra::{DMatrix, DVector};

use crate::Case;

fn request(deviation: f64) -> NoiseRequest {
    NoiseRequest {
        at: vec![0.0; 2],
        deviations: vec![deviation, 0.0],
        law: NoiseLaw::Normal,
        start: vec![0.0; 2],
        orbits: 600,
        transient: 60,
        keep: 100,
        ranges: vec![[-1e-3, 1e-3]; 2],
        cells: 50,
        seed: 1,
        method: Method::Map,
    }
}

impl Case {
    fn noise(&self, request: &NoiseRequest) -> NoisyOrbits {
        noise(&self.scene, &self.orbit, &self.map, request, &NoProgress).expect("a good request")
    }
}

#[test]
fn without_contact_the_covariance_is_that_of_the_linear_recursion() {
    let case = Case::new("linear");
    let (mean, deviation) = (-1e-4, 1e-6);
    let found = case.noise(&NoiseRequest { at: vec![mean, 0.0], ..request(deviation) });
    assert_eq!(found.contacts, 0.0);
    // The fixed point and the derivatives there by direct simulation.
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let (mut state, mut image, mut rows) = ([0.0; 2], [0.0; 2], [0.0; 8]);
    for _ in 0..400 {
        direct.step(&state, &[mean, 0.0], &mut image);
        state = image;
    }
    direct.step_derivatives(&state, &[mean, 0.0], &mut image, &mut rows);
    let rows = DMatrix::from_row_slice(2, 4, &rows);
    let (a, b): (DMatrix<f64>, DVector<f64>) = (rows.columns(0, 2).into(), rows.column(2).into());
    let drive = &b * b.transpose() * deviation * deviation;
    let mut covariance = drive.clone();
    for _ in 0..2000 {
        covariance = &a * covariance * a.transpose() + &drive;
    }
    for row in 0..2 {
        let size = covariance[(row, row)].sqrt();
        // Points of one orbit go together over some returns: 600 orbits count for sure.
        assert!((found.mean[row] - state[row]).abs() < 5.0 * size / 600f64.sqrt());
        for column in 0..2 {
            let expected = covariance[(row, column)];
            let scale = (covariance[(row, row)] * covariance[(column, column)]).sqrt();
            let error = (found.covariance[row][column] - expected).abs() / scale;
            assert!(error < 5.0 * (2.0 / 600f64).sqrt(), "{row} {column}: {error}");
        }
    }
}

/// A return from the graze moves the point away from it by a multiple of the random number, and the
/// next return makes contact if that is outward. The square root of a normal number's positive part
/// has the mean `2^(1/4) Γ(3/4) / (2 √π)`.
#[test]
fn off_the_graze_half_of_the_returns_make_contact_and_the_mean_is_that_of_a_root() {
    let case = Case::new("linear");
    let deviation = 1e-9;
    let asked = NoiseRequest { orbits: 40_000, transient: 1, keep: 1, ..request(deviation) };
    let found = case.noise(&asked);
    assert!((found.contacts - 0.5).abs() < 5.0 * 0.5 / 200.0, "{}", found.contacts);
    // The kick of one standard deviation outwards, by direct simulation.
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let kick = |sign: f64| {
        let (mut off, mut image) = ([0.0; 2], [0.0; 2]);
        direct.step(&[0.0; 2], &[sign * deviation, 0.0], &mut off);
        let step = direct.step(&off, &[0.0; 2], &mut image);
        (!step.passages.is_empty()).then_some(image)
    };
    let kick = kick(1.0).or(kick(-1.0)).expect("contact on one side");
    let mean = 2f64.powf(0.25) * 1.225_416_702_465_177_6 / (2.0 * std::f64::consts::PI.sqrt());
    for (found, kick) in found.mean.iter().zip(kick) {
        let expected = kick * mean;
        // The mean of 40 000 such numbers is known to 0.6 %.
        assert!((found - expected).abs() < 0.03 * expected.abs(), "{found}: {expected}");
    }
}

#[test]
fn a_seed_gives_the_same_numbers_on_any_number_of_threads_and_another_gives_others() {
    let case = Case::new("linear");
    let asked = NoiseRequest {
        orbits: 700,
        transient: 1,
        keep: 20,
        method: Method::Guarded,
        law: NoiseLaw::Uniform,
        ..request(1e-6)
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| case.noise(&asked))
    };
    let found = on(1);
    assert_eq!(found, on(3));
    assert!(found.contacts > 0.0 && found.by_map > 0.0);
    assert_ne!(found.mean, case.noise(&NoiseRequest { seed: 2, ..asked.clone() }).mean);
    let counted: u64 = found.joint.iter().sum();
    assert!(counted <= found.points && counted > 0);
    // Each marginal holds the points of the joint density, and those outside in the other.
    assert!(found.marginals.iter().all(|counts| counts.iter().sum::<u64>() >= counted));
}

#[test]
fn guarded_orbits_are_those_of_direct_simulation_under_the_same_noise() {
    let case = Case::new("linear");
    let asked =
        |method| NoiseRequest { orbits: 40, transient: 0, keep: 12, method, ..request(1e-6) };
    let [guarded, direct] = [Method::Guarded, Method::Direct].map(|m| case.noise(&asked(m)));
    assert_eq!(direct.by_map, 0.0);
    for row in 0..2 {
        let size = direct.covariance[row][row].sqrt();
        assert!((guarded.mean[row] - direct.mean[row]).abs() < 1e-2 * size);
    }
}
