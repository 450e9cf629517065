//! Files of the benchmark, made from the reference numbers of `tests/data`.
//!
//! A column whose name begins with `result.` is to be computed, the others are given. Digits stay
//! text from the reference file to the table.

use std::error::Error;
use std::fs;

use serde_json::Value;

use crate::root;

/// File of the benchmark.
pub struct Table {
    /// Path in the benchmark's folder.
    pub path: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Decimal numbers and words, row by row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn new(path: impl Into<String>, columns: &[&str]) -> Self {
        let columns = columns.iter().map(ToString::to_string).collect();
        Self { path: path.into(), columns, rows: Vec::new() }
    }

    /// Table as CSV; no cell needs quotes.
    pub fn csv(&self) -> String {
        let rows = self.rows.iter().map(|row| row.join(","));
        let lines: Vec<_> = [self.columns.join(",")].into_iter().chain(rows).collect();
        lines.join("\n") + "\n"
    }
}

type Made = Result<Vec<Table>, Box<dyn Error>>;

/// Oscillators with a rigid stop: file of `tests/data/rigid`, scene of the catalogue.
pub const RIGID: [(&str, &str); 7] = [
    ("linear_w1.8", "linear"),
    ("linear_codim2", "linear_codim2"),
    ("mems_w0.46", "mems"),
    ("mems_w0.4878_codim2", "mems_codim2"),
    ("mems_scenario3_codim2", "mems_scenario3"),
    ("cantilever_zeta1.7", "cantilever_1_7"),
    ("cantilever_zeta0.107", "cantilever_0_107"),
];

/// Oscillators with a compliant stop: laws A to D, two sets of values each.
pub const SOFT: [&str; 8] = ["A1", "A2", "B1", "B2", "C1", "C2", "D1", "D2"];

/// A reference file of `tests/data`.
pub fn reference(file: &str) -> Result<Value, Box<dyn Error>> {
    let path = root().join("tests/data").join(file);
    Ok(serde_json::from_str(&fs::read_to_string(path)?)?)
}

/// Number or word as it stands in the file.
pub fn digits(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Entries of a list; empty for any other value.
pub fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// All files of the benchmark.
///
/// # Errors
///
/// A reference file that is missing or not JSON.
pub fn tables() -> Made {
    let parts = [
        problems,
        rigid_images,
        soft_images,
        two_masses,
        linear,
        mems,
        foale,
        cantilever,
        two_stops,
    ];
    let made: Result<Vec<_>, _> = parts.iter().map(|part| part()).collect();
    Ok(made?.into_iter().flatten().collect())
}

/// Parameters at which the oscillators of the images graze.
fn problems() -> Made {
    let keys = ["zeta", "r", "delta", "omega_star", "alpha_star", "V_star", "beta_star", "Q_star"];
    let mut rigid = Table::new("problems/rigid.csv", &["problem"]);
    rigid.columns.extend(keys.iter().chain(&["theta_star"]).map(ToString::to_string));
    for (file, _) in RIGID {
        let base = &reference(&format!("rigid/public_{file}.json"))?["base"];
        let values = keys.iter().chain(&["theta_star"]);
        let values = values.map(|key| base.get(*key).map_or_else(String::new, digits));
        rigid.rows.push([file.to_owned()].into_iter().chain(values).collect());
    }
    let (given, found) = (["typ", "m", "k2", "R2", "d"], ["w", "A_g", "phase_start", "T"]);
    let mut soft = Table::new("problems/soft.csv", &["set", "law", "m", "k2", "R2", "d"]);
    soft.columns.extend(["omega", "A_star", "phase", "period"].map(str::to_owned));
    for set in SOFT {
        let data = reference(&format!("soft/public_strobe_{set}.json"))?;
        let value = |key: &&str| data["params"].get(*key).map_or_else(|| "0".to_owned(), digits);
        let found = found.iter().map(|key| digits(&data[*key]));
        soft.rows.push(
            [set.to_owned()].into_iter().chain(given.iter().map(value)).chain(found).collect(),
        );
    }
    Ok(vec![rigid, soft])
}

/// Three iterates of the section map of random points near the graze.
fn rigid_images() -> Made {
    let one = |(file, _): &(&str, &str)| {
        let data = reference(&format!("rigid/public_{file}.json"))?;
        let offsets = list(&data["base"]["param_offsets"]).iter();
        let offsets = offsets.map(|name| match digits(name).split_once(['-', ':']) {
            Some(("mu", _)) => "dQ".to_owned(),
            Some((parameter, _)) => format!("d{parameter}"),
            None => digits(name),
        });
        let mut table = Table::new(format!("images/{file}.csv"), &["row"]);
        table.columns.extend(["x_minus_delta", "dtheta"].map(str::to_owned));
        table.columns.extend(offsets);
        table.columns.push("iteration".to_owned());
        table.columns.extend(["result.x_minus_delta", "result.dtheta"].map(str::to_owned));
        for row in list(&data["rows"]) {
            let mut given = ["id", "x_minus_delta", "dtheta"].map(|key| digits(&row[key])).to_vec();
            given.extend(list(&row["param_offsets"]).iter().map(digits));
            for image in list(&row["images"]) {
                let asked = ["n", "x_minus_delta", "dtheta"].map(|key| digits(&image[key]));
                table.rows.push([&given[..], &asked].concat());
            }
        }
        Ok(table)
    };
    RIGID.iter().map(one).collect()
}

/// Stroboscopic images half a period before the graze.
fn soft_images() -> Made {
    let one = |set: &&str| {
        let data = reference(&format!("soft/public_strobe_{set}.json"))?;
        let keys = ["du", "dv", "dA", "u1", "v1", "n_contacts"];
        let columns = ["row", "du", "dv", "dA", "result.u1", "result.v1", "result.n_contacts"];
        let mut table = Table::new(format!("images/soft_{set}.csv"), &columns);
        for (number, image) in list(&data["images"]).iter().enumerate() {
            let values = keys.map(|key| digits(&image[key]));
            table.rows.push([&[number.to_string()][..], &values].concat());
        }
        Ok(table)
    };
    SOFT.iter().map(one).collect()
}

/// Images of two masses between two stops, from and to the extremum near the right stop.
fn two_masses() -> Made {
    let one = |set: &str| {
        let data = reference(&format!("soft/public_two_{set}.json"))?;
        let start = ["row", "d", "x1", "v1", "x2", "v2", "phase"];
        let asked = ["x1", "v1", "x2", "v2", "phase"].map(|name| format!("result.{name}"));
        let mut table = Table::new(format!("images/two_masses_{set}.csv"), &start);
        table.columns.extend(asked);
        for (number, image) in list(&data["images"]).iter().enumerate() {
            let mut row = vec![number.to_string(), digits(&image["d"])];
            row.extend(list(&image["x_i"]).iter().chain([&image["phase_i"]]).map(digits));
            let phase = &image["image_phase_minus_2pi"];
            row.extend(list(&image["image"]).iter().chain([phase]).map(digits));
            table.rows.push(row);
        }
        Ok(table)
    };
    ["T1_soft", "T1_rigid", "T2_soft", "T2_rigid"].into_iter().map(one).collect()
}

/// Linear oscillator: grazing orbits, and zeros of `xi_n` along the grazing curve.
fn linear() -> Made {
    let data = reference("rigid/linear_abc.json")?;
    let given = ["omega", "zeta", "r", "delta"];
    let asked = ["alpha_g", "theta_g", "a_star"];
    let mut grazing = Table::new("linear/grazing_orbits.csv", &given);
    grazing.columns.extend(asked.map(|name| format!("result.{name}")));
    grazing.columns.extend((1..=6).map(|n| format!("result.xi_{n}")));
    for row in list(&data["a_b_grazing_and_xi"]) {
        let values = given.iter().chain(&asked).map(|key| &row[*key]);
        grazing.rows.push(values.chain(list(&row["xi"])).map(digits).collect());
    }
    let mut zeros = Table::new("linear/zeros_of_xi.csv", &["n", "m", "result.omega"]);
    for (place, omega) in
        data["codim2_omega_nm_zeta0.05"]["values"].as_object().into_iter().flatten()
    {
        let (n, m) = place.split_once(',').ok_or("a place n,m")?;
        zeros.rows.push(vec![n.to_owned(), m.to_owned(), digits(omega)]);
    }
    Ok(vec![grazing, zeros])
}

/// The MEMS oscillator: the grazing curve, and its points of codimension two.
fn mems() -> Made {
    let mut curve = Table::new("mems/grazing_curve.csv", &["omega", "branch"]);
    let asked = ["V", "theta_star", "a_star"];
    curve.columns.extend(asked.map(|name| format!("result.{name}")));
    curve.columns.extend((1..=6).map(|n| format!("result.xi_{n}_over_1_plus_r")));
    for row in list(&reference("rigid/mems_curve.json")?) {
        let values = ["omega", "branch"].iter().chain(&asked).map(|key| &row[*key]);
        curve.rows.push(values.chain(list(&row["xi_over_1plusr"])).map(digits).collect());
    }
    let columns = ["kind", "row", "result.omega", "result.V", "result.theta_star"];
    let mut points = Table::new("mems/special_points.csv", &columns);
    for (number, row) in list(&reference("rigid/mems_points.json")?).iter().enumerate() {
        let mut values = vec![digits(&row["type"]), number.to_string()];
        values.extend(["omega", "V", "theta_star"].map(|key| digits(&row[key])));
        points.rows.push(values);
    }
    Ok(vec![curve, points])
}

/// Saddle-nodes and flips of one-impact orbits of period `n`, restitution 0.7.
fn foale() -> Made {
    let data = reference("rigid/linear_abc.json")?;
    let columns = ["omega", "n", "kind", "physical", "result.y", "result.alpha"];
    let mut table = Table::new("linear/folds_and_flips.csv", &columns);
    for row in list(&data["foale"]["loci_table"]) {
        let keys = ["omega", "n", "kind", "physical", "y", "alpha"];
        table.rows.push(keys.map(|key| digits(&row[key])).to_vec());
    }
    Ok(vec![table])
}

/// Grazing orbits of the cantilever with real multipliers.
fn cantilever() -> Made {
    let (given, asked) = (["zeta", "alpha", "beta"], ["Q_G_qmin", "t_G", "a_G", "trace", "det"]);
    let mut table = Table::new("cantilever/grazing_orbits.csv", &given);
    table.columns.extend(asked.map(|name| format!("result.{name}")));
    for row in list(&reference("rigid/beam_tables.json")?) {
        if row.get("lambda1").is_some() {
            table.rows.push(given.iter().chain(&asked).map(|key| digits(&row[*key])).collect());
        }
    }
    Ok(vec![table])
}

/// Two masses: points of codimension two of the orbit that grazes both stops.
fn two_stops() -> Made {
    let one = |set: &str| {
        let data = reference(&format!("soft/two_codim_{set}.json"))?;
        let columns = ["row", "kind", "n", "result.omega", "result.d"];
        let mut table = Table::new(format!("two_masses/codimension_two_{set}.csv"), &columns);
        for (number, row) in list(&data["codim2_points_w_in_[0.2,4]"]).iter().enumerate() {
            let values = ["kind", "n", "w", "d"].map(|key| digits(&row[key]));
            table.rows.push([&[number.to_string()][..], &values].concat());
        }
        Ok(table)
    };
    ["T1", "T2"].into_iter().map(one).collect()
}
