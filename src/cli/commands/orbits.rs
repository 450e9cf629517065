//! `grazemap orbits`: periodic orbits by itinerary, their stability, folds and flips.

use super::{map, open};
use crate::cli::arguments::OrbitsArguments;
use crate::cli::output::{Bar, CliError, deliver};
use grazemap::analysis::orbits::BifurcationKind;
use grazemap::pipeline::OrbitsKeys;

pub(in crate::cli) fn run(options: &OrbitsArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let kinds = [(options.fold, BifurcationKind::Fold), (options.flip, BifurcationKind::Flip)];
    let kinds = kinds.into_iter().filter(|(asked, _)| *asked);
    let keys = OrbitsKeys {
        at: options.at.clone(),
        period: options.period,
        itineraries: options.which.itinerary.clone(),
        using: options.which.using.into(),
        kind: kinds.map(|(_, kind)| kind).collect(),
        plane: options.plane.clone(),
        from: options.from,
        to: options.to,
        points: options.points,
    };
    let answer = keys.answer(&map, &Bar::new("orbits", outlets.quiet))?;
    deliver(answer, "orbits", outlets)
}
