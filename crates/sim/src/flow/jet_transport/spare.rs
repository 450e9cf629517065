//! The element of one transport kept for the next of the same thread: preparing one costs as much
//! as computing jets of low order, and asking the system for memory anew as much as a quarter of
//! those of order 6.

use std::cell::RefCell;
use std::sync::Arc;

use super::cache_key::{CacheKey, Inputs};
use super::element::Element;
use crate::flow::Field;
use crate::jet::JetSpace;

/// Longest tape that is kept: 32 MB.
const LONGEST: usize = 1 << 18;

thread_local! {
    static SPARE: RefCell<Option<Box<Element>>> = const { RefCell::new(None) };
}

/// An element for a field and inputs, its values left from earlier use.
pub(super) fn take(field: &Field, space: &Arc<JetSpace>, inputs: Inputs) -> Box<Element> {
    match SPARE.take() {
        Some(element) if element.key.is(field, space, &inputs) => element,
        other => Box::new(Element::new(CacheKey::new(field, space, inputs), other)),
    }
}

/// Keeps an element for the next transport.
pub(super) fn give_back(element: Box<Element>) {
    if element.remainders.tape_len() <= LONGEST {
        SPARE.replace(Some(element));
    }
}
