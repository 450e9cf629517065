//! `grazemap loci`: saddle-nodes, flips, Neimark–Sacker points and grazes in two parameters.

use super::sweeps::answered;
use super::{map, open};
use crate::cli::arguments::LociArguments;
use crate::cli::output::CliError;
use grazemap::pipeline::LociKeys;

pub(in crate::cli) fn run(options: &LociArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let keys = LociKeys {
        plane: options.plane.clone(),
        from: options.stretch.from,
        to: options.stretch.to,
        at: options.stretch.at.clone().unwrap_or_default(),
        kind: options.kind.iter().map(|&kind| kind.into()).collect(),
        itineraries: options.which.itinerary.clone(),
        using: options.which.using.into(),
        chart: outlets.output.is_some(),
    };
    answered(&keys, "loci", &map, outlets, |bar| keys.answer(&map, bar))
}
