//! Commands in shards: the pieces of all shards join to the bytes of an unsharded run.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use grazemap::report::{pieces_from_bytes, pieces_to_bytes, unpack_folder};
use xtask::fuzz::HUGE;

use super::resuming::files;
use super::{grazemap, scratch, text};
use crate::support::tiers;

/// Runs a command that must succeed, and returns its output.
fn call(folder: &Path, arguments: &[&str]) -> String {
    let output = grazemap(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stderr)
}

/// Runs a call that must be refused, and returns its message.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = grazemap(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    text(&output.stderr)
}

/// Computes all shards into a folder, and returns the files of their pieces.
fn shards(folder: &Path, command: &[&str], count: usize, into: &str) -> Vec<String> {
    let shard = |number: usize| {
        call(folder, &[command, &["--shard", &format!("{number}/{count}"), "-o", into]].concat());
        format!("{into}/{}-{number}-of-{count}.pieces", command[0])
    };
    (1..=count).map(shard).collect()
}

/// One, three and seven shards of a command join to the bytes of an unsharded run.
fn equal_bytes(folder: &Path, command: &[&str]) {
    call(folder, &[command, &["-o", "whole"]].concat());
    let whole = files(&folder.join("whole"));
    assert!(whole.len() > 2, "{:?}", whole.keys());
    for count in [1, 3, 7] {
        let (into, out) = (format!("pieces-{count}"), format!("joined-{count}"));
        let mut pieces = shards(folder, command, count, &into);
        pieces.reverse();
        let pieces: Vec<&str> = pieces.iter().map(String::as_str).collect();
        call(folder, &[&["merge", "-o", &out], &pieces[..]].concat());
        let joined = files(&folder.join(&out));
        let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&joined), names(&whole), "{count} shards");
        for (name, bytes) in &whole {
            assert!(joined[name] == *bytes, "{name} of {count} shards differs");
        }
        // The files of pieces are kept, and no other file is beside them.
        assert_eq!(files(&folder.join(&into)).len(), count);
    }
}

/// Saves a map with these tables, so that no shard has to compute it.
fn map_with(folder: &Path, tables: &str) {
    call(folder, &["new", "linear", "-q", "-o", "scene.toml"]);
    let scene = fs::read_to_string(folder.join("scene.toml")).expect("readable");
    let own = scene.find("[[diagram]]").unwrap_or(scene.len());
    fs::write(folder.join("scene.toml"), format!("{}\n{tables}", &scene[..own])).expect("written");
    let orders = ["--set", "expansion.smooth_order=2", "--set", "expansion.contact_weight=3"];
    call(folder, &[&["expand", "scene.toml", "-q", "-o", "."], &orders[..]].concat());
}

#[test]
fn shards_of_diagrams_are_joined_to_the_bytes_of_the_whole() {
    let folder = scratch();
    map_with(
        folder.path(),
        "[[diagram]]\nparameter = \"alpha\"\nrange = [-1e-4, 3e-4]\npoints = 90\n\
         transient = 100\nkeep = 20\nwith = [\"map\", \"guarded\"]\n\
         [[diagram]]\nparameter = \"alpha\"\nrange = [-1e-4, 3e-4]\npoints = 30\n\
         transient = 20\nkeep = 10\nwith = [\"direct\"]\ndirection = \"up\"\n",
    );
    equal_bytes(folder.path(), &["diagram", "map.json"]);
}

#[test]
fn shards_of_charts_are_joined_to_the_bytes_of_the_whole() {
    let folder = scratch();
    map_with(
        folder.path(),
        "[[chart]]\nparameters = [\"omega\", \"alpha\"]\nranges = [[-1e-3, 1e-3], [-1e-4, 3e-4]]\n\
         points = [36, 24]\ntransient = 100\nkeep = 16\n\
         [[chart]]\nparameters = [\"omega\", \"alpha\"]\nranges = [[-1e-3, 1e-3], [-1e-4, 3e-4]]\n\
         points = [12, 16]\ntransient = 50\nkeep = 16\nobserve = \"lyapunov\"\nwith = [\"map\"]\n",
    );
    equal_bytes(folder.path(), &["chart", "map.json"]);
}

#[test]
fn shards_of_basins_are_joined_to_the_bytes_of_the_whole() {
    let folder = scratch();
    map_with(folder.path(), "");
    let call = ["basin", "map.json", "--points", "36,24", "--at", "alpha=1e-4"];
    equal_bytes(folder.path(), &call);
}

#[test]
fn shards_of_branches_are_joined_to_the_bytes_of_the_whole() {
    let folder = scratch();
    map_with(folder.path(), "");
    equal_bytes(folder.path(), &["branch", "map.json", "--along", "alpha", "--period", "3"]);
}

#[test]
fn what_is_no_whole_computation_is_refused() {
    let folder = scratch();
    let folder = folder.path();
    map_with(folder, "");
    let basin = ["basin", "map.json", "--points", "12"];
    let pieces = shards(folder, &basin, 3, "pieces");
    let merge = |names: &[&str]| refused(folder, &[&["merge", "-o", "out"], names].concat());
    let [first, second, third] = [0, 1, 2].map(|number| &*pieces[number]);
    assert!(merge(&[first, third]).contains("of 3 shards there is no file of 2;"));
    assert!(merge(&[first, second, second, third]).contains("name one of them"));
    let other = ["basin", "map.json", "--points", "13"];
    let others = shards(folder, &other, 3, "others");
    assert!(merge(&[first, second, &others[2]]).contains("settings"));
    let whole = fs::read(folder.join(second)).expect("readable");
    fs::write(folder.join(second), &whole[..whole.len() - 1]).expect("writable");
    assert!(merge(&[first, second, third]).contains("compute shard 2/3 again"));
    assert!(merge(&["map.json"]).contains("holds no pieces"));
    assert!(!folder.join("out").exists(), "what is refused writes nothing");
    let own = |more: &[&str]| refused(folder, &[&basin, more].concat());
    assert!(own(&["--shard", "4/3"]).contains("expected I/N"));
    assert!(own(&["--shard", "1/2", "--json", "-"]).contains("`grazemap merge`"));
}

#[test]
fn the_task_of_a_job_array_is_a_shard() {
    let folder = scratch();
    map_with(folder.path(), "");
    let task = |id: Option<&str>, variables: &[(&str, &str)]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_grazemap"));
        program.args(["basin", "map.json", "--points", "9", "-o", "out", "--shard"]);
        program.current_dir(folder.path()).envs(variables.iter().copied());
        program.envs(id.map(|id| ("SLURM_ARRAY_TASK_ID", id)));
        let output = program.output().expect("the program can be started");
        (output.status.code(), text(&output.stderr))
    };
    let array = [
        ("SLURM_ARRAY_TASK_COUNT", "2"),
        ("SLURM_ARRAY_TASK_MIN", "10"),
        ("SLURM_ARRAY_TASK_STEP", "5"),
    ];
    assert_eq!(task(Some("15"), &array).0, Some(0));
    assert!(folder.path().join("out/basin-2-of-2.pieces").exists());
    for (id, variables, word) in [
        (None, &array[..], "SLURM_ARRAY_TASK_ID is not set"),
        (Some("1"), &[], "SLURM_ARRAY_TASK_COUNT is not set"),
        (Some("12"), &array[..], "task 12"),
        (Some("20"), &array[..], "task 20"),
    ] {
        let (code, said) = task(id, variables);
        assert_eq!(code, Some(2));
        assert!(said.contains(word), "{said}");
    }
}

/// Number of iterates that the commands of this test keep.
const KEEP: u8 = 13;

/// Changes of one piece, each a place and what stands there instead of a byte: numbers of iterates,
/// sizes at the start, and some other bytes.
fn changes(piece: &[u8]) -> Vec<(usize, &'static [u8])> {
    let counts = (0..piece.len()).filter(|&at| piece[at] == KEEP);
    let counts = counts.flat_map(|at| HUGE.map(|huge| (at, huge)));
    let spread = (1..=4).map(|number| number * piece.len() / 5);
    let others = (0..piece.len().min(4)).chain(spread).enumerate();
    counts.chain(others.map(|(number, at)| (at, HUGE[number % HUGE.len()]))).collect()
}

/// Merges a file of one shard with a huge number at places of one or more of its pieces and with
/// their digests written anew. Every merge ends by itself with 2 GB of memory and without a panic.
#[cfg(unix)]
fn forged_sizes_are_harmless(folder: &Path, command: &[&str], changed: usize) {
    let file = folder.join(&shards(folder, command, 1, "pieces")[0]);
    let whole = fs::read(&file).expect("readable");
    let pieces = pieces_from_bytes(&whole).expect("a whole file");
    // The piece without a place is the header.
    let places: Vec<_> = pieces.keys().filter(|place| !place.is_empty()).collect();
    let step = places.len().div_ceil(changed).max(1);
    assert!(!places.is_empty(), "{command:?}");
    for place in places.into_iter().step_by(step) {
        for (at, huge) in changes(&pieces[place]) {
            let mut forged = pieces.clone();
            let piece = forged.get_mut(place).expect("a piece of this file");
            piece.splice(at..at + 1, huge.iter().copied());
            fs::write(&file, pieces_to_bytes(&forged)).expect("writable");
            let call = "ulimit -v 2000000 && exec \"$0\" \"$@\"";
            let mut merge = Command::new("sh");
            merge.args(["-c", call, env!("CARGO_BIN_EXE_grazemap"), "merge", "-q", "-o", "forged"]);
            let output = merge.arg(&file).args(["--threads", "1"]).current_dir(folder).output();
            let output = output.expect("a shell can be started");
            let said = text(&output.stderr);
            let case = format!("{command:?}, piece {place:?}, byte {at}");
            assert!(matches!(output.status.code(), Some(0..=2)), "{case}: {said}");
            assert!(!said.contains("panicked") && said.len() < 10_000, "{case}: {said}");
        }
    }
}

#[cfg(unix)]
#[test]
fn forged_sizes_of_pieces_neither_panic_nor_take_memory() {
    let folder = scratch();
    let folder = folder.path();
    let tables = format!(
        "[[diagram]]\nparameter = \"alpha\"\nrange = [-1e-4, 3e-4]\npoints = 12\n\
         transient = 20\nkeep = {KEEP}\nwith = [\"map\"]\n\
         [[chart]]\nparameters = [\"omega\", \"alpha\"]\nranges = [[-1e-3, 1e-3], [-1e-4, 3e-4]]\n\
         points = [6, 4]\ntransient = 20\nkeep = {KEEP}\n"
    );
    map_with(folder, &tables);
    forged_sizes_are_harmless(folder, &["diagram", "map.json"], tiers::count(1, 3));
    if tiers::are_whole() {
        forged_sizes_are_harmless(folder, &["chart", "map.json"], 2);
    }
    let basin = ["basin", "map.json", "--points", "6", "--at", "alpha=1e-4"];
    forged_sizes_are_harmless(folder, &basin, 1);
    let branch = ["branch", "map.json", "--along", "alpha", "--period", "2"];
    forged_sizes_are_harmless(folder, &branch, 1);
}

#[test]
fn a_folder_of_forged_sizes_cannot_be_unpacked() {
    // No reason for the end, then the number of files, the length of a name, and that of a file.
    let ends = [&[0][..], &[0, 1], &[1], &[0, 1, 1, b'a']];
    for (end, huge) in ends.iter().flat_map(|end| HUGE.map(|huge| (end, huge))) {
        assert_eq!(unpack_folder(&[end, huge].concat()), None, "{end:?}, {huge:?}");
    }
    assert!(unpack_folder(&[0, 1, 1, b'a', 0]).is_some());
}
