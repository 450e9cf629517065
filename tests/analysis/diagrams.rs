//! Bifurcation diagrams of a map known from the literature, and of the linear oscillator by the map
//! and by direct simulation.

use grazemap::analysis::NoProgress;
use grazemap::analysis::diagram::{
    Diagram, DiagramPlan, Sweep, SweepHeading, SweepRequest, UnobservedSweep, diagram, run_plan,
};
use grazemap::expansion::{Expander, MapOrders, MapWindow};
use grazemap::iteration::{
    ContactsPerPeriod, DiscreteMap, Itinerary, OrbitEnd, OrbitRequest, Period, StepInfo,
};
use grazemap::model::{Method, Observable, SweepDirection, even_offsets};
use grazemap::report::diagram_rows;

use crate::support::scenes::grazing;

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

/// The cantilever beam (docs/literature.md): with `zeta = 0.09` the orbit beyond grazing has one
/// impact in five periods.
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
    let csv =
        diagram_rows(std::slice::from_ref(&diagram)).into_table().and_then(|table| table.to_csv());
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
