//! `grazemap gallery`: recomputes published figures and tables, and compares them.
//!
//! An [`Entry`] is a file under `gallery/`: commands of this program, the pictures to show, and the
//! numbers to compare with the printed ones. The gallery computes nothing itself: each command runs
//! as typed in a shell, into its own folder, and its files are read.

mod entry;
mod page;

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;

use super::arguments::{Command, GalleryOptions, Joined};
use super::help;
use super::output::{Bar, CliError, Outlets, print};
use super::pieces::Sharded;
use entry::{Computation, Entry, Number, Version, entries, papers, scene_text};
use grazemap::Error;
use grazemap::analysis::{Pieces, Progress, Share};
use grazemap::model::{Digest, nearest};
use grazemap::numeric::Shown;
use grazemap::report::{CommandEnd, OutputFolder, Picture, counted, pack_folder, unpack_folder};

/// Default folder of the page.
const FOLDER: &str = "out/gallery";

/// Function that runs a command.
pub(super) type Run<'a> = &'a dyn Fn(Command) -> Result<(), CliError>;

/// Results of an entry.
#[derive(Debug)]
pub(super) struct Computed<'a> {
    entry: &'a Entry,
    /// Commands as typed in a shell.
    lines: Vec<String>,
    /// Pictures with captions.
    pictures: Vec<(Picture, &'a str)>,
    numbers: Vec<Compared<'a>>,
    /// Reason why a command ended without results.
    fault: Option<String>,
    seconds: f64,
}

/// Computed number beside the printed one.
#[derive(Debug)]
pub(super) struct Compared<'a> {
    number: &'a Number,
    ours: Option<Value>,
}

/// Numbers of each result.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    /// Agree with the print.
    printed: usize,
    /// Agree with another way; the print differs.
    misprinted: usize,
    /// Differ.
    different: usize,
    /// Agree with another way; no paper prints them.
    unprinted: usize,
}

/// Result of comparing a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Agreement {
    /// Agrees with the printed value, and with the reference if there is one.
    Printed,
    /// Agrees with the reference; nothing is printed.
    Reference,
    /// Agrees with the reference, but not with the printed value.
    Misprint,
    /// Differs, and the entry says why.
    Explained,
    /// Differs without an explanation; or agrees, though the entry explains a difference.
    Unexplained,
}

/// Lists the entries, or computes those named (default: all).
pub(super) fn run(options: &GalleryOptions, command: Run<'_>) -> Result<(), CliError> {
    let entries = entries().map_err(CliError::Gallery)?;
    if options.list {
        return print(&listing(&entries));
    }
    let version = match (options.small, options.numbers) {
        (true, _) => Version::Small,
        (_, true) => Version::Numbers,
        _ => Version::Full,
    };
    let chosen = chosen(&entries, &options.names, version)?;
    let made_by = MadeBy { version, command };
    if let Some(share) = options.sharding.share {
        return shard(&chosen, options, share, &made_by);
    }
    let mut pieces = options.joined.as_deref().map(Joined::take).unwrap_or_default();
    let folder = OutputFolder::create(folder_of(options))?;
    let bar = Bar::new("gallery", options.quiet);
    bar.expect(chosen.iter().map(|entry| entry.computation.len() as u64).sum());
    let mut computed = Vec::new();
    for entry in chosen {
        computed.push(compute(entry, folder.path(), &made_by, &mut pieces, &bar)?);
    }
    drop(bar);
    let mut written = "numbers.csv";
    if version != Version::Numbers {
        written = "index.html";
        let papers = papers().map_err(CliError::Gallery)?;
        let is_left_out = |entry: &&Entry| version == Version::Small && !entry.is_short();
        let left_out = entries.iter().filter(is_left_out).count();
        folder.write(written, page::page(&papers, &computed, left_out)?.to_html()?)?;
    }
    folder.write("numbers.csv", page::all_numbers(&computed).to_csv()?)?;
    let unexplained = computed.iter().flat_map(Computed::unexplained).collect::<Vec<_>>();
    if !options.quiet {
        let page = folder.path().join(written);
        let entries = match computed.len() {
            1 => "1 entry".to_owned(),
            count => format!("{count} entries"),
        };
        let counts = computed.iter().map(Computed::counts).fold(Counts::default(), Counts::plus);
        print(&format!("gallery: {entries}: {}; open {}\n", counts.words(), page.display()))?;
    }
    match unexplained.is_empty() {
        true => Ok(()),
        false => Err(CliError::Unexplained { what: unexplained.join("; ") }),
    }
}

/// Folder of the results.
fn folder_of(options: &GalleryOptions) -> PathBuf {
    options.output.clone().unwrap_or_else(|| FOLDER.into())
}

/// Entries with their figures, one a line.
fn listing(entries: &[Entry]) -> String {
    let width = entries.iter().map(|entry| entry.name.len()).max().unwrap_or(0);
    let line = |entry: &Entry| {
        let needs = entry.needs.as_ref().map(|needs| format!(" (needs {needs})"));
        let Entry { name, paper, figure, title, .. } = entry;
        format!("{name:<width$}  {paper}, {figure}: {title}{}\n", needs.unwrap_or_default())
    };
    entries.iter().map(line).collect()
}

/// Entries of a version with these names; a paper's name stands for all its entries. Without names,
/// all entries.
fn chosen<'a>(
    entries: &'a [Entry],
    names: &[String],
    version: Version,
) -> Result<Vec<&'a Entry>, CliError> {
    let is_named = |entry: &Entry, name: &str| {
        let rest = entry.name.strip_prefix(name.trim_end_matches('/'));
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    for name in names {
        if !entries.iter().any(|entry| is_named(entry, name)) {
            let nearest = nearest(name, entries.iter().map(|entry| entry.name));
            return Err(CliError::NotInGallery { name: name.clone(), nearest });
        }
    }
    let chosen = entries
        .iter()
        .filter(|entry| names.is_empty() || names.iter().any(|name| is_named(entry, name)))
        .filter(|entry| version != Version::Small || entry.is_short());
    let chosen: Vec<&Entry> = chosen.collect();
    if chosen.is_empty() {
        return Err(CliError::Gallery(format!(
            "`--small` computes no entry that takes long, as {}; leave it out",
            names.join(" and ")
        )));
    }
    Ok(chosen)
}

/// Computes an entry in its folder. A command that ends without results is recorded as part of the
/// result.
fn compute<'a>(
    entry: &'a Entry,
    folder: &Path,
    made_by: &MadeBy<'_>,
    pieces: &mut Pieces,
    bar: &Bar,
) -> Result<Computed<'a>, CliError> {
    let (start, version) = (Instant::now(), made_by.version);
    let mut computed = Computed {
        entry,
        lines: Vec::new(),
        pictures: Vec::new(),
        numbers: Vec::new(),
        fault: None,
        seconds: 0.0,
    };
    let mut documents = Vec::new();
    for computation in entry.computation.iter().filter(|one| !one.is_left_out(version)) {
        let place = folder.join(entry.name).join(&computation.name);
        computed.lines.push(computation.line(version));
        let ended = match pieces.remove(&piece_of(entry, computation)[..]) {
            Some(piece) => unpacked(&piece, &place)?,
            None => made_by.execute(computation, &place),
        };
        if let Err(error) = ended {
            computed.fault = Some(format!("{}: {error}", computation.line(version)));
            break;
        }
        bar.advance(1);
        documents.push((computation.name.as_str(), document(&place)?));
        for shown in computation.picture.iter().filter(|_| version != Version::Numbers) {
            let picture = picture(&place, &shown.file)?;
            computed.pictures.push((picture, shown.caption.as_str()));
        }
    }
    let numbers = entry.number.iter().filter(|number| !entry.is_left_out(number, version));
    computed.numbers = numbers.map(|number| Compared::new(number, &documents)).collect();
    computed.seconds = start.elapsed().as_secs_f64();
    Ok(computed)
}

/// Settings and function that run a computation.
struct MadeBy<'a> {
    version: Version,
    command: Run<'a>,
}

impl MadeBy<'_> {
    /// Runs the computation in a folder. Returns the reason as text if it ended without results.
    fn execute(&self, computation: &Computation, place: &Path) -> CommandEnd {
        self.run(computation, place).map_err(|error| error.to_string())
    }

    fn run(&self, computation: &Computation, place: &Path) -> Result<(), CliError> {
        let mut words = vec!["grazemap".to_owned()];
        words.extend(computation.arguments(self.version));
        if let Some(scene) = words.get_mut(2)
            && let Some(text) = scene_text(scene)
            && computation.is_file(scene)
        {
            let folder = OutputFolder::create(place)?;
            let tables = computation.append.as_deref().unwrap_or_default();
            folder.write(&format!("{scene}.toml"), format!("{text}\n{tables}"))?;
            *scene = folder.path().join(format!("{scene}.toml")).display().to_string();
        }
        words.extend(["-q".to_owned(), "-o".to_owned(), place.display().to_string()]);
        let arguments = help::parse(words.iter().map(OsString::from));
        let arguments = arguments.map_err(|fault| CliError::Gallery(fault.to_string()))?;
        arguments.command.map_or(Ok(()), self.command)
    }
}

/// Place of a computation among the pieces of shards.
fn piece_of(entry: &Entry, computation: &Computation) -> [u64; 1] {
    [Digest::of(&format!("{}/{}", entry.name, computation.name)).0]
}

/// Computes a share of the computations. A piece holds the files that one computation writes.
fn shard(
    chosen: &[&Entry],
    options: &GalleryOptions,
    share: Share,
    made_by: &MadeBy<'_>,
) -> Result<(), CliError> {
    let version = made_by.version;
    let all = chosen.iter().flat_map(|entry| {
        let computations = entry.computation.iter().filter(|one| !one.is_left_out(version));
        computations.map(move |computation| (*entry, computation))
    });
    let all: Vec<(&Entry, &Computation)> = all.collect();
    let lines = all.iter().map(|(_, computation)| computation.line(version));
    let asked = lines.collect::<Vec<_>>().join("\n");
    let (output, quiet) = (Some(folder_of(options)), options.quiet);
    let outlets = Outlets { output, quiet, ..Outlets::default() };
    let sharded = Sharded { share, command: "gallery", scene: None, map: None, asked: &asked };
    sharded.write(&outlets, |shard| -> Result<(), CliError> {
        let own = all.iter().enumerate().filter(|(number, _)| share.takes(*number));
        for (_, (entry, computation)) in own {
            let place = piece_of(entry, computation);
            if shard.recall(&place).is_none() {
                let folder = folder_of(options).join(format!(".shard-{}", share.number()));
                empty(&folder)?;
                let ended = made_by.execute(computation, &folder);
                fs::create_dir_all(&folder).map_err(|source| unread(&folder, source))?;
                shard.keep(&place, &pack_folder(&folder, &ended).map_err(|e| unread(&folder, e))?);
                empty(&folder)?;
            }
        }
        Ok(())
    })
}

/// Removes a folder and its contents, including remains of an interrupted run.
fn empty(folder: &Path) -> Result<(), CliError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(unread(folder, error)),
        _ => Ok(()),
    }
}

/// Writes the files of a piece and returns how its computation ended.
fn unpacked(piece: &[u8], place: &Path) -> Result<CommandEnd, CliError> {
    let damaged = || CliError::Gallery("a piece cannot be read".to_owned());
    let (ended, files) = unpack_folder(piece).ok_or_else(damaged)?;
    empty(place)?;
    OutputFolder::create(place)?.write_all(files)?;
    Ok(ended)
}

/// JSON document that a command wrote.
fn document(place: &Path) -> Result<Value, CliError> {
    let files = fs::read_dir(place).map_err(|source| unread(place, source))?;
    let mut files = files.filter_map(|file| Some(file.ok()?.path()));
    let Some(path) = files.find(|path| path.extension().is_some_and(|ending| ending == "json"))
    else {
        return Ok(Value::Null);
    };
    let text = fs::read_to_string(&path).map_err(|source| unread(&path, source))?;
    serde_json::from_str(&text).map_err(|fault| CliError::Gallery(fault.to_string()))
}

fn picture(place: &Path, file: &str) -> Result<Picture, CliError> {
    let path = |ending: &str| place.join(format!("{file}.{ending}"));
    let svg = fs::read_to_string(path("svg")).map_err(|source| unread(&path("svg"), source))?;
    let png = fs::read(path("png")).map_err(|source| unread(&path("png"), source))?;
    Ok(Picture { svg, png })
}

fn unread(path: &Path, source: io::Error) -> CliError {
    Error::Unreadable { path: path.to_owned(), source }.into()
}

impl Computed<'_> {
    /// Unexplained faults and differences, as text.
    fn unexplained(&self) -> Vec<String> {
        let name = self.entry.name;
        if let Some(fault) = &self.fault {
            return vec![format!("{name}: {fault}")];
        }
        let differ = self
            .numbers
            .iter()
            .filter(|compared| matches!(compared.agreement(), Agreement::Unexplained));
        let words = |compared: &Compared<'_>| {
            let Number { what, printed, reference, .. } = compared.number;
            let expected = printed.iter().chain(reference).cloned().collect::<Vec<_>>();
            let (expected, ours) = (expected.join(" or "), compared.ours());
            format!("{name}: {what} is {ours}, not {expected}")
        };
        differ.map(words).collect()
    }

    /// Results of the comparisons.
    fn counts(&self) -> Counts {
        let one = |compared: &Compared<'_>| match compared.agreement() {
            Agreement::Printed => Counts { printed: 1, ..Counts::default() },
            Agreement::Misprint => Counts { misprinted: 1, ..Counts::default() },
            Agreement::Reference => Counts { unprinted: 1, ..Counts::default() },
            Agreement::Explained | Agreement::Unexplained => {
                Counts { different: 1, ..Counts::default() }
            }
        };
        self.numbers.iter().map(one).fold(Counts::default(), Counts::plus)
    }
}

impl Counts {
    fn plus(self, other: Self) -> Self {
        Self {
            printed: self.printed + other.printed,
            misprinted: self.misprinted + other.misprinted,
            different: self.different + other.different,
            unprinted: self.unprinted + other.unprinted,
        }
    }

    /// Counts as text.
    fn words(self) -> String {
        let Self { printed, misprinted, different, unprinted } = self;
        format!(
            "{} printed: {printed} agree with the print, {misprinted} agree with another way where \
             the print differs, {different} differ; {unprinted} more agree with another way, no \
             paper prints them",
            counted(printed + misprinted + different, "number")
        )
    }
}

impl<'a> Compared<'a> {
    fn new(number: &'a Number, documents: &[(&str, Value)]) -> Self {
        let one = |path: &str| {
            let (name, path) = path.split_once('/')?;
            let (_, document) = documents.iter().find(|(known, _)| *known == name)?;
            entry::find(document, path)
        };
        let ours = match number.of.is_empty() {
            true => one(&number.value),
            false => {
                let named = |(name, path): (&'a String, &String)| {
                    Some((name.as_str(), one(path)?.as_f64()?))
                };
                let named = number.of.iter().map(named).collect::<Option<Vec<_>>>();
                let value = named.and_then(|named| entry::evaluate(&number.value, &named));
                value.map(Value::from)
            }
        };
        Self { number, ours }
    }

    /// Computed value as text.
    fn ours(&self) -> String {
        match &self.ours {
            None => "not found".to_owned(),
            Some(Value::String(word)) => word.clone(),
            Some(Value::Number(number)) => match number.as_f64() {
                Some(value) if !number.is_u64() => format!("{}", Shown(value)),
                _ => number.to_string(),
            },
            Some(other) => other.to_string(),
        }
    }

    fn agrees_with(&self, text: &str) -> bool {
        match (&self.ours, text.parse::<f64>()) {
            (Some(Value::Number(ours)), Ok(expected)) => ours
                .as_f64()
                .is_some_and(|ours| (ours - expected).abs() <= self.number.tolerance(text)),
            (Some(_), _) => self.ours() == text,
            (None, _) => false,
        }
    }

    pub(super) fn agreement(&self) -> Agreement {
        let Number { printed, reference, differs, .. } = self.number;
        let agrees = |expected: &Option<String>| {
            expected.as_ref().map(|expected| self.agrees_with(expected))
        };
        match (agrees(printed), agrees(reference), differs.is_some()) {
            (Some(true), None | Some(true), false) => Agreement::Printed,
            (None, Some(true), false) => Agreement::Reference,
            (Some(false), Some(true), _) => Agreement::Misprint,
            (Some(false), None, true) if self.ours.is_some() => Agreement::Explained,
            _ => Agreement::Unexplained,
        }
    }
}
