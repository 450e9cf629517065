//! Two tiers of checks: `.ci/run` takes a part of a long list of cases, `.ci/full` the whole list.

use std::env;

/// Whether lists of cases are whole: `WHOLE_TESTS` is set, as by `.ci/full`.
pub(crate) fn are_whole() -> bool {
    env::var_os("WHOLE_TESTS").is_some()
}

/// Number of cases that are made by counting: the first number, or the second if lists are whole.
pub(crate) fn count(part: usize, whole: usize) -> usize {
    if are_whole() { whole } else { part }
}

/// Cases of a list: as many as asked for, from its first to its last in equal steps, or all if lists
/// are whole.
pub(crate) fn part<T>(cases: &[T], count: usize) -> impl Iterator<Item = &T> {
    let taken = self::count(count, cases.len()).min(cases.len());
    let steps = taken.saturating_sub(1).max(1);
    (0..taken).map(move |place| &cases[place * (cases.len() - 1) / steps])
}
