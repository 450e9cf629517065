//! Help of the program: its commands in groups.

use std::any::TypeId;
use std::ffi::OsString;

use clap::{Arg, Command, CommandFactory as _, FromArgMatches as _};

use super::arguments::Arguments;
use grazemap::pipeline::Position;

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

/// An option that takes a number takes a negative one too, which is then read or refused as a
/// number.
fn with_negative_numbers(option: Arg) -> Arg {
    let numbers = [
        TypeId::of::<f64>(),
        TypeId::of::<Position>(),
        TypeId::of::<u8>(),
        TypeId::of::<u16>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
    ];
    let parsed = option.get_value_parser().type_id();
    let is_optional = option.get_num_args().is_some_and(|values| values.min_values() == 0);
    if !numbers.into_iter().any(|number| parsed == number) {
        option
    } else if is_optional {
        // NOTE: any other option that follows is no value.
        option.allow_negative_numbers(true)
    } else {
        option.allow_hyphen_values(true)
    }
}

/// The command line of the program.
pub(super) fn command() -> Command {
    let command = Arguments::command().mut_args(with_negative_numbers);
    let command = command.mut_subcommands(|command| command.mut_args(with_negative_numbers));
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
    use clap::error::ErrorKind;

    /// Names of values that are no numbers.
    const TEXTS: &str = "A,B CSV DIGITS DIR FILE FILE#N FILE|- I/N KIND,... NAME,... \
        NAME=FROM:TO,... NAME=OFFSET,... NAME=SIZE,... NAME=VALUE NAME=VALUE,... P,... P,Q \
        P=5%,... P=FROM:TO,... P=OFFSET,... P=SIZE,... P[,Q] WHAT WxH [P,]Q";

    #[test]
    fn every_option_that_takes_a_number_takes_a_negative_one() {
        let mut numbers = 0;
        for command in command().get_subcommands() {
            for option in command.get_arguments().filter(|option| option.get_long().is_some()) {
                let name = option.get_long().unwrap_or_default();
                let values = option.get_value_names().unwrap_or_default();
                let takes_text =
                    values.iter().any(|value| TEXTS.split(' ').any(|text| text == value.as_str()));
                let is_word = !option.get_possible_values().is_empty();
                let names_parameter = matches!(name, "along" | "with");
                let takes_value = option.get_action().takes_values();
                if !takes_value || takes_text || is_word || names_parameter {
                    continue;
                }
                let spelled = format!("--{name}");
                let is_optional = option.get_num_args().is_some_and(|of| of.min_values() == 0);
                let number = if is_optional { "-1" } else { "-1e-5" };
                let called = ["grazemap", command.get_name(), &spelled, number];
                let refusal = super::command().try_get_matches_from(called).err();
                let kind = refusal.map(|refusal| refusal.kind());
                assert_ne!(kind, Some(ErrorKind::UnknownArgument), "{called:?}");
                numbers += 1;
            }
        }
        assert!(numbers > 50, "{numbers}");
    }

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
