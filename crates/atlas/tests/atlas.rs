//! Atlases of maps in closed form, and of oscillators against direct simulation.

use grazemap_atlas::atlas::{
    Answer, Atlas, AtlasOptions, Cell, Expansion, FrozenLeaves, LeafKind, OptionsError, Patch,
    Piece, Region, RegionError, RestoreError, Side, StroboscopicReturn, Tabulated,
};
use grazemap_atlas::hybrid::HybridSystem;
use grazemap_atlas::jet::{Jet, JetSpace};
use grazemap_atlas::model::Scene;

/// The surface `√max(0, x − y²/4)` over `[−1, 1]²`, with or without the cut at its edge.
#[derive(Clone)]
struct RootSurface {
    cut: bool,
}

impl RootSurface {
    fn depth(cell: &Cell, order: usize) -> Jet<f64> {
        let space = JetSpace::uniform(2, order).expect("small");
        let axis = |axis: usize| {
            let offset = Jet::variable(&space, axis, 0.0).scale(cell.half[axis]);
            offset.add_constant(cell.centre[axis])
        };
        let (x, y) = (axis(0), axis(1));
        &x - &(&y * &y).scale(0.25)
    }
}

impl Tabulated for RootSurface {
    fn ranges(&self) -> Vec<[f64; 2]> {
        vec![[-1.0, 1.0]; 2]
    }

    fn scales(&self) -> Vec<f64> {
        vec![1.0]
    }

    fn image(&mut self, point: &[f64], image: &mut [f64]) -> bool {
        image[0] = (point[0] - 0.25 * point[1] * point[1]).max(0.0).sqrt();
        true
    }

    fn expand(&mut self, cell: &Cell, order: usize) -> Expansion {
        let depth = Self::depth(cell, order);
        let zero = Jet::zero(depth.space());
        let swing: f64 = depth.coefficients()[1..].iter().map(|value| value.abs()).sum();
        let piece = match depth.head() {
            head if self.cut && head.abs() <= swing => {
                let deepest = swing + head;
                let deep = JetSpace::new(&[2, 2, 1], 2 * order).expect("small");
                let root = Jet::variable(&deep, 2, 0.0).scale(deepest.sqrt());
                Piece::Grazed {
                    depth: Patch::new(&[depth.scale(1.0 / deepest)]),
                    missing: Patch::new(&[zero]),
                    touching: Patch::new(&[root]),
                }
            }
            head if head > 0.0 => Piece::Smooth(Patch::new(&[depth.sqrt()])),
            _ => Piece::Smooth(Patch::new(&[zero])),
        };
        Expansion::Piece(piece, None)
    }
}

fn leaves_of_the_root(cut: bool, tolerance: f64) -> (usize, f64) {
    let options = AtlasOptions { tolerance, order: 5, ..AtlasOptions::default() };
    let mut atlas = Atlas::new(RootSurface { cut }, options).expect("usable settings");
    atlas.make_all();
    let counts = atlas.counts();
    let found = atlas.measure(2000, || ());
    (counts.smooth + 2 * counts.grazed + counts.direct, found.largest_error)
}

#[test]
fn with_the_cut_two_polynomials_hold_a_square_root_surface() {
    let (polynomials, error) = leaves_of_the_root(true, 1e-12);
    assert_eq!(polynomials, 2);
    assert!(error < 1e-14, "{error:e}");
}

#[test]
fn without_the_cut_a_square_root_surface_takes_hundreds_of_polynomials_for_one_digit() {
    let (polynomials, _) = leaves_of_the_root(false, 0.1);
    assert!((100..10_000).contains(&polynomials), "{polynomials}");
}

#[test]
fn an_image_does_not_depend_on_the_points_that_came_before() {
    let options = AtlasOptions { tolerance: 0.05, order: 5, ..AtlasOptions::default() };
    let new = || Atlas::new(RootSurface { cut: false }, options.clone());
    let [mut forward, mut backward] = [(); 2].map(|()| new().expect("usable settings"));
    let points: Vec<[f64; 2]> = (0..400)
        .map(|index| [f64::from(index % 20), f64::from(index / 20)].map(|at| 0.1 * at - 0.97))
        .collect();
    let images = |atlas: &mut Atlas<RootSurface>, points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let image = |point: &[f64; 2]| {
            let mut image = [0.0];
            atlas.image(point, &mut image);
            image[0]
        };
        points.map(image).collect::<Vec<_>>()
    };
    let first = images(&mut forward, &mut points.iter());
    let mut second = images(&mut backward, &mut points.iter().rev());
    second.reverse();
    assert_eq!(first, second);
    assert_eq!(forward.counts(), backward.counts());
}

/// A ball that falls upwards, `x'' = 2`, onto a floor at `x = 0`, over a time of 2.
const BALL: &str = r#"
[model]
states = ["x", "v"]
parameters = { r = 0.5, omega = 1.0 }

[model.phase]
name = "theta"
rate = "omega"
period = "2"

[model.flow]
x = "v"
v = "2"

[[model.surface]]
name = "floor"
event = "x"
impact = { v = "-r*v" }

[grazing]
surface = "floor"
solve_for = "omega"
periods = 1

[section]
kind = "tangency"

[expansion]
active = ["r"]
smooth_order = 3
contact_weight = 3

[window]
depth = 1e-3
state = { v = 1e-3, theta = 1e-3 }
parameter = { r = 1e-3 }
"#;

/// Image of a point by the closed form: the gap is `x + v t + t²`.
fn ball([x, v]: [f64; 2]) -> [f64; 2] {
    let (restitution, end) = (0.5, 2.0);
    let depth = 0.25 * v * v - x;
    if depth <= 0.0 {
        return [x + v * end + end * end, v + 2.0 * end];
    }
    let y = depth.sqrt();
    let (speed, since) = (2.0 * restitution * y, end + 0.5 * v + y);
    [speed * since + since * since, speed + 2.0 * since]
}

fn of_catalogue(name: &str) -> Scene {
    Scene::of_catalogue(name).expect("a scene of the catalogue")
}

/// Return of a scene over a region, to a phase.
fn return_over<'s>(
    system: &'s HybridSystem,
    scene: &'s Scene,
    phase: f64,
    ranges: &[(&str, [f64; 2])],
) -> StroboscopicReturn<'s> {
    let region = Region::new(&scene.model, phase, 1, ranges).expect("a region");
    StroboscopicReturn::new(system, &scene.model, region).expect("a map")
}

fn atlas_of<'s>(
    system: &'s HybridSystem,
    scene: &'s Scene,
    phase: f64,
    ranges: &[(&str, [f64; 2])],
) -> Atlas<StroboscopicReturn<'s>> {
    let map = return_over(system, scene, phase, ranges);
    Atlas::new(map, AtlasOptions::default()).expect("usable settings")
}

#[test]
fn images_of_a_ball_are_exact_on_both_sides_of_its_graze() {
    let scene = Scene::parse(BALL, "ball.toml").expect("a scene");
    let system = HybridSystem::new(&scene.model);
    let ranges = [("x", [0.12, 0.28]), ("v", [-1.0, -0.8])];
    let mut atlas = atlas_of(&system, &scene, 0.0, &ranges);
    let (mut sides, mut image) = ([0, 0], [0.0; 2]);
    for index in 0..400 {
        let point =
            [0.125 + 0.0077 * f64::from(index % 20), -0.995 + 0.0097 * f64::from(index / 20)];
        match atlas.image(&point, &mut image) {
            Answer::Tabulated(Side::Missing) => sides[0] += 1,
            Answer::Tabulated(Side::Touching) => sides[1] += 1,
            answer => panic!("{point:?}: {answer:?}"),
        }
        let exact = ball(point);
        for (value, exact) in image.iter().zip(exact) {
            assert!((value - exact).abs() < 1e-12, "{point:?}: {image:?} {exact:?}");
        }
    }
    assert!(sides[0] > 50 && sides[1] > 50, "{sides:?}");
    let counts = atlas.counts();
    assert!(counts.grazed > 0 && counts.direct == 0, "{counts:?}");
}

fn measured(scene: &str, phase: f64, ranges: &[(&str, [f64; 2])], points: usize) {
    let scene = of_catalogue(scene);
    let system = HybridSystem::new(&scene.model);
    let mut atlas = atlas_of(&system, &scene, phase, ranges);
    let found = atlas.measure(points, || ());
    let counts = atlas.counts();
    assert!(found.violations.is_empty(), "{:e} {found:?}", found.largest_error);
    assert!(counts.grazed > 0 && found.tabulated > points * 9 / 10, "{counts:?} {found:?}");
}

#[test]
fn images_next_to_the_graze_of_the_linear_oscillator_are_within_the_tolerance() {
    measured("linear", 0.0, &[("x", [-1.1, -0.9]), ("v", [0.0, 0.3])], 2000);
}

#[test]
fn images_along_a_parameter_are_within_the_tolerance() {
    let ranges = [("x", [-1.02, -0.98]), ("v", [0.1, 0.2]), ("alpha", [2.24, 2.26])];
    measured("linear", 0.0, &ranges, 1000);
}

#[test]
fn iteration_ends_when_it_is_told_to_and_keeps_parameters() {
    let scene = of_catalogue("linear");
    let system = HybridSystem::new(&scene.model);
    let ranges = [("x", [-1.1, -0.9]), ("v", [0.0, 0.3]), ("alpha", [2.24, 2.2475])];
    let mut atlas = atlas_of(&system, &scene, 0.0, &ranges);
    // NOTE: below the grazing value of alpha the steady state has no contact; its amplitude is
    // alpha over that value. The multipliers are of size 0.84, so that errors add up to six times
    // the tolerance.
    let alpha: f64 = 2.243;
    let (mut steps, mut last) = (0, [0.0; 2]);
    atlas.iterate(&[-0.998, 0.1435, alpha], |image, _| {
        last.copy_from_slice(image);
        steps += 1;
        steps < 200
    });
    let amplitude = alpha / 2.247_220_505_424_423;
    let lag: f64 = 3.061_407_806_288_477;
    let exact = [amplitude * lag.cos(), amplitude * 1.8 * lag.sin()];
    assert_eq!(steps, 200);
    for (value, exact) in last.iter().zip(exact) {
        assert!((value - exact).abs() < 2e-6, "{last:?} {exact:?}");
    }
}

#[test]
fn points_outside_the_region_are_simulated() {
    let mut atlas = Atlas::new(RootSurface { cut: true }, AtlasOptions::default()).expect("usable");
    let mut image = [0.0];
    assert_eq!(atlas.image(&[4.0, 0.0], &mut image), Answer::Outside);
    assert_eq!(image, [2.0]);
}

#[test]
fn regions_and_settings_that_cannot_be_are_refused_with_what_was_given() {
    let model = of_catalogue("linear").model;
    let region = |ranges: &[(&str, [f64; 2])]| Region::new(&model, 0.0, 1, ranges);
    let (x, v) = (("x", [-1.0, 0.0]), ("v", [0.0, 1.0]));
    assert_eq!(region(&[x]), Err(RegionError::MissingState { name: "v".into() }));
    assert_eq!(region(&[x, v, x]), Err(RegionError::Repeated { name: "x".into() }));
    let unknown = region(&[x, v, ("beta", [0.0, 1.0])]).expect_err("there is no beta");
    assert_eq!(unknown.to_string(), "`beta` is neither a state nor a parameter of the model");
    let empty = region(&[x, ("v", [1.0, 1.0])]).expect_err("an empty range");
    assert!(empty.to_string().ends_with("1 to 1 was given"), "{empty}");
    let options = AtlasOptions { order: 2, ..AtlasOptions::default() };
    let refused = Atlas::new(RootSurface { cut: true }, options).err();
    assert_eq!(refused, Some(OptionsError::Order { found: 2, most: 20 }));
}

#[test]
fn beyond_the_most_boxes_points_are_simulated() {
    let options = AtlasOptions { tolerance: 0.05, boxes: 40, ..AtlasOptions::default() };
    let mut atlas = Atlas::new(RootSurface { cut: false }, options).expect("usable settings");
    let found = atlas.measure(500, || ());
    assert!(atlas.is_exhausted() && atlas.expanded() == 40);
    assert!(found.direct > 0 && found.tabulated > 0 && found.violations.is_empty(), "{found:?}");
    let shares = atlas.shares();
    assert!(shares.smooth > 0.0 && shares.smooth + shares.direct < 1.0, "{shares:?}");
}

#[test]
fn a_restored_atlas_gives_the_same_images_without_new_leaves() {
    let options = AtlasOptions { tolerance: 0.05, order: 5, ..AtlasOptions::default() };
    let mut made = Atlas::new(RootSurface { cut: false }, options).expect("usable settings");
    let images = |atlas: &mut Atlas<RootSurface>| -> Vec<u64> {
        let image = |index: usize| {
            let mut image = [0.0];
            let point = atlas.spread(index);
            atlas.image(&point, &mut image);
            image[0].to_bits()
        };
        (0..300).map(image).collect()
    };
    let first = images(&mut made);
    let saved = made.saved();
    let mut read = Atlas::restore(RootSurface { cut: false }, &saved, 0).expect("its own tree");
    assert_eq!(images(&mut read), first);
    assert_eq!((read.counts(), read.expanded()), (made.counts(), made.expanded()));
    assert_eq!(read.saved().ranges(), saved.ranges());
    let cut = Atlas::new(RootSurface { cut: true }, AtlasOptions::default());
    let cut = cut.expect("usable settings").saved();
    assert_ne!(cut, saved);
}

#[test]
fn an_atlas_of_another_region_is_not_restored() {
    let scene = of_catalogue("linear");
    let system = HybridSystem::new(&scene.model);
    let map =
        |high: f64| return_over(&system, &scene, 0.0, &[("x", [-1.1, high]), ("v", [0.0, 0.3])]);
    let atlas = Atlas::new(map(-0.9), AtlasOptions::default()).expect("usable settings");
    let refused = Atlas::restore(map(-0.8), &atlas.saved(), 10).err();
    assert!(matches!(refused, Some(RestoreError::Region { .. })), "{refused:?}");
}

#[test]
fn frozen_leaves_give_the_images_of_the_atlas() {
    let scene = of_catalogue("linear");
    let system = HybridSystem::new(&scene.model);
    let ranges = [("x", [-1.02, -0.98]), ("v", [0.1, 0.2]), ("alpha", [2.24, 2.26])];
    let mut atlas = atlas_of(&system, &scene, 0.0, &ranges);
    let alpha = 2.2473;
    let mut frozen = FrozenLeaves::new(&[alpha]);
    let (mut plain, mut reduced) = ([0.0; 2], [0.0; 2]);
    let (mut touching, mut missing) = (0, 0);
    for index in 0..200 {
        let point = atlas.spread(index);
        let answer = atlas.image(&[point[0], point[1], alpha], &mut plain);
        assert_eq!(frozen.image(&mut atlas, &point[..2], &mut reduced), answer);
        touching += usize::from(answer == Answer::Tabulated(Side::Touching));
        missing += usize::from(answer == Answer::Tabulated(Side::Missing));
        for (value, exact) in reduced.iter().zip(plain) {
            assert!((value - exact).abs() < 1e-13, "{point:?}: {reduced:?} {plain:?}");
        }
    }
    assert!(touching > 20 && missing > 20, "{touching} {missing}");
    let outside = frozen.image(&mut atlas, &[-1.5, 0.1], &mut reduced);
    assert_eq!(outside, Answer::Outside);
}

#[test]
fn boxes_fill_the_region_and_the_graze_curve_lies_where_the_word_changes() {
    let scene = Scene::parse(BALL, "ball.toml").expect("a scene");
    let system = HybridSystem::new(&scene.model);
    let ranges = [("x", [0.12, 0.28]), ("v", [-1.0, -0.8])];
    let mut atlas = atlas_of(&system, &scene, 0.0, &ranges);
    atlas.make_all();
    let boxes = atlas.boxes();
    let area: f64 = boxes.iter().map(|leaf| 4.0 * leaf.cell.half.iter().product::<f64>()).sum();
    assert!((area - 0.16 * 0.2).abs() < 1e-14, "{area}");
    let mut compared = 0;
    for leaf in boxes.iter().filter(|leaf| leaf.kind == LeafKind::Grazed) {
        assert_eq!(atlas.kind_at(&leaf.cell.centre), LeafKind::Grazed);
        for share in [-0.9, -0.3, 0.4, 0.8] {
            let point = [leaf.cell.centre[0] + share * leaf.cell.half[0], leaf.cell.centre[1]];
            let exact = 0.25 * point[1] * point[1] - point[0];
            let hits = atlas.map().word(&point).expect("it returns");
            assert_eq!(hits.len(), usize::from(exact > 0.0), "{point:?}");
            assert_eq!(atlas.depth_in(leaf.node, &point) > 0.0, exact > 0.0, "{point:?}");
            compared += 1;
        }
    }
    assert!(compared >= 4);
}
