//! Emitted crates: their statements, and their reproducibility.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use grazemap::emission::EmittedCrate;

use super::{QUICK, files, grazemap, scratch, text};
use crate::support::driver::rustc;

#[test]
fn an_emitted_crate_checks_until_it_is_touched() {
    let folder = scratch();
    let emit = |arguments: &[&str]| {
        grazemap(folder.path(), &[&["emit", "linear", "-o", "crate"], arguments].concat())
            .status
            .code()
    };
    assert_eq!(emit(&[]), Some(0));
    assert_eq!(emit(&["--check"]), Some(0));
    assert_eq!(emit(&["--check", "--target", "c"]), Some(1), "no header is there");
    assert_eq!(emit(&["--target", "c"]), Some(0));
    assert_eq!(emit(&["--check", "--target", "c"]), Some(0));
    assert_eq!(emit(&["--check", "--set", "expansion.smooth_order=4"]), Some(1));
    fs::write(folder.path().join("crate/src/linear.rs"), "").expect("writable");
    assert_eq!(emit(&["--check"]), Some(1));
}

#[test]
fn a_crate_emitted_for_a_tolerance_states_the_measured_error_and_is_the_same_twice() {
    let folder = scratch();
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let tolerant = linear
        .replace("smooth_order = 5\n", "tolerance = 1e-6\n")
        .replace("contact_weight = 6\n", "");
    fs::write(folder.path().join("linear.toml"), tolerant).expect("writable");
    let emit = |scene: &str, output: &str, options: &[&str]| {
        let arguments = [&["emit", scene, "-o", output], options].concat();
        let done = grazemap(folder.path(), &arguments);
        assert!(done.status.success(), "{}", text(&done.stderr));
        let sources = files(&folder.path().join(output));
        let texts = sources.iter().map(|path| fs::read_to_string(path).unwrap_or_default());
        texts.collect::<String>()
    };
    let constant = |source: &str, name: &str| -> Option<f64> {
        let line = source.lines().find(|line| line.contains(&format!("const {name}:")));
        let value = line.and_then(|line| line.split("Some(").nth(1))?;
        value.split(')').next()?.parse().ok()
    };
    let tolerant = emit("linear.toml", "a", &[]);
    assert_eq!(constant(&tolerant, "TOLERANCE"), Some(1e-6));
    assert!(tolerant.contains("Coefficients: economised"), "{tolerant}");
    let error = constant(&tolerant, "MEASURED_ERROR").expect("measured");
    // Rounded up to two digits, at most a tenth.
    assert!((1e-9..=1.1e-6).contains(&error), "{error:e}");
    assert_eq!(tolerant, emit("linear.toml", "b", &[]));
    let stated = emit("linear", "c", &[]);
    let error = constant(&stated, "MEASURED_ERROR").expect("measured");
    assert!((1e-9..1e-6).contains(&error), "{error:e}");
    assert_eq!(stated, emit("linear", "d", &["--measure"]));
    let unmeasured = emit("linear", "e", &["--no-measure"]);
    assert_eq!(constant(&unmeasured, "MEASURED_ERROR"), None);
    assert!(unmeasured.contains("error on the window not measured"), "{unmeasured}");
}

/// A map is chosen in the form with the fewest operations, whose error differs from the factored
/// form's.
#[test]
fn code_that_errs_more_than_its_tolerance_is_emitted_with_a_warning_and_the_figure() {
    let folder = scratch();
    let scene = grazemap::model::catalogue::text("impact_pair").expect("in the catalogue");
    let orders = |line: &&str| !line.starts_with("contact_weight");
    let lines = scene.lines().filter(orders).map(|line| match line.starts_with("smooth_order") {
        true => "tolerance = 1e-7",
        false => line,
    });
    let tolerant = lines.collect::<Vec<_>>().join("\n");
    fs::write(folder.path().join("pair.toml"), tolerant).expect("writable");
    let done = grazemap(folder.path(), &["emit", "pair.toml", "-o", "a", "--json", "-"]);
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    let module = &json["modules"][0];
    let error = module["measured_error"].as_f64().expect("measured");
    let errors = module["window"]["errors"].as_array().expect("by coordinate").iter();
    let largest = errors.filter_map(|error| error["error"].as_f64()).fold(0.0, f64::max);
    assert_eq!(error, largest, "{module}");
    let said = text(&done.stderr);
    assert!(error > 1e-7, "{error:e}");
    assert!(said.contains("more than 1e-7, as the scene states"), "{error:e}: {said}");
}

/// Files under a folder, with their bytes.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let paths = files(folder).into_iter();
    paths.map(|path| (path.clone(), fs::read(&path).expect("readable"))).collect()
}

/// Runs the command in a line of the header, by a shell in the folder of the file.
fn run_line(file: &Path, heading: &str) -> Output {
    let source = fs::read_to_string(file).expect("emitted");
    let line = source.lines().find_map(|line| line.split_once(heading)).expect("in the header").1;
    let program = Path::new(env!("CARGO_BIN_EXE_grazemap")).parent().expect("in a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    Command::new("bash")
        .args(["-c", line])
        .current_dir(file.parent().expect("in a folder"))
        .env("PATH", format!("{}:{path}", program.display()))
        .output()
        .expect("bash is there")
}

#[test]
fn the_lines_of_an_emitted_file_reproduce_it_from_the_folder_it_lies_in() {
    let folder = scratch();
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    fs::create_dir(folder.path().join("my scenes")).expect("writable");
    fs::write(folder.path().join("my scenes/it's \u{e9} 1.toml"), linear).expect("writable");
    let named = "my scenes/it's \u{e9} 1.toml";
    let set =
        ["--set", "r=0.7", "--set", "emit.shape=\"composed\"", "--set", "window.depth = 2e-3"];
    let ways: [(&[&str], &str); 4] = [
        (&["emit", named, "-o", "deep/crate"], "deep/crate/src/it_s___1.rs"),
        (&["emit", "linear", "--target", "c", "--measure", "-o", "."], "linear.h"),
        (&["emit", named, "--target", "cuda"], "out/cuda/it_s___1.cu"),
        (&["run", named, "-q"], "out/crate/src/it_s___1.rs"),
    ];
    for (arguments, file) in ways {
        let quick = if arguments[0] == "run" { &QUICK[..] } else { &[] };
        let done = grazemap(folder.path(), &[arguments, &set, quick].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        let file = folder.path().join(file);
        let made = fs::read(&file).expect("emitted");
        let checked = run_line(&file, "Verify: ");
        assert!(checked.status.success(), "{}", text(&checked.stderr));
        fs::write(&file, [&made[..], b"// changed\n"].concat()).expect("writable");
        assert_eq!(run_line(&file, "Verify: ").status.code(), Some(1));
        let again = run_line(&file, "Regenerate: ");
        assert!(again.status.success(), "{}", text(&again.stderr));
        assert!(fs::read(&file).expect("emitted") == made, "{} is another", file.display());
    }
}

#[test]
fn what_a_person_wrote_is_not_replaced_and_nothing_else_is_written() {
    let folder = scratch();
    let own: [(&str, &[&str]); 4] = [
        ("Cargo.toml", &["emit", "linear", "-o", "."]),
        ("src/lib.rs", &["emit", "linear", "-o", "."]),
        ("linear.h", &["emit", "linear", "--target", "c", "-o", "."]),
        ("out/crate/src/linear.rs", &["run", "linear"]),
    ];
    for (name, arguments) in own {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("in a folder")).expect("writable");
        fs::write(&path, "[package]\n# not @generated by grazemap\n").expect("writable");
        let before = contents(folder.path());
        let refused = grazemap(folder.path(), arguments);
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains("was not emitted by grazemap and is not replaced"), "{said}");
        assert!(said.contains(Path::new(name).file_name().expect("named").to_str().expect("text")));
        assert!(contents(folder.path()) == before, "{name}: something was written");
        fs::remove_file(path).expect("writable");
    }
    let library = grazemap::pipeline::write_emitted;
    let file = ("src/lib.rs".to_owned(), "// @generated by grazemap\n".into());
    let emitted = EmittedCrate { files: BTreeMap::from([file]) };
    fs::write(folder.path().join("src/lib.rs"), "//! mine\n").expect("writable");
    assert!(library(&emitted, folder.path()).is_err());
    fs::write(folder.path().join("src/lib.rs"), "// @generated by grazemap 0.0.1\n")
        .expect("writable");
    assert!(library(&emitted, folder.path()).is_ok());
}

#[test]
fn scenes_named_as_crates_types_and_words_of_rust_give_crates_that_compile() {
    let folder = scratch();
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let long = "7".repeat(70);
    for name in ["core", "std", "alloc", "fn", "union", "lib", "main", "f64", "self", "step", &long]
    {
        fs::write(folder.path().join(format!("{name}.toml")), linear).expect("writable");
        let scene = format!("{name}.toml");
        let least = ["--set", "expansion.smooth_order=1", "--set", "expansion.contact_weight=1"];
        let arguments = [&["emit", &scene, "-o", name][..], &least].concat();
        let done = grazemap(folder.path(), &arguments);
        assert!(done.status.success(), "{}", text(&done.stderr));
        let root = folder.path().join(name);
        let library = ["--crate-type", "lib", "--crate-name", "a", "src/lib.rs"];
        rustc(&[&library[..], &["--emit=metadata", "--cfg", "feature=\"std\""]].concat(), &root);
        rustc(&[&library[..], &["--emit=metadata"]].concat(), &root);
    }
}
