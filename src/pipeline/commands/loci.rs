//! `loci`: saddle-nodes, flips, Neimark–Sacker points and grazes in two parameters.

use serde::{Deserialize, Serialize};

use crate::analysis::loci::{LociRequest, LocusKind};
use crate::analysis::{Part, Progress};
use crate::model::ChartRequest;
use crate::pipeline::keys::{ActiveParameters, KeyError, OrbitsOf, itineraries};
use crate::pipeline::{Answer, Ended, Error, Map};
use crate::report::{
    Document, DocumentKind, Figure, LociListing, Named, chart_figure, loci_searched, to_json,
};

/// Passages of the longest period whose loci are looked for where none is named.
const DEFAULT_PASSAGES: usize = 2;

/// The keys of `loci`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LociKeys {
    /// The two active parameters.
    #[serde(rename = "in")]
    pub plane: Vec<String>,
    /// First offset of the first of them; by default that of the window.
    pub from: Option<f64>,
    /// Its last offset; by default that of the window.
    pub to: Option<f64>,
    /// Offsets of further active parameters, those not named 0.
    pub at: Named<f64>,
    /// Which loci; none: all but crises.
    pub kind: Vec<LocusKind>,
    /// The contacts of the orbits; none: all of short periods.
    pub itineraries: Vec<String>,
    /// Whose orbits.
    pub using: OrbitsOf,
    /// Whether the scene's first chart in these parameters is drawn below the loci.
    pub chart: bool,
}

impl LociKeys {
    /// What the keys ask for, in numbers.
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
            at: parameters.at(&self.at)?,
            kinds,
            itineraries: itineraries.filter(|itinerary| itinerary.contacts() > 0).collect(),
            direct: self.using == OrbitsOf::Direct,
        })
    }

    /// The loci, laid out.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] as [`request`](Self::request); as [`Map::loci`].
    pub fn answer(&self, map: &Map, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = self.request(map)?;
        let found = map.loci(&request, &Part::new(progress, 0))?;
        let listing =
            LociListing::new(map.section(), map.local(), request.plane, &found, request.direct);
        let document = to_json(&Document::new(DocumentKind::Loci, map.scene(), &listing))?;
        let text = listing.text(&map.scene().identifier)?;
        let below = match self.chart {
            true => chart_below(map, &listing, &Part::new(progress, 1))?,
            false => None,
        };
        let kinds = || request.kinds.iter().map(|kind| kind.word()).collect::<Vec<_>>();
        let none =
            || Ended::NoLoci { kinds: kinds().join(" or "), searched: loci_searched(&request) };
        let graze = listing.figure_from_graze().map(|figure| ("_from_graze", figure));
        Ok(Answer {
            remarks: map.remarks().chain(listing.remarks()).collect(),
            ended: listing.loci.is_empty().then(none),
            ..Answer::new("loci", text, document, listing.data_table()?)
                .with_figures([("", listing.figure(below))].into_iter().chain(graze))
        })
    }
}

/// The scene's first chart in the parameters of the loci, drawn.
fn chart_below(
    map: &Map,
    listing: &LociListing,
    progress: &dyn Progress,
) -> Result<Option<Figure>, Error> {
    let names = |request: &ChartRequest| {
        request.parameters.map(|place| map.scene().model.parameters[place].name.clone())
    };
    let mut charts = map.scene().charts.iter();
    let Some(request) = charts.find(|request| names(request) == listing.plane) else {
        return Ok(None);
    };
    let bare = ChartRequest { overlay: Vec::new(), ..request.clone() };
    Ok(map.chart_with(&bare, progress)?.first().map(chart_figure))
}
