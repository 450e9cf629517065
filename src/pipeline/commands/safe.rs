//! `safe`: whether a scene is clear of its stops, how far its parameters may go, and which other
//! attractors there are.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::stops::{SAME, grazing, stops};
use crate::analysis::branches::{AttractorBranch, BranchLabel, BranchPoint, BranchRequest};
use crate::analysis::diagram::Sweep;
use crate::analysis::{
    MotionEvents, PartProgress, Progress, SectionFrame, SubProgress, TimeSeriesRequest,
    escape_bounds,
};
use crate::iteration::OrbitEnd;
use crate::model::{DiagramRequest, Method, Observable, Scene, Spacing, Starts, SweepDirection};
use crate::numeric::Dd;
use crate::orbit::{ClearInterval, IntervalEnd, clear_interval, rigid_stops_beyond};
use crate::pipeline::keys::{KeyError, finite};
#[cfg(feature = "cli")]
use crate::pipeline::options::shares;
use crate::pipeline::{Answer, Error, Map, Source, parameter_number};
use crate::report::{
    AttractorEnd, Document, DocumentKind, Named, OtherAttractor, SafeInterval, SafetyListing,
    ToleranceBox, to_json,
};

/// Starts simulated together: a bound on what they take of memory, and on what an interruption
/// still frees.
const BLOCK: usize = 1024;

/// Starts along each axis of the plane where none are named.
const STARTS: u32 = 16;
/// Largest number of starts along each axis of the plane of states.
const MOST_STARTS: u32 = 1000;

/// Half-width of the plane of starts, in sizes of a coordinate: its value at the graze or its
/// amplitude along the grazing orbit. The half-width where both are 0.
const REACH: f64 = 1.5;
const LEAST_REACH: f64 = 1e-3;

/// Returns before an orbit is looked at, and those looked at.
const TRANSIENT: usize = 1000;
const KEPT: usize = 64;

/// Returns after which the motion of an attractor is simulated by itself, until it has settled.
const SETTLED_AFTER: [usize; 2] = [TRANSIENT, 10 * TRANSIENT];

/// Difference of impact speeds, relative above 1, within which two orbits of one name are one.
const SAME_SPEED: f64 = 1e-6;

/// Attractors that are followed, those with the largest shares, and the longest period in returns.
const FOLLOWED: usize = 8;
const LONGEST: usize = 16;

/// Keys of `safe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct SafeKeys {
    /// Tolerances of parameters, relative to their values; a box that is looked at as a whole.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "P=5%,...", value_parser = shares)
    )]
    pub tolerance: Option<Named<f64>>,
    /// Number of starts along each axis, at most 1000, from which direct simulation looks for other
    /// attractors; 0: none.
    #[cfg_attr(
        feature = "cli",
        arg(
            long,
            value_name = "N",
            default_value_t = STARTS,
            value_parser = clap::value_parser!(u32).range(0..=i64::from(MOST_STARTS))
        )
    )]
    pub points: u32,
}

impl Default for SafeKeys {
    /// No tolerance; 16 by 16 starts.
    fn default() -> Self {
        Self { tolerance: None, points: STARTS }
    }
}

impl SafeKeys {
    /// Computes the answer: margins, intervals, the box of tolerances, other attractors.
    ///
    /// # Errors
    ///
    /// [`Error::Key`] and [`Error::NoSuchParameter`] for unknown parameters, tolerances that are
    /// not positive or of a value of 0, and too many starts; [`Error::NotLocated`] if the scene has
    /// no periodic orbit.
    pub fn answer(&self, scene: &Scene, progress: &dyn Progress) -> Result<Answer, Error> {
        if self.points > MOST_STARTS {
            let (range, value) = ([0.0, f64::from(MOST_STARTS)], f64::from(self.points));
            return Err(KeyError::Outside { key: "points", range, value }.into());
        }
        let adjusted = scene.grazing.solve_for[0];
        let mut tolerances = Vec::new();
        for (name, tolerance) in self.tolerance.iter().flat_map(|Named(given)| given) {
            let parameter = parameter_number(scene, name)?;
            if finite("tolerance", *tolerance)? <= 0.0 {
                return Err(KeyError::NotPositive { key: "tolerance", value: *tolerance }.into());
            }
            if scene.model.parameters[parameter].value == Dd::ZERO {
                return Err(KeyError::ShareOfZero { name: name.clone() }.into());
            }
            tolerances.push((parameter, *tolerance));
        }
        let mut listed = scene.expansion.active.clone();
        listed.extend(std::iter::once(adjusted).chain(tolerances.iter().map(|of| of.0)));
        listed.sort_unstable();
        listed.dedup();
        let corners = corners(scene, &tolerances);
        let parts = 1 + listed.len() + corners.len() + usize::from(self.points > 0);
        PartProgress::announce(progress, parts);
        // The verdict is of the orbit that grazes where the scene's own parameter is adjusted.
        let searched = part(progress);
        let nominal = clear_interval(scene, adjusted, None)??;
        drop(searched);
        let mut stops = StopsToClear { counted: stops(scene), lost: Vec::new() };
        let mut intervals = Vec::new();
        for parameter in listed {
            let _part = part(progress);
            let first = match parameter == adjusted {
                true => nominal.clone(),
                false => clear_interval(scene, parameter, Some(&nominal.start))??,
            };
            let ends = stops.nearest(scene, parameter, &first);
            intervals.push(stops.interval(scene, parameter, ends));
        }
        let tolerance = match tolerances.is_empty() {
            true => None,
            false => {
                Some(stops.tolerance_box(scene, &nominal.start, &tolerances, &corners, progress)?)
            }
        };
        let found = match self.points {
            0 => FoundAttractors::default(),
            points => attractors(scene, adjusted, points as usize, progress)?,
        };
        let named = |stops: &[usize]| {
            stops.iter().map(|&stop| scene.model.surfaces[stop].name.clone()).collect()
        };
        let listing = SafetyListing {
            surface: scene.model.surfaces[scene.grazing.passages[0]].name.clone(),
            stops: named(&stops.counted),
            clears: nominal.clears(),
            unstable: nominal.unstable,
            through: nominal.through.map(|other| scene.model.surfaces[other].name.clone()),
            others: named(&stops.lost),
            intervals,
            tolerance,
            attractors: found.attractors,
            along: scene.model.parameters[adjusted].name.clone(),
            starts: found.starts,
            no_image: found.no_image,
            escaped: found.escaped,
        };
        let document = to_json(&Document::new(DocumentKind::Safety, scene, &listing))?;
        let text = listing.text(&scene.identifier);
        let mut answer = Answer::new("safe", text, document, listing.table());
        if !listing.attractors.is_empty() {
            answer.tables.insert(0, ("safe_attractors", listing.attractor_data()));
        }
        answer.page = Some(listing.page(scene));
        Ok(answer.with_figures([("", listing.figure())]))
    }
}

/// Progress of one part of the answer, which is announced.
fn part(progress: &dyn Progress) -> PartProgress<'_> {
    PartProgress::new(progress, 1)
}

/// Stops that the orbit is to be clear of.
struct StopsToClear {
    /// Stops whose grazes are found: first the one that the scene's orbit grazes.
    counted: Vec<usize>,
    /// Stops along whose grazes the orbit could not be followed.
    lost: Vec<usize>,
}

/// End of the interval of a parameter, and the stop that is grazed there.
type StopEnd = (IntervalEnd, usize);

impl StopsToClear {
    /// Nearest ends of the interval of a parameter, whichever stop is grazed there, from the
    /// interval of the first stop.
    fn nearest(
        &mut self,
        scene: &Scene,
        parameter: usize,
        first: &ClearInterval,
    ) -> [Option<StopEnd>; 2] {
        let own = scene.model.parameters[parameter].value.to_f64();
        let of = |found: &ClearInterval, stop: usize| {
            found.ends.clone().map(|end| end.map(|end| (end, stop)))
        };
        let mut nearest = of(first, self.counted[0]);
        for at in (1..self.counted.len()).rev() {
            let stop = self.counted[at];
            let scene = grazing(scene, stop);
            let Ok(Ok(found)) = clear_interval(&scene, parameter, Some(&first.start)) else {
                self.lost.push(self.counted.remove(at));
                continue;
            };
            let distance = |end: &StopEnd| (end.0.value() - own).abs();
            for (nearest, end) in nearest.iter_mut().zip(of(&found, stop)) {
                let Some(end) = end else { continue };
                let known = nearest.as_ref().map_or(f64::INFINITY, distance);
                if distance(&end) < (1.0 - SAME) * known {
                    *nearest = Some(end);
                }
            }
        }
        nearest
    }

    /// Interval of a parameter, about the scene's value, in which the orbit neither grazes nor ends
    /// as far as was found.
    fn interval(
        &self,
        scene: &Scene,
        parameter: usize,
        ends: [Option<StopEnd>; 2],
    ) -> SafeInterval {
        let value = scene.model.parameters[parameter].value.to_f64();
        let name = scene.model.parameters[parameter].name.clone();
        let mut interval = SafeInterval { parameter: name, value, ..SafeInterval::default() };
        let [below, above] = ends;
        for (end, graze, fold, at) in [
            (below, &mut interval.below, &mut interval.fold_below, &mut interval.stop_below),
            (above, &mut interval.above, &mut interval.fold_above, &mut interval.stop_above),
        ] {
            match end {
                Some((IntervalEnd::Graze { value, .. }, stop)) => {
                    *graze = Some(value);
                    *at = self.name_of(scene, stop);
                }
                Some((IntervalEnd::Fold { value }, _)) => *fold = Some(value),
                None => {}
            }
        }
        interval
    }

    /// Name of a stop; `None` where there is only one.
    fn name_of(&self, scene: &Scene, stop: usize) -> Option<String> {
        let several = self.counted.len() + self.lost.len() > 1;
        several.then(|| scene.model.surfaces[stop].name.clone())
    }

    /// Whether all of a box of tolerances is clear of the stops: on the edge along its first
    /// parameter at every corner of the others, and through its middle.
    fn tolerance_box(
        &mut self,
        scene: &Scene,
        start: &[f64],
        tolerances: &[(usize, f64)],
        corners: &[Vec<(usize, f64)>],
        progress: &dyn Progress,
    ) -> Result<ToleranceBox, Error> {
        let (first, share) = tolerances[0];
        let own = scene.model.parameters[first].value.to_f64();
        let mut ends = [own * (1.0 - share), own * (1.0 + share)];
        ends.sort_by(f64::total_cmp);
        let name = |parameter: usize| scene.model.parameters[parameter].name.clone();
        let (mut touched, mut stops, mut folds) = (Vec::new(), Vec::new(), Vec::new());
        for corner in corners {
            let _part = part(progress);
            let mut scene = scene.clone();
            for &(parameter, value) in corner {
                scene.model.parameters[parameter].value = Dd::from(value);
            }
            if let Some((trouble, stop)) = self.first_trouble(&scene, start, first, ends)? {
                let values = corner.iter().map(|&(parameter, value)| (name(parameter), value));
                let own = std::iter::once((name(first), trouble.value()));
                let values = Named::new(own.chain(values));
                match trouble {
                    IntervalEnd::Graze { .. } => {
                        touched.push(values);
                        stops.extend(self.name_of(&scene, stop));
                    }
                    IntervalEnd::Fold { .. } => folds.push(values),
                }
            }
        }
        let tolerances = tolerances.iter().map(|&(parameter, share)| (name(parameter), share));
        let tolerances = Named::new(tolerances);
        Ok(ToleranceBox { tolerances, edges: corners.len(), touched, stops, folds })
    }

    /// First place between two ends of a parameter at which the scene's orbit is clear no more:
    /// the nearest at which it touches a stop or lies beyond it, else at which it ends.
    fn first_trouble(
        &mut self,
        scene: &Scene,
        start: &[f64],
        parameter: usize,
        ends: [f64; 2],
    ) -> Result<Option<StopEnd>, Error> {
        let own = scene.model.parameters[parameter].value.to_f64();
        let grazed = self.counted[0];
        let Ok(found) = clear_interval(scene, parameter, Some(start))? else {
            return Ok(Some((IntervalEnd::Fold { value: own }, grazed)));
        };
        let is_inside = |(end, _): &StopEnd| (ends[0]..=ends[1]).contains(&end.value());
        let nearest = self.nearest(scene, parameter, &found);
        let inside = nearest.into_iter().flatten().filter(is_inside);
        let order = |(end, _): &StopEnd| {
            (matches!(end, IntervalEnd::Fold { .. }), (end.value() - own).abs())
        };
        let nearest = inside.min_by(|a, b| {
            let (a, b) = (order(a), order(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let is_graze = matches!(nearest, Some((IntervalEnd::Graze { .. }, _)));
        if found.clears() || is_graze {
            return Ok(nearest);
        }
        let stop = found.through.unwrap_or(grazed);
        Ok(Some((IntervalEnd::Graze { value: own, state: found.start }, stop)))
    }
}

/// Values of the tolerated parameters but the first: at the scene's values and at every corner.
fn corners(scene: &Scene, tolerances: &[(usize, f64)]) -> Vec<Vec<(usize, f64)>> {
    let own = |parameter: usize| scene.model.parameters[parameter].value.to_f64();
    let rest = tolerances.get(1..).unwrap_or_default();
    if tolerances.is_empty() {
        return Vec::new();
    }
    let middle: Vec<(usize, f64)> = rest.iter().map(|&(p, _)| (p, own(p))).collect();
    let corner = |number: usize| {
        let value = |(place, &(p, share)): (usize, &(usize, f64))| {
            let sign = if number >> place & 1 == 1 { 1.0 } else { -1.0 };
            (p, own(p) * (1.0 + sign * share))
        };
        rest.iter().enumerate().map(value).collect()
    };
    let count = if rest.is_empty() { 0 } else { 1 << rest.len() };
    std::iter::once(middle).chain((0..count).map(corner)).collect()
}

/// Attractors that starts come to, and shares of the starts that come to none.
#[derive(Default)]
struct FoundAttractors {
    attractors: Vec<OtherAttractor>,
    starts: usize,
    no_image: f64,
    escaped: f64,
}

/// Attractors at the scene's values, by direct simulation from every state of a grid; those with
/// the largest shares with the interval of the adjusted parameter in which they exist.
fn attractors(
    scene: &Scene,
    adjusted: usize,
    points: usize,
    progress: &dyn Progress,
) -> Result<FoundAttractors, Error> {
    let simulated = part(progress);
    let Some(along) = scene.expansion.active.iter().position(|&active| active == adjusted) else {
        return Ok(FoundAttractors::default());
    };
    let map = Source::Scene(Box::new(scene.clone())).free_flight()?;
    let own = scene.model.parameters[adjusted].value;
    let offset = (own - map.orbit().parameters()[adjusted]).to_f64();
    let coordinates = map.orbit().section_coordinates(scene);
    let bounds = escape_bounds(scene, map.orbit());
    let phase = scene.model.phase.as_ref().map(|phase| phase.name.as_str());
    let places: Vec<Vec<(&str, f64)>> = coordinates
        .iter()
        .take(2)
        .zip(&bounds)
        .map(|((name, value), bound)| {
            let amplitude = 0.5 * bound.offset / bound.extents;
            let amplitude = if amplitude.is_finite() { amplitude } else { 0.0 };
            let half = match value.to_f64().abs().max(amplitude) {
                _ if phase == Some(name) => PI,
                0.0 => LEAST_REACH,
                size => REACH * size,
            };
            let place = |number: usize| half * ((2 * number + 1) as f64 / points as f64 - 1.0);
            (0..points).map(|number| (*name, place(number))).collect()
        })
        .collect();
    let count = points.pow(places.len() as u32);
    let start = |number: usize| -> Vec<(&str, f64)> {
        let later = (0..places.len() as u32).rev();
        let axes = places.iter().zip(later);
        axes.map(|(axis, later)| axis[number / points.pow(later) % points]).collect()
    };
    let components = &map.orbit().section.coordinates;
    let full = |start: &Vec<(&str, f64)>| {
        let mut state = vec![None; scene.model.dimension()];
        for (&component, &(_, offset)) in components.iter().zip(start) {
            state[component] = Some(offset);
        }
        state
    };
    let mut request = DiagramRequest {
        parameter: adjusted,
        range: [offset; 2],
        points: 1,
        spacing: Spacing::Listed(vec![offset]),
        starts: Starts::Given(Vec::new()),
        transient: TRANSIENT,
        keep: KEPT,
        observe: Observable::ImpactSpeed,
        direction: SweepDirection::Up,
        with: vec![Method::Direct],
    };
    let mut all = FoundAttractors { starts: count, ..FoundAttractors::default() };
    let share = 1.0 / count as f64;
    let at = following(&map, along, offset).at;
    let state_of = |start: &[(&str, f64)]| {
        let mut state = vec![0.0; components.len()];
        state.iter_mut().zip(start).for_each(|(own, (_, offset))| *own = *offset);
        state
    };
    let mut frame = SectionFrame::<f64>::new(scene, map.orbit());
    let mut is_possible = |start: &[(&str, f64)]| -> Result<bool, Error> {
        frame.place(&state_of(start), &at)?;
        let mut beyond = rigid_stops_beyond(&scene.model, frame.state(), frame.parameters());
        // A section point beyond its own stop stands for the contact before it.
        Ok(beyond.all(|(surface, _)| surface == frame.surface()))
    };
    PartProgress::announce(&simulated, count);
    let blocks = (0..count).step_by(BLOCK).map(|first| first..count.min(first + BLOCK));
    for (number, block) in blocks.enumerate() {
        let mut starts: Vec<_> = Vec::with_capacity(block.len());
        for start in block.map(start) {
            match is_possible(&start)? {
                true => starts.push(start),
                false => all.no_image += share,
            }
        }
        request.starts = Starts::Given(starts.iter().map(full).collect());
        let own = PartProgress::new(&simulated, starts.len());
        let diagram = map.diagram_with(&request, &SubProgress::new(&own, number))?;
        for (sweep, start) in diagram.sweeps.iter().zip(&starts) {
            all.enter(sweep, start, share);
        }
    }
    drop(simulated);
    let state_of = |attractor: &OtherAttractor| {
        let named = attractor.start.0.iter();
        state_of(&named.map(|(name, offset)| (name.as_str(), *offset)).collect::<Vec<_>>())
    };
    let found = &mut all.attractors;
    join_motions(scene, &map, found, &|attractor, settle| TimeSeriesRequest {
        start: state_of(attractor),
        parameters: at.clone(),
        settle,
        returns: 2 * LONGEST,
        samples: 1,
    })?;
    found.sort_by(|a, b| b.fraction.total_cmp(&a.fraction));
    let periodic = found.iter_mut().filter(|attractor| attractor.orbit.is_some()).take(FOLLOWED);
    let periodic: Vec<&mut OtherAttractor> = periodic.collect();
    PartProgress::announce(progress, periodic.len());
    for attractor in periodic {
        let (request, state) = (following(&map, along, offset), state_of(attractor));
        if let Some(branch) = map.attractor_branch(&request, &state, &part(progress))? {
            let [from, to] = ends(&branch, along, &map.orbit().parameters()[adjusted]);
            (attractor.from, attractor.to) = (Some(from), Some(to));
        }
    }
    Ok(all)
}

impl FoundAttractors {
    /// Counts the attractor on which a sweep settled from a start, with its share of all starts.
    fn enter(&mut self, sweep: &Sweep, start: &[(&str, f64)], share: f64) {
        let Some(point) = sweep.points.first() else { return };
        if point.kept < KEPT {
            match point.end {
                OrbitEnd::NoImage { .. } => self.no_image += share,
                _ => self.escaped += share,
            }
            return;
        }
        let speed = point.values.iter().copied().filter(|speed| speed.is_finite());
        let speed = speed.reduce(f64::max).filter(|speed| *speed > 0.0);
        let orbit = point.orbit.as_ref().map(ToString::to_string);
        let is_same = |other: &OtherAttractor| {
            let speeds = [speed, other.impact_speed].map(Option::unwrap_or_default);
            let apart = (speeds[0] - speeds[1]).abs();
            // Attractors without a period are told apart by nothing that is sharp.
            other.orbit == orbit && (orbit.is_none() || apart <= SAME_SPEED * (1.0 + speeds[0]))
        };
        match self.attractors.iter_mut().find(|other| is_same(other)) {
            Some(known) => {
                known.fraction += share;
                known.impact_speed =
                    [known.impact_speed, speed].into_iter().flatten().reduce(f64::max);
            }
            None => self.attractors.push(OtherAttractor {
                orbit,
                fraction: share,
                impact_speed: speed,
                start: Named::new(start.iter().copied()),
                from: None,
                to: None,
            }),
        }
    }
}

/// Joins attractors that are one motion, which may have several points on a tangency section, and
/// gives each the largest speed of all contacts of its motion; `flight` is the simulation of one
/// after a number of returns. A flight that has not settled, after a long transient, tells nothing.
fn join_motions(
    scene: &Scene,
    map: &Map,
    found: &mut Vec<OtherAttractor>,
    flight: &dyn Fn(&OtherAttractor, usize) -> TimeSeriesRequest,
) -> Result<(), Error> {
    let motion = |attractor: &OtherAttractor| {
        let periodic = SETTLED_AFTER.into_iter().filter(|_| attractor.orbit.is_some());
        for returns in periodic {
            let motion = MotionEvents::of(scene, map.orbit(), &flight(attractor, returns))?;
            if let Some(settled) = motion.filter(MotionEvents::repeats) {
                return Ok(Some(settled));
            }
        }
        Ok::<_, Error>(None)
    };
    let motions: Vec<_> = found.iter().map(motion).collect::<Result<_, _>>()?;
    let first = MotionEvents::first_of_each(&motions);
    for (number, motion) in motions.iter().enumerate() {
        if let Some(motion) = motion {
            found[number].impact_speed = Some(motion.impact_speed()).filter(|speed| *speed > 0.0);
        }
        if first[number] != number {
            found[first[number]].fraction += found[number].fraction;
        }
    }
    let mut kept = first.iter().enumerate().map(|(number, first)| number == *first);
    found.retain(|_| kept.next().unwrap_or(true));
    Ok(())
}

/// Request for the branch through an attractor at an offset of the parameter `along`: as far as the
/// size of the parameter to both sides.
fn following(map: &Map, along: usize, offset: f64) -> BranchRequest {
    let parameters = &map.local().parameters;
    let graze = parameters[along].value.to_f64();
    let size = match (graze + offset).abs() {
        0.0 => graze.abs().max(f64::MIN_POSITIVE),
        size => size,
    };
    let mut at = vec![0.0; parameters.len()];
    at[along] = offset;
    BranchRequest {
        itineraries: Vec::new(),
        longest: LONGEST,
        along,
        range: [offset - size, offset + size],
        at,
        direct: true,
        starts: Vec::new(),
    }
}

/// Lower and upper end of the interval in which an attractor exists along its branch.
fn ends(branch: &AttractorBranch, along: usize, graze: &Dd) -> [AttractorEnd; 2] {
    // Values that are equal in double precision.
    let stretch = branch.stretch(along, f64::EPSILON * graze.to_f64().abs());
    let end = |point: &BranchPoint| {
        let label = point.special.as_ref().map(|special| special.label);
        let value = (*graze + Dd::from(point.orbit.parameters[along])).to_f64();
        AttractorEnd { value, label: label.filter(|label| *label != BranchLabel::BranchPoint) }
    };
    let mut ends = [end(&stretch[0]), end(&stretch[stretch.len() - 1])];
    ends.sort_by(|a, b| a.value.total_cmp(&b.value));
    ends
}
