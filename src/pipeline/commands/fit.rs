//! Fits and noise: parameters from measured section points, and densities of orbits under noise.

use serde::{Deserialize, Serialize};

use crate::analysis::Progress;
use crate::analysis::fit::{FitRequest, MeasuredSeries};
use crate::analysis::noise::{NoiseLaw, NoiseRequest};
use crate::model::Method;
use crate::pipeline::keys::{ActiveParameters, COORDINATES, KeyError, named_offsets, place_of};
use crate::pipeline::{Answer, Error, Map};
use crate::report::{
    Document, DocumentKind, Named, fit_remarks, fit_table, fit_text, noise_figures, noise_remarks,
    noise_table, noise_text, to_json,
};

/// Keys of a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitKeys {
    /// Active parameters to fit.
    pub parameters: Vec<String>,
    /// Offsets of active parameters, 0 if not named; starting values for those that are fitted.
    pub at: Named<f64>,
    /// Standard deviation of the measurement for every coordinate. Default: that of the residuals.
    pub noise: Named<f64>,
    /// Number of returns in a piece of a series; each piece has a start of its own. 0: one piece.
    pub piece: usize,
    /// Number of points at the end of every series that are predicted instead of fitted.
    pub withheld: usize,
    /// Method that computes images.
    #[serde(alias = "using")]
    pub method: Method,
}

impl Default for FitKeys {
    /// No parameter; guarded iteration of pieces of ten returns.
    fn default() -> Self {
        Self {
            parameters: Vec::new(),
            at: Named::default(),
            noise: Named::default(),
            piece: FitRequest::PIECE,
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
        let noise = match self.noise.is_empty() {
            true => None,
            false => Some(self.deviations(map)?),
        };
        Ok(FitRequest {
            parameters: places,
            at: parameters.at(&self.at)?,
            series,
            noise,
            piece: self.piece,
            withheld: self.withheld,
            method: self.method,
        })
    }

    /// Standard deviation of every coordinate.
    fn deviations(&self, map: &Map) -> Result<Vec<f64>, KeyError> {
        let coordinates = &map.local().section.coordinates;
        let noise = named_offsets("noise", COORDINATES, &self.noise, coordinates)?;
        match noise.iter().find(|&&deviation| deviation <= 0.0) {
            Some(&value) => Err(KeyError::NotPositive { key: "noise", value }),
            None => Ok(noise),
        }
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
        let offsets = map.settled().graze().offset_remarks("at", &self.at);
        Ok(Answer {
            remarks: map.remarks().chain(offsets).chain(remarks).collect(),
            ..Answer::new("fit", fit_text(map.local(), &fit)?, document, fit_table(&fit)?)
        })
    }
}

/// Keys of orbits under noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseKeys {
    /// Standard deviations of active parameters, drawn at random at every return.
    pub deviations: Named<f64>,
    /// Means of active parameters as offsets, 0 if not named.
    pub at: Named<f64>,
    /// Distribution of the parameters.
    pub law: NoiseLaw,
    /// Offsets of section coordinates at the start, 0 if not named.
    pub start: Named<f64>,
    /// Number of orbits.
    pub orbits: usize,
    /// Number of returns before counting begins.
    pub transient: usize,
    /// Number of returns that are counted.
    pub keep: usize,
    /// First and last offset of a coordinate. Default: the window.
    pub range: Named<[f64; 2]>,
    /// Number of cells along every coordinate.
    pub cells: usize,
    /// Seed of the random number generators.
    pub seed: u64,
    /// Method that computes the returns.
    #[serde(alias = "using")]
    pub method: Method,
}

impl Default for NoiseKeys {
    /// A thousand guarded orbits of a thousand returns each, after a hundred; a hundred cells.
    fn default() -> Self {
        Self {
            deviations: Named::default(),
            at: Named::default(),
            law: NoiseLaw::Normal,
            start: Named::default(),
            orbits: 1000,
            transient: 100,
            keep: 1000,
            range: Named::default(),
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
        for (name, range) in &self.range.0 {
            ranges[place_of("range", COORDINATES, name, coordinates)?] = *range;
        }
        if let Some(range) = ranges.iter().find(|[from, to]| !(to - from).is_normal()) {
            return Err(KeyError::NotFinite { key: "range", value: range[1] - range[0] });
        }
        let count = |key, value: usize| match value {
            0 => Err(KeyError::NotPositive { key, value: 0.0 }),
            value => Ok(value),
        };
        let deviations = parameters.offsets("deviations", &self.deviations)?;
        if let Some(&value) = deviations.iter().find(|deviation| **deviation < 0.0) {
            return Err(KeyError::Negative { key: "deviations", value });
        }
        Ok(NoiseRequest {
            at: parameters.at(&self.at)?,
            deviations,
            law: self.law,
            start: named_offsets("start", COORDINATES, &self.start, coordinates)?,
            orbits: count("orbits", self.orbits)?,
            transient: self.transient,
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
        let (local, table) = (map.local(), noise_table(map.local(), &request, &found)?);
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
