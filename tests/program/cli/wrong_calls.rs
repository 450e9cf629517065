//! Each wrong call of [`wrong_calls`] must end with the exit code and the message recorded in
//! `tests/program/cli/NAME.expected`; `UPDATE_EXPECTED=1 cargo test --test program wrong_calls::`
//! writes those anew.

use std::fs;
use std::path::{Path, PathBuf};

use super::orbits::wrong_orbits;
use super::outputs::wrong_outputs;
use super::{grazemap, scratch, text};

/// Wrong calls: a name, the arguments.
fn wrong_calls() -> Vec<(&'static str, Vec<&'static str>)> {
    vec![
        ("unknown_command", vec!["lokate", "linear"]),
        ("unknown_flag", vec!["locate", "linear", "--fast"]),
        ("chart_without_a_table", vec!["chart", "mems"]),
        ("diagram_options_without_a_parameter", vec!["diagram", "linear", "--method", "direct"]),
        ("chart_options_without_a_plane", vec!["chart", "linear", "--keep", "8"]),
        ("no_scene_named", vec!["locate"]),
        ("no_such_scene", vec!["check", "lineer"]),
        ("no_such_file", vec!["check", "nowhere/scene.toml"]),
        ("scene_is_a_folder", vec!["check", "."]),
        ("scene_is_not_text", vec!["check", "garbage.toml"]),
        ("set_without_value", vec!["check", "linear", "--set", "omega"]),
        ("set_unknown_parameter", vec!["check", "linear", "--set", "omgea=2"]),
        ("set_unknown_key", vec!["check", "linear", "--set", "expansion.smoth_order=3"]),
        ("set_not_a_number", vec!["check", "linear", "--set", "omega=fast"]),
        ("set_restitution_above_one", vec!["check", "linear", "--set", "r=1.5"]),
        ("set_order_absurd", vec!["check", "linear", "--set", "expansion.smooth_order=1000"]),
        (
            "reset_that_moves_a_touching_state",
            vec!["check", "linear", "--set", "model.surface.0.impact.v=0.01 - r*v"],
        ),
        (
            "window_of_a_frozen_parameter",
            vec!["check", "linear", "--set", "window.parameter.zeta=1e-3"],
        ),
        (
            "weight_of_a_frozen_parameter",
            vec!["check", "linear", "--set", "expansion.weights.zeta=4"],
        ),
        (
            "impact_beside_contact",
            vec!["check", "linear", "--set", "model.surface.0.contact.v=free"],
        ),
        ("orders_of_minutes", vec!["check", "linear", "--set", "expansion.smooth_order=30"]),
        ("standard_input_twice", vec!["image", "-", "--states", "-"]),
        ("new_unknown", vec!["new", "linaer"]),
        ("new_exists", vec!["new", "linear", "-o", "taken.toml"]),
        ("new_into_no_folder", vec!["new", "linear", "-o", "nowhere/linear.toml"]),
        ("new_without_name", vec!["new"]),
        ("json_into_no_folder", vec!["locate", "linear", "--json", "nowhere/orbit.json"]),
        ("json_onto_a_folder", vec!["locate", "linear", "--json", "folder"]),
        ("output_onto_a_file", vec!["locate", "linear", "-o", "taken.toml"]),
        ("order_beyond_memory", vec!["expand", "linear", "--set", "expansion.smooth_order=64"]),
        (
            "weight_beyond_memory",
            vec![
                "expand",
                "linear",
                "--set",
                "expansion.contact_weight=64",
                "--set",
                "expansion.active=[\"alpha\", \"omega\", \"zeta\", \"delta\"]",
            ],
        ),
        (
            "orbit_never_touches",
            vec!["locate", "linear", "--set", "grazing.solve_for=zeta", "--set", "delta=1.5"],
        ),
        ("stop_below_the_equilibrium", vec!["locate", "linear", "--set", "delta=-1"]),
        ("delta_at_the_equilibrium", vec!["locate", "linear", "--set", "delta=0"]),
        (
            "corner_at_the_graze",
            vec![
                "locate",
                "linear",
                "--set",
                "model.flow.v=alpha*cos(theta) - 2*zeta*v - x - 0.1*abs(x - delta)",
            ],
        ),
        (
            "corner_along_the_orbit",
            vec![
                "locate",
                "linear",
                "--set",
                "model.flow.v=alpha*cos(theta) - 2*zeta*v - x - 0.1*max(x, 0.3)",
            ],
        ),
        (
            "corner_of_dry_friction",
            vec!["locate", "linear", "--set", "model.flow.v=alpha*cos(theta) - 0.1*sign(v) - x"],
        ),
        (
            "corner_in_the_event",
            vec!["locate", "linear", "--set", "model.surface.0.event=delta - x + abs(v)"],
        ),
        (
            "two_parameters_solved_for",
            vec!["locate", "linear", "--set", "grazing.solve_for=[\"alpha\", \"omega\"]"],
        ),
        ("half_period_symmetry", vec!["locate", "linear", "--set", "grazing.symmetry=half-period"]),
        ("forcing_stands_still", vec!["locate", "linear", "--set", "omega=0"]),
        ("state_named_as_the_depth", vec!["expand", "depth_state.toml"]),
        ("image_without_states", vec!["image", "linear"]),
        ("image_no_such_file", vec!["image", "linear", "--states", "nowhere.csv"]),
        ("image_empty_file", vec!["image", "linear", "--states", "empty.csv"]),
        ("image_header_alone", vec!["image", "linear", "--states", "header.csv"]),
        ("image_unknown_column", vec!["image", "linear", "--states", "unknown.csv"]),
        ("image_column_twice", vec!["image", "linear", "--states", "twice.csv"]),
        ("image_not_a_number", vec!["image", "linear", "--states", "word.csv"]),
        ("image_not_finite", vec!["image", "linear", "--states", "infinite.csv"]),
        ("image_ragged", vec!["image", "linear", "--states", "ragged.csv"]),
        (
            "image_no_iterations",
            vec!["image", "linear", "--states", "good.csv", "--iterations", "0"],
        ),
        (
            "image_unknown_method",
            vec!["image", "linear", "--states", "good.csv", "--using", "magic"],
        ),
        (
            "image_unknown_precision",
            vec!["image", "linear", "--states", "good.csv", "--precision", "f16"],
        ),
        (
            "image_single_simulation",
            vec![
                "image",
                "linear",
                "--states",
                "good.csv",
                "--using",
                "direct",
                "--precision",
                "f32",
            ],
        ),
        ("image_far_away", vec!["image", "mems", "--states", "far.csv", "--using", "direct", "-q"]),
        ("basin_of_one_axis", vec!["basin", "linear", "--axes", "x"]),
        ("basin_off_the_section", vec!["basin", "linear", "--axes", "x,v"]),
        ("basin_range_of_no_axis", vec!["basin", "linear", "--range", "v=0:1"]),
        ("basin_range_backwards", vec!["basin", "linear", "--range", "x=1:0"]),
        ("curve_nearest_in_three", vec!["curve", "linear", "--nearest", "alpha,omega,zeta"]),
        (
            "curve_scale_of_another",
            vec!["curve", "linear", "--nearest", "alpha", "--scale", "omega=1"],
        ),
        ("curve_without_range", vec!["curve", "linear", "--with", "omega"]),
        (
            "curve_unknown_parameter",
            vec!["curve", "linear", "--with", "omgea", "--from", "1", "--to", "2"],
        ),
        (
            "curve_in_the_adjusted_parameter",
            vec!["curve", "linear", "--with", "alpha", "--from", "1", "--to", "2"],
        ),
        (
            "curve_not_finite",
            vec!["curve", "linear", "--with", "omega", "--from", "1.8", "--to", "inf"],
        ),
        (
            "diagram_of_a_frozen_parameter",
            vec!["diagram", "linear", "--set", "expansion.active=[\"omega\"]"],
        ),
        ("emit_nothing", vec!["emit"]),
        ("emit_in_another_language", vec!["emit", "linear", "--target", "cobol"]),
        ("emit_catalogue_in_c", vec!["emit", "--catalogue", "--target", "c"]),
        (
            "emit_catalogue_in_single_precision",
            vec!["emit", "--catalogue", "--set", "emit.precision=f32"],
        ),
        ("emit_check_of_nothing", vec!["emit", "linear", "--check", "-o", "nowhere"]),
        ("emit_onto_a_file", vec!["emit", "linear", "-o", "taken.toml"]),
        ("tolerance_out_of_reach", vec!["expand", "tolerance.toml"]),
        (
            "single_precision_out_of_reach",
            vec![
                "emit",
                "tolerance.toml",
                "--set",
                "expansion.tolerance=1e-12",
                "--set",
                "emit.precision=f32",
            ],
        ),
        (
            "any_precision_without_a_tolerance",
            vec!["emit", "linear", "--set", "emit.precision=any"],
        ),
        ("any_section_without_tolerance", vec!["expand", "linear", "--set", "section.kind=any"]),
        (
            "orders_beside_a_tolerance",
            vec![
                "expand",
                "linear",
                "--set",
                "expansion.tolerance=1e-6",
                "--set",
                "expansion.smooth_order=4",
            ],
        ),
        (
            "two_tolerances",
            vec![
                "check",
                "linear",
                "--set",
                "emit.tolerance=1e-6",
                "--set",
                "expansion.tolerance=1e-6",
            ],
        ),
        (
            "image_columns_of_another_section",
            vec![
                "image",
                "moving_stop",
                "--states",
                "good.csv",
                "--set",
                "expansion.tolerance=1e-6",
                "--set",
                "section.kind=any",
                "-q",
            ],
        ),
    ]
}

/// The files that wrong calls name.
fn set_up(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("writable");
    write("taken.toml", b"mine");
    write("garbage.toml", b"\xff\xfe\x00[model]");
    write("empty.csv", b"");
    write("header.csv", b"x,theta\n");
    write("good.csv", b"x,theta\n1e-6,1e-6\n");
    write("unknown.csv", b"x,phi\n1,2\n");
    write("twice.csv", b"x,x\n1,2\n");
    write("word.csv", b"x,theta\n1e-6,0\n1e-6,small\n");
    write("infinite.csv", b"x\ninf\n");
    write("ragged.csv", b"x,theta\n1\n");
    write("far.csv", b"x,theta\n0.6,0\n");
    fs::create_dir(folder.join("folder")).expect("writable");
    let linear = grazemap::model::catalogue::text("linear").expect("in the catalogue");
    let renamed = linear
        .replace("states = [\"x\", \"v\"]", "states = [\"y\", \"v\"]")
        .replace("x = \"v\"", "y = \"v\"")
        .replace("- x\"", "- y\"")
        .replace("{ x = ", "{ y = ");
    write("depth_state.toml", renamed.as_bytes());
    let tolerant = linear
        .replace("smooth_order = 5\n", "tolerance = 1e-30\n")
        .replace("contact_weight = 6\n", "");
    write("tolerance.toml", tolerant.as_bytes());
}

fn record(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/cli").join(format!("{name}.expected"))
}

#[test]
fn every_wrong_call_ends_with_its_recorded_message_and_exit_code() {
    let folder = scratch();
    set_up(folder.path());
    let update = std::env::var_os("UPDATE_EXPECTED").is_some();
    let mut differences = Vec::new();
    let calls = wrong_calls().into_iter().chain(wrong_orbits());
    for (name, arguments) in calls.chain(wrong_outputs()) {
        let output = grazemap(folder.path(), &arguments);
        let code = output.status.code().unwrap_or(-1);
        assert!(code == 1 || code == 2, "{name}: exit {code}: {}", text(&output.stderr));
        let found =
            format!("$ grazemap {}\nexit {code}\n{}", arguments.join(" "), text(&output.stderr));
        if update {
            fs::write(record(name), &found).expect("the record can be written");
        }
        let expected = fs::read_to_string(record(name)).unwrap_or_default();
        if found != expected {
            differences.push(format!("{name}: expected\n{expected}\nfound\n{found}"));
        }
    }
    assert!(differences.is_empty(), "{}", differences.join("\n"));
    assert_eq!(fs::read(folder.path().join("taken.toml")).expect("there"), b"mine");
}
