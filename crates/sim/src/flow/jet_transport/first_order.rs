//! Values and gradients with respect to the state: jets of order 1, with which the nominal orbit is
//! found.

use std::ops::Range;

use super::gauss::NodeValues;
use crate::flow::Program;
use crate::flow::program::run;
use crate::jet::{Graded, HeadFunction, Span, scalar_head};
use crate::numeric::{Lanes, Scalar, Vectorised, one_by_one, widest};

/// Jets of order 1 in a number of variables: a value and its derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct FirstOrder {
    pub(super) variables: usize,
}

/// Slots of a program in jets of order 1. Slots that depend on the phase and the parameters only
/// are computed once for an orbit, the others after every correction.
pub(super) struct FirstOrderTape {
    algebra: FirstOrder,
    values: Vec<NodeValues>,
    scratch: Vec<NodeValues>,
    fixed: Vec<usize>,
    moving: Vec<usize>,
}

impl FirstOrderTape {
    /// A tape for a program whose first inputs are the variables.
    pub(super) fn new(program: &Program, variables: usize) -> Self {
        let algebra = FirstOrder { variables };
        let len = 1 + variables;
        let mut values = vec![Lanes::splat(0.0); program.slots() * len];
        for variable in 0..variables {
            values[variable * len + 1 + variable] = Lanes::splat(1.0);
        }
        let is_moving = moving_slots(program, variables);
        let (moving, fixed) =
            (program.inputs()..program.slots()).partition(|&slot| is_moving[slot]);
        Self { algebra, values, scratch: vec![Lanes::splat(0.0); len], fixed, moving }
    }

    /// Sets the values of the inputs that are not variables.
    pub(super) fn set_parameters(&mut self, parameters: impl Iterator<Item = f64>) {
        let (variables, len) = (self.algebra.variables, self.algebra.variables + 1);
        for (input, value) in (variables..).zip(parameters) {
            self.values[input * len] = Lanes::splat(value);
        }
    }

    /// Sets the values of the variables, and computes the slots that depend only on variables
    /// linear in time and on parameters.
    pub(super) fn fix(&mut self, program: &Program, variables: &[NodeValues]) {
        self.move_to(variables);
        let fixed = std::mem::take(&mut self.fixed);
        self.run::<0>(program, &fixed);
        self.run::<1>(program, &fixed);
        self.fixed = fixed;
    }

    /// Computes the values of all other slots from values of the variables.
    pub(super) fn evaluate(&mut self, program: &Program, variables: &[NodeValues]) {
        self.move_to(variables);
        let moving = std::mem::take(&mut self.moving);
        self.run::<0>(program, &moving);
        self.moving = moving;
    }

    /// Computes the derivatives of all other slots, whose values are known.
    pub(super) fn differentiate(&mut self, program: &Program) {
        let moving = std::mem::take(&mut self.moving);
        self.run::<1>(program, &moving);
        self.moving = moving;
    }

    fn move_to(&mut self, variables: &[NodeValues]) {
        let len = self.algebra.variables + 1;
        for (variable, &value) in variables.iter().enumerate() {
            self.values[variable * len] = value;
        }
    }

    /// Computes the parts of a degree of some slots.
    ///
    /// NOTE: never inlined: the recurrences are long, and the time of their compilation grows
    /// faster than their length.
    #[inline(never)]
    fn run<const DEGREE: usize>(&mut self, program: &Program, slots: &[usize]) {
        widest(SlotParts::<DEGREE> { tape: self, program, slots });
    }

    /// Value of a slot.
    #[inline(always)]
    pub(super) fn value(&self, slot: usize) -> NodeValues {
        self.values[slot * (self.algebra.variables + 1)]
    }

    /// Derivative of a slot with respect to a variable.
    #[inline(always)]
    pub(super) fn slope(&self, slot: usize, variable: usize) -> NodeValues {
        self.values[slot * (self.algebra.variables + 1) + 1 + variable]
    }
}

/// Vectorised work for the parts of a degree of some slots.
struct SlotParts<'t, const DEGREE: usize> {
    tape: &'t mut FirstOrderTape,
    program: &'t Program,
    slots: &'t [usize],
}

impl<const DEGREE: usize> Vectorised for SlotParts<'_, DEGREE> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let FirstOrderTape { algebra, values, scratch, .. } = self.tape;
        let (len, part) = (algebra.variables + 1, algebra.part(DEGREE));
        for &slot in self.slots {
            let out = &mut scratch[..part.len()];
            let operation = self.program.operation(slot);
            run(operation, slot, algebra, DEGREE, len, values, out);
            values[slot * len + part.start..slot * len + part.end].copy_from_slice(out);
        }
    }
}

/// For each slot: whether it depends on a state whose rate depends on a state, that is, on a state
/// that is not linear in time.
fn moving_slots(program: &Program, dimension: usize) -> Vec<bool> {
    let depending_on = |is_source: &dyn Fn(usize) -> bool| {
        let mut depends: Vec<_> = (0..program.inputs()).map(is_source).collect();
        for slot in program.inputs()..program.slots() {
            let depends_here = program.operands(slot).any(|operand| depends[operand]);
            depends.push(depends_here);
        }
        depends
    };
    let on_states = depending_on(&|input| input < dimension);
    depending_on(&|input| input < dimension && on_states[program.output(input)])
}

impl Graded<NodeValues> for FirstOrder {
    fn order(&self) -> usize {
        1
    }

    fn element_len(&self) -> usize {
        1 + self.variables
    }

    #[inline(always)]
    fn part(&self, degree: usize) -> Range<usize> {
        if degree == 0 { 0..1 } else { 1..1 + self.variables }
    }

    #[inline(always)]
    fn convolve(
        &self,
        degree: usize,
        span: Span,
        a: &[NodeValues],
        b: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        let range = span.range(degree + 1);
        for j in range {
            let (left, right) = (&a[self.part(j)], &b[self.part(degree - j)]);
            let (head, part) = if j == 0 { (left[0], right) } else { (right[0], left) };
            for (index, (value, &factor)) in out.iter_mut().zip(part).enumerate() {
                one_by_one::<NodeValues>(index);
                *value = head.mul_add(factor, *value);
            }
        }
    }

    #[inline(always)]
    fn multiply_by_head(
        &self,
        _: usize,
        a: &[NodeValues],
        part: &[NodeValues],
        out: &mut [NodeValues],
    ) {
        for (value, &factor) in out.iter_mut().zip(part) {
            *value = a[0].mul_add(factor, *value);
        }
    }

    #[inline(always)]
    fn divide_by_head(&self, b: &[NodeValues], part: &mut [NodeValues]) {
        let inverse = Lanes::splat(1.0) / b[0];
        for (index, value) in part.iter_mut().enumerate() {
            one_by_one::<NodeValues>(index);
            *value *= inverse;
        }
    }

    #[inline(always)]
    fn head(&self, function: HeadFunction, a: &[NodeValues], out: &mut [NodeValues]) {
        // NOTE: sine and cosine are computed here, in the widest registers; a function that is not
        // inlined is compiled for the baseline instruction set.
        out[0] = match function {
            HeadFunction::Sin => a[0].sin_cos().0,
            HeadFunction::Cos => a[0].sin_cos().1,
            _ => scalar_head(function, a[0]),
        };
    }

    fn head_power(&self, a: &[NodeValues], exponent: NodeValues, out: &mut [NodeValues]) {
        out[0] = a[0].powf(exponent);
    }

    fn head_atan2(&self, y: &[NodeValues], x: &[NodeValues], out: &mut [NodeValues]) {
        out[0] = y[0].atan2(x[0]);
    }
}
