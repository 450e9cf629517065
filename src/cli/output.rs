//! Output of commands: results in files that are written atomically, or on standard output; errors,
//! notes and progress on standard error; errors of commands with their exit codes.

use std::cell::RefCell;
use std::fmt;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use etcetera::{BaseStrategy, choose_base_strategy};
use indicatif::{ProgressBar, ProgressStyle};
use miette::{GraphicalReportHandler, GraphicalTheme};

use grazemap::Error;
use grazemap::analysis::Progress;
use grazemap::model::SceneHeadline;
use grazemap::numeric::INSTRUCTION_LIMIT;
use grazemap::pipeline::{Extent, Results, refuse_memory};
use grazemap::report::{
    Journal, OutputFolder, PictureForm, ReportError, ShardError, check_creatable, check_writable,
    replaced_path, write_streamed,
};

/// Destinations of a command's results.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct Outlets {
    /// Write the results as JSON to a file, or to standard output (`-`)
    #[arg(long, value_name = "FILE|-", value_parser = Destination::parse)]
    pub(in crate::cli) json: Option<Destination>,
    /// Write the table of results as CSV to a file, or to standard output (`-`)
    #[arg(long, value_name = "FILE|-", value_parser = Destination::parse)]
    pub(in crate::cli) csv: Option<Destination>,
    /// Write all result files into this folder
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(in crate::cli) output: Option<PathBuf>,
    #[command(flatten)]
    pub(in crate::cli) pictures: PictureOptions,
    /// Print errors only
    #[arg(short = 'q', long = "quiet")]
    pub(in crate::cli) quiet: bool,
}

/// Form of the figures in the folder of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args)]
pub(in crate::cli) struct PictureOptions {
    /// Width and height of figures in millimetres, 42 to 1058 each, as 84x60
    #[arg(long, value_name = "WxH", value_parser = size_of, requires = "output")]
    pub(in crate::cli) size: Option<(u32, u32)>,
    /// Dots per inch of PNG figures. Default: 192
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(24..=1200),
        requires = "output")]
    pub(in crate::cli) dpi: Option<u32>,
    /// Write figures as PDF too
    #[arg(long, requires = "output")]
    pub(in crate::cli) pdf: bool,
}

/// Sides in CSS pixels, 96 to the inch, from `WIDTHxHEIGHT` in millimetres.
fn size_of(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| {
        let pixels = text.trim().parse::<f64>().ok()? * 96.0 / 25.4;
        (158.0..=4000.0).contains(&pixels).then(|| (pixels.round() as u32).max(160))
    };
    let sides =
        text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| {
        "expected a width and a height from 42 to 1058 millimetres, such as 84x60".to_owned()
    })
}

impl PictureOptions {
    pub(in crate::cli) fn form(self) -> PictureForm {
        let usual = PictureForm::default();
        let dots_per_inch = self.dpi.unwrap_or(usual.dots_per_inch);
        PictureForm { size: self.size, dots_per_inch, has_pdf: self.pdf }
    }
}

/// Destination of `--json` or `--csv`.
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

impl Outlets {
    /// Whether no option is given.
    pub(in crate::cli) fn are_default(&self) -> bool {
        let has_destination = self.json.is_some() || self.csv.is_some() || self.output.is_some();
        !has_destination && !self.quiet
    }
}

impl Destination {
    /// Parses a destination: `-` is standard output, anything else a file.
    pub(in crate::cli) fn parse(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("expected a file name, or - for standard output".to_owned()),
            "-" => Ok(Self::Standard),
            name => Ok(Self::File(PathBuf::from(name))),
        }
    }

    /// Writes a text.
    pub(in crate::cli) fn write(&self, text: &str) -> Result<(), CliError> {
        self.write_streamed(&|out| Ok(out.write_all(text.as_bytes())?))
    }

    /// Writes the output of `content`.
    pub(in crate::cli) fn write_streamed(&self, content: &Content<'_>) -> Result<(), CliError> {
        match self {
            Self::Standard => {
                let mut standard = Reader { out: io::stdout().lock(), gone: false };
                let mut out = BufWriter::new(&mut standard);
                content(&mut out)?;
                out.flush().map_err(CliError::StandardOutput)
            }
            Self::File(path) => Ok(write_streamed(path, content)?),
        }
    }

    /// File that is replaced, all links followed; `None` for standard output.
    fn replaced(&self) -> Option<PathBuf> {
        match self {
            Self::Standard => None,
            Self::File(path) => replaced_path(path),
        }
    }

    /// Folder of the file that is replaced. `None` for a device or a pipe: nothing else may be
    /// written beside those.
    fn folder(&self) -> Option<PathBuf> {
        let file = self.replaced().filter(|path| path.is_file() || !path.exists())?;
        file.parent().map(Path::to_path_buf)
    }
}

/// Function that writes a result.
pub(in crate::cli) type Content<'a> = dyn Fn(&mut dyn Write) -> Result<(), ReportError> + 'a;

/// Standard output. A reader that has closed its end (a broken pipe) is no error.
struct Reader {
    out: io::StdoutLock<'static>,
    gone: bool,
}

impl Write for Reader {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.gone {
            return Ok(bytes.len());
        }
        match self.out.write(bytes) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.gone = true;
                Ok(bytes.len())
            }
            other => other,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self.out.flush() {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}

impl Outlets {
    /// Folder of the results, created, with figures in the form of the options; `None` if none is
    /// asked for.
    pub(in crate::cli) fn results(&self) -> Result<Option<OutputFolder>, CliError> {
        let made = self.output.as_ref().map(OutputFolder::create).transpose()?;
        Ok(made.map(|folder| folder.with_pictures(self.pictures.form())))
    }

    /// Folder of the journal: the folder of the results, or the user's cache if no result is a
    /// file.
    pub(in crate::cli) fn folder(&self) -> Option<PathBuf> {
        let beside = self.output.clone().or_else(|| self.files().find_map(Destination::folder));
        beside.or_else(|| Some(choose_base_strategy().ok()?.cache_dir().join("grazemap")))
    }

    /// Destinations of table and document.
    fn files(&self) -> impl Iterator<Item = &Destination> {
        [&self.csv, &self.json].into_iter().flatten()
    }

    /// Refuses, before any computing, destinations that cannot be written to, two results in one
    /// file, and a result that would replace an input. `saved` is the file of `--save`, `results`
    /// are names of results in the folder of `-o`.
    pub(in crate::cli) fn check<'a>(
        &self,
        inputs: impl IntoIterator<Item = &'a Path> + Clone,
        saved: Option<&Path>,
        results: &[&str],
    ) -> Result<(), CliError> {
        let saved = saved.map(|path| Destination::File(path.to_owned()));
        let places = [("json", &self.json), ("csv", &self.csv), ("save", &saved)];
        let places = places.map(|(option, place)| place.as_ref().map(|place| (option, place)));
        let places: Vec<_> = places.into_iter().flatten().collect();
        let input_at = |file: &Path| {
            let mut inputs = inputs.clone().into_iter();
            inputs.find(|input| input.canonicalize().is_ok_and(|input| input == file))
        };
        let replaces = |path: &Path| CliError::ReplacesInput { path: path.to_path_buf() };
        for (number, (option, place)) in places.iter().enumerate() {
            let file = place.replaced();
            let is_same =
                |other: &Destination| other == *place || file.is_some() && other.replaced() == file;
            let mut earlier = places[..number].iter().filter(|(_, other)| is_same(other));
            if let Some((first, place)) = earlier.next() {
                let (options, place) = ([*first, *option], (*place).clone());
                return Err(CliError::OnePlace { options, place });
            }
            if let Some(input) = file.as_deref().and_then(input_at) {
                return Err(replaces(input));
            }
            if let Destination::File(path) = place {
                check_writable(path)?;
            }
        }
        let Some(folder) = &self.output else { return Ok(()) };
        for file in results.iter().filter_map(|name| replaced_path(&folder.join(name))) {
            if let Some(input) = input_at(&file) {
                return Err(replaces(input));
            }
            let is_there = |place: &Destination| place.replaced().as_ref() == Some(&file);
            if let Some(place) = saved.as_ref().filter(|place| is_there(place)) {
                let (options, place) = (["output", "save"], place.clone());
                return Err(CliError::OnePlace { options, place });
            }
        }
        Ok(check_creatable(folder)?)
    }

    /// Writes the JSON document where `--json` asks for it.
    pub(in crate::cli) fn write_json(&self, content: &Content<'_>) -> Result<(), CliError> {
        self.json.as_ref().map_or(Ok(()), |place| place.write_streamed(content))
    }

    /// Writes the CSV table where `--csv` asks for it.
    pub(in crate::cli) fn write_csv(&self, content: &Content<'_>) -> Result<(), CliError> {
        self.csv.as_ref().map_or(Ok(()), |place| place.write_streamed(content))
    }

    /// Prints a text for people, unless standard output carries data or `-q` is given.
    pub(in crate::cli) fn show(&self, text: &str) -> Result<(), CliError> {
        if self.shows() { print(text) } else { Ok(()) }
    }

    /// Whether texts for people go to standard output.
    pub(in crate::cli) fn shows(&self) -> bool {
        !self.quiet && !self.files().any(|place| *place == Destination::Standard)
    }
}

/// Writes the files that the options ask for, prints the text unless standard output carries data
/// or `-q` is given, then the remarks on standard error. Returns an error if the computation ended
/// without the result that was asked for.
pub(in crate::cli) fn deliver(
    results: &mut dyn Results,
    outlets: &Outlets,
) -> Result<(), CliError> {
    let (remarks, ended) = (results.remarks(), results.ended());
    if let Some(folder) = outlets.results()? {
        note_all(&results.write_files(&folder)?, outlets.quiet);
    }
    outlets.write_csv(&|out| results.rows().write_csv(out))?;
    let text = if outlets.shows() { results.text()? } else { String::new() };
    let results = RefCell::new(results);
    outlets.write_json(&|out| results.borrow_mut().write_document(Extent::Whole, out))?;
    outlets.show(&text)?;
    note_all(&remarks, outlets.quiet);
    ended.map_or(Ok(()), |ended| Err(Error::from(ended).into()))
}

/// Prints remarks to standard error, unless `quiet`.
pub(in crate::cli) fn note_all(remarks: &[String], quiet: bool) {
    remarks.iter().filter(|_| !quiet).for_each(|words| note(words));
}

/// Refuses, before any computing, results that exceed the machine's memory. Prints the size of
/// large results unless `quiet`.
pub(in crate::cli) fn refuse(bytes: u64, quiet: bool) -> Result<(), CliError> {
    note_all(&refuse_memory(bytes)?.into_iter().collect::<Vec<_>>(), quiet);
    Ok(())
}

/// Prints to standard output. A reader that has closed its end is no error.
pub(in crate::cli) fn print(text: &str) -> Result<(), CliError> {
    Destination::Standard.write(text)
}

/// Prints a line for people to standard error, and ignores failure.
pub(in crate::cli) fn note(text: &str) {
    let _lost_where_nobody_listens = writeln!(io::stderr(), "{text}");
}

/// Progress bar on standard error, shown if that is a terminal, with the journal of a computation
/// that can be resumed.
#[derive(Debug)]
pub(in crate::cli) struct Bar {
    bar: ProgressBar,
    /// Number of the computation within its command, and the journal of its pieces.
    journal: Option<(u64, Arc<Journal>)>,
}

impl Bar {
    /// Bar with this heading and length 0; hidden if `quiet`.
    pub(in crate::cli) fn new(heading: &'static str, quiet: bool) -> Self {
        if quiet || !io::stderr().is_terminal() {
            return Self { bar: ProgressBar::hidden(), journal: None };
        }
        let bar = ProgressBar::new(0);
        if let Ok(style) = ProgressStyle::with_template("{msg:>14} {bar:40} {pos}/{len} {eta}") {
            bar.set_style(style);
        }
        bar.set_message(heading);
        Self { bar, journal: None }
    }

    /// Bar for computation `number` of a command whose pieces are kept in a journal.
    pub(in crate::cli) fn resuming(mut self, number: u64, journal: Option<Arc<Journal>>) -> Self {
        self.journal = journal.map(|journal| (number, journal));
        self
    }

    fn place(number: u64, place: &[u64]) -> Vec<u64> {
        [&[number], place].concat()
    }
}

impl Progress for Bar {
    fn expect(&self, total: u64) {
        self.bar.inc_length(total);
    }

    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }

    fn recall(&self, place: &[u64]) -> Option<Vec<u8>> {
        let (number, journal) = self.journal.as_ref()?;
        journal.recall(&Self::place(*number, place))
    }

    fn keep(&self, place: &[u64], piece: &[u8]) {
        if let Some((number, journal)) = &self.journal {
            journal.keep(&Self::place(*number, place), piece);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Exit code if there is no result (no grazing orbit, for example).
const ENDED_OTHERWISE: u8 = 1;
/// Exit code of wrong input.
const WRONG_INPUT: u8 = 2;

/// Failure of a command.
#[derive(Debug, thiserror::Error)]
pub(in crate::cli) enum CliError {
    /// The library refused its input, or the computation ended without a result.
    #[error(transparent)]
    Library(#[from] Error),
    /// The catalogue has no such scene.
    #[error(
        "no scene `{name}` in the catalogue{}; `grazemap new --list` shows it",
        meant(.nearest)
    )]
    NotInCatalogue { name: String, nearest: Option<String> },
    /// A file would be overwritten.
    #[error("`{}` exists and is not overwritten; name another file with -o", .path.display())]
    Exists { path: PathBuf },
    /// A table was asked of a command without one.
    #[error("`grazemap {command}` has no table; use --json")]
    NoTable { command: &'static str },
    /// Two results go to one place, where one would be lost.
    #[error(
        "--{} and --{} both write to {place}; name another place for one of them",
        .options[0], .options[1]
    )]
    OnePlace { options: [&'static str; 2], place: Destination },
    /// A result would replace an input of the command.
    #[error("{} is read by this command and not replaced; name another file", .path.display())]
    ReplacesInput { path: PathBuf },
    /// A folder differs from the emission of today.
    #[error("{} is not what would be emitted now:{differences}", .folder.display())]
    NotCurrent { folder: PathBuf, differences: String },
    /// Several basins would go to one file or stream.
    #[error("the scene asks for {found} basins, and --json and --csv write one; -o DIR writes all")]
    SeveralBasins { found: usize },
    /// The scene has no diagram.
    #[error(
        "the scene asks for no diagram; name a parameter with --along, or add a [[diagram]] table"
    )]
    NoDiagram,
    /// An option is given for the tables of a scene, which state the same themselves.
    #[error(
        "--{option} goes with {names}, which names a {table} in the place of the scene's; a table \
         of the scene is changed by --set '{table}.0.{option}=...'"
    )]
    OfAnotherTable { option: &'static str, table: &'static str, names: &'static str },
    /// A command that needs no scene has values for one.
    #[error("--set changes a scene, and none is named")]
    NothingToSet,
    /// The scene has no chart.
    #[error(
        "the scene asks for no chart; name two parameters with --plane, or add a [[chart]] table \
         with `parameters` and `ranges`"
    )]
    NoChart,
    /// A range without ends, of a parameter that the window does not bound.
    #[error("the window does not bound `{}`; name its range", .name.escape_default())]
    NoRange { name: String },
    /// A range of a parameter that is not in the plane.
    #[error("--range names `{}`, which --plane does not", .name.escape_default())]
    RangeOfNoAxis { name: String },
    /// Scene and starting points are both read from standard input.
    #[error("the scene and the points are both standard input; name a file for one of them")]
    StandardInputTwice,
    /// The file of starting points cannot be read.
    #[error("cannot read the points {}: {source}", .path.display())]
    UnreadableStates { path: PathBuf, source: csv::Error },
    /// The file of starting points has no rows.
    #[error(
        "no points in {}: a header and at least one row are expected",
        .path.display()
    )]
    NoStates { path: PathBuf },
    /// The file has too many starting points.
    #[error("more than {limit} points in {}", .path.display())]
    TooManyStates { path: PathBuf, limit: usize },
    /// A column is neither a section coordinate nor an active parameter.
    #[error(
        "unknown column `{}` in {}; expected some of {known}: coordinates of {section} and \
         active parameters",
        .name.escape_default(), .path.display()
    )]
    UnknownColumn { path: PathBuf, name: String, known: String, section: String },
    /// Two columns have the same name.
    #[error("column `{}` stands twice in {}", .name.escape_default(), .path.display())]
    ColumnTwice { path: PathBuf, name: String },
    /// A cell is not a finite number.
    #[error(
        "`{}` in line {line} of {} is no finite decimal number",
        .text.escape_default(), .path.display()
    )]
    NotANumber { path: PathBuf, line: u64, text: String },
    /// The gallery has no such entry.
    #[error(
        "no entry `{name}` in the gallery{}; `grazemap gallery --list` shows it",
        meant(.nearest)
    )]
    NotInGallery { name: String, nearest: Option<String> },
    /// An entry of the gallery cannot be read.
    #[error("the gallery: {0}")]
    Gallery(String),
    /// Numbers of the gallery differ from their expected values.
    #[error("the gallery differs from what it says: {what}")]
    Unexplained { what: String },
    /// JSON or a table was asked of a shard.
    #[error(
        "a shard has pieces alone, which go into -o DIR; ask `grazemap merge` for --json, --csv"
    )]
    ShardHasNoResults,
    /// Files of pieces cannot be joined.
    #[error(transparent)]
    Shards(#[from] ShardError),
    /// The program cannot read its own executable.
    #[error("cannot read this very program, which pieces are marked with: {0}")]
    Program(io::Error),
    /// A result could not be laid out or written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// An environment variable has an unknown value.
    #[error("{INSTRUCTION_LIMIT} is `{}`; expected sse2, avx2 or avx512", .value.escape_default())]
    InstructionLimit { value: String },
    /// Standard output cannot be written to.
    #[error("cannot write to standard output: {0}")]
    StandardOutput(io::Error),
    /// Threads were started before.
    #[error("the number of threads is decided already: give `--threads` with the first command")]
    Threads,
}

impl CliError {
    /// Exit code: 1 for no result or a failed comparison, 2 for wrong input.
    pub(in crate::cli) fn exit_code(&self) -> u8 {
        match self {
            Self::Library(error) if error.ended_otherwise() => ENDED_OTHERWISE,
            Self::Unexplained { .. } | Self::NotCurrent { .. } => ENDED_OTHERWISE,
            _ => WRONG_INPUT,
        }
    }

    /// Prints the error to standard error. A fault of a scene is drawn in the scene's text.
    pub(in crate::cli) fn show(&self) {
        match self {
            Self::Library(Error::Scene(error)) => note(drawn(&error.clone().headline()).trim_end()),
            // A key of a request is an option of the program.
            Self::Library(Error::Key(error)) if error.begins_with_key() => {
                note(&format!("error: --{error}"));
            }
            other => note(&format!("error: {}", chain(other))),
        }
    }
}

/// ` (did you mean ...?)`, or the empty text.
fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// Fault drawn in the text of its scene, in colour on a terminal.
fn drawn(headline: &SceneHeadline) -> String {
    let mut theme = if io::stderr().is_terminal() {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    };
    theme.characters.error = "error:".to_owned();
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).with_width(120).with_context_lines(1);
    match handler.render_report(&mut text, headline) {
        Ok(()) => text,
        Err(_) => format!("error: {headline}"),
    }
}

/// Error followed by its causes, without repetition.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let said = inner.to_string();
        if !text.contains(&said) {
            text = format!("{text}: {said}");
        }
        cause = inner.source();
    }
    text
}
