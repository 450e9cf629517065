//! `grazemap branch`: branches of periodic orbits in one parameter.

use super::sweeps::answered;
use super::{map, open};
use crate::cli::arguments::BranchArguments;
use crate::cli::output::CliError;
use grazemap::pipeline::BranchKeys;

pub(in crate::cli) fn run(options: &BranchArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let keys = BranchKeys {
        along: options.along.clone(),
        from: options.stretch.from,
        to: options.stretch.to,
        at: options.stretch.at.clone().unwrap_or_default(),
        itineraries: options.which.itinerary.clone(),
        period: options.period,
        using: options.which.using.into(),
        observe: options.observe.iter().map(|&option| option.into()).collect(),
        iterates: outlets.output.is_some(),
    };
    answered(&keys, "branch", &map, outlets, |bar| keys.answer(&map, bar))
}
