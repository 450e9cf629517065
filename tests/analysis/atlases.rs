//! Diagrams, charts and basins by atlases, compared with direct simulation of the same requests.

use grazemap::analysis::NoProgress;
use grazemap::analysis::basin::{BasinRequest, basin};
use grazemap::analysis::chart::chart;
use grazemap::analysis::diagram::{DiagramPoint, diagram};
use grazemap::iteration::Period;
use grazemap::model::{ChartRequest, DiagramRequest, Method};

use crate::Case;

/// Largest difference of a value of a periodic orbit: the tolerance of an atlas in the widths of
/// its region, and what orbits of multipliers up to 0.99 make of it.
const APART: f64 = 1e-4;

/// Rigid stops and a compliant one, far outside the windows of their maps.
#[test]
fn diagrams_by_an_atlas_have_the_orbits_of_direct_simulation() {
    let systems = [
        ("linear", [-0.3, 1.2], 300, 0.99),
        ("mems", [-5e-3, 5e-3], 200, 0.9),
        ("cantilever_0_09", [-0.02, 0.02], 60, 0.9),
        ("soft_a", [-0.02, 0.02], 60, 0.5),
    ];
    for (name, range, points, least) in systems {
        let case = Case::new(name);
        let [direct, atlas] = [Method::Direct, Method::Atlas].map(|method| {
            let request = DiagramRequest {
                range,
                points,
                // Beside a crisis chaos lasts for hundreds of returns, of a length by chance.
                transient: 3000,
                with: vec![method],
                ..case.scene.diagrams[0].clone()
            };
            let found = diagram(&case.scene, &case.orbit, &case.map, &request, &NoProgress);
            found.expect("a good scene")
        });
        for (direct, atlas) in direct.sweeps.iter().zip(&atlas.sweeps) {
            assert!(atlas.by_map > least, "{name}: {}", atlas.by_map);
            for (exact, found) in direct.points.iter().zip(&atlas.points) {
                let at = (name, exact.offset);
                assert_eq!(found.period, exact.period, "{at:?}");
                assert_eq!(found.orbit, exact.orbit, "{at:?}");
                if exact.period == Period::NotFound {
                    continue;
                }
                // Orbits may be met at another of their points.
                let extent = |point: &DiagramPoint| {
                    let low = point.kept_values().fold(f64::INFINITY, f64::min);
                    [low, point.kept_values().fold(f64::NEG_INFINITY, f64::max)]
                };
                let (found, exact) = (extent(found), extent(exact));
                let mut ends = found.iter().zip(exact);
                assert!(ends.all(|(a, b)| (a - b).abs() <= APART), "{at:?} {found:?} {exact:?}");
            }
        }
    }
}

#[test]
fn charts_and_basins_by_an_atlas_have_the_labels_of_direct_simulation() {
    let case = Case::new("linear");
    let charts = [Method::Direct, Method::Atlas].map(|method| {
        let place = |wanted: &str| {
            let mut known = case.scene.model.parameters.iter();
            known.position(|parameter| parameter.name == wanted).expect("a parameter")
        };
        let request = ChartRequest {
            points: [40, 20],
            every_cell: true,
            transient: 600,
            keep: 16,
            with: vec![method],
            ..ChartRequest::new(["alpha", "omega"].map(place), [[0.2, 1.2], [-0.1, 0.1]])
        };
        let found = chart(&case.scene, &case.orbit, &case.map, None, &request, &NoProgress);
        found.expect("a good scene").remove(0)
    });
    let [direct, atlas] = charts;
    for (exact, found) in direct.cells.iter().zip(&atlas.cells) {
        assert_eq!(direct.class(&exact.attractor), atlas.class(&found.attractor));
    }
    assert!(atlas.by_map > 0.9, "{}", atlas.by_map);
    let basins = [Method::Direct, Method::Atlas].map(|method| {
        let plane = BasinRequest {
            parameters: vec![0.3, 0.0],
            ranges: [[-1.0, 1.0], [-0.5, 0.5]],
            points: [60, 60],
            every_cell: true,
            method,
            ..BasinRequest::over_the_window(&case.map)
        };
        basin(&case.scene, &case.orbit, &case.map, &plane, &NoProgress).expect("a good scene")
    });
    assert_eq!(basins[0].cells, basins[1].cells);
}
