//! Fits and noise: parameters from measured section points, and densities of orbits under noise.

use serde::{Deserialize, Serialize};

use crate::analysis::Progress;
use crate::analysis::fit::{FitRequest, MeasuredSeries};
use crate::analysis::noise::{NoiseLaw, NoiseRequest};
use crate::model::Method;
use crate::pipeline::keys::{ActiveParameters, COORDINATES, KeyError, named_offsets, place_of};
#[cfg(feature = "cli")]
use crate::pipeline::options::{LAWS, RETURN_METHODS, one_of, positions, ranges, sizes};
use crate::pipeline::positions::{Counting, Ends, Origin, Position};
use crate::pipeline::{Answer, Error, Map};
use crate::report::{
    Document, DocumentKind, Named, fit_remarks, fit_table, fit_text, noise_figures, noise_remarks,
    noise_table, noise_text, to_json,
};

/// Keys of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct FitKeys {
    /// Active parameters to fit.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "P,...", value_delimiter = ',', required = true)
    )]
    pub parameters: Vec<String>,
    /// Offsets of active parameters from the graze (0 if not named); the fit starts there.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "P=OFFSET,...", value_parser = positions)
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Standard deviation of the measurement of every coordinate. Default: that of the residuals.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=SIZE,...", value_parser = sizes)
    )]
    pub noise: Option<Named<f64>>,
    /// Number of returns in a piece, which has a start of its own; 0: a series is one piece.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "N", default_value_t = FitRequest::PIECE as u32)
    )]
    pub piece: u32,
    /// Number of points at the end of every series that are predicted instead of fitted.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 0))]
    pub withheld: u32,
    /// Method that computes returns.
    #[serde(alias = "using")]
    #[cfg_attr(
        feature = "cli",
        arg(long, default_value = "guarded", value_parser = one_of(RETURN_METHODS))
    )]
    pub method: Method,
}

impl Default for FitKeys {
    /// No parameter; guarded iteration of pieces of ten returns.
    fn default() -> Self {
        Self {
            parameters: Vec::new(),
            at: None,
            values: Counting::default(),
            noise: None,
            piece: FitRequest::PIECE as u32,
            withheld: 0,
            method: Method::Guarded,
        }
    }
}

impl FitKeys {
    /// Request for these series, with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names and numbers that the map does not have.
    pub fn request(&self, map: &Map, series: Vec<MeasuredSeries>) -> Result<FitRequest, KeyError> {
        let parameters = ActiveParameters::of(map.scene(), map.local());
        let places = parameters.distinct("parameters", &self.parameters)?;
        if places.is_empty() {
            return Err(KeyError::NothingNamed { key: "parameters" });
        }
        let noise = self.noise.as_ref().filter(|noise| !noise.is_empty());
        let noise = noise.map(|noise| deviations(map, noise)).transpose()?;
        Ok(FitRequest {
            parameters: places,
            at: parameters.at(&self.origin(map).offsets(self.at.as_ref()))?,
            series,
            noise,
            piece: self.piece as usize,
            withheld: self.withheld as usize,
            method: self.method,
        })
    }

    fn origin<'m>(&self, map: &'m Map) -> Origin<'m> {
        Origin::new(map.settled().graze(), self.values)
    }

    /// Computes the fit and lays it out.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] as [`request`](Self::request), [`Error::Analysis`] for series whose rows have
    /// the wrong length, or that are too short.
    pub fn answer(
        &self,
        map: &Map,
        series: Vec<MeasuredSeries>,
        progress: &dyn Progress,
    ) -> Result<Answer, Error> {
        let fit = map.fit(&self.request(map, series)?, progress)?;
        let document = to_json(&Document::new(DocumentKind::Fit, map.scene(), &fit))?;
        let remarks = fit_remarks(&fit, self.method == Method::Map);
        let offsets = self.origin(map).remarks("at", self.at.as_ref());
        Ok(Answer {
            remarks: map.remarks().chain(offsets).chain(remarks).collect(),
            ..Answer::new("fit", fit_text(map.local(), &fit), document, fit_table(&fit))
        })
    }
}

/// Standard deviation of every coordinate.
fn deviations(map: &Map, noise: &Named<f64>) -> Result<Vec<f64>, KeyError> {
    let coordinates = &map.local().section.coordinates;
    let noise = named_offsets("noise", COORDINATES, noise, coordinates)?;
    match noise.iter().find(|&&deviation| deviation <= 0.0) {
        Some(&value) => Err(KeyError::NotPositive { key: "noise", value }),
        None => Ok(noise),
    }
}

/// Keys of orbits under noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct NoiseKeys {
    /// Standard deviations of active parameters.
    #[cfg_attr(
        feature = "cli",
        arg(long = "deviation", value_name = "P=SIZE,...", value_parser = sizes)
    )]
    pub deviations: Named<f64>,
    /// Means of active parameters, as offsets from the graze (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "P=OFFSET,...", value_parser = positions)
    )]
    pub at: Option<Named<Position>>,
    /// Whether all numbers of parameters and coordinates are values.
    #[cfg_attr(feature = "cli", command(flatten))]
    pub values: Counting,
    /// Distribution of the parameters.
    #[cfg_attr(feature = "cli", arg(long, default_value = "normal", value_parser = one_of(LAWS)))]
    pub law: NoiseLaw,
    /// Offsets of section coordinates at which the orbits start (0 if not named).
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=OFFSET,...", value_parser = positions)
    )]
    pub start: Option<Named<Position>>,
    /// Number of orbits.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 1000))]
    pub orbits: u32,
    /// Number of returns before counting begins.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 100))]
    pub transient: u32,
    /// Number of returns counted.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 1000))]
    pub keep: u32,
    /// First and last offset of a coordinate. Default: the window's.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "NAME=FROM:TO,...", value_parser = ranges)
    )]
    pub range: Option<Named<Ends>>,
    /// Number of cells along every coordinate.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = 100,
            value_parser = clap::value_parser!(u32).range(1..=1_000_000)
        )
    )]
    pub cells: u32,
    /// Seed of the random numbers; equal seeds give equal results.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = 0))]
    pub seed: u64,
    /// Method that computes returns.
    #[serde(alias = "using")]
    #[cfg_attr(
        feature = "cli",
        arg(long, default_value = "guarded", value_parser = one_of(RETURN_METHODS))
    )]
    pub method: Method,
}

impl Default for NoiseKeys {
    /// A thousand guarded orbits of a thousand returns each, after a hundred; a hundred cells.
    fn default() -> Self {
        Self {
            deviations: Named::default(),
            at: None,
            values: Counting::default(),
            law: NoiseLaw::Normal,
            start: None,
            orbits: 1000,
            transient: 100,
            keep: 1000,
            range: None,
            cells: 100,
            seed: 0,
            method: Method::Guarded,
        }
    }
}

impl NoiseKeys {
    /// Request with numbers in place of names.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names and numbers that the map does not have.
    pub fn request(&self, map: &Map) -> Result<NoiseRequest, KeyError> {
        let parameters = ActiveParameters::of(map.scene(), map.local());
        let coordinates = &map.local().section.coordinates;
        let widths = map.local().window.state.iter();
        let mut ranges: Vec<[f64; 2]> = widths.map(|&width| [-width, width]).collect();
        let origin = Origin::new(map.settled().graze(), self.values);
        for (name, range) in &origin.ranges(self.range.as_ref()).0 {
            ranges[place_of("range", COORDINATES, name, coordinates)?] = *range;
        }
        if let Some(range) = ranges.iter().find(|[from, to]| !(to - from).is_normal()) {
            return Err(KeyError::NotFinite { key: "range", value: range[1] - range[0] });
        }
        let count = |key, value: u32| match value {
            0 => Err(KeyError::NotPositive { key, value: 0.0 }),
            value => Ok(value as usize),
        };
        let start = origin.offsets(self.start.as_ref());
        let deviations = parameters.offsets("deviations", &self.deviations)?;
        if let Some(&value) = deviations.iter().find(|deviation| **deviation < 0.0) {
            return Err(KeyError::Negative { key: "deviations", value });
        }
        Ok(NoiseRequest {
            at: parameters.at(&origin.offsets(self.at.as_ref()))?,
            deviations,
            law: self.law,
            start: named_offsets("start", COORDINATES, &start, coordinates)?,
            orbits: count("orbits", self.orbits)?,
            transient: self.transient as usize,
            keep: count("keep", self.keep)?,
            ranges,
            cells: count("cells", self.cells)?,
            seed: self.seed,
            method: self.method,
        })
    }

    /// Computes the orbits and lays out their densities.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] as [`request`](Self::request), [`Error::Analysis`] if the simulator refuses
    /// the model.
    pub fn answer(&self, map: &Map, progress: &dyn Progress) -> Result<Answer, Error> {
        let request = self.request(map)?;
        let found = map.noise(&request, progress)?;
        let content = NoiseDocument { request: &request, found: &found };
        let document = to_json(&Document::new(DocumentKind::Noise, map.scene(), content))?;
        let remarks = noise_remarks(&found, self.method == Method::Map);
        let (local, table) = (map.local(), noise_table(map.local(), &request, &found));
        Ok(Answer {
            remarks: map.remarks().chain(remarks).collect(),
            ..Answer::new("noise", noise_text(local, &found), document, table)
                .with_figures(noise_figures(local, &request, &found))
        })
    }
}

/// JSON document of orbits under noise.
#[derive(Serialize)]
struct NoiseDocument<'a> {
    request: &'a NoiseRequest,
    #[serde(flatten)]
    found: &'a crate::analysis::noise::NoisyOrbits,
}
