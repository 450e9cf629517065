//! `orbits`: periodic orbits by itinerary, their stability, folds and flips.

use serde::{Deserialize, Serialize};

use crate::analysis::orbits::{
    BifurcationKind, BifurcationRequest, OrbitsRequest, SteppedParameter,
};
use crate::analysis::{Progress, itinerary};
use crate::orbit::PoincareSectionKind;
use crate::pipeline::keys::{ActiveParameters, KeyError, OrbitsOf, itineraries};
use crate::pipeline::{Answer, Ended, Error, Map};
use crate::report::{Document, DocumentKind, Named, OrbitsListing, orbits_searched, to_json};

/// Default offset of the search, as a share of the window's half-width.
const DEFAULT_SHARE: f64 = 0.1;

/// Keys of `orbits`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OrbitsKeys {
    /// Offsets of active parameters, 0 if not named, at each of which orbits are searched for.
    /// Default: a tenth of the window, on both sides of the graze.
    pub at: Vec<Named<f64>>,
    /// Longest period, in returns.
    pub period: Option<u8>,
    /// Itineraries of the orbits. Default: all of short periods.
    pub itineraries: Vec<String>,
    /// Method that computes the orbits.
    #[serde(alias = "using")]
    pub method: OrbitsOf,
    /// Bifurcations to find in addition.
    pub kind: Vec<BifurcationKind>,
    /// Parameter that bifurcations are solved for; if two are given, the first is stepped through.
    /// Default: the first parameter adjusted to graze.
    #[serde(alias = "in")]
    pub plane: Vec<String>,
    /// First offset of the stepped parameter. Default: the edge of the window.
    pub from: Option<f64>,
    /// Last offset of the stepped parameter. Default: the edge of the window.
    pub to: Option<f64>,
    /// Number of offsets.
    pub points: u16,
}

impl Default for OrbitsKeys {
    /// All orbits of short periods beside the graze, and 21 points if a parameter is stepped
    /// through.
    fn default() -> Self {
        Self {
            at: Vec::new(),
            period: None,
            itineraries: Vec::new(),
            method: OrbitsOf::Map,
            kind: Vec::new(),
            plane: Vec::new(),
            from: None,
            to: None,
            points: 21,
        }
    }
}

impl OrbitsKeys {
    /// Request with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names, numbers and itineraries that the map does not have.
    pub fn request(&self, map: &Map) -> Result<OrbitsRequest, KeyError> {
        if self.period.is_some() && !self.itineraries.is_empty() {
            return Err(KeyError::BothGiven { keys: ["period", "itineraries"] });
        }
        let parameters = ActiveParameters::of(map.scene(), map.local());
        let passages = map.local().passages();
        let at = match self.at.is_empty() {
            true => {
                let first = parameters.first()?;
                let offset = DEFAULT_SHARE * parameters.width(first);
                [offset, -offset].map(|offset| parameters.one(first, offset)).into()
            }
            false => self.at.iter().map(|at| parameters.at(at)).collect::<Result<_, _>>()?,
        };
        let direct = self.method == OrbitsOf::Direct;
        Ok(OrbitsRequest {
            itineraries: itineraries(&self.itineraries, self.period, passages)?,
            at,
            direct,
            far: direct,
            loci: self.loci(&parameters)?,
        })
    }

    /// Request for folds and flips in one parameter, or in two. Other parameters are at the first
    /// `at`.
    fn loci(
        &self,
        parameters: &ActiveParameters<'_>,
    ) -> Result<Option<BifurcationRequest>, KeyError> {
        let ranges = self.from.is_some() || self.to.is_some();
        if ranges && self.plane.len() != 2 {
            return Err(KeyError::Needs { key: "from", needed: "a plane of two parameters" });
        }
        if self.kind.is_empty() {
            return match self.plane.is_empty() {
                true => Ok(None),
                false => Err(KeyError::Needs { key: "plane", needed: "folds or flips to find" }),
            };
        }
        let (stepped, free) = match parameters.plane(&self.plane)?[..] {
            [] => (None, parameters.first()?),
            [free] => (None, free),
            [stepped, free] => (Some(stepped), free),
            _ => return Err(KeyError::NotAPlane { found: self.plane.len() }),
        };
        let named = self.at.first().cloned().unwrap_or_default();
        let mut at = parameters.at(&named)?;
        at[free] = 0.0;
        let stepped = stepped.map(|parameter| {
            let [from, to] = parameters.range(parameter, self.from, self.to)?;
            let last = f64::from(self.points.max(2) - 1);
            let value = |number: u16| from + (to - from) * f64::from(number) / last;
            let values = (0..self.points).map(value).collect();
            Ok::<_, KeyError>(SteppedParameter { parameter, values })
        });
        Ok(Some(BifurcationRequest {
            kinds: self.kind.clone(),
            free,
            stepped: stepped.transpose()?,
            at,
        }))
    }

    /// Computes the orbits and lays them out. The table is that of folds and flips if those are
    /// asked for.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] as [`request`](Self::request); as [`Map::orbits`].
    pub fn answer(&self, map: &Map, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = self.request(map)?;
        let found = map.orbits(&request, progress)?;
        let names = itinerary(map.scene(), map.orbit());
        let polynomials = (map.local(), map.window(), map.window_edges());
        let listing =
            OrbitsListing::new(map.section(), polynomials, &names, &found, request.direct);
        let searched = searched(map, &request, &found);
        let mut text = listing.text(&map.scene().identifier)?;
        if request.direct {
            text.push_str(&format!("\nsearched: {searched}\n"));
        }
        let document = to_json(&Document::new(DocumentKind::Orbits, map.scene(), &listing))?;
        let graze = map.settled().graze();
        let offsets = self.at.iter().flat_map(|at| graze.offset_remarks("at", at));
        let mut answer = Answer {
            remarks: map.remarks().chain(offsets).chain(listing.remarks()).collect(),
            ended: None,
            ..Answer::new("orbits", text, document, listing.data_table()?)
        };
        match (&listing.loci, &request.loci) {
            (Some(loci), Some(asked)) => {
                answer.tables.push(("loci", listing.loci_data_table()?));
                let kinds = asked.kinds.iter().map(|kind| kind.word()).collect::<Vec<_>>();
                let kinds = kinds.join(" or ");
                answer.ended = loci.is_empty().then_some(Ended::NoLoci { kinds, searched });
            }
            _ if listing.orbits.is_empty() => {
                answer.ended = Some(Ended::NoOrbits { at: request.at.len(), searched });
            }
            _ => {}
        }
        Ok(answer)
    }
}

/// Description of the search.
pub(super) fn searched(
    map: &Map,
    request: &OrbitsRequest,
    found: &crate::analysis::orbits::Orbits,
) -> String {
    let is_tangency = map.orbit().section.kind == PoincareSectionKind::Tangency;
    let stroboscopic_too = is_tangency && map.scene().model.phase.is_some();
    orbits_searched(map.local(), request, found, stroboscopic_too)
}
