//! Where results go: files that are whole or absent, or standard output; errors, notes and progress
//! on standard error.

mod error;

use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

pub(super) use error::CliError;
use grazemap::analysis::Progress;
use grazemap::report::{OutputFolder, write_atomically};

/// Where the results of a command go.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct Outlets {
    /// Write the results as JSON to a file, or to standard output (`-`)
    #[arg(long, value_name = "FILE|-", value_parser = Destination::parse)]
    pub(in crate::cli) json: Option<Destination>,
    /// Write the results' table as CSV to a file, or to standard output (`-`)
    #[arg(long, value_name = "FILE|-", value_parser = Destination::parse)]
    pub(in crate::cli) csv: Option<Destination>,
    /// Write the results' files into this folder
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(in crate::cli) output: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short = 'q', long = "quiet")]
    pub(in crate::cli) quiet: bool,
}

/// Where `--json` and `--csv` write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) enum Destination {
    /// Standard output.
    Standard,
    /// A file.
    File(PathBuf),
}

impl fmt::Display for Destination {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Standard => formatter.write_str("standard output"),
            Self::File(path) => write!(formatter, "{}", path.display()),
        }
    }
}

impl Destination {
    /// `-` is standard output, anything else a file.
    pub(in crate::cli) fn parse(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("expected a file name, or - for standard output".to_owned()),
            "-" => Ok(Self::Standard),
            name => Ok(Self::File(PathBuf::from(name))),
        }
    }

    /// Writes the whole content.
    fn write(&self, content: &str) -> Result<(), CliError> {
        match self {
            Self::Standard => print(content),
            Self::File(path) => Ok(write_atomically(path, content.as_bytes())?),
        }
    }
}

/// The results of one command, in the forms a user can ask for.
#[derive(Debug, Default)]
pub(in crate::cli) struct Results {
    /// For people, on standard output.
    pub(in crate::cli) text: String,
    /// For programs.
    pub(in crate::cli) json: String,
    /// The table, where the command has one.
    pub(in crate::cli) csv: Option<String>,
    /// Files for `-o DIR`, by name.
    pub(in crate::cli) files: Vec<(String, Vec<u8>)>,
}

impl Results {
    /// Results that are `{stem}.json` and, where there is a table, `{stem}.csv` in a folder.
    pub(in crate::cli) fn named(
        stem: &str,
        text: String,
        json: String,
        csv: Option<String>,
    ) -> Self {
        let mut files = vec![(format!("{stem}.json"), json.clone().into_bytes())];
        files.extend(csv.iter().map(|csv| (format!("{stem}.csv"), csv.clone().into_bytes())));
        Self { text, json, csv, files }
    }

    /// Writes what the options ask for; the text is shown unless standard output carries data or
    /// `-q` is given.
    pub(in crate::cli) fn deliver(
        &self,
        command: &'static str,
        outlets: &Outlets,
    ) -> Result<(), CliError> {
        let mut shown = !outlets.quiet;
        if let Some(folder) = &outlets.output {
            OutputFolder::create(folder)?.write_all(pairs(&self.files))?;
        }
        if let Some(destination) = &outlets.json {
            destination.write(&self.json)?;
            shown &= *destination != Destination::Standard;
        }
        if let Some(destination) = &outlets.csv {
            let csv = self.csv.as_ref().ok_or(CliError::NoTable { command })?;
            destination.write(csv)?;
            shown &= *destination != Destination::Standard;
        }
        if shown { print(&self.text) } else { Ok(()) }
    }
}

/// Files by name, as a folder takes them.
pub(in crate::cli) fn pairs(
    files: &[(String, Vec<u8>)],
) -> impl Iterator<Item = (&String, &Vec<u8>)> {
    files.iter().map(|(name, bytes)| (name, bytes))
}

/// The file name, without its ending, of one of several results, counted from 0.
pub(in crate::cli) fn stem(name: &str, number: usize, count: usize) -> String {
    match count {
        1 => name.to_owned(),
        _ => format!("{name}-{}", number + 1),
    }
}

/// A number of things, in words: `1 file`, `2 files`.
pub(in crate::cli) fn counted(count: usize, thing: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {thing}{plural}")
}

/// Writes to standard output; a reader that has gone away is no fault.
pub(in crate::cli) fn print(text: &str) -> Result<(), CliError> {
    let mut standard = io::stdout().lock();
    match standard.write_all(text.as_bytes()).and_then(|()| standard.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(CliError::StandardOutput(error))
        }
        _ => Ok(()),
    }
}

/// Writes a line for people to standard error, whatever becomes of it.
pub(in crate::cli) fn note(text: &str) {
    let _lost_where_nobody_listens = writeln!(io::stderr(), "{text}");
}

/// A bar on standard error, where that is a terminal.
#[derive(Debug)]
pub(in crate::cli) struct Bar(ProgressBar);

impl Bar {
    /// A bar of no length yet, under this heading; none where all is to be quiet.
    pub(in crate::cli) fn new(heading: &'static str, quiet: bool) -> Self {
        if quiet || !io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new(0);
        if let Ok(style) = ProgressStyle::with_template("{msg:>14} {bar:40} {pos}/{len} {eta}") {
            bar.set_style(style);
        }
        bar.set_message(heading);
        Self(bar)
    }
}

impl Progress for Bar {
    fn expect(&self, total: u64) {
        self.0.inc_length(total);
    }

    fn advance(&self, units: u64) {
        self.0.inc(units);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
