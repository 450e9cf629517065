//! Long computations on a thread of their own, while Python's thread looks for signals.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use grazemap::Error;
use grazemap::analysis::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::exception;

/// How often Python's signals and progress are attended to.
const PAUSE: Duration = Duration::from_millis(50);

/// What is done of a computation, and whether it is still wanted.
#[derive(Debug, Default)]
struct Watch {
    expected: AtomicU64,
    done: AtomicU64,
    unwanted: AtomicBool,
}

impl Progress for Watch {
    fn expect(&self, total: u64) {
        self.expected.fetch_add(total, Ordering::Relaxed);
    }

    fn advance(&self, units: u64) {
        self.done.fetch_add(units, Ordering::Relaxed);
        if self.unwanted.load(Ordering::Relaxed) {
            // Ends all threads of the computation, without a word.
            resume_unwind(Box::new("interrupted"));
        }
    }
}

/// What a computation gives. An exception of a signal or of `progress` (called with what is done
/// and what is expected, the second 0 where it is not known) ends the call at once and the
/// computation at its next step.
pub(crate) fn compute<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&dyn Progress) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let seen = Arc::clone(&watch);
    let (sender, receiver) = channel();
    thread::spawn(move || {
        // Nobody listens once the call was interrupted.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| work(&*seen))));
    });
    let receiver = Mutex::new(receiver);
    let next = || match receiver.lock() {
        Ok(receiver) => receiver.recv_timeout(PAUSE),
        Err(_) => Err(RecvTimeoutError::Disconnected),
    };
    let report = || match progress {
        Some(progress) => {
            let [done, all] = [&watch.done, &watch.expected].map(|n| n.load(Ordering::Relaxed));
            progress.call1((done, all)).map(drop)
        }
        None => Ok(()),
    };
    loop {
        match py.detach(next) {
            Ok(Ok(result)) => {
                report()?;
                return result.map_err(|error| exception(py, &error));
            }
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the computation was lost"));
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(interrupt) = py.check_signals().and_then(|()| report()) {
                    watch.unwanted.store(true, Ordering::Relaxed);
                    return Err(interrupt);
                }
            }
        }
    }
}
