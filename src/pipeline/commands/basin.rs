//! `basin`: where the states of a plane of the section go.

use serde::{Deserialize, Serialize};

use crate::analysis::basin::BasinRequest;
use crate::model::Method;
use crate::pipeline::Map;
use crate::pipeline::keys::{ActiveParameters, COORDINATES, KeyError, named_offsets, place_of};
use crate::report::Named;

/// The keys of `basin`, in the place of a table of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BasinKeys {
    /// Offsets of active parameters, those not named 0.
    pub at: Named<f64>,
    /// The coordinates that span the plane, the horizontal one first; by default the first two.
    pub axes: Vec<String>,
    /// First and last offset along an axis; by default the window.
    pub range: Named<[f64; 2]>,
    /// Cells along both axes, or along each.
    pub points: Vec<u32>,
    /// Offsets of the section's other coordinates, those not named 0.
    pub start: Named<f64>,
    /// What follows the states.
    pub with: Option<Method>,
    /// Returns of the saddles whose manifolds are computed.
    pub manifolds: Option<u8>,
}

impl BasinKeys {
    /// Whether none of them is given.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What the keys ask for, in numbers.
    ///
    /// # Errors
    ///
    /// [`KeyError`] for names and numbers that the map does not have.
    pub fn request(&self, map: &Map) -> Result<BasinRequest, KeyError> {
        let mut request = BasinRequest::over_the_window(map.local());
        let coordinates = &map.local().section.coordinates;
        if !self.at.is_empty() {
            request.parameters = ActiveParameters::of(map.scene(), map.local()).at(&self.at)?;
        }
        if !self.start.is_empty() {
            request.origin = named_offsets("start", COORDINATES, &self.start, coordinates)?;
        }
        if let [first, second] = &self.axes[..] {
            let place = |name: &str| place_of("axes", COORDINATES, name, coordinates);
            request = request.over([place(first)?, place(second)?], map.local());
        } else if !self.axes.is_empty() {
            return Err(KeyError::NotTwoAxes { found: self.axes.len() });
        }
        for (name, range) in &self.range.0 {
            let place = place_of("range", COORDINATES, name, coordinates)?;
            let axis = request.axes.iter().position(|&axis| axis == place);
            let axis = axis.ok_or_else(|| KeyError::NoAxis { name: name.clone() })?;
            request.ranges[axis] = *range;
        }
        match self.points[..] {
            [] => {}
            [both] => request.points = [both as usize; 2],
            [first, second] => request.points = [first as usize, second as usize],
            _ => return Err(KeyError::NotTwoAxes { found: self.points.len() }),
        }
        request.method = self.with.unwrap_or(request.method);
        request.manifolds = self.manifolds.map(usize::from);
        Ok(request)
    }
}
