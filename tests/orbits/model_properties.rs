//! Reader of scenes: no text makes it panic, and every message can be drawn.

use grazemap::model::{Scene, catalogue};
use miette::GraphicalReportHandler;
use proptest::prelude::*;

/// Reads a text; draws the message where there is one.
fn read(source: &str, overrides: &[(String, String)]) {
    if let Err(error) = Scene::parse_with(source, "random.toml", overrides) {
        assert!(!error.to_string().is_empty());
        let mut drawn = String::new();
        let handler = GraphicalReportHandler::new();
        handler.render_report(&mut drawn, &error.headline()).expect("a message can be drawn");
    }
}

/// The linear scene with `text` as the acceleration.
fn with_acceleration(text: &str) -> String {
    let scene = catalogue::text("linear").expect("in the catalogue");
    scene.replace("alpha*cos(theta) - 2*zeta*v - x", text)
}

/// Pieces of which expressions are made.
fn token() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "+",
        "-",
        "*",
        "/",
        "^",
        "(",
        ")",
        ",",
        " ",
        "x",
        "v",
        "theta",
        "alpha",
        "omega",
        "pi",
        "free",
        "sqrt(",
        "exp(",
        "log(",
        "sin(",
        "atan2(",
        "min(",
        "max(",
        "abs(",
        "sign(",
        "tanh(",
        "0",
        "1",
        "2",
        "0.5",
        "1e300",
        "1e-300",
        "7e5",
        ".",
        "e",
        "_",
        "é",
        "2147483647",
        "2147483648",
        "-2147483648",
    ])
}

/// Pieces of which scenes are made.
fn piece() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
        "=",
        ",",
        ".",
        "\n",
        "\"",
        "'",
        "\"\"\"",
        "#",
        "model",
        "states",
        "surface",
        "grazing",
        "expansion",
        "diagram",
        "nan",
        "inf",
        "-1",
        "0",
        "1e9",
        "true",
        "1979-05-27",
        "\u{0}",
        "\\u0000",
        "é",
    ])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_read_or_refused(source in any::<String>()) {
        read(&source, &[]);
    }

    #[test]
    fn any_soup_of_tokens_is_read_or_refused_as_an_expression(tokens in prop::collection::vec(token(), 0..40)) {
        read(&with_acceleration(&tokens.concat()), &[]);
    }

    #[test]
    fn any_text_is_read_or_refused_as_an_expression(text in any::<String>()) {
        read(&with_acceleration(&text.escape_default().to_string()), &[]);
        read(&with_acceleration(&text), &[]);
    }

    #[test]
    fn any_mutation_of_a_scene_is_read_or_refused(
        scene in 0..catalogue::names().count(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0..30_usize, piece()), 1..4),
    ) {
        let name = catalogue::names().nth(scene).expect("the catalogue is longer");
        let mut text = catalogue::text(name).expect("in the catalogue").to_owned();
        for (place, length, piece) in edits {
            let start = place.index(text.len());
            let start = (0..=start).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
            let end = (start + length).min(text.len());
            let end = (end..=text.len()).find(|&at| text.is_char_boundary(at)).unwrap_or(text.len());
            text.replace_range(start..end, piece);
        }
        read(&text, &[]);
    }

    #[test]
    fn any_override_is_applied_or_refused(key in "[a-z0-9_.]{0,20}|(model|grazing|diagram|window)(\\.[a-z0-9]{1,9}){1,3}", value in any::<String>()) {
        read(catalogue::text("mems").expect("in the catalogue"), &[(key, value)]);
    }
}
