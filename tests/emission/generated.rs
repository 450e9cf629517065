//! Check that the checked-in crate of emitted maps equals the program's emission today.
//!
//! `UPDATE_GENERATED=1 cargo test --test emission generated::` rewrites the crate.

use std::path::Path;
use std::process::{Command, Output};

fn emit_catalogue(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grazemap"))
        .args(["emit", "--catalogue", "-o"])
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("generated"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn the_generated_crate_is_current() {
    if std::env::var_os("UPDATE_GENERATED").is_some() {
        assert!(emit_catalogue(&[]).status.success(), "the folder can be written");
    }
    let checked = emit_catalogue(&["--check"]);
    assert!(
        checked.status.success(),
        "{}{}",
        String::from_utf8_lossy(&checked.stdout),
        String::from_utf8_lossy(&checked.stderr)
    );
}
