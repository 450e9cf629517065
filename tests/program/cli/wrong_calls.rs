//! Wrong calls: each ends with the exit code and the message that `wrong_calls.md` and
//! `wrong_outputs.md` show. `TRYCMD=overwrite cargo test --test program wrong_calls::` writes those
//! pages anew.

use std::fs;
use std::path::Path;

use super::{cache, scratch};

/// Runs the calls of a page in a folder of their own, which is returned.
fn as_shown(name: &str, set_up: impl Fn(&Path)) -> tempfile::TempDir {
    let (folder, page) = (scratch(), format!("{name}.md"));
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/cli").join(&page);
    let (copied, inside) = (folder.path().join(&page), folder.path().join(format!("{name}.in")));
    fs::copy(&kept, &copied).expect("a page of the repository");
    fs::create_dir(&inside).expect("writable");
    set_up(&inside);
    trycmd::TestCases::new()
        .register_bin("grazemap", Path::new(env!("CARGO_BIN_EXE_grazemap")))
        .env("XDG_CACHE_HOME", cache(folder.path()).to_string_lossy())
        .case(&copied)
        .run();
    if std::env::var_os("TRYCMD").is_some_and(|value| value == "overwrite") {
        fs::copy(&copied, &kept).expect("the page can be written");
    }
    folder
}

/// The files that wrong calls name.
fn set_up(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("writable");
    write("taken.toml", b"mine");
    write("garbage.toml", b"\xff\xfe\x00[model]");
    write("empty.csv", b"");
    write("header.csv", b"x,theta\n");
    write("good.csv", b"x,theta\n1e-6,1e-6\n");
    write("unknown.csv", b"x,phi\n1,2\n");
    write("twice.csv", b"x,x\n1,2\n");
    write("word.csv", b"x,theta\n1e-6,0\n1e-6,small\n");
    write("infinite.csv", b"x\ninf\n");
    write("ragged.csv", b"x,theta\n1\n");
    write("far.csv", b"x,theta\n0.6,0\n");
    fs::create_dir(folder.join("folder")).expect("writable");
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let renamed = linear
        .replace("states = [\"x\", \"v\"]", "states = [\"y\", \"v\"]")
        .replace("x = \"v\"", "y = \"v\"")
        .replace("- x\"", "- y\"")
        .replace("{ x = ", "{ y = ");
    write("depth_state.toml", renamed.as_bytes());
    let tolerant = linear
        .replace("smooth_order = 5\n", "tolerance = 1e-30\n")
        .replace("contact_weight = 6\n", "");
    write("tolerance.toml", tolerant.as_bytes());
}

#[test]
fn every_wrong_call_ends_with_its_recorded_message_and_exit_code() {
    let folder = as_shown("wrong_calls", set_up);
    let taken = folder.path().join("wrong_calls.in/taken.toml");
    assert_eq!(fs::read(taken).expect("there"), b"mine");
}

/// Calls that would lose results, or ask for unavailable ones.
#[test]
fn calls_that_are_refused_beforehand_write_nothing() {
    let folder = as_shown("wrong_outputs", |_| ());
    let left = fs::read_dir(folder.path().join("wrong_outputs.in")).expect("there").count();
    assert_eq!(left, 0);
}
