//! Parameters fitted to measured points: those of direct simulation are recovered, with valid
//! standard errors.

use grazemap::analysis::fit::{Fit, FitEnd, FitRequest, MeasuredSeries, fit};
use grazemap::analysis::{AnalysisError, DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DifferentiableMap, DiscreteMap, HornerMap};
use grazemap::model::Method;

use crate::Case;
use crate::support::scenes;
use crate::support::synthetic::Numbers;
use crate::support::tiers;

/// Electrostatic oscillator with its restitution as a variable, and a window that contains the
/// returns after a shallow contact.
fn mems() -> Case {
    let keys = [
        ("expansion.active", "[\"V\", \"omega\", \"r\"]"),
        ("window.depth", "6e-3"),
        ("window.state", "{ x = 6e-3, theta = 0.1 }"),
        ("window.parameter", "{ V = 3e-4, omega = 3e-4, r = 1e-2 }"),
    ];
    Case::of(scenes::scene_with("mems", &keys))
}

/// Approximately normal random number: the sum of twelve uniform ones.
fn normal(numbers: &mut Numbers) -> f64 {
    0.5 * (0..12).map(|_| numbers.next()).sum::<f64>()
}

/// Standard deviations of the measurement.
const NOISE: [f64; 2] = [3e-7, 1e-5];

/// Series of points of a map from states with contacts deeper than the noise, measured with it.
fn measured(
    map: &impl DiscreteMap,
    truth: &[f64],
    (series, returns): (usize, usize),
    scatter: f64,
    numbers: &mut Numbers,
) -> Vec<MeasuredSeries> {
    let one = |_| {
        let mut state = vec![8e-6 + 4e-6 * numbers.next(), 1e-3 * numbers.next()];
        let mut points = Vec::new();
        for _ in 0..=returns {
            let noisy = state.iter().zip(NOISE);
            points.push(noisy.map(|(x, s)| x + scatter * s * normal(numbers)).collect());
            let mut image = vec![0.0; 2];
            assert!(map.step(&state, truth, &mut image).valid);
            state = image;
        }
        MeasuredSeries { controls: vec![0.0; truth.len()], points }
    };
    (0..series).map(one).collect()
}

fn request(series: Vec<MeasuredSeries>) -> FitRequest {
    FitRequest {
        parameters: vec![0, 1, 2],
        at: vec![0.0; 3],
        series,
        noise: Some(NOISE.to_vec()),
        piece: 0,
        withheld: 0,
        method: Method::Map,
    }
}

impl Case {
    fn fit(&self, request: &FitRequest) -> Fit {
        fit(&self.scene, &self.orbit, &self.map, request, &NoProgress).expect("good series")
    }
}

const TRUTH: [f64; 3] = [-1e-5, -1e-5, 4e-3];

#[test]
fn parameters_are_found_in_noisy_points_of_direct_simulation_and_withheld_ones_are_predicted() {
    let case = mems();
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let series = measured(&direct, &TRUTH, (30, 3), 1.0, &mut Numbers::new(3));
    let asked = FitRequest { withheld: 1, method: Method::Guarded, ..request(series) };
    let found = case.fit(&asked);
    assert_eq!(found.end, FitEnd::Converged);
    for (fitted, truth) in found.parameters.iter().zip(TRUTH) {
        let error = (fitted.offset - truth).abs();
        assert!(error < 4.0 * fitted.standard_error, "{fitted:?}: {truth}");
    }
    let freedom = found.freedom as f64;
    assert!((found.sum_of_squares - freedom).abs() < 4.0 * (2.0 * freedom).sqrt());
    let withheld = found.withheld.expect("one of every series");
    assert_eq!(withheld.points, 30);
    for error in withheld.error_over_noise {
        // Errors of the predictions include the uncertainty of the starts.
        assert!((0.5..6.0).contains(&error), "{error}");
    }
}

#[test]
fn points_without_noise_give_the_parameters_themselves() {
    let case = mems();
    let map = HornerMap::new(&case.map);
    let series = measured(&map, &TRUTH, (20, 2), 0.0, &mut Numbers::new(5));
    let found = case.fit(&request(series));
    for (fitted, truth) in found.parameters.iter().zip(TRUTH) {
        assert!((fitted.offset - truth).abs() < 1e-9 * truth.abs(), "{fitted:?}: {truth}");
    }
}

#[test]
fn standard_errors_cover_the_truth_as_often_as_they_should() {
    let case = mems();
    let map = HornerMap::new(&case.map);
    let mut numbers = Numbers::new(11);
    let (mut within, mut all, trials) = ([0; 2], 0, 60);
    for _ in 0..trials {
        let series = measured(&map, &TRUTH, (50, 2), 1.0, &mut numbers);
        let found = case.fit(&request(series));
        for (fitted, truth) in found.parameters.iter().zip(TRUTH) {
            let error = (fitted.offset - truth).abs() / fitted.standard_error;
            within[0] += usize::from(error < 1.0);
            within[1] += usize::from(error < 2.0);
            all += 1;
        }
    }
    // Parameters of one trial are not independent: three standard deviations of 60 trials.
    let share = |number: usize| within[number] as f64 / f64::from(all);
    assert!((share(0) - 0.683).abs() < 3.0 * (0.683f64 * 0.317 / f64::from(trials)).sqrt());
    assert!((share(1) - 0.954).abs() < 3.0 * (0.954f64 * 0.046 / f64::from(trials)).sqrt());
}

/// Series that graze: half of the fits from parameters of 0 ended in minima with contacts that are
/// not those of the data.
#[test]
fn false_minima_are_left_for_the_parameters_of_single_returns() {
    const SETS: usize = 12;
    let noise = [1e-8, 1e-7];
    let case = Case::new("linear");
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let mut numbers = Numbers::new(3);
    let mut found = 0;
    for _ in 0..SETS {
        let truth = [2e-6 * numbers.next(), 3e-6 * numbers.next()];
        let series = (0..15).map(|_| {
            let mut state = vec![4e-6 * numbers.next(), 2e-4 * numbers.next()];
            let points = (0..4).map(|_| {
                let pairs = state.iter().zip(noise);
                let measured = pairs.map(|(x, size)| x + size * normal(&mut numbers)).collect();
                let mut image = vec![0.0; 2];
                assert!(direct.step(&state, &truth, &mut image).valid);
                state = image;
                measured
            });
            MeasuredSeries { controls: vec![0.0; 2], points: points.collect() }
        });
        let series = series.collect();
        let asked = FitRequest {
            parameters: vec![0, 1],
            at: vec![0.0; 2],
            noise: Some(noise.to_vec()),
            piece: FitRequest::PIECE,
            method: Method::Guarded,
            ..request(series)
        };
        let fitted = case.fit(&asked);
        let near = fitted
            .parameters
            .iter()
            .zip(truth)
            .all(|(fitted, truth)| (fitted.offset - truth).abs() < 5.0 * fitted.standard_error);
        found += usize::from(near && fitted.end == FitEnd::Converged);
    }
    assert!(found + 1 >= SETS, "{found} of {SETS}");
}

#[test]
fn noise_that_is_not_stated_is_estimated() {
    let case = mems();
    let map = HornerMap::new(&case.map);
    let series = measured(&map, &TRUTH, (60, 2), 1.0, &mut Numbers::new(2));
    let known = case.fit(&request(series.clone()));
    let found = case.fit(&FitRequest { noise: None, ..request(series) });
    for (estimated, truth) in found.noise.iter().zip(NOISE) {
        assert!((estimated / truth - 1.0).abs() < 0.2, "{estimated}: {truth}");
    }
    for (own, known) in found.parameters.iter().zip(&known.parameters) {
        assert!((own.offset - known.offset).abs() < known.standard_error);
        assert!((own.standard_error / known.standard_error - 1.0).abs() < 0.2);
    }
}

#[test]
fn pieces_and_missing_numbers_cost_precision_alone() {
    let case = mems();
    let map = HornerMap::new(&case.map);
    let mut series = measured(&map, &TRUTH, (60, 3), 1.0, &mut Numbers::new(4));
    for (number, own) in series.iter_mut().enumerate() {
        own.points[1 + number % 2][number % 2] = f64::NAN;
    }
    let whole = case.fit(&request(series.clone()));
    let cut = case.fit(&FitRequest { piece: 1, ..request(series) });
    assert_eq!((whole.measured, whole.pieces), (60 * 7, 60));
    assert!(cut.pieces > whole.pieces && cut.measured <= whole.measured);
    for own in [&whole, &cut] {
        for (own, truth) in own.parameters.iter().zip(TRUTH) {
            assert!((own.offset - truth).abs() < 4.0 * own.standard_error, "{own:?}");
        }
    }
    for (own, whole) in cut.parameters.iter().zip(&whole.parameters) {
        assert!(own.standard_error > whole.standard_error);
    }
}

#[test]
fn a_restitution_without_contacts_is_said_not_to_be_determined() {
    let case = mems();
    let map = HornerMap::new(&case.map);
    let apart = |n: usize| vec![-1e-3 - 1e-5 * n as f64, 0.0];
    let one = |n: usize| {
        let mut image = vec![0.0; 2];
        assert!(map.step(&apart(n), &[0.0; 3], &mut image).passages.is_empty());
        MeasuredSeries { controls: vec![0.0; 3], points: vec![apart(n), image] }
    };
    let asked = FitRequest { parameters: vec![2], ..request((0..9).map(one).collect()) };
    let found = case.fit(&asked);
    assert!(!found.parameters[0].standard_error.is_finite(), "{found:?}");
}

#[test]
fn too_few_numbers_and_wrong_lengths_are_refused() {
    let case = mems();
    let one = |points: Vec<Vec<f64>>| MeasuredSeries { controls: vec![0.0; 3], points };
    let refused = |series| fit(&case.scene, &case.orbit, &case.map, &request(series), &NoProgress);
    let few = refused(vec![one(vec![vec![0.0; 2]; 2])]);
    assert!(matches!(few, Err(AnalysisError::TooFewMeasured { measured: 4, unknowns: 5 })));
    let short = refused(vec![one(vec![vec![0.0; 3]; 9])]);
    assert!(matches!(short, Err(AnalysisError::Length { expected: 2, found: 3, .. })));
}

#[test]
fn measured_values_at_the_ends_of_the_range_of_numbers_are_refused_or_have_an_outcome() {
    let case = mems();
    let good: Vec<Vec<f64>> = (0..9).map(|k| vec![1e-6 * f64::from(k), 1e-4]).collect();
    let refuses = [1e160, -1e160, 1e300, f64::MAX, f64::INFINITY];
    let values = [&[1e-320, 1e10, 1e90], &refuses[..]].concat();
    for &value in tiers::part(&values, 3) {
        let mut once = good.clone();
        once[4][0] = value;
        for points in [vec![vec![value; 2]; 9], once] {
            for noise in [Some(NOISE.to_vec()), None] {
                for method in [Method::Map, Method::Guarded, Method::Direct] {
                    let points = points.clone();
                    let series = vec![MeasuredSeries { controls: vec![0.0; 3], points }];
                    let request = FitRequest { noise: noise.clone(), method, ..request(series) };
                    let found = fit(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
                    let is_refused = matches!(found, Err(AnalysisError::Unbounded { .. }));
                    assert_eq!(is_refused, refuses.contains(&value), "{value:e}: {found:?}");
                    assert!(is_refused || found.is_ok(), "{value:e}: {found:?}");
                }
            }
        }
    }
    let series = || vec![MeasuredSeries { controls: vec![0.0; 3], points: good.clone() }];
    for noise in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let request = FitRequest { noise: Some(vec![noise, 1e-5]), ..request(series()) };
        let found = fit(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
        assert!(matches!(found, Err(AnalysisError::NotAStandardDeviation { .. })), "{found:?}");
    }
}

#[test]
fn derivatives_by_parameters_are_those_of_direct_simulation() {
    let case = mems();
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let map = HornerMap::new(&case.map);
    let (mut image, mut own, mut simulated) = ([0.0; 2], [0.0; 10], [0.0; 10]);
    for (state, contact) in [([4e-6, 0.0], true), ([-4e-5, 1e-3], false)] {
        let step = map.step_derivatives(&state, &TRUTH, &mut image, &mut own);
        assert_eq!(!step.passages.is_empty(), contact);
        let simple = map.step(&state, &TRUTH, &mut [0.0; 2]);
        assert_eq!(step, simple);
        direct.step_derivatives(&state, &TRUTH, &mut image, &mut simulated);
        for (a, b) in own.iter().zip(simulated) {
            // The truncation of the map, whose entries are as large as 1e3 here.
            assert!((a - b).abs() < 1e-3 * (1.0 + b.abs()), "{own:?} {simulated:?}");
        }
    }
}
