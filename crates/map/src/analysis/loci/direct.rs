//! Loci by direct simulation: the physical parts, followed as far as the orbits make their
//! contacts.
//!
//! One idea: on the tangency section of a graze the contact of a return is a coordinate of its
//! first point. A locus therefore reaches the graze of its orbits exactly, and a graze is that
//! coordinate at 0. Seeds are orbits that simulation settles on and orbits that begin at the graze;
//! the map is not needed.

use std::iter::once;

use nalgebra::{Complex, DMatrix, DVector};

use super::data::{LociRequest, Locus, LocusEnd, LocusKind, LocusPoint};
use super::equations::{CodimensionTwo, Condition, LocusEquations, OrbitEquations, Unfolding};
use super::trace::{
    ClosedOrbits, LocusPiece, LocusSeed, SAME, SearchedLocus, SeedLine, TracePoint, TracedLocus,
    condition_of, is_stable, through, through_seed,
};
use crate::analysis::branches::{
    BranchLabel, BranchPoint, BranchRequest, Extent, Follow, followed,
};
use crate::analysis::direct_image::DirectImage;
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::{DepthEvaluation, MapEvaluation};
use crate::analysis::periodic::{
    ContactItinerary, DirectOrbit, DirectOrbitEquations, DirectUnits, finite_or_one,
};
use crate::analysis::progress::{Progress, SubProgress, resumed};
use crate::analysis::work::{MOST_WORK, Unfinished};
use crate::continuation::{ContinuationEnd, Linearised, between, corrected, farthest, unit_vector};
use crate::expansion::LocalMap;
use crate::hybrid::HybridSystem;
use crate::iteration::{PassageSet, parallel};
use crate::model::Scene;
use crate::numeric::linear::{eigenvalues, inverse};
use crate::numeric::{Dd, Real, converted};
use crate::orbit::GrazingOrbit;

/// Most work for the loci of one kind and itinerary.
const LOCI_WORK: u64 = 10 * MOST_WORK;
/// Most work for solving for the orbits of one locus in double-double.
const EXACT_WORK: u64 = MOST_WORK;
/// Largest number of ordinary points of a locus that are solved for in double-double, and the
/// number kept even if they cost more than following the locus.
const POINTS: usize = 96;
const FEWEST: usize = 8;
/// Smallest depth variables, relative to the window's, of the map's orbits used as seeds.
const DEEP: f64 = 1e-2;
/// Largest variable of a passage that counts as next to a graze.
const NEAR: f64 = 1e-3;
/// Largest distance of a point in double-double from its first guess, in units.
const FAR: f64 = 1e-5;

impl<S: Real> OrbitEquations<S> for DirectOrbitEquations<'_, S> {
    fn first_point(&self, there: &Linearised<S, DirectOrbit<S>>) -> DMatrix<S> {
        self.first_point(&there.extra)
    }

    fn count(&self) -> usize {
        self.variables() + 2
    }

    /// Variables of the own passage of each return.
    fn depth_variables(&self) -> Vec<usize> {
        (0..self.variables()).filter(|&unknown| self.passage_of(unknown).is_some()).collect()
    }

    /// Returns none: grazes are borders of the range.
    fn grazes(&self, _: &[S], _: &DirectOrbit<S>) -> Vec<(Option<usize>, S)> {
        Vec::new()
    }

    fn without(
        &mut self,
        unknowns: &[S],
        _: &Linearised<S, DirectOrbit<S>>,
        contact: usize,
    ) -> Option<[DMatrix<S>; 2]> {
        let mut free = self.with_itinerary(&self.itinerary().without_contact(contact, 0));
        let there = free.orbit_at(unknowns);
        self.take_work(&free);
        let there = there?;
        let first = free.first_point(&there.extra);
        Some([there.jacobian, first])
    }

    fn unfolding(
        &mut self,
        unknowns: &[S],
        there: &Linearised<S, DirectOrbit<S>>,
    ) -> Option<Unfolding<S>> {
        let place = *self.depth_variables().first()?;
        let [jacobian, first] = self.without(unknowns, there, 0)?;
        let rows = self.variables();
        let [jacobian, first] = [jacobian, first].map(|part| part.columns(0, rows).into_owned());
        let to_variables = inverse(&first).ok()?;
        let depth = DVector::from_vec(unit_vector(rows, place));
        let with = &there.jacobian + self.first_point(&there.extra);
        Some(Unfolding {
            period: &to_variables * (jacobian + &first),
            kick: &to_variables * with.column(place),
            depth,
        })
    }

    fn rounding() -> f64 {
        Self::rounding()
    }
}

impl ClosedOrbits for DirectOrbitEquations<'_, f64> {
    fn begun_later(&mut self, unknowns: &[f64]) -> Vec<Vec<f64>> {
        let (size, itinerary) = (self.dimension(), self.itinerary());
        let later = (1..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
        let begun = later.map(|later| {
            let mut rotated = unknowns.to_vec();
            rotated[..self.variables()].rotate_left(later * size);
            rotated
        });
        begun.collect()
    }

    fn is_several(&mut self, unknowns: &[f64]) -> bool {
        self.itinerary().period() > 1 && {
            let there = self.orbit_at(&unknowns[..self.count()]);
            there.is_some_and(|there| self.is_repeated(&there.extra, SAME))
        }
    }
}

/// Direct simulation over a plane of parameters, in double precision and in double-double.
pub(super) struct DirectPlane<'a> {
    pub(super) rounded: DirectImage<'a, f64>,
    pub(super) exact: DirectImage<'a, Dd>,
    pub(super) units: DirectUnits,
    free: [(usize, [f64; 2]); 2],
    depths: DepthEvaluation<f64>,
    map: &'a LocalMap,
    at: &'a [f64],
}

impl<'a> DirectPlane<'a> {
    /// Both parameters vary within `free`; the others are fixed by the request.
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
        (request, free): (&'a LociRequest, [(usize, [f64; 2]); 2]),
    ) -> Result<Self, AnalysisError> {
        let rounded = DirectImage::new(system, scene, orbit)?;
        Ok(Self {
            units: DirectUnits::measured(scene, orbit, rounded.clone(), &free, &request.at)?,
            rounded,
            exact: DirectImage::new(system, scene, orbit)?,
            free,
            depths: MapEvaluation::depths(map),
            map,
            at: &request.at,
        })
    }

    /// Equations of an itinerary.
    pub(super) fn equations<S: Real>(
        &self,
        image: &DirectImage<'a, S>,
        itinerary: &ContactItinerary,
    ) -> DirectOrbitEquations<'a, S> {
        DirectOrbitEquations::new(image.clone(), itinerary, &self.units, &self.free, self.at)
    }

    /// Whether all section points lie in the window of the map.
    pub(super) fn holds(&self, states: &[Vec<f64>], parameters: &[f64]) -> bool {
        let window = &self.map.window;
        let depths = |state: &[f64]| self.depths.at(state, parameters);
        states.iter().all(|state| window.holds(state, parameters, &depths(state)))
    }
}

/// Loci of direct simulation.
pub(super) struct DirectLoci<'a> {
    scene: &'a Scene,
    orbit: &'a GrazingOrbit,
    map: &'a LocalMap,
    request: &'a LociRequest,
    plane: DirectPlane<'a>,
    progress: &'a dyn Progress,
    unfinished: Unfinished,
}

impl<'a> DirectLoci<'a> {
    pub(super) fn new(
        system: &'a HybridSystem,
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        map: &'a LocalMap,
        (request, progress): (&'a LociRequest, &'a dyn Progress),
    ) -> Result<Self, AnalysisError> {
        let widths = request.plane.map(|place| finite_or_one(map.window.parameter[place]));
        let plane = (request, request.free(widths));
        let plane = DirectPlane::new(system, scene, orbit, map, plane)?;
        Ok(Self { scene, orbit, map, request, plane, progress, unfinished: Unfinished::default() })
    }

    fn rounded(&self, itinerary: &ContactItinerary) -> DirectOrbitEquations<'a, f64> {
        self.plane.equations(&self.plane.rounded, itinerary)
    }

    fn exact(&self, itinerary: &ContactItinerary) -> DirectOrbitEquations<'a, Dd> {
        self.plane.equations(&self.plane.exact, itinerary)
    }

    /// All loci asked for, and the itineraries that were not followed completely. Loci of the map
    /// provide further seeds.
    pub(super) fn all(
        &self,
        by_map: &[Locus],
    ) -> Result<(Vec<Locus>, Vec<ContactItinerary>), AnalysisError> {
        let progress = self.progress;
        // NOTE: the first range in the order in which it is asked for.
        let lines = SeedLine::of_plane([self.request.range, self.plane.free[1].1]);
        progress.expect(lines.len() as u64 + 1);
        let grazes: Vec<TracedLocus> = self.graze().into_iter().collect();
        progress.advance(1);
        let found = parallel::try_map(lines.iter().enumerate(), |(number, &line)| {
            let seeds = self.seeds_along(&grazes, line, number);
            progress.advance(1);
            seeds
        });
        let mut seeds = self.seeds_at_conditions(&grazes);
        seeds.extend(found?.into_iter().flatten());
        seeds.extend(by_map.iter().flat_map(|locus| self.seeds_of(locus)));
        seeds.retain(|seed| self.request.kinds.contains(&seed.kind));
        // Seeds of one locus share kind and itinerary.
        let mut groups: Vec<Vec<LocusSeed>> = Vec::new();
        for seed in seeds {
            let same = |group: &&mut Vec<LocusSeed>| {
                group[0].kind == seed.kind && group[0].itinerary == seed.itinerary
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.push(seed),
                None => groups.push(vec![seed]),
            }
        }
        groups.sort_by_key(|group| group[0].kind as usize);
        let mut traces = parallel::map(&groups, |group| self.traces(group, Vec::new()));
        if self.request.kinds.contains(&LocusKind::Torus) {
            let double = traces.iter().flatten().flat_map(TracedLocus::double_multipliers);
            let double: Vec<LocusSeed> = double.collect();
            let is_torus = |trace: &TracedLocus| trace.kind == LocusKind::Torus;
            let (known, others) = traces.into_iter().flatten().partition(is_torus);
            traces = vec![others, self.traces(&double, known)];
        }
        let asked = self.request.kinds.contains(&LocusKind::Graze);
        let mut all: Vec<TracedLocus> = grazes.into_iter().filter(|_| asked).collect();
        all.extend(traces.into_iter().flatten());
        progress.expect(all.len() as u64);
        let all = all.iter().enumerate().filter_map(|(number, trace)| {
            let place = [LocusPiece::Locus as u64, number as u64];
            let locus = resumed(progress, &place, || self.described(trace));
            progress.advance(1);
            locus
        });
        Ok((all.collect(), self.unfinished.listed()))
    }

    /// Locus of grazes of the orbit without contact; `None` if returns have no passage of their
    /// own.
    fn graze(&self) -> Option<TracedLocus> {
        self.plane.units.gap?;
        let itinerary = self.one_contact();
        let unknowns = vec![0.0; self.rounded(&itinerary).count()];
        self.traces(&[LocusSeed { kind: LocusKind::Graze, itinerary, unknowns }], Vec::new()).pop()
    }

    /// Itinerary of one return with the contact of its own passage.
    fn one_contact(&self) -> ContactItinerary {
        let made: PassageSet = [0].into_iter().collect();
        ContactItinerary::new(self.map.passages(), vec![made])
    }

    /// Seeds of folds and flips of orbits with one contact, at the points `ξ_n = 0` on the graze of
    /// the orbit without contact.
    fn seeds_at_conditions(&self, grazes: &[TracedLocus]) -> Vec<LocusSeed> {
        let own = self.one_contact();
        let mut seeds = Vec::new();
        for itinerary in &self.request.itineraries {
            if itinerary.contacts() != 1 || itinerary.returns()[0] != own.returns()[0] {
                continue;
            }
            let label = Some(CodimensionTwo::Xi(itinerary.period()));
            let points = grazes.iter().flat_map(|graze| &graze.points);
            for point in points.filter(|point| point.label == label) {
                let (state, parameters) = point.unknowns.split_at(point.unknowns.len() - 2);
                let mut unknowns = state.repeat(itinerary.period());
                unknowns.extend(parameters);
                seeds.extend([LocusKind::Fold, LocusKind::Flip].map(|kind| LocusSeed {
                    kind,
                    itinerary: itinerary.clone(),
                    unknowns: unknowns.clone(),
                }));
            }
        }
        seeds
    }

    /// Seeds at the special points of the branches along line `number` of the plane.
    fn seeds_along(
        &self,
        grazes: &[TracedLocus],
        line: SeedLine,
        number: usize,
    ) -> Result<Vec<LocusSeed>, AnalysisError> {
        let [held, along] = [line.held, 1 - line.held].map(|place| self.request.plane[place]);
        let mut at = self.request.at.clone();
        at[held] = line.value;
        at[along] = 0.0;
        let asked = &self.request.itineraries;
        let request = BranchRequest {
            itineraries: asked.clone(),
            longest: asked.iter().map(ContactItinerary::period).max().unwrap_or(1),
            along,
            range: self.plane.free[1 - line.held].1,
            at,
            direct: true,
            starts: Vec::new(),
        };
        let extent = Extent {
            graze: grazes.iter().find_map(|graze| self.graze_at(graze, line)),
            ..Extent::to(Follow::All)
        };
        let (scene, orbit, map) = (self.scene, self.orbit, self.map);
        let part = SubProgress::new(self.progress, LocusPiece::Seeds as usize);
        let part = SubProgress::new(&part, number);
        let found = followed(scene, orbit, map, &request, extent, &part)?;
        self.unfinished.extend(&found.unfinished);
        let points = found.branches.iter().flat_map(|branch| &branch.points);
        Ok(points.filter_map(|point| self.seed(point)).collect())
    }

    /// Point at which a locus of grazes crosses a line of the plane: section point and the
    /// parameter along the line, in offsets.
    fn graze_at(&self, graze: &TracedLocus, line: SeedLine) -> Option<(Vec<f64>, f64)> {
        let SeedLine { held, value } = line;
        let mut equations = self.rounded(&graze.itinerary);
        let place = equations.variables() + held;
        let wanted = value / self.plane.units.parameters[held];
        let pair = graze.points.windows(2).find(|pair| {
            let [a, b] = [&pair[0], &pair[1]].map(|point| point.unknowns[place] - wanted);
            a * b <= 0.0 && a != b
        })?;
        let [a, b] = [&pair[0].unknowns, &pair[1].unknowns];
        let share = (wanted - a[place]) / (b[place] - a[place]);
        let guess = between(a, b, share);
        let normal = unit_vector(guess.len(), place);
        let mut locus = LocusEquations::new(equations.clone(), Condition::Graze(0), 0);
        let (found, _) = corrected(&mut locus, &guess, &guess, &normal)?;
        let there = equations.orbit_at(&found)?;
        let state = there.extra.states.into_iter().next()?;
        Some((state, equations.parameters(&found)[self.request.plane[1 - held]]))
    }

    /// Seed at a special point of a branch.
    fn seed(&self, point: &BranchPoint) -> Option<LocusSeed> {
        let (special, orbit) = (point.special.as_ref()?, &point.orbit);
        // Loci are followed with the section points of all returns.
        if orbit.states.len() < orbit.itinerary.period() {
            return None;
        }
        let asked = |itinerary: &ContactItinerary| {
            let mut known = self.request.itineraries.iter();
            known.any(|known| known.rotation_to(itinerary).is_some())
        };
        let mut itinerary = orbit.itinerary.clone();
        let mut states = orbit.states.clone();
        let mut is_asked = asked(&itinerary);
        let (kind, angle) = match special.label {
            BranchLabel::SaddleNode => (LocusKind::Fold, None),
            BranchLabel::PeriodDoubling => (LocusKind::Flip, None),
            BranchLabel::NeimarkSacker => (LocusKind::Torus, Some(angle(&orbit.multipliers)?)),
            BranchLabel::Graze => {
                let [[number, 0]] = special.grazing[..] else { return None };
                itinerary = itinerary.with_contact(number, 0).begun_at(number);
                states.rotate_left(number);
                is_asked |= asked(&itinerary);
                // The graze of the orbit without contact is known.
                (itinerary.contacts() > 1).then_some((LocusKind::Graze, None))?
            }
            BranchLabel::BranchPoint | BranchLabel::Hopf => return None,
        };
        for state in &mut states {
            self.plane.rounded.circle().reduce(state);
        }
        let mut unknowns = self.rounded(&itinerary).unknowns(&states, &orbit.parameters)?;
        unknowns.extend(angle);
        is_asked.then_some(LocusSeed { kind, itinerary, unknowns })
    }

    /// Seeds from the map's locus: one orbit of each physical part, away from the graze.
    fn seeds_of(&self, locus: &Locus) -> Vec<LocusSeed> {
        let mut itinerary = locus.itinerary.clone();
        if let Some([number, passage]) = locus.grazing {
            itinerary = itinerary.with_contact(number, passage);
            // The graze of another passage is no coordinate of the section.
            if passage != 0 || itinerary.contacts() < 2 {
                return Vec::new();
            }
        }
        let least = DEEP * finite_or_one(self.map.window.depth.sqrt());
        let equations = self.rounded(&itinerary);
        let stretches = locus.points.chunk_by(|a, b| a.physical == b.physical);
        let physical = stretches.filter(|stretch| stretch[0].physical);
        let seeds = physical.filter_map(|stretch| {
            let deep = |point: &&LocusPoint| {
                let depths = point.depth_variables.iter();
                depths.filter(|&&y| y < least).count() <= usize::from(locus.grazing.is_some())
            };
            let deep: Vec<&LocusPoint> = stretch.iter().filter(deep).collect();
            let point = deep.get(deep.len() / 2)?;
            let mut unknowns = equations.clone().unknowns(&point.states, &point.parameters)?;
            if locus.kind == LocusKind::Torus {
                unknowns.push(angle(&point.multipliers)?);
            }
            Some(LocusSeed { kind: locus.kind, itinerary: itinerary.clone(), unknowns })
        });
        seeds.collect()
    }

    /// Loci through seeds, added to those known.
    fn traces(&self, seeds: &[LocusSeed], mut traces: Vec<TracedLocus>) -> Vec<TracedLocus> {
        self.progress.expect(seeds.len() as u64);
        let mut left = LOCI_WORK;
        for seed in seeds {
            if left == 0 {
                break;
            }
            let follow = || self.searched(seed, &traces, left);
            let (found, work) = through_seed(self.progress, (traces.len(), left), seed, follow);
            left = left.saturating_sub(work);
            traces.extend(found);
            self.progress.advance(1);
        }
        if left == 0 {
            self.unfinished.extend(seeds.iter().map(|seed| &seed.itinerary));
        }
        traces
    }

    /// Locus through a seed, unless it is known, with at most `most` work.
    fn searched(&self, seed: &LocusSeed, known: &[TracedLocus], most: u64) -> SearchedLocus {
        let mut orbits = self.rounded(&seed.itinerary);
        orbits.limit_work(most);
        let condition = condition_of(seed.kind);
        let conditions = self.request.conditions(seed.kind, &seed.itinerary);
        let mut locus = LocusEquations::new(orbits, condition, conditions);
        let found = self.trace(seed, known, &mut locus);
        (found, locus.orbits.work())
    }

    fn trace(
        &self,
        seed: &LocusSeed,
        known: &[TracedLocus],
        locus: &mut LocusEquations<DirectOrbitEquations<'a, f64>, f64>,
    ) -> Option<TracedLocus> {
        let LocusSeed { kind, itinerary, .. } = seed;
        let own = locus.orbits.depth_variables();
        let exact = self.exact(itinerary);
        let mut fine = LocusEquations::new(exact, locus.condition, locus.conditions);
        let (mut points, ends) = through(seed, known, locus, &mut fine, 0)?;
        // A locus without orbits beside its first is physical on neither side.
        let first = &points.first()?.unknowns;
        if points.iter().all(|point| farthest(&point.unknowns, first) < SAME) {
            return None;
        }
        // At a graze multipliers are undefined, so that double ones are dropped.
        use CodimensionTwo as C;
        for point in &mut points {
            let double = matches!(point.label, Some(C::Cusp | C::R1 | C::R2));
            if double && own.iter().any(|&place| point.unknowns[place].abs() < SAME) {
                point.label = None;
            }
        }
        let mut found = [LocusEnd::Lost; 2];
        for (number, end) in ends.into_iter().enumerate() {
            let place = if number == 0 { 0 } else { points.len() - 1 };
            let size = |unknown: usize| points[place].unknowns[unknown].abs();
            let nearest = own.iter().copied().min_by(|&a, &b| size(a).total_cmp(&size(b)));
            let unknown = match end {
                ContinuationEnd::Border { unknown } => own.contains(&unknown).then_some(unknown),
                // In double precision the last orbits before a graze may not be found.
                _ => nearest.filter(|&unknown| size(unknown) < NEAR),
            };
            let Some(unknown) = unknown else {
                found[number] = LocusEnd::of(end);
                continue;
            };
            found[number] = LocusEnd::Graze;
            if let Some(there) = grazing(&points[place], unknown, &own, &mut fine) {
                let there = TracePoint { label: Some(at_graze(*kind)), ..there };
                points.insert(if number == 0 { 0 } else { points.len() }, there);
            }
        }
        let ends = found;
        Some(TracedLocus { kind: *kind, itinerary: itinerary.clone(), points, ends })
    }

    /// The locus with orbits solved for in double-double; orbits that fail are left out.
    fn described(&self, trace: &TracedLocus) -> Option<Locus> {
        let typical = trace.points.iter().find(|point| point.label.is_none());
        let (_, work) = self.point(trace, typical.or(trace.points.first())?);
        let most = (EXACT_WORK / work.max(1)).clamp(FEWEST as u64, POINTS as u64) as usize;
        let apart = trace.points.len().div_ceil(most).max(1);
        let last = trace.points.len() - 1;
        let kept =
            trace.points.iter().enumerate().filter(|(place, point)| {
                place % apart == 0 || *place == last || point.label.is_some()
            });
        let kept: Vec<&TracePoint> = kept.map(|(_, point)| point).collect();
        let points = parallel::map(kept, |point| self.point(trace, point).0);
        let points: Vec<LocusPoint> = points.into_iter().flatten().collect();
        (!points.is_empty()).then(|| trace.described(points, 0))
    }

    /// A point of a locus, and the work it took.
    fn point(&self, trace: &TracedLocus, point: &TracePoint) -> (Option<LocusPoint>, u64) {
        let condition = condition_of(trace.kind);
        let mut locus = LocusEquations::new(self.exact(&trace.itinerary), condition, 0);
        let found = self.solved_point(trace, point, &mut locus);
        (found, locus.orbits.work())
    }

    fn solved_point(
        &self,
        trace: &TracedLocus,
        point: &TracePoint,
        locus: &mut LocusEquations<DirectOrbitEquations<'a, Dd>, Dd>,
    ) -> Option<LocusPoint> {
        let at: Vec<Dd> = converted(&point.unknowns);
        let found = match point.label {
            // Labelled points are solved for already.
            Some(_) => at,
            None => {
                let (found, _) = corrected(locus, &at, &at, &converted::<_, Dd>(&point.tangent))?;
                (farthest(&found, &at) < FAR).then_some(found)?
            }
        };
        let orbits = &mut locus.orbits;
        let found = &found[..orbits.variables() + 2];
        let orbit = orbits.orbit_at(found)?.extra;
        let speeds = orbit.speeds.iter();
        let (jacobian, speeds) = match trace.kind {
            LocusKind::Graze => {
                let mut free = orbits.with_itinerary(&trace.itinerary.without_contact(0, 0));
                let there = free.orbit_at(found)?.extra;
                let others = speeds.filter(|(n, passage, _)| (*n, *passage) != (0, 0));
                let others = others.map(|(_, _, speed)| speed.to_f64());
                (free.jacobian(&there), once(0.0).chain(others).collect())
            }
            _ => (orbits.jacobian(&orbit), speeds.map(|(_, _, speed)| speed.to_f64()).collect()),
        };
        let at_graze = point.label.is_some() && trace.kind != LocusKind::Graze;
        let multipliers = match jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok()) {
            Some(multipliers) => multipliers,
            None if at_graze => Vec::new(),
            None => return None,
        };
        let parameters = converted(&orbits.parameters(found));
        let states: Vec<Vec<f64>> = orbit.states.iter().map(|state| converted(state)).collect();
        let inside = self.plane.holds(&states, &parameters);
        Some(LocusPoint {
            parameters,
            states,
            depth_variables: speeds,
            stable: is_stable(trace.kind, &multipliers, point.unknowns.last().copied()),
            multipliers: multipliers.iter().map(|value| [value.re, value.im]).collect(),
            physical: orbit.extra_contacts == 0,
            inside,
            label: point.label,
        })
    }
}

/// Kind of codimension-two point at which a locus ends at a graze.
fn at_graze(kind: LocusKind) -> CodimensionTwo {
    match kind {
        LocusKind::Graze | LocusKind::Crisis => CodimensionTwo::DoubleGraze,
        LocusKind::Fold => CodimensionTwo::FoldGraze,
        LocusKind::Flip => CodimensionTwo::FlipGraze,
        LocusKind::Torus => CodimensionTwo::TorusGraze,
    }
}

/// Orbit of a locus at which a variable of a passage is 0, solved for in double-double from a
/// nearby one; `None` if the variable of another passage is negative there.
fn grazing<O: OrbitEquations<Dd>>(
    near: &TracePoint,
    unknown: usize,
    own: &[usize],
    fine: &mut LocusEquations<O, Dd>,
) -> Option<TracePoint> {
    let mut at: Vec<Dd> = converted(&near.unknowns);
    at[unknown] = Dd::ZERO;
    let (found, _) = corrected(fine, &at, &at, &unit_vector(at.len(), unknown))?;
    let unknowns = converted(&found);
    let is_orbit = own.iter().all(|&place| unknowns[place] > -SAME);
    let is_near = farthest(&unknowns, &near.unknowns) < 10.0 * NEAR;
    (is_orbit && is_near).then(|| TracePoint { unknowns, ..near.clone() })
}

/// Angle of the pair of multipliers nearest to the unit circle.
fn angle(multipliers: &[[f64; 2]]) -> Option<f64> {
    let pairs = multipliers.iter().map(|[re, im]| Complex::new(*re, *im));
    let pairs = pairs.filter(|value| value.im > 0.0);
    let apart = |value: &Complex<f64>| (value.norm() - 1.0).abs();
    pairs.min_by(|a, b| apart(a).total_cmp(&apart(b))).map(|value| value.arg())
}
