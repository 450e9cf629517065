//! Check that every attractor of guarded iteration lies on a stable branch.

use grazemap::Map;
use grazemap::analysis::branches::{Branch, BranchRequest};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::analysis::{DirectMap, GuardedMap, NoProgress, escape_bounds};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{MapOrbit, OrbitEnd, OrbitRequest, PassageSet, Period};

/// Number of iterates dropped at each value.
const TRANSIENT: usize = 2000;
/// Largest distance of an attractor from the line through two orbits of a branch, as a share of
/// their distance. Distances are the largest over the coordinates, in half-widths of the window.
const BESIDE: f64 = 0.2;
/// Remainder of a transient, in half-widths of the window.
const SETTLED: f64 = 1e-6;

/// Attractors of an upward and a downward sweep.
#[derive(Clone, Debug, Default)]
pub(crate) struct Completeness {
    /// Number of periodic attractors with a period that was followed.
    pub(crate) periodic: usize,
    /// Number of these on stable branches of the map, and of direct simulation if an iterate is
    /// outside the window.
    pub(crate) found: [usize; 2],
    /// Number of attractors of longer periods or without a period.
    pub(crate) others: usize,
    /// Numbers of branches and points by the map.
    pub(crate) branches: [usize; 2],
    /// Attractors on no stable branch.
    pub(crate) missed: Vec<String>,
}

/// Sweeps an active parameter over a range with a number of values; itineraries up to a period.
pub(crate) fn of_map(
    map: &Map,
    (along, range): (usize, [f64; 2]),
    longest: usize,
    values: usize,
) -> Result<Completeness, Box<dyn std::error::Error>> {
    let (scene, orbit, local) = (map.scene(), map.orbit(), map.local());
    let request = |itineraries: Vec<ContactItinerary>, direct: bool| BranchRequest {
        itineraries,
        longest,
        along,
        range,
        at: vec![0.0; local.parameters.len()],
        direct,
        starts: Vec::new(),
    };
    let all = ContactItinerary::all(local.passages(), longest)?;
    let by_map = map.branches(&request(all, false), &NoProgress)?.branches;
    let points = by_map.iter().map(|branch| branch.points.len()).sum();
    let mut found = Completeness { branches: [by_map.len(), points], ..Default::default() };
    let mut simulated: Vec<(ContactItinerary, Vec<Branch>)> = Vec::new();
    let system = HybridSystem::new(&scene.model);
    let direct = DirectMap::new(&system, scene, orbit)?;
    let guarded = GuardedMap::new(map.discrete(), &local.window, &direct);
    let bounds: Vec<f64> = escape_bounds(scene, orbit).iter().map(|bound| bound.offset).collect();
    let iterates =
        OrbitRequest::new(TRANSIENT, 4 * longest, &local.window.state).escaping_at(&bounds);
    for down in [false, true] {
        let mut state = vec![1e-9; local.dimension()];
        for number in 0..values {
            let number = if down { values - 1 - number } else { number };
            let share = (number as f64 + 0.5) / values as f64;
            let offset = range[0] + share * (range[1] - range[0]);
            let mut parameters = vec![0.0; local.parameters.len()];
            parameters[along] = offset;
            let settled = MapOrbit::of(&guarded, &state, &parameters, &iterates);
            if settled.end != OrbitEnd::Completed {
                state.fill(1e-9);
                continue;
            }
            state.clone_from(&settled.last);
            let period = match settled.period {
                Period::Periodic(period) if period <= longest => period,
                _ => {
                    found.others += 1;
                    continue;
                }
            };
            found.periodic += 1;
            let last = settled.steps.len() - period;
            let returns: Vec<PassageSet> =
                settled.steps[last..].iter().map(|step| step.passages).collect();
            let outside = settled.steps[last..].iter().any(|step| step.simulated);
            let itinerary = ContactItinerary::new(local.passages(), returns).largest_rotation().0;
            if outside && !simulated.iter().any(|(known, _)| *known == itinerary) {
                let request = request(vec![itinerary.clone()], true);
                let branches = map.branches(&request, &NoProgress)?.branches;
                simulated.push((itinerary.clone(), branches));
            }
            let known = simulated.iter().find(|(known, _)| *known == itinerary);
            let branches = match (outside, known) {
                (true, Some((_, branches))) => branches,
                _ => &by_map,
            };
            let place = Place { along, offset, state: &settled.last, scales: &local.window.state };
            let mine = branches.iter().filter(|branch| branch.itinerary == itinerary);
            if { mine }.any(|branch| place.lies_on(branch)) {
                found.found[usize::from(outside)] += 1;
            } else {
                let by = if outside { "direct simulation" } else { "the map" };
                found.missed.push(format!("{itinerary} at {offset:e} by {by}"));
            }
        }
    }
    Ok(found)
}

/// Point of an attractor at a parameter value.
struct Place<'a> {
    along: usize,
    offset: f64,
    state: &'a [f64],
    scales: &'a [f64],
}

impl Place<'_> {
    /// Whether the point lies between two neighbours of a branch, one of them stable.
    fn lies_on(&self, branch: &Branch) -> bool {
        branch.points.windows(2).any(|pair| {
            let [a, b] = [&pair[0].orbit, &pair[1].orbit];
            let (from, to) = (a.parameters[self.along], b.parameters[self.along]);
            let share = (self.offset - from) / (to - from);
            let stable = (a.stable && a.physical) || (b.stable && b.physical);
            stable
                && (0.0..=1.0).contains(&share)
                && a.states.iter().zip(&b.states).any(|(a, b)| self.is_beside(a, b, share))
        })
    }

    fn is_beside(&self, a: &[f64], b: &[f64], share: f64) -> bool {
        let scale = |place: usize| match self.scales[place] {
            scale if scale.is_finite() => scale,
            _ => 1.0,
        };
        let apart = |of: &dyn Fn(usize) -> f64| {
            (0..a.len()).map(|place| of(place).abs() / scale(place)).fold(0.0, f64::max)
        };
        let length = apart(&|place| a[place] - b[place]);
        let aside = apart(&|place| a[place] + share * (b[place] - a[place]) - self.state[place]);
        aside <= BESIDE * length + SETTLED
    }
}
