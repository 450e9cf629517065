//! Direct simulation of several orbits in lanes, each at its own parameters.

use super::direct_image::DirectImage;
use super::section_frame::SectionFrame;
use crate::hybrid::{DirectReturn, LaneReturns};
use crate::iteration::{MapOrbit, OrbitRequest, StepInfo};
use crate::numeric::Lanes;

/// The section map by direct simulation with other parameters in every lane, made by
/// [`DirectMap::in_lanes`](super::DirectMap::in_lanes).
///
/// Every image is that of [`DirectMap`](super::DirectMap) to the last bit.
#[derive(Clone, Debug)]
pub struct DirectLanes<'a, const N: usize> {
    frames: Vec<SectionFrame<f64>>,
    parameters: Vec<Vec<f64>>,
    returns: LaneReturns<'a, N>,
    /// Of every passage.
    normal_accelerations: Vec<f64>,
    starts: Vec<Lanes<N>>,
}

impl<'a, const N: usize> DirectLanes<'a, N> {
    pub(super) fn new(
        image: &DirectImage<'a, f64>,
        normal_accelerations: &[f64],
        parameters: &[&[f64]],
    ) -> Option<Self> {
        let mut frames = Vec::with_capacity(parameters.len());
        let mut alone: Vec<DirectReturn<'a, f64>> = Vec::with_capacity(parameters.len());
        for own in parameters {
            let (frame, returns) = image.at(own).ok()?;
            frames.push(frame);
            alone.push(returns);
        }
        let dimension = frames.first()?.state().len();
        Some(Self {
            frames,
            parameters: parameters.iter().map(|own| own.to_vec()).collect(),
            returns: LaneReturns::new(alone)?,
            normal_accelerations: normal_accelerations.to_vec(),
            starts: vec![Lanes::splat(0.0); dimension],
        })
    }

    /// Iterates a state in every lane, as [`MapOrbit::of`] does one.
    ///
    /// # Panics
    ///
    /// If there is not one state of the map's length for every lane.
    pub fn orbits(&mut self, initial: &[&[f64]], request: &OrbitRequest) -> Vec<MapOrbit> {
        assert_eq!(initial.len(), self.frames.len(), "one state for every lane");
        MapOrbit::in_step(initial, request, |going, states, images, infos| {
            self.step(going, states, images, infos);
        })
    }

    /// One step of the lanes that go on, their states one after another.
    pub fn step(
        &mut self,
        going: &[bool],
        states: &[f64],
        images: &mut [f64],
        infos: &mut [StepInfo],
    ) {
        let dimension = states.len() / self.frames.len();
        let mut wanted = [false; N];
        for (lane, state) in states.chunks_exact(dimension).enumerate() {
            let frame = &mut self.frames[lane];
            wanted[lane] = going[lane] && frame.place(state, &self.parameters[lane]).is_ok();
            for (start, &value) in self.starts.iter_mut().zip(frame.state()) {
                start[lane] = value;
            }
        }
        let returned = self.returns.images(&self.starts, wanted);
        for (lane, image) in images.chunks_exact_mut(dimension).enumerate() {
            infos[lane] = StepInfo::default();
            if !wanted[lane] || !returned.returned[lane] {
                image.fill(f64::NAN);
                continue;
            }
            let offsets =
                self.frames[lane].offset_values(|component| returned.state[component][lane]);
            for (image, offset) in image.iter_mut().zip(offsets) {
                *image = offset;
            }
            let passages = returned.speeds.iter().zip(&self.normal_accelerations);
            for (passage, (speeds, acceleration)) in passages.enumerate() {
                if let Some(speed) = speeds[lane] {
                    infos[lane].add_passage(passage, 0.5 * speed * speed / acceleration);
                }
            }
            infos[lane] = infos[lane].checked(image);
        }
    }
}
