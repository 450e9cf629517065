//! What is computed side by side, on all threads of the pool.
//!
//! One function asks the pool, so that its code is compiled once and not for every closure.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

/// Threads among which work is shared.
pub(crate) fn threads() -> usize {
    rayon::current_num_threads()
}

/// The values of items, in the items' order.
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

/// The values of items, in the items' order, computed with a state that one thread at a time holds.
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

/// The values of items, in the items' order.
///
/// # Errors
///
/// That of the first item, among those computed, that has one: after an error no other item is
/// begun.
pub fn try_map<I: Send, T: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    value: impl Fn(I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    try_map_with(items, || (), |(), item| value(item))
}

/// The values of items, in the items' order, computed with a state that one thread at a time holds.
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

/// Does the work of every number below a count.
fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

/// What a mutex holds, also after a panic of another thread.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

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
        assert!(made.into_inner() <= rayon::current_num_threads());
    }

    #[test]
    fn after_an_error_nothing_is_begun() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
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
