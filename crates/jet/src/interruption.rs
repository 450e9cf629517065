//! The end of a computation that its caller no longer wants.
//!
//! Long loops call [`check`], which unwinds the stack after the caller asked for the end. What a
//! thread pool does for a computation belongs to it as well: the pool's work is wrapped by
//! [`Work::resume`].
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
    /// The interruption that covers what this thread is doing.
    static COVERING: RefCell<Option<Interruption>> = const { RefCell::new(None) };
}

/// A request to end a computation, from any thread. Clones are one request.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicBool>);

/// What a computation unwinds with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted;

impl Interruption {
    /// Asks all that this interruption covers to end at its next [`check`].
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Does work that a request ends. Work inside other covered work is covered by the inner
    /// interruption alone.
    pub fn cover<T>(&self, work: impl FnOnce() -> T) -> T {
        Work { covering: Some(self.clone()) }.resume(work)
    }
}

/// The computation that a thread is at work for, to be handed to other threads.
#[derive(Clone, Debug)]
pub struct Work {
    covering: Option<Interruption>,
}

impl Work {
    /// The computation of this thread.
    pub fn current() -> Self {
        Self { covering: COVERING.with_borrow(Clone::clone) }
    }

    /// Goes on with the computation on this thread.
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

/// Restores what covered a thread before, also when it unwinds.
struct Restored(Option<Interruption>);

impl Drop for Restored {
    fn drop(&mut self) {
        COVERING.set(self.0.take());
    }
}

/// Ends the computation of this thread, by unwinding with [`Interrupted`], where its end was asked
/// for.
#[inline(never)]
pub fn check() {
    let ends = COVERING.with_borrow(|covering| match covering {
        Some(interruption) => interruption.is_requested(),
        None => false,
    });
    if ends {
        // No message of a panic: the caller knows.
        resume_unwind(Box::new(Interrupted));
    }
}

/// As [`check`], at every 256th step of a loop whose steps take less time than a check.
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
