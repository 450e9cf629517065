//! Composition, inversion and implicit functions.

use grazemap::jet::{Jet, JetError, JetMap, JetSpace, implicit_root, implicit_roots, substitute};
use grazemap::numeric::{Dd, Lanes, Scalar};
use proptest::prelude::*;

use super::identities::{agree, drawn, jet};

/// A random map: near the identity, each component beginning at its variable's weight.
fn map<S: Scalar>(weights: &[u32], order: usize, drawn: &[f64]) -> JetMap<S> {
    let space = JetSpace::new(weights, order).expect("a small space");
    let component = |variable: usize| {
        let mut component = jet::<S>(&space, 0.0, &drawn[variable * 7..]);
        for degree in 0..weights[variable] as usize {
            component.coefficients_mut()[space.degree_range(degree)].fill(S::zero());
        }
        component.scale_in_place(S::from_f64(0.5));
        &component + &Jet::variable(&space, variable, S::zero())
    };
    JetMap::new((0..weights.len()).map(component).collect()).expect("components of one space")
}

/// Moves components into another map's space, which has the same monomials.
fn in_space_of<S: Scalar>(map: JetMap<S>, other: &JetMap<S>) -> JetMap<S> {
    let moved = |jet: Jet<S>| Jet::from_coefficients(other.space(), jet.coefficients().to_vec());
    JetMap::new(map.into_components().into_iter().map(moved).collect())
        .expect("components of one space")
}

fn same<S: Scalar>(left: &JetMap<S>, right: &JetMap<S>, scale: f64) -> bool {
    left.components().iter().zip(right.components()).all(|(left, right)| agree(left, right, scale))
}

fn largest<S: Scalar>(map: &JetMap<S>) -> f64 {
    map.components().iter().map(Jet::max_abs).fold(1.0, f64::max)
}

fn check_group<S: Scalar>(weights: &[u32], order: usize, drawn: [&[f64]; 3]) {
    let f = map::<S>(weights, order, drawn[0]);
    let [g, h] = [drawn[1], drawn[2]].map(|drawn| in_space_of(map::<S>(weights, order, drawn), &f));
    let compose =
        |f: &JetMap<S>, g: &JetMap<S>| f.compose(g).expect("as many components as variables");
    let left = compose(&compose(&f, &g), &h);
    let right = compose(&f, &compose(&g, &h));
    assert!(same(&left, &right, 100.0 * largest(&left)), "composition is associative");
    let inverse = f.invert().expect("a linear part near 1");
    let identity = JetMap::identity(f.space());
    // NOTE: a composition multiplies up to `order` coefficients of the inverse.
    let scale = largest(&inverse).powi(2) * 100.0;
    assert!(same(&compose(&f, &inverse), &identity, scale), "M ∘ M⁻¹ = id");
    assert!(same(&compose(&inverse, &f), &identity, scale), "M⁻¹ ∘ M = id");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn maps_form_a_group(f in drawn(), g in drawn(), h in drawn()) {
        check_group::<f64>(&[1, 1, 1], 5, [&f, &g, &h]);
        check_group::<f64>(&[1, 2, 2], 7, [&f, &g, &h]);
        check_group::<Lanes<4>>(&[1, 2], 6, [&f, &g, &h]);
        check_group::<Dd>(&[1, 1], 5, [&f, &g, &h]);
    }

    #[test]
    fn a_composed_polynomial_has_the_value_of_the_composition(f in drawn(), g in drawn(), x in -0.4..0.4f64) {
        // NOTE: no truncation: degree 3 of degree 3 fits in order 9, constants included.
        let (outer, line) = (JetSpace::uniform(2, 3).unwrap(), JetSpace::uniform(1, 9).unwrap());
        let outer = jet::<f64>(&outer, 0.25, &f);
        let inner = [&g[..], &g[9..]].map(|drawn| jet::<f64>(&line, 0.5, drawn).truncate(3));
        let point = [inner[0].evaluate(&[x]), inner[1].evaluate(&[x])];
        let error = substitute(&outer, &inner).evaluate(&[x]) - outer.evaluate(&point);
        prop_assert!(error.abs() < 1e-14, "{error:e}");
    }
}

#[test]
fn reversion_of_a_geometric_series_has_integer_coefficients() {
    // y = x / (1 − x) has the inverse x = y / (1 + y).
    let x = Jet::<f64>::variable(&JetSpace::uniform(1, 12).unwrap(), 0, 0.0);
    let map = JetMap::new(vec![&x / &(-&x).add_constant(1.0)]).unwrap();
    let inverse = map.invert().unwrap();
    for (k, &value) in inverse.components()[0].coefficients().iter().enumerate().skip(1) {
        assert_eq!(value, if k % 2 == 1 { 1.0 } else { -1.0 }, "degree {k}");
    }
}

#[test]
fn reversion_of_a_parabola_gives_the_catalan_numbers() {
    let x = Jet::<Dd>::variable(&JetSpace::uniform(1, 10).unwrap(), 0, Dd::ZERO);
    let inverse = JetMap::new(vec![&x - &(&x * &x)]).unwrap().invert().unwrap();
    let catalan = [0.0, 1.0, 1.0, 2.0, 5.0, 14.0, 42.0, 132.0, 429.0, 1430.0, 4862.0];
    assert_eq!(inverse.components()[0].coefficients(), catalan.map(Dd::from));
}

#[test]
fn maps_that_have_no_inverse_are_refused() {
    let space = JetSpace::new(&[1, 2], 4).unwrap();
    let [x, y] = [0, 1].map(|variable| Jet::variable(&space, variable, 0.0));
    let refusal =
        |components: Vec<Jet<f64>>| JetMap::new(components).unwrap().invert().unwrap_err();
    assert_eq!(
        refusal(vec![x.clone(), x.clone()]),
        JetError::DegreeTooLow { component: 1, degree: 1, weight: 2 }
    );
    assert_eq!(
        refusal(vec![x.add_constant(1.0), y.clone()]),
        JetError::DegreeTooLow { component: 0, degree: 0, weight: 1 }
    );
    assert_eq!(refusal(vec![x.clone(), &x * &x]), JetError::Singular { column: 1 });
    assert_eq!(refusal(vec![x.clone()]), JetError::DimensionMismatch { expected: 2, found: 1 });
    let stranger = Jet::variable(&JetSpace::new(&[1, 2], 4).unwrap(), 1, 0.0);
    assert_eq!(
        JetMap::new(vec![x, stranger]).unwrap_err(),
        JetError::SpaceMismatch { component: 1 }
    );
    assert_eq!(JetMap::<f64>::new(vec![]).unwrap_err(), JetError::Empty);
}

/// Lambert's function has the coefficients `(−k)^(k−1) / k!`.
fn check_lambert<S: Scalar>() {
    let x = Jet::variable(&JetSpace::uniform(1, 10).expect("a small space"), 0, S::zero());
    let equation = |w: &Jet<S>| {
        let exp = w.exp();
        (&(w * &exp) - &x, &w.add_constant(S::one()) * &exp)
    };
    let w = implicit_root(&x, equation).expect("a simple root");
    let (mut factorial, mut worst) = (1.0, 0.0f64);
    for k in 1..=10 {
        factorial *= f64::from(k);
        let expected = S::from_f64(f64::from(-k).powi(k - 1)) / S::from_f64(factorial);
        worst = worst.max(((w.coefficients()[k as usize] - expected) / expected).magnitude());
    }
    assert!(worst < 64.0 * S::ROUNDOFF, "{worst:e}");
}

#[test]
fn implicit_root_gives_the_series_of_lambert() {
    check_lambert::<f64>();
    check_lambert::<Dd>();
    check_lambert::<Lanes<4>>();
}

#[test]
fn implicit_root_solves_kepler_from_a_rough_head() {
    // E − e sin E = M about M = 1, e = 0: E = M + e sin M + e² sin(2M)/2 + e³ (3 sin 3M − sin M)/8.
    let space = JetSpace::uniform(2, 3).unwrap();
    let (mean, eccentricity) = (Jet::variable(&space, 0, 1.0), Jet::variable(&space, 1, 0.0));
    let anomaly = implicit_root(&mean.add_constant(0.1), |anomaly| {
        let (sine, cosine) = anomaly.sin_cos();
        let value = &(anomaly - &(&eccentricity * &sine)) - &mean;
        (value, (-&(&eccentricity * &cosine)).add_constant(1.0))
    })
    .unwrap();
    let expected = [
        ([0, 0], 1.0),
        ([1, 0], 1.0),
        ([0, 1], 1f64.sin()),
        ([1, 1], 1f64.cos()),
        ([0, 2], 2f64.sin() / 2.0),
        ([1, 2], 2f64.cos()),
        ([0, 3], (3.0 * 3f64.sin() - 1f64.sin()) / 8.0),
    ];
    for (powers, value) in expected {
        assert!((anomaly.coefficient(&powers) - value).abs() < 1e-15, "{powers:?}");
    }
}

#[test]
fn two_implicit_roots_are_polar_coordinates() {
    let space = JetSpace::new(&[1, 2], 6).unwrap();
    let (x, y) = (Jet::variable(&space, 0, 1.0), Jet::variable(&space, 1, 1.0));
    let start = [Jet::constant(&space, 2f64.sqrt()), Jet::constant(&space, 0.75)];
    let roots = implicit_roots(&start, |polar| {
        let (sine, cosine) = polar[1].sin_cos();
        let (to_x, to_y) = (&polar[0] * &cosine, &polar[0] * &sine);
        (vec![&to_x - &x, &to_y - &y], vec![vec![cosine, -&to_y], vec![sine, to_x]])
    })
    .unwrap();
    assert!(agree(&roots[0], &(&(&x * &x) + &(&y * &y)).sqrt(), 1.0));
    assert!(agree(&roots[1], &y.atan2(&x), 1.0));
}

#[test]
fn double_roots_and_equations_without_root_are_refused() {
    let x = Jet::<f64>::variable(&JetSpace::uniform(1, 3).unwrap(), 0, 0.0);
    let double = implicit_root(&Jet::zero(x.space()), |t| (&(t * t) - &x, t.scale(2.0)));
    assert_eq!(double, Err(JetError::Singular { column: 0 }));
    let none = implicit_root(&x.add_constant(0.7), |t| ((t * t).add_constant(1.0), t.scale(2.0)));
    assert!(
        matches!(none, Err(JetError::NoConvergence { .. } | JetError::NotFinite { .. })),
        "{none:?}"
    );
}
