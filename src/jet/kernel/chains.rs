//! Chains of multiply-adds in a kernel, and the order in which they run.
//!
//! The one idea: each multiply-add of a chain waits for the one before, five cycles or so, so that two chains with one
//! factor run in little more than the time of one. Operations are taken by their level, how far they are from the inputs,
//! and chains of one level and factor in pairs of like length.

use super::{Kernel, Operation, Value};

/// A chain: `(…((start · factor + c₁) · factor + c₂) …) · factor + c_n`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chain {
    pub(super) start: Value,
    pub(super) factor: Value,
    pub(super) addends: Vec<Value>,
}

/// What runs at once.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// An operation that is no multiply-add.
    Operation(usize),
    /// The chain that gives an operation's result.
    Chain(usize, Chain),
    /// Two chains with one factor, the longer one first, neither of which needs the other.
    Chains([usize; 2], [Chain; 2]),
}

/// All that a kernel does, in an order in which everything needed has been done.
pub(super) fn schedule(kernel: &Kernel) -> Vec<Step> {
    let absorbed = absorbed(kernel);
    let mut levels: Vec<Level> = Vec::new();
    let mut of_result = vec![0; kernel.operations.len()];
    for number in (0..kernel.operations.len()).filter(|&number| !absorbed[number]) {
        let chain = chain(kernel, &absorbed, number);
        let level_of = |value: Value| match value {
            Value::Result(number) => of_result[number as usize] + 1,
            Value::Input(_) | Value::Constant(_) => 0,
        };
        let level = match &chain {
            Some(chain) => chain.operands().map(level_of).max(),
            None => kernel.operations[number].operands().map(level_of).max(),
        };
        of_result[number] = level.unwrap_or(0);
        levels.resize_with(levels.len().max(of_result[number] + 1), Level::default);
        levels[of_result[number]].add(number, chain);
    }
    levels.into_iter().flat_map(Level::steps).collect()
}

/// Operations none of which needs another.
#[derive(Default)]
struct Level {
    alone: Vec<usize>,
    /// Chains by their factors, in the order in which factors appear.
    chains: Vec<(Value, Vec<(usize, Chain)>)>,
}

impl Level {
    fn add(&mut self, number: usize, chain: Option<Chain>) {
        let Some(chain) = chain else {
            self.alone.push(number);
            return;
        };
        let factor = chain.factor;
        match self.chains.iter_mut().find(|(own, _)| *own == factor) {
            Some((_, chains)) => chains.push((number, chain)),
            None => self.chains.push((factor, vec![(number, chain)])),
        }
    }

    fn steps(self) -> Vec<Step> {
        let mut steps: Vec<Step> = self.alone.into_iter().map(Step::Operation).collect();
        for (_, mut chains) in self.chains {
            chains.sort_by_key(|(_, chain)| std::cmp::Reverse(chain.addends.len()));
            let mut chains = chains.into_iter();
            while let Some((first, longer)) = chains.next() {
                steps.push(match chains.next() {
                    Some((second, other)) => Step::Chains([first, second], [longer, other]),
                    None => Step::Chain(first, longer),
                });
            }
        }
        steps
    }
}

impl Chain {
    fn operands(&self) -> impl Iterator<Item = Value> {
        [self.start, self.factor]
            .into_iter()
            .chain(self.addends.iter().copied())
    }
}

/// The chain that gives the result of a multiply-add.
fn chain(kernel: &Kernel, absorbed: &[bool], number: usize) -> Option<Chain> {
    let Operation::MultiplyAdd(mut start, factor, addend) = kernel.operations[number] else {
        return None;
    };
    let mut addends = vec![addend];
    while let Value::Result(sum) = start
        && absorbed[sum as usize]
        && let Operation::MultiplyAdd(before, _, addend) = kernel.operations[sum as usize]
    {
        addends.push(addend);
        start = before;
    }
    addends.reverse();
    Some(Chain {
        start,
        factor,
        addends,
    })
}

/// Which operations are multiply-adds whose result is used once, as the sum that a multiply-add with the same factor goes on from.
fn absorbed(kernel: &Kernel) -> Vec<bool> {
    let mut uses = vec![0; kernel.operations.len()];
    let operands = kernel.operations.iter().flat_map(Operation::operands);
    for value in operands.chain(kernel.outputs.iter().copied()) {
        if let Value::Result(number) = value {
            uses[number as usize] += 1;
        }
    }
    let mut absorbed = vec![false; kernel.operations.len()];
    for operation in &kernel.operations {
        if let Operation::MultiplyAdd(Value::Result(sum), factor, _) = *operation {
            let before = kernel.operations[sum as usize];
            let goes_on = matches!(before, Operation::MultiplyAdd(_, own, _) if own == factor);
            absorbed[sum as usize] = goes_on && uses[sum as usize] == 1;
        }
    }
    absorbed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::kernel::KernelBuilder;

    #[test]
    fn rows_of_a_polynomial_run_in_pairs_and_the_sum_over_rows_after_them() {
        let mut builder = KernelBuilder::new(2);
        let (x, y) = (builder.input(0), builder.input(1));
        let constants: Vec<Value> = (2..11).map(|n| builder.constant(f64::from(n))).collect();
        let mut row = |first: usize, len: usize| {
            let start = constants[first];
            let addends = &constants[first + 1..=first + len];
            let addends = addends.iter();
            addends.fold(start, |sum, &addend| builder.multiply_add(sum, x, addend))
        };
        let rows = [row(0, 1), row(2, 3), row(6, 2)];
        let sum = builder.multiply_add(rows[0], y, rows[1]);
        let sum = builder.multiply_add(sum, y, rows[2]);
        let steps = schedule(&builder.finish(vec![sum]));
        let lengths = |step: &Step| match step {
            Step::Operation(_) => vec![],
            Step::Chain(_, chain) => vec![chain.addends.len()],
            Step::Chains(_, chains) => chains.iter().map(|own| own.addends.len()).collect(),
        };
        let lengths: Vec<Vec<usize>> = steps.iter().map(lengths).collect();
        assert_eq!(lengths, [vec![3, 2], vec![1], vec![2]]);
    }

    #[test]
    fn chains_that_need_each_other_are_apart() {
        let mut builder = KernelBuilder::new(2);
        let (x, c) = (builder.input(0), builder.input(1));
        let inner = builder.multiply_add(c, x, c);
        let outer = builder.multiply_add(c, x, inner);
        let twice = builder.multiply(outer, inner);
        let steps = schedule(&builder.finish(vec![twice]));
        assert_eq!(steps.len(), 3);
        assert!(matches!(steps[0], Step::Chain(0, _)));
        assert!(matches!(steps[1], Step::Chain(1, _)));
    }
}
