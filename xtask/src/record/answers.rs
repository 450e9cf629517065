//! Records of commands of the pipeline: branches, loci, crises, searches, grazing curves, basins,
//! manifolds, fits, noise, windows and choices of orders.
//!
//! A document writes every number with the digits that give it back, so that the hash of its text
//! is one of all bits.

use grazemap::analysis::NoProgress;
use grazemap::analysis::fit::MeasuredSeries;
use grazemap::convergence::Choice;
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::decimal_below;
use grazemap::pipeline::{BasinKeys, Command, Extent, FitKeys, Results as _, Source};
use grazemap::report::to_json;
use grazemap::{Error, Map};

use super::hash::{Hash, Scatter};
use super::questions::{OPEN_WINDOWS, Question, TOLERANCES};
use super::recorder::Page;
use super::subject::{On, Subjects};

/// Series of a fit, and the number of points in each.
const SERIES: usize = 8;
const POINTS: usize = 4;
/// Parameters at which the series are measured, starts, and rounding of the measurement, in
/// half-widths of the window.
const TRUTH: f64 = 0.05;
const START: f64 = 0.2;
const ROUNDING: f64 = 1e-4;

/// Members of a document that name the program and the text of the scene, and a measured time:
/// they hold no result.
pub(super) const STAMPS: [&str; 4] = ["version", "digest", "integrity", "seconds"];

/// Records answers of commands.
pub(super) fn commands(subjects: &Subjects, page: &mut Page, questions: &[Question]) {
    each(subjects, page, questions, |map, keys| {
        let command = Command::from_json(keys).expect("a command of the library");
        let answer = command.answer(Source::Map(map.clone()), &NoProgress)?;
        Ok(answer.document)
    });
}

/// Records basins of attraction, some with manifolds.
pub(super) fn basins(subjects: &Subjects, page: &mut Page, questions: &[Question]) {
    each(subjects, page, questions, |map, keys| {
        let keys: BasinKeys = serde_json::from_str(keys).expect("keys of a basin");
        let mut basin = map.drawn_basins(&[keys.request(map)?], &NoProgress)?;
        Ok(basin.document(Extent::Whole)?)
    });
}

/// Records parameters fitted to returns of direct simulation that are measured in a few digits.
pub(super) fn fits(subjects: &Subjects, page: &mut Page, questions: &[Question]) {
    each(subjects, page, questions, |map, keys| {
        let keys: FitKeys = serde_json::from_str(keys).expect("keys of a fit");
        let series = series(subjects, map)?;
        Ok(keys.answer(map, series, &NoProgress)?.document)
    });
}

/// Records windows that are measured because the scene leaves them open.
pub(super) fn windows(subjects: &Subjects, page: &mut Page) {
    if !OPEN_WINDOWS.contains(&subjects.name) {
        return;
    }
    let map = without_window(subjects.name).and_then(|scene| mapped(scene).ok());
    let text = map.map(|map| to_json(&(map.window(), map.window_edges())));
    page.put_or("open", text.and_then(Result::ok).as_deref().map(of_document));
}

/// Records orders that are chosen for a tolerance.
pub(super) fn choices(subjects: &Subjects, page: &mut Page) {
    for &(name, tolerance) in TOLERANCES.iter().filter(|(name, _)| *name == subjects.name) {
        let overrides = [("expansion.tolerance".to_owned(), tolerance.to_owned())];
        let scene = catalogue::text(name).map(|text| Scene::parse_with(text, name, &overrides));
        let map = scene.and_then(Result::ok).and_then(|scene| mapped(scene).ok());
        let choice = map.as_ref().and_then(Map::choice);
        let text = choice.map(|choice| to_json(&Choice { seconds: 0.0, ..choice.clone() }));
        page.put_or(tolerance, text.and_then(Result::ok).as_deref().map(of_document));
    }
}

/// Records the documents of all questions about a scene.
fn each(
    subjects: &Subjects,
    page: &mut Page,
    questions: &[Question],
    document: impl Fn(&Map, &str) -> Result<String, Error>,
) {
    for question in questions.iter().filter(|question| question.scene == subjects.name) {
        let document = subjects.map().and_then(|map| document(map, question.keys).ok());
        page.put_or(question.variant, document.as_deref().map(of_document));
    }
}

/// Hash of a document without its stamps.
fn of_document(document: &str) -> Hash {
    let is_stamp = |line: &&str| {
        let name = line.trim_start().strip_prefix('"').and_then(|line| line.split('"').next());
        name.is_some_and(|name| STAMPS.contains(&name))
    };
    let lines: Vec<&str> = document.lines().filter(|line| !is_stamp(line)).collect();
    Hash::of(&lines.join("\n"))
}

/// Map of a scene.
fn mapped(scene: Scene) -> Result<Map, Error> {
    Source::Scene(Box::new(scene)).map()
}

/// Scene of the catalogue without the bounds of its window.
fn without_window(name: &str) -> Option<Scene> {
    let (before, after) = catalogue::text(name)?.split_once("[window]")?;
    let rest = after.find("\n[").map_or("", |next| &after[next..]);
    Scene::parse_with(&format!("{before}{rest}"), name, &[]).ok()
}

/// Series of returns by direct simulation, rounded as a measurement is.
fn series(subjects: &Subjects, map: &Map) -> Result<Vec<MeasuredSeries>, Error> {
    let [states, parameters] = subjects.on(On::Own).expect("a scene with a map").widths();
    let mut scatter = Scatter::of(subjects.name);
    let truth: Vec<f64> = parameters.iter().map(|width| TRUTH * width).collect();
    let mut all = Vec::new();
    for _ in 0..SERIES {
        let mut state: Vec<f64> =
            states.iter().map(|width| START * width * scatter.next()).collect();
        let mut points = Vec::new();
        while points.len() < POINTS && state.iter().all(|offset| offset.is_finite()) {
            let units = states.iter().map(|width| decimal_below(ROUNDING * width, 1));
            let point =
                state.iter().zip(units).map(|(offset, unit)| (offset / unit).round() * unit);
            points.push(point.collect());
            state = map.simulate(&state, &truth)?.offsets;
        }
        all.push(MeasuredSeries { controls: vec![0.0; truth.len()], points });
    }
    Ok(all)
}
