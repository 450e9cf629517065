//! Basins of attraction in a plane of states of the section.
//!
//! One idea: attractors are found while the states of a grid are followed, and the grid is refined
//! where neighbouring cells go to different attractors, so that the cost of a picture is that of
//! its borders. States that escape and states that leave the window of a map used alone are
//! separate classes.

mod known;
mod manifolds;
mod search;

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::diagram::{SweepSubject, Timing};
use super::error::{AnalysisError, active_place, check_length, coordinate_place};
use super::motion::MotionEvents;
use super::periodic::ContactItinerary;
use super::progress::{PartProgress, Progress, Shard, given};
use super::refinement::{COMPUTED, Tiles, first_asked, neighbours, refine, refine_share};
use super::section_frame::{EscapeBound, escape_bounds, itinerary};
use super::section_table::TabulatedUse;
use super::time_series::TimeSeriesRequest;
use crate::expansion::LocalMap;
use crate::iteration::{OrbitName, OrbitRequest, Period, parallel};
use crate::model::{BasinPlan, Digest, Method, Scene, even_offsets};
use crate::numeric::low_discrepancy;
use crate::orbit::{GrazingOrbit, PoincareSectionKind};
use manifolds::{ManifoldPlane, manifolds};
use search::BasinSearch;

pub use super::refinement::{BLOCK, BlockProbes};
pub(super) use known::are_one_cycle;
pub use manifolds::{ManifoldBranch, ManifoldEnd, ManifoldKind, ManifoldSide, Manifolds, Saddle};

/// Request of [`basin`].
///
/// States and parameters are offsets from the grazing orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct BasinRequest {
    /// Offsets of all active parameters.
    pub parameters: Vec<f64>,
    /// Indices of the two coordinates of the section that span the plane, the horizontal one first.
    pub axes: [usize; 2],
    /// First and last offset along each axis.
    pub ranges: [[f64; 2]; 2],
    /// Number of cells along each axis.
    pub points: [usize; 2],
    /// Whether the state of every cell is followed, or only those along borders and probes.
    pub every_cell: bool,
    /// Offsets of all coordinates; those of the axes are ignored.
    pub origin: Vec<f64>,
    /// Iterates after which an orbit that reached no known attractor counts as settled.
    pub transient: usize,
    /// Longest period looked for.
    pub longest_period: usize,
    /// Method that iterates the states.
    pub method: Method,
    /// Longest period of the saddles whose manifolds are asked for; `None` for no manifolds.
    pub manifolds: Option<usize>,
}

/// Starts that tell where an atlas pays, and a guess of the returns in which an orbit reaches a
/// known attractor.
const STARTS: usize = 256;
const SETTLED_IN: usize = 50;

impl BasinRequest {
    /// Default number of cells along each axis.
    pub const POINTS: usize = 400;

    /// Request for the first two coordinates over the window of a map, at the grazing parameters,
    /// by guarded iteration; orbits settle in 1000 iterates, periods up to 32.
    pub fn over_the_window(map: &LocalMap) -> Self {
        let empty = Self {
            parameters: vec![0.0; map.parameters.len()],
            axes: [0, 1],
            ranges: [[0.0; 2]; 2],
            points: [Self::POINTS; 2],
            every_cell: false,
            origin: vec![0.0; map.window.state.len()],
            transient: 1000,
            longest_period: 32,
            method: Method::Guarded,
            manifolds: None,
        };
        empty.over([0, 1], map)
    }

    /// Requests of a basin entry of a scene, one for each method.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::NotAPlane`] for axes that are not two coordinates of the section,
    /// [`AnalysisError::NotACoordinate`] for a start that is none of them.
    pub fn of_scene(
        scene: &Scene,
        map: &LocalMap,
        plan: &BasinPlan,
    ) -> Result<Vec<Self>, AnalysisError> {
        let coordinates = &map.section.coordinates;
        let place = |name: &String| coordinates.iter().position(|known| known == name);
        let mut request = Self::over_the_window(map);
        if let Some([first, second]) = &plan.axes {
            let axes = place(first).zip(place(second));
            let known = || coordinates.join(", ");
            let (first, second) =
                axes.ok_or_else(|| AnalysisError::NotAPlane { known: known() })?;
            request = request.over([first, second], map);
        }
        for (name, offset) in &plan.start {
            request.origin[coordinate_place(map, name)?] = *offset;
        }
        for (parameter, offset) in &plan.at {
            let place = active_place(map, &scene.model.parameters[*parameter].name)?;
            request.parameters[place] = *offset;
        }
        request.ranges = plan.ranges.unwrap_or(request.ranges);
        request.points = plan.points.unwrap_or(request.points);
        request.every_cell = plan.every_cell;
        request.manifolds = plan.manifolds;
        let by = |&method: &Method| Self { method, ..request.clone() };
        Ok(plan.with.iter().map(by).collect())
    }

    /// Replaces the axes; the ranges become the window of the map.
    #[must_use]
    pub fn over(mut self, axes: [usize; 2], map: &LocalMap) -> Self {
        let widths = &map.window.state;
        self.axes = axes;
        self.ranges = axes.map(|axis| {
            let width = widths.get(axis).copied().unwrap_or(f64::NAN);
            [-width, width]
        });
        self
    }

    /// Iterates before an orbit counts as settled, and escape bounds.
    fn settling(&self, subject: &SweepSubject<'_>) -> OrbitRequest {
        subject.orbits(self.transient, 2 * self.longest_period)
    }

    /// Use of an atlas: orbits from all over the plane.
    fn tabulated(&self) -> TabulatedUse {
        let spread = |index: usize| {
            let mut state = self.origin.clone();
            let shares = low_discrepancy(index, 2);
            for ((&axis, [low, high]), share) in self.axes.iter().zip(&self.ranges).zip(shares) {
                state[axis] = low + share * (high - low);
            }
            state
        };
        TabulatedUse {
            parameters: self.parameters.clone(),
            varied: Vec::new(),
            starts: (0..STARTS).map(spread).collect(),
            carried: false,
            returns: self.points.map(|count| count as f64).iter().product::<f64>()
                * if self.every_cell { 1.0 } else { COMPUTED }
                * SETTLED_IN.min(self.transient) as f64,
        }
    }

    /// Checks the request against a map.
    fn check(&self, map: &LocalMap) -> Result<(), AnalysisError> {
        let coordinates = &map.section.coordinates;
        check_length("offsets of the parameters", map.parameters.len(), self.parameters.len())?;
        check_length("offsets of the state", coordinates.len(), self.origin.len())?;
        let [first, second] = self.axes;
        if first == second || first.max(second) >= coordinates.len() {
            return Err(AnalysisError::NotAPlane { known: coordinates.join(", ") });
        }
        if self.manifolds.is_some() && coordinates.len() != 2 {
            return Err(AnalysisError::NotPlanar { dimension: coordinates.len() });
        }
        for (&axis, range) in self.axes.iter().zip(&self.ranges) {
            if !range.iter().all(|end| end.is_finite()) {
                return Err(AnalysisError::NoRange { name: coordinates[axis].clone() });
            }
        }
        Ok(())
    }
}

/// Basins of attraction in a plane of states of the section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Basin {
    /// Identifier of the scene.
    pub scene: String,
    /// Digest of the scene's text.
    pub digest: Digest,
    /// Method that iterated the states.
    pub method: Method,
    /// The active parameters, in order.
    pub parameters: Vec<BasinParameter>,
    /// Names of the section's coordinates.
    pub coordinates: Vec<String>,
    /// The two axes, the horizontal one first.
    pub axes: [BasinAxis; 2],
    /// Offsets of all coordinates in the plane; those of the axes vary.
    pub origin: Vec<f64>,
    /// Names of the surfaces that graze, in the model's order, which is the order of the hits in
    /// names of orbits.
    pub surfaces: Vec<String>,
    /// Iterates after which an orbit that reached no known attractor counts as settled.
    pub transient: usize,
    /// Longest period looked for.
    pub longest_period: usize,
    /// Escape bounds of the section's coordinates.
    pub escape: Vec<EscapeBound>,
    /// Attractors, the one with the largest share first.
    pub attractors: Vec<BasinAttractor>,
    /// States from which the orbit escapes.
    pub escaped: BasinShare,
    /// States whose orbit ends without an image, such as those beyond a rigid stop.
    #[serde(default)]
    pub no_image: BasinShare,
    /// States whose orbit leaves the window of a map used alone.
    pub outside: BasinShare,
    /// States whose orbit stays near a repelling orbit.
    pub undecided: BasinShare,
    /// Fraction of the cells that touch a cell of another class.
    pub border: f64,
    /// Uncertainty exponent of the border; `None` if there is no border, or too little.
    pub uncertainty: Option<Uncertainty>,
    /// Number of cells whose state was followed; the others were filled from their neighbours.
    pub computed: usize,
    /// Probes of the blocks of cells that were filled.
    #[serde(default)]
    pub probes: BlockProbes,
    /// Fraction of all iterates made by the map; the others are direct returns.
    pub by_map: f64,
    /// Class of every cell: rows by increasing offset of the second axis, in a row by increasing
    /// offset of the first. Files hold them in a separate table.
    #[serde(skip)]
    pub cells: Vec<BasinClass>,
    /// Stable and unstable manifolds of saddles; `None` if not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub manifolds: Option<Manifolds>,
    /// Computing time.
    pub timing: Timing,
}

/// A parameter of a basin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BasinParameter {
    /// Name of the parameter.
    pub name: String,
    /// Offset from its grazing value.
    pub offset: f64,
    /// Value of the parameter.
    pub value: f64,
}

/// One axis of a basin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BasinAxis {
    /// Name of the coordinate.
    pub coordinate: String,
    /// Offsets of the columns or rows, increasing.
    pub offsets: Vec<f64>,
}

/// Destination of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BasinClass {
    /// The attractor of this index, from 0.
    Attractor(usize),
    /// Escapes beyond the bounds.
    Escaped,
    /// Ends without an image: no section point follows, or the state is beyond a rigid stop.
    NoImage,
    /// Leaves the window of a map used alone.
    Outside,
    /// Stays near a repelling orbit.
    Undecided,
}

/// An attractor of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attractor {
    /// Period in nominal returns (those of the grazing orbit); [`Period::NotFound`] for a chaotic
    /// or quasi-periodic attractor, or a period longer than the longest looked for.
    pub period: Period,
    /// Contacts of the passages, return by return; `None` without a period.
    pub itinerary: Option<ContactItinerary>,
    /// Name of the orbit; `None` without a period.
    pub orbit: Option<OrbitName>,
    /// Points of the orbit, starting where the itinerary starts; without a period a sample of its
    /// states.
    pub states: Vec<Vec<f64>>,
    /// Multipliers as real and imaginary parts, largest magnitude first; empty without a period or
    /// where the map has no derivative.
    pub multipliers: Vec<[f64; 2]>,
    /// Largest Lyapunov exponent per iterate; `None` if unknown.
    pub lyapunov: Option<f64>,
    /// Standard error of the exponent of an attractor without a period.
    #[serde(default)]
    pub lyapunov_error: Option<f64>,
}

/// An attractor and the share of its basin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BasinAttractor {
    /// The attractor.
    #[serde(flatten)]
    pub attractor: Attractor,
    /// Share of its basin.
    #[serde(flatten)]
    pub share: BasinShare,
}

/// Share of the cells of a class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BasinShare {
    /// Number of cells of the class.
    pub count: usize,
    /// Fraction of the area.
    pub fraction: f64,
    /// Half the fraction of cells that lie at a border of the class, on either side: the
    /// uncertainty of the area, as the border passes through these cells.
    pub boundary: f64,
    /// Standard deviation of the fraction if the cells were a random sample of states.
    pub statistical: f64,
}

/// Uncertainty exponent: power law for the fraction of pairs of states that go to different
/// attractors as a function of their distance.
///
/// Reference: `Grebogi1983`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Exponent, 1 for a smooth border; the dimension of the border is 2 minus the exponent.
    pub exponent: f64,
    /// Distances, in cells along an axis.
    pub distances: Vec<usize>,
    /// Fraction of the pairs of cells at each distance that differ in class.
    pub fractions: Vec<f64>,
}

/// Computes the basins of attraction of a map in a plane of states.
///
/// Every cell represents the state at its centre. Attractors are found on the way: a state that
/// reaches no known attractor is followed until it settles. A periodic orbit is refined by Newton's
/// method; a state counts as attracted once it is in an ellipsoid about one of the orbit's points
/// that the map was seen to send into itself. An attractor without a period is known by the cells
/// that it visits.
///
/// Cells are computed where their neighbours differ, and at probes of the blocks between
/// ([`BLOCK`]); the others are filled, and a region that holds no computed cell is missed.
/// [`BlockProbes::missed_at_most`] bounds their share. A request of every cell fills none.
///
/// ```
/// use grazemap_map::analysis::NoProgress;
/// use grazemap_map::analysis::basin::{BasinRequest, basin};
/// use grazemap_map::expansion::{Expander, MapOrders};
/// use grazemap_map::model::Scene;
/// use grazemap_map::orbit::locate;
///
/// let scene = Scene::of_catalogue("linear")?;
/// let orbit = locate(&scene)?.into_result()?;
/// let orders = MapOrders { smooth_order: 5, contact_weight: 6 };
/// let map = Expander::new(&scene, &orbit)?.expand(orders)?;
/// let request = BasinRequest {
///     parameters: vec![-5e-4, 0.0],
///     ranges: [[-1e-3, 1e-3], [-2e-3, 2e-3]],
///     points: [48, 48],
///     ..BasinRequest::over_the_window(&map)
/// };
/// let basin = basin(&scene, &orbit, &map, &request, &NoProgress)?;
/// let itineraries = basin.attractors.iter().map(|found| &found.attractor.itinerary);
/// let itineraries: Vec<_> = itineraries.flatten().map(ToString::to_string).collect();
/// assert_eq!(itineraries, ["1", "0"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// [`AnalysisError::NotAPlane`] for axes that are not two coordinates of the section,
/// [`AnalysisError::NoRange`] for a range that is not finite, [`AnalysisError::NotPlanar`] for
/// manifolds on a section of other than two coordinates, [`AnalysisError::Length`], and
/// [`AnalysisError::Hybrid`] if the simulator refuses the model.
pub fn basin(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BasinRequest,
    progress: &dyn Progress,
) -> Result<Basin, AnalysisError> {
    request.check(map)?;
    let tabulated = request.tabulated();
    let subject = SweepSubject { tabulated, ..SweepSubject::new(scene, orbit, map) };
    let swept = subject.swept(request.method)?;
    let clock = Instant::now();
    let (parameters, window) = (&request.parameters, &map.window);
    let settling = request.settling(&subject);
    let search = BasinSearch::new(&*swept, parameters, window, settling, progress);
    let mut search = search.with_found(given(progress));
    let grid = BasinGrid::new(request);
    let mut classes = |cells: &[usize]| {
        PartProgress::announce(progress, cells.len());
        search.classes(cells, |cell| grid.state(cell))
    };
    let (classes, computed, probes) = if request.every_cell {
        let classes = classes(&grid.all());
        let computed = classes.len();
        (classes, computed, BlockProbes::default())
    } else {
        let cells = refine(grid.size(), BasinClass::eq, classes);
        let (computed, probes) = (cells.computed(), cells.probes());
        (cells.into_cells(|class| class), computed, probes)
    };
    let attractors = search.attractors();
    let motions = first_of_each_motion((scene, orbit), request, &attractors)?;
    let (attractors, classes) = ranked(&attractors, &motions, classes);
    let borders = grid.borders(&classes);
    let subjects = (scene, orbit, map);
    let plane = ManifoldPlane {
        parameters,
        axes: request.axes,
        ranges: request.ranges,
        method: request.method,
    };
    let curves =
        request.manifolds.map(|longest| manifolds(subjects, &plane, longest, &*swept, progress));
    let share = |class: BasinClass| grid.share(class, &classes, &borders);
    let attractors = attractors.into_iter().enumerate().map(|(number, attractor)| BasinAttractor {
        attractor,
        share: share(BasinClass::Attractor(number)),
    });
    let parameter = |(active, &offset): (&crate::expansion::ActiveParameter, &f64)| {
        let place = scene.model.parameters.iter().position(|known| known.name == active.name);
        let value = place.map_or(f64::NAN, |place| orbit.parameters()[place].to_f64() + offset);
        BasinParameter { name: active.name.clone(), offset, value }
    };
    let axis = |number: usize| BasinAxis {
        coordinate: map.section.coordinates[request.axes[number]].clone(),
        offsets: grid.offsets[number].clone(),
    };
    Ok(Basin {
        scene: scene.identifier.clone(),
        digest: scene.digest,
        method: request.method,
        parameters: map.parameters.iter().zip(parameters).map(parameter).collect(),
        coordinates: map.section.coordinates.clone(),
        axes: [axis(0), axis(1)],
        origin: request.origin.clone(),
        surfaces: itinerary(scene, orbit).surfaces,
        transient: request.transient,
        longest_period: request.longest_period,
        escape: escape_bounds(scene, orbit),
        attractors: attractors.collect(),
        escaped: share(BasinClass::Escaped),
        no_image: share(BasinClass::NoImage),
        outside: share(BasinClass::Outside),
        undecided: share(BasinClass::Undecided),
        border: borders.iter().filter(|&&touches| touches).count() as f64 / classes.len() as f64,
        uncertainty: grid.uncertainty(&classes),
        computed,
        probes,
        by_map: search.mapped as f64 / search.iterates.max(1) as f64,
        timing: Timing::since(clock, search.iterates),
        manifolds: curves.transpose()?,
        cells: classes,
    })
}

/// Computes a share of the cells of [`basin`]: those of some tiles, followed until they reach an
/// attractor that the first states of the whole grid lead to. Three things are left to the joining
/// run: cells that borders between tiles need, cells that reach attractors of other shares only,
/// and manifolds.
///
/// # Errors
///
/// As [`basin`].
pub fn basin_share(
    scene: &Scene,
    orbit: &GrazingOrbit,
    map: &LocalMap,
    request: &BasinRequest,
    shard: &Shard<'_>,
) -> Result<(), AnalysisError> {
    request.check(map)?;
    let tabulated = request.tabulated();
    let subject = SweepSubject { tabulated, ..SweepSubject::new(scene, orbit, map) };
    let swept = subject.swept(request.method)?;
    let settling = request.settling(&subject);
    let (parameters, window) = (&request.parameters, &map.window);
    let mut search = BasinSearch::new(&*swept, parameters, window, settling, shard.own);
    let grid = BasinGrid::new(request);
    let refined = |compute: &mut dyn FnMut(&[usize]) -> Vec<BasinClass>| {
        if request.every_cell {
            compute(&Tiles::of(grid.size()).cells(shard.share));
        } else {
            refine_share(grid.size(), Some(shard.share), BasinClass::eq, compute);
        }
    };
    search.share(&first_asked(grid.size()), |cell| grid.state(cell), refined, shard);
    Ok(())
}

/// First attractor of the motion of each attractor: on a tangency section the flight of one may
/// pass through the section points of others.
fn first_of_each_motion(
    (scene, orbit): (&Scene, &GrazingOrbit),
    request: &BasinRequest,
    attractors: &[Attractor],
) -> Result<Vec<usize>, AnalysisError> {
    if orbit.section.kind != PoincareSectionKind::Tangency || request.method == Method::Map {
        return Ok((0..attractors.len()).collect());
    }
    let motions = parallel::try_map(attractors, |attractor| {
        if attractor.period == Period::NotFound {
            return Ok(None);
        }
        // Without forcing a return may take longer than the nominal one.
        let returns = 2 * attractor.states.len();
        let (start, parameters) = (attractor.states[0].clone(), request.parameters.clone());
        let flight = TimeSeriesRequest { start, parameters, settle: 0, returns, samples: 1 };
        MotionEvents::of(scene, orbit, &flight)
    })?;
    Ok(MotionEvents::first_of_each(&motions))
}

/// Sorts attractors by their number of cells and renumbers the cells; `motions` has the attractor
/// that stands for each.
fn ranked(
    attractors: &[Attractor],
    motions: &[usize],
    mut classes: Vec<BasinClass>,
) -> (Vec<Attractor>, Vec<BasinClass>) {
    let mut counts = vec![0; attractors.len()];
    for class in &mut classes {
        if let BasinClass::Attractor(number) = class {
            *number = motions[*number];
            counts[*number] += 1;
        }
    }
    let mut order: Vec<usize> =
        (0..attractors.len()).filter(|&number| motions[number] == number).collect();
    order.sort_by_key(|&number| std::cmp::Reverse(counts[number]));
    let mut rank = vec![0; attractors.len()];
    order.iter().enumerate().for_each(|(place, &number)| rank[number] = place);
    for class in &mut classes {
        if let BasinClass::Attractor(number) = class {
            *number = rank[*number];
        }
    }
    (order.into_iter().map(|number| attractors[number].clone()).collect(), classes)
}

/// The cells of the plane.
struct BasinGrid<'a> {
    request: &'a BasinRequest,
    offsets: [Vec<f64>; 2],
}

impl<'a> BasinGrid<'a> {
    fn new(request: &'a BasinRequest) -> Self {
        let offsets = |axis: usize| even_offsets(request.ranges[axis], request.points[axis]);
        Self { request, offsets: [offsets(0), offsets(1)] }
    }

    /// Numbers of columns and rows.
    fn size(&self) -> [usize; 2] {
        [self.offsets[0].len(), self.offsets[1].len()]
    }

    /// Indices of all cells.
    fn all(&self) -> Vec<usize> {
        let [columns, rows] = self.size();
        (0..columns * rows).collect()
    }

    /// State at the centre of a cell.
    fn state(&self, cell: usize) -> Vec<f64> {
        let [columns, _] = self.size();
        let mut state = self.request.origin.clone();
        state[self.request.axes[0]] = self.offsets[0][cell % columns];
        state[self.request.axes[1]] = self.offsets[1][cell / columns];
        state
    }

    /// Whether each cell touches a cell of another class.
    fn borders(&self, classes: &[BasinClass]) -> Vec<bool> {
        let touches = |cell: usize| {
            let mut others = neighbours(self.size(), cell).into_iter();
            others.any(|other| classes[other] != classes[cell])
        };
        (0..classes.len()).map(touches).collect()
    }

    fn share(&self, wanted: BasinClass, classes: &[BasinClass], borders: &[bool]) -> BasinShare {
        let all = classes.len() as f64;
        let count = classes.iter().filter(|&&class| class == wanted).count();
        let fraction = count as f64 / all;
        let is_uncertain = |cell: &usize| {
            borders[*cell]
                && (classes[*cell] == wanted
                    || neighbours(self.size(), *cell).iter().any(|&other| classes[other] == wanted))
        };
        let uncertain = (0..classes.len()).filter(is_uncertain).count();
        BasinShare {
            count,
            fraction,
            boundary: 0.5 * uncertain as f64 / all,
            statistical: (fraction * (1.0 - fraction) / all).sqrt(),
        }
    }

    /// Fits the fraction of pairs of cells that differ in class by a power of their distance.
    fn uncertainty(&self, classes: &[BasinClass]) -> Option<Uncertainty> {
        /// Largest distance is the shorter side divided by this; fewest distances for a fit.
        const SIDE: usize = 16;
        const FEWEST: usize = 3;
        let [columns, rows] = self.size();
        let distances = (0..).map(|power| 1 << power);
        let distances = distances.take_while(|distance| distance * SIDE <= columns.min(rows));
        let fraction = |distance: usize| {
            let pairs = |(cell, class): (usize, &BasinClass)| {
                let right = (cell % columns + distance < columns).then_some(cell + distance);
                let up = classes.get(cell + distance * columns).map(|_| cell + distance * columns);
                let differs = |other: usize| usize::from(classes[other] != *class);
                let found = [right, up].into_iter().flatten();
                found.fold([0, 0], |[differ, all], other| [differ + differs(other), all + 1])
            };
            let sum = classes.iter().enumerate().map(pairs);
            let [differ, all] = sum.fold([0, 0], |[a, b], [c, d]| [a + c, b + d]);
            differ as f64 / all as f64
        };
        let (distances, fractions): (Vec<usize>, Vec<f64>) =
            distances.map(|distance| (distance, fraction(distance))).unzip();
        if fractions.len() < FEWEST || fractions.contains(&0.0) {
            return None;
        }
        let points = distances.iter().zip(&fractions);
        let points: Vec<[f64; 2]> =
            points.map(|(&distance, share)| [(distance as f64).ln(), share.ln()]).collect();
        let count = points.len() as f64;
        let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
        let (x, y) = (mean(0), mean(1));
        let sum = |product: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(product).sum::<f64>();
        let exponent =
            sum(&|point| (point[0] - x) * (point[1] - y)) / sum(&|point| (point[0] - x).powi(2));
        Some(Uncertainty { exponent, distances, fractions })
    }
}

impl Basin {
    /// Cells with their offsets, the horizontal one first.
    pub fn located(&self) -> impl Iterator<Item = ([f64; 2], BasinClass)> {
        let [horizontal, vertical] = &self.axes;
        let grid = vertical
            .offsets
            .iter()
            .flat_map(|&row| horizontal.offsets.iter().map(move |&column| [column, row]));
        grid.zip(self.cells.iter().copied())
    }

    /// Full start state at a place in the plane.
    pub fn state(&self, place: [f64; 2]) -> Vec<f64> {
        let mut state = self.origin.clone();
        for (axis, offset) in self.axes.iter().zip(place) {
            let number = self.coordinates.iter().position(|name| *name == axis.coordinate);
            if let Some(value) = number.and_then(|number| state.get_mut(number)) {
                *value = offset;
            }
        }
        state
    }

    /// Resets the timing, so that results are equal from run to run.
    pub fn take_timing(&mut self) {
        self.timing = Timing::default();
    }
}
