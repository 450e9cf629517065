//! Basins of attraction against direct simulation, state by state.

use grazemap::analysis::basin::{Basin, BasinClass, BasinRequest, basin};
use grazemap::analysis::{AnalysisError, DirectMap, NoProgress};
use grazemap::hybrid::HybridSystem;
use grazemap::iteration::Period;
use grazemap::model::Method;
use grazemap::report::{basin_array, basin_rows};

use crate::Case;

/// Half-widths about the graze in which the orbit without contact has its basin, with that which
/// has one contact a period far away.
const PLANE: [[f64; 2]; 2] = [[-1e-3, 3e-4], [-6e-4, 6e-4]];

impl Case {
    /// Before the graze, where both attractors stand.
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

    /// The number of the attractor that a state comes to by direct simulation alone.
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

/// The attractors and shares do not depend on what follows the states.
#[test]
fn guarded_and_direct_basins_agree_and_the_map_alone_says_where_it_ends() {
    let case = Case::new("linear");
    let basins = [Method::Guarded, Method::Direct, Method::Map]
        .map(|method| case.basin(&case.basin_request([49, 33], method)).expect("a plane"));
    let [guarded, direct, map] = &basins;
    assert_eq!(guarded.cells, direct.cells);
    assert!(guarded.by_map > 0.05 && direct.by_map == 0.0 && map.by_map == 1.0);
    // What goes to the far attractor leaves the window on the way.
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
    assert!(basin.computed <= 16, "{} computed", basin.computed);
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
