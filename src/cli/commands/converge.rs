//! `grazemap converge`: truncation orders against direct simulation; speed against accuracy.

use super::{open, settle};
use crate::cli::arguments::ConvergeOptions;
use crate::cli::output::{Bar, CliError, deliver};
use crate::cli::resume::Resumable;
use grazemap::pipeline::ConvergenceKeys;

pub(in crate::cli) fn run(options: &ConvergeOptions) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let settled = settle(open(&options.scene)?, outlets.quiet)?;
    let keys = ConvergenceKeys { fresh: options.fresh };
    let decisive = [&*settled.graze().to_json()?, &options.fresh.to_string()];
    let resumable = Resumable::begin("converge", outlets.folder(), &decisive, outlets.quiet);
    let bar = Bar::new("convergence", outlets.quiet).resuming(0, resumable.journal());
    let answer = keys.answer(&settled, &bar)?;
    drop(bar);
    deliver(answer, "converge", outlets)?;
    resumable.finish();
    Ok(())
}
