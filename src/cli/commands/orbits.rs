//! `grazemap orbits`: periodic orbits by itinerary, their stability, folds and flips.

use super::{map, open, remark_on_window};
use crate::cli::arguments::{OrbitsArguments, OrbitsUsing, ParameterOffsets};
use crate::cli::output::{Bar, CliError, Results, note};
use grazemap::Map;
use grazemap::analysis::itinerary;
use grazemap::analysis::orbits::{
    BifurcationKind, DirectReach, LociRequest, Orbits, OrbitsRequest, SteppedParameter,
};
use grazemap::analysis::periodic::{ContactItinerary, ItineraryError};
use grazemap::expansion::LocalMap;
use grazemap::model::{Scene, nearest};
use grazemap::orbit::PoincareSectionKind;
use grazemap::report::{Document, DocumentKind, OrbitsListing, to_json};

/// Share of the window's half-width at which orbits are looked for where no parameters are named.
const DEFAULT_SHARE: f64 = 0.1;
/// Passages of the longest period that is looked for where none is named.
const DEFAULT_PASSAGES: usize = 4;

pub(in crate::cli) fn run(options: &OrbitsArguments) -> Result<(), CliError> {
    let outlets = &options.scene.common.outlets;
    let map = map(open(&options.scene)?, outlets.quiet)?;
    let request = request(options, map.scene(), map.local())?;
    remark_on_window(&map, outlets.quiet);
    let found = map.orbits(&request, &Bar::new("orbits", outlets.quiet))?;
    let names = itinerary(map.scene(), map.orbit());
    let polynomials = (map.local(), map.window(), map.window_edges());
    let listing = OrbitsListing::new(map.section(), polynomials, &names, &found, request.direct);
    let searched = searched(&map, &found, &request);
    let mut results = results(&map, &listing)?;
    if request.direct {
        results.text.push_str(&format!("\nsearched: {searched}\n"));
    }
    results.deliver("orbits", outlets)?;
    if !outlets.quiet {
        warn(&listing);
    }
    judge(&request, &listing, searched)
}

/// What has been searched, in words.
pub(super) fn searched(map: &Map, found: &Orbits, request: &OrbitsRequest) -> String {
    let itineraries = request.itineraries.len();
    let mut words = format!(
        "the map (itineraries: {itineraries}; depth variables up to twice the window's, offsets up \
         to a hundred half-widths)"
    );
    if let Some(DirectReach { parameter, range: [from, to] }) = found.reach {
        let name = &map.local().parameters[parameter].name;
        words.push_str(&format!(
            "; direct simulation next to the map's orbits, and by itself along the branches in \
             {name}, at offsets from {from:.3} to {to:.3}, that begin at the graze or at what it \
             settles on or nearly repeats"
        ));
        let is_tangency = map.orbit().section.kind == PoincareSectionKind::Tangency;
        if is_tangency && map.scene().model.phase.is_some() {
            words.push_str(
                "; orbits that do not return to the tangency section once in `periods` of the \
                 forcing are found on a stroboscopic one",
            );
        }
    } else if !request.direct {
        words.push_str("; `--using direct` searches direct simulation far beyond the window");
    }
    words
}

/// The orbits, and the loci where asked for; the table is that of the loci then.
fn results(map: &Map, document: &OrbitsListing) -> Result<Results, CliError> {
    let json = to_json(&Document::new(DocumentKind::Orbits, map.scene(), document))?;
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
    Ok(Results { text: text(map.scene(), document)?, json, csv: Some(csv), files })
}

/// The orbits as a person reads them.
fn text(scene: &Scene, document: &OrbitsListing) -> Result<String, CliError> {
    let using = match document.using {
        "direct" => "direct simulation",
        _ => "the map",
    };
    let passages: Vec<String> = document.passages.iter().map(|name| format!("`{name}`")).collect();
    let mut text = format!(
        "periodic orbits of `{}` by {using}; offsets on the {}\nitinerary: return by return, 1 \
            where the passage of {} makes contact, 0 where not\n\n{}",
        scene.identifier,
        document.section.words(),
        passages.join(", then of "),
        document.table()?.to_text()
    );
    text.push_str(&virtual_words(document));
    if document.loci.is_some() {
        text.push_str(&format!("\nfolds and flips\n\n{}", document.loci_table()?.to_text()));
    }
    Ok(text)
}

/// What is said of orbits that the map does not go.
fn virtual_words(document: &OrbitsListing) -> String {
    let count = document.orbits.iter().filter(|orbit| !orbit.physical);
    match (count.count(), document.any_physical()) {
        _ if document.using == "direct" => String::new(),
        (0, _) => String::new(),
        (_, false) => {
            "\nvirtual: on a branch of the root that the map does not take; no orbit is physical\n"
                .to_owned()
        }
        (count, true) => format!(
            "\nvirtual orbits, on a branch of the root that the map does not take: {count}; JSON \
                and CSV have them\n"
        ),
    }
}

/// Says which orbits were outside the window, and which direct simulation has not.
fn warn(document: &OrbitsListing) {
    let points = document.loci.iter().flatten().flat_map(|locus| &locus.points);
    let physical = document.orbits.iter().chain(points);
    let physical: Vec<_> = physical.filter(|orbit| orbit.physical).collect();
    let outside = physical.iter().filter(|orbit| !orbit.inside).count();
    if outside > 0 && document.using == "map" {
        note(&format!(
            "warning: {outside} of {} orbits are outside the window, where the map has not been \
                measured; --using direct asks direct simulation for them",
            physical.len()
        ));
    }
    for lost in &document.lost {
        let parameters = lost.parameters.0.iter();
        let parameters: Vec<String> =
            parameters.map(|(name, value)| format!("{name} = {value:e}")).collect();
        note(&format!(
            "warning: direct simulation has no orbit next to the map's of itinerary {} at {}: {}",
            lost.itinerary,
            parameters.join(", "),
            lost.reason
        ));
    }
}

/// Nothing found is mathematics that ended otherwise.
fn judge(
    request: &OrbitsRequest,
    document: &OrbitsListing,
    searched: String,
) -> Result<(), CliError> {
    match (&document.loci, &request.loci) {
        (Some(loci), Some(asked)) if loci.is_empty() => {
            let kinds: Vec<_> = asked.kinds.iter().map(|kind| kind.word()).collect();
            let kinds = kinds.join(" or ");
            Err(CliError::NoLoci { kinds, searched })
        }
        (None, _) if document.orbits.is_empty() => {
            Err(CliError::NoOrbits { at: request.at.len(), searched })
        }
        _ => Ok(()),
    }
}

/// What the options ask for, in numbers.
fn request(
    options: &OrbitsArguments,
    scene: &Scene,
    map: &LocalMap,
) -> Result<OrbitsRequest, CliError> {
    let parameters = Parameters { scene, map };
    Ok(OrbitsRequest {
        itineraries: itineraries(&options.which.itinerary, options.period, map.passages())?,
        at: parameters.at(options)?,
        direct: options.which.using == OrbitsUsing::Direct,
        far: options.which.using == OrbitsUsing::Direct,
        loci: parameters.loci(options)?,
    })
}

/// The itineraries named, or all of short periods.
pub(super) fn itineraries(
    named: &[String],
    period: Option<u8>,
    passages: usize,
) -> Result<Vec<ContactItinerary>, ItineraryError> {
    if named.is_empty() {
        return ContactItinerary::all(passages, longest_period(period, passages));
    }
    let parse = |digits: &String| ContactItinerary::parse(digits, passages);
    named.iter().map(parse).collect()
}

/// Returns of the longest period that is looked for.
pub(super) fn longest_period(period: Option<u8>, passages: usize) -> usize {
    period.map_or((DEFAULT_PASSAGES / passages.max(1)).max(1), usize::from)
}

/// What offsets name: what is said of a name that is not known, and of those known.
pub(super) const ACTIVE: [&str; 2] = ["the map has no variable", "active parameters"];
pub(super) const COORDINATES: [&str; 2] = ["the section has no coordinate", "coordinates"];

/// Offsets by name among those known; those not named are 0.
pub(super) fn named_offsets(
    flag: &'static str,
    kind: [&'static str; 2],
    named: &ParameterOffsets,
    known: &[&str],
) -> Result<Vec<f64>, CliError> {
    let mut offsets = vec![None; known.len()];
    for (name, offset) in &named.0 {
        let place = place_of(flag, kind, name, known)?;
        if offsets[place].replace(*offset).is_some() {
            return Err(CliError::NamedTwice { flag, name: name.clone() });
        }
    }
    Ok(offsets.into_iter().map(Option::unwrap_or_default).collect())
}

/// The place of a name among those known.
pub(super) fn place_of(
    flag: &'static str,
    kind: [&'static str; 2],
    name: &str,
    known: &[&str],
) -> Result<usize, CliError> {
    known.iter().position(|&known| known == name).ok_or_else(|| CliError::UnknownName {
        flag,
        kind,
        name: name.to_owned(),
        nearest: nearest(name, known.iter().copied()),
        known: known.join(", "),
    })
}

/// The active parameters of a map.
pub(super) struct Parameters<'a> {
    pub(super) scene: &'a Scene,
    pub(super) map: &'a LocalMap,
}

impl Parameters<'_> {
    fn names(&self) -> impl Iterator<Item = &str> {
        self.map.parameters.iter().map(|parameter| parameter.name.as_str())
    }

    /// The number of a parameter.
    pub(super) fn place(&self, flag: &'static str, name: &str) -> Result<usize, CliError> {
        place_of(flag, ACTIVE, name, &self.names().collect::<Vec<_>>())
    }

    /// The first that is adjusted so that the orbit grazes; where the map has none of those, its
    /// first.
    fn first(&self) -> Result<usize, CliError> {
        let adjusted = self.scene.grazing.solve_for.iter();
        let mut adjusted = adjusted.map(|&parameter| &self.scene.model.parameters[parameter].name);
        let place = adjusted.find_map(|name| self.names().position(|known| known == name));
        let any = (!self.map.parameters.is_empty()).then_some(0);
        place.or(any).ok_or(CliError::NoParameter)
    }

    /// Its half-width in the window.
    fn width(&self, place: usize) -> f64 {
        self.map.window.parameter[place]
    }

    /// Offsets, all 0 but one.
    pub(super) fn one(&self, place: usize, offset: f64) -> Vec<f64> {
        let mut offsets = vec![0.0; self.map.parameters.len()];
        offsets[place] = offset;
        offsets
    }

    /// Offsets by name; those not named are 0.
    pub(super) fn offsets(&self, named: &ParameterOffsets) -> Result<Vec<f64>, CliError> {
        named_offsets("--at", ACTIVE, named, &self.names().collect::<Vec<_>>())
    }

    /// Where orbits are looked for.
    fn at(&self, options: &OrbitsArguments) -> Result<Vec<Vec<f64>>, CliError> {
        if options.at.is_empty() {
            let first = self.first()?;
            let offset = DEFAULT_SHARE * self.width(first);
            return Ok([offset, -offset].map(|offset| self.one(first, offset)).into());
        }
        let named = options.at.iter();
        named.map(|offsets| self.offsets(offsets)).collect()
    }

    /// Folds and flips in one parameter, or in two; beside them the offsets named first hold.
    fn loci(&self, options: &OrbitsArguments) -> Result<Option<LociRequest>, CliError> {
        let kinds = [(options.fold, BifurcationKind::Fold), (options.flip, BifurcationKind::Flip)];
        let kinds = kinds.into_iter().filter(|(asked, _)| *asked);
        let kinds: Vec<_> = kinds.map(|(_, kind)| kind).collect();
        if kinds.is_empty() {
            return Ok(None);
        }
        let (stepped, free) = self.plane(options)?;
        let named = options.at.first().map(|offsets| self.offsets(offsets));
        let named = named.transpose()?;
        let mut at = named.unwrap_or_else(|| vec![0.0; self.map.parameters.len()]);
        at[free] = 0.0;
        let stepped = stepped.map(|place| self.steps(options, place));
        Ok(Some(LociRequest { kinds, free, stepped: stepped.transpose()?, at }))
    }

    /// The parameter that is stepped through, where there is one, and the one that is solved for.
    fn plane(&self, options: &OrbitsArguments) -> Result<(Option<usize>, usize), CliError> {
        let plane = options.plane.iter();
        let plane = plane.map(|name| self.place("--in", name.trim()));
        match plane.collect::<Result<Vec<_>, _>>()?[..] {
            [] => Ok((None, self.first()?)),
            [free] => Ok((None, free)),
            [stepped, free] if stepped == free => {
                Err(CliError::NamedTwice { flag: "--in", name: options.plane[0].clone() })
            }
            [stepped, free] => Ok((Some(stepped), free)),
            _ => Err(CliError::NotAPlane { found: options.plane.len() }),
        }
    }

    /// An end of a range of a parameter: as given, or that of the window on a side.
    pub(super) fn end(
        &self,
        flag: &'static str,
        given: Option<f64>,
        (place, side): (usize, f64),
    ) -> Result<f64, CliError> {
        let value = given.unwrap_or(side * self.width(place));
        if value.is_finite() { Ok(value) } else { Err(CliError::NotFinite { flag, value }) }
    }

    /// The values of the parameter that is stepped through.
    fn steps(&self, options: &OrbitsArguments, place: usize) -> Result<SteppedParameter, CliError> {
        let from = self.end("--from", options.from, (place, -1.0))?;
        let to = self.end("--to", options.to, (place, 1.0))?;
        let last = f64::from(options.points - 1);
        let value = |number: u16| from + (to - from) * f64::from(number) / last;
        Ok(SteppedParameter { parameter: place, values: (0..options.points).map(value).collect() })
    }
}
