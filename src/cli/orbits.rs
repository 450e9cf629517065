//! `grazemap orbits`: periodic orbits by itinerary, their stability, folds and flips.

use super::error::CliError;
use super::orbits_arguments::OrbitsArguments;
use super::orbits_request::request;
use super::output::{Results, note};
use super::prepare::{grazing_orbit, prepare, settle};
use super::progress::Bar;
use super::window_edge::local_map;
use grazemap::analysis::itinerary;
use grazemap::analysis::orbits::{OrbitsRequest, orbits};
use grazemap::report::{OrbitsDocument, to_dense_json};

pub(super) fn run(options: &OrbitsArguments) -> Result<(), CliError> {
    let common = &options.scene.common;
    let scene = prepare(&options.scene)?.scene;
    let orbit = grazing_orbit(&scene)?;
    let settled = settle(&scene, &orbit, common.quiet)?;
    let (map, edges) = local_map(&settled, common.quiet)?;
    let request = request(options, &settled.scene, &map)?;
    let bar = Bar::new("orbits", common);
    let found = orbits(&settled.scene, &settled.orbit, &map, &request, &bar)?;
    drop(bar);
    let names = itinerary(&settled.scene, &settled.orbit);
    let document = OrbitsDocument::new(&settled, (&map, &edges), &names, &found, request.direct);
    results(&document)?.deliver("orbits", common)?;
    if !common.quiet {
        warn(&document);
    }
    judge(&request, &document)
}

/// The orbits, and the loci where asked for; the table is that of the loci then.
fn results(document: &OrbitsDocument) -> Result<Results, CliError> {
    let json = to_dense_json(document)?;
    let orbits = document.data_table()?.to_csv()?;
    let mut files = vec![
        ("orbits.json".to_owned(), json.clone().into_bytes()),
        ("orbits.csv".to_owned(), orbits.clone().into_bytes()),
    ];
    let mut csv = orbits;
    if document.loci.is_some() {
        csv = document.loci_data_table()?.to_csv()?;
        files.push(("loci.csv".to_owned(), csv.clone().into_bytes()));
    }
    Ok(Results {
        text: text(document)?,
        json,
        csv: Some(csv),
        files,
    })
}

/// The orbits as a person reads them.
fn text(document: &OrbitsDocument) -> Result<String, CliError> {
    let using = match document.using {
        "direct" => "direct simulation",
        _ => "the map",
    };
    let passages: Vec<String> = document
        .passages
        .iter()
        .map(|name| format!("`{name}`"))
        .collect();
    let mut text = format!(
        "periodic orbits of `{}` by {using}; offsets on the {}\nitinerary: return by return, 1 where the passage of {} makes contact, 0 where not\n\n{}",
        document.scene,
        document.section.words(),
        passages.join(", then of "),
        document.table()?.to_text()
    );
    text.push_str(&virtual_words(document));
    if document.loci.is_some() {
        text.push_str(&format!(
            "\nfolds and flips\n\n{}",
            document.loci_table()?.to_text()
        ));
    }
    Ok(text)
}

/// What is said of orbits that the map does not go.
fn virtual_words(document: &OrbitsDocument) -> String {
    let count = document.orbits.iter().filter(|orbit| !orbit.physical);
    match (count.count(), document.any_physical()) {
        _ if document.using == "direct" => String::new(),
        (0, _) => String::new(),
        (_, false) => {
            "\nvirtual: on a branch of the root that the map does not take; no orbit is physical\n"
                .to_owned()
        }
        (count, true) => format!(
            "\nvirtual orbits, on a branch of the root that the map does not take: {count}; JSON and CSV have them\n"
        ),
    }
}

/// Says which orbits were outside the window, and which direct simulation has not.
fn warn(document: &OrbitsDocument) {
    let points = document
        .loci
        .iter()
        .flatten()
        .flat_map(|locus| &locus.points);
    let physical = document.orbits.iter().chain(points);
    let physical: Vec<_> = physical.filter(|orbit| orbit.physical).collect();
    let outside = physical.iter().filter(|orbit| !orbit.inside).count();
    if outside > 0 && document.using == "map" {
        note(&format!(
            "warning: {outside} of {} orbits are outside the window, where the map has not been measured; --using direct asks direct simulation for them",
            physical.len()
        ));
    }
    for lost in &document.lost {
        let parameters = lost.parameters.0.iter();
        let parameters: Vec<String> = parameters
            .map(|(name, value)| format!("{name} = {value:e}"))
            .collect();
        note(&format!(
            "warning: direct simulation has no orbit next to the map's of itinerary {} at {}: {}",
            lost.itinerary,
            parameters.join(", "),
            lost.reason
        ));
    }
}

/// Nothing found is mathematics that ended otherwise.
fn judge(request: &OrbitsRequest, document: &OrbitsDocument) -> Result<(), CliError> {
    let itineraries = request.itineraries.len();
    match (&document.loci, &request.loci) {
        (Some(loci), Some(asked)) if loci.is_empty() => {
            let kinds: Vec<_> = asked.kinds.iter().map(|kind| kind.word()).collect();
            let kinds = kinds.join(" or ");
            Err(CliError::NoLoci { kinds, itineraries })
        }
        (None, _) if document.orbits.is_empty() => Err(CliError::NoOrbits {
            itineraries,
            at: request.at.len(),
        }),
        _ => Ok(()),
    }
}
