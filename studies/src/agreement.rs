//! Attractors of guarded and direct sweeps, compared value by value, with the reasons for
//! differences.
//!
//! Both sweeps carry their states. If they settle on different orbits, each is restarted from the
//! other's last state: an orbit that direct simulation keeps is an orbit of the oscillator, and the
//! two sweeps are on different attractors.

use std::fmt;

use grazemap::Map;
use grazemap::analysis::diagram::{
    DirectSweep, FrozenSweep, GuardedSweep, Observer, Settled, SmoothFixedPoint, Start, SweptMap,
};
use grazemap::analysis::{DirectMap, escape_bounds, itinerary};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{DiscreteMap, HornerMap, MapOrbit, OrbitEnd, OrbitRequest, Period};
use grazemap::model::{DiagramRequest, Observable, Scene};
use grazemap::prelude::*;

/// Number of parts of a sweep that run in lanes, each with its own state.
const PARTS: usize = 8;
/// Factor by which the transient is extended if orbits differ.
const LONGER: usize = 20;
/// Largest difference of the extents of equal periodic orbits, as a share of the window and of
/// their own size: the map's error per step, accumulated over an orbit.
const SAME: f64 = 1e-3;
/// Largest difference of the extents of equal attractors without a period, as a share of their own.
const ALIKE: f64 = 0.25;

/// Numbers of iterates.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Number of values of a sweep.
    pub values: usize,
    /// Number of iterates dropped at each value.
    pub transient: usize,
    /// Number of iterates kept at each value.
    pub keep: usize,
}

/// Comparison of the attractors of a diagram's sweeps.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    /// Names of the scene and of the swept parameter.
    pub name: String,
    /// Share of the iterates computed by the map.
    pub by_map: f64,
    /// Number of values at which period, itinerary and extent agree, or both orbits escape.
    pub same: usize,
    /// Number of values at which neither has a period and the extents are similar.
    pub chaotic: usize,
    /// Number of values that agree after a longer transient.
    pub transient: usize,
    /// Number of values at which the guarded orbit is one of direct simulation, or the reverse: two
    /// attractors coexist.
    pub coexisting: usize,
    /// Other values, as text.
    pub unexplained: Vec<String>,
    /// Largest difference of the extents of equal periodic orbits, over the half-width of the
    /// window.
    pub difference: f64,
}

/// Headings of the columns of an agreement.
pub const HEADINGS: &str = "scene and parameter                by map %   same chaotic \
                            transient coexisting unexplained   difference";

impl fmt::Display for Agreement {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, by_map, same, chaotic, transient, coexisting, unexplained, difference } =
            self;
        let (share, left) = (100.0 * by_map, unexplained.len());
        write!(
            out,
            "{name:34} {share:8.2} {same:6} {chaotic:7} {transient:9} {coexisting:10} {left:11} \
             {difference:12.1e}"
        )
    }
}

/// Compares every diagram of a scene.
pub fn of_scene(scene: Scene, effort: &Effort) -> Result<Vec<Agreement>, grazemap::Error> {
    let map = scene.graze()?.map()?;
    let mut diagrams = map.scene().diagrams.clone();
    diagrams.dedup_by(|a, b| (a.parameter, a.range) == (b.parameter, b.range));
    diagrams.iter().map(|diagram| of_diagram(&map, diagram, effort)).collect()
}

/// Compares one upward sweep by both methods.
pub fn of_diagram(
    map: &Map,
    diagram: &DiagramRequest,
    effort: &Effort,
) -> Result<Agreement, grazemap::Error> {
    let settled = map.settled();
    let (scene, orbit, local) = (settled.scene(), settled.orbit(), map.local());
    let system = HybridSystem::new(&scene.model);
    let observer = || Observer::new(scene, orbit, local, &Observable::EventFunction);
    let start = SmoothFixedPoint::new(local);
    let guarded = GuardedSweep {
        map: FrozenSweep {
            map: HornerMap::new(local),
            start: start.clone(),
            observer: observer()?,
            itinerary: itinerary(scene, orbit),
        },
        window: local.window.clone(),
        direct: DirectMap::new(&system, scene, orbit)?,
    };
    let direct = DirectSweep {
        map: DirectMap::new(&system, scene, orbit)?,
        start,
        observer: observer()?,
        itinerary: itinerary(scene, orbit),
    };
    let bounds: Vec<f64> = escape_bounds(scene, orbit).iter().map(|bound| bound.offset).collect();
    let widths = &local.window.state;
    let request = OrbitRequest::new(effort.transient, effort.keep, widths)
        .escaping_at(&bounds)
        .on_circle(direct.map.circle());
    let parameter = &scene.model.parameters[diagram.parameter].name;
    let mut active = local.parameters.iter();
    let place = active.position(|active| active.name == *parameter).unwrap_or(0);
    let pair = Pair { guarded: &guarded, direct: &direct, request };
    let mut found = pair.sweep(place, diagram.range, effort.values);
    found.name = format!("{} {parameter}", scene.identifier);
    Ok(found)
}

/// Guarded and direct maps of a scene.
struct Pair<'a> {
    guarded: &'a dyn SweptMap,
    direct: &'a dyn SweptMap,
    request: OrbitRequest,
}

impl Pair<'_> {
    fn sweep(&self, place: usize, [first, last]: [f64; 2], values: usize) -> Agreement {
        let steps = values.div_ceil(PARTS);
        let mut found = Agreement::default();
        let mut carried: [Vec<Option<Vec<f64>>>; 2] = [vec![None; PARTS], vec![None; PARTS]];
        let (mut mapped, mut made) = (0, 0);
        for step in 0..steps {
            let parameters = (0..PARTS).map(|part| {
                let share = (part * steps + step) as f64 / (PARTS * steps - 1) as f64;
                let mut parameters = vec![0.0; self.guarded.parameters()];
                parameters[place] = first + share * (last - first);
                parameters
            });
            let parameters: Vec<Vec<f64>> = parameters.collect();
            let settled = [self.guarded, self.direct].into_iter().zip(&mut carried);
            let mut settled = settled.map(|(map, carried)| {
                let starts = parameters.iter().zip(&*carried).map(|(own, state)| Start {
                    state: state.clone().unwrap_or_else(|| map.start(own)),
                    parameters: own.clone(),
                });
                let settled = map.settle(&starts.collect::<Vec<_>>(), &self.request, &|| ());
                for (carried, Settled { orbit, .. }) in carried.iter_mut().zip(&settled) {
                    let completed = orbit.end == OrbitEnd::Completed;
                    *carried = completed.then(|| orbit.last.clone());
                }
                settled
            });
            let (guarded, direct) = (settled.next(), settled.next());
            let pairs = guarded.into_iter().flatten().zip(direct.into_iter().flatten());
            for ((guarded, direct), own) in pairs.zip(&parameters) {
                mapped += guarded.orbit.steps.iter().filter(|step| !step.simulated).count();
                made += guarded.orbit.steps.len();
                self.judge([&guarded.orbit, &direct.orbit], own, place, &mut found);
            }
        }
        found.by_map = mapped as f64 / made.max(1) as f64;
        found
    }

    /// Counts a value as equal, or by the reason for its difference.
    fn judge(
        &self,
        orbits: [&MapOrbit; 2],
        parameters: &[f64],
        place: usize,
        found: &mut Agreement,
    ) {
        if let Some(alike) = self.alike(orbits, parameters) {
            return alike.count(found);
        }
        let again = |map: &dyn SweptMap, from: &MapOrbit| {
            let (state, parameters) = (from.last.clone(), parameters.to_vec());
            let transient = LONGER * self.request.transient;
            let request = OrbitRequest { transient, ..self.request.clone() };
            let mut settled = map.settle(&[Start { state, parameters }], &request, &|| ());
            settled.remove(0).orbit
        };
        let [guarded, direct] = orbits;
        let later = [again(self.guarded, guarded), again(self.direct, direct)];
        if self.alike([&later[0], &later[1]], parameters).is_some() {
            found.transient += 1;
            return;
        }
        let crossed = [again(self.guarded, &later[1]), again(self.direct, &later[0])];
        let kept = self.alike([&later[0], &crossed[1]], parameters).is_some()
            || self.alike([&crossed[0], &later[1]], parameters).is_some();
        if kept {
            found.coexisting += 1;
            return;
        }
        let words = |orbit: &MapOrbit| format!("{:?} {:?}", orbit.period, orbit.end);
        found.unexplained.push(format!(
            "at {:.6e}: guarded {}, direct {}",
            parameters[place],
            words(&later[0]),
            words(&later[1])
        ));
    }

    /// Whether two orbits, the guarded one first, are the same attractor.
    fn alike(&self, orbits: [&MapOrbit; 2], parameters: &[f64]) -> Option<Alike> {
        let [guarded, direct] = orbits;
        let ended = |orbit: &MapOrbit| orbit.end != OrbitEnd::Completed;
        if ended(guarded) || ended(direct) {
            return (ended(guarded) && ended(direct)).then_some(Alike::Same(0.0));
        }
        match (guarded.period, direct.period) {
            (Period::Periodic(period), Period::Periodic(other)) => {
                let name = |map: &dyn SweptMap, orbit: &MapOrbit| {
                    let hits = (0..period).map(|number| map.hits(orbit, number, parameters));
                    map.itinerary().name(hits, orbit.turns())
                };
                let same =
                    period == other && name(self.guarded, guarded) == name(self.direct, direct);
                let [apart, of_size] = self.apart(orbits);
                (same && (apart <= SAME || of_size <= SAME)).then_some(Alike::Same(apart))
            }
            (Period::NotFound, Period::NotFound) => {
                (self.apart(orbits)[1] <= ALIKE).then_some(Alike::Chaotic)
            }
            _ => None,
        }
    }

    /// Largest difference of the extents of two orbits: over the window, and over the larger of
    /// their own sizes and widths.
    fn apart(&self, orbits: [&MapOrbit; 2]) -> [f64; 2] {
        let [guarded, direct] = orbits.map(MapOrbit::extent);
        let pairs = guarded.iter().zip(&direct).zip(&self.request.scales);
        let apart = pairs.map(|((a, b), scale)| {
            let apart = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            let size = (a[1] - a[0]).max(b[1] - b[0]);
            let size = if size > 1e-6 * scale { size } else { a[1].abs().max(b[1].abs()) };
            [apart / scale, apart / size.max(f64::MIN_POSITIVE)]
        });
        apart.fold([0.0; 2], |most, now| [most[0].max(now[0]), most[1].max(now[1])])
    }
}

/// Kind of agreement of two orbits.
enum Alike {
    /// Period, itinerary and extent agree, with this difference over the window.
    Same(f64),
    /// Neither has a period.
    Chaotic,
}

impl Alike {
    fn count(self, found: &mut Agreement) {
        match self {
            Self::Same(apart) => {
                found.same += 1;
                found.difference = found.difference.max(apart);
            }
            Self::Chaotic => found.chaotic += 1,
        }
    }
}
