//! What is said of a window that is deeper than its map, against direct simulation and at the
//! command line.

use std::process::Output;

use grazemap::analysis::direct_image;
use grazemap::expansion::{Expander, MapOrders, WindowEdge};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::catalogue;
use grazemap::numeric::Dd;

use crate::cli::{grazemap, scratch};
use crate::support::scenes::{orbit, scene_with};

fn said(output: &Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A scene, its overrides, and the offset of the first coordinate that makes a depth of 1.
type Case = (&'static str, &'static [(&'static str, &'static str)], f64);

/// The error at the usable depth, of what the contact does: below the share it was computed from,
/// which sums absolute values and so is an upper estimate, and not so far below that the warning
/// would be idle.
#[test]
fn at_the_usable_depth_a_map_has_two_digits_of_what_the_contact_does() {
    let cases: [Case; 4] = [
        ("cantilever_3_5", &[], -1.0),
        ("cantilever_4_5", &[], -1.0),
        ("soft_a", &[("k2", "1e6")], 1.0),
        ("soft_b", &[("k2", "1e4")], 1.0),
    ];
    let orders = MapOrders { smooth_order: 6, contact_weight: 6 };
    for (name, overrides, sign) in cases {
        let scene = scene_with(name, overrides);
        let orbit = orbit(&scene);
        let expander = Expander::new(&scene, &orbit).expect("an analytic law");
        let edge = expander.window_edge(0, orders.contact_weight).expect("a series");
        let depth = edge.expect("an infinite series").usable_depth;
        let (state, parameters) = ([sign * depth, 0.0], [0.0; 2]);

        let lifted = state.map(Dd::from);
        let truth = direct_image(&scene, &orbit, &lifted, &[Dd::ZERO; 2]).expect("an image");
        let mut image = [0.0; 2];
        let map = expander.expand(orders).expect("an expansion");
        HornerMap::new(&map).step(&state, &parameters, &mut image);
        let smooth = expander.smooth(orders.smooth_order).expect("legs");
        let point = [state, parameters].concat();
        let distance = |from: &dyn Fn(usize) -> f64| {
            let theta = truth.offsets[1].hi - from(1);
            (truth.offsets[0].hi - from(0)).hypot(theta)
        };
        let error = distance(&|k| image[k]) / distance(&|k| smooth.image[k].evaluate(&point));
        println!("{name}: depth {depth:.2e}, error {error:.1e}");
        assert!(error < WindowEdge::LARGEST_SHARE, "{name}: {error:e}");
        assert!(error > 0.05 * WindowEdge::LARGEST_SHARE, "{name}: {error:e}");
    }
}

#[test]
fn a_stop_too_stiff_for_its_window_is_said_by_every_command_that_maps() {
    let folder = scratch();
    let states = folder.path().join("states.csv");
    std::fs::write(&states, "u\n-1e-6\n").expect("a writable folder");
    let (states, out) = (states.to_string_lossy(), folder.path().to_string_lossy());
    let stiff = ["soft_b", "--set", "k2=1e6"];
    let commands: [&[&str]; 4] =
        [&["expand"], &["emit", "-o", &out], &["diagram"], &["image", "--states", &states]];
    for command in commands {
        let arguments = [command, &stiff].concat();
        let warned = said(&grazemap(folder.path(), &arguments));
        let warnings: Vec<_> = warned.lines().filter(|line| line.contains("diverge")).collect();
        assert_eq!(warnings.len(), 1, "{command:?}: {warned}");
        assert!(warnings[0].starts_with("warning: `soft_b`: at the edge of the window"));
        assert_eq!(said(&grazemap(folder.path(), &[&arguments[..], &["-q"]].concat())), "");
    }
    let places =
        ["/depth/window_edge", "/modules/0/window_edges/0", "/0/window_edges/0", "/0/window_edge"];
    for (command, place) in commands.into_iter().zip(places) {
        let output = grazemap(folder.path(), &[command, &stiff, &["--json", "-"]].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let edge = json.pointer(place).expect("an edge");
        assert!(
            edge["omitted_share"].as_f64() > Some(1.0) && edge["depth"] == 1e-4,
            "{command:?}: {edge}"
        );
    }
}

#[test]
fn no_scene_of_the_catalogue_has_a_window_deeper_than_its_map() {
    let folder = scratch();
    for name in catalogue::names() {
        let warned = said(&grazemap(folder.path(), &["expand", name]));
        assert!(!warned.contains("warning"), "{name}: {warned}");
    }
}
