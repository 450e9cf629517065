//! Equations of an itinerary's orbits of direct simulation, for continuation.
//!
//! One idea: the contact of a return corresponds to a coordinate of its first point, whose gap at
//! the passage follows from the free flow (on a tangency section it is the gap of the point
//! itself). A return that begins with contact has `y = √(−h)` in place of one coordinate, any other
//! the gap `h`. The images of all section points are then smooth up to the graze, which is the
//! border of the range and is reached exactly.
//!
//! If a contact begins without a jump of the field, the image is differentiable by the depth `y²`.
//! Its derivative by `y` vanishes at the graze, and with it every determinant; test functions and
//! multipliers therefore use derivatives by `y²`, which have no spurious zero at the graze.

use nalgebra::{DMatrix, DVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::contact_itinerary::ContactItinerary;
use super::kept_orbit::{KeptOrbit, lengths};
use super::map_equations::{halves, is_same, reciprocal_pairs, repeats_after_half};
use super::returns::PrescribedReturn;
use crate::analysis::direct_image::{DirectEnd, DirectImage, SectionImage};
use crate::analysis::error::AnalysisError;
use crate::analysis::progress::{NoProgress, Progress};
use crate::analysis::section_frame::extents;
use crate::continuation::{
    ContinuationPoint, CurveEquations, Linearised, TestValue, crossing, saved, tangent_at,
};
use crate::iteration::{PassageSet, PhaseCircle};
use crate::model::Scene;
use crate::numeric::Real;
use crate::numeric::linear::{determinant, inverse};
use crate::orbit::GrazingOrbit;

/// Equations of the orbits of an itinerary by direct simulation, in one parameter or more:
///
/// ```text
/// u = (w_0, …, w_{n−1}, p):   P(x(w_k, p), p) − x(w_{k+1}, p) = 0,   w_n = w_0
/// ```
///
/// where `w` is a section point in which the variable of its own passage replaces the coordinate
/// that the gap depends on most.
#[derive(Clone, Debug)]
pub struct DirectOrbitEquations<'a, S: Real> {
    image: DirectImage<'a, S>,
    itinerary: ContactItinerary,
    flights: Vec<SectionFlight<'a, S>>,
    points: SectionPoints,
    units: DirectUnits,
    /// Indices of the free parameters, with their ranges in units.
    free: Vec<(usize, [f64; 2])>,
    at: Vec<S>,
    /// Bound of the variables, in units.
    reach: f64,
    /// Work done and its bound, in products of series.
    work: u64,
    most_work: u64,
    /// Receiver of the work as it is done.
    progress: &'a dyn Progress,
}

/// Section points whose variables are unknowns, and their variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SectionPoints {
    /// Points of all returns, with the variable of the own passage in place of one coordinate.
    Every,
    /// Points of returns that begin with contact, with such a variable: on a tangency section a
    /// return without contact begins at a local minimum of the gap, which an orbit may lose.
    AtContacts,
    /// Points of all returns in their coordinates: an orbit may hit so hard that the free flight
    /// behind the stop does not turn and has no gap. Grazes are no border of the range.
    Plain,
}

/// Flight from one section point to the next.
#[derive(Clone, Debug)]
struct SectionFlight<'a, S: Real> {
    /// Index of its first return.
    first: usize,
    /// Passages that make contact, over all its returns in order.
    made: PassageSet,
    image: DirectImage<'a, S>,
    /// Coordinate that a passage variable replaces, at the last section point.
    nearby: S,
}

/// Units of length of the unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectUnits {
    /// Unit of each coordinate.
    pub state: Vec<f64>,
    /// Unit of each free parameter.
    pub parameters: Vec<f64>,
    /// Index of the coordinate that a passage variable replaces, and the unit of the gap; `None` if
    /// the free flow passes no surface.
    pub gap: Option<(usize, f64)>,
    /// Whether the contact of the own passage begins without a jump of the field.
    pub smooth: bool,
    /// Acceleration `h''` at the graze of an autonomous system, whose orbits may shrink to an
    /// equilibrium; `None` with forcing.
    pub acceleration: Option<f64>,
}

/// An orbit of direct simulation.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "S: Real + Serialize + DeserializeOwned")]
pub struct DirectOrbit<S> {
    /// Section points, in offsets.
    pub states: Vec<Vec<S>>,
    /// Index of the return that starts at each section point.
    pub returns: Vec<usize>,
    /// Section points of the equations.
    pub points: SectionPoints,
    /// Contacts: return, passage and speed.
    pub speeds: Vec<(usize, usize, S)>,
    /// Contacts beyond one per passage, or at other surfaces.
    pub extra_contacts: usize,
    /// Number of contacts at each surface of the model.
    pub hits: Vec<usize>,
    /// Whole periods of the phase beyond the nominal ones of the returns.
    pub turns: i32,
    /// Derivatives of each section point and of its image by the point's variables; by `y²` if the
    /// contact begins without a jump.
    #[serde(with = "saved")]
    blocks: Vec<[DMatrix<S>; 2]>,
    /// Derivative of the variable used in `blocks` by each unknown: `2y`, or 1.
    stretches: Vec<S>,
    /// Jacobian of the equations by the variables used in `blocks`.
    #[serde(with = "saved")]
    regular: DMatrix<S>,
    /// Derivatives of the first section point by the free parameters.
    #[serde(with = "saved")]
    by_parameters: Vec<DVector<S>>,
}

impl KeptOrbit for DirectOrbit<f64> {
    fn states(&self) -> &[Vec<f64>] {
        &self.states
    }

    fn is_like(&self, computed: &Self, itinerary: &ContactItinerary) -> bool {
        let is_known = |&(number, passage, _): &(usize, usize, f64)| {
            number < itinerary.period() && passage < itinerary.passages()
        };
        let blocks = |orbit: &Self| -> Vec<[(usize, usize); 2]> {
            orbit.blocks.iter().map(|block| block.each_ref().map(DMatrix::shape)).collect()
        };
        let by_parameters =
            |orbit: &Self| -> Vec<usize> { orbit.by_parameters.iter().map(DVector::len).collect() };
        lengths(&self.states) == lengths(&computed.states)
            && self.returns == computed.returns
            && self.points == computed.points
            && self.speeds.iter().all(is_known)
            && self.hits.len() == computed.hits.len()
            && blocks(self) == blocks(computed)
            && self.stretches.len() == computed.stretches.len()
            && self.regular.shape() == computed.regular.shape()
            && by_parameters(self) == by_parameters(computed)
    }
}

impl<S: Copy> DirectOrbit<S> {
    /// Speed of the contact of a return and a passage; `None` if the orbit does not make it.
    pub(in crate::analysis) fn speed_of(&self, contact: [usize; 2]) -> Option<S> {
        let mut speeds = self.speeds.iter();
        let own = speeds.find(|(number, passage, _)| [*number, *passage] == contact);
        own.map(|(.., speed)| *speed)
    }
}

/// A section point and its image.
struct FlownPoint<S> {
    point: Vec<S>,
    image: Vec<S>,
    speeds: Vec<Option<S>>,
    extra_contacts: usize,
    hits: Vec<usize>,
    /// Derivatives of both by the variables and the free parameters, as in [`DirectOrbit::blocks`],
    /// if asked for and known.
    slopes: Option<[DMatrix<S>; 2]>,
}

/// Default bound of the variables, in units.
const REACH: f64 = 30.0;
/// Most reductions of a difference that meets other contacts, and the factor of each.
const SHORTENINGS: usize = 3;
const SHORTENED: f64 = 1e-2;
/// One-sided derivative of fourth order: twelve times the weights of four evenly spaced values,
/// over their spacing; the weight of the value itself is −25.
const AHEAD: [f64; 4] = [48.0, -36.0, 16.0, -3.0];
/// Number of interpolation nodes used to extrapolate through the graze.
const NODES: usize = 5;
/// Cost of a variation, in flights.
const VARIED: u64 = 2;
/// Least stretch of a variable for which a tangent is transformed.
const LEAST_STRETCH: f64 = 1e-6;
/// Acceleration, relative to that at the graze, below which an orbit has shrunk to an equilibrium.
const AT_REST: f64 = 1e-3;
/// Most secant steps for a gap, and its largest distance from the gap wanted.
const STEPS: usize = 30;
const REACHED: f64 = 1e-6;
/// Relative difference up to which section points count as equal.
const REPEATED: f64 = 1e-4;

/// Weighted sum of images with the same contacts; `None` if their extra contacts differ.
fn weighted<S: Real>(nodes: &[(S, FlownPoint<S>)]) -> Option<FlownPoint<S>> {
    let (_, first) = nodes.first()?;
    let sum =
        |of: &dyn Fn(&FlownPoint<S>) -> S| nodes.iter().map(|(w, node)| *w * of(node)).sum::<S>();
    let all = |of: fn(&FlownPoint<S>) -> &Vec<S>| -> Vec<S> {
        (0..of(first).len()).map(|place| sum(&|node| of(node)[place])).collect()
    };
    let speeds = first.speeds.iter().enumerate().map(|(passage, speed)| {
        speed.map(|_| sum(&|node| node.speeds[passage].unwrap_or(S::zero())))
    });
    let alike = nodes.iter().all(|(_, node)| node.extra_contacts == first.extra_contacts);
    let slopes = [0, 1].map(|part| {
        let parts = nodes.iter().map(|(w, node)| Some(&node.slopes.as_ref()?[part] * *w));
        parts.reduce(|sum, part| Some(sum? + part?)).flatten()
    });
    let [point, image] = slopes;
    alike.then(|| FlownPoint {
        slopes: point.zip(image).map(|(point, image)| [point, image]),
        point: all(|node| &node.point),
        image: all(|node| &node.image),
        speeds: speeds.collect(),
        extra_contacts: first.extra_contacts,
        hits: first.hits.clone(),
    })
}

/// Matrix with its columns multiplied by factors.
fn stretched<S: Real>(mut matrix: DMatrix<S>, stretches: &[S]) -> DMatrix<S> {
    for (mut column, &stretch) in matrix.column_iter_mut().zip(stretches) {
        column *= stretch;
    }
    matrix
}

/// Flights of one return each.
fn flights_of<'a, S: Real>(
    image: &DirectImage<'a, S>,
    itinerary: &ContactItinerary,
) -> Vec<SectionFlight<'a, S>> {
    let flight = |(first, &made)| {
        let nearby = S::zero();
        SectionFlight { first, made, image: image.clone(), nearby }
    };
    itinerary.returns().iter().enumerate().map(flight).collect()
}

impl DirectUnits {
    /// Units from the extents of the grazing orbit, smaller if the parameters vary little; the gap
    /// replaces the coordinate that it depends on most. Parameters in `free` vary within their
    /// ranges, the others are fixed at the offsets `at`.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::Length`] for a wrong number of offsets.
    pub fn measured(
        scene: &Scene,
        orbit: &GrazingOrbit,
        mut image: DirectImage<'_, f64>,
        free: &[(usize, [f64; 2])],
        at: &[f64],
    ) -> Result<Self, AnalysisError> {
        let lengths = free.iter().map(|(place, range)| {
            let value = orbit.parameters()[scene.expansion.active[*place]].to_f64().abs();
            let largest = (0.5 * (range[1] - range[0]).abs()).max(f64::MIN_POSITIVE);
            if value > 0.0 {
                (largest.min(value), (largest / value).min(1.0))
            } else {
                (largest, 1.0)
            }
        });
        let (parameters, shares): (Vec<f64>, Vec<f64>) = lengths.unzip();
        let share = shares.into_iter().fold(0.0, f64::max).sqrt();
        let extents = extents(scene, orbit);
        let longest = extents.iter().copied().fold(0.0, f64::max);
        let state = extents.iter().map(|&extent| match extent > 1e-9 * longest {
            true => extent * share,
            false => share,
        });
        let state: Vec<f64> = state.collect();
        let mut slopes = Vec::new();
        for place in 0..state.len() {
            let mut moved = vec![0.0; state.len()];
            moved[place] = 1e-4 * state[place];
            let up = image.gap(&moved, at)?;
            moved[place] = -moved[place];
            slopes.push((up - image.gap(&moved, at)?).abs() / 2e-4);
        }
        let steepest = slopes.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let gap = steepest.map(|(place, &slope)| (place, slope));
        let gap = gap.filter(|(_, slope)| slope.is_finite());
        let smooth = image.begins_smoothly(orbit);
        let acceleration = orbit.grazing_point().normal_acceleration.to_f64();
        let acceleration = image.is_autonomous().then_some(acceleration);
        Ok(Self { state, parameters, gap, smooth, acceleration })
    }
}

impl<'a, S: Real> DirectOrbitEquations<'a, S> {
    /// Equations of an itinerary. The parameters in `free` vary within ranges of offsets, the
    /// others are fixed at the offsets `at`.
    pub fn new(
        image: DirectImage<'a, S>,
        itinerary: &ContactItinerary,
        units: &DirectUnits,
        free: &[(usize, [f64; 2])],
        at: &[f64],
    ) -> Self {
        let free = free.iter().zip(&units.parameters);
        let free = free.map(|(&(place, range), unit)| (place, range.map(|value| value / unit)));
        Self {
            flights: flights_of(&image, itinerary),
            image,
            itinerary: itinerary.clone(),
            points: SectionPoints::Every,
            free: free.collect(),
            at: at.iter().map(|&value| S::from_f64(value)).collect(),
            units: units.clone(),
            reach: REACH,
            work: 0,
            most_work: u64::MAX,
            progress: &NoProgress,
        }
    }

    /// Extends the bound of the variables to twice the distance of an orbit.
    pub fn reach_beyond(&mut self, unknowns: &[S]) {
        let variables = unknowns[..self.variables()].iter();
        let farthest = variables.fold(0.0_f64, |most, value| most.max(value.to_f64().abs()));
        self.reach = self.reach.max(2.0 * farthest);
    }

    /// Bounds the work; nothing more is simulated once it is used up.
    pub fn limit_work(&mut self, most: u64) {
        self.most_work = most;
    }

    /// Reports work as it is done; the receiver knows its bound.
    pub fn report_work(&mut self, progress: &'a dyn Progress) {
        self.progress = progress;
    }

    /// Work so far, in products of series.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Takes over the work of equations that were cloned from these.
    pub(in crate::analysis) fn take_work(&mut self, of: &Self) {
        self.work = of.work;
    }

    /// Equations of the same orbits with another itinerary.
    pub fn with_itinerary(&self, itinerary: &ContactItinerary) -> Self {
        let (flights, points) = (flights_of(&self.image, itinerary), SectionPoints::Every);
        Self { itinerary: itinerary.clone(), flights, points, ..self.clone() }
    }

    /// Equations in these section points; `None` if the itinerary has none of the kind or has all:
    /// points at contacts need a first return with contact and another one without, plain ones a
    /// section that is stroboscopic and a first passage whose variable they leave out.
    pub fn in_points(mut self, points: SectionPoints) -> Option<Self> {
        self.flights = match points {
            SectionPoints::Every => flights_of(&self.image, &self.itinerary),
            SectionPoints::AtContacts => self.flights_between_contacts()?,
            SectionPoints::Plain if self.image.is_on_tangency() || self.units.gap.is_none() => {
                return None;
            }
            SectionPoints::Plain => flights_of(&self.image, &self.itinerary),
        };
        Some(Self { points, ..self })
    }

    /// Flights from each return that begins with contact to the next one.
    fn flights_between_contacts(&self) -> Option<Vec<SectionFlight<'a, S>>> {
        let (returns, passages) = (self.itinerary.returns(), self.itinerary.passages());
        let begins = |number: &usize| returns[*number].contains(0);
        let firsts: Vec<usize> = (0..returns.len()).filter(begins).collect();
        if firsts.first() != Some(&0) || firsts.len() == returns.len() {
            return None;
        }
        let ends = firsts[1..].iter().copied().chain([returns.len()]);
        let flights = firsts.iter().zip(ends).map(|(&first, end)| {
            let made = returns[first..end].iter().enumerate();
            let made = made.flat_map(|(later, made)| {
                made.iter().map(move |passage| later * passages + passage)
            });
            Some(SectionFlight {
                first,
                made: made.collect(),
                image: self.image.over(end - first).ok()?,
                nearby: S::zero(),
            })
        });
        flights.collect()
    }

    /// Seeks section points next to those of an orbit first.
    pub(in crate::analysis) fn seek_near(&mut self, orbit: &DirectOrbit<f64>) {
        let Some((replaced, _)) = self.replaced() else { return };
        for (flight, state) in self.flights.iter_mut().zip(&orbit.states) {
            flight.nearby = S::from_f64(state[replaced]);
        }
    }

    /// Coordinate that the variable of the own passage replaces, and the unit of the gap.
    pub(in crate::analysis) fn replaced(&self) -> Option<(usize, f64)> {
        self.units.gap.filter(|_| self.points != SectionPoints::Plain)
    }

    /// Section points of these equations.
    pub fn points(&self) -> SectionPoints {
        self.points
    }

    /// Number of variables of section points, which come first among the unknowns.
    pub fn variables(&self) -> usize {
        self.dimension() * self.flights.len()
    }

    /// Number of coordinates of a section point.
    pub fn dimension(&self) -> usize {
        self.units.state.len()
    }

    /// Itinerary of the orbits.
    pub fn itinerary(&self) -> &ContactItinerary {
        &self.itinerary
    }

    /// Offsets of all active parameters.
    pub fn parameters(&self, unknowns: &[S]) -> Vec<S> {
        let mut parameters = self.at.clone();
        let values = unknowns[self.variables()..].iter().zip(&self.units.parameters);
        for ((place, _), (&value, &unit)) in self.free.iter().zip(values) {
            parameters[*place] = value * S::from_f64(unit);
        }
        parameters
    }

    /// Whether a flight begins with contact.
    fn begins_with_contact(&self, number: usize) -> bool {
        self.flights[number].made.contains(0)
    }

    /// Return whose own passage has the given unknown as its variable; `None` for other unknowns.
    pub fn passage_of(&self, unknown: usize) -> Option<usize> {
        let (replaced, _) = self.replaced()?;
        let number = unknown / self.dimension();
        let is_own = unknown % self.dimension() == replaced;
        let flight = self.flights.get(number).filter(|_| is_own);
        flight.map(|flight| flight.first)
    }

    /// Whether an unknown is the variable of a contact at the start of a return.
    pub fn begins_with_contact_at(&self, unknown: usize) -> bool {
        self.passage_of(unknown).is_some() && self.begins_with_contact(unknown / self.dimension())
    }

    /// Unknowns for section points and parameters, in offsets. The points are those of all returns,
    /// or of these equations' returns only.
    pub fn unknowns(&mut self, states: &[Vec<S>], parameters: &[S]) -> Option<Vec<S>> {
        let mut unknowns = Vec::new();
        for number in 0..self.flights.len() {
            let own = states.len() == self.flights.len();
            let state = states.get(if own { number } else { self.flights[number].first })?;
            let units = self.units.state.iter();
            let mut values: Vec<S> =
                state.iter().zip(units).map(|(&x, &unit)| x / S::from_f64(unit)).collect();
            if let Some((replaced, unit)) = self.replaced() {
                let gap = self.image.gap(state, parameters).ok()? / S::from_f64(unit);
                if !gap.is_finite() {
                    return None;
                }
                self.flights[number].nearby = state[replaced];
                values[replaced] = match self.begins_with_contact(number) {
                    true => (-gap).max(S::zero()).sqrt(),
                    false => gap.max(S::zero()),
                };
            }
            unknowns.extend(values);
        }
        let free = self.free.iter().zip(&self.units.parameters);
        unknowns.extend(free.map(|((place, _), &unit)| parameters[*place] / S::from_f64(unit)));
        Some(unknowns)
    }

    /// Section point for the variables of a flight.
    fn point(&mut self, number: usize, variables: &[S], parameters: &[S]) -> Option<Vec<S>> {
        let units = self.units.state.iter();
        let mut point: Vec<S> =
            variables.iter().zip(units).map(|(&w, &unit)| w * S::from_f64(unit)).collect();
        let Some((replaced, unit)) = self.replaced() else {
            return Some(point);
        };
        let own = variables[replaced];
        let wanted = match self.begins_with_contact(number) {
            true => -(own * own),
            false => own,
        };
        let wanted = wanted * S::from_f64(unit);
        // A gap that needs a flight may be the same at other points, where the flight has another
        // minimum: the point next to the last one is meant.
        let nearby = self.flights[number].nearby;
        let starts = match self.image.is_on_tangency() {
            true => [S::zero(), nearby],
            false => [nearby, S::zero()],
        };
        let found = starts.into_iter().find_map(|start| {
            point[replaced] = start;
            self.with_gap(&point, (replaced, unit), (wanted, parameters))
        });
        let found = found.filter(|value| value.is_finite())?;
        self.flights[number].nearby = found;
        point[replaced] = found;
        Some(point)
    }

    /// Value of a coordinate at which the gap of a point, in its unit, is `wanted`, from its own
    /// value: by secant steps, the first slope by a difference, exact after one step if the gap is
    /// affine.
    fn with_gap(
        &mut self,
        point: &[S],
        (replaced, unit): (usize, f64),
        (wanted, parameters): (S, &[S]),
    ) -> Option<S> {
        let mut point = point.to_vec();
        let scale = S::from_f64(self.units.state[replaced]);
        let mut lacking = self.image.gap(&point, parameters).ok()? - wanted;
        let mut step = scale * S::from_f64(1e-3);
        for _ in 0..STEPS {
            let before = lacking;
            point[replaced] += step;
            lacking = self.image.gap(&point, parameters).ok()? - wanted;
            let slope = (lacking - before) / step;
            let next = -(lacking / slope);
            let small = S::from_f64(4.0 * S::ROUNDOFF) * scale;
            // Rounding of a gap that needs a flight keeps steps from shrinking further.
            let stalls = next.abs() >= step.abs() && step.abs() <= S::from_f64(1e-6) * scale;
            if lacking == S::zero() || !next.is_finite() || next.abs() <= small || stalls {
                break;
            }
            step = next;
        }
        let reached = lacking.magnitude() <= REACHED * wanted.magnitude().max(unit);
        reached.then_some(point[replaced])
    }

    /// Section point with its image; `None` if the flight does not make the contacts of the
    /// itinerary.
    fn flown(&mut self, number: usize, unknowns: &[S], varied: bool) -> Option<FlownPoint<S>> {
        let size = self.dimension();
        let variables = &unknowns[number * size..(number + 1) * size];
        let parameters = &self.parameters(unknowns);
        let Some((replaced, _)) = self.replaced() else {
            return self.flown_at(number, variables, parameters, varied);
        };
        // Next to the graze contacts are not resolved, and beyond it there is no flight: both are
        // replaced by the polynomial through orbits before the graze.
        let own = variables[replaced];
        let mut spacing = S::ROUNDOFF.powf(0.2);
        for _ in 0..SHORTENINGS {
            if own >= S::from_f64(spacing) {
                return self.flown_at(number, variables, parameters, varied);
            }
            let at = |node: usize| S::from_f64((node + 1) as f64 * spacing);
            let nodes = (0..NODES).map(|node| {
                let mut variables = variables.to_vec();
                variables[replaced] = at(node);
                let others = (0..NODES).filter(|&other| other != node);
                let weight = others.fold(S::one(), |product, other| {
                    product * (own - at(other)) / (at(node) - at(other))
                });
                Some((weight, self.flown_at(number, &variables, parameters, varied)?))
            });
            if let Some(nodes) = nodes.collect::<Option<Vec<_>>>() {
                return weighted(&nodes);
            }
            spacing *= SHORTENED;
        }
        None
    }

    /// Section point with its image without extrapolation near the graze; as
    /// [`flown`](Self::flown).
    fn flown_at(
        &mut self,
        number: usize,
        variables: &[S],
        parameters: &[S],
        varied: bool,
    ) -> Option<FlownPoint<S>> {
        if self.is_spent() {
            return None;
        }
        let point = self.point(number, variables, parameters)?;
        let columns = if varied { self.dimension() + self.free.len() } else { 0 };
        let replaced = self.replaced();
        let flight = &mut self.flights[number];
        // A maximum of the gap is no point of a tangency section.
        let is_maximum = flight.image.is_on_tangency()
            && flight.image.normal_acceleration(&point, parameters).ok()? <= S::zero();
        if is_maximum {
            return None;
        }
        let free: Vec<usize> = self.free.iter().map(|(place, _)| *place).collect();
        let (image, both) = match varied {
            false => (flight.image.lifted_image(&point, parameters).ok()?, None),
            true => {
                let gap = match replaced {
                    Some(_) => flight.image.varied_gap(&point, parameters, &free).ok()?,
                    None => None,
                };
                let (image, slopes) = flight.image.varied(&point, parameters, &free).ok()?;
                (flight.image.lifted(image), slopes.zip(Some(gap)))
            }
        };
        let work = flight.image.work() * (1 + VARIED * columns as u64);
        self.work += work;
        self.progress.advance(work);
        let SectionImage { end, passages, .. } = &image;
        if *end != DirectEnd::Returned {
            return None;
        }
        let made = passages.iter().enumerate().filter(|(_, speed)| speed.is_some());
        let made: PassageSet = made.map(|(passage, _)| passage).collect();
        if made != flight.made {
            return None;
        }
        let slopes = both.and_then(|(image, gap)| self.by_variables(number, variables, image, gap));
        Some(FlownPoint {
            point,
            image: image.offsets,
            speeds: image.passages,
            extra_contacts: image.extra_contacts,
            hits: image.hits,
            slopes,
        })
    }

    /// Derivatives of a section point and of its image by the variables and the free parameters,
    /// from those of the image and of the gap by the coordinates and the parameters; `None` if the
    /// gap does not determine the point.
    fn by_variables(
        &self,
        number: usize,
        variables: &[S],
        image: DMatrix<S>,
        gap: Option<Vec<S>>,
    ) -> Option<[DMatrix<S>; 2]> {
        let (size, free) = (self.dimension(), self.free.len());
        let units = self.units.state.iter().chain(&self.units.parameters);
        let units: Vec<S> = units.map(|&unit| S::from_f64(unit)).collect();
        let mut point = DMatrix::from_fn(size, size + free, |row, column| match row == column {
            true => units[row],
            false => S::zero(),
        });
        if let Some((replaced, unit)) = self.replaced() {
            let gap = gap?;
            for column in 0..size + free {
                point[(replaced, column)] = if column == replaced {
                    let by_own = match (self.begins_with_contact(number), self.units.smooth) {
                        (false, _) => S::one(),
                        (true, false) => -(variables[replaced] + variables[replaced]),
                        (true, true) => -S::one(),
                    };
                    by_own * S::from_f64(unit) / gap[replaced]
                } else {
                    -(gap[column] * units[column] / gap[replaced])
                };
            }
        }
        let mut image_slopes = image.columns(0, size) * &point;
        for column in size..size + free {
            for row in 0..size {
                image_slopes[(row, column)] += image[(row, column)] * units[column];
            }
        }
        let all = point.iter().chain(image_slopes.iter()).all(|entry| entry.is_finite());
        all.then_some([point, image_slopes])
    }

    /// Derivative, by an unknown, of the variable that slopes are taken by; see [`DirectOrbit`].
    fn stretch(&self, unknown: usize, value: S) -> S {
        match self.units.smooth && self.begins_with_contact_at(unknown) {
            true => value + value,
            false => S::one(),
        }
    }

    /// Derivatives of a section point and of its image by one variable, or by a parameter (numbered
    /// after the variables).
    fn slopes(
        &mut self,
        number: usize,
        unknowns: &[S],
        place: usize,
        centre: &FlownPoint<S>,
    ) -> Option<[DVector<S>; 2]> {
        let size = self.dimension();
        let own = self.replaced().is_some_and(|(replaced, _)| replaced == place);
        let unknown = if place < size { number * size } else { self.variables() - size } + place;
        let at = unknowns[unknown].to_f64();
        let mut length = S::ROUNDOFF.powf(0.2);
        for _ in 0..SHORTENINGS {
            let mut side = |steps: f64| {
                let mut moved = unknowns.to_vec();
                moved[unknown] += S::from_f64(steps * length);
                let flown = self.flown(number, &moved, false)?;
                (flown.extra_contacts == centre.extra_contacts).then_some(flown)
            };
            // One-sided next to the graze, beyond which there is no flight.
            let weights: &[(f64, f64)] = match own && at < 2.0 * length {
                true => &[
                    (1.0, AHEAD[0]),
                    (2.0, AHEAD[1]),
                    (3.0, AHEAD[2]),
                    (4.0, AHEAD[3]),
                    (0.0, -25.0),
                ],
                false => &[(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)],
            };
            let sides = weights.iter().map(|&(steps, weight)| Some((weight, side(steps)?)));
            if let Some(sides) = sides.collect::<Option<Vec<_>>>() {
                let factor = S::from_f64(12.0 * length);
                let of = |part: fn(&FlownPoint<S>) -> &Vec<S>| {
                    DVector::from_fn(size, |component, _| {
                        let terms = sides
                            .iter()
                            .map(|(weight, flown)| S::from_f64(*weight) * part(flown)[component]);
                        terms.sum::<S>() / factor
                    })
                };
                return Some([of(|flown| &flown.point), of(|flown| &flown.image)]);
            }
            length *= SHORTENED;
        }
        None
    }

    /// Flight with derivatives of its section point and of its image by its variables and the free
    /// parameters, as in [`DirectOrbit::blocks`]: by first variations, or by differences if it
    /// rests on a rigid surface.
    fn with_slopes(
        &mut self,
        number: usize,
        unknowns: &[S],
    ) -> Option<(FlownPoint<S>, [DMatrix<S>; 2])> {
        let mut centre = self.flown(number, unknowns, true)?;
        if let Some(slopes) = centre.slopes.take() {
            return Some((centre, slopes));
        }
        let (size, free) = (self.dimension(), self.free.len());
        let mut both = [0, 1].map(|_| DMatrix::from_element(size, size + free, S::zero()));
        for place in 0..size + free {
            let slopes = self.slopes(number, unknowns, place, &centre)?;
            let stretch = match place < size {
                true => self.stretch(number * size + place, unknowns[number * size + place]),
                false => S::one(),
            };
            let parts = both.iter_mut().zip(slopes);
            parts.for_each(|(part, slope)| part.set_column(place, &(slope / stretch)));
        }
        Some((centre, both))
    }

    /// Derivative of the impact speed by the variable of a return that begins with contact, at
    /// zero, by a one-sided difference.
    pub fn speed_by_variable(&mut self, unknowns: &[S], unknown: usize) -> Option<S> {
        let (number, size) = (unknown / self.dimension(), self.dimension());
        let parameters = self.parameters(unknowns);
        let length = S::ROUNDOFF.powf(0.2);
        let speed = |steps: f64| {
            let mut moved = unknowns.to_vec();
            moved[unknown] = S::from_f64(steps * length);
            let variables = &moved[number * size..(number + 1) * size];
            self.flown_at(number, variables, &parameters, false)?.speeds[0]
        };
        let weighted = AHEAD.iter().zip([1.0, 2.0, 3.0, 4.0].map(speed));
        let terms = weighted.map(|(&weight, speed)| Some(S::from_f64(weight) * speed?));
        Some(terms.sum::<Option<S>>()? / S::from_f64(12.0 * length))
    }

    /// Return in units; slopes are 0 unless `with_slopes`. `None` if it does not make exactly the
    /// contacts of the itinerary.
    pub(in crate::analysis) fn return_at(
        &mut self,
        number: usize,
        unknowns: &[S],
        with_slopes: bool,
    ) -> Option<PrescribedReturn<S>> {
        let (size, free) = (self.dimension(), self.free.len());
        let units: Vec<S> = self.units.state.iter().map(|&unit| S::from_f64(unit)).collect();
        let (centre, slopes) = match with_slopes {
            false => {
                let slopes = DMatrix::from_element(2 * size, size + free, S::zero());
                (self.flown(number, unknowns, false)?, slopes)
            }
            true => {
                let (centre, both) = self.with_slopes(number, unknowns)?;
                let slope = |row: usize, place| {
                    let unknown = number * size + place;
                    let stretch = match place < size {
                        true => self.stretch(unknown, unknowns[unknown]),
                        false => S::one(),
                    };
                    both[row / size][(row % size, place)] * stretch / units[row % size]
                };
                (centre, DMatrix::from_fn(2 * size, size + free, slope))
            }
        };
        let scaled = |values: &[S]| values.iter().zip(&units).map(|(&a, &b)| a / b).collect();
        (centre.extra_contacts == 0).then(|| PrescribedReturn {
            point: scaled(&centre.point),
            image: scaled(&centre.image),
            lacking: Vec::new(),
            slopes,
            free: Vec::new(),
        })
    }

    /// Rounding of derivatives (which may be differences) relative to that of the number type.
    pub fn rounding() -> f64 {
        S::ROUNDOFF.powf(0.8) / S::ROUNDOFF
    }

    /// Jacobian of the map of the period at its first point; `None` at a graze, and for an orbit
    /// without derivatives.
    pub fn jacobian(&self, orbit: &DirectOrbit<S>) -> Option<DMatrix<S>> {
        if orbit.blocks.is_empty() {
            return None;
        }
        let size = self.dimension();
        let unit = DMatrix::from_fn(size, size, |i, j| if i == j { S::one() } else { S::zero() });
        let product = orbit.blocks.iter().try_fold(unit, |product, [point, image]| {
            Some(image * inverse(point).ok()? * product)
        })?;
        product.iter().all(|entry| entry.is_finite()).then_some(product)
    }

    /// Square Jacobian with the sign of the last image changed, by the variables of
    /// [`DirectOrbit`]: singular if −1 is a multiplier.
    fn doubling(&self, orbit: &DirectOrbit<S>) -> DMatrix<S> {
        let matrix = &orbit.regular + self.first_point_regular(orbit) * S::from_f64(2.0);
        matrix.columns(0, self.variables()).into_owned()
    }

    /// Direction of the unknowns in which orbits double at a flip; `None` at a graze.
    pub fn doubling_direction(
        &self,
        orbit: &DirectOrbit<S>,
        null_vector: impl Fn(&DMatrix<S>) -> Option<Vec<S>>,
    ) -> Option<Vec<S>> {
        let vector = null_vector(&self.doubling(orbit))?;
        let values = vector.iter().zip(&orbit.stretches).map(|(&value, &by)| value / by);
        let values: Vec<S> = values.collect();
        values.iter().all(|value| value.is_finite()).then_some(values)
    }

    /// Derivatives of the first section point by all unknowns, in the rows of the last image.
    pub fn first_point(&self, orbit: &DirectOrbit<S>) -> DMatrix<S> {
        stretched(self.first_point_regular(orbit), &orbit.stretches)
    }

    fn first_point_regular(&self, orbit: &DirectOrbit<S>) -> DMatrix<S> {
        let (size, rows) = (self.dimension(), self.variables());
        let mut matrix = DMatrix::from_element(rows, rows + self.free.len(), S::zero());
        let [point, _] = &orbit.blocks[0];
        for row in 0..size {
            let (at, unit) = (rows - size + row, S::from_f64(self.units.state[row]));
            for column in 0..size {
                matrix[(at, column)] = point[(row, column)] / unit;
            }
            for (number, slope) in orbit.by_parameters.iter().enumerate() {
                matrix[(at, rows + number)] = slope[row] / unit;
            }
        }
        matrix
    }

    /// Tangent of a curve of orbits in one parameter, in the variables of [`DirectOrbit`].
    fn regular_tangent(&self, point: &ContinuationPoint<S, DirectOrbit<S>>) -> Option<Vec<S>> {
        let orbit = &point.linearised.extra;
        if orbit.stretches.iter().all(|&stretch| stretch == S::one()) {
            return Some(point.tangent.clone());
        }
        // At a graze the tangent is along the variable of the contact alone, as is the direction
        // next to which it is sought.
        let least = S::from_f64(LEAST_STRETCH);
        let along = point.tangent.iter().zip(&orbit.stretches);
        let along: Vec<S> = along.map(|(&value, &stretch)| value * stretch.max(least)).collect();
        tangent_at(&orbit.regular, &along)
    }

    /// Whether the orbit has a shorter period, to a relative tolerance of its offsets.
    pub fn is_repeated(&self, orbit: &DirectOrbit<S>, tolerance: f64) -> bool {
        let count = orbit.states.len();
        let circle = self.image.circle();
        let near = |a: &[S], b: &[S]| {
            let mut later = b.to_vec();
            circle.bring_near(&mut later, a);
            let mut pairs = a.iter().zip(later).zip(&self.units.state);
            pairs.all(|((&a, b), unit)| is_same([a, b], *unit, tolerance))
        };
        // Next to a graze the halves of an orbit may be near, and one of them makes a contact more.
        let contacts = || orbit.hits.iter().chain([&orbit.extra_contacts]);
        self.rotations().skip(1).any(|later| {
            let times = (1..=count).find(|times| times * later % count == 0).unwrap_or(1);
            contacts().all(|contacts| contacts.is_multiple_of(times))
                && (0..count).all(|n| near(&orbit.states[n], &orbit.states[(n + later) % count]))
        })
    }

    /// Whether an orbit of an autonomous system is an equilibrium or ends near one, by the
    /// acceleration of the gap at its first point.
    pub fn is_at_rest(&mut self, orbit: &DirectOrbit<S>, parameters: &[S]) -> bool {
        let Some(nominal) = self.units.acceleration else { return false };
        let here = self.image.normal_acceleration(&orbit.states[0], parameters);
        here.is_ok_and(|here| here.to_f64() <= AT_REST * nominal)
    }

    /// Components of a vector of unknowns of all returns that belong to these equations.
    pub fn own(&self, all: &[S]) -> Vec<S> {
        let size = self.dimension();
        let places = self.flights.iter().map(|flight| flight.first * size);
        let own = places.flat_map(|place| &all[place..place + size]);
        own.chain(&all[size * self.itinerary.period()..]).copied().collect()
    }

    /// Section points of all returns of an orbit that has only some of them; `None` if a return has
    /// no image.
    pub fn every_point(&mut self, orbit: &DirectOrbit<S>, parameters: &[S]) -> Option<Vec<Vec<S>>> {
        let mut states: Vec<Vec<S>> = Vec::new();
        for number in 0..self.itinerary.period() {
            let state = match orbit.returns.iter().position(|&known| known == number) {
                Some(place) => orbit.states[place].clone(),
                None => {
                    let image = self.image.lifted_image(states.last()?, parameters).ok()?;
                    (image.end == DirectEnd::Returned).then_some(image.offsets)?
                }
            };
            states.push(state);
        }
        Some(states)
    }

    /// Numbers of section points after which the orbit can be started with the same itinerary.
    pub fn rotations(&self) -> impl Iterator<Item = usize> {
        let firsts = self.flights.iter().enumerate();
        let same = firsts.filter(|(_, flight)| self.itinerary.repeats_after(flight.first));
        same.map(|(number, _)| number)
    }

    /// Test function for half the period: difference of the first points of both halves, if the
    /// itinerary consists of two equal halves.
    fn halves(&self, unknowns: &[S]) -> TestValue<S> {
        let half = self.flights.len() / 2;
        let doubled = self.flights.len() == 2 * half && repeats_after_half(&self.itinerary);
        let place = self.replaced().map_or(0, |(replaced, _)| replaced);
        halves(&unknowns[place..], half * self.dimension(), doubled)
    }

    /// Test function for reciprocal multipliers, smooth up to the graze.
    fn reciprocity(&self, orbit: &DirectOrbit<S>) -> Option<TestValue<S>> {
        if self.dimension() < 2 {
            return None;
        }
        let product = |part: usize| {
            let blocks = orbit.blocks.iter();
            let factors = blocks.map(|both| determinant(&both[part]).unwrap_or(S::zero()));
            factors.fold(S::one(), |product, factor| product * factor)
        };
        let points = product(0);
        if self.dimension() == 2 {
            let images = product(1);
            let size = points.magnitude().max(images.magnitude());
            return Some(TestValue { value: images - points, size });
        }
        Some(reciprocal_pairs(self.jacobian(orbit), points))
    }
}

impl<S: Real> DirectOrbitEquations<'_, S> {
    /// Orbit without derivatives, and the residuals; `None` if a return does not make the contacts
    /// of the itinerary.
    pub fn flown_orbit(&mut self, unknowns: &[S]) -> Option<(DirectOrbit<S>, DVector<S>)> {
        let (mut orbit, mut residual) = self.begun();
        for number in 0..self.flights.len() {
            let flown = self.flown(number, unknowns, false)?;
            self.add_to(&mut orbit, &mut residual, number, flown);
        }
        self.close(&mut orbit, &mut residual);
        Some((orbit, residual))
    }

    /// Orbit and residuals before any return is added.
    fn begun(&self) -> (DirectOrbit<S>, DVector<S>) {
        let orbit = DirectOrbit {
            states: Vec::new(),
            returns: self.flights.iter().map(|flight| flight.first).collect(),
            points: self.points,
            speeds: Vec::new(),
            extra_contacts: 0,
            hits: Vec::new(),
            turns: 0,
            blocks: Vec::new(),
            stretches: Vec::new(),
            regular: DMatrix::from_element(0, 0, S::zero()),
            by_parameters: Vec::new(),
        };
        (orbit, DVector::from_element(self.variables(), S::zero()))
    }

    /// First row of a point's own equation, and first row of the equation of the return that leads
    /// to it.
    fn rows(&self, number: usize) -> (usize, usize) {
        let (size, count) = (self.dimension(), self.flights.len());
        (number * size, (number + count - 1) % count * size)
    }

    /// Adds a flight to an orbit, and its section point and image to the residuals.
    fn add_to(
        &self,
        orbit: &mut DirectOrbit<S>,
        residual: &mut DVector<S>,
        number: usize,
        flown: FlownPoint<S>,
    ) {
        let (own, before) = self.rows(number);
        for (row, &unit) in self.units.state.iter().enumerate() {
            let unit = S::from_f64(unit);
            residual[own + row] += flown.image[row] / unit;
            residual[before + row] -= flown.point[row] / unit;
        }
        let (first, passages) = (self.flights[number].first, self.itinerary.passages());
        let speeds = flown.speeds.iter().enumerate().filter_map(|(passage, speed)| {
            Some((first + passage / passages, passage % passages, (*speed)?))
        });
        orbit.speeds.extend(speeds);
        orbit.extra_contacts += flown.extra_contacts;
        orbit.hits.resize(flown.hits.len(), 0);
        orbit.hits.iter_mut().zip(&flown.hits).for_each(|(sum, hits)| *sum += hits);
        orbit.states.push(flown.point);
    }

    /// Removes whole periods of the phase from the residuals.
    fn close(&self, orbit: &mut DirectOrbit<S>, residual: &mut DVector<S>) {
        let circle = self.circle();
        for rows in residual.as_mut_slice().chunks_exact_mut(self.dimension()) {
            orbit.turns = orbit.turns.saturating_add(circle.reduce(rows));
        }
    }

    /// Phase among the coordinates in their units, if it is one.
    fn circle(&self) -> PhaseCircle<S> {
        let circle = self.image.circle().phase().map(|(phase, period)| {
            PhaseCircle::new(phase, period / S::from_f64(self.units.state[phase]))
        });
        circle.unwrap_or_else(PhaseCircle::none)
    }

    /// Residuals and their Jacobian by all unknowns, with the orbit; `None` if a return does not
    /// make the contacts of the itinerary.
    pub fn orbit_at(&mut self, unknowns: &[S]) -> Option<Linearised<S, DirectOrbit<S>>> {
        let (size, count) = (self.dimension(), self.flights.len());
        let (rows, free) = (size * count, self.free.len());
        let (mut orbit, mut residual) = self.begun();
        let mut jacobian = DMatrix::from_element(rows, rows + free, S::zero());
        for number in 0..count {
            let (centre, both) = self.with_slopes(number, unknowns)?;
            let (own, before) = self.rows(number);
            for place in 0..size + free {
                let column = if place < size { number * size } else { rows - size } + place;
                for (row, &unit) in self.units.state.iter().enumerate() {
                    let unit = S::from_f64(unit);
                    jacobian[(own + row, column)] += both[1][(row, place)] / unit;
                    jacobian[(before + row, column)] -= both[0][(row, place)] / unit;
                }
            }
            if number == 0 {
                let by_parameters = both[0].columns(size, free);
                orbit.by_parameters = by_parameters.column_iter().map(|c| c.into_owned()).collect();
            }
            orbit.blocks.push(both.map(|part| part.columns(0, size).into_owned()));
            self.add_to(&mut orbit, &mut residual, number, centre);
        }
        self.close(&mut orbit, &mut residual);
        let finite = residual.iter().chain(jacobian.iter()).all(|value| value.is_finite());
        let stretches = unknowns.iter().enumerate();
        let stretches = stretches.map(|(unknown, &value)| self.stretch(unknown, value));
        orbit.stretches = stretches.take(rows + free).collect();
        orbit.regular = jacobian.clone();
        let jacobian = stretched(jacobian, &orbit.stretches);
        finite.then_some(Linearised { residual, jacobian, extra: orbit })
    }
}

/// Test functions: the turn of the parameter (a fold), a multiplier −1 (a flip), the determinant
/// with the tangent (a branch point), the difference of both halves of a period, reciprocal
/// multipliers. Grazes are borders.
impl<S: Real> CurveEquations<S> for DirectOrbitEquations<'_, S> {
    type Extra = DirectOrbit<S>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, DirectOrbit<S>>> {
        self.orbit_at(unknowns)
    }

    fn residual(&mut self, unknowns: &[S]) -> Option<DVector<S>> {
        Some(self.flown_orbit(unknowns)?.1)
    }

    fn tests(&self, point: &ContinuationPoint<S, DirectOrbit<S>>) -> Vec<TestValue<S>> {
        let orbit = &point.linearised.extra;
        let unknown = S::from_f64(f64::NAN);
        let tangent = self.regular_tangent(point).unwrap_or(vec![unknown; point.tangent.len()]);
        let mut tests = vec![
            TestValue { value: tangent[tangent.len() - 1], size: 1.0 },
            TestValue::determinant(&self.doubling(orbit)),
            crossing(&orbit.regular, &tangent),
            self.halves(&point.unknowns),
        ];
        tests.extend(self.reciprocity(orbit));
        // Derivatives may be differences, with larger rounding than the number type.
        let rounding = Self::rounding();
        tests.iter_mut().for_each(|test| test.size *= rounding);
        tests
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        let number = unknown.checked_sub(self.variables());
        if let Some((_, range)) = number.and_then(|number| self.free.get(number)) {
            return *range;
        }
        let least = if self.passage_of(unknown).is_some() { 0.0 } else { -self.reach };
        [least, self.reach]
    }

    fn bring_near(&self, unknowns: &mut [S], other: &[S]) {
        let (circle, size, variables) = (self.circle(), self.dimension(), self.variables());
        // The variable of a passage that replaces the phase is not periodic.
        let replaced = self.replaced().map(|(replaced, _)| replaced);
        if circle.phase().is_some_and(|(phase, _)| Some(phase) != replaced) {
            let points = unknowns[..variables].chunks_exact_mut(size);
            for (point, other) in points.zip(other.chunks_exact(size)) {
                circle.bring_near(point, other);
            }
        }
    }

    fn is_spent(&self) -> bool {
        self.work >= self.most_work
    }

    fn is_last(&mut self, [_, point]: [&ContinuationPoint<S, DirectOrbit<S>>; 2]) -> bool {
        let orbit = &point.linearised.extra;
        let parameters = self.parameters(&point.unknowns);
        let may_rest = self.units.acceleration.is_some();
        self.is_repeated(orbit, REPEATED) || (may_rest && self.is_at_rest(orbit, &parameters))
    }
}
