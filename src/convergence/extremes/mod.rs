//! Maps at the ends of what can be asked: what is accurate, what is refused, what is promised.
//!
//! One idea: every expansion comes with an estimate of what it is worth, the smaller of what its
//! truncation leaves out and what rounding took ([`WindowEdge`](crate::expansion::WindowEdge),
//! [`LostDigits`](crate::expansion::LostDigits)); a case whose measured digits fall short of it is
//! a silent loss. See docs/studies/extremes.md.

mod cases;
mod closed_form;
mod data;
mod measure;

pub use cases::{ExtremeCase, extreme_cases};
pub use data::{Coefficients, ExtremeAxis, ExtremeOutcome, ExtremeRow, ExtremesStudy, Measured};
pub use measure::measure_extreme;

use rayon::prelude::*;

use crate::analysis::Progress;

/// Measures cases side by side; the rows keep their order.
pub fn extremes(cases: &[ExtremeCase], progress: &dyn Progress) -> ExtremesStudy {
    progress.expect(cases.len() as u64);
    let measure = |case| {
        let row = measure_extreme(case);
        progress.advance(1);
        row
    };
    ExtremesStudy {
        rows: cases.par_iter().map(measure).collect(),
    }
}
