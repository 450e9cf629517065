//! Where the values of a kernel stand when it runs.

use std::collections::HashMap;

use super::Value;
use super::schemes::Step;

/// A value that is known before a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Known {
    /// An input that is set for good, by its number among those.
    Input(u32),
    /// A constant of the kernel.
    Constant(u32),
}

impl Known {
    /// It, from the values of all inputs that are set for good and all constants.
    pub(super) fn of<T: Copy>(self, set: &[T], constants: &[T]) -> T {
        match self {
            Self::Input(number) => set[number as usize],
            Self::Constant(number) => constants[number as usize],
        }
    }
}

/// Places in a memory of inputs, results and known values; only those known values have one that are looked up.
#[derive(Debug)]
pub(super) struct Places {
    free: usize,
    /// Which of the results is an operation's.
    of_operations: HashMap<usize, usize>,
    known: HashMap<Known, u32>,
    /// The known values in the order of their places.
    pub(super) kept: Vec<Known>,
}

impl Places {
    /// Places of the results of these steps, with inputs from number `free` on known.
    pub(super) fn new(free: usize, steps: &[Step]) -> Self {
        let numbers = steps.iter().flat_map(Step::numbers);
        Self {
            free,
            of_operations: numbers
                .enumerate()
                .map(|(place, number)| (number, place))
                .collect(),
            known: HashMap::new(),
            kept: Vec::new(),
        }
    }

    /// Number of results.
    pub(super) fn results(&self) -> usize {
        self.of_operations.len()
    }

    /// A value's place; a known one gets it when first asked for.
    pub(super) fn of(&mut self, value: Value) -> u32 {
        let first_known = self.free + self.results();
        match (value, self.known(value)) {
            (Value::Result(number), _) => {
                (self.free + self.of_operations[&(number as usize)]) as u32
            }
            (_, Some(known)) => *self.known.entry(known).or_insert_with(|| {
                self.kept.push(known);
                (first_known + self.kept.len() - 1) as u32
            }),
            (Value::Input(number) | Value::Constant(number), None) => number,
        }
    }

    /// What a value is if it is known.
    pub(super) fn known(&self, value: Value) -> Option<Known> {
        match value {
            Value::Input(number) => number.checked_sub(self.free as u32).map(Known::Input),
            Value::Constant(number) => Some(Known::Constant(number)),
            Value::Result(_) => None,
        }
    }
}
