//! `grazemap branch`: branches of periodic orbits in one parameter.

use super::orbits::{Parameters, itineraries, longest_period};
use super::sweeps::pictures;
use super::{map, open, remark_on_window};
use crate::cli::arguments::{BranchArguments, OrbitsUsing};
use crate::cli::output::{Bar, CliError, Results, counted, note};
use grazemap::Map;
use grazemap::analysis::branches::{BranchDiagram, BranchRequest};
use grazemap::analysis::itinerary;
use grazemap::report::{BranchListing, Document, DocumentKind, to_json};

pub(in crate::cli) fn run(options: &BranchArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let request = request(options, &map)?;
    remark_on_window(&map, outlets.quiet);
    let found = map.branches(&request, &Bar::new("branch", outlets.quiet))?;
    let names = itinerary(map.scene(), map.orbit());
    let polynomials = (map.local(), map.window(), map.window_edges());
    let kind = (request.along, request.direct);
    let listing = BranchListing::new(map.section(), polynomials, &names, &found, kind);
    let observed = options.observe.iter().map(|&option| {
        let observable = option.into();
        Ok((observable, map.branch_observable(&found, observable)?))
    });
    let listing = listing.with_observed(&observed.collect::<Result<Vec<_>, CliError>>()?);
    let diagram = match outlets.output.is_some() {
        true => Some(map.branch_diagram(&request, &found)?),
        false => None,
    };
    results(&map, &listing, diagram)?.deliver("branch", outlets)?;
    if !outlets.quiet {
        warn(&listing);
    }
    match listing.branches.is_empty() {
        true => Err(CliError::NoBranch { itineraries: request.itineraries.len() }),
        false => Ok(()),
    }
}

fn request(options: &BranchArguments, map: &Map) -> Result<BranchRequest, CliError> {
    let parameters = Parameters { scene: map.scene(), map: map.local() };
    let along = parameters.place("--along", options.along.trim())?;
    let passages = map.local().passages();
    let longest = longest_period(options.period, passages);
    let named = itineraries(&options.which.itinerary, options.period, passages)?;
    let named_longest = named.iter().map(|itinerary| itinerary.period()).max();
    let at = options.stretch.at.as_ref().map(|at| parameters.offsets(at)).transpose()?;
    Ok(BranchRequest {
        longest: longest.max(named_longest.unwrap_or(1)),
        itineraries: named,
        along,
        range: [
            parameters.end("--from", options.stretch.from, (along, -1.0))?,
            parameters.end("--to", options.stretch.to, (along, 1.0))?,
        ],
        at: at.unwrap_or_else(|| parameters.one(along, 0.0)),
        direct: options.which.using == OrbitsUsing::Direct,
    })
}

/// Data, and pictures where they are asked for, over iterates where the scene has a diagram.
fn results(
    map: &Map,
    listing: &BranchListing,
    drawn: Option<Option<BranchDiagram>>,
) -> Result<Results, CliError> {
    let json = to_json(&Document::new(DocumentKind::Branch, map.scene(), listing))?;
    let csv = listing.data_table()?.to_csv()?;
    let mut files = vec![
        ("branch.json".to_owned(), json.clone().into_bytes()),
        ("branch.csv".to_owned(), csv.clone().into_bytes()),
    ];
    if let Some(diagram) = drawn {
        for (ending, figure) in listing.figures(diagram.as_ref()) {
            files.extend(pictures(&format!("branch{ending}"), &figure));
        }
    }
    Ok(Results { text: text(map, listing)?, json, csv: Some(csv), files })
}

/// The branches as a person reads them: their special points.
fn text(map: &Map, listing: &BranchListing) -> Result<String, CliError> {
    let using = match listing.using {
        "direct" => "direct simulation",
        _ => "the map",
    };
    let points = listing.branches.iter().map(|branch| branch.points.len()).sum();
    Ok(format!(
        "branches of `{}` in {} by {using}: {} with {}; offsets on the {}\n\n{}",
        map.scene().identifier,
        listing.along,
        listing.branches.len(),
        counted(points, "point"),
        listing.section.words(),
        listing.special_table()?.to_text()
    ))
}

/// Says what may not be trusted, or not be all.
fn warn(listing: &BranchListing) {
    let points = listing.branches.iter().flat_map(|branch| &branch.points);
    let physical: Vec<_> = points.filter(|point| point.orbit.physical).collect();
    let outside = physical.iter().filter(|point| !point.orbit.inside).count();
    if outside > 0 && listing.using == "map" {
        note(&format!(
            "warning: {outside} of {} physical points are outside the window, where the map has \
             not been measured; --using direct asks direct simulation",
            physical.len()
        ));
    }
    let unresolved = listing.branches.iter().filter(|branch| !branch.unresolved.is_empty()).count();
    if unresolved > 0 {
        note(&format!(
            "warning: on {} more special points may lie than were found; \
             `unresolved` in the JSON says where",
            counted(unresolved, "branch")
        ));
    }
}
