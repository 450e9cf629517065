//! A stop that hardens: the discontinuity mapping by direct simulation in double-double against
//! numbers of its own (tests/data/soft/soft_to_rigid.json; README there), and the law by which it
//! tends to that of the rigid stop.
//!
//! The simulation is that of the study `soft_to_rigid`, which rests on it.

use grazemap::numeric::{Dd, Scalar};
use grazemap_studies::soft_to_rigid::family::{Family, Stop};
use grazemap_studies::soft_to_rigid::law::approach_law;
use serde_json::Value;

use crate::support::reference::{exact, read, text};

/// Allowed error, relative to the size of a jump or to the state it is a difference of (below 1).
const EXACT: f64 = 1e-26;
/// Stiffnesses above this: a contact shorter than 1e-5 of the fall, of which the simulation has
/// fewer digits.
const STIFFEST: f64 = 1e12;

fn cases() -> Vec<Value> {
    read("soft/soft_to_rigid.json")["system_A"].as_array().expect("cases").clone()
}

fn check(change: [Dd; 2], row: &Value, named: &str) {
    for (found, key) in change.into_iter().zip(["zdm_du", "zdm_dv"]) {
        let error = (found - exact(&row[key])).magnitude();
        assert!(error < EXACT, "{named} {key}: {error:e}");
    }
}

#[test]
fn jumps_of_stiffening_stops_and_of_the_rigid_one_are_those_of_closed_forms() {
    for case in cases() {
        let (m, y) = (text(&case["m"]), exact(&case["y"]));
        let rigid = Stop::rigid(m).direct().at(y);
        check(rigid.change, &case["rigid_r1"], "rigid");
        for row in case["rows"].as_array().expect("rows") {
            if exact(&row["k2"]).hi > STIFFEST {
                continue;
            }
            let stop = Family::A.stop(text(&row["k2"]), m);
            let jump = stop.direct().at(y);
            let named = format!("m {m} y {} k2 {}", case["y"], row["k2"]);
            check(jump.change, row, &named);
            let time =
                (jump.contact_time / exact(&row["contact_time"]) - Dd::from(1.0)).magnitude();
            assert!(time < 1e-20, "{named}: contact time {time:e}");
        }
    }
}

/// The next term of the law is `1/√k2` of the first one, times `√(a/2) /y` (the contact time's next
/// term) or 1.
#[test]
fn difference_to_the_rigid_stop_over_its_law_tends_to_one_as_the_root_of_the_stiffness() {
    for y in [1e-2, 1e-1] {
        let rigid = Stop::rigid("2.4").direct().at(Dd::from(y));
        for family in Family::ALL {
            let ratios = ["1e8", "1e10", "1e12"].map(|k2| {
                let (stop, stiffness) = (family.stop(k2, "2.4"), k2.parse().expect("a number"));
                let jump = stop.direct().at(Dd::from(y));
                let law = approach_law(&stop, &jump, stiffness, family.stop_damping());
                [0, 1].map(|k| (jump.change[k] - rigid.change[k]).to_f64() / law[k] - 1.0)
            });
            println!("{family:?} y {y:e}: {ratios:?}");
            for [before, after] in [[0, 1], [1, 2]] {
                for k in [0, 1] {
                    let factor = ratios[before][k] / ratios[after][k];
                    assert!((9.0..11.0).contains(&factor), "{family:?}: {factor}");
                }
            }
        }
    }
}
