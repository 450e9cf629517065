//! Branches of periodic orbits: the equations of continuation, and the orbits and special points
//! found.

use grazemap::analysis::branches::{Branch, BranchLabel, BranchRequest, Branches};
use grazemap::analysis::periodic::{ContactItinerary, ItinerarySearch, MapOrbitEquations};
use grazemap::analysis::{MapEvaluation, NoProgress, TimeSeriesRequest, time_series};
use grazemap::iteration::{MapOrbit, OrbitRequest, Period};
use grazemap::numeric::{Dd, Scalar};
use grazemap::prelude::{FindGraze, Map, Scene};

use crate::support::foale::Foale;
use crate::support::scenes::scene_with;

/// Exact derivatives agree with differences in double-double at any point.
#[test]
fn derivatives_are_those_of_the_residuals() {
    let scene = Scene::of_catalogue("foale").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let evaluation = MapEvaluation::<Dd>::new(map.local());
    let itinerary = ContactItinerary::parse("110", 1).expect("digits");
    let window = &map.local().window;
    let equations =
        MapOrbitEquations::new(&evaluation, &itinerary, window, &[0, 1], &[0.0; 2], [2.0; 2]);
    let at: Vec<Dd> = [0.3, -0.2, 0.7, -0.4, 0.1, 0.6].into_iter().map(Dd::from).collect();
    let there = equations.at(&at).expect("residuals");
    assert_eq!(there.jacobian.shape(), (4, 6));
    let step = 1e-7;
    for column in 0..at.len() {
        let side = |sign: f64| {
            let mut moved = at.clone();
            moved[column] += Dd::from(sign * step);
            equations.at(&moved).expect("residuals").residual
        };
        let (up, down) = (side(1.0), side(-1.0));
        for row in 0..there.residual.len() {
            let difference = ((up[row] - down[row]) / Dd::from(2.0 * step)).to_f64();
            let exact = there.jacobian[(row, column)].to_f64();
            let error = (difference - exact).abs();
            assert!(error < 1e-10 * exact.abs().max(1.0), "{row} {column}: {error:e}");
        }
    }
}

/// The Jacobian of the period's map and its multipliers agree with those of the search by
/// itinerary, which uses differences.
#[test]
fn multipliers_are_those_of_the_search() {
    let scene = Scene::of_catalogue("foale_omega_2_2").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let itinerary = ContactItinerary::parse("1", 1).expect("digits");
    let parameters = [2e-4, 0.0];
    let found = ItinerarySearch::new(map.local()).orbits(&itinerary, &parameters);
    let orbit = found.first().expect("an orbit with one impact");
    let evaluation = MapEvaluation::<Dd>::new(map.local());
    let window = &map.local().window;
    let equations =
        MapOrbitEquations::new(&evaluation, &itinerary, window, &[0], &parameters, [2.0; 2]);
    let free = parameters.map(Dd::from);
    let at = equations.unknowns(&orbit.orbit.states[0], &orbit.depth_variables, &free);
    let there = equations.at(&at).expect("residuals");
    assert!(there.residual.iter().all(|value| value.magnitude() < 1e-20));
    let jacobian = equations.jacobian(&there).expect("a contact");
    for (ours, searched) in jacobian.iter().zip(orbit.orbit.jacobian.iter()) {
        let error = (*ours - *searched).magnitude();
        assert!(error < 1e-15 * searched.magnitude().max(1.0), "{ours:?} {searched:?}");
    }
}

/// Offsets of the varied parameter at the points of a label, on the branches of an itinerary.
fn labelled(found: &Branches, itinerary: &str, label: BranchLabel) -> Vec<f64> {
    let branches = found.branches.iter().filter(|branch| branch.itinerary.to_string() == itinerary);
    let points = branches.flat_map(|branch| &branch.points);
    let labelled =
        points.filter(|point| point.special.as_ref().is_some_and(|special| special.label == label));
    labelled.map(|point| point.orbit.parameters[0]).collect()
}

fn request(itineraries: &[&str], longest: usize, range: [f64; 2], direct: bool) -> BranchRequest {
    let parse = |digits: &&str| ContactItinerary::parse(digits, 1).expect("digits");
    BranchRequest {
        itineraries: itineraries.iter().map(parse).collect(),
        longest,
        along: 0,
        range,
        at: vec![0.0; 2],
        direct,
        starts: Vec::new(),
    }
}

fn map_of(scene: &str) -> Map {
    let scene = Scene::of_catalogue(scene).expect("a scene");
    scene.graze().and_then(|graze| graze.map()).expect("a map")
}

/// Foale's saddle-node below ω = 2 and flip above it, followed by direct simulation from the graze,
/// compared with the closed form (tests/data/rigid/README.md).
#[test]
fn one_branch_of_direct_simulation_goes_from_the_graze_to_the_published_points() {
    let cases = [
        ("foale", [-0.8, 0.1], BranchLabel::SaddleNode, 1.487172409899, 3.823568166819),
        (
            "foale_omega_2_2",
            [-0.1, 0.6],
            BranchLabel::PeriodDoubling,
            4.270260988791,
            0.869956974914,
        ),
    ];
    for (scene, range, label, alpha, speed) in cases {
        let map = map_of(scene);
        let found = map.branches(&request(&["1"], 1, range, true), &NoProgress).expect("branches");
        let one = found.branches.iter().filter(|branch| branch.itinerary.to_string() == "1");
        let one: Vec<_> = one.collect();
        assert_eq!(one.len(), 1, "{scene}");
        let points = &one[0].points;
        let special = points
            .iter()
            .find(|point| point.special.as_ref().is_some_and(|special| special.label == label));
        let orbit = &special.expect("the published point").orbit;
        let value = map.parameter("alpha").expect("a parameter") + orbit.parameters[0];
        assert!((value - alpha).abs() < 2e-12, "{scene}: {value}");
        assert!((orbit.contacts[0].speed - speed).abs() < 1e-7, "{scene}: {orbit:?}");
        // The branch begins at the graze itself.
        let grazes = labelled(&found, "1", BranchLabel::Graze);
        assert!(grazes.len() == 1 && grazes[0].abs() < 1e-15, "{scene}: {grazes:?}");
        // Every orbit is that of the closed form: its amplitude follows from its speed.
        let parameter = |name: &str| match name {
            "zeta" => Dd::from(0.05),
            "omega" => Dd::from(map.parameter("omega").expect("a parameter")),
            _ => Dd::from(0.7),
        };
        let closed = Foale::unfolded(parameter, 0.0, 1);
        // Its slope there is that of the closed form.
        let step = Dd::from(1e-10);
        let sides = [closed.alpha(step), closed.alpha(-step)];
        let expected = ((sides[0] - sides[1]) / (step + step)).to_f64();
        let graze = points.iter().filter_map(|point| point.special.as_ref());
        let mut graze = graze.filter(|special| special.label == BranchLabel::Graze);
        let slope = graze.next().and_then(|special| special.coefficient).expect("a slope");
        assert!((slope / expected - 1.0).abs() < 1e-9, "{scene}: {slope} {expected}");
        for point in points.iter().filter(|point| !point.orbit.contacts.is_empty()) {
            let orbit = &point.orbit;
            let expected = closed.alpha(Dd::from(orbit.contacts[0].speed)).to_f64();
            let value = map.parameter("alpha").expect("a parameter") + orbit.parameters[0];
            assert!((value - expected).abs() < 1e-10, "{scene}: {value} {expected}");
        }
    }
}

/// The saddle-node of Thota, Zhao and Dankowicz' Fig. 6b is 1.238e-6 from the codimension-two point
/// (docs/explanation/where-papers-err.md); over this range contacts next to the graze are known to
/// 1e-6 alone.
#[test]
#[ignore = "long: .ci/full runs it"]
fn a_branch_begins_at_its_graze_where_the_range_is_wide() {
    let set = [
        ("omega", "0.095476043524942905"),
        ("V", "0.398637"),
        ("grazing.guess", "{x=0.5,v=0.0,theta=-0.9926}"),
    ];
    let scene = scene_with("mems_scenario3", &set);
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let asked = request(&["1"], 1, [-3e-5, 3e-5], true);
    let found = map.branches(&asked, &NoProgress).expect("branches");
    let folds = labelled(&found, "1", BranchLabel::SaddleNode);
    let value = map.parameter("V").expect("a parameter") + folds[0] - 0.39863656360925426;
    assert!((value - 1.238e-6).abs() < 2e-8, "{value:e}");
    assert_eq!(labelled(&found, "1", BranchLabel::Graze).len(), 1);
}

/// On a stroboscopic section, at the phase of the graze and at another, a branch of direct
/// simulation begins at its graze, with the slope of the closed form, and reaches the published
/// saddle-node.
#[test]
fn a_branch_on_a_stroboscopic_section_begins_at_its_graze() {
    let parameter = |name: &str| match name {
        "zeta" => Dd::from(0.05),
        "omega" => Dd::from(1.8),
        _ => Dd::from(0.7),
    };
    let closed = Foale::unfolded(parameter, 0.0, 1);
    let step = Dd::from(1e-10);
    let sides = [closed.alpha(step), closed.alpha(-step)];
    let expected = ((sides[0] - sides[1]) / (step + step)).to_f64();
    for phase in ["\"grazing\"", "0.5"] {
        let set = [
            ("section.kind", "\"stroboscopic\""),
            ("section.phase", phase),
            ("window.state", "{}"),
        ];
        let map = scene_with("foale", &set).graze().and_then(|graze| graze.map()).expect("a map");
        let found = map.branches(&request(&["1"], 1, [-0.8, 0.1], true), &NoProgress);
        let found = found.expect("branches");
        let graze = map.parameter("alpha").expect("a parameter");
        let folds = labelled(&found, "1", BranchLabel::SaddleNode);
        assert_eq!(folds.len(), 1, "{phase}");
        assert!((graze + folds[0] - 1.487172409899).abs() < 2e-12, "{phase}: {folds:?}");
        let points = found.branches.iter().filter(|branch| branch.itinerary.to_string() == "1");
        let special = points.flat_map(|branch| &branch.points);
        let special = special.filter_map(|point| Some((point, point.special.as_ref()?)));
        let grazes: Vec<_> =
            special.filter(|(_, special)| special.label == BranchLabel::Graze).collect();
        assert_eq!(grazes.len(), 1, "{phase}");
        let (point, special) = grazes[0];
        assert!(point.orbit.parameters[0].abs() < 1e-15, "{phase}: {:?}", point.orbit);
        let slope = special.coefficient.expect("a slope");
        assert!((slope / expected - 1.0).abs() < 1e-9, "{phase}: {slope} {expected}");
    }
}

/// At a compliant stop with a damper the parameter changes with the square of the impact speed.
#[test]
fn a_parameter_that_changes_with_the_square_of_the_speed_has_the_slope_zero() {
    let map = map_of("soft_b");
    for direct in [false, true] {
        let found = map.branches(&request(&["1"], 1, [-1e-3, 1e-3], direct), &NoProgress);
        let found = found.expect("branches");
        let one = found.branches.iter().find(|branch| branch.itinerary.to_string() == "1");
        let points = &one.expect("orbits with contact").points;
        let special = points.iter().filter_map(|point| point.special.as_ref());
        let grazes: Vec<_> =
            special.filter(|special| special.label == BranchLabel::Graze).collect();
        assert_eq!(grazes.len(), 1, "{direct}");
        assert_eq!(grazes[0].coefficient, Some(0.0), "{direct}");
    }
}

/// Flips and grazes of the beam's orbits of two and three returns, inside the window: the map
/// and direct simulation are solved each alone.
#[test]
fn special_points_of_the_map_are_those_of_direct_simulation() {
    let map = map_of("cantilever_1_7");
    let range = [-1e-6, 1e-6];
    let of = |direct| {
        let request = request(&["10", "100"], 3, range, direct);
        map.branches(&request, &NoProgress).expect("branches")
    };
    let (by_map, direct) = (of(false), of(true));
    // The cubic coefficient of the flip is that of the map in the same units.
    let cubic = |found: &Branches| {
        let ten = found.branches.iter().filter(|branch| branch.itinerary.to_string() == "10");
        let points = ten.flat_map(|branch| &branch.points);
        let special = points.filter_map(|point| point.special.as_ref());
        let mut flips = special.filter(|special| special.label == BranchLabel::PeriodDoubling);
        flips.next().and_then(|special| special.coefficient).expect("a coefficient")
    };
    let (ours, simulated) = (cubic(&by_map), cubic(&direct));
    assert!((simulated / ours - 1.0).abs() < 1e-4, "{ours} {simulated}");
    for (itinerary, label, tolerance) in [
        ("10", BranchLabel::PeriodDoubling, 1e-9),
        ("100", BranchLabel::PeriodDoubling, 1e-9),
        ("100", BranchLabel::Graze, 1e-7),
    ] {
        let beyond = |found: &Branches| {
            let all = labelled(found, itinerary, label).into_iter();
            all.filter(|offset| offset.abs() > 1e-16).collect::<Vec<_>>()
        };
        let (ours, simulated) = (beyond(&by_map), beyond(&direct));
        assert!(!ours.is_empty(), "{itinerary} {label:?}");
        for offset in ours {
            let near = simulated.iter().any(|other| (other / offset - 1.0).abs() < tolerance);
            assert!(near, "{itinerary} {label:?}: {offset:e} {simulated:?}");
        }
    }
}

/// A compliant stop with a prestressed spring, its section points inside a contact that is still
/// closing: the flip of the orbit with one contact in five returns, each solved for alone.
#[test]
#[ignore = "long: .ci/full runs it"]
fn section_points_inside_a_contact_have_their_branch_by_direct_simulation() {
    let map = map_of("three_masses");
    let flip = |direct| {
        let found = map.branches(&request(&["10000"], 5, [-2e-4, 2e-4], direct), &NoProgress);
        let flips = labelled(&found.expect("branches"), "10000", BranchLabel::PeriodDoubling);
        assert_eq!(flips.len(), 1, "{direct}: {flips:?}");
        flips[0]
    };
    let (by_map, direct) = (flip(false), flip(true));
    assert!((direct / by_map - 1.0).abs() < 2e-9, "{by_map:e} {direct:e}");
}

/// Two masses between two elastic stops: the orbit that has lost its symmetry meets one stop a
/// second time. Where it begins to, direct simulation touches that stop, and on one side of it the
/// orbit has one contact more.
#[test]
#[ignore = "long: .ci/full runs it"]
fn a_graze_beside_the_passages_changes_the_name_by_one_contact() {
    let map = map_of("two_stops_t1");
    let along = map.local().parameters.iter().position(|parameter| parameter.name == "omega");
    let found = map.branches(
        &BranchRequest {
            itineraries: vec![ContactItinerary::parse("11", 2).expect("digits")],
            longest: 1,
            along: along.expect("an active parameter"),
            range: [-0.12, 0.05],
            at: vec![0.0; 2],
            direct: true,
            starts: Vec::new(),
        },
        &NoProgress,
    );
    let found = found.expect("branches");
    let grazes = found.branches.iter().flat_map(|branch| {
        let places = 1..branch.points.len().saturating_sub(1);
        let is_graze = |place: &usize| {
            let special = branch.points[*place].special.as_ref();
            special.is_some_and(|special| special.label == BranchLabel::Graze)
        };
        places.filter(is_graze).map(|place| &branch.points[place - 1..=place + 1])
    });
    let grazes: Vec<_> = grazes.collect();
    assert_eq!(grazes.len(), 1);
    let [before, graze, after] = grazes[0] else { panic!("three points") };
    let hits = [before, after].map(|point| point.orbit.hits.as_ref().expect("counted"));
    let changes = hits[0].iter().zip(hits[1]).map(|(a, b)| a.abs_diff(*b)).sum::<u32>();
    assert_eq!(changes, 1, "{hits:?}");
    let request = TimeSeriesRequest {
        start: graze.orbit.states[0].clone(),
        parameters: graze.orbit.parameters.clone(),
        settle: 0,
        returns: 1,
        samples: 20_000,
    };
    let series =
        time_series(map.scene(), map.orbit(), &request, &NoProgress).expect("it is simulated");
    let touches = series.points.windows(3).flat_map(|near| {
        let lowest = |&stop: &usize| {
            let [a, b, c] = [0, 1, 2].map(|place: usize| near[place].gaps[stop]);
            b < a && b <= c && b.abs() < 1e-6
        };
        (0..2).filter(lowest).collect::<Vec<_>>()
    });
    assert_eq!(touches.count(), 1);
}

/// Branch switching: at the graze of a passage the itineraries with and without its contact meet,
/// and the doubled branch begins where the orbit flips.
#[test]
fn branches_change_their_itinerary_at_grazes_and_double_at_flips() {
    let map = map_of("self_excited");
    let mut request = request(&["10"], 4, [-1e-3, 1e-3], false);
    request.at = vec![0.0; map.local().parameters.len()];
    let found = map.branches(&request, &NoProgress).expect("branches");
    // Further branches are followed: 11 beyond the graze of 10's second return and, at the end of
    // that, 1 as the orbit whose doubling is 11.
    let grazes = |itinerary: &str| labelled(&found, itinerary, BranchLabel::Graze);
    let shared: Vec<f64> = grazes("10").into_iter().filter(|offset| *offset < -1e-6).collect();
    assert_eq!(shared.len(), 1);
    let same = |offset: &f64| (offset / shared[0] - 1.0).abs() < 1e-12;
    assert!(grazes("11").iter().any(same), "{:?} {shared:?}", grazes("11"));
    let doubled = labelled(&found, "10", BranchLabel::PeriodDoubling);
    let begins = labelled(&found, "1010", BranchLabel::BranchPoint);
    assert_eq!((doubled.len(), begins.len()), (1, 1));
    assert!((begins[0] / doubled[0] - 1.0).abs() < 1e-12, "{begins:?} {doubled:?}");
}

/// Every attractor of a sweep by the map lies on a stable branch.
#[test]
fn every_attractor_of_a_sweep_lies_on_a_stable_branch() {
    let map = map_of("cantilever_2_5");
    let longest = 4;
    let all = ContactItinerary::all(1, longest).expect("short periods");
    let itineraries: Vec<String> = all.iter().map(ContactItinerary::to_string).collect();
    let names: Vec<&str> = itineraries.iter().map(String::as_str).collect();
    let range = [-1e-5, 2e-5];
    let found = map.branches(&request(&names, longest, range, false), &NoProgress);
    let found = found.expect("branches");
    let scales = [1e-4, 1e-4];
    let mut settled = 0;
    for number in 0..40 {
        let offset = range[0] + (range[1] - range[0]) * (f64::from(number) + 0.5) / 40.0;
        let parameters = [offset, 0.0];
        let request = OrbitRequest::new(3000, 2 * longest, &scales);
        let orbit = MapOrbit::of(map.discrete(), &[1e-9, 0.0], &parameters, &request);
        let Period::Periodic(period) = orbit.period else { continue };
        settled += 1;
        let last = &orbit.last;
        let lies = |branch: &Branch| {
            branch.points.windows(2).any(|pair| {
                let [a, b] = [&pair[0].orbit, &pair[1].orbit];
                let (from, to) = (a.parameters[0], b.parameters[0]);
                let share = (offset - from) / (to - from);
                let stable = (a.stable && a.physical) || (b.stable && b.physical);
                stable
                    && (0.0..=1.0).contains(&share)
                    && a.states.iter().zip(&b.states).any(|(a, b)| {
                        let pairs = a.iter().zip(b).zip(last).zip(scales);
                        { pairs }.all(|(((a, b), last), scale)| {
                            let between = a + share * (b - a);
                            let reach = (a - b).abs() + 1e-6 * scale;
                            (between - last).abs() <= 0.2 * reach
                        })
                    })
            })
        };
        let branches = found.branches.iter();
        let mut same = branches.filter(|branch| branch.itinerary.period() == period);
        assert!(same.any(lies), "period {period} at {offset:e}: {last:?}");
    }
    assert!(settled >= 20, "{settled}");
}

/// Attractors of direct simulation have their branches even far from the graze: 70 times as far as
/// the graze moves over the range.
#[test]
fn an_orbit_far_from_the_graze_has_its_branch_by_direct_simulation() {
    let scene = Scene::of_catalogue("mems_scenario3").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let request = BranchRequest {
        itineraries: vec![ContactItinerary::parse("0", 1).expect("digits")],
        longest: 1,
        along: 0,
        range: [-1e-5, 1e-5],
        at: vec![0.0; map.local().parameters.len()],
        direct: true,
        starts: Vec::new(),
    };
    let found = map.branches(&request, &NoProgress).expect("branches");
    let far = found.branches.iter().find(|branch| branch.points[0].orbit.states[0][0] < -0.1);
    let far = far.expect("a branch far from the graze");
    assert!(far.points.iter().all(|point| point.orbit.stable && point.orbit.physical));
    let ends = [0, far.points.len() - 1].map(|place| far.points[place].orbit.parameters[0]);
    assert!(ends.iter().all(|end| end.abs() > 0.99e-5), "{ends:?}");
}

/// The branches of an orbit do not depend on the return at which its itinerary begins.
#[test]
fn an_itinerary_may_begin_at_any_return() {
    let scene = Scene::of_catalogue("cantilever_2_5").expect("a scene");
    let map = scene.graze().and_then(|graze| graze.map()).expect("a map");
    let found = ["10", "01"].map(|digits| {
        let request = BranchRequest {
            itineraries: vec![ContactItinerary::parse(digits, 1).expect("digits")],
            longest: 2,
            along: 0,
            range: [-1e-4, 1e-4],
            at: vec![0.0; map.local().parameters.len()],
            direct: false,
            starts: Vec::new(),
        };
        map.branches(&request, &NoProgress).expect("branches")
    });
    assert!(found[0].branches.iter().any(|branch| branch.itinerary.contacts() == 1));
    assert_eq!(found[0], found[1]);
}

/// Foale's oscillator at a force of 3.5, where it grazes at a frequency.
fn foale_over_omega() -> Map {
    let set = [
        ("alpha", "3.5"),
        ("omega", "2.1198"),
        ("grazing.guess", "{x = 1.0, v = 0.0, theta = 3.08099}"),
        ("grazing.solve_for", "\"omega\""),
        ("section.kind", "\"stroboscopic\""),
        ("section.phase", "\"0\""),
    ];
    scene_with("foale", &set).graze().and_then(|graze| graze.map()).expect("a map")
}

/// With one impact in three or four periods, the other returns have no local minimum of the gap.
/// Flips are those of the closed form, solved with 30 digits.
#[test]
fn returns_without_a_minimum_of_the_gap_have_their_branch() {
    let map = foale_over_omega();
    let omega = map.local().parameters[1].value.to_f64();
    let cases =
        [("100", [1.6, 2.8], 4.115_431_958_233_79), ("1000", [2.8, 4.2], 5.360_354_676_974_13)];
    for (itinerary, range, flip) in cases {
        let request = BranchRequest { along: 1, ..request(&[itinerary], 4, range, true) };
        let found = map.branches(&request, &NoProgress).expect("branches");
        let points = found.branches.iter().flat_map(|branch| &branch.points);
        let special = points.filter(|point| point.special.is_some());
        let found: Vec<f64> = special.map(|point| point.orbit.parameters[1] + omega).collect();
        assert!((found[0] - flip).abs() < 1e-11, "{itinerary}: {found:?}");
    }
}

/// Orbit with one impact in six periods, reached from a hundredth of the states.
#[test]
fn an_orbit_that_few_states_come_to_has_its_branch_from_a_start_that_is_given() {
    let map = foale_over_omega();
    let mut request = BranchRequest { along: 1, ..request(&["100000"], 6, [4.6, 5.4], true) };
    let is_stable = |branch: &Branch| {
        branch.points.iter().all(|point| point.orbit.stable && point.orbit.physical)
    };
    let found = map.branches(&request, &NoProgress).expect("branches");
    assert!(!found.branches.iter().any(is_stable));
    request.starts = vec![vec![1.8917, 0.2817]];
    let found = map.branches(&request, &NoProgress).expect("branches");
    assert_eq!(found.branches.iter().filter(|branch| is_stable(branch)).count(), 1);
}
