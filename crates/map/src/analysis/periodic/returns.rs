//! Returns one by one, their contacts prescribed: what orbits that do not close are put together
//! from.
//!
//! One idea: every return has variables of its own, so that an orbit of any length is as well
//! conditioned as one return.

use nalgebra::DMatrix;

use super::direct_equations::DirectOrbitEquations;
use super::orbit::window_scales;
use crate::analysis::continuation::CurveEquations;
use crate::analysis::evaluation::MapEvaluation;
use crate::expansion::MapWindow;
use crate::iteration::{PassageSet, Tangent, Tangents};
use crate::numeric::Real;

/// A return in the units of its coordinates.
#[derive(Clone, Debug)]
pub(in crate::analysis) struct PrescribedReturn<S> {
    /// The section point.
    pub(in crate::analysis) point: Vec<S>,
    /// Its image.
    pub(in crate::analysis) image: Vec<S>,
    /// What the depths lack to the squares of the depth variables, where these are variables.
    pub(in crate::analysis) lacking: Vec<S>,
    /// Derivatives of the three, row by row, by the variables of the return and the free
    /// parameters.
    pub(in crate::analysis) slopes: DMatrix<S>,
    /// Depths of the passages without contact, where these are known.
    pub(in crate::analysis) free: Vec<S>,
}

impl<S: Real> PrescribedReturn<S> {
    /// A component: of the section point, then the image, then what the depths lack.
    pub(in crate::analysis) fn value(&self, part: usize) -> S {
        let all = self.point.iter().chain(&self.image).chain(&self.lacking);
        all.copied().nth(part).unwrap_or(S::zero())
    }
}

/// A number of returns with contacts prescribed: each has its own variables, and free parameters
/// follow those of all.
pub(in crate::analysis) trait PrescribedReturns<S: Real> {
    /// Coordinates of a section point.
    fn dimension(&self) -> usize;
    /// Number of returns.
    fn returns(&self) -> usize;
    /// Number of variables of a return.
    fn variables(&self, number: usize) -> usize;
    /// The variables of a return that vanish where one of its contacts begins, by passage.
    fn depth_variables(&self, number: usize) -> Vec<(usize, usize)>;
    /// A return from the unknowns of all; `first` is the first of its own.
    fn at(&mut self, number: usize, first: usize, unknowns: &[S]) -> Option<PrescribedReturn<S>>;
    /// The range of a variable of a return.
    fn range(&self, number: usize, variable: usize) -> [f64; 2];
    /// The range of a free parameter.
    fn parameter_range(&self, place: usize) -> [f64; 2];
    /// Rounding of the derivatives over that of the numbers.
    fn rounding() -> f64;
}

/// Returns of a map. The variables are the coordinates and the depth variable of each contact, in
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
    /// Returns with these contacts, the parameters `free` within ranges of offsets, the others at
    /// the offsets `at`; coordinates and depth variables are followed up to `reach` of their units.
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

    /// The unknowns of section points with the depth variables of each return and of parameters,
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

    /// Unit of the coordinates, and of the depth variables.
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

/// Returns of direct simulation. The variables are those of the orbits' equations: with the square
/// root of the gap in the place of a coordinate where a return begins with contact.
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
