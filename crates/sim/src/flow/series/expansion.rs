//! Runs the instructions, degree by degree; products of series, four degrees at a time.
//!
//! One idea: a series in `t` is a series in `t⁴` whose coefficients are polynomials of four terms,
//! its *blocks*. With `a_q b_r = low + t⁴ high`, block `m` of a product is
//!
//! ```text
//! (ab)_m = Σ_{q+r=m} low(a_q, b_r) + Σ_{q+r=m−1} high(a_q, b_r).
//! ```
//!
//! When all blocks before `m` are known, only `low(a_0, b_m) + low(a_m, b_0)` is left to be added
//! degree by degree. The rest is computed at once for four degrees, in loops of fixed length
//! (relaxed multiplication: van der Hoeven 2002). Sums have one order for all registers: in 16
//! chains over the blocks, then over the chains.

use super::{
    Blocks, Instruction, MOST_BLOCKS, Operand, ScaledOperand, SeriesProgram, Sign, Sum, Terms,
};
use crate::flow::program::Slot;
use crate::numeric::{Scalar, Vectorised};

/// Series of a step, during their computation.
pub(super) struct Expansion<'s, S> {
    pub(super) program: &'s SeriesProgram,
    pub(super) blocks: usize,
    /// Series of the slots. In a product, the block that is not computed yet holds the contribution
    /// of earlier blocks.
    pub(super) tape: &'s mut [Blocks<S>],
    pub(super) factors: &'s [S],
    pub(super) inverses: &'s Blocks<S>,
}

impl<S: Scalar> Vectorised for Expansion<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        for group in &self.program.groups {
            self.complete(group);
        }
    }
}

impl<S: Scalar> Expansion<'_, S> {
    /// Computes the series of slots whose operands are complete.
    #[inline(always)]
    fn complete(&mut self, group: &[Instruction]) {
        match *group {
            [Instruction::Linear { out, ref sum }] => self.linear_series(out, sum),
            [Instruction::Phase { a, table, sine, cosine }] => {
                self.phase_series(a, table, (sine, cosine))
            }
            _ => self.in_step(group),
        }
    }

    /// Runs instructions through all degrees, one degree after another.
    #[inline(always)]
    fn in_step(&mut self, instructions: &[Instruction]) {
        let mut last = match instructions.last().and_then(Instruction::out) {
            Some(out) => self.series(out)[0][0],
            None => return,
        };
        for block in 0..self.blocks.min(MOST_BLOCKS) {
            if block > 0 {
                self.add_earlier(instructions, block);
            }
            last = self.degree::<0>(instructions, block, last);
            last = self.degree::<1>(instructions, block, last);
            last = self.degree::<2>(instructions, block, last);
            last = self.degree::<3>(instructions, block, last);
        }
    }

    /// Sums the products of coefficients of earlier blocks, for the four degrees of a block.
    #[inline(always)]
    fn add_earlier(&mut self, instructions: &[Instruction], block: usize) {
        for instruction in instructions {
            let (out, sum) = match *instruction {
                Instruction::Square { out, a } => {
                    (out, earlier_square(&self.series(a.slot)[..block]))
                }
                Instruction::Product { out, a, b: Operand { slot: b, .. } }
                | Instruction::Function { out, euler_a: a, partner: b, .. } => {
                    (out, earlier_product(&self.series(a.slot)[..block], &self.series(b)[..block]))
                }
                Instruction::Quotient { out, denominator, .. } => (
                    out,
                    earlier_product(
                        &self.series(denominator.slot)[..block],
                        &self.series(out)[..block],
                    ),
                ),
                _ => continue,
            };
            self.tape[out][block] = sum;
        }
    }

    /// Runs instructions at the degree `4 block + I`; `last` is the result of the instruction
    /// before.
    #[inline(always)]
    fn degree<const I: usize>(
        &mut self,
        instructions: &[Instruction],
        block: usize,
        mut last: S,
    ) -> S {
        for instruction in instructions {
            last = match *instruction {
                Instruction::Linear { out, ref sum } => {
                    let value = self.sum::<I>(sum, block, last);
                    self.put::<I>(out, block, value)
                }
                Instruction::Integral { out, ref sum } => {
                    let value = self.sum::<I>(sum, block, last) * self.inverses[block][I];
                    self.put_next::<I>(out, block, value)
                }
                Instruction::Square { out, a } => {
                    let value = self.square::<I>(out, a, block, last);
                    self.put::<I>(out, block, value)
                }
                Instruction::Product { out, a, b } => {
                    let value = self.product::<I>(out, (a, b), block, last);
                    self.put::<I>(out, block, value)
                }
                Instruction::Quotient { out, numerator, denominator, reciprocal } => {
                    let rest = self.dividend::<I>(out, (numerator, denominator), block, last);
                    if I == 0 && block == 0 {
                        let head = self.newest::<I>(denominator, block, last);
                        self.put::<I>(reciprocal, block, S::one() / head);
                    }
                    let value = rest * self.tape[reciprocal][0][0];
                    self.put::<I>(out, block, value)
                }
                Instruction::Phase { .. } => last,
                Instruction::Euler { out, a } => {
                    let degree = S::from_f64((BLOCK * block + I) as f64);
                    let value = self.newest::<I>(a, block, last) * degree;
                    self.put::<I>(out, block, value)
                }
                Instruction::Function { out, ref operation, .. } if I == 0 && block == 0 => {
                    let value = super::any_coefficient(self.tape, out, operation, 0);
                    self.put::<I>(out, block, value)
                }
                Instruction::Function { out, sign, euler_a, partner, .. } => {
                    let sum = self.function::<I>(out, (euler_a, partner), block, last);
                    let value = sum * self.inverses.as_flattened()[BLOCK * block + I - 1];
                    let value = match sign {
                        Sign::Plus => value,
                        Sign::Minus => -value,
                    };
                    self.put::<I>(out, block, value)
                }
                Instruction::Other { out, ref operation } => {
                    let k = BLOCK * block + I;
                    let value = super::any_coefficient(self.tape, out, operation, k);
                    self.put::<I>(out, block, value)
                }
            };
        }
        last
    }

    #[inline(always)]
    fn sum<const I: usize>(&self, sum: &Sum, block: usize, last: S) -> S {
        let value = match &sum.terms {
            Terms::One(a) => self.newest::<I>(a.operand, block, last) * self.factors[a.factor],
            Terms::Two([a, b]) => {
                let newest = self.newest::<I>(b.operand, block, last);
                newest.mul_add(self.factors[b.factor], self.scaled::<I>(a, block))
            }
            Terms::Three([a, b, c]) => {
                let newest = self.newest::<I>(c.operand, block, last);
                let second = self.at::<I>(b.operand.slot, block);
                let rest = second.mul_add(self.factors[b.factor], self.scaled::<I>(a, block));
                newest.mul_add(self.factors[c.factor], rest)
            }
        };
        match sum.constant {
            Some(constant) if I == 0 && block == 0 => value + self.factors[constant],
            _ => value,
        }
    }

    #[inline(always)]
    fn scaled<const I: usize>(&self, term: &ScaledOperand, block: usize) -> S {
        self.at::<I>(term.operand.slot, block) * self.factors[term.factor]
    }

    #[inline(always)]
    fn square<const I: usize>(&self, out: Slot, a: Operand, block: usize, last: S) -> S {
        let newest = self.newest::<I>(a, block, last);
        let series = self.series(a.slot);
        let (first, present) = (&series[0], &series[block]);
        if block > 0 {
            let sum = sum_before::<S, I>(S::zero(), first, present);
            let sum = first[0].mul_add(newest, sum);
            return self.at::<I>(out, block) + (sum + sum);
        }
        if I == 0 {
            return newest * newest;
        }
        let mut sum = S::zero();
        for j in 1..I.div_ceil(2) {
            sum = first[j].mul_add(first[I - j], sum);
        }
        let sum = first[0].mul_add(newest, sum);
        let twice = sum + sum;
        if I.is_multiple_of(2) { first[I / 2].mul_add(first[I / 2], twice) } else { twice }
    }

    #[inline(always)]
    fn product<const I: usize>(
        &self,
        out: Slot,
        (a, b): (Operand, Operand),
        block: usize,
        last: S,
    ) -> S {
        let newest = (self.newest::<I>(a, block, last), self.newest::<I>(b, block, last));
        if I == 0 && block == 0 {
            return newest.0 * newest.1;
        }
        let sum = self.without_newest::<I>(out, [a.slot, b.slot], block);
        let [a, b] = [a, b].map(|operand| self.at::<0>(operand.slot, 0));
        a.mul_add(newest.1, b.mul_add(newest.0, sum))
    }

    /// Coefficient of the product of two series, without the products of heads and newest
    /// coefficients.
    #[inline(always)]
    fn without_newest<const I: usize>(&self, out: Slot, [a, b]: [Slot; 2], block: usize) -> S {
        let (a, b) = (self.series(a), self.series(b));
        if block > 0 {
            let sum = sum_before::<S, I>(self.at::<I>(out, block), &a[0], &b[block]);
            return sum_before::<S, I>(sum, &b[0], &a[block]);
        }
        let mut sum = S::zero();
        for j in 1..I {
            sum = a[0][j].mul_add(b[0][I - j], sum);
        }
        sum
    }

    /// Coefficient of the product of an Euler derivative, whose head is 0, and a partner, whose
    /// newest coefficient may not be known yet.
    #[inline(always)]
    fn function<const I: usize>(
        &self,
        out: Slot,
        (euler_a, partner): (Operand, Slot),
        block: usize,
        last: S,
    ) -> S {
        let newest = self.newest::<I>(euler_a, block, last);
        let sum = self.without_newest::<I>(out, [euler_a.slot, partner], block);
        self.at::<0>(partner, 0).mul_add(newest, sum)
    }

    /// Coefficient of a quotient before the division by the head of the denominator.
    #[inline(always)]
    fn dividend<const I: usize>(
        &self,
        out: Slot,
        (numerator, denominator): (Operand, Operand),
        block: usize,
        last: S,
    ) -> S {
        let numerator = self.newest::<I>(numerator, block, last);
        if I == 0 && block == 0 {
            return numerator;
        }
        let newest = self.newest::<I>(denominator, block, last);
        let sum = self.without_newest::<I>(out, [out, denominator.slot], block);
        numerator - self.at::<0>(out, 0).mul_add(newest, sum)
    }

    /// Linear combination of complete series.
    #[inline(always)]
    fn linear_series(&mut self, out: Slot, sum: &Sum) {
        let (first, others) = match &sum.terms {
            Terms::One(a) => (a, [None, None]),
            Terms::Two([a, b]) => (a, [Some(b), None]),
            Terms::Three([a, b, c]) => (a, [Some(b), Some(c)]),
        };
        for block in 0..self.blocks.min(MOST_BLOCKS) {
            let factor = self.factors[first.factor];
            for i in 0..BLOCK {
                self.tape[out][block][i] = self.tape[first.operand.slot][block][i] * factor;
            }
        }
        for term in others.into_iter().flatten() {
            let factor = self.factors[term.factor];
            for block in 0..self.blocks.min(MOST_BLOCKS) {
                for i in 0..BLOCK {
                    let a = self.tape[term.operand.slot][block][i];
                    self.tape[out][block][i] = a.mul_add(factor, self.tape[out][block][i]);
                }
            }
        }
        if let Some(constant) = sum.constant {
            self.tape[out][0][0] += self.factors[constant];
        }
    }

    /// `sin(a_0 + a_1 t)` and its cosine: four derivatives in turn.
    #[inline(always)]
    fn phase_series(&mut self, a: Slot, table: Slot, (sine, cosine): (Option<Slot>, Option<Slot>)) {
        let (s, c) = self.series(a)[0][0].sin_cos();
        let derivatives = [(sine, [s, c, -s, -c]), (cosine, [c, -s, -c, s])];
        for (out, derivatives) in derivatives {
            let Some(out) = out else { continue };
            for block in 0..self.blocks.min(MOST_BLOCKS) {
                let powers = self.tape[table][block];
                let out = &mut self.tape[out][block];
                for i in 0..BLOCK {
                    out[i] = powers[i] * derivatives[i];
                }
            }
        }
    }

    #[inline(always)]
    fn series(&self, slot: Slot) -> &Blocks<S> {
        &self.tape[slot]
    }

    #[inline(always)]
    fn at<const I: usize>(&self, slot: Slot, block: usize) -> S {
        self.tape[slot][block][I]
    }

    #[inline(always)]
    fn newest<const I: usize>(&self, operand: Operand, block: usize, last: S) -> S {
        if operand.is_fresh { last } else { self.at::<I>(operand.slot, block) }
    }

    #[inline(always)]
    fn put<const I: usize>(&mut self, slot: Slot, block: usize, value: S) -> S {
        self.tape[slot][block][I] = value;
        value
    }

    /// Writes a coefficient to the next degree, if there is one.
    #[inline(always)]
    fn put_next<const I: usize>(&mut self, slot: Slot, block: usize, value: S) -> S {
        if I + 1 < BLOCK {
            self.tape[slot][block][I + 1] = value;
        } else if block + 1 < MOST_BLOCKS {
            self.tape[slot][block + 1][0] = value;
        }
        value
    }
}

/// `sum + Σ_{j=1}^{I} first_j present_{I−j}`, the newest coefficient last.
#[inline(always)]
fn sum_before<S: Scalar, const I: usize>(mut sum: S, first: &Block<S>, present: &Block<S>) -> S {
    for j in (1..=I).rev() {
        sum = first[j].mul_add(present[I - j], sum);
    }
    sum
}

/// Number of degrees in a block.
pub(super) const BLOCK: usize = 4;

/// Four neighbouring coefficients.
pub(super) type Block<S> = [S; BLOCK];

/// Contribution of the blocks `a` and `b` before the present one (equally many, at least one) to
/// the present block of the product.
#[inline(always)]
fn earlier_product<S: Scalar>(a: &[Block<S>], b: &[Block<S>]) -> Block<S> {
    let last = a.len() - 1;
    let mut sum = high([S::zero(); BLOCK], &a[0], &b[last]);
    add(&mut sum, both(&a[1..], b));
    sum
}

/// Contribution of the earlier blocks `a` to the present block of the square, each pair of factors
/// once.
#[inline(always)]
fn earlier_square<S: Scalar>(a: &[Block<S>]) -> Block<S> {
    let (last, middle) = (a.len() - 1, a.len() / 2);
    let zero = [S::zero(); BLOCK];
    if last == 0 {
        return high(zero, &a[0], &a[0]);
    }
    let mut sum = high(zero, &a[0], &a[last]);
    add(&mut sum, both(&a[1..middle], a));
    let alone = if a.len().is_multiple_of(2) {
        low(zero, &a[middle], &a[middle])
    } else {
        sum = low(sum, &a[middle], &a[middle + 1]);
        high(zero, &a[middle], &a[middle])
    };
    let twice = sum;
    add(&mut sum, twice);
    add(&mut sum, alone);
    sum
}

/// `Σ_q low(a_q, b_{n−q}) + high(a_q, b_{n−1−q})` over the blocks of `a`; the first block of `a` is
/// multiplied with the last two of `b`.
#[inline(always)]
fn both<S: Scalar>(a: &[Block<S>], b: &[Block<S>]) -> Block<S> {
    let mut chains = [[S::zero(); BLOCK]; BLOCK];
    for (a, pair) in a.iter().zip(b.windows(2).rev()) {
        if let Ok(pair) = <&[S; 2 * BLOCK]>::try_from(pair.as_flattened()) {
            for (degree, chain) in chains.iter_mut().enumerate() {
                for (offset, sum) in chain.iter_mut().enumerate() {
                    *sum = a[degree].mul_add(pair[BLOCK - degree + offset], *sum);
                }
            }
        }
    }
    let [mut sum, second, mut third, fourth] = chains;
    add(&mut sum, second);
    add(&mut third, fourth);
    add(&mut sum, third);
    sum
}

#[inline(always)]
fn add<S: Scalar>(sum: &mut Block<S>, other: Block<S>) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += other;
    }
}

/// `sum + low(a, b)`: `Σ_{j ≤ i} a_j b_{i−j}`.
#[inline(always)]
fn low<S: Scalar>(mut sum: Block<S>, a: &Block<S>, b: &Block<S>) -> Block<S> {
    for (i, sum) in sum.iter_mut().enumerate() {
        for j in 0..=i {
            *sum = a[j].mul_add(b[i - j], *sum);
        }
    }
    sum
}

/// `sum + high(a, b)`: `Σ_{j > i} a_j b_{4+i−j}`.
#[inline(always)]
fn high<S: Scalar>(mut sum: Block<S>, a: &Block<S>, b: &Block<S>) -> Block<S> {
    for (i, sum) in sum.iter_mut().enumerate() {
        for j in i + 1..BLOCK {
            *sum = a[j].mul_add(b[BLOCK + i - j], *sum);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `Σ_j a_j b_{k−j}` over the terms in which both factors lie before degree `known`.
    fn terms_before(a: &[f64], b: &[f64], k: usize, known: usize) -> f64 {
        let both_known = |&j: &usize| j < known && k - j < known;
        (0..=k).filter(both_known).map(|j| a[j] * b[k - j]).sum()
    }

    #[test]
    fn earlier_parts_of_products_and_squares_are_exact_on_integers() {
        let series = |factor: u32| -> Vec<Block<f64>> {
            let coefficient = |k: u32| f64::from((k * factor + 3) % 17) - 8.0;
            (0..8).map(|block| std::array::from_fn(|i| coefficient(4 * block + i as u32))).collect()
        };
        let (a, b) = (series(5), series(11));
        for block in 1..8 {
            let product = earlier_product(&a[..block], &b[..block]);
            let square = earlier_square(&a[..block]);
            for i in 0..BLOCK {
                let (k, known) = (BLOCK * block + i, BLOCK * block);
                let (a, b) = (a.as_flattened(), b.as_flattened());
                assert_eq!(product[i], terms_before(a, b, k, known), "{block} {i}");
                assert_eq!(square[i], terms_before(a, a, k, known), "{block} {i}");
            }
        }
    }
}
