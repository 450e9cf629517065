//! One sweep: parameter values in order, with the last state carried from value to value.
//!
//! A carried state makes a sweep sequential. A sweep is therefore cut into segments, which run in
//! parallel: a coarse run, with few values and few iterates at each, guesses the state carried into
//! every segment. The starts are then corrected: from the true last state of the segment before,
//! the values of a segment are visited again until the map settles on the attractor already found
//! there. A change that reaches a segment's end is carried into the next segment. The cuts depend
//! on the number of values alone, so that results do not depend on the number of cores.

use std::ops::Range;
use std::time::Instant;

use super::data::{DiagramPoint, Shares, Sweep, SweepHeading, Timing};
use super::sweep::{Reach, SweepRequest, Visit, starts, visit};
use super::swept_map::SweptMap;
use crate::analysis::progress::{
    MOST_ITERATES, NoProgress, PartProgress, Progress, Shard, keep, recalled,
};
use crate::iteration::parallel;
use crate::iteration::{MapOrbit, OrbitEnd, OrbitRequest};

/// Fewest values of a segment.
const SHORTEST: usize = 8;
/// Values of each segment in the coarse run.
const COARSE_VALUES: usize = 4;
/// Iterates at each value in the coarse run.
const COARSE_ITERATES: usize = 16;

/// Runs one sweep, from a state or from beside the map's start at the first parameter value.
pub(super) fn sweep(
    map: &dyn SweptMap,
    request: &SweepRequest,
    start: Option<&[f64]>,
    heading: SweepHeading,
    progress: &dyn Progress,
) -> Sweep {
    let clock = Instant::now();
    let mut sweep_run = SweepRun::new(map, request, start, heading);
    sweep_run.run(0..sweep_run.segments.len(), progress);
    sweep_run.correct(0..sweep_run.segments.len(), progress);
    let timing = Timing::since(clock, sweep_run.iterates);
    let visits = sweep_run.visits.into_iter().flatten();
    let points: Vec<DiagramPoint> = visits.map(|visit| visit.point).collect();
    let shares = |point: &DiagramPoint| {
        let DiagramPoint { by_map, outside, .. } = *point;
        (Shares { by_map, outside }, point.kept)
    };
    let Shares { by_map, outside } = Shares::mean(points.iter().map(shares));
    let start = start.map(<[f64]>::to_vec);
    Sweep { method: map.method(), heading, start, points, by_map, outside, timing }
}

/// Computes a share of a sweep: some segments, and their corrections as far as these segments
/// determine them.
pub(super) fn sweep_share(
    map: &dyn SweptMap,
    request: &SweepRequest,
    start: Option<&[f64]>,
    heading: SweepHeading,
    shard: &Shard<'_>,
) {
    let mut sweep_run = SweepRun::new(map, request, start, heading);
    let segments = shard.share.range(sweep_run.segments.len());
    if !segments.is_empty() {
        sweep_run.run(segments.clone(), shard);
        sweep_run.correct(segments, shard);
    }
}

/// A sweep under way.
struct SweepRun<'a> {
    map: &'a dyn SweptMap,
    request: &'a SweepRequest,
    start: Option<&'a [f64]>,
    offsets: Vec<f64>,
    segments: Vec<Range<usize>>,
    /// Visits of all values, in order.
    visits: Vec<Option<Visit>>,
    iterates: u64,
}

/// Position of the visits in a segment.
#[derive(Clone)]
struct Front {
    segment: usize,
    /// Index of the next value to visit.
    value: usize,
    /// State carried to that value.
    carried: Option<Vec<f64>>,
    /// Whether that state is a guess that no orbit has confirmed.
    guessed: bool,
}

/// Visits of a group of fronts.
#[derive(Default)]
struct GroupVisits {
    /// Visits with the index of the value.
    visits: Vec<(usize, Visit)>,
    /// Segments whose last value was visited.
    changed: Vec<usize>,
    iterates: u64,
}

/// Kept visits of one round of fronts, which pass every value at most once.
struct KeptVisits<'a> {
    /// 0 for guessed starts, then the number of the correction.
    round: usize,
    /// Length of a state.
    dimension: usize,
    /// Largest number of values at a point.
    keep: usize,
    progress: &'a dyn Progress,
}

impl KeptVisits<'_> {
    fn place(&self, value: usize) -> [u64; 2] {
        [self.round as u64, value as u64]
    }

    /// Visit of a value in an earlier run.
    fn recall(&self, value: usize) -> Option<Visit> {
        recalled(self.progress, &self.place(value), |visit: &Visit| {
            let DiagramPoint { kept, values, .. } = &visit.point;
            let carried = visit.carried.as_ref();
            visit.iterates < MOST_ITERATES
                && *kept <= self.keep
                && values.len() <= *kept
                && carried.is_none_or(|state| state.len() == self.dimension)
        })
    }

    fn keep(&self, value: usize, visit: &Visit) {
        keep(self.progress, &self.place(value), visit);
    }

    /// Progress of some visits; corrections are not part of the announced work.
    fn part(&self, visits: usize) -> PartProgress<'_> {
        match self.round {
            0 => PartProgress::new(self.progress, visits),
            _ => PartProgress::new(&NoProgress, 0),
        }
    }
}

impl<'a> SweepRun<'a> {
    fn new(
        map: &'a dyn SweptMap,
        request: &'a SweepRequest,
        start: Option<&'a [f64]>,
        heading: SweepHeading,
    ) -> Self {
        let offsets = request.offsets(heading);
        let count = map.segments().min(offsets.len() / SHORTEST).max(1);
        let cut = |number: usize| number * offsets.len() / count;
        let segments = (0..count).map(|number| cut(number)..cut(number + 1));
        Self {
            map,
            request,
            start,
            segments: segments.collect(),
            visits: vec![None; offsets.len()],
            offsets,
            iterates: 0,
        }
    }

    /// Runs some segments in parallel, from the states of the coarse run.
    fn run(&mut self, segments: Range<usize>, progress: &dyn Progress) {
        let starts = self.coarse_run();
        let fronts = starts.into_iter().zip(&self.segments).enumerate();
        let fronts = fronts.take(segments.end).skip(segments.start);
        let fronts = fronts.map(|(segment, (carried, values))| Front {
            segment,
            value: values.start,
            carried,
            guessed: true,
        });
        let pieces = self.kept_visits(progress);
        self.advance(&fronts.collect::<Vec<_>>(), &pieces);
    }

    /// Visits that an earlier run kept, of the first round.
    fn kept_visits<'p>(&self, progress: &'p dyn Progress) -> KeptVisits<'p> {
        let OrbitRequest { scales, keep, .. } = &self.request.orbit;
        KeptVisits { round: 0, dimension: scales.len(), keep: *keep, progress }
    }

    /// Carries the last state of every segment into the next until nothing changes; for a share of
    /// the segments, as far as the result does not depend on earlier segments.
    fn correct(&mut self, segments: Range<usize>, progress: &dyn Progress) {
        let mut changed: Vec<usize> = segments.clone().skip(1).collect();
        let mut pieces = self.kept_visits(progress);
        while !changed.is_empty() {
            pieces.round += 1;
            let corrected = changed.iter().map(|&segment| self.corrected(segment));
            changed = self.advance(&corrected.collect::<Vec<_>>(), &pieces);
            changed.iter_mut().for_each(|segment| *segment += 1);
            // In a share that starts later, each round leaves one more segment open, which depends
            // on earlier shares.
            let open = if segments.start == 0 { 0 } else { segments.start + pieces.round };
            changed.retain(|segment| (open + 1..segments.end).contains(segment));
        }
    }

    /// Front at the start of a segment, with the state carried from the end of the segment before.
    fn corrected(&self, segment: usize) -> Front {
        let value = self.segments[segment].start;
        let before = self.visits[value - 1].as_ref();
        let carried = before.and_then(|visit| visit.carried.clone());
        Front { segment, value, carried, guessed: false }
    }

    /// Moves fronts to the ends of their segments or to where nothing changes, as many at a time as
    /// the map has lanes, on all cores; returns the segments whose ends changed.
    fn advance(&mut self, fronts: &[Front], pieces: &KeptVisits<'_>) -> Vec<usize> {
        let share = fronts.len().div_ceil(parallel::threads());
        let blocks = fronts.chunks(share.clamp(1, self.map.lanes()));
        let found = parallel::map(blocks, |block| self.follow(block.to_vec(), pieces));
        let mut changed = Vec::new();
        for found in found {
            changed.extend(found.changed);
            self.iterates += found.iterates;
            for (value, visit) in found.visits {
                self.visits[value] = Some(visit);
            }
        }
        changed
    }

    /// Visits of some fronts, in step, after those that an earlier run kept.
    fn follow(&self, mut fronts: Vec<Front>, pieces: &KeptVisits<'_>) -> GroupVisits {
        let mut found = GroupVisits::default();
        fronts.retain_mut(|front| {
            let mut continues = true;
            while continues && let Some(visit) = pieces.recall(front.value) {
                drop(pieces.part(1));
                continues = self.keep(front, visit, &mut found);
            }
            continues
        });
        while !fronts.is_empty() {
            let value = |front: &Front| (front.carried.clone(), self.offsets[front.value]);
            let values = fronts.iter().map(value).collect();
            let part = pieces.part(fronts.len());
            part.expect((self.request.orbit.transient + self.request.orbit.keep) as u64);
            let visits = visit(self.map, self.request, self.start, values, &|| part.advance(1));
            drop(part);
            let mut visits = visits.into_iter();
            fronts.retain_mut(|front| {
                visits.next().is_some_and(|visit| {
                    pieces.keep(front.value, &visit);
                    self.keep(front, visit, &mut found)
                })
            });
        }
        found
    }

    /// Keeps a visit if it changes anything; returns whether the front continues.
    fn keep(&self, front: &mut Front, mut visit: Visit, found: &mut GroupVisits) -> bool {
        found.iterates += visit.iterates;
        // A guess that escaped is not carried on.
        visit.carried = visit.carried.filter(|_| !front.guessed || visit.attractor.completed);
        front.guessed = false;
        let known = self.visits[front.value].as_ref();
        if known.is_some_and(|known| known.agrees(&visit)) {
            return false;
        }
        front.carried.clone_from(&visit.carried);
        found.visits.push((front.value, visit));
        front.value += 1;
        let continues = front.value < self.segments[front.segment].end;
        if !continues {
            found.changed.push(front.segment);
        }
        continues
    }

    /// Approximate states carried into the segments.
    fn coarse_run(&self) -> Vec<Option<Vec<f64>>> {
        let request =
            OrbitRequest { transient: COARSE_ITERATES, keep: 0, ..self.request.orbit.clone() };
        let stops = self.coarse_values();
        // Maps at fixed values are prepared on all cores.
        let prepare = |&stop: &usize| {
            let parameters = self.request.parameters(self.map, self.offsets[stop]);
            (self.map.at(&parameters), parameters)
        };
        let prepared = parallel::map(&stops, prepare);
        let mut carried: Option<Vec<f64>> = None;
        let mut entered = vec![None];
        for segment in prepared.chunks(COARSE_VALUES) {
            for (fixed, parameters) in segment {
                let begin = || {
                    starts(self.map, self.start, parameters, &request.scales, Reach::Beside)
                        .remove(0)
                };
                let state = carried.clone().unwrap_or_else(begin);
                let orbit = MapOrbit::of(&**fixed, &state, &[], &request);
                if orbit.end == OrbitEnd::Completed {
                    carried = Some(orbit.last);
                }
            }
            entered.push(carried.clone());
        }
        entered
    }

    /// Indices of the values that the coarse run visits: in every segment but the last.
    fn coarse_values(&self) -> Vec<usize> {
        let segments = self.segments.split_last().map_or(&[][..], |(_, rest)| rest);
        let stops = |segment: &Range<usize>| {
            let (start, len) = (segment.start, segment.len());
            (0..COARSE_VALUES).map(move |stop| start + stop * len / COARSE_VALUES)
        };
        segments.iter().flat_map(stops).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::diagram::swept_map::{Settled, Start};
    use crate::expansion::MapWindow;
    use crate::iteration::{DiscreteMap, Itinerary, StepInfo};
    use crate::model::{Method, even_offsets};

    /// `x ↦ x + (p + x − x³)/10`: two stable fixed points between the folds at `p = ±2/√27`.
    struct Hysteresis;

    impl DiscreteMap for Hysteresis {
        fn dimension(&self) -> usize {
            1
        }
        fn parameters(&self) -> usize {
            1
        }
        fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
            let x = state[0];
            image[0] = x + 0.1 * (parameters[0] + x - x * x * x);
            StepInfo::default().checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            jacobian[0] = 1.1 - 0.3 * state[0] * state[0];
            self.step(state, parameters, image)
        }
    }

    /// Sweeps `Hysteresis`, with a coarse run that is right or always ends on the wrong side.
    struct Swept {
        misled: bool,
        itinerary: Itinerary,
    }

    /// The map at a parameter value, or one that sends every state to the upper side.
    struct At {
        parameter: f64,
        misled: bool,
    }

    impl DiscreteMap for At {
        fn dimension(&self) -> usize {
            1
        }
        fn parameters(&self) -> usize {
            0
        }
        fn step(&self, state: &[f64], _: &[f64], image: &mut [f64]) -> StepInfo {
            let info = Hysteresis.step(state, &[self.parameter], image);
            if self.misled {
                image[0] = 2.0;
            }
            info
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            _: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            Hysteresis.step_jacobian(state, &[self.parameter], image, jacobian)
        }
    }

    impl SweptMap for Swept {
        fn method(&self) -> Method {
            Method::Map
        }
        fn parameters(&self) -> usize {
            1
        }
        fn segments(&self) -> usize {
            16
        }
        fn at(&self, parameters: &[f64]) -> Box<dyn DiscreteMap + Send + '_> {
            Box::new(At { parameter: parameters[0], misled: self.misled })
        }
        fn settle(&self, starts: &[Start], request: &OrbitRequest, _: &dyn Fn()) -> Vec<Settled> {
            let settle = |start: &Start| Settled {
                orbit: MapOrbit::of(&Hysteresis, &start.state, &start.parameters, request),
                lyapunov: None,
            };
            starts.iter().map(settle).collect()
        }
        fn start(&self, _: &[f64]) -> Vec<f64> {
            vec![0.0]
        }
        fn observe_all(&self, orbit: &MapOrbit, _: &[f64]) -> Vec<f64> {
            orbit.states().map(|state| state[0]).collect()
        }
        fn itinerary(&self) -> &Itinerary {
            &self.itinerary
        }
        fn has_jacobian(&self) -> bool {
            false
        }
    }

    /// Offsets at which a sweep jumps from one side to the other.
    fn jumps(misled: bool, heading: SweepHeading) -> Vec<f64> {
        let map = Swept {
            misled,
            itinerary: Itinerary {
                surfaces: vec!["wall".to_owned()],
                passages: vec![0],
                nominal_hits: vec![0],
                periods: 1,
            },
        };
        let request = SweepRequest {
            parameter: 0,
            offsets: even_offsets([-0.6, 0.6], 241),
            starts: Vec::new(),
            orbit: OrbitRequest::new(400, 4, &[1.0]),
            window: MapWindow { depth: 1.0, state: vec![9.0], parameter: vec![9.0] },
        };
        let sweep = sweep(&map, &request, None, heading, &NoProgress);
        let points = &sweep.points;
        let pairs = points.windows(2);
        let value = |point: &DiagramPoint| point.kept_values().last().unwrap_or(f64::NAN);
        let jump = |pair: &&[DiagramPoint]| value(&pair[0]) * value(&pair[1]) < 0.0;
        pairs.filter(jump).map(|pair| pair[1].offset).collect()
    }

    #[test]
    fn a_sweep_stays_on_its_branch_up_to_the_fold_whatever_its_segments_started_with() {
        let fold = 2.0 / 27f64.sqrt();
        for misled in [false, true] {
            let up = jumps(misled, SweepHeading::Up);
            assert_eq!(up.len(), 1, "{up:?}");
            assert!((0.0..0.02).contains(&(up[0] - fold)), "{up:?}");
            let down = jumps(misled, SweepHeading::Down);
            assert_eq!(down.len(), 1, "{down:?}");
            assert!((-0.02..0.0).contains(&(down[0] + fold)), "{down:?}");
        }
    }
}
