//! `grazemap view`: the page of a run, opened by the program that `BROWSER` names.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread::sleep;
use std::time::Duration;

use super::{scratch, text};

/// Overrides that make a run short.
const QUICK: [&str; 8] = [
    "--set",
    "expansion.smooth_order=2",
    "--set",
    "expansion.contact_weight=3",
    "--set",
    "diagram.0.points=20",
    "--set",
    "diagram.0.transient=20",
];

fn view(folder: &Path, browser: &Path) -> Output {
    let arguments = ["view", "linear", "-o", "seen"];
    Command::new(env!("CARGO_BIN_EXE_grazemap"))
        .args(arguments.iter().chain(&QUICK))
        .current_dir(folder)
        .env("BROWSER", browser)
        .output()
        .expect("the program can be started")
}

#[test]
fn view_writes_the_page_and_hands_it_to_the_browser() {
    let folder = scratch();
    let opener = folder.path().join("opener");
    let record = folder.path().join("opened");
    // Written under another name first: a file that is there is whole.
    let script = format!(
        "#!/bin/sh\nprintf '%s\\n' \"$@\" > '{0}.new' && mv '{0}.new' '{0}'\n",
        record.display()
    );
    fs::write(&opener, script).expect("writable");
    fs::set_permissions(&opener, fs::Permissions::from_mode(0o755)).expect("ours");
    let output = view(folder.path(), &opener);
    assert!(output.status.success(), "{}", text(&output.stderr));
    // The program does not wait for the browser.
    let waits = (0..200).any(|_| {
        sleep(Duration::from_millis(50));
        record.exists()
    });
    assert!(waits, "the opener was not started");
    let opened = fs::read_to_string(&record).expect("written");
    let opened: Vec<PathBuf> = opened.lines().map(PathBuf::from).collect();
    let page = folder.path().join("seen/report.html");
    assert_eq!(opened.len(), 1);
    assert!(opened[0].is_absolute());
    assert_eq!(
        fs::canonicalize(&opened[0]).expect("there"),
        fs::canonicalize(page).expect("written")
    );
}

#[test]
fn view_without_a_browser_keeps_the_page_and_says_so() {
    let folder = scratch();
    let output = view(folder.path(), &folder.path().join("no-such-browser"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("set BROWSER"), "{}", text(&output.stderr));
    assert!(folder.path().join("seen/report.html").exists());
}
