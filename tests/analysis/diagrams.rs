//! Bifurcation diagrams of a map known from the literature, and of the linear oscillator by the map
//! and by direct simulation.

use grazemap::analysis::NoProgress;
use grazemap::analysis::diagram::{
    Diagram, DiagramPlan, DiagramPoint, Sweep, SweepHeading, SweepRequest, UnobservedSweep,
    diagram, run_plan,
};
use grazemap::expansion::{Expander, MapOrders, MapWindow};
use grazemap::iteration::{
    ContactsPerPeriod, DiscreteMap, HornerMap, Itinerary, OrbitEnd, OrbitRequest, Period, StepInfo,
};
use grazemap::model::{Method, Observable, SweepDirection, even_offsets};
use grazemap::numeric::linear::eigenvalues;
use grazemap::report::figure::AxisScale;
use grazemap::report::{diagram_figures, diagram_rows};
use nalgebra::DMatrix;

use crate::support::scenes::{grazing, grazing_by, orbit, scene_with};

/// The one-dimensional square-root map `x ↦ ν x + μ − √max(0, x)` of Nordmark (1991) and Chin, Ott,
/// Nusse and Grebogi (1994), at `ν = 0.2`: below `ν = 1/4` the attractors for `μ > 0` are orbits
/// with one contact in `m` iterates, and `m` grows by one at a time as `μ` falls to 0.
struct SquareRootMap;

impl DiscreteMap for SquareRootMap {
    fn dimension(&self) -> usize {
        1
    }

    fn parameters(&self) -> usize {
        1
    }

    fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
        let mut info = StepInfo::default();
        info.add_passage(0, state[0]);
        image[0] = 0.2 * state[0] + parameters[0] - state[0].max(0.0).sqrt();
        info.checked(image)
    }

    fn step_jacobian(
        &self,
        state: &[f64],
        parameters: &[f64],
        image: &mut [f64],
        jacobian: &mut [f64],
    ) -> StepInfo {
        jacobian[0] = if state[0] > 0.0 { 0.2 - 0.5 / state[0].sqrt() } else { 0.2 };
        self.step(state, parameters, image)
    }
}

fn plan(range: [f64; 2], direction: SweepDirection) -> DiagramPlan<'static> {
    DiagramPlan {
        maps: vec![Box::new(UnobservedSweep {
            map: SquareRootMap,
            itinerary: Itinerary {
                surfaces: vec!["wall".to_owned()],
                passages: vec![0],
                nominal_hits: vec![0],
                periods: 1,
            },
        })],
        direction,
        request: SweepRequest {
            parameter: 0,
            offsets: even_offsets(range, 400),
            starts: Vec::new(),
            orbit: OrbitRequest::new(2000, 40, &[1.0]),
            window: MapWindow { depth: 1.0, state: vec![1.0], parameter: vec![1.0] },
        },
    }
}

#[test]
fn iterates_beyond_the_depth_or_the_parameter_of_the_window_are_counted_outside() {
    let outside = |depth: f64, parameter: f64| {
        let mut plan = plan([1e-3, 2e-3], SweepDirection::Up);
        (plan.request.window.depth, plan.request.window.parameter[0]) = (depth, parameter);
        let sweep = run_plan(&plan, &NoProgress).remove(0);
        let points = sweep.points.iter();
        let counts = points.map(|point| (40.0 * point.outside).round() as usize);
        counts.collect::<Vec<_>>()
    };
    assert!(outside(1.0, 1.0).iter().all(|&count| count == 0));
    // Every periodic orbit of the map near grazing makes a contact, at some depth.
    assert!(outside(1e-12, 1.0).iter().all(|&count| (1..=40).contains(&count)));
    let beyond = outside(1.0, 1.5e-3);
    assert!(beyond[..190].iter().all(|&count| count == 0));
    assert!(beyond[210..].iter().all(|&count| count == 40));
}

#[test]
fn periods_of_the_square_root_map_grow_by_one_towards_grazing() {
    let sweep = &run_plan(&plan([1e-5, 0.2], SweepDirection::Down), &NoProgress)[0];
    let mut labels: Vec<ContactsPerPeriod> =
        sweep.points.iter().filter_map(|p| p.contacts).collect();
    labels.dedup();
    let adding = labels.iter().filter(|label| label.contacts == 1);
    let periods: Vec<usize> = adding.map(|label| label.period).collect();
    assert!(periods.starts_with(&[2, 3, 4]), "{labels:?}");
    assert!(periods.is_sorted(), "{periods:?}");
    let names = sweep.points.iter().filter_map(|point| point.orbit.as_ref());
    let names: Vec<String> = names.map(ToString::to_string).collect();
    for period in 2..=4 {
        let name = format!("(1,{period})");
        assert!(names.contains(&name), "{name} in {names:?}");
    }
}

#[test]
fn a_stable_period_has_a_negative_exponent() {
    let sweep = &run_plan(&plan([0.03, 0.2], SweepDirection::Up), &NoProgress)[0];
    let periodic = sweep.points.iter().filter(|point| point.period != Period::NotFound);
    let exponents: Vec<f64> = periodic.filter_map(|point| point.lyapunov).collect();
    assert!(exponents.len() > 100 && exponents.iter().all(|&exponent| exponent < 0.0));
}

#[test]
fn sweeps_do_not_depend_on_the_number_of_threads() {
    let on = |threads: usize| -> Vec<Sweep> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| run_plan(&plan([1e-4, 0.2], SweepDirection::Both), &NoProgress))
    };
    let points = |sweeps: Vec<Sweep>| -> Vec<_> {
        sweeps.into_iter().map(|s| (s.heading, s.points)).collect()
    };
    let (one, four) = (points(on(1)), points(on(4)));
    assert_eq!(one[0].0, SweepHeading::Up);
    assert_eq!(one[1].1[0].offset, 0.2);
    assert_eq!(one, four);
}

/// `x ↦ (1 + p) x − x³`: for `0 < p < 1` the origin, where its sweeps would start, repels, and
/// `±√p` attract.
struct Pitchfork;

/// `x ↦ c + (x − c)/2` with `c = 10 p` within 1 of `c`; elsewhere, and for `0.5 < p < 0.51`, orbits
/// escape.
struct Islands;

/// A map of one coordinate and one parameter by its image and slope.
fn one_step([value, slope]: [f64; 2], image: &mut [f64], jacobian: Option<&mut [f64]>) -> StepInfo {
    image[0] = value;
    if let Some(jacobian) = jacobian {
        jacobian[0] = slope;
    }
    StepInfo::default().checked(image)
}

macro_rules! map_of_one_coordinate {
    ($name:ident, $law:expr) => {
        impl DiscreteMap for $name {
            fn dimension(&self) -> usize {
                1
            }
            fn parameters(&self) -> usize {
                1
            }
            fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
                one_step($law(state[0], parameters[0]), image, None)
            }
            fn step_jacobian(
                &self,
                state: &[f64],
                parameters: &[f64],
                image: &mut [f64],
                jacobian: &mut [f64],
            ) -> StepInfo {
                one_step($law(state[0], parameters[0]), image, Some(jacobian))
            }
        }
    };
}

map_of_one_coordinate!(Pitchfork, |x: f64, p: f64| [
    (1.0 + p) * x - x.powi(3),
    1.0 + p - 3.0 * x * x
]);
map_of_one_coordinate!(Islands, |x: f64, p: f64| {
    let centre = 10.0 * p;
    let stays = (x - centre).abs() < 1.0 && !(0.5..0.51).contains(&p);
    if stays { [0.5 * (centre + x), 0.5] } else { [1e3 * (x + 2.0), 1e3] }
});

/// The plan of a map of one coordinate over some values, upwards.
fn plan_of(
    map: impl DiscreteMap + 'static,
    offsets: Vec<f64>,
    starts: Vec<Vec<f64>>,
) -> DiagramPlan<'static> {
    let plan = plan([0.0, 1.0], SweepDirection::Up);
    let itinerary = plan.maps[0].itinerary().clone();
    DiagramPlan {
        maps: vec![Box::new(UnobservedSweep { map, itinerary })],
        request: SweepRequest { offsets, starts, ..plan.request.clone() },
        ..plan
    }
}

/// Last value of a sweep at every parameter value.
fn ends(sweep: &Sweep) -> Vec<f64> {
    let last = |point: &DiagramPoint| point.kept_values().last().unwrap_or(f64::NAN);
    sweep.points.iter().map(last).collect()
}

/// The origin is a numerical fixed point as well. At `p = 1e-4` a start beside it is still there,
/// within the tolerance of periods, when the period is determined.
#[test]
fn no_sweep_stays_on_a_fixed_point_that_repels() {
    for lowest in [0.1, 1e-4] {
        let plan = plan_of(Pitchfork, even_offsets([lowest, 0.5], 21), Vec::new());
        let sweep = &run_plan(&plan, &NoProgress)[0];
        for (point, end) in sweep.points.iter().zip(ends(sweep)) {
            let attracts = (end.abs() - point.offset.sqrt()).abs() < 1e-6;
            let unsettled = point.period == Period::NotFound && point.offset == 1e-4;
            assert!(attracts || unsettled, "{}: {end}", point.offset);
        }
    }
}

#[test]
fn every_start_has_a_sweep_of_its_own() {
    let starts = vec![vec![0.3], vec![-0.3]];
    let plan = plan_of(Pitchfork, even_offsets([0.1, 0.5], 11), starts.clone());
    let sweeps = run_plan(&plan, &NoProgress);
    assert_eq!(sweeps.len(), 2);
    for ((sweep, start), sign) in sweeps.iter().zip(&starts).zip([1.0, -1.0]) {
        assert_eq!(sweep.start.as_ref(), Some(start));
        assert!(ends(sweep).iter().all(|end| end * sign > 0.3), "{:?}", ends(sweep));
    }
}

#[test]
fn after_an_escape_a_sweep_goes_on_from_the_last_state_that_stayed() {
    let plan = plan_of(Islands, even_offsets([0.0, 1.0], 401), Vec::new());
    let sweep = &run_plan(&plan, &NoProgress)[0];
    for point in &sweep.points {
        let escapes = (0.5..0.51).contains(&point.offset);
        let expected = if escapes { Period::NotFound } else { Period::Periodic(1) };
        assert_eq!(point.period, expected, "{}", point.offset);
    }
}

/// The electrostatic oscillator beside the second codimension-two point of its paper: the grazing
/// orbit has a multiplier of 1.37, and the stable orbit with a contact lives between its fold and
/// its flip (`orbits`: -2.485e-7 and -1.80e-7).
#[test]
fn beside_a_repelling_graze_the_orbit_with_contact_is_found_and_no_period_repels() {
    let found = |observe: &str, range: &str, points: &str| {
        let set = [
            ("omega", "0.10100209348"),
            ("V", "0.36107652"),
            ("grazing.guess.theta", "-1.2"),
            ("diagram.0.range", range),
            ("diagram.0.points", points),
            ("diagram.0.transient", "1000"),
            ("diagram.0.keep", "200"),
            ("diagram.0.observe", observe),
            ("diagram.0.with", "[\"map\"]"),
        ];
        let text = crate::support::scenes::text("mems_scenario3");
        let (scene, orbit) = grazing_by(text, "mems_scenario3", &set);
        let expander = Expander::new(&scene, &orbit).expect("rigid");
        let map = expander.expand(MapOrders::new(5, 6)).expect("a simple graze");
        let diagram = diagram(&scene, &orbit, &map, &scene.diagrams[0], &NoProgress);
        (diagram.expect("V is active"), map, orbit)
    };
    for (range, points) in [("[-6e-5, 6e-5]", "241"), ("[-2.6e-7, -1.7e-7]", "46")] {
        let (by_x, map, orbit) = found("\"x\"", range, points);
        let (by_theta, ..) = found("\"theta\"", range, points);
        let section = &orbit.section_point;
        let map = HornerMap::new(&map);
        let (mut stable, mut periodic) = (0, 0);
        let rows = |diagram: &Diagram| -> Vec<DiagramPoint> {
            diagram.sweeps.iter().flat_map(|sweep| sweep.points.clone()).collect()
        };
        for (by_x, by_theta) in rows(&by_x).iter().zip(&rows(&by_theta)) {
            let Period::Periodic(period) = by_x.period else { continue };
            periodic += 1;
            let mut product = DMatrix::identity(2, 2);
            for (x, theta) in by_x.kept_values().zip(by_theta.kept_values()).take(period) {
                let state = [x - section[0].to_f64(), theta - section[2].to_f64()];
                let (mut image, mut rows) = ([0.0; 2], [0.0; 4]);
                map.step_jacobian(&state, &[by_x.offset, 0.0], &mut image, &mut rows);
                product = DMatrix::from_row_slice(2, 2, &rows) * product;
            }
            let multipliers = eigenvalues(&product).expect("finite");
            let largest = multipliers.iter().map(|value| value.norm()).fold(0.0, f64::max);
            assert!(largest < 1.0, "{}: {largest}", by_x.offset);
            let one = ContactsPerPeriod { contacts: 1, period: 1 };
            let inside = (-2.48e-7..-1.81e-7).contains(&by_x.offset);
            stable += usize::from(by_x.contacts == Some(one) && inside);
        }
        if points == "46" {
            assert!(stable >= 30, "{stable} of {periodic}");
        }
    }
}

/// A diagram of the linear oscillator over a few parameter values.
fn of_the_linear_oscillator(range: [f64; 2], points: usize, observe: Observable) -> Diagram {
    of_scene("linear", range, points, observe)
}

/// A diagram of a scene of the catalogue over a few parameter values.
fn of_scene(name: &str, range: [f64; 2], points: usize, observe: Observable) -> Diagram {
    let (scene, orbit) = grazing(name);
    let orders = MapOrders { smooth_order: 5, contact_weight: 8 };
    let map = Expander::new(&scene, &orbit).expect("rigid").expand(orders).expect("a simple graze");
    let request = grazemap::model::DiagramRequest {
        range,
        points,
        transient: 200,
        keep: 20,
        observe,
        with: vec![Method::Map, Method::Direct],
        ..scene.diagrams[0].clone()
    };
    diagram(&scene, &orbit, &map, &request, &NoProgress).expect("alpha is active")
}

#[test]
fn a_sweep_of_equal_ratios_is_drawn_on_a_logarithmic_axis() {
    let scale = |range: &str, scale: &str| {
        let keys = [("points", "5"), ("transient", "50"), ("keep", "4"), ("direction", "up")];
        let keys = keys.map(|(key, value)| (format!("diagram.0.{key}"), value.to_owned()));
        let own = [("diagram.0.range", range), ("diagram.0.scale", scale)];
        let own = own.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let scene = scene_with("linear", &[&keys[..], &own[..]].concat());
        let request = scene.diagrams[0].clone();
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("rigid");
        let map = expander.expand(MapOrders::new(3, 4)).expect("a simple graze");
        let diagram = diagram(&scene, &orbit, &map, &request, &NoProgress).expect("active");
        let (_, figure) = diagram_figures(&diagram).remove(0);
        figure.to_svg().expect("a figure that can be drawn");
        (figure.horizontal.scale, figure.guides.len())
    };
    assert_eq!(scale("[1e-8, 1e-3]", "log"), (AxisScale::Log10, 0));
    let (below, guides) = scale("[-1e-3, -1e-8]", "log");
    assert!(matches!(below, AxisScale::Symlog { threshold } if (threshold - 1e-9).abs() < 1e-20));
    assert_eq!(guides, 0);
    assert_eq!(scale("[1e-8, 1e-3]", "linear"), (AxisScale::Linear, 1));
}

#[test]
fn map_and_simulation_agree_before_grazing() {
    let diagram = of_the_linear_oscillator([-1e-3, -9e-4], 4, Observable::EventFunction);
    for (by_map, direct) in diagram.sweeps[0].points.iter().zip(&diagram.sweeps[2].points) {
        assert_eq!((by_map.period, by_map.end), (Period::Periodic(1), OrbitEnd::Completed));
        assert_eq!(by_map.contacts, Some(ContactsPerPeriod { contacts: 0, period: 1 }));
        assert_eq!(direct.period, Period::Periodic(1));
        // Simulation in double precision keeps about 14 digits of the gap.
        assert!((by_map.values[0] - direct.values[0]).abs() < 1e-12);
        assert!(
            by_map.lyapunov.is_some_and(|exponent| exponent < 0.0) && direct.lyapunov.is_none()
        );
    }
    assert!(diagram.speed_ratio.is_some());
}

/// The cantilever beam (docs/explanation/where-papers-err.md): with `zeta = 0.09` the orbit beyond
/// grazing has one impact in five periods.
#[test]
fn map_and_simulation_name_the_orbit_beyond_grazing_as_the_literature_does() {
    let range = [-4e-4, 8e-4];
    let diagram = of_scene("cantilever_0_09", range, 5, Observable::EventFunction);
    for sweep in [&diagram.sweeps[0], &diagram.sweeps[2]] {
        let names = sweep.points.iter().map(|point| point.orbit.as_ref());
        let names: Vec<_> = names.map(|name| name.map(ToString::to_string)).collect();
        let expected = ["(0,1)", "(0,1)", "(1,5)", "(1,5)", "(1,5)"];
        let expected = expected.map(|name| Some(name.to_owned()));
        assert_eq!(names, expected, "{:?}", sweep.method);
    }
}

#[test]
fn one_stop_of_two_is_hit_once_in_three_periods_by_map_and_by_simulation() {
    let range = [-1e-3, 1e-4];
    let observe = Observable::EventFunction;
    let diagram = of_scene("two_stops_t1_prestressed", range, 3, observe);
    assert_eq!(diagram.surfaces, ["left", "right"]);
    for sweep in [&diagram.sweeps[1], &diagram.sweeps[3]] {
        let names = sweep.points.iter().map(|point| point.orbit.as_ref());
        let names: Vec<_> = names.map(|name| name.map(ToString::to_string)).collect();
        // Downwards from before the graze; of the symmetric pair, either stop.
        assert_eq!(names[0].as_deref(), Some("(0,0,1)"), "{:?}", sweep.method);
        for name in &names[1..] {
            let name = name.as_deref();
            assert!(matches!(name, Some("(0,1,3)" | "(1,0,3)")), "{name:?} {:?}", sweep.method);
        }
    }
}

#[test]
fn tables_and_json_write_the_names_and_what_they_count() {
    let diagram = of_the_linear_oscillator([-1e-3, -9e-4], 2, Observable::EventFunction);
    let csv = diagram_rows(std::slice::from_ref(&diagram)).into_table().to_csv();
    let csv = csv.expect("a table");
    let mut lines = csv.lines();
    let header = lines.next().expect("a header");
    assert!(header.contains(",outside,\"orbit (stop,periods)\",value_1"), "{header}");
    assert!(lines.all(|line| line.contains(",0,\"(0,1)\",")), "{csv}");
    let json = serde_json::to_value(&diagram).expect("plain data");
    assert_eq!(json["surfaces"][0], "stop");
    let name = &json["sweeps"][0]["points"][0]["orbit"];
    assert_eq!((&name["hits"][0], &name["periods"]), (&0.into(), &1.into()));
}
