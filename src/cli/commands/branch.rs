//! `grazemap branch`: branches of periodic orbits in one parameter.

use super::sweeps::answered;
use super::{map, open, shard};
use crate::cli::arguments::BranchArguments;
use crate::cli::output::CliError;
use grazemap::analysis::Joining;
use grazemap::pipeline::BranchKeys;
use grazemap::report::to_json;

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
        starts: options.start.clone(),
        observe: options.observe.iter().map(|&option| option.into()).collect(),
        iterates: outlets.output.is_some() || options.sharding.share.is_some(),
    };
    if let Some(share) = options.sharding.share {
        let asked = to_json(&keys)?;
        return shard(share, ("branch", &map, &asked), outlets, |shard| keys.share(&map, shard));
    }
    let pieces = options.scene.common.pieces();
    answered(&keys, "branch", &map, outlets, |bar| keys.answer(&map, &Joining::new(bar, pieces)))
}
