//! Maps of orbits that hit before they graze, against direct simulation in double-double.

use grazemap::analysis::{DirectEnd, DirectImage};
use grazemap::convergence::{ConvergenceOptions, converge};
use grazemap::hybrid::HybridSystem;
use grazemap::model::{MapOrders, catalogue};
use grazemap::numeric::Dd;
use grazemap::pipeline::{FindGraze as _, Settled};
use grazemap::{Scene, analysis::NoProgress};

use crate::support::tiers;

/// Scenes of the catalogue and of `tests/data/hits`: one stop hit twice and the other grazed, one
/// stop hit and grazed, a compliant stop hit and a rigid one grazed, a stop grazed after hits of
/// both, and three whose orbits rest against the other stop, the last with two masses.
const SCENES: [&str; 7] =
    ["two_sided", "one_stop", "soft_left", "ball_in_capsule", "rests", "chatters", "two_masses"];

fn settled(name: &str, section: &str) -> Settled {
    let path = format!("{}/tests/data/hits/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let file = || std::fs::read_to_string(path).expect("the scene is part of the repository");
    let text = catalogue::text(name).map_or_else(file, str::to_owned);
    let scene = Scene::parse(&format!("{text}{section}"), name).expect("a scene");
    scene.graze().expect("an orbit").settle().expect("a section")
}

/// Offset of the gap's parameter at which the orbit does not touch.
const OPEN: f64 = 1e-9;

#[test]
fn a_point_beside_the_grazing_orbit_returns_with_its_hits() {
    for name in SCENES {
        for section in ["", "\n[section]\nkind = \"stroboscopic\"\nphase = \"grazing\"\n"] {
            let settled = settled(name, section);
            let (scene, orbit) = (settled.scene(), settled.orbit());
            let system = HybridSystem::new(&scene.model);
            let mut direct = DirectImage::<Dd>::new(&system, scene, orbit).expect("a section");
            let point = vec![Dd::ZERO; orbit.section.coordinates.len()];
            let mut opened = vec![Dd::ZERO; scene.expansion.active.len()];
            opened[0] = Dd::from(OPEN);
            let image = direct.image(&point, &opened).expect("finite offsets");
            assert_eq!((image.end, image.extra_contacts), (DirectEnd::Returned, 0), "{name}");
            for offset in image.offsets {
                // The return moves by up to 17 times the parameter, that of the capsule.
                assert!(offset.to_f64().abs() < 30.0 * OPEN, "{name}: {:e}", offset.to_f64());
            }
        }
    }
}

#[test]
fn errors_fall_at_the_rate_of_the_orders() {
    for name in tiers::part(&SCENES, 2) {
        // An image behind the rest knows nothing of the graze: the section follows the graze.
        let section = match *name {
            "rests" | "chatters" => "\n[section]\nkind = \"stroboscopic\"\nphase = 1.5\n",
            _ => "",
        };
        let settled = settled(name, section);
        let options = ConvergenceOptions {
            highest: Some(MapOrders::new(4, 5)),
            tolerance: 1e-3,
            fresh: 0,
            smooth_rates: 4,
            discontinuity_rates: 5,
            ..ConvergenceOptions::of(settled.scene())
        };
        let study = converge(settled.scene(), settled.orbit(), &options, &NoProgress);
        let study = study.expect("a study");
        let low = study.orders.iter().filter(|at| at.rate.measured.is_some());
        let mut count = 0;
        for result in low {
            let (measured, expected) = (result.rate.measured.unwrap(), result.rate.expected);
            count += 1;
            // Both leading terms may vanish for the directions sampled; a rate is never lower.
            assert!(measured > expected - 0.02, "{name} {:?}: {measured}", result.orders);
        }
        assert!(count >= 20, "{name}: {count} rates were measured");
    }
}
