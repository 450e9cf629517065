//! Short part of the campaign of `xtask fuzz`, and all cases in its corpus.

use std::fs;
use std::path::PathBuf;

use xtask::fuzz::campaign::{Campaign, Case, corpus};

/// Number of cases that take a few seconds.
const CASES: u64 = 60;

fn campaign(folder: &tempfile::TempDir) -> Campaign {
    Campaign::new(PathBuf::from(env!("CARGO_BIN_EXE_grazemap")), folder.path().to_owned())
}

#[test]
fn what_was_found_before_is_ended_as_it_should_be() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let campaign = campaign(&folder);
    let mut count = 0;
    for entry in fs::read_dir(corpus()).expect("the folder is part of the repository") {
        let path = entry.expect("readable").path();
        let text = fs::read_to_string(&path).expect("readable");
        let case = Case::read(&text).expect("a first line with the arguments");
        let fault = campaign.fault(&case).expect("a shell with ulimit");
        assert_eq!(fault, None, "{}", path.display());
        count += 1;
    }
    assert!(count > 0);
}

#[test]
fn changed_scenes_end_with_a_message_and_an_exit_code() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let campaign = campaign(&folder);
    for number in 0..CASES {
        let case = Case::new(1, number);
        let fault = campaign.fault(&case).expect("a shell with ulimit");
        assert_eq!(fault, None, "--seed 1 --case {number}: {}", case.arguments.join(" "));
    }
}
