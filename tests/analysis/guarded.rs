//! Guarded iteration: the map inside its window, direct simulation outside, point by point.

use grazemap::analysis::chart::{ChartClass, chart};
use grazemap::analysis::diagram::{Diagram, DiagramPoint, Sweep, diagram};
use grazemap::analysis::{
    DirectMap, GuardedMap, ImageRequest, ImageRow, NoProgress, Precision, Using, escape_bounds,
    images,
};
use grazemap::expansion::MapWindow;
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::{
    DiscreteMap, HornerMap, MapOrbit, OrbitEnd, OrbitRequest, Period, StepInfo,
};
use grazemap::model::{ChartRequest, DiagramRequest, Method, Scene};
use grazemap::numeric::Dd;
use grazemap_studies::agreement::{self, Agreement, Effort};

use crate::Case;
use crate::support::scenes;

impl Case {
    /// Scales the window by a share.
    fn narrowed(mut self, share: f64) -> Self {
        let MapWindow { depth, state, .. } = &mut self.map.window;
        *depth *= share;
        state.iter_mut().for_each(|width| *width *= share);
        self
    }

    fn diagram(&self, range: [f64; 2], points: usize, with: &[Method]) -> Diagram {
        let request = DiagramRequest {
            range,
            points,
            transient: 60,
            keep: 20,
            with: with.to_vec(),
            ..self.scene.diagrams[0].clone()
        };
        diagram(&self.scene, &self.orbit, &self.map, &request, &NoProgress).expect("active")
    }
}

/// Sweeps of a method.
fn by(diagram: &Diagram, method: Method) -> impl Iterator<Item = &Sweep> {
    diagram.sweeps.iter().filter(move |sweep| sweep.method == method)
}

fn points(diagram: &Diagram, method: Method) -> Vec<&DiagramPoint> {
    by(diagram, method).flat_map(|sweep| &sweep.points).collect()
}

#[test]
fn a_step_is_the_maps_inside_the_window_and_the_direct_return_outside() {
    let case = Case::new("cantilever_0_09");
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let map = HornerMap::new(&case.map);
    let window = &case.map.window;
    let guarded = GuardedMap::new(map.clone(), window, &direct);
    let mut seen = [0; 2];
    for number in 0..60 {
        let share = |step: f64| 3.0 * ((f64::from(number) * step).fract() - 0.5);
        let state = [share(0.618_034) * window.state[0], share(0.414_214) * window.state[1]];
        let parameters = [share(0.732_051) * window.parameter[0], 0.0];
        let mut expected = vec![0.0; 2];
        let step = map.step(&state, &parameters, &mut expected);
        let inside = window.holds(&state, &parameters, &[step.depth]);
        if !inside {
            direct.step(&state, &parameters, &mut expected);
        }
        let mut image = vec![0.0; 2];
        let step = guarded.step(&state, &parameters, &mut image);
        assert_eq!((&image, step.simulated), (&expected, !inside), "{state:?}");
        seen[usize::from(inside)] += 1;
    }
    assert!(seen.iter().all(|&count| count > 5), "{seen:?}");
}

/// Orbits in lanes agree with single orbits by the [`GuardedMap`], a separate implementation.
#[test]
fn lanes_are_guarded_as_one_orbit_is_to_the_last_bit() {
    let offsets = [-2e-4, 1e-5, 1e-4, 2e-4, 4e-4, 8e-4, 9e-3];
    let [mapped, simulated, ended] = lanes_against_one_orbit(0.3, &offsets, |_| vec![1.0, 10.0]);
    assert!(mapped > 40 && simulated > 40, "{mapped} by the map, {simulated} simulated");
    assert_eq!(ended, 0);
}

/// Every lane is inside its window until its orbit escapes, during a map's first steps.
#[test]
fn lanes_that_escape_inside_the_window_end_as_one_orbit_does() {
    let inside = |window: &[f64]| window.iter().map(|width| 0.1 * width).collect();
    let offsets = [-2e-4, 1e-5, 1e-4, 2e-4, 4e-4, 8e-4];
    let [mapped, simulated, ended] = lanes_against_one_orbit(30.0, &offsets, inside);
    assert!(mapped > 10 && simulated == 0, "{mapped} by the map, {simulated} simulated");
    assert!((1..6).contains(&ended), "{ended} escaped");
}

/// Numbers of steps by the map, of simulated steps, and of orbits that ended early, for orbits in
/// lanes that are compared with single ones. The window is scaled by a share; orbits escape at the
/// given bounds.
fn lanes_against_one_orbit(
    share: f64,
    offsets: &[f64],
    escape: fn(&[f64]) -> Vec<f64>,
) -> [usize; 3] {
    let case = Case::new("cantilever_0_09").narrowed(share);
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a good scene");
    let map = HornerMap::new(&case.map);
    let window = &case.map.window;
    let request = OrbitRequest::new(5, 40, &window.state).escaping_at(&escape(&window.state));
    let parameters: Vec<[f64; 2]> = offsets.iter().map(|&offset| [offset, 0.0]).collect();
    let own: Vec<&[f64]> = parameters.iter().map(|own| &own[..]).collect();
    let states = vec![&[1e-5, 1e-4][..]; own.len()];
    let mut lanes = map.freeze_lanes::<16>(&own);
    let mut fly = |wanted: &[bool], states: &[f64], images: &mut [f64], steps: &mut [_]| {
        for lane in (0..wanted.len()).filter(|&lane| wanted[lane]) {
            let place = 2 * lane..2 * lane + 2;
            let image = &mut images[place.clone()];
            steps[lane] = direct.step(&states[place], own[lane], image);
        }
    };
    let orbits = lanes.guarded_orbits(&states, &request, window, &mut fly);
    let mut counts = [0; 3];
    for (lane, orbit) in orbits.iter().enumerate() {
        let frozen = map.freeze(own[lane]);
        let alone = GuardedMap::frozen(frozen, own[lane], window, &direct);
        assert_eq!(*orbit, MapOrbit::of(&alone, states[lane], &[], &request), "{lane}");
        for step in &orbit.steps {
            counts[usize::from(step.simulated)] += 1;
        }
        counts[2] += usize::from(orbit.end != OrbitEnd::Completed);
    }
    counts
}

#[test]
fn inside_the_window_a_guarded_sweep_is_the_maps() {
    let case = Case::new("linear");
    let diagram = case.diagram([-9e-4, -1e-4], 40, &[Method::Map, Method::Guarded]);
    let (map, guarded) = (points(&diagram, Method::Map), points(&diagram, Method::Guarded));
    assert_eq!(map, guarded);
    for sweep in by(&diagram, Method::Guarded) {
        assert_eq!((sweep.by_map, sweep.outside), (1.0, 0.0));
    }
}

/// A window without a parameter leaves all iterates to direct simulation.
#[test]
fn outside_the_window_a_guarded_sweep_is_direct_simulations() {
    let case = Case::new("linear");
    let diagram = case.diagram([2e-3, 5e-3], 12, &[Method::Guarded, Method::Direct]);
    let (guarded, direct) = (points(&diagram, Method::Guarded), points(&diagram, Method::Direct));
    for (guarded, direct) in guarded.iter().zip(direct) {
        assert_eq!((guarded.by_map, guarded.outside), (0.0, 1.0));
        assert_eq!((guarded.period, &guarded.orbit), (direct.period, &direct.orbit));
        assert_eq!(guarded.lyapunov, None);
        assert_eq!(direct.by_map, 0.0);
        // Farther than 1000 half-widths of the window, which is no escape.
        assert_eq!((guarded.end, direct.end), (OrbitEnd::Completed, OrbitEnd::Completed));
    }
}

/// The steady state of the linear oscillator that reaches the stop at 1 swings from −1 to 1; its
/// phase goes round and leaves no bound.
#[test]
fn an_orbit_has_escaped_at_so_many_extents_of_the_grazing_orbit_as_the_scene_says() {
    let said = scenes::scene_with("linear", &[("direct.escape", "2.5")]);
    for (scene, times) in [(scenes::scene("linear"), 100.0), (said, 2.5)] {
        let case = Case::of(scene);
        let bounds = escape_bounds(&case.scene, &case.orbit);
        let names: Vec<&str> = bounds.iter().map(|bound| &*bound.coordinate).collect();
        assert_eq!(names, ["x", "theta"]);
        // The orbit is sampled at the graze and half a period later.
        assert!((bounds[0].offset / (times * 2.0) - 1.0).abs() < 1e-9, "{bounds:?}");
        assert_eq!(bounds[1].offset, f64::INFINITY);
    }
}

/// Beyond the graze the section points of the linear oscillator's impacting orbit lie between a ten
/// thousandth of the extent of the grazing orbit and ten times that extent from the graze.
#[test]
fn a_guarded_orbit_ends_at_the_bound_of_the_scene() {
    for (times, escapes) in [("10.0", false), ("0.0001", true)] {
        let case = Case::of(scenes::scene_with("linear", &[("direct.escape", times)]));
        let diagram = case.diagram([2e-3, 3e-3], 2, &[Method::Guarded, Method::Direct]);
        for method in [Method::Guarded, Method::Direct] {
            for point in points(&diagram, method) {
                let escaped = matches!(point.end, OrbitEnd::Escaped { .. });
                assert_eq!(escaped, escapes, "{times}: {point:?}");
            }
        }
    }
}

/// Attractors that cross the edge of a small window, in the built-in scene and in two others, have
/// the period, itinerary and values of direct simulation.
#[test]
fn guarded_and_direct_sweeps_settle_on_the_same_orbits_across_the_edge_of_the_window() {
    for (name, range) in
        [("cantilever_0_09", [-4e-4, 8e-4]), ("linear", [-5e-4, 5e-4]), ("foale", [-4e-4, 4e-4])]
    {
        let case = Case::new(name).narrowed(0.2);
        let diagram = case.diagram(range, 12, &[Method::Guarded, Method::Direct]);
        let both = points(&diagram, Method::Guarded).into_iter();
        let both = both.zip(points(&diagram, Method::Direct));
        let mut mixed = 0;
        for (guarded, direct) in both {
            if guarded.period != direct.period || guarded.end != direct.end {
                panic!("{name} at {}: {guarded:?}, {direct:?}", guarded.offset);
            }
            assert_eq!(guarded.orbit, direct.orbit, "{name} at {}", guarded.offset);
            mixed += usize::from((0.01..0.99).contains(&guarded.by_map));
        }
        println!("{name}: {mixed} values by both");
    }
}

#[test]
fn guarded_sweeps_do_not_depend_on_the_number_of_threads() {
    let case = Case::new("cantilever_0_09").narrowed(0.2);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let diagram = pool.install(|| case.diagram([-4e-4, 8e-4], 30, &[Method::Guarded]));
        diagram.without_timing()
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn cells_of_the_map_alone_beyond_its_window_are_outside_and_guarded_ones_are_not() {
    let case = Case::new("linear");
    let place = |name: &str| {
        let mut parameters = case.scene.model.parameters.iter();
        parameters.position(|known| known.name == name).expect("a parameter")
    };
    let ranges = [[-5e-4, 5e-4], [-5e-4, 3e-3]];
    let request = ChartRequest {
        points: [3, 8],
        every_cell: true,
        transient: 60,
        keep: 6,
        with: vec![Method::Map, Method::Guarded],
        ..ChartRequest::new(["omega", "alpha"].map(place), ranges)
    };
    let charts = chart(&case.scene, &case.orbit, &case.map, None, &request, &NoProgress);
    let [map, guarded]: [_; 2] = charts.expect("active").try_into().expect("one for each method");
    assert_eq!((map.method, guarded.method), (Method::Map, Method::Guarded));
    let outside = map.count(ChartClass::Outside);
    assert!(outside >= 12 && guarded.count(ChartClass::Outside) == 0, "{outside}");
    assert!(guarded.by_map > 0.1 && guarded.by_map < 0.8, "{:?}", guarded.by_map);
    for (map_cell, cell) in map.cells.iter().zip(&guarded.cells) {
        if map.class(&map_cell.attractor) != ChartClass::Outside {
            assert_eq!(map_cell.attractor.orbit, cell.attractor.orbit);
        }
    }
}

#[test]
fn guarded_images_are_the_maps_inside_and_direct_simulations_outside() {
    let case = Case::new("linear");
    let row = |x: f64, alpha: f64| ImageRow {
        state: [x, 1e-3].map(Dd::from).to_vec(),
        parameters: [alpha, 0.0].map(Dd::from).to_vec(),
    };
    let rows = vec![row(1e-4, 1e-4), row(-2e-4, -1e-3), row(5e-3, 0.0), row(1e-4, 2e-3)];
    let of = |using: Using| {
        let (rows, precision) = (rows.clone(), Precision::F64);
        let request = ImageRequest { rows, iterations: 1, using, precision };
        images(&case.scene, &case.orbit, &case.map, &request).expect("fitting rows")
    };
    let (map, direct, guarded) = (of(Using::Map), of(Using::Direct), of(Using::Guarded));
    let inside: Vec<bool> = guarded.iter().map(|record| record.inside()).collect();
    assert_eq!(inside, [true, true, false, false]);
    assert_eq!(guarded, [&map[..2], &direct[2..]].concat());
}

/// A small form of the study `guarded agree`.
#[test]
fn every_difference_of_guarded_and_direct_sweeps_is_explained() {
    for name in ["cantilever_0_09", "soft_b", "two_stops_t1_prestressed"] {
        let scene = Scene::of_catalogue(name);
        let effort = Effort { values: 24, transient: 200, keep: 40 };
        let found = agreement::of_scene(scene.expect("a good scene"), &effort).expect("it grazes");
        for Agreement { name, by_map, same, unexplained, difference, .. } in found {
            assert!(unexplained.is_empty(), "{name}: {unexplained:?}");
            assert!(same >= 8 && by_map < 1.0, "{name}: {same}, {by_map}");
            // Bound relative to the half-width: the error of a map of orders 5 and 6 over some
            // iterates.
            assert!(difference < 1e-3, "{name}: {difference:e}");
        }
    }
}

/// A period whose points are many windows apart is found with the tolerance of its own extent.
#[test]
fn a_period_larger_than_the_window_is_found_in_its_own_extent() {
    struct Approaching;
    impl DiscreteMap for Approaching {
        fn dimension(&self) -> usize {
            1
        }
        fn parameters(&self) -> usize {
            1
        }
        fn step(&self, state: &[f64], parameters: &[f64], image: &mut [f64]) -> StepInfo {
            // Between p and −p, approached by half each time.
            let goal = -parameters[0] * state[0].signum();
            image[0] = goal + 0.5 * (state[0] + goal);
            StepInfo::default().checked(image)
        }
        fn step_jacobian(
            &self,
            state: &[f64],
            parameters: &[f64],
            image: &mut [f64],
            jacobian: &mut [f64],
        ) -> StepInfo {
            jacobian[0] = 0.5;
            self.step(state, parameters, image)
        }
    }
    // After 30 iterates the approach moves by 1e-9 of the orbit's size.
    let request = OrbitRequest::new(30, 8, &[1e-6]).escaping_at(&[10.0]);
    let period = |p: f64| MapOrbit::of(&Approaching, &[1.5 * p], &[p], &request).period;
    assert_eq!(period(1.0), Period::Periodic(2));
    assert_eq!(period(1e-3), Period::Periodic(2));
}

/// The diagrams and charts of the built-in scene are computed where its map was measured, or
/// simulated.
#[test]
fn the_pictures_of_the_built_in_scene_are_not_beyond_its_window() {
    let name = "cantilever_3_5_soft";
    let scene = Scene::of_catalogue(name);
    let scene = scene.expect("a good scene");
    for chart in &scene.charts {
        assert_eq!(chart.with, [Method::Guarded]);
        for (&parameter, range) in chart.parameters.iter().zip(chart.ranges) {
            let width = scene.window.parameter[parameter];
            assert!(range.iter().all(|end| end.abs() <= width), "{range:?} in {width}");
        }
    }
    let case = Case::new(name);
    let alone = scene.diagrams.iter().filter(|diagram| diagram.with.contains(&Method::Map));
    for diagram in alone {
        let drawn = case.diagram(diagram.range, 40, &[Method::Map]);
        assert!(by(&drawn, Method::Map).all(|sweep| sweep.outside == 0.0));
    }
}
