//! Basins of attraction against direct simulation, state by state.

use grazemap::analysis::basin::{
    Basin, BasinClass, BasinRequest, ManifoldEnd, ManifoldKind, basin,
};
use grazemap::analysis::{AnalysisError, DirectImage, DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::Period;
use grazemap::model::Method;
use grazemap::numeric::{Dd, Scalar};
use grazemap::report::{basin_array, basin_rows};

use crate::Case;
use crate::support::scenes;

/// Half-widths about the graze of a region in which the orbit without contact has its basin, and
/// the attractor with one contact per period lies far away.
const PLANE: [[f64; 2]; 2] = [[-1e-3, 3e-4], [-6e-4, 6e-4]];

impl Case {
    /// Request before the graze, where both attractors exist.
    fn basin_request(&self, points: [usize; 2], method: Method) -> BasinRequest {
        BasinRequest {
            parameters: vec![-5e-4, 0.0],
            ranges: PLANE,
            points,
            method,
            ..BasinRequest::over_the_window(&self.map)
        }
    }

    fn basin(&self, request: &BasinRequest) -> Result<Basin, AnalysisError> {
        basin(&self.scene, &self.orbit, &self.map, request, &NoProgress)
    }

    /// Index of the attractor that a state reaches by direct simulation alone.
    fn goal(&self, direct: &DirectMap<'_>, basin: &Basin, start: &[f64]) -> Option<usize> {
        let parameters: Vec<f64> = basin.parameters.iter().map(|p| p.offset).collect();
        let mut state = start.to_vec();
        for _ in 0..150 {
            let image = direct.simulate(&state, &parameters);
            state = image.expect("an image of finite offsets").offsets;
        }
        let near = |point: &Vec<f64>| {
            point.iter().zip(&state).all(|(a, b)| (a - b).abs() < 1e-7 * (1.0 + a.abs()))
        };
        basin.attractors.iter().position(|found| found.attractor.states.iter().any(near))
    }
}

#[test]
fn states_on_both_sides_of_the_border_go_where_direct_simulation_takes_them() {
    let case = Case::new("linear");
    let basin = case.basin(&case.basin_request([120, 80], Method::Guarded)).expect("a plane");
    let itineraries = basin.attractors.iter().map(|found| {
        let itinerary = &found.attractor.itinerary;
        itinerary.as_ref().map(ToString::to_string).unwrap_or_default()
    });
    let mut itineraries: Vec<String> = itineraries.collect();
    itineraries.sort();
    assert_eq!(itineraries, ["0", "1"]);
    let columns = basin.axes[0].offsets.len();
    let differs = |cell: usize| {
        let other = basin.cells.get(cell + columns);
        other.is_some_and(|other| *other != basin.cells[cell])
    };
    let border = (0..basin.cells.len()).filter(|&cell| differs(cell));
    let border: Vec<usize> = border.flat_map(|cell| [cell, cell + columns]).collect();
    assert!(border.len() > 100, "{} cells at the border", border.len());
    let located: Vec<_> = basin.located().collect();
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a model to simulate");
    for cell in border {
        let (place, class) = located[cell];
        let goal = case.goal(&direct, &basin, &basin.state(place));
        assert_eq!(Some(class), goal.map(BasinClass::Attractor), "{place:?}");
    }
}

#[test]
fn a_basin_beside_a_graze_is_not_lost_where_the_window_is_much_larger() {
    let keys = [
        ("window.depth", "1.1e-3"),
        ("window.state", "{ x = 0.13, theta = 0.012 }"),
        ("window.parameter", "{ alpha = 1.5e-2 }"),
    ];
    let cases = [Case::new("linear"), Case::of(scenes::scene_with("linear", &keys))];
    for method in [Method::Guarded, Method::Direct] {
        let [near, far] = cases.each_ref().map(|case| {
            let basin = case.basin(&case.basin_request([40, 40], method)).expect("a plane");
            let mut shares: Vec<f64> =
                basin.attractors.iter().map(|found| found.share.fraction).collect();
            shares.sort_by(f64::total_cmp);
            shares
        });
        assert_eq!(near, far, "{method:?}");
        assert!(near[0] > 0.1, "{near:?}");
    }
}

#[test]
fn refined_basins_are_those_with_every_cell_followed() {
    let case = Case::new("linear");
    let request = case.basin_request([97, 61], Method::Guarded);
    let basin = case.basin(&request).expect("a plane");
    assert!(basin.computed < basin.cells.len() / 4, "{} computed", basin.computed);
    let system = HybridSystem::new(&case.scene.model);
    let direct = DirectMap::new(&system, &case.scene, &case.orbit).expect("a model to simulate");
    for (row, cells) in basin.cells.chunks(97).enumerate().step_by(7) {
        for (column, class) in cells.iter().enumerate().step_by(5) {
            let place = [basin.axes[0].offsets[column], basin.axes[1].offsets[row]];
            let goal = case.goal(&direct, &basin, &basin.state(place));
            assert_eq!(Some(*class), goal.map(BasinClass::Attractor), "{place:?}");
        }
    }
}

#[test]
fn a_basin_of_every_cell_fills_none_and_has_the_cells_of_a_refined_one() {
    let case = Case::new("linear");
    let refined = case.basin_request([41, 33], Method::Guarded);
    let every = BasinRequest { every_cell: true, ..refined.clone() };
    let [refined, every] = [refined, every].map(|request| case.basin(&request).expect("a plane"));
    assert_eq!((every.computed, every.probes.count), (41 * 33, 0));
    assert_eq!(refined.cells, every.cells);
    // Blocks away from the border have a probe each, and none of them differs.
    assert!(refined.probes.count > 5 && refined.probes.differing == 0, "{:?}", refined.probes);
}

/// Attractors and shares do not depend on the method of iteration.
#[test]
fn guarded_and_direct_basins_agree_and_the_map_alone_says_where_it_ends() {
    let case = Case::new("linear");
    let basins = [Method::Guarded, Method::Direct, Method::Map]
        .map(|method| case.basin(&case.basin_request([49, 33], method)).expect("a plane"));
    let [guarded, direct, map] = &basins;
    assert_eq!(guarded.cells, direct.cells);
    assert!(guarded.by_map > 0.05 && direct.by_map == 0.0 && map.by_map == 1.0);
    // States of the far attractor's basin leave the window on the way.
    let far = guarded.attractors.iter().position(|found| {
        found.attractor.states[0].iter().zip(&case.map.window.state).any(|(x, w)| x.abs() > *w)
    });
    let far = BasinClass::Attractor(far.expect("an attractor outside the window"));
    for (by_map, by_both) in map.cells.iter().zip(&guarded.cells) {
        assert_eq!(*by_both == far, *by_map == BasinClass::Outside);
    }
    assert_eq!(map.outside.count + map.attractors[0].share.count, map.cells.len());
}

#[test]
fn shares_sum_to_one_and_a_smooth_border_has_exponent_one() {
    let case = Case::new("linear");
    let basin = case.basin(&case.basin_request([256, 256], Method::Guarded)).expect("a plane");
    let shares = basin.attractors.iter().map(|found| found.share.fraction);
    assert!((shares.sum::<f64>() - 1.0).abs() < 1e-12);
    let uncertainty = basin.uncertainty.as_ref().expect("a border");
    assert!((uncertainty.exponent - 1.0).abs() < 0.05, "{uncertainty:?}");
    let coarser = case.basin(&case.basin_request([128, 128], Method::Guarded)).expect("a plane");
    for (coarse, fine) in coarser.attractors.iter().zip(&basin.attractors) {
        let (coarse, fine) = (&coarse.share, &fine.share);
        assert!((coarse.fraction - fine.fraction).abs() < coarse.boundary);
        assert!(fine.boundary < 0.6 * coarse.boundary);
    }
    let rows = basin_rows(&basin);
    let mut csv = Vec::new();
    rows.write_csv(&mut csv).expect("rows of one shape");
    assert!(csv.starts_with(b"x,theta,attractor\n"));
    assert_eq!(basin_array(&basin).expect("a full grid").len(), 128 + 8 * 256 * 256);
}

#[test]
fn the_attractor_of_a_window_alone_has_all_of_it() {
    let case = Case::new("linear");
    let request = BasinRequest {
        parameters: vec![-5e-4, 0.0],
        ranges: [[-3e-4, -1e-4], [-1e-4, 1e-4]],
        points: [20, 20],
        ..BasinRequest::over_the_window(&case.map)
    };
    let basin = case.basin(&request).expect("a plane");
    let [only] = &basin.attractors[..] else { panic!("{} attractors", basin.attractors.len()) };
    assert_eq!(only.attractor.period, Period::Periodic(1));
    assert_eq!((only.share.fraction, only.share.boundary, basin.border), (1.0, 0.0, 0.0));
    assert_eq!(basin.uncertainty, None);
    // Four columns and rows, and a probe in each of four blocks.
    assert!(basin.computed <= 16 + 4, "{} computed", basin.computed);
}

#[test]
fn what_is_no_plane_is_refused() {
    let case = Case::new("linear");
    let request = case.basin_request([8, 8], Method::Map);
    let same = BasinRequest { axes: [1, 1], ..request.clone() };
    assert!(matches!(case.basin(&same), Err(AnalysisError::NotAPlane { .. })));
    let missing = BasinRequest { axes: [0, 2], ..request.clone() };
    assert!(matches!(case.basin(&missing), Err(AnalysisError::NotAPlane { .. })));
    let endless = BasinRequest { ranges: [[f64::NAN; 2], PLANE[1]], ..request.clone() };
    assert!(matches!(case.basin(&endless), Err(AnalysisError::NoRange { .. })));
    let short = BasinRequest { parameters: vec![0.0], ..request };
    assert!(matches!(case.basin(&short), Err(AnalysisError::Length { .. })));
}

/// Request with manifolds before the graze of the linear oscillator, over the whole basin of the
/// orbit without contact.
fn with_manifolds(case: &Case, method: Method) -> BasinRequest {
    BasinRequest {
        ranges: [[-1e-3, 3e-4], [-9e-4, 8e-4]],
        manifolds: Some(1),
        ..case.basin_request([100, 100], method)
    }
}

/// The points of all pieces of the curves of a kind.
fn points(basin: &Basin, kind: ManifoldKind) -> impl Iterator<Item = &Vec<[f64; 2]>> {
    let manifolds = basin.manifolds.as_ref().expect("manifolds were asked for");
    let branches = manifolds.branches.iter().filter(move |branch| branch.kind == kind);
    branches.flat_map(|branch| &branch.pieces)
}

#[test]
fn the_border_of_a_basin_lies_on_the_stable_manifold_of_the_saddle() {
    let case = Case::new("linear");
    let basin = case.basin(&with_manifolds(&case, Method::Map)).expect("a plane");
    let manifolds = basin.manifolds.as_ref().expect("manifolds were asked for");
    let [saddle] = &manifolds.saddles[..] else { panic!("{:?}", manifolds.saddles) };
    assert_eq!(saddle.itinerary.to_string(), "1");
    assert!(saddle.multipliers[0] > 1000.0 && saddle.multipliers[1] < 1e-3);
    let cell = basin.axes.each_ref().map(|axis| axis.offsets[1] - axis.offsets[0]);
    // Between a cell and its neighbour of another class the border passes.
    let columns = basin.axes[0].offsets.len();
    let located: Vec<_> = basin.located().collect();
    let pairs = (0..located.len()).flat_map(|at| [(at, at + 1), (at, at + columns)]);
    let apart = |(a, b): &(usize, usize)| *b < located.len() && located[*a].1 != located[*b].1;
    let pairs: Vec<_> = pairs.filter(|(a, b)| b - a > 1 || b % columns > 0).filter(apart).collect();
    assert!(pairs.len() > 150, "{} pairs", pairs.len());
    for (a, b) in pairs {
        let middle = [0, 1].map(|axis| 0.5 * (located[a].0[axis] + located[b].0[axis]));
        let distance = |pair: &[[f64; 2]]| {
            let from_middle =
                |point: [f64; 2]| [0, 1].map(|axis| (point[axis] - middle[axis]) / cell[axis]);
            let (p, q) = (from_middle(pair[0]), from_middle(pair[1]));
            let leg = [q[0] - p[0], q[1] - p[1]];
            let size = (leg[0] * leg[0] + leg[1] * leg[1]).max(f64::MIN_POSITIVE);
            let share = (-(p[0] * leg[0] + p[1] * leg[1]) / size).clamp(0.0, 1.0);
            (p[0] + share * leg[0]).hypot(p[1] + share * leg[1])
        };
        let curves = points(&basin, ManifoldKind::Stable);
        let nearest = curves.flat_map(|piece| piece.windows(2)).map(distance);
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.75, "{middle:?} is {nearest} cells from the stable manifold");
    }
}

/// Points on the map's curve, flown by direct simulation in double-double. The multiplier of 1160
/// amplifies the curve's error away from the saddle.
#[test]
fn states_on_the_stable_manifold_come_to_the_saddle() {
    let case = Case::new("linear");
    let system = HybridSystem::new(&case.scene.model);
    let mut direct =
        DirectImage::<Dd>::new(&system, &case.scene, &case.orbit).expect("a model to simulate");
    let parameters = [Dd::from_f64(-5e-4), Dd::from_f64(0.0)];
    let basin = case.basin(&with_manifolds(&case, Method::Map)).expect("a plane");
    let manifolds = basin.manifolds.as_ref().expect("manifolds were asked for");
    let saddle = &manifolds.saddles[0].states[0];
    let (mut tried, mut farthest) = (0, 0.0_f64);
    for point in points(&basin, ManifoldKind::Stable).flatten().step_by(29) {
        let mut state = point.map(Dd::from_f64).to_vec();
        let mut nearest = f64::INFINITY;
        for _ in 0..12 {
            state = direct.image(&state, &parameters).expect("finite offsets").offsets;
            let apart = [(0, 6.5e-4), (1, 8.5e-4)];
            let apart = apart.map(|(axis, width)| (state[axis].to_f64() - saddle[axis]) / width);
            nearest = nearest.min(apart[0].hypot(apart[1]));
        }
        farthest = farthest.max(nearest);
        tried += 1;
    }
    assert!(tried > 40 && farthest < 1e-2, "{tried} points come within {farthest}");
}

/// The manifold has points without preimages at a graze, and continues beyond it.
#[test]
fn a_stable_manifold_of_direct_simulation_goes_on_where_preimages_are_lacking() {
    let case = Case::new("linear");
    let request = BasinRequest {
        ranges: [[-5e-5, 5e-5], [-9e-4, -2e-4]],
        points: [4, 4],
        ..with_manifolds(&case, Method::Direct)
    };
    let basin = case.basin(&request).expect("a plane");
    let manifolds = basin.manifolds.as_ref().expect("manifolds were asked for");
    assert!(manifolds.branches.iter().all(|branch| branch.end == ManifoldEnd::Plane));
    let pieces = points(&basin, ManifoldKind::Stable).filter(|piece| piece.len() > 200);
    assert_eq!(pieces.count(), 2);
}

#[test]
fn manifolds_are_refused_on_a_section_of_other_than_two_coordinates() {
    let case = Case::new("two_stops_t1");
    let request = BasinRequest {
        points: [2, 2],
        manifolds: Some(1),
        ..BasinRequest::over_the_window(&case.map)
    };
    let refused = case.basin(&request);
    assert!(matches!(refused, Err(AnalysisError::NotPlanar { dimension: 3.. })), "{refused:?}");
}
