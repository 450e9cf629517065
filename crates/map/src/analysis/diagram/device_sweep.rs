//! A map whose orbits are computed by another processor, many at once.
//!
//! One idea: both processors produce the same bits, so that any orbit can be computed on either.
//! Small batches, orbits that leave the window on the device, and everything after a device failure
//! are computed by the underlying map on this processor.

use super::swept_map::{Settled, SideBySide, Start, SweptMap, TANGENT_TRANSIENT, by_multipliers};
use crate::expansion::MapWindow;
use crate::iteration::parallel;
use crate::iteration::{DeviceMap, DiscreteMap, Itinerary, MapOrbit, OrbitRequest, Period};
use crate::model::Method;

/// Fewest orbits for a launch.
const FEWEST: usize = 128;

/// Most orbits of a launch: several at once fill the device, and there are enough launches for all
/// cores to process the results.
const LANES: usize = 2048;

/// Most bytes returned by a launch.
const BYTES: usize = 1 << 25;

/// A map on another processor, guarded or alone, with the same map on this processor as its
/// fallback.
pub(in crate::analysis) struct DeviceSweep<'a> {
    map: Box<dyn SweptMap + 'a>,
    device: &'a DeviceMap,
    /// Window of the map, if direct simulation replaces it outside.
    window: Option<&'a MapWindow>,
    lanes: usize,
}

impl<'a> DeviceSweep<'a> {
    /// Moves a map to another processor, for orbits of `keep` kept iterates; a direct simulation
    /// stays on this one.
    pub(in crate::analysis) fn of(
        map: Box<dyn SweptMap + 'a>,
        device: &'a DeviceMap,
        window: &'a MapWindow,
        keep: usize,
    ) -> Box<dyn SweptMap + 'a> {
        let window = match map.method() {
            Method::Direct | Method::Atlas => {
                device.leave_direct();
                return map;
            }
            Method::Map => None,
            Method::Guarded => Some(window),
        };
        let bytes = device.numbers(keep) * size_of::<f64>();
        let lanes = (BYTES / bytes.max(1)).clamp(FEWEST, LANES);
        Box::new(Self { map, device, window, lanes })
    }

    /// Orbits by the underlying map, on all cores.
    fn behind(&self, starts: &[Start], request: &OrbitRequest) -> Vec<Settled> {
        let chunks = starts.chunks(self.map.lanes());
        parallel::map(chunks, |starts| self.map.settle(starts, request, &|| ()))
            .into_iter()
            .flatten()
            .collect()
    }
}

impl SweptMap for DeviceSweep<'_> {
    fn method(&self) -> Method {
        self.map.method()
    }

    fn parameters(&self) -> usize {
        self.map.parameters()
    }

    fn segments(&self) -> usize {
        self.map.segments()
    }

    fn lanes(&self) -> usize {
        self.lanes
    }

    fn settle(&self, starts: &[Start], request: &OrbitRequest, _: &dyn Fn()) -> Vec<Settled> {
        if starts.len() < FEWEST || self.device.has_failed() {
            return self.behind(starts, request);
        }
        // Same request as the map alone uses on this processor.
        let own = match self.window {
            None => &request.near_the_window(),
            Some(_) => request,
        };
        let points: Vec<[&[f64]; 2]> =
            starts.iter().map(|start| [&*start.state, &*start.parameters]).collect();
        let Some(made) = self.device.orbits(&points, own, TANGENT_TRANSIENT, self.window) else {
            return self.behind(starts, request);
        };
        let left = made.iter().zip(starts).filter(|(made, _)| made.is_none());
        let left: Vec<Start> = left.map(|(_, start)| start.clone()).collect();
        let mut behind = self.behind(&left, request).into_iter();
        let settled = made.into_iter().zip(starts).filter_map(|(made, start)| match made {
            Some((orbit, mean)) => {
                let lyapunov = match orbit.period {
                    Period::Periodic(_) => by_multipliers(&*self.map, &orbit, start),
                    Period::NotFound => mean,
                };
                Some(Settled { orbit, lyapunov })
            }
            None => behind.next(),
        });
        settled.collect()
    }

    fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
        self.map.at(parameters)
    }

    fn side_by_side(&self, parameters: &[f64], work: &mut dyn FnMut(&mut SideBySide<'_>)) {
        self.map.side_by_side(parameters, work);
    }

    fn start(&self, parameters: &[f64]) -> Vec<f64> {
        self.map.start(parameters)
    }

    fn observe_all(&self, orbit: &MapOrbit, parameters: &[f64]) -> Vec<f64> {
        self.map.observe_all(orbit, parameters)
    }

    fn itinerary(&self) -> &Itinerary {
        self.map.itinerary()
    }

    fn hits(&self, orbit: &MapOrbit, number: usize, parameters: &[f64]) -> Vec<u32> {
        self.map.hits(orbit, number, parameters)
    }

    fn has_jacobian(&self) -> bool {
        self.map.has_jacobian()
    }
}
