//! Short part of the campaign of `xtask fuzz`, and all cases in its corpus.

use std::fs;
use std::path::PathBuf;

use xtask::fuzz::campaign::{Campaign, Case, Judgement, corpus};

use crate::support::tiers;

fn campaign(folder: &tempfile::TempDir) -> Campaign {
    Campaign::new(PathBuf::from(env!("CARGO_BIN_EXE_grazemap")), folder.path().to_owned())
}

#[test]
fn what_was_found_before_is_ended_as_it_should_be() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let campaign = campaign(&folder);
    let entries = fs::read_dir(corpus()).expect("the folder is part of the repository");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.sort();
    assert!(paths.len() > 5);
    for path in tiers::part(&paths, 3) {
        let text = fs::read_to_string(path).expect("readable");
        let case = Case::read(&text).expect("a first line with the arguments");
        let judgement = campaign.judge(&case).expect("a shell with ulimit");
        assert!(!judgement.is_fault(), "{}: {judgement}", path.display());
    }
}

#[test]
fn changed_scenes_end_with_a_message_and_an_exit_code() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let campaign = campaign(&folder);
    for number in 0..tiers::count(20, 60) as u64 {
        let case = Case::new(1, number);
        let judgement = campaign.judge(&case).expect("a shell with ulimit");
        let call = case.arguments.join(" ");
        assert!(!judgement.is_fault(), "--seed 1 --case {number}: {call}: {judgement}");
    }
}

/// Endless call that prints a bar: a shell script whose loop changes and shows `n`.
#[cfg(unix)]
fn judged_long(loops: &str) -> Judgement {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let program = folder.path().join("program");
    let text = format!(
        "#!/bin/sh\nn=0\nwhile :; do\n{loops}\ni=0\n\
         while [ $i -lt 2000 ]; do i=$((i+1)); done\ndone\n"
    );
    fs::write(&program, text).expect("writable");
    let runs = fs::Permissions::from_mode(0o755);
    fs::set_permissions(&program, runs).expect("own file");
    let campaign = Campaign::new(program, folder.path().to_owned()).within(1);
    let case = Case::read("# check scene.toml").expect("arguments");
    campaign.judge(&case).expect("a shell with ulimit, and script")
}

#[cfg(unix)]
#[test]
fn a_long_call_is_a_fault_unless_a_bar_states_a_bound_and_moves_to_the_end() {
    let bar = "printf '\\r         check ██████░░░░ %s/%s 3s' $n";
    let moves = judged_long(&format!("n=$((n+1))\n{bar} 1000000 >&2"));
    let Judgement::Long { done, of: 1_000_000 } = moves else { panic!("{moves}") };
    assert!(done > 1, "{done}");
    for fault in [
        // A bar that stands; one that stands after its first steps; no bound.
        format!("{bar} 1000000 >&2"),
        format!("[ $n -lt 3 ] && n=$((n+1))\n{bar} 1000000 >&2"),
        format!("n=$((n+1))\n{bar} 0 >&2"),
    ] {
        let judgement = judged_long(&fault);
        assert!(judgement.is_fault(), "{fault}: {judgement}");
    }
}
