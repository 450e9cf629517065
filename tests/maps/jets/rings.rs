//! The one recurrence in three rings: numbers in time, homogeneous polynomials, jets in time.

use grazemap::jet::elementary::{
    atan2_part, exponential_part, power_part, primitive_part, product_part, quotient_part,
    sqrt_part,
};
use grazemap::jet::{Graded, HeadFunction, Jet, JetSeries, JetSpace, TimeSeries};
use grazemap::numeric::{Dd, Scalar};

use super::coefficients::assert_close;

/// Time derivatives of the flow of `x' = f(x)` at 0, `f` giving the part of one degree.
fn flow<S: Scalar, A: Graded<S>>(
    algebra: &A,
    start: &[S],
    f: impl Fn(usize, &[S], &mut [S]),
) -> Vec<S> {
    let mut x = vec![S::zero(); algebra.element_len()];
    x[algebra.part(0)].copy_from_slice(start);
    for k in 0..algebra.order() {
        let mut slope = vec![S::zero(); algebra.part(k).len()];
        f(k, &x, &mut slope);
        for (value, slope) in x[algebra.part(k + 1)].iter_mut().zip(slope) {
            *value = slope / S::from_f64((k + 1) as f64);
        }
    }
    x
}

#[test]
fn flow_of_the_square_has_all_coefficients_one() {
    let algebra = TimeSeries { order: 60 };
    let series = flow(&algebra, &[1.0], |k, x, out| product_part(&algebra, k, x, x, out));
    assert!(series.iter().all(|&coefficient| coefficient == 1.0), "{series:?}"); // 1 / (1 − t)
}

/// Jets of a flow after time 1/2, as the sum of its jets in time.
fn jets_at_half<S: Scalar>(algebra: &JetSeries, series: &[S]) -> Vec<S> {
    let mut sum = vec![S::zero(); algebra.space().len()];
    for jet in series.chunks_exact(algebra.space().len()).rev() {
        for (value, &term) in sum.iter_mut().zip(jet) {
            *value = *value * S::from_f64(0.5) + term;
        }
    }
    sum
}

/// Derivatives by `x_0` at 1/4, over factorials, of `x(1/2) = x_0 e^t / (1 − x_0 + x_0 e^t)`
/// (mpmath).
const LOGISTIC: [&str; 7] = [
    "0.3546612443924433927296167951131276",
    "1.220675445965050308509184438505416",
    "-0.6813728595946824493195594242118235",
    "0.3803377673622244142078402695376451",
    "-0.2123019947817282645600154763912083",
    "0.118505551791219753355835590471098",
    "-0.06614900542870511181779479617903828",
];

/// Likewise at 3/4 for `x' = sin x`: `x(1/2) = 2 atan(e^t tan(x_0/2))` (mpmath).
const SINE: [&str; 7] = [
    "1.151316393331779077582696263649411",
    "1.339860543371929966834110947099658",
    "-0.3188310716280506096157762461384342",
    "-0.01292249402537686596782437711239991",
    "0.07190141292005596000837158226677547",
    "-0.02980656819001766618303966960576883",
    "-0.004083029692142832990068186261661037",
];

fn start<S: Scalar>(time_order: usize, value: f64) -> (JetSeries, Jet<S>) {
    let space = JetSpace::uniform(1, 6).expect("a small space");
    let x = Jet::variable(&space, 0, S::from_f64(value));
    (JetSeries::new(&space, time_order), x)
}

fn check_logistic<S: Scalar>(time_order: usize) {
    let (algebra, x) = start::<S>(time_order, 0.25);
    let series = flow(&algebra, x.coefficients(), |k, x, out| {
        product_part(&algebra, k, x, x, out);
        out.iter_mut()
            .zip(&x[Graded::<S>::part(&algebra, k)])
            .for_each(|(out, &x)| *out = x - *out);
    });
    assert_close(&jets_at_half(&algebra, &series), &LOGISTIC, "logistic flow");
}

fn check_sine<S: Scalar>(time_order: usize) {
    let (algebra, x) = start::<S>(time_order, 0.75);
    let len = Graded::<S>::element_len(&algebra);
    let pair = std::cell::RefCell::new((vec![S::zero(); len], vec![S::zero(); len]));
    let series = flow(&algebra, x.coefficients(), |k, x, out| {
        let (sine, cosine) = &mut *pair.borrow_mut();
        let (part, euler) = (Graded::<S>::part(&algebra, k), euler(&algebra, x));
        exponential_part(&algebra, HeadFunction::Sin, k, x, &euler, cosine, out);
        sine[part.clone()].copy_from_slice(out);
        let mut cosine_part = out.to_vec();
        exponential_part(&algebra, HeadFunction::Cos, k, x, &euler, sine, &mut cosine_part);
        cosine[part].copy_from_slice(&cosine_part);
    });
    assert_close(&jets_at_half(&algebra, &series), &SINE, "flow of the sine");
}

#[test]
fn jets_of_the_logistic_flow_are_those_of_its_closed_form() {
    check_logistic::<f64>(40); // NOTE: radius of convergence above 3, so the tail is (1/6)^40.
    check_logistic::<Dd>(70);
}

#[test]
fn jets_of_the_flow_of_the_sine_are_those_of_its_closed_form() {
    check_sine::<f64>(40);
    check_sine::<Dd>(70);
}

fn euler<S: Scalar, A: Graded<S>>(algebra: &A, a: &[S]) -> Vec<S> {
    let mut euler = a.to_vec();
    for k in 0..=algebra.order() {
        euler[algebra.part(k)].iter_mut().for_each(|value| *value *= S::from_f64(k as f64));
    }
    euler
}

/// An element built degree by degree; `part` sees it and its Euler derivative.
fn build(algebra: &JetSeries, part: impl Fn(usize, &[f64], &[f64], &mut [f64])) -> Vec<f64> {
    let mut u = vec![0.0; Graded::<f64>::element_len(algebra)];
    for k in 0..=Graded::<f64>::order(algebra) {
        let mut out = vec![0.0; algebra.space().len()];
        part(k, &u, &euler(algebra, &u), &mut out);
        u[Graded::<f64>::part(algebra, k)].copy_from_slice(&out);
    }
    u
}

/// Order in time and in each jet of the comparison below.
const ORDER: usize = 5;

/// A jet in (time, x, y) as jets in (x, y) along time.
fn along_time(algebra: &JetSeries, jet: &Jet<f64>) -> Vec<f64> {
    let mut element = vec![0.0; Graded::<f64>::element_len(algebra)];
    for (powers, value) in jet.terms() {
        if let (true, Some(monomial)) =
            (usize::from(powers[0]) <= ORDER, algebra.space().monomial(&powers[1..]))
        {
            element[usize::from(powers[0]) * algebra.space().len() + monomial] = value;
        }
    }
    element
}

#[test]
fn jets_in_time_are_jets_with_time_as_a_variable() {
    let algebra = JetSeries::new(&JetSpace::uniform(2, ORDER).unwrap(), ORDER);
    let joint = JetSpace::uniform(3, 2 * ORDER).unwrap();
    let [t, x, y] = [0, 1, 2].map(|variable| Jet::variable(&joint, variable, 0.0));
    let a_jet = (&(&(&t * &x) + &x.scale(0.5)) + &(&y * &t.add_constant(0.25))).add_constant(0.6);
    let b_jet = (&(&t.scale(0.3) - &(&y * &y)) + &x).add_constant(1.2);
    let (a, b) = (along_time(&algebra, &a_jet), along_time(&algebra, &b_jet));
    let (ea, eb, g) = (euler(&algebra, &a), euler(&algebra, &b), &algebra);
    let (sinh_jet, cosh_jet) = a_jet.sinh_cosh();
    let w_jet = &(&a_jet * &a_jet) + &(&b_jet * &b_jet);
    let (cosh, w) = (along_time(g, &cosh_jet), along_time(g, &w_jet));
    let atan_w = along_time(g, &(&a_jet * &a_jet).add_constant(1.0));
    let cases = [
        ("quotient", &a_jet / &b_jet, build(g, |k, u, _, out| quotient_part(g, k, &a, &b, u, out))),
        ("square root", a_jet.sqrt(), build(g, |k, u, _, out| sqrt_part(g, k, &a, u, out))),
        (
            "exponential",
            a_jet.exp(),
            build(g, |k, u, _, out| exponential_part(g, HeadFunction::Exp, k, &a, &ea, u, out)),
        ),
        (
            "hyperbolic sine",
            sinh_jet,
            build(g, |k, _, _, out| {
                exponential_part(g, HeadFunction::Sinh, k, &a, &ea, &cosh, out)
            }),
        ),
        (
            "power",
            a_jet.power_real(2.5),
            build(g, |k, u, eu, out| power_part(g, 2.5, k, &a, &ea, u, eu, out)),
        ),
        (
            "arc tangent",
            a_jet.atan(),
            build(g, |k, _, eu, out| {
                primitive_part(g, HeadFunction::Atan, k, (&a, &a), &atan_w, eu, out)
            }),
        ),
        (
            "angle",
            a_jet.atan2(&b_jet),
            build(g, |k, _, eu, out| atan2_part(g, k, &a, &b, &ea, &eb, &w, eu, out)),
        ),
    ];
    for (name, jet, element) in cases {
        let expected = along_time(&algebra, &jet);
        let scale = expected.iter().fold(1.0, |max: f64, value| max.max(value.abs()));
        for (found, expected) in element.iter().zip(&expected) {
            assert!(
                (found - expected).abs() < 1e-14 * scale,
                "{name}: {found} instead of {expected}"
            );
        }
    }
}
