//! Part of the record of results that a change of the code must not change; `cargo run --release -p
//! xtask -- record` compares all of it.

use xtask::record::recorder::{self, Scenes, computed, differences, groups_of, is_of, recorded};
use xtask::record::{golden_text, scenes};

/// Scenes, and groups that are compared in a few seconds.
const PARTS: [(&str, &[&str]); 3] = [
    ("linear", &["orbits", "jets", "images", "sweeps", "emitted"]),
    ("mems", &["orbits", "lanes", "emitted"]),
    ("soft_b", &["orbits", "jets", "emitted"]),
];

#[test]
fn results_are_those_of_the_record_to_the_last_bit() {
    for (scene, parts) in PARTS {
        let computed = computed(scene, parts);
        let mut all = recorder::Lines::new();
        for part in parts {
            all.extend(recorded(part).expect("a file of the record"));
        }
        all.retain(|line, _| is_of(line, parts, &[scene]));
        assert!(all.len() >= parts.len());
        let differences = differences(&all, &computed);
        assert!(differences.is_empty(), "{}", differences.join("\n"));
    }
}

#[test]
fn a_number_of_a_golden_text_has_twelve_digits_in_quotes_too() {
    for (text, expected) in [
        ("0.1", "0.1"),
        ("-2.247220505424423", "-2.24722050542e0"),
        ("123456789012345", "1.23456789012e14"),
        ("[0.0003,1.8e-5,4.33e-48,-0.0]", "[0.0003,1.8e-5,0,-0]"),
        ("\"8140.865230662105*d + v1\"", "\"8.14086523066e3*d + v1\""),
    ] {
        assert_eq!(golden_text(text), expected);
    }
}

#[test]
fn the_record_is_of_every_scene_that_it_names_and_of_no_other() {
    let scenes: Vec<_> = scenes().collect();
    for group in groups_of(Scenes::All) {
        let lines = recorded(group).expect("a file of the record");
        assert!(lines.keys().all(|line| is_of(line, &[group], &scenes)));
        for scene in &scenes {
            let mut lines = lines.keys();
            assert!(lines.any(|line| is_of(line, &[group], &[scene])), "{scene}");
        }
    }
}
