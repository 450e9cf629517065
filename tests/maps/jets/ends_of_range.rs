//! Elementary functions at the ends of their ranges: representable values are finite, with the
//! derivatives of the closed form.

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

/// A function's text, a place, and its Taylor coefficients there: the value, the first derivative
/// and half of the second.
type Row = (&'static str, f64, [f64; 3]);

/// Computed with 420 digits from the closed forms of the derivatives (the sum `1 + exp(x)` as it
/// stands), rounded to the nearest double; numbers below the least are 0.
#[expect(clippy::approx_constant, reason = "values of an independent table")]
const ROWS: [Row; 85] = [
    ("sqrt", 1e-90, [1e-45, 5e+44, -1.25e+134]),
    ("sqrt", 1e+300, [1e+150, 5e-151, 0.0]),
    ("sqrt", 1.7e+308, [1.3038404810405297e+154, 3.8348249442368524e-155, 0.0]),
    ("exp", -745.0, [5e-324, 5e-324, 0.0]),
    ("exp", -708.0, [3.307553003638408e-308, 3.307553003638408e-308, 1.653776501819204e-308]),
    ("exp", -700.0, [9.85967654375977e-305, 9.85967654375977e-305, 4.929838271879885e-305]),
    ("exp", 1e-300, [1.0, 1.0, 0.5]),
    ("exp", 700.0, [1.0142320547350045e+304, 1.0142320547350045e+304, 5.0711602736750225e+303]),
    ("exp", 709.7, [1.6549840276802644e+308, 1.6549840276802644e+308, 8.274920138401322e+307]),
    ("log", 1e-90, [-207.2326583694641, 1e+90, -5e+179]),
    ("log", 0.9999999999999999, [-1.1102230246251565e-16, 1.0000000000000002, -0.5000000000000001]),
    ("log", 1.0000000000000002, [2.2204460492503128e-16, 0.9999999999999998, -0.4999999999999998]),
    ("log", 1e+300, [690.7755278982137, 1e-300, 0.0]),
    ("log", 1.7e+308, [709.7268368932282, 5.88235294117647e-309, 0.0]),
    ("sin", 1e-320, [1e-320, 1.0, -5e-321]),
    ("sin", 1e-300, [1e-300, 1.0, -5e-301]),
    ("sin", 100000.5, [-0.4477465716572126, -0.8941605043666447, 0.2238732858286063]),
    ("sin", 100000000.0, [0.931639027109726, -0.3633850893556905, -0.465819513554863]),
    ("cos", 1e-320, [1.0, -1e-320, -0.5]),
    ("cos", 1e-300, [1.0, -1e-300, -0.5]),
    ("cos", 100000.5, [-0.8941605043666447, 0.4477465716572126, 0.44708025218332237]),
    ("cos", 100000000.0, [-0.3633850893556905, -0.931639027109726, 0.18169254467784526]),
    ("tan", 1e-320, [1e-320, 1.0, 1e-320]),
    ("tan", 1e-300, [1e-300, 1.0, 1e-300]),
    ("tan", 1.5707963, [37320539.634354815, 1392822678599449.8, 5.1980893980299e+22]),
    ("tan", 100000.5, [0.5007451900085457, 1.2507457453166946, 0.6263049158909884]),
    ("asin", 1e-320, [1e-320, 1.0, 5e-321]),
    ("asin", -0.9999999999999999, [-1.5707963118937354, 67108864.0, -1.5111572745182865e+23]),
    ("asin", 0.999, [1.526071239626163, 22.36627204212921, 5588.770827935734]),
    ("acos", 1e-320, [1.5707963267948966, -1.0, -5e-321]),
    ("acos", -0.9999999999999999, [3.141592638688632, -67108864.0, 1.5111572745182865e+23]),
    ("acos", 0.999, [0.044725087168733454, -22.36627204212921, -5588.770827935734]),
    ("atan", 1e-320, [1e-320, 1.0, -1e-320]),
    ("atan", 1e+70, [1.5707963267948966, 9.999999999999999e-141, -9.999999999999997e-211]),
    ("atan", -1e+100, [-1.5707963267948966, 1e-200, 1e-300]),
    ("atan", 1e+154, [1.5707963267948966, 1e-308, 0.0]),
    ("atan", 1e+155, [1.5707963267948966, 1e-310, 0.0]),
    ("atan", -1e+200, [-1.5707963267948966, 0.0, 0.0]),
    ("atan", 1e+308, [1.5707963267948966, 0.0, 0.0]),
    ("sinh", 1e-320, [1e-320, 1.0, 5e-321]),
    ("sinh", -700.0, [-5.0711602736750225e+303, 5.0711602736750225e+303, -2.5355801368375112e+303]),
    ("sinh", 709.9, [1.010701028059782e+308, 1.010701028059782e+308, 5.05350514029891e+307]),
    ("sinh", 710.4, [1.6663642832806496e+308, 1.6663642832806496e+308, 8.331821416403248e+307]),
    ("cosh", 1e-320, [1.0, 1e-320, 0.5]),
    ("cosh", -700.0, [5.0711602736750225e+303, -5.0711602736750225e+303, 2.5355801368375112e+303]),
    ("cosh", 709.9, [1.010701028059782e+308, 1.010701028059782e+308, 5.05350514029891e+307]),
    ("cosh", 710.4, [1.6663642832806496e+308, 1.6663642832806496e+308, 8.331821416403248e+307]),
    ("tanh", 1e-320, [1e-320, 1.0, -1e-320]),
    ("tanh", -19.0, [-0.9999999999999999, 1.2556531168192118e-16, 1.2556531168192116e-16]),
    ("tanh", 350.0, [1.0, 3.943870617503908e-304, -3.943870617503908e-304]),
    ("tanh", -10000.0, [-1.0, 0.0, 0.0]),
    ("tanh", 1e+308, [1.0, 0.0, 0.0]),
    ("1/cosh", 1e-320, [1.0, -1e-320, -0.5]),
    ("1/cosh", -19.0, [1.1205592875074534e-08, 1.1205592875074534e-08, 5.602796437537266e-09]),
    ("1/cosh", 350.0, [1.985918079252996e-152, -1.985918079252996e-152, 9.92959039626498e-153]),
    ("1/cosh", -700.0, [1.971935308751954e-304, 1.971935308751954e-304, 9.85967654375977e-305]),
    ("1/cosh", -10000.0, [0.0, 0.0, 0.0]),
    ("1/cosh", 1e+308, [0.0, 0.0, 0.0]),
    ("1/(1 + exp(-x))", 1e-320, [0.5, 0.25, -6.23e-322]),
    (
        "1/(1 + exp(-x))",
        -36.0,
        [2.3195228302435686e-16, 2.319522830243568e-16, 1.1597614151217836e-16],
    ),
    (
        "1/(1 + exp(-x))",
        -700.0,
        [9.85967654375977e-305, 9.85967654375977e-305, 4.929838271879885e-305],
    ),
    ("1/(1 + exp(-x))", -800.0, [0.0, 0.0, 0.0]),
    ("1/(1 + exp(-x))", 40.0, [1.0, 4.248354255291589e-18, -2.1241771276457944e-18]),
    ("1/(1 + exp(-x))", 10000.0, [1.0, 0.0, 0.0]),
    ("1/(1 + exp(-x))", -1e+308, [0.0, 0.0, 0.0]),
    ("1/(1 + exp(-x))", 1e+308, [1.0, 0.0, 0.0]),
    ("1/(1 + exp(x))", 1e-320, [0.5, -0.25, 6.23e-322]),
    (
        "1/(1 + exp(x))",
        -36.0,
        [0.9999999999999998, -2.319522830243568e-16, -1.1597614151217836e-16],
    ),
    (
        "1/(1 + exp(x))",
        700.0,
        [9.85967654375977e-305, -9.85967654375977e-305, 4.929838271879885e-305],
    ),
    ("1/(1 + exp(x))", 800.0, [0.0, 0.0, 0.0]),
    ("1/(1 + exp(x))", -10000.0, [1.0, 0.0, 0.0]),
    ("1/(1 + exp(x))", 1e+308, [0.0, 0.0, 0.0]),
    ("log(1 + exp(x))", 1e-320, [0.6931471805599453, 0.5, 0.125]),
    (
        "log(1 + exp(x))",
        -36.0,
        [2.319522830243569e-16, 2.3195228302435686e-16, 1.159761415121784e-16],
    ),
    (
        "log(1 + exp(x))",
        -700.0,
        [9.85967654375977e-305, 9.85967654375977e-305, 4.929838271879885e-305],
    ),
    ("log(1 + exp(x))", -10000.0, [0.0, 0.0, 0.0]),
    ("log(1 + exp(x))", 40.0, [40.0, 1.0, 2.1241771276457944e-18]),
    ("log(1 + exp(x))", 800.0, [800.0, 1.0, 0.0]),
    ("log(1 + exp(x))", 1e+307, [1e+307, 1.0, 0.0]),
    ("log(cosh(x))", 2.0, [1.3250027473578645, 0.9640275800758169, 0.035325412426582235]),
    ("log(cosh(x))", -19.0, [18.306852819440056, -0.9999999999999999, 6.278265584096059e-17]),
    ("log(cosh(x))", 350.0, [349.30685281944005, 1.0, 1.971935308751954e-304]),
    ("log(cosh(x))", 800.0, [799.3068528194401, 1.0, 0.0]),
    ("log(cosh(x))", -10000.0, [9999.30685281944, -1.0, 0.0]),
    ("log(cosh(x))", 1e+307, [1e+307, 1.0, 0.0]),
];

fn expression(text: &str, graph: &mut ExpressionGraph, x: NodeId) -> NodeId {
    let one = graph.number(1.0);
    let opposite = graph.neg(x);
    match text {
        "1/cosh" => {
            let cosh = graph.unary(Unary::Cosh, x);
            graph.div(one, cosh)
        }
        "1/(1 + exp(-x))" | "1/(1 + exp(x))" | "log(1 + exp(x))" => {
            let exponent = if text.contains('-') { opposite } else { x };
            let exponential = graph.unary(Unary::Exp, exponent);
            let sum = graph.add(one, exponential);
            match text.starts_with("log") {
                true => graph.unary(Unary::Log, sum),
                false => graph.div(one, sum),
            }
        }
        "log(cosh(x))" => {
            let cosh = graph.unary(Unary::Cosh, x);
            graph.unary(Unary::Log, cosh)
        }
        _ => {
            let functions = [
                ("sqrt", Unary::Sqrt),
                ("exp", Unary::Exp),
                ("log", Unary::Log),
                ("sin", Unary::Sin),
                ("cos", Unary::Cos),
                ("tan", Unary::Tan),
                ("asin", Unary::Asin),
                ("acos", Unary::Acos),
                ("atan", Unary::Atan),
                ("sinh", Unary::Sinh),
                ("cosh", Unary::Cosh),
                ("tanh", Unary::Tanh),
            ];
            let named = functions.iter().find(|(name, _)| *name == text);
            graph.unary(named.expect("a function").1, x)
        }
    }
}

/// The jets of an expression of one input at a place by its program, in numbers of any kind.
fn jet_by_program<S: Scalar>(graph: &ExpressionGraph, node: NodeId, at: S) -> Vec<S> {
    let parameters: [InputKind; 0] = [];
    let field = Field::new(graph, &[node], &[], &parameters);
    let space = JetSpace::uniform(1, 2).expect("a small space");
    let jets = evaluate(field.program(), &space, &[Jet::variable(&space, 0, at)]);
    jets[0].coefficients().to_vec()
}

#[test]
fn every_function_has_its_value_and_slopes_at_the_ends_of_its_range_in_every_format() {
    let mut wrong = Vec::new();
    for (text, at, expected) in ROWS {
        let mut graph = ExpressionGraph::new();
        let x = graph.input(0);
        let node = expression(text, &mut graph, x);
        let slope = graph.derivative(node, 0);
        let mut values = Vec::new();
        graph.evaluate(&[at], &mut values);
        let single = jet_by_program(&graph, node, at);
        let double = jet_by_program(&graph, node, Dd::from(at));
        let double: Vec<f64> = double.iter().map(|value| value.to_f64()).collect();
        let lanes = jet_by_program(&graph, node, Lanes([0.5, at]));
        let lanes: Vec<f64> = lanes.iter().map(|value| value[1]).collect();
        let graphs = [values[node.index()], values[slope.index()]];
        for (format, found) in [
            ("graph", &graphs[..]),
            ("f64", &single),
            ("double-double", &double),
            ("lanes", &lanes),
        ] {
            for (degree, (&found, exact)) in found.iter().zip(expected).enumerate() {
                // An exponential is known to as many roundings as its argument is large; 1 − tanh²
                // of the graph to the rounding of 1; what is no normal number counts as 0.
                let rounding = f64::EPSILON * (8.0 + 2.0 * at.abs().min(750.0));
                let cancels = if format == "graph" && degree == 1 { f64::EPSILON } else { 0.0 };
                let most = rounding * exact.abs() + cancels + 1e-300;
                let error = (found - exact).abs();
                if error > most || error.is_nan() {
                    wrong
                        .push(format!("{text} at {at:e}, {degree}, {format}: {found:e} {exact:e}"));
                }
            }
        }
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&lanes), bits(&single), "{text} at {at}");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
