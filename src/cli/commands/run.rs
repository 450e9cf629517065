//! `grazemap run` and `view`: compute everything that a scene asks for, write a report page, and
//! open it.

use std::cell::RefCell;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::emit::Reproduction;
use super::{note_section, open, resumable};
use crate::cli::arguments::{Common, SceneOptions};
use crate::cli::output::{Bar, CliError, deliver, note};
use crate::cli::pieces::Resumable;
use grazemap::Map;
use grazemap::analysis::Progress;
use grazemap::emission::{Target, shell_word};
use grazemap::pipeline::{Answer, RunWatch, Settled, run as run_in};
use grazemap::report::StageTime;

/// Default folder of results.
const FOLDER: &str = "out";
/// Scene of a run without SCENE.
const BUILT_IN: &str = "cantilever_3_5_soft";

/// Runs the built-in scene, start to finish.
pub(in crate::cli) fn built_in(common: &Common) -> Result<(), CliError> {
    run(&SceneOptions { scene: PathBuf::from(BUILT_IN), common: common.clone() })
}

/// Runs a scene, start to finish.
pub(in crate::cli) fn run(options: &SceneOptions) -> Result<(), CliError> {
    let mut outlets = options.common.outlets.clone();
    let source = open(options)?;
    let folder = outlets.output.take().unwrap_or_else(|| PathBuf::from(FOLDER));
    let watch = Watch { options, resumable: RefCell::new(None) };
    let timings = run_in(source, folder.clone(), outlets.pictures.form(), &watch)?;
    if let Some(resumable) = watch.resumable.take() {
        resumable.finish();
    }
    let (scene, page) = (options.scene.display(), folder.join("report.html"));
    let text = format!("{scene}: done; open {}\n", page.display());
    deliver(&mut Answer::without_table("timings", text, timings), &outlets)
}

/// Path of the report page of a run with these options.
fn page_of(common: &Common) -> PathBuf {
    let folder = common.outlets.output.as_deref();
    folder.unwrap_or(Path::new(FOLDER)).join("report.html")
}

/// Reports the progress of a run on standard error, and keeps its pieces.
struct Watch<'a> {
    options: &'a SceneOptions,
    resumable: RefCell<Option<Resumable>>,
}

impl Watch<'_> {
    fn quiet(&self) -> bool {
        self.options.common.outlets.quiet
    }
}

impl RunWatch for Watch<'_> {
    fn stage(&self, StageTime { stage, seconds }: &StageTime) {
        self.remark(&format!("{stage:<16} {seconds:8.3} s"));
    }

    fn remark(&self, words: &str) {
        if !self.quiet() {
            note(words);
        }
    }

    fn settled(&self, settled: &Settled) {
        note_section(settled, self.quiet());
    }

    fn begin(&self, folder: &Path, map: &Map) {
        // NOTE: a run whose pieces cannot be kept continues without a journal.
        let kept = resumable("run", Some(folder.to_owned()), map, "", self.quiet());
        *self.resumable.borrow_mut() = kept.ok();
    }

    fn progress(&self, heading: &'static str, number: u64) -> Box<dyn Progress + '_> {
        let journal = self.resumable.borrow().as_ref().and_then(Resumable::journal);
        Box::new(Bar::new(heading, self.quiet()).resuming(number, journal))
    }

    fn subject(&self) -> Option<String> {
        let scene = shell_word(self.options.scene.as_os_str().as_encoded_bytes());
        let set = self.options.common.set.iter();
        let set = set.map(|(name, value)| shell_word(format!("{name}={value}").as_bytes()));
        Some(set.fold(scene, |words, own| words + " --set " + &own))
    }

    fn emission(&self, folder: &Path) -> Option<String> {
        let again = Reproduction {
            scene: Some(&self.options.scene),
            overrides: &self.options.common.set,
            target: Target::Rust,
            measure: true,
        };
        Some(again.command(folder))
    }
}

/// Runs a scene and opens its page in the browser named by `BROWSER`, else in the system's.
pub(in crate::cli) fn view(options: &SceneOptions) -> Result<(), CliError> {
    run(options)?;
    let page = page_of(&options.common);
    if !opens(&page) && !options.common.outlets.quiet {
        note("no browser could be started; set BROWSER, or open the page yourself");
    }
    Ok(())
}

/// Whether a browser started with the page.
fn opens(page: &Path) -> bool {
    let page = std::path::absolute(page).unwrap_or_else(|_| page.to_owned());
    let opener = match std::env::var_os("BROWSER").filter(|browser| !browser.is_empty()) {
        Some(browser) => browser,
        None if cfg!(target_os = "macos") => OsString::from("open"),
        None if cfg!(windows) => OsString::from("explorer"),
        None => OsString::from("xdg-open"),
    };
    let quiet = || Stdio::null();
    Command::new(opener).arg(page).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn().is_ok()
}
