//! Help of the program: its commands in groups.

use clap::{Command, CommandFactory as _, FromArgMatches as _};
use std::ffi::OsString;

use super::arguments::Arguments;

/// Groups of commands, in the order in which they are shown.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Scenes", &["new", "check", "demo", "run", "view"]),
    (
        "Grazing orbits and maps",
        &["locate", "safe", "contact", "curve", "expand", "converge", "emit", "image"],
    ),
    ("Dynamics", &["diagram", "chart", "basin", "trajectory", "derivatives", "atlas", "noise"]),
    ("Periodic orbits and bifurcations", &["orbits", "branch", "loci"]),
    ("Measured data, published figures, clusters", &["fit", "gallery", "merge"]),
    ("Program", &["completions", "man", "help"]),
];

/// Layout of the help of the program.
const TEMPLATE: &str =
    "{about-with-newline}\n{usage-heading} grazemap COMMAND [OPTIONS]{after-help}";

/// Columns that the name of a command takes.
const WIDTH: usize = 14;

/// The command line of the program.
pub(super) fn command() -> Command {
    let command = Arguments::command();
    let groups = GROUPS.map(|(heading, names)| {
        let about = |name: &str| {
            let found = command.find_subcommand(name).and_then(Command::get_about);
            found.map_or_else(|| "Print the help of a command".to_owned(), ToString::to_string)
        };
        let lines = names.iter().map(|name| format!("  {name:<WIDTH$}{}\n", about(name)));
        format!("{heading}:\n{}", lines.collect::<String>())
    });
    let options = "Options:\n  -h, --help      Print help\n  -V, --version   Print the version\n\n\
                   `grazemap help COMMAND` describes the options of a command.";
    command.help_template(TEMPLATE).after_help(format!("{}\n{options}", groups.join("\n")))
}

/// The help of the program, as `grazemap --help` prints it.
pub(super) fn help() -> String {
    command().render_help().to_string()
}

/// Parses what was typed.
///
/// # Errors
///
/// An error of clap for wrong arguments; `--help` and `--version` arrive as errors too.
pub(super) fn parse(typed: impl IntoIterator<Item = OsString>) -> Result<Arguments, clap::Error> {
    let matches = command().try_get_matches_from(typed)?;
    Arguments::from_arg_matches(&matches)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_stands_in_one_group() {
        let mut listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        listed.retain(|name| *name != "help");
        listed.sort_unstable();
        let command = Arguments::command();
        let mut known: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
        known.sort_unstable();
        assert_eq!(listed, known);
    }
}
