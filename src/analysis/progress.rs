//! Progress reports of long computations.

/// Receives the progress of a computation; called from any thread.
pub trait Progress: Sync {
    /// `total` more units of work are to come.
    fn expect(&self, total: u64);

    /// `units` of work are done.
    fn advance(&self, units: u64);
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn expect(&self, _total: u64) {}
    fn advance(&self, _units: u64) {}
}
