//! Emitted crates: what they state, and when they are the same.

use std::fs;

use super::{files, grazemap, scratch, text};

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
