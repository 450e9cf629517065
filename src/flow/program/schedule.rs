//! A program run for series in time with numbers as coefficients: what must go degree by degree, and what need not.
//!
//! One idea: of the slots only those that feed the derivatives *and* depend on the states are bound to the
//! order of the integration, degree after degree. Functions of the phase and the parameters can be
//! completed before it, watched functions after it, slot by slot.

use super::operation::{Operation, Slot, run};
use super::{InputKind, Program};
use crate::jet::{HeadFunction, Span, TimeSeries};
use crate::numeric::Scalar;

/// The slots of a program in the order in which a series in time is computed.
#[derive(Clone, Debug)]
pub(crate) struct TimeSchedule {
    /// Highest degree of a part of each slot, 2 standing for all higher ones.
    reaches: Vec<usize>,
    /// Functions of the phase and the parameters, in units that are completed one after another.
    before: Vec<Vec<Slot>>,
    /// What the derivatives need of the states, by degree 0, 1, and 2 or more.
    during: [Vec<Slot>; 3],
    /// All else.
    after: Vec<Vec<Slot>>,
}

impl Program {
    /// The schedule of a field's program whose first outputs are the derivatives of the states.
    pub(crate) fn schedule(&self, inputs: &[InputKind], derivatives: usize) -> TimeSchedule {
        let slots = self.operations.len();
        let mut of_state = vec![false; slots];
        let mut feeds = vec![false; slots];
        for (slot, kind) in inputs.iter().enumerate() {
            of_state[slot] = *kind == InputKind::Variable;
        }
        for slot in inputs.len()..slots {
            of_state[slot] = self.operands(slot).any(|operand| of_state[operand]);
        }
        for &output in &self.outputs[..derivatives] {
            feeds[output] = true;
        }
        for unit in self.units().into_iter().rev() {
            if unit.iter().any(|&slot| feeds[slot]) {
                for slot in unit {
                    feeds[slot] = true;
                    self.operations[slot]
                        .reads()
                        .for_each(|read| feeds[read] = true);
                }
            }
        }
        let is_during = |slot: Slot| of_state[slot] && feeds[slot];
        let during = self.reaching.clone().map(|mut reaching| {
            reaching.retain(|&slot| is_during(slot));
            reaching
        });
        let (mut before, mut after) = (Vec::new(), Vec::new());
        for unit in self.units() {
            if !of_state[unit[0]] {
                before.push(unit);
            } else if !is_during(unit[0]) {
                after.push(unit);
            }
        }
        let mut reaches = vec![0; slots];
        for (degree, reaching) in self.reaching.iter().enumerate() {
            reaching.iter().for_each(|&slot| reaches[slot] = degree);
        }
        TimeSchedule {
            reaches,
            before,
            during,
            after,
        }
    }

    /// The slots beyond the inputs, those that need each other together.
    fn units(&self) -> Vec<Vec<Slot>> {
        let mut units: Vec<Vec<Slot>> = Vec::new();
        let mut open = 0;
        for slot in self.inputs..self.operations.len() {
            if slot < open
                && let Some(unit) = units.last_mut()
            {
                unit.push(slot);
            } else {
                units.push(vec![slot]);
            }
            let last = self.operations[slot].reads().max().unwrap_or(0);
            open = open.max(last + 1);
        }
        units
    }

    /// Taylor coefficients of every slot, the heads of the inputs being in place, as many as `inverses` holds
    /// numbers `1/k` (of which the first is not used).
    ///
    /// `tape` holds that many coefficients per slot. Parameters must be zero beyond their heads.
    pub(crate) fn expand<S: Scalar>(
        &self,
        schedule: &TimeSchedule,
        derivatives: usize,
        inverses: &[S],
        tape: &mut [S],
    ) {
        let order = inverses.len() - 1;
        let mut series = Series {
            program: self,
            reaches: &schedule.reaches,
            tape,
            inverses,
            algebra: TimeSeries { order },
            len: order + 1,
        };
        // NOTE: a phase is linear in time; its rate is known from the heads of the parameters.
        for unit in &schedule.before {
            series.coefficients(unit, 0..1);
        }
        for component in 0..derivatives {
            series.next_coefficient(component, 0);
        }
        for unit in &schedule.before {
            series.coefficients(unit, 1..order + 1);
        }
        for degree in 0..=order {
            for &slot in &schedule.during[degree.min(2)] {
                series.coefficient(slot, degree);
            }
            if degree < order {
                for component in 0..derivatives {
                    series.next_coefficient(component, degree);
                }
            }
        }
        for unit in &schedule.after {
            series.coefficients(unit, 0..order + 1);
        }
    }
}

/// The series of all slots.
struct Series<'t, S> {
    program: &'t Program,
    reaches: &'t [usize],
    tape: &'t mut [S],
    /// `1/k`.
    inverses: &'t [S],
    algebra: TimeSeries,
    len: usize,
}

impl<S: Scalar> Series<'_, S> {
    fn coefficients(&mut self, unit: &[Slot], degrees: std::ops::Range<usize>) {
        let highest = unit.iter().map(|&slot| self.reaches[slot]).max();
        let end = match highest {
            Some(highest) if highest < 2 => degrees.end.min(highest + 1),
            _ => degrees.end,
        };
        for degree in degrees.start..end {
            for &slot in unit {
                self.coefficient(slot, degree);
            }
        }
    }

    /// `x_{k+1} = f_k / (k + 1)`.
    fn next_coefficient(&mut self, component: usize, degree: usize) {
        let source = self.program.outputs[component] * self.len + degree;
        self.tape[component * self.len + degree + 1] =
            self.tape[source] * self.inverses[degree + 1];
    }

    fn at(&self, slot: Slot, degree: usize) -> S {
        self.tape[slot * self.len + degree]
    }

    fn element(&self, slot: Slot) -> &[S] {
        &self.tape[slot * self.len..(slot + 1) * self.len]
    }

    #[inline]
    fn coefficient(&mut self, slot: Slot, k: usize) {
        let value = match self.program.operations[slot] {
            Operation::Add(a, b) => self.at(a, k) + self.at(b, k),
            Operation::Sub(a, b) => self.at(a, k) - self.at(b, k),
            Operation::Neg(a) => -self.at(a, k),
            Operation::Scale(a, factor) => self.at(a, k) * S::from_dd(factor),
            Operation::AddConstant(a, _) if k > 0 => self.at(a, k),
            Operation::MulByHead { head, factor } => self.at(head, 0) * self.at(factor, k),
            Operation::Mul(a, b) if a == b => square(self.element(a), k),
            Operation::Mul(a, b) => convolution(self.element(a), self.element(b), Span::Full, k),
            Operation::Div(a, b) => {
                let sum = convolution(self.element(b), self.element(slot), Span::WithoutFirst, k);
                (self.at(a, k) - sum) / self.at(b, 0)
            }
            // u' = ±a' c for the sine or cosine u of a slot that is linear in time, c being the other
            Operation::OfPhase {
                function,
                a,
                partner,
            } if k > 0 => {
                let slope = self.at(a, 1) * self.at(partner, k - 1) * self.inverses[k];
                match function {
                    HeadFunction::Cos => -slope,
                    _ => slope,
                }
            }
            _ => self.other(slot, k),
        };
        self.tape[slot * self.len + k] = value;
    }

    /// NOTE: not inlined, so that the common operations above stay a few instructions each.
    #[inline(never)]
    fn other(&self, slot: Slot, k: usize) -> S {
        let (operation, mut out) = (&self.program.operations[slot], [S::zero()]);
        run(
            operation,
            slot,
            &self.algebra,
            k,
            self.len,
            self.tape,
            &mut out,
        );
        out[0]
    }
}

/// `Σ_j a_j b_{k−j}` over a span.
#[inline]
fn convolution<S: Scalar>(a: &[S], b: &[S], span: Span, k: usize) -> S {
    let terms = span.range(k + 1);
    let (from, to) = (k + 1 - terms.end, k + 1 - terms.start);
    dot_reversed(&a[terms], &b[from..to])
}

/// `Σ_j a_j a_{k−j}`, each pair once.
#[inline]
fn square<S: Scalar>(a: &[S], k: usize) -> S {
    let half = k.div_ceil(2);
    let sum = dot_reversed(&a[..half], &a[k + 1 - half..=k]);
    let twice = sum + sum;
    if k.is_multiple_of(2) {
        a[k / 2].mul_add(a[k / 2], twice)
    } else {
        twice
    }
}

/// `Σ_j a_j b_{n−1−j}` of two slices of a length `n`, in two sums.
#[inline(always)]
fn dot_reversed<S: Scalar>(a: &[S], b: &[S]) -> S {
    let (pairs, rest) = a.as_chunks::<2>();
    let (last, reversed) = b.as_rchunks::<2>();
    let (mut even, mut odd) = (S::zero(), S::zero());
    for (&[a0, a1], &[b1, b0]) in pairs.iter().zip(reversed.iter().rev()) {
        even = a0.mul_add(b0, even);
        odd = a1.mul_add(b1, odd);
    }
    if let ([a], [b]) = (rest, last) {
        even = a.mul_add(*b, even);
    }
    even + odd
}
