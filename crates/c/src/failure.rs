//! Failures of calls, kept for the thread that made the call.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use grazemap::interruption::Interrupted;

use crate::border::{
    GRAZEMAP_DONE, GRAZEMAP_ENDED, GRAZEMAP_INTERRUPTED, GRAZEMAP_PANIC, GRAZEMAP_WRONG,
};
use crate::values::Interruption;

/// Failure of a call.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Error of the library.
    Library(grazemap::Error),
    /// Wrong call.
    Call(String),
}

impl<E: Into<grazemap::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Library(error.into())
    }
}

/// Message of a failure, and its place in the text of a scene.
#[derive(Debug, Default)]
struct Last {
    words: CString,
    position: Option<(usize, usize)>,
}

thread_local! {
    static LAST: RefCell<Last> = RefCell::default();
    /// Interruption that covers the calls of this thread.
    static COVERING: RefCell<Option<Interruption>> = RefCell::default();
}

/// Covers the later calls of this thread with an interruption; `None` removes the cover.
pub(crate) fn cover(interruption: Option<&Interruption>) {
    COVERING.set(interruption.cloned());
}

/// Runs a call and returns its code. A failure is kept for this thread; a panic is caught.
pub(crate) fn answer(call: impl FnOnce() -> Result<(), Failure>) -> i32 {
    let covered = || match COVERING.with_borrow(Clone::clone) {
        Some(interruption) => interruption.0.cover(call),
        None => call(),
    };
    let (code, words, position) = match catch_unwind(AssertUnwindSafe(covered)) {
        Ok(Ok(())) => return GRAZEMAP_DONE,
        Ok(Err(Failure::Library(error))) => {
            let position = match &error {
                grazemap::Error::Scene(fault) => fault.position(),
                _ => None,
            };
            let code = if error.ended_otherwise() { GRAZEMAP_ENDED } else { GRAZEMAP_WRONG };
            (code, error.with_reasons(), position)
        }
        Ok(Err(Failure::Call(words))) => (GRAZEMAP_WRONG, words, None),
        Err(payload) if payload.is::<Interrupted>() => {
            (GRAZEMAP_INTERRUPTED, "interrupted".to_owned(), None)
        }
        Err(payload) => (GRAZEMAP_PANIC, panicked(&*payload), None),
    };
    let words = CString::new(words.replace('\0', " ")).unwrap_or_default();
    LAST.set(Last { words, position });
    code
}

fn panicked(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let words = text.or(payload.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
    format!("a fault of grazemap, please report it: {words}")
}

/// Message of this thread's last failure, with line and column of its place, 0 if there is none.
pub(crate) fn last() -> (*const c_char, usize, usize) {
    LAST.with_borrow(|last| {
        let (line, column) = last.position.unwrap_or_default();
        (last.words.as_ptr(), line, column)
    })
}

#[cfg(test)]
mod tests {
    use super::{
        Failure, GRAZEMAP_DONE, GRAZEMAP_INTERRUPTED, GRAZEMAP_PANIC, GRAZEMAP_WRONG, Interruption,
        LAST, answer, cover,
    };

    fn words() -> String {
        LAST.with_borrow(|last| last.words.to_string_lossy().into_owned())
    }

    #[test]
    fn a_panic_ends_as_a_code_with_its_words() {
        assert_eq!(answer(|| panic!("no {}", "luck")), GRAZEMAP_PANIC);
        assert_eq!(words(), "a fault of grazemap, please report it: no luck");
    }

    #[test]
    fn a_request_ends_the_calls_that_it_covers() {
        let interruption = Interruption::default();
        let ask = || {
            answer(|| {
                grazemap::interruption::check();
                Ok(())
            })
        };
        cover(Some(&interruption));
        assert_eq!(ask(), GRAZEMAP_DONE);
        interruption.0.request();
        assert_eq!((ask(), words()), (GRAZEMAP_INTERRUPTED, "interrupted".to_owned()));
        cover(None);
        assert_eq!(ask(), GRAZEMAP_DONE);
    }

    #[test]
    fn a_failure_is_kept_for_its_thread_until_the_next() {
        let fail = |words: &str| answer(|| Err(Failure::Call(words.to_owned())));
        assert_eq!(fail("first"), GRAZEMAP_WRONG);
        std::thread::spawn(move || fail("elsewhere")).join().expect("it ends");
        assert_eq!((answer(|| Ok(())), words()), (GRAZEMAP_DONE, "first".to_owned()));
        assert_eq!((fail("se\0cond"), words()), (GRAZEMAP_WRONG, "se cond".to_owned()));
    }
}
