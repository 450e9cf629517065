//! `branch` and `loci`: continuation of periodic orbits as branches in one parameter, and of
//! saddle-nodes, flips, Neimark–Sacker points and grazes in two.

use serde::{Deserialize, Serialize};

use crate::analysis::branches::{BranchObservable, BranchRequest, Branches};
use crate::analysis::diagram::Diagram;
use crate::analysis::loci::{LociRequest, LocusKind};
use crate::analysis::{NoProgress, Progress, Shard, SubProgress, itinerary};
use crate::model::{ChartRequest, Method};
use crate::pipeline::keys::{
    ActiveParameters, COORDINATES, KeyError, OrbitsOf, itineraries, longest_period, named_offsets,
};
use crate::pipeline::{Answer, Ended, Error, Map};
use crate::report::{
    BranchListing, Document, DocumentKind, Figure, LociListing, Named, chart_figure, loci_searched,
    to_json,
};

/// Keys of `branch`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BranchKeys {
    /// Active parameter that varies.
    pub along: String,
    /// First offset. Default: the edge of the window.
    pub from: Option<f64>,
    /// Last offset. Default: the edge of the window.
    pub to: Option<f64>,
    /// Offsets of further active parameters, 0 if not named.
    pub at: Named<f64>,
    /// Itineraries of the orbits. Default: all of short periods.
    pub itineraries: Vec<String>,
    /// Longest period, in returns.
    pub period: Option<u8>,
    /// Method that computes the orbits.
    #[serde(alias = "using")]
    pub method: OrbitsOf,
    /// Offsets of section coordinates, 0 if not named, of further starts from which direct
    /// simulation searches for orbits.
    pub starts: Vec<Named<f64>>,
    /// Quantities computed for every orbit in addition to its section points.
    pub observe: Vec<BranchObservable>,
    /// Whether guarded iterates are drawn below the branches, if the scene has a diagram in the
    /// same parameter.
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
        let along = parameters.place("along", &self.along)?;
        let passages = map.local().passages();
        let longest = longest_period(self.period, passages);
        let named = itineraries(&self.itineraries, self.period, passages)?;
        if self.method == OrbitsOf::Map && !self.starts.is_empty() {
            return Err(KeyError::StartsOfMap);
        }
        let coordinates = &map.local().section.coordinates;
        let start = |named| named_offsets("start", COORDINATES, named, coordinates);
        let named_longest = named.iter().map(|itinerary| itinerary.period()).max();
        Ok(BranchRequest {
            longest: longest.max(named_longest.unwrap_or(1)),
            itineraries: named,
            along,
            at: parameters.at_beside(&self.at, &[along])?,
            range: parameters.range(along, self.from, self.to)?,
            direct: self.method == OrbitsOf::Direct,
            starts: self.starts.iter().map(start).collect::<Result<_, _>>()?,
        })
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
        let text = listing.text(&map.scene().identifier)?;
        let itineraries = request.itineraries.len();
        Ok(Answer {
            remarks: map
                .remarks()
                .chain(stretch_remarks(map, (&self.along, self.from, self.to), &self.at))
                .chain(listing.remarks())
                .collect(),
            ended: listing.branches.is_empty().then_some(Ended::NoBranch { itineraries }),
            ..Answer::new("branch", text, document, listing.data_table()?)
                .with_figures(listing.figures(below.as_ref()))
        })
    }
}

/// Remarks on a range of a parameter and on further offsets that look like parameter values.
fn stretch_remarks(
    map: &Map,
    (name, from, to): (&str, Option<f64>, Option<f64>),
    at: &Named<f64>,
) -> Vec<String> {
    let graze = map.settled().graze();
    let ends: Vec<f64> = from.into_iter().chain(to).collect();
    let range = graze.offset_remark("from, to", name, &ends);
    range.into_iter().chain(graze.offset_remarks("at", at)).collect()
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
        let (along, from, to) = (name.to_owned(), Some(from), Some(to));
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
#[serde(default, deny_unknown_fields)]
pub struct LociKeys {
    /// Two active parameters.
    #[serde(alias = "in")]
    pub plane: Vec<String>,
    /// First offset of the first parameter. Default: the edge of the window.
    pub from: Option<f64>,
    /// Last offset of the first parameter. Default: the edge of the window.
    pub to: Option<f64>,
    /// Offsets of further active parameters, 0 if not named.
    pub at: Named<f64>,
    /// Kinds of loci. Default: all but crises.
    pub kind: Vec<LocusKind>,
    /// Itineraries of the orbits. Default: all of short periods.
    pub itineraries: Vec<String>,
    /// Method that computes the orbits.
    #[serde(alias = "using")]
    pub method: OrbitsOf,
    /// Whether the scene's first chart in these parameters is drawn below the loci.
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
        let longest = u8::try_from((DEFAULT_PASSAGES / passages.max(1)).max(1)).ok();
        let itineraries = itineraries(&self.itineraries, longest, passages)?.into_iter();
        let kinds = match self.kind.is_empty() {
            true => LocusKind::LOCAL.to_vec(),
            false => self.kind.clone(),
        };
        Ok(LociRequest {
            plane,
            range: parameters.range(plane[0], self.from, self.to)?,
            at: parameters.at_beside(&self.at, &plane)?,
            kinds,
            itineraries: itineraries.filter(|itinerary| itinerary.contacts() > 0).collect(),
            direct: self.method == OrbitsOf::Direct,
        })
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
        let text = listing.text(&map.scene().identifier)?;
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
                .chain(stretch_remarks(map, (&self.plane[0], self.from, self.to), &self.at))
                .chain(listing.remarks())
                .collect(),
            ended: listing.loci.is_empty().then(none),
            ..Answer::new("loci", text, document, listing.data_table()?)
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
        map.local().has_contacts() || request.with.iter().all(|&method| method == Method::Direct)
    };
    let asked = |request: &&ChartRequest| names(request) == listing.plane && is_made(request);
    let Some(request) = charts.find(asked) else {
        return Ok(None);
    };
    let bare = ChartRequest { overlay: Vec::new(), ..request.clone() };
    Ok(map.chart_with(&bare, progress)?.first().map(chart_figure))
}
