//! Interruption and sharding. An interrupted command resumes from the finished pieces in a journal
//! beside its results. A shard, one of several machines, writes its pieces instead of results.

use std::env;
use std::fs;
use std::path::PathBuf;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use super::output::{Bar, CliError, Outlets, note};
use grazemap::analysis::{Gathered, Shard, Share};
use grazemap::model::Digest;
use grazemap::report::{Journal, OutputFolder, ShardHeader, counted};

/// Version of the program. Pieces are marked with it.
pub(in crate::cli) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Journal of the running command.
static RUNNING: Mutex<Option<Arc<Journal>>> = Mutex::new(None);

/// Exit code of an interrupted command: that of shells.
const INTERRUPTED: i32 = 130;

/// Installs a handler that reports, on interruption, the pieces that are kept.
pub(in crate::cli) fn catch_interruptions() {
    // NOTE: on a system without such signals, an interruption prints nothing.
    let _caught_or_not = ctrlc::set_handler(|| {
        let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner).clone();
        match running {
            None => interrupted("nothing of this command is kept"),
            Some(journal) => {
                let pieces = counted(journal.pieces(), "finished piece");
                journal.hold(|path| {
                    let path = path.display();
                    interrupted(&format!(
                        "{pieces} kept in {path}; the same command goes on from there"
                    ));
                });
            }
        }
    });
}

fn interrupted(what: &str) {
    note(&format!("interrupted: {what}"));
    process::exit(INTERRUPTED);
}

/// Command whose finished pieces are kept until its results are written.
#[derive(Debug)]
pub(in crate::cli) struct Resumable {
    journal: Option<Arc<Journal>>,
}

impl Resumable {
    /// Begins a command that keeps its pieces in `folder`, if there is one, under a key made of the
    /// texts that determine them. Prints the number of pieces found there unless `quiet`.
    pub(in crate::cli) fn begin(
        command: &str,
        folder: Option<PathBuf>,
        decisive: &[&str],
        quiet: bool,
    ) -> Self {
        let open = |folder: PathBuf| Journal::open(&folder, command, key(decisive)).map(Arc::new);
        let journal = folder.and_then(open);
        *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) = journal.clone();
        let pieces = journal.as_ref().map_or(0, |journal| journal.pieces());
        if pieces > 0 && !quiet {
            note(&format!(
                "going on from an interrupted run: {}",
                counted(pieces, "finished piece")
            ));
        }
        Self { journal }
    }

    /// Journal of the pieces.
    pub(in crate::cli) fn journal(&self) -> Option<Arc<Journal>> {
        self.journal.clone()
    }

    /// Deletes the journal, once the results are written.
    pub(in crate::cli) fn finish(self) {
        *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) = None;
        if let Some(journal) = self.journal {
            journal.finish();
        }
    }
}

/// Digest of texts, version and executable file (length and time): another build may compute
/// another last bit.
fn key(decisive: &[&str]) -> Digest {
    let program = env::current_exe().and_then(fs::metadata);
    let made = program.and_then(|program| Ok((program.len(), program.modified()?)));
    let made = made.map(|(length, time)| (length, time.duration_since(UNIX_EPOCH).ok()));
    let program = format!("{VERSION} {:?}", made.ok());
    let texts = decisive.iter().copied().chain([&*program]);
    Digest::of(&texts.map(|text| Digest::of(text).to_string()).collect::<String>())
}

/// Shard to compute, and the texts that determine its pieces.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct Sharded<'a> {
    pub(in crate::cli) share: Share,
    pub(in crate::cli) command: &'static str,
    /// Digest of the scene's text.
    pub(in crate::cli) scene: Option<Digest>,
    /// Document of the map.
    pub(in crate::cli) map: Option<&'a str>,
    /// Further settings of the command, as text.
    pub(in crate::cli) asked: &'a str,
}

impl Sharded<'_> {
    /// Computes the shard and writes its pieces into the folder of results.
    pub(in crate::cli) fn write<E: Into<CliError>>(
        &self,
        outlets: &Outlets,
        compute: impl FnOnce(&Shard<'_>) -> Result<(), E>,
    ) -> Result<(), CliError> {
        if outlets.json.is_some() || outlets.csv.is_some() {
            return Err(CliError::ShardHasNoResults);
        }
        let (number, of) = (self.share.number(), self.share.of());
        let folder = outlets.output.clone().unwrap_or_else(|| PathBuf::from("."));
        let header = ShardHeader {
            version: VERSION.to_owned(),
            program: program()?,
            command: self.command.to_owned(),
            scene: self.scene,
            settings: Digest::of(self.asked),
            of,
            number,
            arguments: env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
            map: self.map.map(str::to_owned),
            pieces: 0,
        };
        let journal = format!("shard-{number}-of-{of}-{}", self.command);
        let decisive = [self.map.unwrap_or_default(), self.asked];
        let resumable = Resumable::begin(&journal, Some(folder.clone()), &decisive, outlets.quiet);
        let (bar, gathered) = (Bar::new(self.command, outlets.quiet), Gathered::default());
        let bar = bar.resuming(0, resumable.journal());
        compute(&Shard::new(self.share, &bar, &gathered)).map_err(Into::into)?;
        drop(bar);
        let (name, pieces) = (header.file_name(), gathered.into_pieces());
        let path = OutputFolder::create(folder)?.write(&name, header.file(&pieces))?;
        resumable.finish();
        let pieces = counted(pieces.len(), "piece");
        outlets.show(&format!(
            "shard {number} of {of}: {pieces} in {}; `grazemap merge` joins all\n",
            path.display()
        ))
    }
}

/// Digest of the executable, the same on every machine with a copy of it.
pub(in crate::cli) fn program() -> Result<Digest, CliError> {
    let path = env::current_exe().map_err(CliError::Program)?;
    Ok(Digest::of_bytes(&fs::read(path).map_err(CliError::Program)?))
}

/// Parses the value of `--shard`: `I/N`, or the task of a Slurm job array.
pub(in crate::cli) fn share(text: &str) -> Result<Share, String> {
    let number = |text: &str| text.trim().parse::<usize>().ok();
    if text != ARRAY {
        let share = text.split_once('/').and_then(|(i, n)| Share::new(number(i)?, number(n)?));
        return share.ok_or_else(|| "expected I/N with I from 1 to N, such as 2/7".to_owned());
    }
    let [id, count] = ["SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT"].map(|name| {
        let value = env::var(name).map_err(|_| name)?;
        number(&value).ok_or(name)
    });
    let missing = |name| {
        format!("this is no task of a job array: {name} is not set to a number; expected I/N")
    };
    let (id, count) = (id.map_err(missing)?, count.map_err(missing)?);
    let or =
        |name, otherwise| env::var(name).ok().and_then(|value| number(&value)).unwrap_or(otherwise);
    let (first, step) = (or("SLURM_ARRAY_TASK_MIN", 1), or("SLURM_ARRAY_TASK_STEP", 1).max(1));
    let index = id.checked_sub(first).filter(|index| index % step == 0);
    let share = index.and_then(|index| Share::new(index / step + 1, count));
    share.ok_or_else(|| {
        format!(
            "task {id} of an array of {count} from {first} on in steps of {step} is no shard; \
             expected I/N"
        )
    })
}

/// Value of `--shard` given without one: the task of a job array.
pub(in crate::cli) const ARRAY: &str = "array";
