//! `grazemap locate`, `curve` and `expand`: the grazing orbit, its curve in two parameters, and the
//! coefficients of `P_smooth`, `D` and their composition.

use super::answers::told;
use super::{map, open, remark_on_window};
use crate::cli::arguments::{Asked, CurveArguments, LocateArguments, SceneOptions};
use crate::cli::output::{CliError, deliver, note};
use grazemap::convergence::Choice;
use grazemap::model::Scene;
use grazemap::numeric::Shown;
use grazemap::pipeline::{Answer, BranchPlace, CurveKeys, NearestKeys, Position, SafeKeys, Source};
use grazemap::report::{
    ChosenCoefficients, GrazeStudy, MapListing, OrbitListing, least_orders_words, window_words,
};

/// Note on the window, printed by `locate` if it makes no map.
const NOT_MEASURED: &str = "window: not measured here; `expand` measures how far from this graze \
                            its map keeps its tolerance\n";

/// Runs `grazemap locate`.
pub(in crate::cli) fn locate(options: &LocateArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let source = open(&options.scene)?;
    let source = match &options.from {
        Some(place) => from_branch(source, place, outlets.quiet)?,
        None => source,
    };
    let graze = source.clone().graze()?;
    let theory = graze.theory()?;
    let (measured, window) = match options.measure {
        true => {
            let map = map(source, outlets.quiet)?;
            (map.measure_graze(&theory.parameter)?, window_words(map.window()))
        }
        false => (Vec::new(), NOT_MEASURED.to_owned()),
    };
    let theory_parameter = theory.parameter.clone();
    let study = GrazeStudy { theory, measured };
    let listing = OrbitListing::new(graze.scene(), graze.orbit());
    let all = match options.all {
        true => orbit_text(&listing) + &study_text(&study) + "\n",
        false => "`--all` lists all parameters, digits and conditions\n".to_owned(),
    };
    let text = verdict_text(graze.scene(), &listing, &study)
        + &other_grazes_text(&theory_parameter, &listing)
        + "\n"
        + &all
        + &window;
    let mut answer = Answer::without_table("orbit", text, graze.to_json_with(&study)?);
    deliver(&mut answer, outlets)
}

/// Scene of the graze at a special point of a branch. Prints the keys that lead there, unless
/// `quiet`.
fn from_branch(source: Source, place: &BranchPlace, quiet: bool) -> Result<Source, CliError> {
    let search = source.at_branch_graze(place)?;
    if !quiet {
        let changes = search.changes.iter().map(|(key, value)| format!("{key} = {value}"));
        let changes: Vec<String> = changes.collect();
        note(&format!("note: keys of special point {}: {}", place.number, changes.join(", ")));
    }
    Ok(Source::Scene(Box::new(search.scene)))
}

/// Table of the one-contact orbits of the theory.
fn study_text(study: &GrazeStudy) -> String {
    study.orbits_table().map_or_else(String::new, |table| format!("\n{}", table.to_text()))
}

/// Other grazes found by the search, as text.
fn other_grazes_text(parameter: &str, listing: &OrbitListing) -> String {
    let others: Vec<String> =
        listing.other_grazes.iter().map(|&value| format!("{}", Shown(value))).collect();
    match others.is_empty() {
        true => String::new(),
        false => format!(
            "\nnote: along the curve of periodic orbits the nearest graze was taken; it grazes at \
             {parameter} = {} too: a value of {parameter} or a `guess` near one leads there\n",
            others.join(", ")
        ),
    }
}

/// Verdict on a graze: where it is, what happens there, and the orbit in few digits.
fn verdict_text(scene: &Scene, listing: &OrbitListing, study: &GrazeStudy) -> String {
    let surfaces: Vec<String> =
        listing.surfaces().iter().map(|surface| format!("`{surface}`")).collect();
    let adjusted = scene.grazing.solve_for.iter().map(|&number| {
        let name = &scene.model.parameters[number].name;
        let value = listing.parameters.get(name).copied().unwrap_or(f64::NAN);
        format!("{name} = {}", Shown(value))
    });
    let adjusted = adjusted.collect::<Vec<_>>().join(", ");
    let mut text =
        format!("`{}` grazes {} at {adjusted}\n", scene.identifier, surfaces.join(", then "));
    for words in study.words() {
        text.push_str(&format!("{words}\n"));
    }
    if let Some(words) = study.instability() {
        text.push_str(&format!("note: {words}\n"));
    }
    text.push_str(&format!("section: {}\n\n", listing.section.words()));
    text.push_str(&listing.summary_table().to_text());
    if let Some(hits) = listing.hits_table() {
        text.push_str(&format!("\nhits of a period\n\n{}", hits.to_text()));
    }
    for surface in &scene.grazing.hits.surfaces {
        let name = &scene.model.surfaces[*surface].name;
        if !listing.hits.iter().any(|hit| hit.surface == *name) {
            text.push_str(&format!("note: the orbit does not hit `{name}`, which `hits` names\n"));
        }
    }
    text
}

/// All digits of the orbit, its passages and conditions.
fn orbit_text(document: &OrbitListing) -> String {
    let mut text = document.point_table().to_text();
    if document.passages.len() > 1 {
        let passages = document.passages_table().to_text();
        let conditions = document.conditions_table().to_text();
        text.push_str(&format!(
            "\npassages of a period\n\n{passages}\nxi_n from passage to passage\n\n{conditions}"
        ));
    }
    text
}

/// Runs `grazemap curve`: the grazing curve in two parameters, or its point nearest to the scene.
pub(in crate::cli) fn curve(options: &CurveArguments) -> Result<(), CliError> {
    let source = open(&options.scene)?;
    let second = options.along.as_ref().or(options.with.as_ref());
    let outlets = &options.scene.common.outlets;
    told("curve", outlets, |bar| match (second, options.from, options.to) {
        (Some(second), Some(from), Some(to)) => {
            let are_values = options.with.is_some() || options.counting.values;
            let offsets_from = match are_values {
                true => 0.0,
                false => value(source.scene(), second),
            };
            let [from, to] = [from, to].map(|end| match end {
                Position::Offset(offset) => offsets_from + offset,
                Position::Value(value) => value,
            });
            let keys = CurveKeys { along: second.clone(), from, to, xi: options.xi };
            keys.answer(source.scene(), bar)
        }
        _ => {
            let scale = options.scale.clone().unwrap_or_default();
            let keys = NearestKeys { nearest: options.nearest.clone(), scale };
            keys.answer(source.scene(), bar)
        }
    })
}

/// Safety of a scene.
pub(in crate::cli) fn safe(asked: &Asked<SafeKeys>) -> Result<(), CliError> {
    let Asked { scene, keys } = asked;
    let source = open(scene)?;
    told("safe", &scene.common.outlets, |bar| keys.answer(source.scene(), bar))
}

/// Value of a parameter in a scene; 0 for another name, which the command refuses.
fn value(scene: &Scene, name: &str) -> f64 {
    let mut parameters = scene.model.parameters.iter();
    parameters.find(|parameter| parameter.name == name).map_or(0.0, |known| known.value.to_f64())
}

pub(in crate::cli) fn expand(options: &SceneOptions) -> Result<(), CliError> {
    let map = map(open(options)?, options.common.outlets.quiet)?;
    let listing = map.listing()?;
    remark_on_window(&map, options.common.outlets.quiet);
    let choice = map.choice().map_or_else(String::new, choice_words);
    let text = expansion_text(map.scene(), listing) + &window_words(&listing.window) + &choice;
    let mut answer = Answer::new("map", text, map.to_json()?, listing.coefficient_table());
    deliver(&mut answer, &options.common.outlets)
}

/// Coefficients and least orders of a choice of orders, as text.
fn choice_words(choice: &Choice) -> String {
    let coefficients = ChosenCoefficients::of(choice).words();
    let least = least_orders_words(choice);
    let words = format!("{coefficients}\n{}", least.trim_start());
    words.trim_end().to_owned() + "\n"
}

/// Sizes of the expansion, as text.
fn expansion_text(scene: &Scene, document: &MapListing) -> String {
    let orders = document.orders;
    let laws = document.depth.iter().enumerate().map(|(passage, laws)| {
        let contact = document.discontinuity.get(passage);
        match contact.and_then(|contact| contact.surface.as_ref()) {
            Some(surface) => format!("passage {} at `{surface}`\n{}", passage + 1, laws.words()),
            None => laws.words(),
        }
    });
    let laws: String = laws.collect();
    format!(
        "expansion of `{}`: P_smooth to degree {}, D to weight {}\nsection: {}\n{}{}\nterms\n{}",
        scene.identifier,
        orders.smooth_order,
        orders.contact_weight,
        document.section.words(),
        document.section.decision_line(),
        laws,
        document.size_table().to_text()
    )
}
