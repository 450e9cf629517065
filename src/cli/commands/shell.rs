//! `grazemap completions` and `grazemap man`: what a shell and `man` know of the program.

use clap::CommandFactory;

use crate::cli::arguments::{Arguments, CompletionsOptions, ManOptions};
use crate::cli::output::{CliError, print};
use grazemap::report::OutputFolder;

/// The completions of a shell, on standard output.
pub(in crate::cli) fn completions(options: &CompletionsOptions) -> Result<(), CliError> {
    let mut text = Vec::new();
    clap_complete::generate(options.shell, &mut Arguments::command(), "grazemap", &mut text);
    print(&String::from_utf8_lossy(&text))
}

/// The manual in a folder: a page of the program and one of each command.
pub(in crate::cli) fn man(options: &ManOptions) -> Result<(), CliError> {
    let folder = OutputFolder::create(&options.output)?;
    let mut program = Arguments::command().disable_help_subcommand(true);
    program.build();
    let commands: Vec<_> = program.get_subcommands().cloned().collect();
    for command in commands.into_iter().chain([program]) {
        let page = clap_mangen::Man::new(command);
        let mut text = Vec::new();
        page.render(&mut text).map_err(CliError::StandardOutput)?;
        folder.write(&page.get_filename(), text)?;
    }
    Ok(())
}
