//! `grazemap atlas`: a map of a whole region about the grazing orbit.

use super::open;
use crate::cli::arguments::AtlasArguments;
use crate::cli::output::{Bar, CliError, deliver};
use crate::cli::positions::{Finite, Origin};
use grazemap::pipeline::{AtlasFile, AtlasKeys};

pub(in crate::cli) fn run(options: &AtlasArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let source = open(&options.scene)?;
    let saved = options.load.as_ref().map(|path| AtlasFile::read(path, source.scene()));
    let saved = saved.transpose()?;
    let graze = source.graze()?;
    let mut keys = AtlasKeys {
        phase: options.phase.map(|Finite(phase)| phase),
        tolerance: options.tolerance.map_or(AtlasKeys::TOLERANCE, |Finite(tolerance)| tolerance),
        order: options.order.unwrap_or(AtlasKeys::ORDER),
        depth: options.depth.unwrap_or(AtlasKeys::DEPTH),
        boxes: options.boxes,
        points: options.points,
        plane: outlets.output.is_some(),
        ..AtlasKeys::default()
    };
    let origin = Origin::new(&graze, options.counting);
    keys.at = origin.named(options.at.as_ref());
    if let Some(ranges) = &options.range {
        keys.range = ranges.offsets(&origin.with_coordinates(keys.origin(&graze)?));
    }
    let bar = Bar::new("atlas", outlets.quiet);
    let (answer, file) = keys.measured(&graze, saved.as_ref(), &bar)?;
    drop(bar);
    if let Some(path) = &options.save {
        file.write(path)?;
    }
    deliver(answer, "atlas", outlets)
}
