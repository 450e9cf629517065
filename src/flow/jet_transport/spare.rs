//! Memory of one transport kept for the next of the same thread: asking the system anew costs as much as computing.

use std::cell::RefCell;

use super::gauss::{NODES, NodeValues};
use crate::numeric::Lanes;

/// Longest tape that is kept: 32 MB.
const LONGEST: usize = 1 << 18;

thread_local! {
    static SPARE: RefCell<Vec<NodeValues>> = const { RefCell::new(Vec::new()) };
}

/// A tape of a length, its values left from earlier use.
pub(super) fn take(len: usize) -> Vec<NodeValues> {
    let mut tape = SPARE.take();
    tape.resize(len, Lanes([0.0; NODES]));
    tape
}

/// Keeps a tape for the next transport.
pub(super) fn give_back(tape: Vec<NodeValues>) {
    if tape.len() <= LONGEST {
        SPARE.replace(tape);
    }
}
