//! Progress on standard error, where that is a terminal.

use std::io::{self, IsTerminal};

use indicatif::{ProgressBar, ProgressStyle};

use super::arguments::Common;
use grazemap::analysis::Progress;

/// A bar on a terminal; nothing elsewhere or with `-q`.
#[derive(Debug)]
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// A bar of no length yet, under this heading.
    pub(super) fn new(heading: &'static str, common: &Common) -> Self {
        if common.quiet || !io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new(0);
        if let Ok(style) = ProgressStyle::with_template("{msg:>14} {bar:40} {pos}/{len} {eta}") {
            bar.set_style(style);
        }
        bar.set_message(heading);
        Self(bar)
    }
}

impl Progress for Bar {
    fn expect(&self, total: u64) {
        self.0.inc_length(total);
    }

    fn advance(&self, units: u64) {
        self.0.inc(units);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
