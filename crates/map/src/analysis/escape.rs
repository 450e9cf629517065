//! How far an orbit may go before it counts as escaped: a length of the oscillator, not of its map.

use serde::{Deserialize, Serialize};

use crate::flow::{Field, Integrator};
use crate::model::Scene;
use crate::numeric::unbounded_number;
use crate::orbit::GrazingOrbit;

/// Points of the grazing orbit from which its extent is taken.
const SAMPLES: usize = 64;

/// A coordinate does not move along the grazing orbit where its extent is below this share of the
/// largest.
const STILL: f64 = 1e-9;

/// How far a coordinate of the section may go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EscapeBound {
    /// Name of the coordinate.
    pub coordinate: String,
    /// The bound in extents of the grazing orbit: `direct.escape` of the scene.
    pub extents: f64,
    /// Largest size of its offset; infinite where the coordinate does not move along the grazing
    /// orbit.
    #[serde(with = "unbounded_number")]
    pub offset: f64,
}

/// The bounds of every coordinate of the section: as many times the extent of the grazing orbit as
/// the scene says.
pub fn escape_bounds(scene: &Scene, orbit: &GrazingOrbit) -> Vec<EscapeBound> {
    let extents = extents(scene, orbit);
    let largest = extents.iter().copied().fold(0.0, f64::max);
    let times = scene.direct.escape;
    let coordinates = orbit.section_coordinates(scene).into_iter();
    let bound = |((name, _), extent): ((&str, _), f64)| EscapeBound {
        coordinate: name.to_owned(),
        extents: times,
        offset: if extent > STILL * largest { times * extent } else { f64::INFINITY },
    };
    coordinates.zip(extents).map(bound).collect()
}

/// Difference of the greatest and the least value of every coordinate along the grazing orbit.
pub(super) fn extents(scene: &Scene, orbit: &GrazingOrbit) -> Vec<f64> {
    let field = Field::free(&scene.model, &[]);
    let rounded = |values: &[crate::numeric::Dd]| -> Vec<f64> {
        values.iter().map(|value| value.to_f64()).collect()
    };
    let (mut state, parameters) = (rounded(&orbit.section_point), rounded(orbit.parameters()));
    let step = orbit.period.to_f64() / SAMPLES as f64;
    let mut ends: Vec<[f64; 2]> = state.iter().map(|&value| [value; 2]).collect();
    for _ in 0..SAMPLES {
        let Ok(next) = Integrator::new(&field).flow(&state, &parameters, step) else { break };
        state = next;
        for (ends, &value) in ends.iter_mut().zip(&state) {
            *ends = [ends[0].min(value), ends[1].max(value)];
        }
    }
    let coordinates = orbit.section.coordinates.iter();
    coordinates.map(|&component| ends[component][1] - ends[component][0]).collect()
}
