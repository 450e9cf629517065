//! Interruption of a computation whose result its caller no longer wants.
//!
//! Long loops call [`check`], which unwinds the stack after the caller requested the end. Work that
//! a thread pool does for a computation belongs to that computation: [`Work::resume`] wraps the
//! pool's work.
//!
//! ```
//! use std::panic::catch_unwind;
//! use grazemap_jet::interruption::{Interruption, check};
//!
//! let interruption = Interruption::default();
//! let asked = interruption.clone();
//! let ended = catch_unwind(move || {
//!     interruption.cover(|| {
//!         for step in 0.. {
//!             check();
//!             if step == 1000 {
//!                 asked.request();
//!             }
//!         }
//!     })
//! });
//! assert!(ended.is_err());
//! check(); // Outside of the computation nothing ends.
//! ```

use std::cell::RefCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    /// Interruption that covers the current work of this thread.
    static COVERING: RefCell<Option<Interruption>> = const { RefCell::new(None) };
}

/// A request to end a computation, from any thread. All clones are the same request.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicBool>);

/// Payload with which an interrupted computation unwinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted;

impl Interruption {
    /// Requests that all work that this interruption covers end at its next [`check`].
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the end was requested.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Runs work that a request ends. Work inside other covered work is covered by the inner
    /// interruption only.
    pub fn cover<T>(&self, work: impl FnOnce() -> T) -> T {
        Work { covering: Some(self.clone()) }.resume(work)
    }
}

/// The computation of a thread, to be handed to other threads.
#[derive(Clone, Debug)]
pub struct Work {
    covering: Option<Interruption>,
}

impl Work {
    /// The computation of the current thread.
    pub fn current() -> Self {
        Self { covering: COVERING.with_borrow(Clone::clone) }
    }

    /// Runs a part of the computation on the current thread.
    pub fn resume<T>(&self, part: impl FnOnce() -> T) -> T {
        if COVERING.with_borrow(|covering| same(covering.as_ref(), self.covering.as_ref())) {
            return part();
        }
        let before = COVERING.replace(self.covering.clone());
        let _restored = Restored(before);
        part()
    }
}

fn same(one: Option<&Interruption>, other: Option<&Interruption>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => Arc::ptr_eq(&one.0, &other.0),
        (one, other) => one.is_none() && other.is_none(),
    }
}

/// Guard that restores the previous interruption of a thread, also on unwinding.
struct Restored(Option<Interruption>);

impl Drop for Restored {
    fn drop(&mut self) {
        COVERING.set(self.0.take());
    }
}

/// Ends the computation of this thread, by unwinding with [`Interrupted`], if its end was
/// requested.
#[inline(never)]
pub fn check() {
    let ends = COVERING.with_borrow(|covering| match covering {
        Some(interruption) => interruption.is_requested(),
        None => false,
    });
    if ends {
        // No panic message: the caller knows the reason.
        resume_unwind(Box::new(Interrupted));
    }
}

/// Calls [`check`] at every 256th step, for loops whose steps take less time than a check.
#[inline]
pub fn check_at(step: usize) {
    if step.is_multiple_of(256) {
        check();
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::thread;

    use super::*;

    fn ends(work: impl FnOnce()) -> bool {
        match catch_unwind(AssertUnwindSafe(work)) {
            Ok(()) => false,
            Err(payload) => payload.downcast_ref() == Some(&Interrupted),
        }
    }

    #[test]
    fn a_request_ends_what_it_covers_and_nothing_else() {
        let [asked, other] = [(); 2].map(|()| Interruption::default());
        asked.request();
        assert!(ends(|| asked.cover(check)));
        assert!(!ends(|| other.cover(check)));
        assert!(!ends(|| asked.cover(|| other.cover(check))));
        assert!(ends(|| asked.cover(|| {
            other.cover(check);
            check();
        })));
        assert!(!ends(check));
    }

    #[test]
    fn other_threads_work_for_the_computation_that_is_handed_to_them() {
        let asked = Interruption::default();
        asked.request();
        let work = asked.cover(Work::current);
        let alone = || thread::scope(|scope| scope.spawn(|| ends(check)).join());
        let handed = || thread::scope(|scope| scope.spawn(|| ends(|| work.resume(check))).join());
        assert_eq!(alone().ok(), Some(false));
        assert_eq!(handed().ok(), Some(true));
    }
}
