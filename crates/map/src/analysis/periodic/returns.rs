//! Single returns with prescribed contacts, the parts of orbits that do not close.
//!
//! One idea: every return has its own variables, so that an orbit of any length is as well
//! conditioned as one return.

use nalgebra::DMatrix;

use super::direct_equations::DirectOrbitEquations;
use super::orbit::window_scales;
use crate::analysis::evaluation::MapEvaluation;
use crate::continuation::CurveEquations;
use crate::expansion::MapWindow;
use crate::iteration::{PassageSet, Tangent, Tangents};
use crate::numeric::Real;

/// A return in units of its coordinates.
#[derive(Clone, Debug)]
pub(in crate::analysis) struct PrescribedReturn<S> {
    /// Section point.
    pub(in crate::analysis) point: Vec<S>,
    /// Image of the section point.
    pub(in crate::analysis) image: Vec<S>,
    /// Residuals `depth − y²`, one per contact; empty if there are no depth variables.
    pub(in crate::analysis) lacking: Vec<S>,
    /// Derivatives of the section point, the image and the residuals, as rows, by the variables of
    /// the return and the free parameters.
    pub(in crate::analysis) slopes: DMatrix<S>,
    /// Depths of the passages without contact, if known.
    pub(in crate::analysis) free: Vec<S>,
}

impl<S: Real> PrescribedReturn<S> {
    /// Component of the section point, the image or the residuals, numbered in this order.
    pub(in crate::analysis) fn value(&self, part: usize) -> S {
        let all = self.point.iter().chain(&self.image).chain(&self.lacking);
        all.copied().nth(part).unwrap_or(S::zero())
    }
}

/// Returns with prescribed contacts: each has its own variables; the free parameters follow those
/// of all returns.
pub(in crate::analysis) trait PrescribedReturns<S: Real> {
    /// Number of coordinates of a section point.
    fn dimension(&self) -> usize;
    /// Number of returns.
    fn returns(&self) -> usize;
    /// Number of variables of a return.
    fn variables(&self, number: usize) -> usize;
    /// Variables of a return that vanish where one of its contacts begins, as (passage, variable).
    fn depth_variables(&self, number: usize) -> Vec<(usize, usize)>;
    /// Return `number` from the unknowns of all; `first` is the index of its first unknown.
    fn at(&mut self, number: usize, first: usize, unknowns: &[S]) -> Option<PrescribedReturn<S>>;
    /// Range of a variable of a return.
    fn range(&self, number: usize, variable: usize) -> [f64; 2];
    /// Range of a free parameter.
    fn parameter_range(&self, place: usize) -> [f64; 2];
    /// Rounding of derivatives relative to that of the number type.
    fn rounding() -> f64;
}

/// Returns of a map. Variables are the coordinates and the depth variables of the contacts, in
/// half-widths of the window.
#[derive(Clone, Debug)]
pub(in crate::analysis) struct MapReturns<'a, S: Real> {
    map: &'a MapEvaluation<S>,
    returns: Vec<PassageSet>,
    dimension: usize,
    free: Vec<usize>,
    at: Vec<S>,
    scales: Vec<f64>,
    depth_unit: f64,
    reach: [f64; 2],
    ranges: Vec<[f64; 2]>,
}

impl<'a, S: Real> MapReturns<'a, S> {
    /// Returns with given contacts. The parameters in `free` vary within ranges of offsets, the
    /// others are fixed at the offsets `at`; `reach` bounds coordinates and depth variables, in
    /// their units.
    pub(in crate::analysis) fn new(
        map: &'a MapEvaluation<S>,
        returns: Vec<PassageSet>,
        window: &MapWindow,
        free: &[(usize, [f64; 2])],
        at: &[f64],
        reach: [f64; 2],
    ) -> Self {
        let scales = window_scales(window);
        let dimension = window.state.len();
        let ranges = free.iter();
        let ranges =
            ranges.map(|&(place, range)| range.map(|value| value / scales[dimension + place]));
        Self {
            map,
            returns,
            dimension,
            free: free.iter().map(|&(place, _)| place).collect(),
            at: at.iter().map(|&value| S::from_f64(value)).collect(),
            depth_unit: super::finite_or_one(window.depth.sqrt()),
            ranges: ranges.collect(),
            scales,
            reach,
        }
    }

    /// Offsets of all parameters.
    pub(in crate::analysis) fn parameters(&self, free: &[S]) -> Vec<S> {
        let mut parameters = self.at.clone();
        for (&place, &value) in self.free.iter().zip(free) {
            parameters[place] = value * S::from_f64(self.scales[self.dimension + place]);
        }
        parameters
    }

    /// Unknowns for section points with the depth variables of each return, and for parameters,
    /// from offsets.
    pub(in crate::analysis) fn unknowns(
        &self,
        points: &[(Vec<S>, Vec<S>)],
        parameters: &[S],
    ) -> Vec<S> {
        let scaled = |value: S, unit: f64| value / S::from_f64(unit);
        let mut unknowns = Vec::new();
        for (state, depths) in points {
            unknowns.extend(state.iter().zip(&self.scales).map(|(&x, &unit)| scaled(x, unit)));
            unknowns.extend(depths.iter().map(|&y| scaled(y, self.depth_unit)));
        }
        let free = self.free.iter();
        let free =
            free.map(|&place| scaled(parameters[place], self.scales[self.dimension + place]));
        unknowns.extend(free);
        unknowns
    }

    /// Units of the coordinates, and unit of the depth variables.
    pub(in crate::analysis) fn units(&self) -> (&[f64], f64) {
        (&self.scales[..self.dimension], self.depth_unit)
    }
}

impl<S: Real> PrescribedReturns<S> for MapReturns<'_, S> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn returns(&self) -> usize {
        self.returns.len()
    }

    fn variables(&self, number: usize) -> usize {
        self.dimension + self.returns[number].len()
    }

    fn depth_variables(&self, number: usize) -> Vec<(usize, usize)> {
        let passages = self.returns[number].iter().enumerate();
        passages.map(|(contact, passage)| (passage, self.dimension + contact)).collect()
    }

    fn at(&mut self, number: usize, first: usize, unknowns: &[S]) -> Option<PrescribedReturn<S>> {
        let (made, d) = (self.returns[number], self.dimension);
        let (own, free) = (self.variables(number), self.free.len());
        let size = own + free;
        let mut tangents = Tangents::new(size);
        let variables = &unknowns[first..first + own];
        let unit = |place: usize| match place {
            _ if place < d => self.scales[place],
            _ if place < own => self.depth_unit,
            _ => self.scales[d + self.free[place - own]],
        };
        let value = |place: usize| variables[place] * S::from_f64(unit(place));
        let mut point: Vec<Tangent<S>> =
            (0..d).map(|place| tangents.variable(place, value(place))).collect();
        let parameters = self.parameters(&unknowns[unknowns.len() - free..]);
        point.extend(parameters.iter().enumerate().map(|(parameter, &value)| {
            let place = self.free.iter().position(|&free| free == parameter);
            tangents.variable(place.map_or(size, |place| own + place), value)
        }));
        let mut slopes = DMatrix::from_element(d + own, size, S::zero());
        let depth_unit = S::from_f64(self.depth_unit * self.depth_unit);
        let (mut lacking, mut depths) = (Vec::new(), Vec::new());
        let copied = tangents;
        let mut passage = 0;
        let image = self.map.image_in(&mut tangents, point, |_, depth| {
            let here = passage;
            passage += 1;
            if !made.contains(here) {
                depths.push(depth.value / depth_unit);
                return None;
            }
            let place = d + lacking.len();
            let (row, y) = (d + place, value(place));
            for column in 0..size {
                slopes[(row, column)] = depth.tangent[column] / depth_unit;
            }
            slopes[(row, place)] -= (y + y) / depth_unit;
            lacking.push((depth.value - y * y) / depth_unit);
            Some(copied.variable(place, y))
        });
        for (row, end) in image.iter().enumerate() {
            let unit = S::from_f64(self.scales[row]);
            slopes[(row, row)] = S::one() / unit;
            for column in 0..size {
                slopes[(d + row, column)] = end.tangent[column] / unit;
            }
        }
        for column in 0..size {
            let unit = S::from_f64(unit(column));
            slopes.column_mut(column).iter_mut().for_each(|entry| *entry *= unit);
        }
        let image: Vec<S> = image
            .iter()
            .zip(&self.scales)
            .map(|(end, &unit)| end.value / S::from_f64(unit))
            .collect();
        let finite = image.iter().chain(slopes.iter()).all(|value| value.is_finite());
        finite.then_some(PrescribedReturn {
            point: variables[..d].to_vec(),
            image,
            lacking,
            slopes,
            free: depths,
        })
    }

    fn range(&self, _: usize, variable: usize) -> [f64; 2] {
        let reach = self.reach[usize::from(variable >= self.dimension)];
        [-reach, reach]
    }

    fn parameter_range(&self, place: usize) -> [f64; 2] {
        self.ranges[place]
    }

    fn rounding() -> f64 {
        1.0
    }
}

/// Returns of direct simulation. Variables are those of the orbit equations: where a return begins
/// with contact, the root of the gap replaces a coordinate.
impl<S: Real> PrescribedReturns<S> for DirectOrbitEquations<'_, S> {
    fn dimension(&self) -> usize {
        Self::dimension(self)
    }

    fn returns(&self) -> usize {
        self.itinerary().period()
    }

    fn variables(&self, _: usize) -> usize {
        Self::dimension(self)
    }

    fn depth_variables(&self, number: usize) -> Vec<(usize, usize)> {
        let own = 0..Self::dimension(self);
        let first = number * own.len();
        let begins = self.itinerary().returns()[number].contains(0);
        let own = own.filter(|place| begins && self.passage_of(first + place).is_some());
        own.map(|place| (0, place)).collect()
    }

    fn at(&mut self, number: usize, _: usize, unknowns: &[S]) -> Option<PrescribedReturn<S>> {
        self.return_at(number, unknowns, true)
    }

    fn range(&self, number: usize, variable: usize) -> [f64; 2] {
        CurveEquations::range(self, number * Self::dimension(self) + variable)
    }

    fn parameter_range(&self, place: usize) -> [f64; 2] {
        CurveEquations::range(self, Self::variables(self) + place)
    }

    fn rounding() -> f64 {
        Self::rounding()
    }
}
