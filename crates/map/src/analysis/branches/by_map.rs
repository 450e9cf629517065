//! Branches of the orbits of a local map.

use std::iter::once;

use super::data::{Branch, BranchEnd, BranchLabel, BranchPoint, BranchRequest, Branches, Special};
use super::normal_form::NormalForm;
use super::trace::{
    BranchSeed, BranchSource, Follow, NEAR, SAME, SearchedBranch, SeedKind, TracedBranch,
    each_once, exact_or_zero, first_doubled, halved, label_of, lies_on, null_vector, refined,
    solved, toggled,
};
use crate::analysis::error::AnalysisError;
use crate::analysis::evaluation::MapEvaluation;
use crate::analysis::periodic::{
    ByMap, ContactItinerary, FoundOrbit, ItinerarySearch, MapOrbitEquations, OrbitContact,
    PassagesOfOrbit, SettledCycle, TestKind, finite_or_one, window_scales,
};
use crate::analysis::progress::Progress;
use crate::continuation::{
    ContinuationPoint, CurveEquations, Solution, StepControl, tangent_at, unit_vector,
};
use crate::expansion::LocalMap;
use crate::iteration::{PassageSet, PhaseCircle, parallel};
use crate::model::Scene;
use crate::numeric::linear::eigenvalues;
use crate::numeric::{Real, converted};
use crate::orbit::GrazingOrbit;

/// Largest coordinates and depth variables along branches: in half-widths of the window, and in the
/// depth variable of the window's edge.
const REACH: f64 = 10.0;
const DEEPEST: f64 = 2.0;
/// Parameter values at which orbits are looked for, as shares of the range on each side of the
/// graze.
const SHARES: [f64; 4] = [0.02, 0.15, 0.5, 0.95];
/// Largest value of a graze function that counts as zero, in the units of the unknowns.
const AT_GRAZE: f64 = 1e-10;
/// Largest distances of real multipliers and of complex pairs from critical values.
const AT_MULTIPLIER: [f64; 2] = [1e-5, 1e-6];

type MapPoint = ContinuationPoint<f64, PassagesOfOrbit<f64>>;

type MapTrace = TracedBranch<PassagesOfOrbit<f64>>;

/// Data from which seeds are taken.
pub(super) struct MapSeedData {
    /// Orbits that the map settles on, by parameter value.
    settled: Vec<(f64, Vec<SettledCycle>)>,
    /// Grazes of the orbit without contact: point, parameter, and grazing passages.
    grazing: Vec<(Vec<f64>, f64, PassageSet)>,
}

/// Branches of a map.
pub(super) struct MapBranches<'a> {
    search: ItinerarySearch<'a>,
    by_map: ByMap<'a>,
    map: &'a LocalMap,
    request: &'a BranchRequest,
    progress: &'a dyn Progress,
}

impl<'a> MapBranches<'a> {
    pub(super) fn new(
        scene: &Scene,
        orbit: &GrazingOrbit,
        map: &'a LocalMap,
        request: &'a BranchRequest,
        progress: &'a dyn Progress,
    ) -> Result<Self, AnalysisError> {
        Ok(Self {
            search: ItinerarySearch::new(map),
            by_map: ByMap::new(scene, orbit, map)?,
            map,
            request,
            progress,
        })
    }

    /// Branches that are physical somewhere.
    pub(super) fn physical(&self, follow: Follow) -> Branches {
        // A branch that is virtual on both sides of a graze is physical only at that point.
        let of_stretch = |point: &BranchPoint| {
            point.orbit.physical && point.special.is_none() && !point.orbit.multipliers.is_empty()
        };
        let branches = self.described(&self.all(follow)).into_iter();
        let physical = branches.filter(|branch| branch.points.iter().any(of_stretch));
        Branches { branches: physical.collect(), unfinished: Vec::new() }
    }

    fn equations<'e>(&'e self, itinerary: &'e ContactItinerary) -> MapOrbitEquations<'e, f64> {
        self.equations_of(&self.search.map, itinerary)
    }

    fn equations_of<'e, S: Real>(
        &'e self,
        map: &'e MapEvaluation<S>,
        itinerary: &'e ContactItinerary,
    ) -> MapOrbitEquations<'e, S> {
        let BranchRequest { along, at, .. } = self.request;
        let range = self.request.ordered_range();
        let reach = [REACH, DEEPEST];
        let equations =
            MapOrbitEquations::new(map, itinerary, &self.map.window, &[*along], at, reach);
        let equations = equations.in_units_of(0, range);
        if self.search.positive { equations.with_positive_depths() } else { equations }
    }

    /// Parameter values at which orbits are looked for: over the followed part of the range, and
    /// over the window if it is a small part of that.
    fn values(&self) -> Vec<f64> {
        let [a, b] = self.request.range;
        let zero = 0.0_f64.clamp(a.min(b), a.max(b));
        let width = finite_or_one(self.map.window.parameter[self.request.along]);
        let sides = [a, b].into_iter().filter(|&end| end != zero);
        let values = sides.flat_map(|end| {
            let within = |most: f64| zero + (end - zero).clamp(-most, most);
            let (far, near) = (within(REACH * width), within(width));
            let near = Some(near).filter(|near| *near != far);
            let ends = once(far).chain(near);
            ends.flat_map(move |end| SHARES.map(|share| zero + share * (end - zero)))
        });
        values.collect()
    }

    /// The value nearest to the graze.
    fn value_at_graze(&self) -> f64 {
        let values = self.values().into_iter();
        values.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or_default()
    }

    /// Orbits that the map settles on at these values.
    fn settled(&self) -> Vec<(f64, Vec<SettledCycle>)> {
        let values = self.values();
        let longest = self.request.itineraries.iter().map(ContactItinerary::period).max();
        parallel::map(values, |value| {
            let settled =
                self.search.settled(&self.request.parameters(value), longest.unwrap_or(1));
            (value, settled)
        })
    }

    /// Grazes of the orbit without contact: point, parameter, and grazing passages.
    fn grazing_orbits(&self) -> Vec<(Vec<f64>, f64, PassageSet)> {
        let passages = self.map.passages();
        let none = ContactItinerary::new(passages, vec![PassageSet::default()]);
        let value = self.value_at_graze();
        let state = self.search.smooth.at(&self.request.parameters(value));
        let seed = BranchSeed::new(&none, vec![state], Vec::new(), value);
        let traces = self.traces(&none, vec![seed], (Vec::new(), &mut self.most_work()));
        let turns = traces.iter().flat_map(|trace| {
            let equations = self.equations(&none);
            let grazes = trace.turns.iter().filter(move |turn| {
                let test = equations.test(&trace.points[turn.point], turn.test);
                matches!(test, TestKind::Passage(_))
            });
            grazes.map(|turn| {
                let point = &trace.points[turn.point];
                let free = point.linearised.extra.free.iter();
                let made = free.filter(|(_, _, depth)| depth.abs() <= AT_GRAZE);
                let state = point.linearised.extra.states[0].clone();
                let (_, _, parameters) = self.equations(&none).offsets(&point.unknowns);
                let value = parameters[self.request.along];
                (state, value, made.map(|(_, passage, _)| *passage).collect())
            })
        });
        turns.collect()
    }

    /// Data of the special point at which the given test functions vanish.
    fn special(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &MapPoint,
        turns: &[usize],
    ) -> Option<Special> {
        let vanishing = || turns.iter().map(|&test| equations.test(point, test));
        let jacobian = equations.jacobian(&point.linearised);
        let multipliers = jacobian.and_then(|jacobian| eigenvalues(&jacobian).ok());
        let multipliers = multipliers.unwrap_or_default();
        // Within rounding of a graze, real multipliers cannot be distinguished.
        let at_graze = depths_at_graze(equations, point) > 0;
        let told = |label: &BranchLabel| {
            !at_graze || matches!(label, BranchLabel::Graze | BranchLabel::NeimarkSacker)
        };
        let doubles = equations.is_repeated(&point.linearised.extra, NEAR);
        let label = match doubles {
            true => BranchLabel::BranchPoint,
            false => label_of(vanishing(), &multipliers, AT_MULTIPLIER).find(told)?,
        };
        let grazing = vanishing().filter_map(|test| grazing_passage(point, test));
        let grazing = grazing.filter(|_| label == BranchLabel::Graze).collect();
        let coefficient = match label {
            BranchLabel::Graze => self.slope(equations, point, turns),
            _ => self.normal_form(equations, point, label),
        };
        Some(Special { grazing, coefficient, ..Special::new(label) })
    }

    /// Derivative of the parameter by the speed of the contact that begins at a graze; `None`
    /// unless there is exactly one.
    fn slope(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &MapPoint,
        turns: &[usize],
    ) -> Option<f64> {
        let contacts = turns.iter().filter_map(|&test| match equations.test(point, test) {
            TestKind::Contact(place) => Some(place),
            _ => None,
        });
        let [place] = contacts.collect::<Vec<_>>()[..] else { return None };
        let (unknown, parameter) =
            (equations.first_depth_variable() + place, equations.first_parameter());
        let units = equations.units();
        let (_, passage, arrival) = &point.linearised.extra.arrivals[place];
        let small = 1e-9 * units[unknown];
        let by_depth = self.by_map.speed(*passage, small, arrival) / small;
        let along = |unknown: usize| exact_or_zero(point.tangent[unknown]) * units[unknown];
        let slope = along(parameter) / along(unknown) / by_depth;
        slope.is_finite().then_some(slope)
    }

    /// Coefficient of the normal form.
    fn normal_form(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &MapPoint,
        label: BranchLabel,
    ) -> Option<f64> {
        let mut map = self.search.fine.clone();
        let (state, depths, parameters) = equations.offsets(&point.unknowns);
        let first = equations.first_depth_variable();
        let units = &window_scales(&self.map.window)[..first];
        // The units of the equations are half-widths times a common factor of at most 1.
        let smaller = (equations.units()[0] / units[0]).powi(2);
        let depths = depths.iter().zip(&equations.units()[first..]);
        let depths = depths.map(|(y, unit)| smaller * (y / unit).powi(2));
        let free = point.linearised.extra.free.iter();
        let free = free.map(|(_, _, depth)| smaller * depth.abs());
        let jacobian = equations.jacobian(&point.linearised)?;
        NormalForm {
            map: &mut map,
            state: converted(&state),
            parameters: converted(&parameters),
            returns: equations.itinerary().period(),
            units: units.to_vec(),
            length: depths.chain(free).fold(1.0, f64::min),
            jacobian,
        }
        .of(label)
    }

    /// Parameters of a special point, a zero of test function `test`, to the rounding of
    /// double-double.
    fn refined(
        &self,
        itinerary: &ContactItinerary,
        point: &MapPoint,
        test: usize,
    ) -> Option<Vec<f64>> {
        let mut fine = self.equations_of(&self.search.fine, itinerary);
        let found = refined(&mut fine, point, test)?;
        Some(converted(&fine.offsets(&found.unknowns).2))
    }

    /// Parameters of a branch point whose orbit has half the period, refined as the period-doubling
    /// point of that orbit.
    fn refined_doubling(&self, itinerary: &ContactItinerary, point: &MapPoint) -> Option<Vec<f64>> {
        let half = halved(itinerary);
        let (state, depths, parameters) = self.equations(itinerary).offsets(&point.unknowns);
        let equations = self.equations(&half);
        let unknowns = equations.unknowns(&state, &depths[..half.contacts()], &parameters);
        let linearised = equations.at(&unknowns)?;
        let along = unit_vector(unknowns.len(), unknowns.len() - 1);
        let tangent = tangent_at(&linearised.jacobian, &along)?;
        let point = MapPoint { unknowns, tangent, linearised, tests: Vec::new() };
        self.refined(&half, &point, 1)
    }

    /// Branch through a seed, if it is not among those known.
    fn through(
        &self,
        itinerary: &ContactItinerary,
        seed: &BranchSeed,
        known: &[MapTrace],
    ) -> Option<MapTrace> {
        let mut equations = self.equations(itinerary);
        let parameters = self.request.parameters(seed.parameter);
        let guess = equations.unknowns(&seed.states[0], &seed.depth_variables, &parameters);
        let start = match &seed.way {
            SeedKind::Doubled(direction) => {
                first_doubled(&mut equations, &guess, direction, |equations, orbit, within| {
                    equations.is_repeated(orbit, within)
                })?
            }
            SeedKind::Through | SeedKind::On(_) => {
                let start = solved(&mut equations, &guess)?;
                let in_range = start.0.iter().enumerate().all(|(unknown, value)| {
                    let [lower, upper] = equations.range(unknown);
                    lower <= *value && *value <= upper
                });
                (in_range && !equations.is_repeated(&start.1.extra, SAME)).then_some(start)?
            }
        };
        let is_new = !is_known(&mut equations, &start, known);
        is_new.then(|| TracedBranch::through(&mut equations, &start.0, &StepControl::DEFAULT))?
    }

    /// Orbit at a point of a branch.
    fn found(
        &self,
        equations: &MapOrbitEquations<'_, f64>,
        point: &MapPoint,
        physical: bool,
    ) -> FoundOrbit {
        let (_, depth_variables, parameters) = equations.offsets(&point.unknowns);
        let extra = &point.linearised.extra;
        let at_graze = depths_at_graze(equations, point) > 0;
        let jacobian = equations.jacobian(&point.linearised).filter(|_| !at_graze);
        let inside = extra.states.iter();
        let depths: Vec<f64> = depth_variables.iter().map(|y| y * y).collect();
        let window = &self.map.window;
        let contacts = extra.arrivals.iter().zip(&depth_variables);
        let contacts = contacts.map(|((number, passage, point), &y)| OrbitContact {
            number: *number,
            passage: *passage,
            speed: self.by_map.speed(*passage, y, point),
        });
        FoundOrbit {
            contacts: contacts.collect(),
            physical,
            inside: { inside }.all(|state| window.holds(state, &parameters, &depths)),
            ..FoundOrbit::on_branch(
                equations.itinerary(),
                (&extra.states, &parameters),
                jacobian,
                &point.linearised.residual,
            )
        }
    }
}

impl BranchSource for MapBranches<'_> {
    type Orbit = PassagesOfOrbit<f64>;
    type SeedData = MapSeedData;

    fn asked(&self) -> (&BranchRequest, &dyn Progress) {
        (self.request, self.progress)
    }

    fn seed_data(&self) -> MapSeedData {
        MapSeedData { settled: self.settled(), grazing: self.grazing_orbits() }
    }

    fn seeds(
        &self,
        itinerary: &ContactItinerary,
        MapSeedData { settled, grazing }: &MapSeedData,
    ) -> Vec<BranchSeed> {
        let contacts = itinerary.contacts();
        let seed = |state: Vec<f64>, depth_variables: Vec<f64>, parameter: f64| {
            BranchSeed::new(itinerary, vec![state], depth_variables, parameter)
        };
        let mut seeds = Vec::new();
        for (state, parameter, passages) in grazing {
            let all = itinerary.returns().iter().flat_map(|made| made.iter());
            if all.into_iter().all(|passage| passages.contains(passage)) {
                seeds.push(seed(state.clone(), vec![0.0; contacts], *parameter));
            }
        }
        for (value, settled) in settled {
            for start in settled.iter().filter_map(|settled| settled.begun_as(itinerary)) {
                seeds.push(seed(start.state, start.depth_variables, *value));
            }
            for start in self.search.starts_about(itinerary, &self.request.parameters(*value)) {
                seeds.push(seed(start.state, start.depth_variables, *value));
            }
        }
        seeds
    }

    fn trace(
        &self,
        itinerary: &ContactItinerary,
        seed: &BranchSeed,
        known: &[MapTrace],
        _: u64,
    ) -> SearchedBranch<PassagesOfOrbit<f64>> {
        SearchedBranch { trace: self.through(itinerary, seed, known), work: 0 }
    }

    fn fits(&self, itinerary: &ContactItinerary, trace: &MapTrace) -> bool {
        let mut equations = self.equations(itinerary);
        let count = equations.first_parameter() + 1;
        trace.fits(itinerary, &mut equations, count)
    }

    fn led_to(&self, itinerary: &ContactItinerary, trace: &MapTrace) -> Vec<BranchSeed> {
        let equations = self.equations(itinerary);
        let mut seeds = Vec::new();
        for turn in &trace.turns {
            let point = &trace.points[turn.point];
            let extra = &point.linearised.extra;
            if !is_physical(&equations, point, &[turn.test]) {
                continue;
            }
            let (_, depth_variables, parameters) = equations.offsets(&point.unknowns);
            let parameter = parameters[self.request.along];
            let seed = BranchSeed::new(itinerary, extra.states.clone(), depth_variables, parameter);
            match equations.test(point, turn.test) {
                TestKind::Flip if 2 * itinerary.period() <= self.request.longest => {
                    seeds.extend(doubling(&equations, point, seed));
                }
                TestKind::Contact(place) => {
                    let (number, passage, _) = extra.arrivals[place];
                    seeds.push(with(seed, number, passage, Some(place)));
                }
                TestKind::Passage(place) => {
                    let (number, passage, _) = extra.free[place];
                    seeds.push(with(seed, number, passage, None));
                }
                _ => {}
            }
        }
        seeds
    }

    fn branch(&self, itinerary: &ContactItinerary, trace: &MapTrace) -> Branch {
        let equations = self.equations(itinerary);
        let points = trace.orbits().into_iter().map(|(place, turns)| {
            let point = &trace.points[place];
            let physical = is_physical(&equations, point, &turns);
            let mut orbit = self.found(&equations, point, physical);
            let mut special = None;
            if let Some(&first) = turns.first() {
                special = self.special(&equations, point, &turns).filter(|_| physical);
                let doubles = equations.is_repeated(&point.linearised.extra, NEAR);
                let exact = match doubles {
                    true => self.refined_doubling(itinerary, point),
                    false => self.refined(itinerary, point, first),
                };
                orbit.parameters = exact.unwrap_or(orbit.parameters);
            }
            BranchPoint { orbit, special }
        });
        let points = each_once(points.collect());
        let value = |place: usize| {
            let (_, _, parameters) = equations.offsets(&trace.points[place].unknowns);
            parameters[self.request.along]
        };
        // Where several contacts graze at once, determinants have multiple zeros.
        let several = |ends: &&[usize; 2]| {
            let places = ends[0]..=ends[1];
            let mut grazing = places.map(|place| &trace.points[place]);
            !grazing.any(|point| depths_at_graze(&equations, point) > 1)
        };
        let unresolved = trace.unresolved.iter().filter(several);
        let unresolved = unresolved.map(|ends| ends.map(value)).collect();
        let first = equations.first_parameter();
        let ends = trace.ends(|unknown| match unknown == first {
            true => BranchEnd::Range,
            false => BranchEnd::Reach,
        });
        Branch { itinerary: itinerary.clone(), points, ends, unresolved }
    }
}

/// Whether an orbit lies on a known branch, from any of its starting points.
fn is_known(
    equations: &mut MapOrbitEquations<'_, f64>,
    (unknowns, linearised): &Solution<f64, PassagesOfOrbit<f64>>,
    traces: &[MapTrace],
) -> bool {
    let itinerary = equations.itinerary();
    let later = (0..itinerary.period()).filter(|&later| itinerary.repeats_after(later));
    let starts = later.map(|later| {
        let state = linearised.extra.states[later].iter().zip(equations.units());
        state.map(|(value, unit)| value / unit).collect()
    });
    let starts: Vec<Vec<f64>> = starts.collect();
    let lines = traces
        .iter()
        .map(|trace| trace.points.iter().map(|point| point.unknowns.clone()).collect::<Vec<_>>());
    let lines: Vec<Vec<Vec<f64>>> = lines.collect();
    lies_on(equations, (&starts, unknowns[unknowns.len() - 1]), &lines, SAME)
}

/// Whether the map makes exactly the prescribed contacts; `vanishing` test functions may be zero.
fn is_physical(
    equations: &MapOrbitEquations<'_, f64>,
    point: &MapPoint,
    vanishing: &[usize],
) -> bool {
    let contacts = equations.itinerary().contacts();
    let first = equations.first_depth_variable();
    let depths = &point.unknowns[first..first + contacts];
    let grazes = |test: TestKind, value: f64| {
        let mut tests = vanishing.iter().map(|&index| equations.test(point, index));
        (value.abs() <= AT_GRAZE && !vanishing.is_empty()) || tests.any(|other| other == test)
    };
    let made = depths.iter().enumerate();
    let mut made = made.map(|(place, &y)| y > 0.0 || grazes(TestKind::Contact(place), y));
    let free = point.linearised.extra.free.iter().enumerate();
    let mut free =
        free.map(|(place, &(_, _, depth))| depth <= 0.0 || grazes(TestKind::Passage(place), depth));
    made.all(|made| made) && free.all(|free| free)
}

/// Return and passage that graze where a test function vanishes.
fn grazing_passage(point: &MapPoint, test: TestKind) -> Option<[usize; 2]> {
    let extra = &point.linearised.extra;
    match test {
        TestKind::Contact(place) => {
            let (number, passage, _) = extra.arrivals.get(place)?;
            Some([*number, *passage])
        }
        TestKind::Passage(place) => {
            let (number, passage, _) = extra.free.get(place)?;
            Some([*number, *passage])
        }
        _ => None,
    }
}

/// Number of contacts with depth zero.
fn depths_at_graze(equations: &MapOrbitEquations<'_, f64>, point: &MapPoint) -> usize {
    let depths = equations.first_depth_variable()..equations.first_parameter();
    point.unknowns[depths].iter().filter(|y| y.abs() <= AT_GRAZE).count()
}

/// Seed of the doubled branch at an orbit with multiplier −1: its eigenvector, with opposite depth
/// variables in the second half.
fn doubling(
    equations: &MapOrbitEquations<'_, f64>,
    point: &MapPoint,
    seed: BranchSeed,
) -> Option<BranchSeed> {
    let matrix = equations.shifted(&point.linearised.jacobian, -1.0);
    let vector = null_vector(&matrix)?;
    let (state, depths) = vector.split_at(equations.first_depth_variable());
    let direction = state.iter().chain(depths).copied();
    let direction = direction.chain(depths.iter().map(|value| -value)).chain([0.0]);
    Some(seed.doubled(&direction.collect::<Vec<f64>>()))
}

/// Seed with the contact of a passage removed (`contact` is its index), or added with depth zero.
fn with(mut seed: BranchSeed, number: usize, passage: usize, contact: Option<usize>) -> BranchSeed {
    match contact {
        Some(place) => drop(seed.depth_variables.remove(place)),
        None => {
            let returns = seed.itinerary.returns();
            let before = returns[..number].iter().map(|made| made.len()).sum::<usize>()
                + returns[number].iter().filter(|&other| other < passage).count();
            seed.depth_variables.insert(before, 0.0);
        }
    }
    seed.itinerary = toggled(&seed.itinerary, number, passage);
    seed.in_standard_form(PhaseCircle::none())
}
