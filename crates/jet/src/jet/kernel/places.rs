//! Where the values of a kernel stand when it runs.

use std::collections::HashMap;

use super::schemes::Step;
use super::{Kernel, Value};

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

/// Places in a memory of inputs, results and known values; only those known values have one that
/// are looked up.
#[derive(Debug)]
pub(super) struct Places {
    free: usize,
    /// Which of the results is an operation's.
    of_operations: HashMap<usize, usize>,
    /// Results that are copies of inputs, after the others.
    copies: usize,
    known: HashMap<Known, u32>,
    /// The known values in the order of their places.
    pub(super) kept: Vec<Known>,
}

impl Places {
    /// Places of the results of these steps, with inputs from number `free` on known.
    pub(super) fn new(kernel: &Kernel, free: usize, steps: &[Step]) -> Self {
        let numbers = steps.iter().flat_map(Step::numbers).enumerate();
        let mut places = Self {
            free,
            of_operations: numbers.map(|(place, number)| (number, place)).collect(),
            copies: 0,
            known: HashMap::new(),
            kept: Vec::new(),
        };
        let outputs = kernel.outputs.iter();
        places.copies = outputs.filter(|&&value| places.is_input(value)).count();
        places
    }

    /// Number of results.
    pub(super) fn results(&self) -> usize {
        self.of_operations.len() + self.copies
    }

    /// Whether a value is an input, not known before a run.
    pub(super) fn is_input(&self, value: Value) -> bool {
        matches!(value, Value::Input(number) if (number as usize) < self.free)
    }

    /// Places of outputs, those that are inputs in the places of their copies.
    pub(super) fn of_outputs(&mut self, outputs: &[Value]) -> Vec<u32> {
        let mut copy = self.free + self.of_operations.len();
        let mut place = |&value: &Value| {
            if !self.is_input(value) {
                return self.of(value);
            }
            copy += 1;
            copy as u32 - 1
        };
        outputs.iter().map(&mut place).collect()
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
