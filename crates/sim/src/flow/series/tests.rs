//! Instructions against the program they come from, run in the algebra of series by the recurrences
//! of any ring.

use super::*;
use crate::flow::time_expansion::expand;
use crate::flow::{Field, InputKind, samples};
use crate::model::{ExpressionGraph, Unary};
use crate::numeric::{Dd, Real};

/// `x' = y, y' = −x y² + y sin(x)/(2 + x) + cos²θ − sin θ cos θ + p x + e^{−y} + |x|, θ' = 2p`,
/// watching `x y + θ + p` and `sin² θ`: products, sums of many terms, functions of states, and of
/// the phase alone.
fn everything() -> Field {
    let mut g = ExpressionGraph::new();
    let [x, y, theta, p] = std::array::from_fn(|input| g.input(input));
    let square = g.power_integer(y, 2);
    let drag = g.mul(x, square);
    let (sine, two) = (g.unary(Unary::Sin, x), g.number(2.0));
    let (top, bottom) = (g.mul(y, sine), g.add(two, x));
    let quotient = g.div(top, bottom);
    let (s, c) = (g.unary(Unary::Sin, theta), g.unary(Unary::Cos, theta));
    let (cc, sc, ss) = (g.power_integer(c, 2), g.mul(s, c), g.power_integer(s, 2));
    let (spring, minus) = (g.mul(p, x), g.neg(y));
    let (decay, size) = (g.unary(Unary::Exp, minus), g.unary(Unary::Abs, x));
    let mut rate = g.neg(drag);
    for term in [quotient, cc, spring, decay, size] {
        rate = g.add(rate, term);
    }
    let rate = g.sub(rate, sc);
    let turn = g.mul(two, p);
    let (xy, shifted) = (g.mul(x, y), g.add(theta, p));
    let watched = g.add(xy, shifted);
    Field::new(&g, &[y, rate, turn], &[watched, ss], &[InputKind::HeadOnly])
}

/// The largest difference of the states' and watched functions' coefficients, relative to the
/// largest of this degree or above.
fn largest_difference<S: Real>(field: &Field, state: &[f64], parameters: &[f64]) -> f64 {
    let values = |values: &[f64]| -> Vec<S> { values.iter().map(|&v| S::from_f64(v)).collect() };
    let (state, parameters) = (values(state), values(parameters));
    let mut series = Series::new(field.series(), 30);
    // Twice, so that what a first expansion leaves behind is seen.
    series.expand(&another_state(&state), &parameters);
    series.expand(&state, &parameters);
    let (order, program) = (series.order(), field.time_program());
    let mut tape = vec![S::zero(); program.slots() * (order + 1)];
    for (input, &value) in state.iter().chain(&parameters).enumerate() {
        tape[input * (order + 1)] = value;
    }
    expand(field, &TimeSeries { order }, &mut tape, &mut [S::zero()]);
    let watched = (0..field.watched()).map(|w| program.output(field.dimension() + w));
    let slots: Vec<_> = (0..field.dimension()).chain(watched).collect();
    let (mut size, mut largest) = (1e-300, 0.0_f64);
    for degree in (0..=order).rev() {
        for &slot in &slots {
            size = tape[slot * (order + 1) + degree].magnitude().max(size);
        }
        for &slot in &slots {
            let (found, expected) =
                (series.coefficients(slot)[degree], tape[slot * (order + 1) + degree]);
            largest = largest.max((found - expected).magnitude() / size);
        }
    }
    largest
}

fn another_state<S: Real>(state: &[S]) -> Vec<S> {
    state.iter().map(|&value| value * S::from_f64(0.5)).collect()
}

#[test]
fn instructions_give_the_series_of_the_program() {
    let kinds = [InputKind::HeadOnly; 3];
    let cases: [(Field, &[f64], &[f64]); 6] = [
        (everything(), &[0.4, -0.3, 0.8], &[0.7]),
        (samples::electrostatic(&kinds), &[0.3, 0.1, 0.4], &[0.02, 0.3, 0.6]),
        (samples::linear(&kinds), &[0.3, 0.1, 0.4], &[0.05, 1.1, 1.8]),
        (samples::kepler(), &[0.5, 0.1, 0.2, 1.5], &[]),
        (samples::pendulum(), &[0.7, 0.4], &[]),
        (samples::quadratic(), &[0.7], &[]),
    ];
    for (index, (field, state, parameters)) in cases.iter().enumerate() {
        // Roundings of some 30 coefficients of 30 terms each, which later ones inherit.
        let double = largest_difference::<f64>(field, state, parameters);
        assert!(double < 1e-12, "{index}: {double:e}");
        let exact = largest_difference::<Dd>(field, state, parameters);
        assert!(exact < 1e-27, "{index}: {exact:e}");
    }
}

#[test]
fn squares_of_the_phase_need_no_products() {
    let field = samples::electrostatic(&[InputKind::HeadOnly; 3]);
    let products = field.series().groups.iter().flatten().filter(|instruction| {
        matches!(
            instruction,
            Instruction::Square { .. } | Instruction::Product { .. } | Instruction::Quotient { .. }
        )
    });
    // The quotient `V sin θ/(1 − x)` and its square; the phase is in neither convolution twice.
    assert_eq!(products.count(), 2);
    let phase_alone = everything();
    let before = &phase_alone.series().groups[..2];
    assert!(before.iter().flatten().all(|instruction| matches!(
        instruction,
        Instruction::Phase { .. } | Instruction::Linear { .. }
    )));
}
