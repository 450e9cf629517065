//! `grazemap atlas`: a map of a whole region about the grazing orbit.

use super::open;
use crate::cli::arguments::AtlasArguments;
use crate::cli::output::{Bar, CliError, deliver};
use grazemap::pipeline::{AtlasFile, AtlasKeys};

pub(in crate::cli) fn run(options: &AtlasArguments) -> Result<(), CliError> {
    let AtlasArguments { scene, keys, save, load } = options;
    let outlets = &scene.common.outlets;
    let source = open(scene)?;
    let saved = load.as_ref().map(|path| AtlasFile::read(path, source.scene())).transpose()?;
    let graze = source.graze()?;
    let keys = AtlasKeys { plane: outlets.output.is_some(), ..keys.clone() };
    let bar = Bar::new("atlas", outlets.quiet);
    let (mut answer, file) = keys.measured(&graze, saved.as_ref(), &bar)?;
    drop(bar);
    if let Some(path) = save {
        file.write(path)?;
    }
    deliver(&mut answer, outlets)
}
