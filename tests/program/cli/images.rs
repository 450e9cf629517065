//! Images of section points, by maps and by direct simulation.

use std::fs;

use grazemap::numeric::Dd;

use super::{grazemap, scratch, text};

#[test]
fn images_by_map_and_by_simulation_agree_and_the_columns_are_those_promised() {
    let folder = scratch();
    fs::write(folder.path().join("states.csv"), "theta,alpha\n1e-4,1e-6\n-2e-4,0\n")
        .expect("writable");
    let image = |using: &str, precision: &str| {
        let arguments = [
            "image",
            "linear",
            "--states",
            "states.csv",
            "--using",
            using,
            "--precision",
            precision,
            "--iterations",
            "2",
        ];
        let output = grazemap(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let (map, direct) = (image("map", "f64"), image("direct", "dd"));
    assert!(map.starts_with("row,iteration,x,theta,contacts,inside\n0,1,"), "{map}");
    assert!(
        direct.starts_with("row,iteration,x,theta,contacts,inside,extra_contacts\n0,1,"),
        "{direct}"
    );
    assert_eq!((map.lines().count(), direct.lines().count()), (5, 5));
    let numbers = |table: &str| -> Vec<f64> {
        let cells = table.lines().skip(1).flat_map(|line| line.split(',').skip(2).take(2));
        cells.map(|cell| cell.parse().expect("a number")).collect()
    };
    for (a, b) in numbers(&map).into_iter().zip(numbers(&direct)) {
        // The second images start some 1e-3 away, where the orders (5, 6) leave a few 1e-9.
        assert!((a - b).abs() < 1e-8, "{a:e} {b:e}");
    }
}

#[test]
fn images_of_a_scene_that_flies_its_contacts_are_exact_where_its_series_end() {
    let folder = scratch();
    // The depth at the graze, a thousand times beyond the radius of the series in y² (3e-7).
    fs::write(folder.path().join("states.csv"), "u\n5e-4\n").expect("a file can be written");
    let offsets = |using: &str| -> Vec<f64> {
        let states = ["--states", "states.csv", "--using", using, "--csv", "-", "-q"];
        let arguments = [&["image", "soft_a_stiff"], &states[..]].concat();
        let output = grazemap(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let csv = text(&output.stdout);
        let row = csv.lines().nth(1).expect("a row").split(',');
        let numbers = row.skip(2).take(2);
        numbers.map(|number| number.parse().expect("a number")).collect()
    };
    let (map, direct) = (offsets("map"), offsets("direct"));
    for (map, direct) in map.iter().zip(&direct) {
        // Degree 6 of the legs leaves 1e-7 at y = 0.02; the series is off by more than 1.
        assert!((map - direct).abs() < 1e-6, "{map} {direct}");
    }
}

fn reference_error(arguments: &[&str]) -> f64 {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/rigid/public_linear_w1.8.json");
    let data: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(path).expect("there")).expect("JSON");
    let rows = data["rows"].as_array().expect("rows");
    let word = |value: &serde_json::Value| value.as_str().expect("a decimal").to_owned();
    let mut states = "x,theta,alpha,omega\n".to_owned();
    for row in rows {
        let cells = [
            &row["x_minus_delta"],
            &row["dtheta"],
            &row["param_offsets"][0],
            &row["param_offsets"][1],
        ];
        states += &format!("{}\n", cells.map(word).join(","));
    }
    let folder = scratch();
    fs::write(folder.path().join("states.csv"), states).expect("writable");
    let output = grazemap(
        folder.path(),
        &[&["image", "linear", "-q", "--states", "states.csv"], arguments].concat(),
    );
    assert!(output.status.success(), "{}", text(&output.stderr));
    let number = |decimal: &str| Dd::from_decimal(decimal).expect("a decimal");
    let mut worst: f64 = 0.0;
    for (line, row) in text(&output.stdout).lines().skip(1).zip(rows) {
        let cells: Vec<&str> = line.split(',').collect();
        for (cell, key) in cells[2..4].iter().zip(["x_minus_delta", "dtheta"]) {
            worst =
                worst.max((number(cell) - number(&word(&row["images"][0][key]))).abs().to_f64());
        }
    }
    worst
}

#[test]
fn reference_images_are_met_to_double_double_and_by_the_map_to_rounding() {
    // A simulated period costs some hundred roundings of numbers of order 1.
    assert!(reference_error(&["--using", "direct", "--precision", "dd"]) < 1e-27);
    assert!(reference_error(&["--using", "direct"]) < 1e-11);
    let orders = ["--set", "expansion.smooth_order=8", "--set", "expansion.contact_weight=10"];
    assert!(reference_error(&orders) < 1e-13);
}

/// A ball that hits the table once in two periods of the table and grazes it once. Between the hit
/// and the graze before it the gap has a minimum far from the table.
const BALL: &str = r#"
[model]
states = ["x", "v"]
parameters = { g = 1.0, A = 1.61, om = 2.0, r = 0.5 }
[model.phase]
name = "p"
rate = "om"
period = "2*pi"
[model.flow]
x = "v"
v = "-g"
[[model.surface]]
name = "table"
event = "x - A*sin(p)"
impact = { v = "A*om*cos(p) - r*(v - A*om*cos(p))" }
[grazing]
surface = "table"
hits = "table"
solve_for = "A"
periods = 2
guess = { x = 1.229, v = 2.088, p = 0.8666 }
[expansion]
active = ["A"]
"#;

#[test]
fn a_return_that_ends_behind_a_hit_of_the_grazing_surface_comes_back_to_the_graze() {
    let folder = scratch();
    fs::write(folder.path().join("ball.toml"), BALL).expect("writable");
    fs::write(folder.path().join("states.csv"), "x,v,A\n1e-6,0,0\n").expect("writable");
    let image = ["image", "ball.toml", "--states", "states.csv", "--csv", "-", "-q", "--method"];
    let [direct, map] = ["direct", "map"].map(|method| {
        let output = grazemap(folder.path(), &[&image[..], &[method]].concat());
        let table = text(&output.stdout);
        let row = table.lines().nth(1).map(str::to_owned);
        let row = row.unwrap_or_else(|| panic!("{}", text(&output.stderr)));
        let row: Vec<f64> = row.split(',').filter_map(|cell| cell.parse().ok()).collect();
        [row[2], row[3]]
    });
    assert!(direct[0].abs() < 1e-5, "{direct:?}");
    for (direct, map) in direct.iter().zip(map) {
        assert!((direct - map).abs() < 1e-9, "{direct} {map}");
    }
}
