//! Where results go: files that are whole or absent, or standard output.

use std::fmt;
use std::io::{self, Write};
use std::path::PathBuf;

use super::arguments::Common;
use super::error::CliError;
use grazemap::report::{OutputFolder, write_atomically};

/// Where `--json` and `--csv` write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Destination {
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
    pub(super) fn parse(text: &str) -> Result<Self, String> {
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
pub(super) struct Results {
    /// For people, on standard output.
    pub(super) text: String,
    /// For programs.
    pub(super) json: String,
    /// The table, where the command has one.
    pub(super) csv: Option<String>,
    /// Files for `-o DIR`, by name.
    pub(super) files: Vec<(String, Vec<u8>)>,
}

impl Results {
    /// Results that are `{stem}.json` and, where there is a table, `{stem}.csv` in a folder.
    pub(super) fn named(stem: &str, text: String, json: String, csv: Option<String>) -> Self {
        let mut files = vec![(format!("{stem}.json"), json.clone().into_bytes())];
        files.extend(
            csv.iter()
                .map(|csv| (format!("{stem}.csv"), csv.clone().into_bytes())),
        );
        Self {
            text,
            json,
            csv,
            files,
        }
    }

    /// Writes what the options ask for; the text is shown unless standard output carries data or
    /// `-q` is given.
    pub(super) fn deliver(&self, command: &'static str, common: &Common) -> Result<(), CliError> {
        let mut shown = !common.quiet;
        if let Some(folder) = &common.output {
            let folder = OutputFolder::create(folder)?;
            for (name, bytes) in &self.files {
                folder.write(name, bytes)?;
            }
        }
        if let Some(destination) = &common.json {
            destination.write(&self.json)?;
            shown &= *destination != Destination::Standard;
        }
        if let Some(destination) = &common.csv {
            let csv = self.csv.as_ref().ok_or(CliError::NoTable { command })?;
            destination.write(csv)?;
            shown &= *destination != Destination::Standard;
        }
        if shown { print(&self.text) } else { Ok(()) }
    }
}

/// The file name, without its ending, of one of several results, counted from 0.
pub(super) fn stem(name: &str, number: usize, count: usize) -> String {
    match count {
        1 => name.to_owned(),
        _ => format!("{name}-{}", number + 1),
    }
}

/// A number of things, in words: `1 file`, `2 files`.
pub(super) fn counted(count: usize, thing: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {thing}{plural}")
}

/// Writes to standard output; a reader that has gone away is no fault.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    let mut standard = io::stdout().lock();
    match standard
        .write_all(text.as_bytes())
        .and_then(|()| standard.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(CliError::StandardOutput(error))
        }
        _ => Ok(()),
    }
}

/// Writes a line for people to standard error, whatever becomes of it.
pub(super) fn note(text: &str) {
    let _lost_where_nobody_listens = writeln!(io::stderr(), "{text}");
}
