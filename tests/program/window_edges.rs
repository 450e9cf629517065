//! Warnings about a window deeper than its map, compared with direct simulation and at the command
//! line.

use std::process::Output;

use grazemap::analysis::direct_image;
use grazemap::expansion::{Expander, MapOrders, WindowEdge};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::model::catalogue;
use grazemap::numeric::Dd;

use crate::cli::{grazemap, scratch};
use crate::support::scenes::{orbit, scene_with};
use crate::support::tiers;

fn said(output: &Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Scene, overrides, and offset of the first coordinate that makes a depth of 1.
type Case = (&'static str, &'static [(&'static str, &'static str)], f64);

/// The error at the usable depth, relative to the effect of the contact, is below the share from
/// which that depth was computed (a sum of absolute values, thus an upper estimate), but not so far
/// below that the warning would be pointless.
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
    let places = [
        "/depth/0/window_edge",
        "/modules/0/window_edges/0",
        "/0/window_edges/0",
        "/0/window_edge",
    ];
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
    let names: Vec<&str> = catalogue::names().collect();
    for name in tiers::part(&names, 12) {
        let warned = said(&grazemap(folder.path(), &["expand", name]));
        assert!(!warned.contains("at the edge of the window"), "{name}: {warned}");
    }
}

#[test]
fn a_point_beyond_the_radius_of_the_series_is_not_inside() {
    let folder = scratch();
    // The radius in y is about 3.1e-7 at this stiffness, the depth that the scene states 1e-4.
    let states = "u\n1e-14\n1e-12\n5e-5\n";
    std::fs::write(folder.path().join("states.csv"), states).expect("a writable folder");
    let arguments = ["image", "soft_b", "--set", "k2=1e6", "--states", "states.csv", "--json", "-"];
    let output = grazemap(folder.path(), &arguments);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let inside = [0, 1, 2].map(|row| json[row]["inside"].as_u64());
    assert_eq!(inside, [Some(1), Some(0), Some(0)], "{json}");
}

/// No command once warned of errors of 6e-3 in images of a two-sided oscillator at these orders:
/// the truncation of the contacts is small at the edge of the window, that of the legs is not.
#[test]
fn a_map_that_errs_more_in_its_window_than_it_should_is_said_with_the_figure() {
    let folder = scratch();
    let low = ["--set", "expansion.smooth_order=1", "--set", "expansion.contact_weight=8"];
    let expand = |more: &[&str]| {
        let arguments = [&["expand", "two_stops_t1_rigid"], &low[..], more].concat();
        let output = grazemap(folder.path(), &arguments);
        (said(&output), output)
    };
    let (warned, _) = expand(&[]);
    assert_eq!(warned.lines().count(), 1, "{warned}");
    assert!(warned.contains("on its window the map of orders (1, 8) errs by up to"), "{warned}");
    assert!(warned.contains("more than 1e-6 of each half-width"), "{warned}");
    let (stated, _) = expand(&["--set", "emit.tolerance=1e-7"]);
    assert!(stated.contains("more than 1e-7, as the scene states"), "{stated}");
    let (silent, output) = expand(&["--set", "emit.tolerance=10", "--json", "-"]);
    assert_eq!(silent, "");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let window = &json["window"];
    assert_eq!(window["tolerance"]["error"], 10.0, "{window}");
    let figure = window["errors"][0]["error"].as_f64().expect("measured");
    assert!((1e-6..1.0).contains(&figure) && warned.contains('e'), "{window}");
}
