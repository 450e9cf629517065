//! Short part of the campaign of `xtask fuzz`, and all cases in its corpus.

use std::fs;
use std::path::PathBuf;

use xtask::fuzz::campaign::{Campaign, Case, corpus};

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
    for path in tiers::part(&paths, 5) {
        let text = fs::read_to_string(path).expect("readable");
        let case = Case::read(&text).expect("a first line with the arguments");
        let fault = campaign.fault(&case).expect("a shell with ulimit");
        assert_eq!(fault, None, "{}", path.display());
    }
}

#[test]
fn changed_scenes_end_with_a_message_and_an_exit_code() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let campaign = campaign(&folder);
    for number in 0..tiers::count(20, 60) as u64 {
        let case = Case::new(1, number);
        let fault = campaign.fault(&case).expect("a shell with ulimit");
        assert_eq!(fault, None, "--seed 1 --case {number}: {}", case.arguments.join(" "));
    }
}
