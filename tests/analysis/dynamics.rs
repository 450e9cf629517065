//! Effect of one step's truncation on orbits: closed forms against direct simulation, and maps
//! against both.
//!
//! The oracle is Foale's closed form of one-impact orbits of the linear oscillator (1994;
//! tests/data/rigid/README.md), which is independent of the simulator and of the expansion.

use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::periodic::{
    Guess, PeriodicOrbit, PeriodicProblem, SectionMap, SectionStep, Stepped, linearise,
    window_scales,
};
use grazemap::analysis::{DirectImage, DirectMap, MapEvaluation};
use grazemap::convergence::{ChoiceOptions, MapFamily, choose, chosen_map, fit_slope};
use grazemap::expansion::{LocalMap, MapOrders};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap, InterpretedMap, PassageSet};
use grazemap::model::Scene;
use grazemap::numeric::{Dd, Real, Scalar};
use grazemap::orbit::GrazingOrbit;
use grazemap_studies::held::{Bifurcation, bifurcation, branch};

use crate::support::foale::Foale;
use crate::support::scenes::grazing;

/// A scene of the catalogue with its grazing orbit and its simulator.
struct Subject {
    scene: Scene,
    orbit: GrazingOrbit,
    system: HybridSystem,
}

impl Subject {
    fn new(name: &str) -> Self {
        let (scene, orbit) = grazing(name);
        Self { system: HybridSystem::new(&scene.model), scene, orbit }
    }

    fn direct(&self) -> DirectImage<'_, Dd> {
        DirectImage::new(&self.system, &self.scene, &self.orbit).expect("good parameters")
    }

    fn family(&self, orders: (u32, u32)) -> MapFamily<'_> {
        MapFamily::new(&self.scene, &self.orbit, pair(orders)).expect("an analytic graze")
    }

    fn map(&self, orders: (u32, u32)) -> LocalMap {
        self.family(orders).map(pair(orders)).expect("small spaces")
    }

    /// Problem of an orbit with one impact in a number of returns.
    fn problem(&self, returns: usize) -> PeriodicProblem {
        let mut itinerary = vec![PassageSet::default(); returns];
        itinerary[0].insert(0);
        PeriodicProblem {
            returns,
            free: 0,
            itinerary: Some(itinerary),
            scales: window_scales(&self.map((1, 1)).window),
        }
    }

    fn parameter(&self, name: &str) -> Dd {
        let parameters = &self.scene.model.parameters;
        let place = parameters.iter().position(|known| known.name == name);
        self.orbit.parameters()[place.expect("a parameter")]
    }
}

fn pair((smooth_order, contact_weight): (u32, u32)) -> MapOrders {
    MapOrders { smooth_order, contact_weight }
}

/// Orbits at these distances beyond the stop, the second parameter at an offset.
fn orbits<S: Real>(
    map: &mut impl SectionMap<S>,
    problem: &PeriodicProblem,
    unfolding: f64,
    depths: &[f64],
) -> Vec<PeriodicOrbit<S>> {
    let guess =
        Guess { state: vec![S::zero(); 2], parameters: vec![S::zero(), S::from_f64(unfolding)] };
    let depths: Vec<S> = depths.iter().map(|&depth| S::from_f64(depth)).collect();
    branch(map, problem, 0, &depths, &guess)
}

/// The first bifurcation of a kind along a branch.
fn first(
    map: &mut impl SectionMap<Dd>,
    problem: &PeriodicProblem,
    kind: BifurcationKind,
    unfolding: f64,
    depths: &[f64],
) -> Option<Bifurcation<Dd>> {
    let orbits = orbits(map, problem, unfolding, depths);
    orbits.windows(2).find_map(|pair| bifurcation(map, problem, kind, 0, [&pair[0], &pair[1]]))
}

/// Depths by quarters of a decade, ascending.
fn depths(deepest: f64, decades: i32) -> Vec<f64> {
    let depth = |k: i32| deepest * 10f64.powf(f64::from(k) / 4.0);
    (-4 * decades..=0).map(depth).collect()
}

/// Largest relative difference allowed between direct simulation in double-double and a closed
/// form: differences of fourth order keep 23 digits of a derivative, and the flight 28 of a state.
const CLOSED: f64 = 1e-17;

fn assert_close(found: Dd, expected: Dd, what: &str) {
    let error = ((found - expected) / expected).magnitude();
    assert!(error < CLOSED, "{what}: {found:?}, closed form {expected:?}, {error:e}");
}

#[test]
fn direct_orbits_have_foales_trace_and_determinant_at_their_parameter() {
    let half = Dd::from(0.5);
    for name in ["foale", "foale_omega_2_2"] {
        let subject = Subject::new(name);
        let (omega, zeta) = (subject.parameter("omega"), half * subject.parameter("d"));
        let form = Foale::new(omega, zeta, subject.parameter("r"), 1);
        let problem = subject.problem(1);
        let found = orbits(&mut subject.direct(), &problem, 0.0, &[1e-9, 1e-6, 1e-3, 1e-2]);
        assert_eq!(found.len(), 4, "{name}");
        for orbit in &found {
            let alpha = subject.parameter("alpha") + orbit.parameters[0];
            assert_close(orbit.trace(), form.trace(form.speed(alpha)), name);
            let determinant = orbit.determinant().expect("finite");
            let error = (determinant - form.determinant()).magnitude();
            // The determinant is a difference of products as large as the squared trace.
            let trace = orbit.trace().magnitude();
            assert!(error < CLOSED + 1e-23 * trace * trace, "{name}: {error:e}");
            assert_eq!((orbit.extra_contacts, orbit.residual < 1e-24), (0, true), "{name}");
        }
    }
}

#[test]
fn direct_folds_and_flips_are_foales() {
    let subject = Subject::new("linear_codim2");
    let mut direct = subject.direct();
    let alpha = subject.parameter("alpha");
    let near = |depth: f64| [0.5 * depth, depth, 2.0 * depth];
    let mut at = |returns, kind, unfolding, depths: &[f64]| {
        let problem = subject.problem(returns);
        let found = first(&mut direct, &problem, kind, unfolding, depths).expect("a bifurcation");
        assert_eq!(found.orbit.extra_contacts, 0);
        alpha + found.orbit.parameters[0]
    };
    let fold = at(1, BifurcationKind::Fold, -1e-4, &near(1.2e-5));
    assert_close(fold, Foale::unfolded(|name| subject.parameter(name), -1e-4, 1).fold(), "fold");
    let flip = at(1, BifurcationKind::Flip, 1e-3, &near(1.5e-6));
    assert_close(flip, Foale::unfolded(|name| subject.parameter(name), 1e-3, 1).flip(), "flip");
    let along = [1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 5.5e-6, 6e-6, 6.5e-6];
    let second = at(2, BifurcationKind::Fold, 1e-3, &along);
    assert_close(
        second,
        Foale::unfolded(|name| subject.parameter(name), 1e-3, 2).fold(),
        "fold of period two",
    );
}

#[test]
fn the_flip_of_foales_oscillator_far_from_grazing_is_the_published_one() {
    let subject = Subject::new("foale_omega_2_2");
    let along = [1e-3, 1e-2, 3e-2, 5e-2, 7e-2, 9e-2];
    let problem = subject.problem(1);
    let flip = first(&mut subject.direct(), &problem, BifurcationKind::Flip, 0.0, &along);
    let alpha = subject.parameter("alpha") + flip.expect("a flip").orbit.parameters[0];
    // alpha = 4.270260988791 (Foale 1994, restored in tests/data/rigid/README.md).
    assert!((alpha.to_f64() - 4.270260988790732).abs() < 1e-14, "{alpha:?}");
}

#[test]
fn derivatives_by_differences_are_those_carried_along() {
    let subject = Subject::new("mems_codim2");
    let map = subject.map((3, 5));
    let scales = window_scales(&map.window);
    let (state, parameters) = ([1e-7, 3e-3], [2e-5, -1e-5]);
    let mut image = [0.0; 2];
    let mut jacobian = [0.0; 4];
    let interpreted = InterpretedMap::new(&map);
    interpreted.step_jacobian(&state, &parameters, &mut image, &mut jacobian);
    let exact = |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect::<Vec<_>>();
    let mut evaluation = MapEvaluation::<Dd>::new(&map);
    let found = linearise(&mut evaluation, &exact(&state), &exact(&parameters), 0, &scales);
    let found = found.expect("away from the corner").by_state;
    for (place, entry) in jacobian.iter().enumerate() {
        // Rounding of the interpreter; the differences keep 23 digits.
        let difference = found[(place / 2, place % 2)].to_f64() - entry;
        assert!(difference.abs() < 1e-13 * entry.abs().max(1.0), "{place}: {difference:e}");
    }
}

#[test]
fn direct_jacobians_in_double_precision_hold_near_the_graze() {
    let subject = Subject::new("linear");
    let direct = DirectMap::new(&subject.system, &subject.scene, &subject.orbit).expect("a map");
    let (state, parameters) = ([1e-6, 2e-3], [0.0, 0.0]);
    let (mut image, mut jacobian) = ([0.0; 2], [0.0; 4]);
    direct.step_jacobian(&state, &parameters, &mut image, &mut jacobian);
    let exact = |values: &[f64]| values.iter().map(|&value| Dd::from(value)).collect::<Vec<_>>();
    let scales = window_scales(&subject.map((1, 1)).window);
    let mut truth = Differences(subject.direct());
    let truth = linearise(&mut truth, &exact(&state), &exact(&parameters), 0, &scales);
    let truth = truth.expect("away from the corner").by_state;
    let largest = truth.iter().fold(0.0, |max: f64, entry| max.max(entry.magnitude()));
    for (place, entry) in jacobian.iter().enumerate() {
        // Double precision leaves ten digits of a kick at this depth.
        let difference = truth[(place / 2, place % 2)].to_f64() - entry;
        assert!(difference.abs() < 1e-9 * largest, "{place}: {difference:e} of {largest:e}");
    }
}

/// Images of direct simulation without its first variations, so that derivatives are differences.
struct Differences<'a>(DirectImage<'a, Dd>);

impl SectionMap<Dd> for Differences<'_> {
    fn image(&mut self, state: &[Dd], parameters: &[Dd]) -> Option<SectionStep<Dd>> {
        SectionMap::image(&mut self.0, state, parameters)
    }
}

/// Power of `y` with which the error of the orbit's parameter falls.
fn slope(
    subject: &Subject,
    truth: &[PeriodicOrbit<Dd>],
    orders: (u32, u32),
    depths: &[f64],
) -> f64 {
    let mut map = MapEvaluation::<Dd>::new(&subject.map(orders));
    let found = orbits(&mut map, &subject.problem(1), 0.0, depths);
    assert_eq!(found.len(), depths.len(), "{orders:?}");
    let errors = found.iter().zip(truth).zip(depths);
    let points = errors.map(|((map, truth), depth)| {
        let error = (map.parameters[0] - truth.parameters[0]).magnitude();
        (depth.sqrt(), error, 1e-14 * depth.sqrt())
    });
    let points: Vec<_> = points.collect();
    let points: Vec<_> = points.into_iter().rev().collect();
    fit_slope(&points).expect("errors above rounding").slope
}

#[test]
fn the_error_of_the_orbit_born_falls_as_its_orders_say() {
    // Docs: docs/mathematics/dynamics.md. Generic: min(N + 1, 1 + ⌈W/2⌉); where ξ₁ = 0: min(N + 1,
    // 2 + ⌈W/2⌉).
    let cases = [
        ("linear", [((1, 2), 2.0), ((2, 2), 2.0), ((2, 3), 3.0), ((3, 5), 4.0)]),
        ("linear_codim2", [((1, 2), 2.0), ((2, 2), 3.0), ((2, 3), 3.0), ((3, 4), 4.0)]),
        ("mems_codim2", [((1, 2), 2.0), ((2, 2), 3.0), ((3, 3), 4.0), ((3, 4), 4.0)]),
    ];
    for (name, expected) in cases {
        let subject = Subject::new(name);
        let depths = depths(subject.scene.window.depth * 0.1, 4);
        let truth = orbits(&mut subject.direct(), &subject.problem(1), 0.0, &depths);
        for (orders, expected) in expected {
            let found = slope(&subject, &truth, orders, &depths);
            // The next power is still there at the smallest depths.
            assert!((found - expected).abs() < 0.1, "{name} {orders:?}: {found}, {expected}");
        }
    }
}

#[test]
fn the_lowest_order_calls_an_unstable_orbit_stable_where_xi_vanishes() {
    let subject = Subject::new("mems_scenario3");
    let depths = depths(1e-7, 1);
    let problem = subject.problem(1);
    let direct = orbits(&mut subject.direct(), &problem, 0.0, &depths);
    let truth = direct[0].multipliers().expect("finite")[0];
    assert!(truth.re < -2.5 && direct[0].parameters[0] > Dd::ZERO, "{truth}");
    let said = |orders| {
        let mut map = MapEvaluation::<Dd>::new(&subject.map(orders));
        orbits(&mut map, &problem, 0.0, &depths).remove(0)
    };
    assert!(said((1, 1)).parameters[0] < Dd::ZERO, "on the wrong side of the graze");
    assert!(said((1, 2)).is_stable().expect("finite"), "stable after it, it says");
    let (half, right) = (said((2, 1)), said((2, 2)));
    let of = |orbit: &PeriodicOrbit<Dd>| orbit.multipliers().expect("finite")[0].re;
    // At (2, 1) the contact does not contract; at (2, 2) the error is that of the depth, y = 1e-4.
    assert!((of(&half) / truth.re - 1.0).abs() > 0.1, "{}", of(&half));
    assert!((of(&right) / truth.re - 1.0).abs() < 1e-3, "{}", of(&right));
}

#[test]
fn folds_and_flips_that_leave_a_codimension_two_point_need_the_second_order() {
    let subject = Subject::new("linear_codim2");
    let problem = subject.problem(1);
    let along = depths(1e-3, 6);
    for (kind, unfolding) in [(BifurcationKind::Fold, -1e-4), (BifurcationKind::Flip, 1e-4)] {
        let form = Foale::unfolded(|name| subject.parameter(name), unfolding, 1);
        let truth = match kind {
            BifurcationKind::Fold => form.fold(),
            BifurcationKind::Flip => form.flip(),
        };
        let distance = (truth - form.gain()).magnitude();
        let error = |orders| {
            let mut map = MapEvaluation::<Dd>::new(&subject.map(orders));
            let found = first(&mut map, &problem, kind, unfolding, &along)?;
            let alpha = subject.parameter("alpha") + found.orbit.parameters[0];
            Some((alpha - truth).magnitude() / distance)
        };
        assert_eq!([error((1, 2)), error((1, 5))], [None, None], "{kind:?}: none at N = 1");
        let errors = [(2, 1), (2, 2), (3, 4), (4, 6)].map(|orders| error(orders).expect("there"));
        assert!(errors[0] > 0.1, "{kind:?}: {errors:?}");
        assert!(errors[1] < 0.03 && errors[2] < 1e-4 && errors[3] < 1e-7, "{kind:?}: {errors:?}");
    }
}

#[test]
fn the_map_of_a_tolerance_is_right_about_orbits_folds_and_stability() {
    let subject = Subject::new("linear_codim2");
    let depth = subject.scene.window.depth;
    let options = ChoiceOptions { tolerance: 1e-2 * depth, fresh: 100 };
    let choice = choose(&subject.scene, &subject.orbit, &options).expect("a window");
    assert!(
        choice.met && choice.orders.smooth_order >= 2 && choice.orders.contact_weight >= 2,
        "{choice:?}"
    );
    let (_, run) = chosen_map(&choice, &subject.scene, &subject.orbit).expect("an expansion");
    let problem = subject.problem(1);
    let along = depths(depth, 4);
    let chosen = orbits(&mut Stepped(&run), &problem, 0.0, &along);
    let direct = orbits(&mut subject.direct(), &problem, 0.0, &along);
    assert_eq!(chosen.len(), direct.len());
    for (chosen, direct) in chosen.iter().zip(&direct) {
        // A step's error of ε moves the parameter by about ε, p being 0.09 y²: 1e-2 of the depth is
        // a ninth of p, at the edge.
        let error = chosen.parameters[0] / direct.parameters[0].to_f64() - 1.0;
        assert!(error.abs() < 0.12, "{error:e}");
        assert!((chosen.trace() - direct.trace().to_f64()).abs() < 1e-2);
        assert!(chosen.is_stable().expect("finite"));
    }
    // The fold lies at y² = 1e-5. An economised map is as good at the edge as there, so that the
    // tolerance is to be a hundredth of that.
    let nearer = ChoiceOptions { tolerance: 1e-4 * depth, fresh: 100 };
    let choice = choose(&subject.scene, &subject.orbit, &nearer).expect("a window");
    let (_, run) = chosen_map(&choice, &subject.scene, &subject.orbit).expect("an expansion");
    let found = orbits(&mut Stepped(&run), &problem, -1e-4, &depths(depth, 5));
    let fold = found.windows(2).find_map(|pair| {
        bifurcation(&mut Stepped(&run), &problem, BifurcationKind::Fold, 0, [&pair[0], &pair[1]])
    });
    let alpha = fold.expect("a fold").orbit.parameters[0] + subject.parameter("alpha").to_f64();
    let form = Foale::unfolded(|name| subject.parameter(name), -1e-4, 1);
    let distance = (form.fold() - form.gain()).magnitude();
    assert!((alpha - form.fold().to_f64()).abs() < 0.02 * distance, "{alpha}");
}

#[test]
fn the_lowest_order_has_the_period_adding_of_the_one_dimensional_law() {
    // The multipliers of this beam are 0.69 and 1e-9: at (1, 1) its map is the one-dimensional
    // square-root map, whose 1/6 orbit flips at mu_PD = 2.3011829e-4
    // (tests/data/rigid/beam_cascade.json).
    // NOTE: the file has `Infinity`, which JSON has not.
    let text = include_str!("../data/rigid/beam_cascade.json").replace("Infinity", "null");
    let reference: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let row = &reference["prediction_leading_with_y2"][5];
    let expected = row["mu_PD"].as_f64().expect("a number");
    let subject = Subject::new("cantilever_3_5_soft");
    let map = subject.map((1, 1));
    let run = HornerMap::new(&map);
    let (mut state, parameters) = ([0.0; 2], [2.4e-4, 0.0]);
    let mut image = [0.0; 2];
    let settled = (0..20_006).find_map(|iterate| {
        let contacts = run.step(&state, &parameters, &mut image).contacts();
        if iterate >= 20_000 && contacts > 0 {
            return Some(state);
        }
        state = image;
        None
    });
    let settled = settled.expect("an orbit with a contact");
    let guess =
        Guess { state: settled.map(Dd::from).into(), parameters: parameters.map(Dd::from).into() };
    let values: Vec<Dd> =
        (0..20).map(|step| guess.state[0] * Dd::from(1.0 - 0.01 * f64::from(step))).collect();
    let problem = subject.problem(6);
    let mut map = MapEvaluation::<Dd>::new(&map);
    let found = branch(&mut map, &problem, 0, &values, &guess);
    let flip = found.windows(2).find_map(|pair| {
        bifurcation(&mut map, &problem, BifurcationKind::Flip, 0, [&pair[0], &pair[1]])
    });
    let found = flip.expect("a flip").orbit.parameters[0].to_f64();
    // The reference drops the second multiplier, 1e-9 of the first.
    assert!((found / expected - 1.0).abs() < 1e-8, "{found}, {expected}");
}
