//! `orbits`: periodic orbits by itinerary, their stability, folds and flips.

use serde::{Deserialize, Serialize};

use crate::analysis::orbits::{
    BifurcationKind, BifurcationRequest, OrbitsRequest, SteppedParameter,
};
use crate::analysis::{Progress, itinerary};
use crate::orbit::PoincareSectionKind;
use crate::pipeline::keys::{ActiveParameters, KeyError, OrbitsOf, itineraries};
#[cfg(feature = "cli")]
use crate::pipeline::options::{ORBITS_OF, one_of, positions};
use crate::pipeline::positions::{Counting, Origin, Position};
use crate::pipeline::{Answer, Ended, Error, Map};
use crate::report::{Document, DocumentKind, Named, OrbitsListing, orbits_searched, to_json};

/// Default offset of the search, as a share of the window's half-width.
const DEFAULT_SHARE: f64 = 0.1;

/// Number of offsets of a parameter that is stepped through.
const POINTS: u16 = 21;

/// Keys of `orbits`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct OrbitsKeys {
    /// Offsets of active parameters from the graze (0 if not named); may be repeated. Default: a
    /// tenth of the window, on both sides of the graze.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub at: Vec<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Search all itineraries of up to N returns. Default: 4 returns, or 4 passages where a return
    /// has several.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            conflicts_with = "itineraries",
            value_parser = clap::value_parser!(u8).range(1..=12)
        )
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
    /// Bifurcations to find in addition.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub kind: FoldsAndFlips,
    /// Parameter that folds and flips are solved for; if two are given, the first is stepped
    /// through. Default: the first active parameter that is adjusted to graze.
    #[serde(alias = "in")]
    #[cfg_attr(
        feature = "cli",
        arg(long, alias = "in", value_name = "[P,]Q", value_delimiter = ',', requires = "kinds")
    )]
    pub plane: Vec<String>,
    /// First offset of the parameter that is stepped through. Default: the edge of the window.
    #[cfg_attr(feature = "cli", arg(long, value_name = "A", requires = "plane"))]
    pub from: Option<Position>,
    /// Last offset of that parameter. Default: the edge of the window.
    #[cfg_attr(feature = "cli", arg(long, value_name = "B", requires = "plane"))]
    pub to: Option<Position>,
    /// Number of offsets.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = POINTS,
            requires = "plane",
            value_parser = clap::value_parser!(u16).range(2..=10_000)
        )
    )]
    pub points: u16,
}

/// Bifurcations that are found beside the orbits: in JSON a list of `fold` and `flip`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args), group(id = "kinds", multiple = true))]
#[serde(from = "Vec<BifurcationKind>", into = "Vec<BifurcationKind>")]
pub struct FoldsAndFlips {
    /// Also find folds (saddle-nodes).
    #[cfg_attr(feature = "cli", arg(long))]
    pub fold: bool,
    /// Also find flips (period-doublings).
    #[cfg_attr(feature = "cli", arg(long))]
    pub flip: bool,
}

impl From<Vec<BifurcationKind>> for FoldsAndFlips {
    fn from(kinds: Vec<BifurcationKind>) -> Self {
        let [fold, flip] =
            [BifurcationKind::Fold, BifurcationKind::Flip].map(|kind| kinds.contains(&kind));
        Self { fold, flip }
    }
}

impl From<FoldsAndFlips> for Vec<BifurcationKind> {
    fn from(FoldsAndFlips { fold, flip }: FoldsAndFlips) -> Self {
        let kinds = [(fold, BifurcationKind::Fold), (flip, BifurcationKind::Flip)];
        kinds.into_iter().filter_map(|(asked, kind)| asked.then_some(kind)).collect()
    }
}

impl Default for OrbitsKeys {
    /// All orbits of short periods beside the graze, and 21 points if a parameter is stepped
    /// through.
    fn default() -> Self {
        Self {
            at: Vec::new(),
            values: Counting::default(),
            period: None,
            itineraries: Vec::new(),
            method: OrbitsOf::Map,
            kind: FoldsAndFlips::default(),
            plane: Vec::new(),
            from: None,
            to: None,
            points: POINTS,
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
            false => {
                self.named(map).iter().map(|at| parameters.at(at)).collect::<Result<_, _>>()?
            }
        };
        let direct = self.method == OrbitsOf::Direct;
        Ok(OrbitsRequest {
            itineraries: itineraries(&self.itineraries, self.period, passages)?,
            at,
            direct,
            far: direct,
            loci: self.loci(map, &parameters)?,
        })
    }

    fn origin<'m>(&self, map: &'m Map) -> Origin<'m> {
        Origin::new(map.settled().graze(), self.values)
    }

    /// Offsets of active parameters at each of which orbits are searched for.
    fn named(&self, map: &Map) -> Vec<Named<f64>> {
        let origin = self.origin(map);
        self.at.iter().map(|at| origin.offsets(at)).collect()
    }

    /// Request for folds and flips in one parameter, or in two. Other parameters are at the first
    /// `at`.
    fn loci(
        &self,
        map: &Map,
        parameters: &ActiveParameters<'_>,
    ) -> Result<Option<BifurcationRequest>, KeyError> {
        let ranges = self.from.is_some() || self.to.is_some();
        if ranges && self.plane.len() != 2 {
            return Err(KeyError::Needs { key: "from", needed: "a plane of two parameters" });
        }
        let kinds = Vec::from(self.kind);
        if kinds.is_empty() {
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
        let named = self.named(map).into_iter().next().unwrap_or_default();
        let mut at = parameters.at(&named)?;
        at[free] = 0.0;
        let stepped = stepped.map(|parameter| {
            let [from, to] = self.origin(map).range(&self.plane[0], [self.from, self.to]);
            let [from, to] = parameters.range(parameter, from, to)?;
            let last = f64::from(self.points.max(2) - 1);
            let value = |number: u16| from + (to - from) * f64::from(number) / last;
            let values = (0..self.points).map(value).collect();
            Ok::<_, KeyError>(SteppedParameter { parameter, values })
        });
        Ok(Some(BifurcationRequest { kinds, free, stepped: stepped.transpose()?, at }))
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
        let mut text = listing.text(&map.scene().identifier);
        if request.direct {
            text.push_str(&format!("\nsearched: {searched}\n"));
        }
        let document = to_json(&Document::new(DocumentKind::Orbits, map.scene(), &listing))?;
        let origin = self.origin(map);
        let offsets = self.at.iter().flat_map(|at| origin.remarks("at", at));
        let mut answer = Answer {
            remarks: map.remarks().chain(offsets).chain(listing.remarks()).collect(),
            ended: None,
            ..Answer::new("orbits", text, document, listing.data_table())
        };
        match (&listing.loci, &request.loci) {
            (Some(loci), Some(asked)) => {
                answer.tables.push(("loci", listing.loci_data_table()));
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
