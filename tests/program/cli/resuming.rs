//! Killed commands: no file is damaged, and the same command resumes and ends with the bytes of an
//! uninterrupted run. `xtask interruptions` does this two hundred times.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use super::{cache, grazemap, program, scratch, text};

/// A diagram by direct simulation that takes a second or two, into the folder `out`.
const CALL: [&str; 14] = [
    "diagram",
    "linear",
    "--set",
    "diagram.0.with=[\"direct\"]",
    "--set",
    "diagram.0.points=400",
    "--set",
    "diagram.0.transient=200",
    "--set",
    "diagram.0.keep=20",
    "--set",
    "diagram.0.range=[-1e-3, -1e-4]",
    "-o",
    "out",
];

fn begun(folder: &Path) -> Child {
    begun_with(folder, &CALL)
}

fn begun_with(folder: &Path, call: &[&str]) -> Child {
    program(folder)
        .args(call)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program can be started")
}

/// Waits until some pieces are kept, and returns the journal's path.
fn kept(folder: &Path) -> Option<std::path::PathBuf> {
    kept_in(&folder.join("out"))
}

fn kept_in(folder: &Path) -> Option<std::path::PathBuf> {
    for _ in 0..1000 {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut journals = entries.filter(|entry| {
            let name = entry.file_name();
            name.to_string_lossy().starts_with(".resume-diagram-")
                && entry.metadata().is_ok_and(|data| data.len() > 10_000)
        });
        if let Some(journal) = journals.next() {
            return Some(journal.path());
        }
        sleep(Duration::from_millis(5));
    }
    None
}

/// Files of a folder, including hidden ones.
pub(super) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let file = |entry: fs::DirEntry| {
        let bytes = fs::read(entry.path()).expect("readable");
        (entry.file_name().to_string_lossy().into_owned(), bytes)
    };
    entries.map(file).collect()
}

fn is_hidden(name: &str) -> bool {
    name.starts_with('.')
}

#[test]
fn a_killed_diagram_goes_on_where_it_was_and_ends_with_the_same_bytes() {
    let (whole, folder) = (scratch(), scratch());
    let output = grazemap(whole.path(), &CALL);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let expected = files(&whole.path().join("out"));
    assert!(!expected.keys().any(|name| is_hidden(name)), "{:?}", expected.keys());

    let mut run = begun(folder.path());
    let journal = kept(folder.path()).expect("pieces are kept while the command runs");
    run.kill().expect("it runs");
    run.wait().expect("it was started");
    assert!(journal.exists());
    let left = files(&folder.path().join("out"));
    assert!(left.keys().all(|name| is_hidden(name)), "{:?}", left.keys());
    let output = grazemap(folder.path(), &CALL);
    assert!(output.status.success());
    let said = text(&output.stderr);
    assert!(said.contains("going on from an interrupted run: "), "{said}");
    assert_eq!(files(&folder.path().join("out")), expected);
}

/// Results on a device: no file is written beside it, and pieces are kept in the cache.
#[cfg(unix)]
#[test]
fn a_diagram_onto_a_device_goes_on_from_the_cache() {
    let folder = scratch();
    let call = [&CALL[..CALL.len() - 2], &["--csv", "/dev/null"]].concat();
    let mut run = begun_with(folder.path(), &call);
    let journal = kept_in(&cache(folder.path()).join("grazemap"));
    run.kill().expect("it runs");
    run.wait().expect("it was started");
    let journal = journal.expect("pieces are kept while the command runs");
    let output = grazemap(folder.path(), &call);
    let said = text(&output.stderr);
    assert!(
        output.status.success() && said.contains("going on from an interrupted run: "),
        "{said}"
    );
    assert!(!journal.exists());
}

/// Other settings do not use pieces of the interrupted run, and its journal is removed.
#[test]
fn other_settings_never_go_on_from_what_was_kept() {
    let folder = scratch();
    let mut run = begun(folder.path());
    let journal = kept(folder.path()).expect("pieces are kept while the command runs");
    run.kill().expect("it runs");
    run.wait().expect("it was started");
    let other = [&CALL[..], &["--set", "zeta=0.06"]].concat();
    let output = grazemap(folder.path(), &other);
    let said = text(&output.stderr);
    assert!(output.status.success() && !said.contains("going on"), "{said}");
    assert!(!journal.exists());
}

#[cfg(unix)]
#[test]
fn an_interrupted_command_says_what_it_kept_and_ends_with_exit_code_130() {
    let folder = scratch();
    let run = begun(folder.path());
    let journal = kept(folder.path()).expect("pieces are kept while the command runs");
    let kill = Command::new("kill").args(["-INT", &run.id().to_string()]).status();
    assert!(kill.expect("kill can be started").success());
    let output = run.wait_with_output().expect("it was started");
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    let name = journal.file_name().expect("a file").to_string_lossy().into_owned();
    assert!(said.contains("interrupted: ") && said.contains(&name), "{said}");
    assert!(said.contains("the same command goes on from there"), "{said}");
}
