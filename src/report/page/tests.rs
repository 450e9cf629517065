use super::super::figure::{Axis, Series};
use super::super::{Cell, Column};
use super::*;

const HOSTILE: &str = "\"><script>alert('x')</script>&\u{1b}";

fn hostile_page() -> String {
    let mut figure = Figure::new(Axis::linear(HOSTILE), Axis::linear(HOSTILE));
    figure.title = HOSTILE.to_owned();
    figure.series.push(Series::dots(HOSTILE, vec![[0.0, 0.0], [1.0, 1.0]]));
    let mut table = Table::new(vec![Column::text(HOSTILE).with_unit(HOSTILE)]);
    table.push(vec![Cell::text(HOSTILE)]).expect("one cell");
    let provenance = Provenance {
        scene: HOSTILE.to_owned(),
        more: vec![(HOSTILE.to_owned(), HOSTILE.to_owned())],
        ..Provenance::default()
    };
    let section =
        Section::new(HOSTILE).prose(HOSTILE).table(table, HOSTILE).figure(figure, HOSTILE);
    let page = Page::new(HOSTILE, provenance).summary(HOSTILE).section(section);
    page.to_html().expect("a page of words")
}

#[test]
fn nothing_from_a_scene_becomes_markup() {
    let html = hostile_page();
    assert!(!html.contains("<script"));
    assert!(!html.contains('\u{1b}'));
    assert!(html.contains("&lt;script&gt;"));
}

#[test]
fn the_page_asks_for_nothing_from_a_network() {
    let html = hostile_page();
    let names_a_namespace = html.replace("http://www.w3.org/2000/svg", "");
    for reference in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!names_a_namespace.contains(reference), "{reference}");
    }
}

#[test]
fn many_dots_become_a_bitmap_and_the_caption_says_how() {
    let dot = |k: u64| {
        let bits = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        [(bits >> 40) as f64, (bits & 0xff_ffff) as f64]
    };
    let mut figure = Figure::new(Axis::linear("x"), Axis::linear("y"));
    figure.series.push(Series::dots("", (0..200_000).map(dot).collect()));
    let section = Section::new("Diagram").figure(figure, "Attractors.");
    let html = Page::new("Run", Provenance::default()).section(section).to_html().expect("drawn");
    assert!(html.contains("data:image/png;base64,"));
    assert!(html.contains("200000 points, drawn as the"));
}

#[test]
fn the_body_of_a_small_page_is_as_recorded() {
    let mut table =
        Table::new(vec![Column::text("quantity"), Column::number("value").with_unit("ns")]);
    table.push(vec![Cell::text("step"), Cell::number(17.25, 3)]).expect("two cells");
    let provenance = Provenance {
        scene: "linear rigid oscillator".to_owned(),
        version: "0.1.0".to_owned(),
        ..Provenance::default()
    };
    let section = Section::new("Speed").prose("One step.").table(table, "Cost of a step.");
    let page = Page::new("Local map", provenance).summary("All is well.").section(section);
    let html = page.to_html().expect("a page of words");
    assert_eq!(html, page.to_html().expect("the same page again"));
    let body = html.split_once("<body>").expect("a page has a body").1;
    insta::assert_snapshot!(body);
}
