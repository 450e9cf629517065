//! Values of a model's expressions at one state.

use crate::flow::Program;
use crate::numeric::{Branched, Scalar};

/// A program run at degree 0: the plain values of its outputs.
#[derive(Clone, Debug)]
pub(super) struct Evaluator<'a, S: Scalar> {
    program: &'a Program,
    outputs: usize,
    tape: Vec<S>,
    values: Vec<S>,
}

impl<'a, S: Scalar> Evaluator<'a, S> {
    /// `outputs`: number of outputs of the program.
    pub(super) fn new(program: &'a Program, outputs: usize) -> Self {
        Self {
            program,
            outputs,
            tape: vec![S::zero(); program.slots()],
            values: vec![S::zero(); outputs],
        }
    }

    /// Values of the first outputs, without what they do not need.
    pub(super) fn first<const M: usize>(&mut self, state: &[S], parameters: &[S]) -> [S; M] {
        let slots: [usize; M] = std::array::from_fn(|output| self.program.output(output));
        self.take(state, parameters);
        let slots_needed = slots.iter().map(|&slot| slot + 1).max().unwrap_or(0);
        self.program.evaluate_values_to(slots_needed, &mut self.tape);
        slots.map(|slot| self.tape[slot])
    }

    /// Values of the outputs.
    pub(super) fn evaluate(&mut self, state: &[S], parameters: &[S]) -> &[S] {
        self.take(state, parameters);
        self.program.evaluate_values(&mut self.tape);
        for output in 0..self.outputs {
            self.values[output] = self.tape[self.program.output(output)];
        }
        &self.values
    }

    fn take(&mut self, state: &[S], parameters: &[S]) {
        self.tape[..state.len()].copy_from_slice(state);
        self.tape[state.len()..state.len() + parameters.len()].copy_from_slice(parameters);
    }
}

/// Normal motion at a surface, along the free flow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense<S> {
    /// `h`.
    pub(super) gap: S,
    /// `h'`.
    pub(super) velocity: S,
    /// `h''`.
    pub(super) acceleration: S,
    /// `h'''`.
    pub(super) jerk: S,
    /// Rounding of `h`: a few units in the last place of its largest term.
    pub(super) rounding: S,
}

impl<S: Branched> Sense<S> {
    /// Where a state on a rigid surface is at rest there: it is pressed against the surface, and a
    /// bounce at its speed stays within the rounding of the gap.
    #[inline(always)]
    pub(super) fn rests(&self) -> S::Mask {
        let bounce = self.velocity * self.velocity;
        self.gap.abs().is_at_most(self.rounding)
            & bounce.is_at_most(-self.acceleration * self.rounding)
            & self.acceleration.is_below(S::zero())
    }
}

/// Reads the normal motion at a surface.
#[derive(Clone, Debug)]
pub(super) struct Sensor<'a, S: Scalar>(Evaluator<'a, S>);

impl<'a, S: Scalar> Sensor<'a, S> {
    pub(super) fn new(program: &'a Program, dimension: usize) -> Self {
        Self(Evaluator::new(program, 4 + dimension))
    }

    /// The gap and its velocity.
    pub(super) fn approach(&mut self, state: &[S], parameters: &[S]) -> [S; 2] {
        self.0.first(state, parameters)
    }

    pub(super) fn sense(&mut self, state: &[S], parameters: &[S]) -> Sense<S> {
        let values = self.0.evaluate(state, parameters);
        Sense {
            gap: values[0],
            velocity: values[1],
            acceleration: values[2],
            jerk: values[3],
            rounding: rounding_of(&values[4..]),
        }
    }
}

/// A gap and its rounding.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance<S> {
    pub(super) gap: S,
    pub(super) rounding: S,
}

/// Rounding of a sum: a few units in the last place of its largest term.
pub(super) fn rounding_of<S: Scalar>(terms: &[S]) -> S {
    let size = terms.iter().fold(S::zero(), |size, term| size.max(term.abs()));
    S::from_f64(16.0 * S::ROUNDOFF) * size
}
