//! The section map of a scene as a map that an atlas can hold, and a [`DiscreteMap`] that takes its
//! images from the atlas.
//!
//! One idea: on a tangency section every contact of the grazing surface begins at a section point,
//! and the map is a root of the depth there. With the signed root of the depth as a coordinate the
//! map is smooth on both sides of 0, and a plane at 0 cuts every box that a graze would cut.

use std::cmp::Reverse;
use std::sync::{Arc, Mutex};

use super::direct_image::DirectEnd;
use super::direct_map::DirectMap;
use super::error::AnalysisError;
use super::section_frame::newton_to_rounding;
use crate::atlas::{
    Atlas, AtlasOptions, Cell, Expansion, FrozenLeaves, Interpolation, LeafKind, Tabulated,
};
use crate::iteration::parallel::{self, locked};
use crate::iteration::{DiscreteMap, MapOrbit, OrbitEnd, OrbitRequest, PhaseCircle, StepInfo};
use crate::jet::{Jet, JetSpace};
use crate::numeric::low_discrepancy;

/// Use of a section map, for which it is tabulated.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TabulatedUse {
    /// Offsets of all active parameters; those that vary are ignored. Empty for the graze.
    pub(super) parameters: Vec<f64>,
    /// Parameters that vary, by place, with the first and last offset.
    pub(super) varied: Vec<(usize, [f64; 2])>,
    /// Starts of orbits; empty for the map's own.
    pub(super) starts: Vec<Vec<f64>>,
    /// Whether the state is carried from value to value of the parameters.
    pub(super) carried: bool,
    /// Number of returns.
    pub(super) returns: f64,
}

/// Most and fewest parameter values at which orbits are followed to find where leaves pay, and the
/// part of all returns that these orbits may take.
const EXPLORED: [usize; 2] = [256, 16];
const EXPLORING: f64 = 0.05;
/// Iterates of each of these orbits, and those before, on the way to an attractor.
const FOLLOWED: usize = 60;
const DROPPED: usize = 40;
/// Returns that a leaf must save, in those that it takes, and the part of all returns that leaves
/// may take.
const GAIN: f64 = 4.0;
const MAKING: f64 = 0.1;
/// Products of numbers that take as long as a fast direct return.
const PRODUCTS_OF_RETURN: f64 = 2000.0;
/// Part of the returns that must have a leaf: with fewer, direct simulation in lanes is as fast.
const FEWEST: f64 = 0.5;
/// Part of its width that a region reaches beyond the points visited, on each side.
const MARGIN: f64 = 0.1;
/// Most Newton steps to a depth.
const NEWTON_STEPS: usize = 30;
/// Largest error of a depth that was solved for, as a share of the largest depth of the region:
/// Newton's method ends at rounding, unless it does not converge.
const MET: f64 = 1e-12;
/// Bits of a label that tell which passages made contact.
const PASSAGE_BITS: u32 = 16;
/// Halvings of a box along each axis.
const HALVINGS: u32 = 7;
/// Largest memory of the coefficients of all leaves.
const MEMORY: usize = 1 << 29;
/// Tolerance of a box, order of its polynomials, and points at which they are checked.
const TOLERANCE: f64 = 1e-6;
const ORDER: usize = 6;
const CHECKED: usize = 12;
/// Most axes: with seven the polynomials of a box take thousands of returns.
const MOST_AXES: usize = 6;

/// Section map over a region of coordinates and parameters.
///
/// The coordinates of a point are offsets, but for one on a tangency section, in whose place the
/// signed root of the depth stands; the parameters that vary follow. Images are offsets, with the
/// whole periods of the phase.
#[derive(Clone, Debug)]
pub(super) struct SectionTable<'a> {
    direct: DirectMap<'a>,
    fit: Arc<Interpolation>,
    planned: TabulatedUse,
    ranges: Vec<[f64; 2]>,
    root: Option<RootAxis>,
    label: u64,
}

/// Coordinate in whose place the signed root of the depth stands.
#[derive(Clone, Copy, Debug)]
struct RootAxis {
    coordinate: usize,
    /// Slope of the gap by the coordinate at the graze.
    slope: f64,
}

/// Signed root of the depth of a gap.
fn signed_root(gap: f64) -> f64 {
    gap.abs().sqrt().copysign(-gap)
}

impl<'a> SectionTable<'a> {
    /// Atlas of a section map, with leaves where orbits come so often that these pay; `None` if it
    /// has too few. Its region holds the orbits that were followed, all over the range of the
    /// parameters.
    ///
    /// Which leaves it has depends on the use alone, not on the number of threads.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::TooManyAxes`].
    pub(super) fn atlas(
        direct: DirectMap<'a>,
        planned: TabulatedUse,
        request: &OrbitRequest,
        start: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Result<Option<Atlas<Self>>, AnalysisError> {
        let axes = direct.dimension() + planned.varied.len();
        let too_many = || AnalysisError::TooManyAxes { found: axes, most: MOST_AXES };
        if axes > MOST_AXES {
            return Err(too_many());
        }
        let returns = planned.returns.max(1.0);
        let size = JetSpace::uniform(axes, ORDER).map_err(|_| too_many())?.len();
        let preparing = (size as f64).powi(3) / PRODUCTS_OF_RETURN;
        if preparing > MAKING * returns {
            return Ok(None);
        }
        let fit = Interpolation::new(axes, ORDER).map_err(|_| too_many())?;
        let mut table = Self {
            root: RootAxis::of(&direct, &request.scales),
            direct,
            fit: Arc::new(fit),
            planned,
            ranges: Vec::new(),
            label: 0,
        };
        let visited = table.visited(request, start);
        table.ranges = table.region(&visited, &request.scales);
        let cost = table.fit.points() + CHECKED;
        let options = AtlasOptions {
            tolerance: TOLERANCE,
            order: ORDER,
            depth: HALVINGS * axes as u32,
            samples: CHECKED,
            boxes: MEMORY / (size_of::<f64>() * size * table.direct.dimension()),
        };
        let mut atlas = Atlas::new(table, options)?;
        let least = GAIN * cost as f64 * visited.len() as f64 / returns;
        let most = (MAKING * returns) as usize / cost;
        loop {
            let boxes = atlas.visited(&visited).into_iter();
            let pays = |&(_, count): &(usize, usize)| count as f64 >= least.max(1.0);
            let mut paying: Vec<(usize, usize)> = boxes.filter(pays).collect();
            // The boxes with most points first.
            paying.sort_by_key(|&(_, count)| Reverse(count));
            paying.truncate(most.saturating_sub(atlas.expanded()));
            if paying.is_empty() || atlas.is_exhausted() {
                break;
            }
            parallel::map(paying, |(node, _)| atlas.clone().expand(node));
        }
        atlas.close();
        let is_held =
            |point: &&Vec<f64>| matches!(atlas.kind_at(point), LeafKind::Smooth | LeafKind::Grazed);
        let held = visited.iter().filter(is_held).count();
        Ok((held as f64 >= FEWEST * visited.len() as f64).then_some(atlas))
    }

    /// Points that orbits visit, with the parameters that vary.
    fn visited(&self, request: &OrbitRequest, start: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
        let TabulatedUse { varied, starts, carried, .. } = &self.planned;
        // Without parameters that vary, as in a basin, most returns are on the way to attractors.
        let transient = if varied.is_empty() { 0 } else { DROPPED };
        let request = OrbitRequest { transient, keep: FOLLOWED, ..request.clone() };
        let each = (transient + FOLLOWED) as f64;
        let explored = (EXPLORING * self.planned.returns / each) as usize;
        let explored = explored.clamp(EXPLORED[1], EXPLORED[0]);
        let mut visited = Vec::new();
        let mut last: Option<Vec<f64>> = None;
        for index in 0..explored {
            // A carried state goes up and down again.
            let up = (2 * index + 1) as f64 / explored as f64;
            let shares = match carried {
                true => vec![1.0 - (1.0 - up).abs(); varied.len()],
                false => low_discrepancy(index, varied.len().max(1)),
            };
            let mut parameters = self.parameters();
            for ((place, [low, high]), share) in varied.iter().zip(shares) {
                parameters[*place] = low + share * (high - low);
            }
            let own = || match starts.len() {
                0 => start(&parameters),
                count => starts[index % count].clone(),
            };
            let begin = last.take().unwrap_or_else(own);
            let orbit = MapOrbit::of(&self.direct, &begin, &parameters, &request);
            if orbit.end != OrbitEnd::Completed {
                continue;
            }
            visited.extend(orbit.states().map(|state| self.point(state, &parameters)));
            last = carried.then_some(orbit.last);
        }
        visited
    }

    /// Point of a state and all parameters.
    fn point(&self, state: &[f64], parameters: &[f64]) -> Vec<f64> {
        let mut point = state.to_vec();
        if let Some(root) = self.root {
            point[root.coordinate] = signed_root(self.direct.gap(state, parameters));
        }
        point.extend(self.planned.varied.iter().map(|(place, _)| parameters[*place]));
        point
    }

    /// Ranges of the axes: of the parameters that vary, and of all points in the coordinates.
    fn region(&self, visited: &[Vec<f64>], scales: &[f64]) -> Vec<[f64; 2]> {
        let wide = |[low, high]: [f64; 2], floor: f64| {
            let margin = (MARGIN * (high - low)).max(floor);
            [low - margin, high + margin]
        };
        let coordinate = |(place, &scale): (usize, &f64)| {
            let values = || visited.iter().map(|point| point[place]);
            let ends = match visited.is_empty() {
                true => [0.0; 2],
                false => [
                    values().fold(f64::INFINITY, f64::min),
                    values().fold(f64::NEG_INFINITY, f64::max),
                ],
            };
            match self.root.filter(|root| root.coordinate == place) {
                None => wide(ends, scale),
                Some(root) => {
                    // The first halving is at a depth of 0.
                    let [low, high] = wide(ends, (root.slope.abs() * scale).sqrt());
                    let most = high.max(-low);
                    [-most, most]
                }
            }
        };
        let parameter = |(_, [first, last]): &(usize, [f64; 2])| {
            wide([first.min(*last), first.max(*last)], f64::MIN_POSITIVE)
        };
        let coordinates = scales.iter().enumerate().map(coordinate);
        coordinates.chain(self.planned.varied.iter().map(parameter)).collect()
    }

    /// Parameters that do not vary; the others are 0.
    fn parameters(&self) -> Vec<f64> {
        match self.planned.parameters.is_empty() {
            true => vec![0.0; self.direct.parameters()],
            false => self.planned.parameters.clone(),
        }
    }

    /// Offsets of the coordinates and of all parameters of a point; `None` if the depth is not met.
    fn offsets(&self, point: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let (state, varied) = point.split_at(self.direct.dimension());
        let (mut state, mut parameters) = (state.to_vec(), self.parameters());
        for ((place, _), value) in self.planned.varied.iter().zip(varied) {
            parameters[*place] = *value;
        }
        if let Some(root) = self.root {
            let wanted = -state[root.coordinate] * state[root.coordinate].abs();
            let mut lacks = |value: f64| {
                state[root.coordinate] = value;
                self.direct.gap(&state, &parameters) - wanted
            };
            let met = newton_to_rounding(wanted / root.slope, NEWTON_STEPS, |value| {
                Some(lacks(value) / root.slope)
            })?;
            let [_, deepest] = self.ranges[root.coordinate];
            let is_met = lacks(met).abs() <= MET * deepest * deepest;
            if !is_met {
                return None;
            }
        }
        Some((state, parameters))
    }

    /// Image of a point with the label of its contacts; `None` without one.
    fn labelled(&self, point: &[f64], image: &mut [f64]) -> Option<u64> {
        let (state, parameters) = self.offsets(point)?;
        let found = self.direct.simulate(&state, &parameters)?;
        if found.end != DirectEnd::Returned {
            return None;
        }
        image.copy_from_slice(&found.offsets);
        self.direct.circle().lift(image, found.turns);
        let passages = found.passages.iter().enumerate();
        let bits: u64 = passages.map(|(place, speed)| u64::from(speed.is_some()) << place).sum();
        let hits = found
            .hits
            .iter()
            .fold(0_u64, |word, &hits| word.wrapping_mul(31).wrapping_add(hits as u64));
        image.iter().all(|value| value.is_finite()).then_some(bits | hits << PASSAGE_BITS)
    }
}

impl RootAxis {
    /// Coordinate on which the gap depends most, in its scales; `None` on a stroboscopic section.
    fn of(direct: &DirectMap<'_>, scales: &[f64]) -> Option<Self> {
        if !direct.is_on_tangency() {
            return None;
        }
        let parameters = vec![0.0; direct.parameters()];
        let slope = |coordinate: usize| {
            let gap = |side: f64| {
                let mut state = vec![0.0; direct.dimension()];
                state[coordinate] = side * scales[coordinate];
                direct.gap(&state, &parameters)
            };
            (gap(1.0) - gap(-1.0)) / (2.0 * scales[coordinate])
        };
        let slopes = (0..direct.dimension()).map(|coordinate| (coordinate, slope(coordinate)));
        let size = |(coordinate, slope): &(usize, f64)| (slope * scales[*coordinate]).abs();
        let largest = slopes.max_by(|a, b| size(a).total_cmp(&size(b)));
        largest
            .filter(|(_, slope)| *slope != 0.0 && slope.is_finite())
            .map(|(coordinate, slope)| Self { coordinate, slope })
    }
}

impl Tabulated for SectionTable<'_> {
    fn ranges(&self) -> Vec<[f64; 2]> {
        self.ranges.clone()
    }

    fn scales(&self) -> Vec<f64> {
        let widths = self.ranges.iter().take(self.direct.dimension()).enumerate();
        let scale = |(place, [low, high]): (usize, &[f64; 2])| match self.root {
            // The range of a depth is that of its root, squared.
            Some(root) if root.coordinate == place => (high * high / root.slope).abs(),
            _ => high - low,
        };
        widths.map(scale).collect()
    }

    fn image(&mut self, point: &[f64], image: &mut [f64]) -> bool {
        self.labelled(point, image).is_some()
    }

    fn expand(&mut self, cell: &Cell, order: usize) -> Expansion {
        let axes = cell.centre.len();
        if let Some(RootAxis { coordinate, .. }) = self.root
            && cell.centre[coordinate].abs() < cell.half[coordinate]
        {
            let space = JetSpace::uniform(axes, order);
            let root = space.map(|space| Jet::variable(&space, coordinate, 0.0));
            return Expansion::Unresolved { crossing: root.ok() };
        }
        let fit = Arc::clone(&self.fit);
        let mut label = 0;
        let expansion = fit.expand(cell, &self.scales(), |point, image| {
            let found = self.labelled(point, image);
            label = found.unwrap_or(0);
            found
        });
        self.label = label;
        expansion
    }

    fn label(&self) -> u64 {
        self.label
    }
}

/// Section map at fixed parameters, from an atlas where it has a leaf, by direct simulation
/// elsewhere.
pub(super) struct AtlasMap<'a> {
    dimension: usize,
    parameters: Vec<f64>,
    circle: PhaseCircle,
    root: Option<RootAxis>,
    gap: AffineGap,
    tabulated: Mutex<TabulatedMap<'a>>,
}

struct TabulatedMap<'a> {
    atlas: Atlas<SectionTable<'a>>,
    leaves: FrozenLeaves,
    point: Vec<f64>,
}

impl<'a> AtlasMap<'a> {
    /// Map of an atlas at values of all active parameters.
    pub(super) fn new(atlas: &Atlas<SectionTable<'a>>, parameters: &[f64]) -> Self {
        let mut atlas = atlas.clone();
        let table = atlas.map();
        let varied: Vec<f64> =
            table.planned.varied.iter().map(|(place, _)| parameters[*place]).collect();
        Self {
            gap: AffineGap::new(&table.direct, parameters, &table.scales()),
            parameters: parameters.to_vec(),
            circle: table.direct.circle(),
            dimension: table.direct.dimension(),
            root: table.root,
            tabulated: Mutex::new(TabulatedMap {
                atlas,
                leaves: FrozenLeaves::new(&varied),
                point: Vec::new(),
            }),
        }
    }

    /// Whether the map is that at these parameters.
    pub(super) fn is_at(&self, parameters: &[f64]) -> bool {
        self.parameters == parameters
    }
}

impl DiscreteMap for AtlasMap<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> usize {
        0
    }

    fn circle(&self) -> PhaseCircle {
        self.circle
    }

    fn step(&self, state: &[f64], _: &[f64], image: &mut [f64]) -> StepInfo {
        let tabulated = &mut *locked(&self.tabulated);
        let TabulatedMap { atlas, leaves, point } = tabulated;
        point.clear();
        point.extend_from_slice(state);
        let mut depth = 0.0;
        if let Some(root) = self.root {
            let simulated = || atlas.map().direct.gap(state, &self.parameters);
            let gap = self.gap.at(state).unwrap_or_else(simulated);
            depth = (-gap).max(0.0);
            point[root.coordinate] = signed_root(gap);
        }
        match leaves.tabulated(atlas, point, image) {
            Err(_) => atlas.map().direct.step(state, &self.parameters, image),
            Ok((_, label)) => {
                let mut info = StepInfo { turns: self.circle.reduce(image), ..StepInfo::default() };
                for passage in (0..PASSAGE_BITS as usize).filter(|place| label >> place & 1 == 1) {
                    info.add_passage(passage, depth);
                }
                info.checked(image)
            }
        }
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        _: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        let atlas = &mut locked(&self.tabulated).atlas;
        atlas.map().direct.step_jacobian(state, &self.parameters, image, jacobian)
    }
}

/// Gap at section points with fixed parameters, if it is affine.
struct AffineGap {
    constant: f64,
    slopes: Option<Vec<f64>>,
}

impl AffineGap {
    /// Points at which the gap is compared.
    const COMPARED: usize = 8;

    fn new(direct: &DirectMap<'_>, parameters: &[f64], scales: &[f64]) -> Self {
        let dimension = direct.dimension();
        let gap = |state: &[f64]| direct.gap(state, parameters);
        let constant = gap(&vec![0.0; dimension]);
        let slope = |place: usize| {
            let mut state = vec![0.0; dimension];
            state[place] = scales[place];
            (gap(&state) - constant) / scales[place]
        };
        let slopes: Vec<f64> = (0..dimension).map(slope).collect();
        let affine = Self { constant, slopes: Some(slopes) };
        let agrees = |index: usize| {
            let shares = low_discrepancy(index, dimension);
            let state: Vec<f64> =
                shares.iter().zip(scales).map(|(share, scale)| (share - 0.5) * scale).collect();
            let size = constant.abs() + scales.iter().fold(0.0, |sum, scale| sum + scale);
            affine.at(&state).is_some_and(|value| (value - gap(&state)).abs() <= 1e-15 * size)
        };
        match (0..Self::COMPARED).all(agrees) {
            true => affine,
            false => Self { constant, slopes: None },
        }
    }

    fn at(&self, state: &[f64]) -> Option<f64> {
        let slopes = self.slopes.as_ref()?;
        let terms = slopes.iter().zip(state);
        Some(terms.fold(self.constant, |sum, (slope, value)| sum + slope * value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hybrid::HybridSystem;
    use crate::model::Scene;
    use crate::orbit::locate;

    /// Calls `work` with the direct map of a scene of the catalogue.
    fn with_direct(name: &str, work: impl FnOnce(DirectMap<'_>)) {
        let scene = Scene::of_catalogue(name).expect("a scene");
        let located = locate(&scene).expect("a search");
        let orbit = located.into_result().expect("a grazing orbit");
        let system = HybridSystem::new(&scene.model);
        work(DirectMap::new(&system, &scene, &orbit).expect("a map"));
    }

    /// Atlas over a range of the first active parameter, and the orbits from beside the graze.
    fn atlas(direct: DirectMap<'_>, range: [f64; 2]) -> Atlas<SectionTable<'_>> {
        let request = OrbitRequest::new(0, 0, &vec![1e-2; direct.dimension()]);
        let request = request.on_circle(direct.circle()).escaping_at(&[1e3; 2]);
        let start = vec![1e-2; direct.dimension()];
        let varied = vec![(0, range)];
        let planned = TabulatedUse { varied, returns: 1e7, ..TabulatedUse::default() };
        let atlas = SectionTable::atlas(direct, planned, &request, |_| start.clone());
        atlas.expect("few axes").expect("leaves that pay")
    }

    /// Rigid and compliant stops, far beyond the windows of their maps.
    #[test]
    fn images_are_within_the_tolerance_where_orbits_come() {
        for (name, range) in [("linear", [-0.3, 1.2]), ("soft_b", [-0.2, 0.2])] {
            with_direct(name, |direct| {
                let mut atlas = atlas(direct, range);
                let found = atlas.measure(2000, || ());
                assert_eq!(found.violations, Vec::<Vec<f64>>::new(), "{name}");
                assert!(found.tabulated > 40, "{name}: {found:?}");
                assert!(found.largest_error > 1e-10, "{name}: {found:?}");
            });
        }
    }

    #[test]
    fn steps_have_the_contacts_and_turns_of_direct_returns() {
        with_direct("linear", |direct| {
            let atlas = atlas(direct.clone(), [-0.3, 1.2]);
            let map = AtlasMap::new(&atlas, &[0.4, 0.0]);
            let mut state = vec![0.02, 0.1];
            let (mut image, mut exact) = (vec![0.0; 2], vec![0.0; 2]);
            let (mut tabulated, mut touched) = (0, 0);
            for _ in 0..2000 {
                let found = map.step(&state, &[], &mut image);
                let truth = direct.step(&state, &[0.4, 0.0], &mut exact);
                assert_eq!(found.passages, truth.passages, "{state:?}");
                assert_eq!(found.turns, truth.turns, "{state:?}");
                for (value, exact) in image.iter().zip(&exact) {
                    assert!((value - exact).abs() < 2e-5, "{state:?}: {image:?} {exact:?}");
                }
                tabulated += usize::from(!found.simulated);
                touched += usize::from(!found.passages.is_empty());
                state.clone_from(&exact);
            }
            assert!(tabulated > 1900 && touched > 200, "{tabulated} {touched}");
        });
    }

    #[test]
    fn the_leaves_do_not_depend_on_the_number_of_threads() {
        with_direct("linear", |direct| {
            let made = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let made = || atlas(direct.clone(), [-0.1, 0.1]);
                pool.expect("threads").install(made)
            };
            let [mut one, mut three] = [made(1), made(3)];
            assert_eq!((one.counts(), one.expanded()), (three.counts(), three.expanded()));
            let (mut image, mut other) = (vec![0.0; 2], vec![0.0; 2]);
            for index in 0..500 {
                let point = one.spread(index);
                assert_eq!(one.image(&point, &mut image), three.image(&point, &mut other));
                let bits = |image: &[f64]| image.iter().map(|it| it.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&image), bits(&other), "{point:?}");
            }
        });
    }
}
