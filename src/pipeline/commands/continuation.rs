//! `branch` and `loci`: continuation of periodic orbits as branches in one parameter, and of
//! saddle-nodes, flips, Neimark–Sacker points and grazes in two.

use serde::{Deserialize, Serialize};

use crate::analysis::branches::{BranchObservable, BranchRequest, Branches};
use crate::analysis::diagram::Diagram;
use crate::analysis::loci::{LociRequest, LocusKind};
use crate::analysis::{NoProgress, Progress, Shard, SubProgress, itinerary};
use crate::model::ChartRequest;
use crate::pipeline::keys::{
    ActiveParameters, COORDINATES, KeyError, OrbitsOf, itineraries, longest_period, named_offsets,
};
#[cfg(feature = "cli")]
use crate::pipeline::options::{LOCI, OBSERVABLES, ORBITS_OF, one_of, positions};
use crate::pipeline::positions::{Counting, Origin, Position};
use crate::pipeline::{Answer, Ended, Error, Map};
use crate::report::{
    BranchListing, Document, DocumentKind, Figure, LociListing, Named, chart_figure, loci_searched,
    to_json,
};

/// Keys of `branch`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct BranchKeys {
    /// Active parameter that varies along the branches.
    #[cfg_attr(feature = "cli", arg(long, value_name = "P"))]
    pub along: String,
    /// First offset of the parameter from the graze. Default: the edge of the window.
    #[cfg_attr(feature = "cli", arg(long, value_name = "A"))]
    pub from: Option<Position>,
    /// Last offset of the parameter from the graze. Default: the edge of the window.
    #[cfg_attr(feature = "cli", arg(long, value_name = "B"))]
    pub to: Option<Position>,
    /// Offsets of further active parameters from the graze (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Search all itineraries of up to N returns, and follow period-doubled branches up to N
    /// returns. Default: 4 returns, or 4 passages where a return has several.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=12))
    )]
    pub period: Option<u8>,
    /// Orbits with these contacts only: 1 for contact, 0 for none, passage by passage and return by
    /// return (`100`); may be repeated. Default: all itineraries of short periods.
    #[cfg_attr(feature = "cli", arg(long = "itinerary", value_name = "DIGITS"))]
    pub itineraries: Vec<String>,
    /// Method that computes the orbits.
    #[serde(alias = "using")]
    #[cfg_attr(
        feature = "cli",
        arg(long, alias = "using", default_value = "map", value_parser = one_of(ORBITS_OF))
    )]
    pub method: OrbitsOf,
    /// Offsets of section coordinates (0 if not named) of a further start from which direct
    /// simulation searches for orbits; may be repeated. `basin` can supply such starts.
    #[cfg_attr(
        feature = "cli",
        arg(long = "start", value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub starts: Vec<Named<Position>>,
    /// Quantities to compute for every orbit; each adds a column and a picture.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "NAME,...",
            value_parser = one_of(OBSERVABLES),
            value_delimiter = ','
        )
    )]
    pub observe: Vec<BranchObservable>,
    /// Whether guarded iterates are drawn below the branches, if the scene has a diagram in the
    /// same parameter.
    #[cfg_attr(feature = "cli", arg(skip))]
    pub iterates: bool,
}

impl BranchKeys {
    /// Request with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names, numbers and itineraries that the map does not have.
    pub fn request(&self, map: &Map) -> Result<BranchRequest, KeyError> {
        let parameters = ActiveParameters::of(map.scene(), map.local());
        let (origin, [from, to], at) = self.offsets(map);
        let along = parameters.place("along", &self.along)?;
        let passages = map.local().passages();
        let longest = longest_period(self.period, passages);
        let named = itineraries(&self.itineraries, self.period, passages)?;
        if self.method == OrbitsOf::Map && !self.starts.is_empty() {
            return Err(KeyError::StartsOfMap);
        }
        let coordinates = &map.local().section.coordinates;
        let start =
            |named| named_offsets("start", COORDINATES, &origin.offsets(named), coordinates);
        let named_longest = named.iter().map(|itinerary| itinerary.period()).max();
        Ok(BranchRequest {
            longest: longest.max(named_longest.unwrap_or(1)),
            itineraries: named,
            along,
            at: parameters.at_beside(&at, &[along])?,
            range: parameters.range(along, from, to)?,
            direct: self.method == OrbitsOf::Direct,
            starts: self.starts.iter().map(start).collect::<Result<_, _>>()?,
        })
    }

    /// Origin of the offsets, the ends of the range, and the offsets of further parameters.
    fn offsets<'m>(&self, map: &'m Map) -> Stretch<'m> {
        stretch(map, self.values, &self.along, [self.from, self.to], self.at.as_ref())
    }

    /// Computes a share of the pieces of [`answer`](Self::answer).
    ///
    /// # Errors
    ///
    /// As [`answer`](Self::answer).
    pub fn share(&self, map: &Map, shard: &Shard<'_>) -> Result<(), Error> {
        let request = self.request(map)?;
        shard.part(0, |shard| map.share_branches(&request, shard))
    }

    /// Computes the branches and lays them out.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] as [`request`](Self::request); as [`Map::branches`].
    pub fn answer(&self, map: &Map, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = self.request(map)?;
        let found = map.branches(&request, &SubProgress::new(progress, 0))?;
        let listing = listing(map, &request, &found);
        let observed = self
            .observe
            .iter()
            .map(|&observable| Ok((observable, map.branch_observable(&found, observable)?)));
        let listing = listing.with_observed(&observed.collect::<Result<Vec<_>, Error>>()?);
        let below = match self.iterates && map.local().has_contacts() {
            true => map.branch_diagram(&request, &found, &SubProgress::new(progress, 1))?,
            false => None,
        };
        let document = to_json(&Document::new(DocumentKind::Branch, map.scene(), &listing))?;
        let text = listing.text(&map.scene().identifier);
        let itineraries = request.itineraries.len();
        Ok(Answer {
            remarks: map
                .remarks()
                .chain(stretch_remarks(
                    &Origin::new(map.settled().graze(), self.values),
                    &self.along,
                    [self.from, self.to],
                    self.at.as_ref(),
                ))
                .chain(listing.remarks())
                .collect(),
            ended: listing.branches.is_empty().then_some(Ended::NoBranch { itineraries }),
            ..Answer::new("branch", text, document, listing.data_table())
                .with_figures(listing.figures(below.as_ref()))
        })
    }
}

/// Interval of one parameter, the others held: origin of the offsets, both ends, and the offsets of
/// further parameters.
type Stretch<'m> = (Origin<'m>, [Option<f64>; 2], Named<f64>);

fn stretch<'m>(
    map: &'m Map,
    values: Counting,
    along: &str,
    ends: [Option<Position>; 2],
    at: Option<&Named<Position>>,
) -> Stretch<'m> {
    let origin = Origin::new(map.settled().graze(), values);
    let (ends, at) = (origin.range(along, ends), origin.offsets(at));
    (origin, ends, at)
}

/// Remarks on a range of a parameter and on further offsets that look like parameter values.
fn stretch_remarks(
    origin: &Origin<'_>,
    along: &str,
    ends: [Option<Position>; 2],
    at: Option<&Named<Position>>,
) -> Vec<String> {
    let range = origin.range_remark("from, to", along, ends);
    range.into_iter().chain(origin.remarks("at", at)).collect()
}

fn listing(map: &Map, request: &BranchRequest, found: &Branches) -> BranchListing {
    let names = itinerary(map.scene(), map.orbit());
    let polynomials = (map.local(), map.window(), map.window_edges());
    let kind = (request.along, request.direct);
    BranchListing::new(map.section(), polynomials, &names, found, kind)
}

/// Branches of short periods in every parameter of the diagrams, over the union of their ranges. No
/// branches for a parameter that the map does not keep, or if none can be computed.
pub(in crate::pipeline) fn diagram_branches(map: &Map, diagrams: &[Diagram]) -> Vec<BranchListing> {
    let mut ranges: Vec<(&str, [f64; 2])> = Vec::new();
    for diagram in diagrams {
        let offsets = diagram.sweeps.iter().flat_map(|sweep| &sweep.points);
        for offset in offsets.map(|point| point.offset) {
            match ranges.iter_mut().find(|(name, _)| *name == diagram.parameter) {
                Some((_, [low, high])) => (*low, *high) = (low.min(offset), high.max(offset)),
                None => ranges.push((&diagram.parameter, [offset; 2])),
            }
        }
    }
    let branches = ranges.into_iter().filter_map(|(name, [from, to])| {
        let (along, from, to) = (name.to_owned(), Some(from.into()), Some(to.into()));
        let request = BranchKeys { along, from, to, ..BranchKeys::default() }.request(map).ok()?;
        let found = map.branches(&request, &NoProgress).ok()?;
        let observable = BranchObservable::ImpactSpeed;
        let speeds = map.branch_observable(&found, observable).ok()?;
        Some(listing(map, &request, &found).with_observed(&[(observable, speeds)]))
    });
    branches.collect()
}

/// Default for the longest period of loci, in passages.
const DEFAULT_PASSAGES: usize = 2;

/// Keys of `loci`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct LociKeys {
    /// The two active parameters of the plane; the second is followed over four times as many
    /// half-widths of its window as the first.
    #[serde(alias = "in")]
    #[cfg_attr(
        feature = "cli",
        arg(long, alias = "in", value_name = "P,Q", value_delimiter = ',', required = true)
    )]
    pub plane: Vec<String>,
    /// First offset of the parameter from the graze. Default: the edge of the window.
    #[cfg_attr(feature = "cli", arg(long, value_name = "A"))]
    pub from: Option<Position>,
    /// Last offset of the parameter from the graze. Default: the edge of the window.
    #[cfg_attr(feature = "cli", arg(long, value_name = "B"))]
    pub to: Option<Position>,
    /// Offsets of further active parameters from the graze (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Kinds of loci to follow. Default: all but crises.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "KIND,...", value_parser = one_of(LOCI), value_delimiter = ',')
    )]
    pub kind: Vec<LocusKind>,
    /// Orbits with these contacts only: 1 for contact, 0 for none, passage by passage and return by
    /// return (`100`); may be repeated. Default: all itineraries of short periods.
    #[cfg_attr(feature = "cli", arg(long = "itinerary", value_name = "DIGITS"))]
    pub itineraries: Vec<String>,
    /// Method that computes the orbits.
    #[serde(alias = "using")]
    #[cfg_attr(
        feature = "cli",
        arg(long, alias = "using", default_value = "map", value_parser = one_of(ORBITS_OF))
    )]
    pub method: OrbitsOf,
    /// Whether the scene's first chart in these parameters is drawn below the loci.
    #[cfg_attr(feature = "cli", arg(skip))]
    pub chart: bool,
}

impl LociKeys {
    /// Request with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names, numbers and itineraries that the map does not have.
    pub fn request(&self, map: &Map) -> Result<LociRequest, KeyError> {
        let parameters = ActiveParameters::of(map.scene(), map.local());
        let plane = match parameters.plane(&self.plane)?[..] {
            [first, second] => [first, second],
            _ => return Err(KeyError::NotAPlane { found: self.plane.len() }),
        };
        let passages = map.local().passages();
        let (_, [from, to], at) = self.offsets(map);
        let longest = u8::try_from((DEFAULT_PASSAGES / passages.max(1)).max(1)).ok();
        let mut itineraries = itineraries(&self.itineraries, longest, passages)?;
        if self.itineraries.is_empty() {
            itineraries.retain(|itinerary| itinerary.contacts() > 0);
        }
        let kinds = match self.kind.is_empty() {
            true => LocusKind::LOCAL.to_vec(),
            false => self.kind.clone(),
        };
        Ok(LociRequest {
            plane,
            range: parameters.range(plane[0], from, to)?,
            at: parameters.at_beside(&at, &plane)?,
            kinds,
            itineraries,
            direct: self.method == OrbitsOf::Direct,
        })
    }

    /// Origin of the offsets, the ends of the range, and the offsets of further parameters.
    fn offsets<'m>(&self, map: &'m Map) -> Stretch<'m> {
        let first = self.plane.first().map_or("", String::as_str);
        stretch(map, self.values, first, [self.from, self.to], self.at.as_ref())
    }

    /// Computes the loci and lays them out.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] as [`request`](Self::request); as [`Map::loci`].
    pub fn answer(&self, map: &Map, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = self.request(map)?;
        let found = map.loci(&request, &SubProgress::new(progress, 0))?;
        let listing =
            LociListing::new(map.section(), map.local(), request.plane, &found, request.direct);
        let document = to_json(&Document::new(DocumentKind::Loci, map.scene(), &listing))?;
        let text = listing.text(&map.scene().identifier);
        let below = match self.chart {
            true => chart_below(map, &listing, &SubProgress::new(progress, 1))?,
            false => None,
        };
        let kinds = || request.kinds.iter().map(|kind| kind.word()).collect::<Vec<_>>();
        let none =
            || Ended::NoLoci { kinds: kinds().join(" or "), searched: loci_searched(&request) };
        let drawn = below.is_some() || !listing.loci.is_empty();
        let plane = drawn.then(|| ("", listing.figure(below)));
        let graze = listing.figure_from_graze().map(|figure| ("_from_graze", figure));
        Ok(Answer {
            remarks: map
                .remarks()
                .chain(stretch_remarks(
                    &Origin::new(map.settled().graze(), self.values),
                    &self.plane[0],
                    [self.from, self.to],
                    self.at.as_ref(),
                ))
                .chain(listing.remarks())
                .collect(),
            ended: listing.loci.is_empty().then(none),
            ..Answer::new("loci", text, document, listing.data_table())
                .with_figures(plane.into_iter().chain(graze))
        })
    }
}

/// Figure of the scene's first chart in the parameters of the loci.
fn chart_below(
    map: &Map,
    listing: &LociListing,
    progress: &dyn Progress,
) -> Result<Option<Figure>, Error> {
    let names = |request: &ChartRequest| {
        request.parameters.map(|place| map.scene().model.parameters[place].name.clone())
    };
    let mut charts = map.scene().charts.iter();
    let is_made = |request: &ChartRequest| {
        map.local().has_contacts() || request.with.iter().all(|method| method.is_direct())
    };
    let asked = |request: &&ChartRequest| names(request) == listing.plane && is_made(request);
    let Some(request) = charts.find(asked) else {
        return Ok(None);
    };
    let bare = ChartRequest { overlay: Vec::new(), ..request.clone() };
    Ok(map.chart_with(&bare, progress)?.first().map(chart_figure))
}
