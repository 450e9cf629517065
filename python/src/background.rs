//! Runs long computations on a thread of their own, while Python's thread checks for signals.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use grazemap::Error;
use grazemap::analysis::Progress;
use grazemap::interruption::Interruption;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::exception;

/// Interval at which Python's signals and progress are handled.
const PAUSE: Duration = Duration::from_millis(50);

/// Progress of a computation.
#[derive(Debug, Default)]
struct Watch {
    expected: AtomicU64,
    done: AtomicU64,
}

impl Progress for Watch {
    fn expect(&self, total: u64) {
        self.expected.fetch_add(total, Ordering::Relaxed);
    }

    fn advance(&self, units: u64) {
        self.done.fetch_add(units, Ordering::Relaxed);
    }
}

/// Computation running on another thread.
struct Computation<T> {
    watch: Arc<Watch>,
    interruption: Interruption,
    result: Mutex<Receiver<thread::Result<Result<T, Error>>>>,
}

/// Result of a computation. An exception, from a signal or from `progress` (called with the units
/// done and expected; expected is 0 if unknown), ends the call at once and the computation, on all
/// its threads, at its next step.
pub(crate) fn compute<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&dyn Progress) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let (computation, begin) = Computation::of(work);
    thread::spawn(begin);
    computation.attend(py, progress)
}

/// Result of a computation that borrows its data. An exception ends the computation first, then the
/// call.
pub(crate) fn compute_borrowing<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    let (computation, begin) = Computation::of(|_| work());
    thread::scope(|scope| {
        scope.spawn(begin);
        computation.attend(py, None)
    })
}

impl<T: Send> Computation<T> {
    /// Creates a computation and the function that its thread runs.
    fn of(
        work: impl FnOnce(&dyn Progress) -> Result<T, Error> + Send,
    ) -> (Self, impl FnOnce() + Send) {
        let (watch, interruption) = (Arc::new(Watch::default()), Interruption::default());
        let (seen, covering) = (Arc::clone(&watch), interruption.clone());
        let (sender, receiver) = channel();
        let begin = move || {
            let result = catch_unwind(AssertUnwindSafe(|| covering.cover(|| work(&*seen))));
            // NOTE: there is no receiver if the call was interrupted.
            let _ = sender.send(result);
        };
        (Self { watch, interruption, result: Mutex::new(receiver) }, begin)
    }

    /// Waits for the result, and handles Python's signals and progress meanwhile.
    fn attend(self, py: Python<'_>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<T> {
        let next = || match self.result.lock() {
            Ok(receiver) => receiver.recv_timeout(PAUSE),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        };
        let report = || match progress {
            Some(progress) => {
                let Watch { done, expected } = &*self.watch;
                let told = [done, expected].map(|number| number.load(Ordering::Relaxed));
                progress.call1((told[0], told[1])).map(drop)
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
                        self.interruption.request();
                        return Err(interrupt);
                    }
                }
            }
        }
    }
}
