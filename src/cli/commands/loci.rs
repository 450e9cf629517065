//! `grazemap loci`: saddle-nodes, flips, Neimark–Sacker points and grazes in two parameters.

use super::orbits::{ACTIVE, named_offsets, place_of};
use super::sweeps::pictures;
use super::{map, open, remark_on_window};
use crate::cli::arguments::{LociArguments, OrbitsUsing};
use crate::cli::output::{Bar, CliError, Results, note};
use grazemap::Map;
use grazemap::analysis::loci::{LociRequest, LocusKind};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::model::ChartRequest;
use grazemap::report::{Document, DocumentKind, Figure, LociListing, chart_figure, to_json};

/// Passages of the longest period whose loci are looked for where none is named.
const DEFAULT_PASSAGES: usize = 2;

pub(in crate::cli) fn run(options: &LociArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let request = request(options, &map)?;
    remark_on_window(&map, outlets.quiet);
    let found = map.loci(&request, &Bar::new("loci", outlets.quiet))?;
    let listing =
        LociListing::new(map.section(), map.local(), request.plane, &found, request.direct);
    let results = results(&map, &listing)?;
    results.deliver("loci", outlets)?;
    if !outlets.quiet {
        warn(&listing);
    }
    match listing.loci.is_empty() {
        true => Err(CliError::NoLoci {
            kinds: request.kinds.iter().map(|kind| kind.word()).collect::<Vec<_>>().join(" or "),
            searched: searched(&request),
        }),
        false => Ok(()),
    }
}

/// What the options ask for, in numbers.
fn request(options: &LociArguments, map: &Map) -> Result<LociRequest, CliError> {
    let local = map.local();
    let names: Vec<&str> = local.parameters.iter().map(|active| active.name.as_str()).collect();
    let place = |name: &String| place_of("--in", ACTIVE, name.trim(), &names);
    let plane = options.plane.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    let plane = match plane[..] {
        [first, second] if first == second => {
            return Err(CliError::NamedTwice { flag: "--in", name: options.plane[0].clone() });
        }
        [first, second] => [first, second],
        _ => return Err(CliError::NotAPlane { found: plane.len() }),
    };
    let width = local.window.parameter[plane[0]];
    let end = |flag, given: Option<f64>, default: f64| match given.unwrap_or(default) {
        value if value.is_finite() => Ok(value),
        value => Err(CliError::NotFinite { flag, value }),
    };
    let range =
        [end("--from", options.stretch.from, -width)?, end("--to", options.stretch.to, width)?];
    let at = match &options.stretch.at {
        Some(named) => named_offsets("--at", ACTIVE, named, &names)?,
        None => vec![0.0; names.len()],
    };
    let passages = local.passages();
    let itineraries = match options.which.itinerary.is_empty() {
        true => ContactItinerary::all(passages, (DEFAULT_PASSAGES / passages.max(1)).max(1)),
        false => {
            let named = options.which.itinerary.iter();
            named.map(|digits| ContactItinerary::parse(digits, passages)).collect()
        }
    };
    let itineraries = itineraries?.into_iter().filter(|itinerary| itinerary.contacts() > 0);
    let kinds = match options.kind.is_empty() {
        true => LocusKind::LOCAL.to_vec(),
        false => options.kind.iter().map(|&kind| kind.into()).collect(),
    };
    Ok(LociRequest {
        plane,
        range,
        at,
        kinds,
        itineraries: itineraries.collect(),
        direct: options.which.using == OrbitsUsing::Direct,
    })
}

fn results(map: &Map, listing: &LociListing) -> Result<Results, CliError> {
    let json = to_json(&Document::new(DocumentKind::Loci, map.scene(), listing))?;
    let csv = listing.data_table()?.to_csv()?;
    let mut results = Results::named("loci", text(map, listing)?, json, Some(csv));
    results.files.extend(pictures("loci", &listing.figure(under(map, listing)?)));
    if let Some(figure) = listing.figure_from_graze() {
        results.files.extend(pictures("loci_from_graze", &figure));
    }
    Ok(results)
}

/// The scene's first chart in these parameters, drawn.
fn under(map: &Map, listing: &LociListing) -> Result<Option<Figure>, CliError> {
    let names = |request: &ChartRequest| {
        request.parameters.map(|place| map.scene().model.parameters[place].name.clone())
    };
    let mut charts = map.scene().charts.iter();
    let Some(request) = charts.find(|request| names(request) == listing.plane) else {
        return Ok(None);
    };
    let bare = ChartRequest { overlay: Vec::new(), ..request.clone() };
    Ok(map.chart(&bare)?.first().map(chart_figure))
}

/// The loci as a person reads them.
fn text(map: &Map, listing: &LociListing) -> Result<String, CliError> {
    let [first, second] = &listing.plane;
    let using = match listing.using {
        "direct" => "direct simulation",
        _ => "the map",
    };
    let mut text = format!(
        "loci of `{}` in {first} and {second} by {using}; offsets from the graze\n\n{}",
        map.scene().identifier,
        listing.table()?.to_text()
    );
    for (number, locus) in listing.crises() {
        text.push_str(&format!(
            "\nlocus {number}: an attractor touches the stable manifold of the saddle {}, which it \
             is followed to from the saddle by {}\n",
            locus.itinerary,
            locus.excursion.as_deref().unwrap_or_default()
        ));
    }
    if listing.using == "direct" {
        text.push_str(
            "\nphysical parts, looked for along branches of direct simulation at five values of \
             the first parameter, and at the map's loci; tangencies are the map's\n",
        );
        if !listing.has_grazes() {
            text.push_str("grazes are followed on a tangency section, those of its own passage\n");
        }
    }
    if listing.special().next().is_some() {
        text.push_str(&format!(
            "\npoints of codimension two\n\n{}",
            listing.special_table()?.to_text()
        ));
    }
    for surface in &listing.without_kick {
        text.push_str(&format!(
            "\nno tangencies at `{surface}`: its contact begins without a kick, so multipliers \
             pass a graze without a jump, and folds and flips do not end there\n"
        ));
    }
    if !listing.tangencies.is_empty() {
        text.push_str(&format!(
            "\ntangencies: {second} of the locus less {second} of the graze, over the square of \
             the distance in {first}\n\n{}",
            listing.tangency_table()?.to_text()
        ));
    }
    Ok(text)
}

fn searched(request: &LociRequest) -> String {
    let itineraries: Vec<String> =
        request.itineraries.iter().map(|itinerary| itinerary.to_string()).collect();
    format!(
        "itineraries {}; branches at five offsets of the first parameter from {:e} to {:e}, depth \
         variables up to twice the window's",
        itineraries.join(", "),
        request.range[0],
        request.range[1]
    )
}

/// Says how many points are outside of the window.
fn warn(listing: &LociListing) {
    let points = listing.loci.iter().flat_map(|locus| &locus.points);
    let physical: Vec<_> = points.filter(|point| point.physical).collect();
    let outside = physical.iter().filter(|point| !point.inside).count();
    if outside > 0 && listing.using == "map" {
        note(&format!(
            "warning: {outside} of {} points are outside the window, where the map has not been \
             measured; --using direct has them by direct simulation",
            physical.len()
        ));
    }
}
