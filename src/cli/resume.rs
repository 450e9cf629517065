//! Commands that can be interrupted: what they finished is kept beside their results, and the same
//! command goes on from there.

use std::env;
use std::fs;
use std::path::Path;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use super::output::note;
use grazemap::model::Digest;
use grazemap::report::{Journal, counted};

/// The journal of the command that runs.
static RUNNING: Mutex<Option<Arc<Journal>>> = Mutex::new(None);

/// Exit code of a command that was interrupted, as shells have it.
const INTERRUPTED: i32 = 130;

/// Says, when the program is interrupted, what is kept.
pub(in crate::cli) fn catch_interruptions() {
    // Where the system has no such signals, an interruption says nothing.
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

/// A command whose finished pieces are kept until its results are written.
#[derive(Debug)]
pub(in crate::cli) struct Resumable {
    journal: Option<Arc<Journal>>,
}

impl Resumable {
    /// A command that keeps its pieces in a folder, if it has one, under a key of all that decides
    /// them; says, unless `quiet`, what is there already.
    pub(in crate::cli) fn begin(
        command: &str,
        folder: Option<&Path>,
        decisive: &[&str],
        quiet: bool,
    ) -> Self {
        let open = |folder| Journal::open(folder, command, key(decisive)).map(Arc::new);
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

    /// Where pieces are kept.
    pub(in crate::cli) fn journal(&self) -> Option<Arc<Journal>> {
        self.journal.clone()
    }

    /// The results are written: nothing is kept any more.
    pub(in crate::cli) fn finish(self) {
        *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) = None;
        if let Some(journal) = self.journal {
            journal.finish();
        }
    }
}

/// Of texts, of the version and of the very program: another build may compute another last bit.
fn key(decisive: &[&str]) -> Digest {
    let program = env::current_exe().and_then(fs::metadata);
    let made = program.and_then(|program| Ok((program.len(), program.modified()?)));
    let made = made.map(|(length, time)| (length, time.duration_since(UNIX_EPOCH).ok()));
    let program = format!("{} {:?}", env!("CARGO_PKG_VERSION"), made.ok());
    let texts = decisive.iter().copied().chain([&*program]);
    Digest::of(&texts.map(|text| Digest::of(text).to_string()).collect::<String>())
}
