//! `grazemap new`: a scene from the catalogue to start from.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::arguments::NewOptions;
use super::error::CliError;
use super::output::{note, print};
use super::prepare::nearest_scene;
use grazemap::model::catalogue;
use grazemap::report::write_atomically;

pub(super) fn run(options: &NewOptions) -> Result<(), CliError> {
    match &options.name {
        Some(name) if !options.list => write(name, options),
        _ => print(&list()),
    }
}

/// The catalogue, one scene a line.
fn list() -> String {
    let width = catalogue::names().map(str::len).max().unwrap_or(0);
    catalogue::names().fold(String::new(), |mut text, name| {
        let summary = catalogue::summary(name).unwrap_or_default();
        let _infallible = writeln!(text, "{name:width$}  {summary}");
        text
    })
}

fn write(name: &str, options: &NewOptions) -> Result<(), CliError> {
    let text = catalogue::text(name).ok_or_else(|| CliError::NotInCatalogue {
        name: name.to_owned(),
        nearest: nearest_scene(name),
    })?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    if path.symlink_metadata().is_ok() {
        return Err(CliError::Exists { path });
    }
    write_atomically(&path, text.as_bytes())?;
    if !options.quiet {
        let path = path.display();
        note(&format!(
            "wrote {path}; edit it, then: grazemap check {path}"
        ));
    }
    Ok(())
}
