//! Parallel computation on all threads of the pool of this process.
//!
//! A single function uses the pool, so that its code is compiled once and not for every closure.
//! The pool's threads work on behalf of the computation that called them: one
//! [`Interruption`](crate::interruption::Interruption) ends them all.

use std::env;
use std::num::NonZero;
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::available_parallelism;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::interruption::{Work, check};

/// The threads of a process.
struct Pool {
    process: u32,
    /// `None` if the system provides no threads: then the caller's thread does all work.
    threads: Option<ThreadPool>,
    /// Pool of a process forked from this one: a fork has none of its parent's threads.
    forked: OnceLock<Box<Pool>>,
}

static FIRST: OnceLock<Pool> = OnceLock::new();

impl Pool {
    /// A pool of so many threads, at most one for each core: more would only wait for each other.
    fn new(threads: usize) -> Self {
        let threads = ThreadPoolBuilder::new().num_threads(threads.clamp(1, cores())).build().ok();
        Self { process: process::id(), threads, forked: OnceLock::new() }
    }

    /// The pool of this process.
    fn own() -> &'static Self {
        let process = process::id();
        let mut pool = FIRST.get_or_init(|| Self::new(threads_of_environment()));
        while pool.process != process {
            let like = pool.threads.as_ref().map_or(1, ThreadPool::current_num_threads);
            pool = pool.forked.get_or_init(|| Box::new(Self::new(like)));
        }
        pool
    }
}

fn cores() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// Number of threads in `RAYON_NUM_THREADS`; unlimited if it is not a positive number.
fn threads_of_environment() -> usize {
    let stated = env::var("RAYON_NUM_THREADS").ok().and_then(|number| number.parse().ok());
    stated.filter(|&threads: &usize| threads > 0).unwrap_or(usize::MAX)
}

/// Starts the pool of this process, with at most one thread for each core. Returns `false` if a
/// pool exists already, which is kept.
pub fn start(threads: usize) -> bool {
    FIRST.set(Pool::new(threads)).is_ok()
}

/// Number of threads that share work.
pub fn threads() -> usize {
    in_pool(|shared| if shared { rayon::current_num_threads() } else { 1 })
}

/// Runs work on a thread of the pool, or of another pool that this thread belongs to. Without a
/// pool it runs on this thread; the argument of `work` says whether there is a pool.
fn in_pool<T: Send>(work: impl FnOnce(bool) -> T + Send) -> T {
    if rayon::current_thread_index().is_some() {
        return work(true);
    }
    match &Pool::own().threads {
        Some(pool) => pool.install(|| work(true)),
        None => work(false),
    }
}

/// Maps items to values in parallel; values are in the items' order.
///
/// ```
/// use grazemap_map::iteration::parallel;
///
/// let squares = parallel::map(1..=3, |number| number * number);
/// assert_eq!(squares, [1, 4, 9]);
/// ```
pub fn map<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    value: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    map_with(items, || (), |(), item| value(item))
}

/// Maps items to values in parallel, in order, with a reusable state that one thread at a time
/// holds.
pub fn map_with<I: Send, S: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    state: impl Fn() -> S + Sync,
    value: impl Fn(&mut S, I) -> T + Sync,
) -> Vec<T> {
    let items: Vec<_> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    let values: Vec<Mutex<Option<T>>> = items.iter().map(|_| Mutex::default()).collect();
    let idle = Mutex::new(Vec::new());
    each(items.len(), &|number| {
        let Some(item) = locked(&items[number]).take() else { return };
        let kept = locked(&idle).pop();
        let mut state = kept.unwrap_or_else(&state);
        let value = value(&mut state, item);
        *locked(&values[number]) = Some(value);
        locked(&idle).push(state);
    });
    let values = values.into_iter();
    values.filter_map(|value| value.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// Maps items to values in parallel; values are in the items' order.
///
/// # Errors
///
/// The first error, in the items' order, among those computed: after an error no other item is
/// begun.
pub fn try_map<I: Send, T: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    value: impl Fn(I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    try_map_with(items, || (), |(), item| value(item))
}

/// Maps items to values in parallel, in order, with a reusable state that one thread at a time
/// holds.
///
/// # Errors
///
/// As [`try_map`].
pub fn try_map_with<I: Send, S: Send, T: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    state: impl Fn() -> S + Sync,
    value: impl Fn(&mut S, I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let failed = AtomicBool::new(false);
    let values = map_with(items, state, |state, item| {
        let begins = !failed.load(Ordering::Relaxed);
        let value = begins.then(|| value(state, item));
        if matches!(value, Some(Err(_))) {
            failed.store(true, Ordering::Relaxed);
        }
        value
    });
    values.into_iter().flatten().collect()
}

/// Runs two functions in parallel.
pub fn join<A: Send, B: Send>(
    one: impl FnOnce() -> A + Send,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    let whole = Work::current();
    in_pool(|shared| match shared {
        true => rayon::join(|| whole.resume(one), || whole.resume(other)),
        false => (one(), other()),
    })
}

/// Flag that is raised where work unwinds.
struct Unwound<'a>(&'a AtomicBool);

impl Drop for Unwound<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

/// Does the work of every number below `count`; after work that unwinds, as at an interruption, no
/// other is begun.
fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    let whole = Work::current();
    let ended = AtomicBool::new(false);
    let part = |number| {
        if ended.load(Ordering::Relaxed) {
            return;
        }
        let _unwound = Unwound(&ended);
        whole.resume(|| {
            check();
            work(number);
        });
    };
    in_pool(|shared| match shared {
        true => (0..count).into_par_iter().for_each(part),
        false => (0..count).for_each(part),
    });
}

/// Locks a mutex, also after a panic of another thread.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::atomic::AtomicUsize;
    use std::thread;
    use std::time::Duration;

    use super::*;
    use crate::interruption::Interruption;

    #[test]
    fn items_are_lent_given_or_changed_and_keep_their_order() {
        let words: Vec<String> = (0..100).map(|number| number.to_string()).collect();
        assert_eq!(map(&words, |word| word.len())[8..=11], [1, 1, 2, 2]);
        let mut counts = vec![0; 100];
        map(counts.iter_mut().enumerate(), |(number, count)| *count = number);
        assert_eq!(counts, Vec::from_iter(0..100));
        assert_eq!(map(words.clone(), |word| word), words);
    }

    #[test]
    fn no_more_states_are_made_than_there_are_threads() {
        let made = AtomicUsize::new(0);
        let state = || made.fetch_add(1, Ordering::Relaxed);
        map_with(0..1000, state, |_, number: usize| number);
        assert!(made.into_inner() <= threads());
    }

    #[test]
    fn a_request_ends_the_work_of_all_threads() {
        let interruption = Interruption::default();
        let begun = AtomicUsize::new(0);
        let ended = catch_unwind(AssertUnwindSafe(|| {
            interruption.cover(|| {
                map(0..100_000, |_| {
                    if begun.fetch_add(1, Ordering::Relaxed) == 10 {
                        interruption.request();
                    }
                    thread::sleep(Duration::from_micros(10));
                })
            })
        }));
        assert!(ended.is_err());
        assert!(begun.into_inner() <= 11 + threads());
        assert_eq!(map(0..3, |number| number), [0, 1, 2]);
    }

    #[test]
    fn two_functions_run_side_by_side_and_in_each_other() {
        let inner = || join(|| map(0..3, |number| number), || 5).0;
        assert_eq!(join(inner, || "other"), (vec![0, 1, 2], "other"));
    }

    #[test]
    fn after_an_error_nothing_is_begun() {
        let pool = ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let begun = AtomicUsize::new(0);
        let found = pool.install(|| {
            try_map(0..100, |number| {
                begun.fetch_add(1, Ordering::Relaxed);
                if number % 10 == 3 { Err(number) } else { Ok(()) }
            })
        });
        assert_eq!((found, begun.into_inner()), (Err(3), 4));
    }
}
