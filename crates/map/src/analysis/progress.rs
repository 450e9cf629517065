//! Progress of long computations: how far they are, and the finished pieces from which a later run
//! can go on.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::model::Digest;

/// Receives the progress of a computation; called from any thread.
pub trait Progress: Sync {
    /// `total` more units of work are to come.
    fn expect(&self, total: u64);

    /// `units` of work are done.
    fn advance(&self, units: u64);

    /// The piece at a place of this very computation that an earlier run kept.
    fn recall(&self, _place: &[u64]) -> Option<Vec<u8>> {
        None
    }

    /// Keeps a finished piece for a later run.
    fn keep(&self, _place: &[u64], _piece: &[u8]) {}
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn expect(&self, _total: u64) {}
    fn advance(&self, _units: u64) {}
}

/// A part of a computation, whose pieces have places of their own.
pub struct Part<'a> {
    whole: &'a dyn Progress,
    number: u64,
}

impl<'a> Part<'a> {
    /// The part of this number.
    pub fn new(whole: &'a dyn Progress, number: usize) -> Self {
        Self { whole, number: number as u64 }
    }

    fn place(&self, place: &[u64]) -> Vec<u64> {
        [&[self.number], place].concat()
    }
}

impl Progress for Part<'_> {
    fn expect(&self, total: u64) {
        self.whole.expect(total);
    }

    fn advance(&self, units: u64) {
        self.whole.advance(units);
    }

    fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        self.whole.recall(&self.place(place))
    }

    fn keep(&self, place: &[u64], piece: &[u8]) {
        self.whole.keep(&self.place(place), piece);
    }
}

/// The value that an earlier run kept at a place, to the last bit.
pub(crate) fn recalled<T: DeserializeOwned>(
    progress: &(impl Progress + ?Sized),
    place: &[u64],
) -> Option<T> {
    postcard::from_bytes(&progress.recall(place)?).ok()
}

/// The value at a place, as an earlier run kept it, or computed and kept.
pub(crate) fn resumed<T: Serialize + DeserializeOwned>(
    progress: &(impl Progress + ?Sized),
    place: &[u64],
    compute: impl FnOnce() -> T,
) -> T {
    recalled(progress, place).unwrap_or_else(|| {
        let value = compute();
        keep(progress, place, &value);
        value
    })
}

/// The place, among those that begin with a number, of a piece that these values decide: for pieces
/// of which nobody knows beforehand how many there are.
pub(crate) fn place_of(number: u64, decisive: &impl Serialize) -> [u64; 2] {
    let bytes = postcard::to_stdvec(decisive).unwrap_or_default();
    [number, Digest::of_bytes(&bytes).0]
}

/// Keeps a value for a later run.
pub(crate) fn keep<T: Serialize>(progress: &(impl Progress + ?Sized), place: &[u64], value: &T) {
    if let Ok(piece) = postcard::to_stdvec(value) {
        progress.keep(place, &piece);
    }
}
