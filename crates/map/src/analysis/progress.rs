//! Progress of long computations, and their finished pieces, from which a later run can resume, on
//! this machine or on several.
//!
//! A computation can be divided into shares. Each share computes pieces that the whole computation
//! would compute too. Joining runs the whole computation with the pieces of all shares: it recalls
//! them in place of computing them, and computes the pieces that no share could, because they
//! depend on the results of several shares.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::iteration::parallel::locked;
use crate::model::Digest;

/// Receives the progress of a computation; called from any thread.
pub trait Progress: Sync {
    /// Announces `total` more units of work.
    fn expect(&self, total: u64);

    /// Reports that `units` of work are done.
    fn advance(&self, units: u64);

    /// Returns the piece at a place of this computation, if an earlier run kept it.
    fn recall(&self, _place: &[u64]) -> Option<Vec<u8>> {
        None
    }

    /// Keeps a finished piece for a later run.
    fn keep(&self, _place: &[u64], _piece: &[u8]) {}
}

impl fmt::Debug for dyn Progress + '_ {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Progress")
    }
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn expect(&self, _total: u64) {}
    fn advance(&self, _units: u64) {}
}

/// A part of a computation: its number is put before the places of its pieces.
pub struct SubProgress<'a> {
    whole: &'a dyn Progress,
    number: u64,
}

impl<'a> SubProgress<'a> {
    /// Part `number` of a computation.
    pub fn new(whole: &'a dyn Progress, number: usize) -> Self {
        Self { whole, number: number as u64 }
    }

    fn place(&self, place: &[u64]) -> Vec<u64> {
        [&[self.number], place].concat()
    }
}

impl Progress for SubProgress<'_> {
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

/// Units of one piece of a computation: a bar of one piece moves by a thousandth.
const UNITS: u64 = 1000;

/// A part of a computation that counts as a fixed number of units of the whole, which
/// [`announce`](Self::announce) tells the whole of. Its own units are of any kind and number:
/// returns, boxes, or work.
///
/// When it is dropped, all its units are done.
#[derive(Debug)]
pub struct PartProgress<'a> {
    whole: &'a dyn Progress,
    /// Units of the whole.
    units: u64,
    /// Own units, of any kind.
    own: Mutex<OwnUnits>,
}

/// Units of a part, and the units of the whole that they have come to.
#[derive(Debug, Default)]
struct OwnUnits {
    expected: u64,
    done: u64,
    /// Units of the whole that are done.
    told: u64,
}

impl<'a> PartProgress<'a> {
    /// Announces the units of some pieces, such as values, cells or states, to the whole.
    pub fn announce(whole: &dyn Progress, pieces: usize) {
        whole.expect(pieces as u64 * UNITS);
    }

    /// Part of some pieces of the whole.
    pub fn new(whole: &'a dyn Progress, pieces: usize) -> Self {
        Self { whole, units: pieces as u64 * UNITS, own: Mutex::default() }
    }

    /// Reports the share that is done, from 0 to 1. A share below an earlier one is ignored.
    pub fn reach(&self, share: f64) {
        self.tell(&mut locked(&self.own), share);
    }

    fn tell(&self, own: &mut OwnUnits, share: f64) {
        let reached = ((self.units as f64 * share) as u64).clamp(own.told, self.units);
        if reached > own.told {
            self.whole.advance(reached - own.told);
            own.told = reached;
        }
    }
}

impl Progress for PartProgress<'_> {
    fn expect(&self, total: u64) {
        locked(&self.own).expected += total;
    }

    fn advance(&self, units: u64) {
        let own = &mut locked(&self.own);
        own.done += units;
        let share = own.done as f64 / own.expected.max(1) as f64;
        self.tell(own, share);
    }

    fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        self.whole.recall(place)
    }

    fn keep(&self, place: &[u64], piece: &[u8]) {
        self.whole.keep(place, piece);
    }
}

impl Drop for PartProgress<'_> {
    fn drop(&mut self) {
        self.reach(1.0);
    }
}

/// Value kept by an earlier run at a place, to the last bit. `None` if there is none or if it does
/// not fit the computation: pieces come from files and are not trusted.
pub(crate) fn recalled<T: DeserializeOwned>(
    progress: &(impl Progress + ?Sized),
    place: &[u64],
    fits: impl FnOnce(&T) -> bool,
) -> Option<T> {
    postcard::from_bytes(&progress.recall(place)?).ok().filter(fits)
}

/// Recalls the value at a place, or computes and keeps it.
pub(crate) fn resumed<T: Serialize + DeserializeOwned>(
    progress: &(impl Progress + ?Sized),
    place: &[u64],
    compute: impl FnOnce() -> T,
) -> T {
    resumed_if(progress, place, |_| true, compute)
}

/// Recalls the value at a place if it fits the computation, or computes and keeps it.
pub(crate) fn resumed_if<T: Serialize + DeserializeOwned>(
    progress: &(impl Progress + ?Sized),
    place: &[u64],
    fits: impl FnOnce(&T) -> bool,
    compute: impl FnOnce() -> T,
) -> T {
    recalled(progress, place, fits).unwrap_or_else(|| {
        let value = compute();
        keep(progress, place, &value);
        value
    })
}

/// Place of a piece, made of `number` and a digest of the values that determine the piece: for
/// pieces whose count is not known beforehand.
pub(crate) fn place_of(number: u64, decisive: &impl Serialize) -> [u64; 2] {
    let bytes = postcard::to_stdvec(decisive).unwrap_or_default();
    [number, Digest::of_bytes(&bytes).0]
}

/// Count of iterates that no piece of a computation reaches; the sum of such counts is a number.
pub(super) const MOST_ITERATES: u64 = 1 << 44;

/// Keeps a value for a later run.
pub(crate) fn keep<T: Serialize>(progress: &(impl Progress + ?Sized), place: &[u64], value: &T) {
    if let Ok(piece) = postcard::to_stdvec(value) {
        progress.keep(place, &piece);
    }
}

/// Pieces by their place.
pub type Pieces = BTreeMap<Vec<u64>, Vec<u8>>;

/// One of `of` shares of a computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Index, from 0.
    index: usize,
    of: usize,
}

impl Share {
    /// Share `number` of `of`, counted from 1; `None` if there is no such share.
    pub fn new(number: usize, of: usize) -> Option<Self> {
        (1..=of).contains(&number).then(|| Self { index: number - 1, of })
    }

    /// Number of the share, from 1.
    pub fn number(self) -> usize {
        self.index + 1
    }

    /// Number of shares.
    pub fn of(self) -> usize {
        self.of
    }

    /// Range of this share among `count` consecutive items.
    pub(super) fn range(self, count: usize) -> Range<usize> {
        let cut = |index: usize| (index as u128 * count as u128 / self.of as u128) as usize;
        cut(self.index)..cut(self.index + 1)
    }

    /// Whether an item belongs to this share, where items are dealt out in turn.
    pub fn takes(self, number: usize) -> bool {
        number % self.of == self.index
    }
}

/// Collects the pieces that are kept.
#[derive(Debug, Default)]
pub struct Gathered(Mutex<Pieces>);

impl Gathered {
    /// All pieces collected.
    pub fn into_pieces(self) -> Pieces {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Gathered {
    fn expect(&self, _total: u64) {}
    fn advance(&self, _units: u64) {}

    fn keep(&self, place: &[u64], piece: &[u8]) {
        let mut pieces = locked(&self.0);
        pieces.insert(place.to_vec(), piece.to_vec());
    }
}

/// A share under way: its progress, the pieces kept by an interrupted run of it, and the receiver
/// of its pieces.
///
/// As a [`Progress`] it passes every piece that is kept or recalled to the receiver.
#[derive(Clone, Copy)]
pub struct Shard<'a> {
    pub(super) share: Share,
    /// Progress of this share alone, with the pieces it keeps for itself.
    pub(super) own: &'a dyn Progress,
    joined: &'a dyn Progress,
}

impl<'a> Shard<'a> {
    /// A share that passes its pieces to `joined`.
    pub fn new(share: Share, own: &'a dyn Progress, joined: &'a Gathered) -> Self {
        Self { share, own, joined }
    }

    /// Runs the share of part `number` of the computation.
    pub fn part<T>(&self, number: usize, work: impl FnOnce(&Shard<'_>) -> T) -> T {
        let (own, joined) =
            (SubProgress::new(self.own, number), SubProgress::new(self.joined, number));
        work(&Shard { share: self.share, own: &own, joined: &joined })
    }

    /// Items of this share, where items are dealt out in turn.
    pub(super) fn own_of<'t, T>(&self, things: &'t [T]) -> Vec<&'t T> {
        let own = things.iter().enumerate().filter(|(number, _)| self.share.takes(*number));
        own.map(|(_, thing)| thing).collect()
    }

    /// Passes on a result of the whole share.
    pub(super) fn give<T: Serialize>(&self, found: &T) {
        keep(self.joined, &place(self.share.index), found);
    }
}

impl Progress for Shard<'_> {
    fn expect(&self, total: u64) {
        self.own.expect(total);
    }

    fn advance(&self, units: u64) {
        self.own.advance(units);
    }

    fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        let piece = self.own.recall(place)?;
        self.joined.keep(place, &piece);
        Some(piece)
    }

    fn keep(&self, place: &[u64], piece: &[u8]) {
        self.own.keep(place, piece);
        self.joined.keep(place, piece);
    }
}

/// Place of the result of a whole share: no round of a computation has this number.
fn place(index: usize) -> [u64; 2] {
    [u64::MAX, index as u64]
}

/// Results of whole shares in order, up to the first that is missing.
pub(super) fn given<T: DeserializeOwned>(progress: &dyn Progress) -> impl Iterator<Item = T> {
    (0..).map_while(|index| recalled(progress, &place(index), |_| true))
}

/// A computation that starts with the pieces of shares.
pub struct Joining<'a> {
    progress: &'a dyn Progress,
    pieces: Mutex<Pieces>,
}

impl<'a> Joining<'a> {
    /// A computation with the pieces of all shares.
    pub fn new(progress: &'a dyn Progress, pieces: Pieces) -> Self {
        Self { progress, pieces: Mutex::new(pieces) }
    }
}

impl Progress for Joining<'_> {
    fn expect(&self, total: u64) {
        self.progress.expect(total);
    }

    fn advance(&self, units: u64) {
        self.progress.advance(units);
    }

    fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        let piece = locked(&self.pieces).remove(place);
        piece.or_else(|| self.progress.recall(place))
    }

    fn keep(&self, place: &[u64], piece: &[u8]) {
        self.progress.keep(place, piece);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    /// Units announced and done.
    #[derive(Default)]
    struct Counted([AtomicU64; 2]);

    impl Progress for Counted {
        fn expect(&self, total: u64) {
            self.0[0].fetch_add(total, Ordering::Relaxed);
        }

        fn advance(&self, units: u64) {
            self.0[1].fetch_add(units, Ordering::Relaxed);
        }
    }

    #[test]
    fn a_part_is_told_in_units_of_the_whole_that_only_grow_and_end_complete() {
        let whole = Counted::default();
        let done = || whole.0[1].load(Ordering::Relaxed);
        PartProgress::announce(&whole, 3);
        let expected = whole.0[0].load(Ordering::Relaxed);
        assert_eq!(expected, 3 * UNITS);
        let part = PartProgress::new(&whole, 1);
        part.expect(7_500_000);
        part.advance(750_000);
        assert_eq!(done(), UNITS / 10);
        // Work that was not foreseen does not take back what was told.
        part.expect(7_500_000);
        part.advance(750_000);
        assert_eq!(done(), UNITS / 10);
        part.advance(1_500_000);
        assert_eq!(done(), UNITS / 5);
        part.reach(0.1);
        assert_eq!(done(), UNITS / 5);
        // More than was announced is no more than the whole part.
        part.advance(30_000_000);
        assert_eq!(done(), UNITS);
        drop(part);
        assert_eq!(done(), UNITS);
        drop(PartProgress::new(&whole, 2));
        assert_eq!(done(), expected);
        assert_eq!(whole.0[0].load(Ordering::Relaxed), expected);
    }

    #[test]
    fn shares_part_what_there_is() {
        assert_eq!(Share::new(0, 3), None);
        assert_eq!(Share::new(4, 3), None);
        for (count, of) in [(16, 3), (2, 7), (0, 2), (64, 7)] {
            let shares: Vec<Share> = (1..=of).filter_map(|number| Share::new(number, of)).collect();
            let parts: Vec<usize> = shares.iter().flat_map(|share| share.range(count)).collect();
            assert_eq!(parts, Vec::from_iter(0..count));
            for number in 0..count {
                assert_eq!(shares.iter().filter(|share| share.takes(number)).count(), 1);
            }
        }
    }
}
