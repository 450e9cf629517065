//! Input that is refused before anything is computed, display of faults, and standard input.

use std::fs;

use grazemap::model::{Scene, catalogue};

use super::{grazemap, grazemap_reading, json, scratch, text};

fn linear() -> &'static str {
    catalogue::text("linear").expect("in the catalogue")
}

#[test]
fn a_fault_far_to_the_right_is_shown_on_a_screen() {
    let folder = scratch();
    let spaces = " ".repeat(70_000);
    let wide = linear().replace("zeta = 0.05", &format!("{spaces}zeta = []"));
    let many = format!("{}[[{}", linear(), "diagram,[".repeat(20_000));
    for (name, source) in [("wide", wide), ("many", many)] {
        fs::write(folder.path().join("scene.toml"), source).expect("writable");
        let refused = grazemap(folder.path(), &["check", "scene.toml"]);
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{name}: {said}");
        assert!(said.starts_with("  error: ") && said.lines().count() < 15, "{name}: {said}");
        assert!(said.lines().all(|line| line.chars().count() <= 125), "{name}: {said}");
    }
}

#[test]
fn results_that_do_not_fit_in_memory_are_refused_before_anything_is_computed() {
    let folder = scratch();
    let chart = "\n[[chart]]\nparameters = [\"alpha\", \"omega\"]\npoints = 9\nkeep = 1000000000\n\
                 ranges = [[-1e-3, 1e-3], [-1e-3, 1e-3]]\n";
    fs::write(folder.path().join("scene.toml"), format!("{}{chart}", linear())).expect("writable");
    for command in ["check", "chart", "run"] {
        let refused = grazemap(folder.path(), &[command, "scene.toml"]);
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{command}: {said}");
        assert!(said.starts_with("error: the results take about "), "{command}: {said}");
    }
}

#[test]
fn orders_are_refused_before_an_orbit_is_looked_for() {
    let folder = scratch();
    // No orbit touches this stop: its search would end with exit code 1.
    let out_of_reach = ["--set", "delta=-1", "--set", "expansion.smooth_order=30"];
    for command in ["check", "expand", "emit", "diagram", "run"] {
        let refused = grazemap(folder.path(), &[&[command, "linear"], &out_of_reach[..]].concat());
        let said = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{command}: {said}");
        assert!(said.contains("the highest that is not refused is 23"), "{command}: {said}");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0, "{command}");
    }
    let located = grazemap(folder.path(), &[&["locate", "linear"], &out_of_reach[..]].concat());
    assert_eq!(located.status.code(), Some(1), "{}", text(&located.stderr));
}

#[test]
fn a_chain_of_many_states_at_high_orders_is_refused_before_it_is_expanded() {
    let mut scene = Scene::parse(linear(), "linear.toml").expect("in the catalogue");
    // Twelve variables: the model itself stays small.
    scene.model.states.extend((0..8).map(|state| format!("x{state}")));
    scene.expansion.orders = grazemap::model::Orders::Fixed(grazemap::MapOrders::new(12, 16));
    let refused = grazemap::expansion::check_orders(&scene).expect_err("too many");
    let said = refused.to_string();
    assert!(said.contains("smooth_order = 12") && said.contains("12 variables"), "{said}");
    assert!(said.contains("1251677700"), "{said}");
}

#[test]
fn an_override_of_the_active_parameters_leaves_out_the_windows_of_the_others() {
    let folder = scratch();
    let frozen = ["check", "linear", "--set", "expansion.active=[\"alpha\"]", "--json", "-"];
    assert_eq!(json(folder.path(), &frozen)["active"], serde_json::json!(["alpha"]));
    let named = [&frozen[..], &["--set", "window.parameter.omega=1e-3"]].concat();
    assert_eq!(grazemap(folder.path(), &named).status.code(), Some(2));
}

#[test]
fn every_scene_of_the_catalogue_passes_the_checks() {
    for name in catalogue::names() {
        let scene = Scene::of_catalogue(name).expect("without a fault");
        assert!(scene.check_diagrams().is_ok() && scene.check_charts().is_ok(), "{name}");
        assert!(scene.check_tangent_states().is_ok(), "{name}");
        assert_eq!(grazemap::expansion::check_orders(&scene), Ok(()), "{name}");
    }
}

#[test]
fn a_scene_and_starting_points_are_read_from_standard_input() {
    let folder = scratch();
    let checked = grazemap_reading(folder.path(), &["check", "-"], linear());
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    let refused = grazemap_reading(folder.path(), &["check", "-"], "[model]\nstates = 1\n");
    assert!(text(&refused.stderr).contains("[standard input:2:10]"), "{}", text(&refused.stderr));

    let states = "x,theta\n1e-6,1e-4\n";
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    fs::write(folder.path().join("linear.toml"), linear()).expect("writable");
    let image = |scene, states, input| {
        let arguments = ["image", scene, "--states", states];
        let done = grazemap_reading(folder.path(), &arguments, input);
        assert!(done.status.success(), "{}", text(&done.stderr));
        text(&done.stdout)
    };
    let expected = image("linear.toml", "states.csv", "");
    assert_eq!(image("linear.toml", "-", states), expected);
    assert_eq!(image("-", "states.csv", linear()), expected);
    let refused =
        grazemap_reading(folder.path(), &["image", "linear", "--states", "-"], "x\nfar\n");
    let said = text(&refused.stderr);
    assert!(said.contains("`far` in line 2 of standard input is no finite"), "{said}");
}

#[test]
fn a_point_outside_the_window_is_said_to_be_beyond_which_half_width() {
    let folder = scratch();
    let states = "x,theta,alpha\n1e-6,0.2,1e-6\n1e-6,0.3,0.1\n1e-6,1e-3,0\n";
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    let arguments = ["image", "linear", "--states", "states.csv", "--json", "-"];
    let done = grazemap(folder.path(), &arguments);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let said = text(&done.stderr);
    assert!(said.contains("2 of 3 points are outside the window"), "{said}");
    let beyond = "the half-width 5e-2 of `theta` (2)";
    assert!(said.contains(beyond) && said.contains("the half-width 1e-3 of `alpha` (1)"), "{said}");
    let images: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    let names = |row: usize| images[row]["outside"].as_array().cloned().unwrap_or_default();
    assert!(names(0).contains(&"theta".into()) && !names(0).contains(&"alpha".into()));
    assert!(names(1).contains(&"alpha".into()) && names(2).is_empty());
    assert_eq!((&images[0]["inside"], &images[2]["inside"]), (&0.into(), &1.into()));
    let window = &images[2]["window"];
    assert_eq!(
        (&window["bounds"][1]["name"], &window["bounds"][1]["value"]),
        (&"x".into(), &1e-3.into())
    );
    assert!(window["errors"][0]["error"].as_f64().is_some_and(|error| error < 1e-3), "{window}");
}

#[test]
fn commands_that_make_no_map_say_that_the_window_is_not_measured() {
    let folder = scratch();
    let said = |arguments: &[&str]| text(&grazemap(folder.path(), arguments).stdout);
    let checked = said(&["check", "linear"]);
    assert!(
        checked.contains("window      y^2 <= 1e-3, x ± 1e-3, theta ± 5e-2, alpha"),
        "{checked}"
    );
    assert!(checked.contains("`expand` measures open bounds"), "{checked}");
    let open = said(&["check", "linear", "--set", "window.state={}"]);
    assert!(open.contains("window      y^2 <= 1e-3, alpha ± 1e-3"), "{open}");
    let located = said(&["locate", "linear"]);
    assert!(located.ends_with("its map keeps its tolerance\n"), "{located}");
}
