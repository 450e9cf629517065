//! Elementary functions at the ends of their ranges: what is a number comes out as one, with the
//! derivatives of its closed form.

use grazemap::flow::{Field, InputKind, evaluate};
use grazemap::jet::{Jet, JetSpace};
use grazemap::model::{Binary, ExpressionGraph, NodeId, Unary};
use grazemap::numeric::{Dd, Lanes, Scalar};

/// Coefficients up to the third of the hyperbolic tangent about a point, from `t = e^{-2|a|}`.
fn tangent_series(at: f64) -> [f64; 4] {
    let decay = (-2.0 * at.abs()).exp();
    let (u, w) = (at.signum() * (1.0 - decay) / (1.0 + decay), 4.0 * decay / (1.0 + decay).powi(2));
    // With the slope w = 1 - u², half of the second derivative is -u w, a sixth of the third
    // (2 u² w - w²)/3.
    [u, w, -u * w, (2.0 * u * u * w - w * w) / 3.0]
}

/// Largest error in units of rounding, each coefficient relative to itself.
///
/// The exponential of `-2|a|` is known to that many units where `a` is large.
fn roundings(at: f64) -> f64 {
    40.0 + 4.0 * at.abs().min(400.0)
}

fn assert_is_tangent(coefficients: &[f64], at: f64) {
    for (found, exact) in coefficients.iter().zip(tangent_series(at)) {
        let error = (found - exact).abs();
        let most = roundings(at) * f64::EPSILON * exact.abs();
        assert!(error <= most, "at {at}: {found:e}, not {exact:e}");
    }
}

const POINTS: [f64; 10] = [0.5, -1.5, 12.0, -30.0, 300.0, -709.0, 710.0, 800.0, 1e4, -1e300];

#[test]
fn jets_of_the_hyperbolic_tangent_are_those_of_its_closed_form_wherever_it_is_flat() {
    let space = JetSpace::uniform(1, 3).expect("a small space");
    for at in POINTS {
        assert_is_tangent(Jet::variable(&space, 0, at).tanh().coefficients(), at);
        let precise = Jet::variable(&space, 0, Dd::from(at)).tanh();
        let precise: Vec<f64> = precise.coefficients().iter().map(|value| value.to_f64()).collect();
        assert_is_tangent(&precise, at);
        let single = Jet::variable(&space, 0, at.clamp(-3e38, 3e38) as f32).tanh();
        assert!(single.coefficients().iter().all(|value| value.is_finite()), "{at}");
    }
    let lanes = Jet::variable(&space, 0, Lanes(POINTS)).tanh();
    for (lane, at) in POINTS.into_iter().enumerate() {
        let alone = Jet::variable(&space, 0, at).tanh();
        for (several, one) in lanes.coefficients().iter().zip(alone.coefficients()) {
            assert_eq!(several[lane].to_bits(), one.to_bits(), "{at}");
        }
    }
}

/// The value of an expression of one input by the graph, and the jet of it by a program.
fn by_graph_and_program(
    build: impl Fn(&mut ExpressionGraph, NodeId) -> NodeId,
    at: f64,
) -> (f64, Vec<f64>) {
    let mut graph = ExpressionGraph::new();
    let x = graph.input(0);
    let node = build(&mut graph, x);
    let mut values = Vec::new();
    graph.evaluate(&[at], &mut values);
    let parameters: [InputKind; 0] = [];
    let field = Field::new(&graph, &[node], &[], &parameters);
    let space = JetSpace::uniform(1, 3).expect("a small space");
    let jets = evaluate(field.program(), &space, &[Jet::variable(&space, 0, at)]);
    (values[node.index()], jets[0].coefficients().to_vec())
}

#[test]
fn programs_take_the_hyperbolic_tangent_of_any_number() {
    for at in POINTS {
        let (value, jet) = by_graph_and_program(|graph, x| graph.unary(Unary::Tanh, x), at);
        assert_is_tangent(&[value], at);
        assert_is_tangent(&jet, at);
    }
    let (value, _) = by_graph_and_program(|graph, x| graph.unary(Unary::Tanh, x), f64::NAN);
    assert!(value.is_nan(), "{value}");
}

#[test]
fn constants_at_the_ends_of_the_range_are_folded_to_their_values() {
    let mut graph = ExpressionGraph::new();
    let (largest, least) = (graph.number(1e308), graph.number(-1e308));
    let folded = |graph: &mut ExpressionGraph, function, argument| {
        let node = graph.unary(function, argument);
        graph.constant_value(node).map(Dd::to_f64)
    };
    assert_eq!(folded(&mut graph, Unary::Tanh, largest), Some(1.0));
    assert_eq!(folded(&mut graph, Unary::Tanh, least), Some(-1.0));
    assert_eq!(folded(&mut graph, Unary::Exp, least), Some(0.0));
    assert_eq!(folded(&mut graph, Unary::Exp, largest), None);
    assert_eq!(folded(&mut graph, Unary::Atan, largest), Some(std::f64::consts::FRAC_PI_2));
    assert_eq!(folded(&mut graph, Unary::Sqrt, largest), Some(1e154));
    assert_eq!(folded(&mut graph, Unary::Sign, least), Some(-1.0));
    assert_eq!(folded(&mut graph, Unary::Abs, least), Some(1e308));
    let angle = graph.binary(Binary::Atan2, least, largest);
    let angle = graph.constant_value(angle).map(Dd::to_f64);
    assert_eq!(angle, Some(-std::f64::consts::FRAC_PI_4));
    let power = graph.power_integer(largest, -1);
    assert_eq!(graph.constant_value(power).map(Dd::to_f64), Some(1e-308));
}

#[test]
fn hyperbolic_functions_are_numbers_up_to_where_they_overflow_in_both_formats() {
    for at in [700.5, 709.9, 710.4, -710.4] {
        let (sinh, cosh) = Dd::from(at).sinh_cosh();
        // The exponential of 710 is known to as many roundings.
        let error = |found: Dd, exact: f64| (found.to_f64() / exact - 1.0).abs();
        assert!(error(sinh, at.sinh()) < 1e-12 && error(cosh, at.cosh()) < 1e-12, "{at}: {sinh}");
    }
    assert!(!Dd::from(710.5).sinh_cosh().0.is_finite());
}

#[test]
fn arcs_keep_the_digits_of_their_slopes_next_to_one() {
    for below in [1e-3, 1e-7, 1e-12] {
        let at = 1.0 - below;
        // 1 - a is exact, so that the slope 1/√((1 - a)(1 + a)) is known to rounding.
        let slope = 1.0 / ((1.0 - at) * (1.0 + at)).sqrt();
        for (function, sign) in [(Unary::Asin, 1.0), (Unary::Acos, -1.0)] {
            let (_, jet) = by_graph_and_program(|graph, x| graph.unary(function, x), at);
            assert!((sign * jet[1] / slope - 1.0).abs() < 1e-14, "{below:e}: {}", jet[1]);
            let derivative = |graph: &mut ExpressionGraph, x| {
                let arc = graph.unary(function, x);
                graph.derivative(arc, 0)
            };
            let (value, _) = by_graph_and_program(derivative, at);
            assert!((sign * value / slope - 1.0).abs() < 1e-14, "{below:e}: {value}");
        }
    }
}

#[test]
fn jets_of_every_function_are_finite_where_its_derivatives_are() {
    let all = |functions: &[Unary], points: &[f64]| {
        for &function in functions {
            for &at in points {
                let (value, jet) = by_graph_and_program(|graph, x| graph.unary(function, x), at);
                assert!(value.is_finite(), "{function:?} at {at}");
                assert!(jet.iter().all(|c| c.is_finite()), "{function:?} at {at}: {jet:?}");
                assert!((jet[0] - value).abs() <= 1e-15 * value.abs(), "{function:?} at {at}");
            }
        }
    };
    let zero = [0.0, 1e-300, -1e-300];
    all(&[Unary::Sin, Unary::Cos, Unary::Tan, Unary::Tanh, Unary::Atan], &zero);
    all(&[Unary::Exp, Unary::Sinh, Unary::Cosh, Unary::Asin, Unary::Acos], &zero);
    all(&[Unary::Exp, Unary::Sinh, Unary::Cosh, Unary::Sin, Unary::Cos], &[700.0, -700.0]);
    all(&[Unary::Tanh, Unary::Atan, Unary::Abs, Unary::Sign], &[1e150, -1e150]);
    all(&[Unary::Sqrt, Unary::Log], &[1e-90, 1e150, 1e300]);
    all(&[Unary::Asin, Unary::Acos], &[1.0 - 1e-15, -1.0 + 1e-15]);
    all(&[Unary::Exp], &[-1e300]);
    let (_, jet) = by_graph_and_program(
        |graph, x| {
            let one = graph.number(1.0);
            let shifted = graph.add(x, one);
            graph.binary(Binary::Atan2, x, shifted)
        },
        1e150,
    );
    assert!(jet.iter().all(|c| c.is_finite()), "{jet:?}");
}
