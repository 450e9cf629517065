//! Tutorials, run: what their commands print is what the pages show; and the reference of the
//! command line.

use std::fs;
use std::path::Path;

use super::cli::{grazemap, scratch};

fn docs() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs")
}

/// Copies a folder with the folders in it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).expect("a folder of the repository") {
        let entry = entry.expect("readable");
        match entry.path().is_dir() {
            true => copy(&entry.path(), &to.join(entry.file_name())),
            false => drop(fs::copy(entry.path(), to.join(entry.file_name())).expect("copied")),
        }
    }
}

/// Commands of a page run in its folder `PAGE.in`, here in a copy: they write results.
#[test]
fn tutorials_show_what_their_commands_print() {
    let folder = scratch();
    copy(&docs().join("tutorials"), folder.path());
    trycmd::TestCases::new()
        .register_bin("grazemap", Path::new(env!("CARGO_BIN_EXE_grazemap")))
        .case(folder.path().join("*.md"))
        .run();
}

/// With `GRAZEMAP_DOCS=write` the page is written anew.
#[test]
fn the_reference_of_the_command_line_is_what_the_program_prints() {
    let path = docs().join("reference/command-line.md");
    let page = fs::read_to_string(&path).expect("a page");
    let (mut written, mut rest, mut commands) = (String::new(), page.as_str(), Vec::new());
    let heading = "### `grazemap ";
    while let Some(start) = rest.find(heading) {
        let (before, section) = rest.split_at(start);
        let name = section[heading.len()..].split('`').next().unwrap_or_default();
        let help = grazemap(docs().as_path(), &["help", name]);
        let help = String::from_utf8(help.stdout).expect("a text");
        let open = section.find("```text\n").expect("a block of text") + "```text\n".len();
        let close = open + section[open..].find("```").expect("its end");
        let lines = help.trim_end().lines().map(|line| format!("{}\n", line.trim_end()));
        written.push_str(before);
        written.push_str(&section[..open]);
        written.extend(lines);
        rest = &section[close..];
        commands.push(name);
    }
    written.push_str(rest);
    let all = String::from_utf8(grazemap(docs().as_path(), &["help"]).stdout).expect("a text");
    let listed = all.split("Options:").next().into_iter().flat_map(str::lines);
    let listed = listed.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let listed: Vec<&str> = listed.filter(|name| *name != "help").collect();
    assert_eq!(commands, listed, "the page has a section for every command, in the order of help");
    if std::env::var_os("GRAZEMAP_DOCS").is_some_and(|value| value == "write") {
        fs::write(&path, &written).expect("writable");
    }
    assert!(written == page, "{} is old; GRAZEMAP_DOCS=write writes it", path.display());
}
