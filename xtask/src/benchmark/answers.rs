//! Answers of this program: images of section points by direct simulation in double-double.

use std::error::Error;

use grazemap::analysis::{ImageRequest, ImageRow, Precision, Using, images};
use grazemap::expansion::{Expander, MapOrders};
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::Dd;
use grazemap::orbit::locate;

use super::files::{self, RIGID, SOFT, Table, digits, reference};

type Made = Result<Table, Box<dyn Error>>;

/// Tables of images, with this program's results instead of the reference's.
pub(crate) fn tables() -> Result<Vec<Table>, Box<dyn Error>> {
    let mut asked = files::tables()?;
    let mut take = |path: String| -> Made {
        let place = asked.iter().position(|table| table.path == path);
        Ok(asked.swap_remove(place.ok_or("a table of the benchmark")?))
    };
    let mut answered = Vec::new();
    for (file, name) in RIGID {
        let scene = Scene::of_catalogue(name)?;
        answered.push(rigid(&scene, take(format!("images/{file}.csv"))?)?);
    }
    for set in SOFT {
        answered.push(soft(&soft_scene(set)?, take(format!("images/soft_{set}.csv"))?)?);
    }
    Ok(answered)
}

/// Images of offsets after a number of iterations.
fn iterate(
    scene: &Scene,
    rows: Vec<ImageRow>,
    iterations: usize,
) -> Result<Vec<Vec<Dd>>, Box<dyn Error>> {
    let orbit = locate(scene)?.into_result().map_err(|reason| reason.to_string())?;
    // NOTE: direct simulation uses only the window of the map.
    let orders = MapOrders { smooth_order: 1, contact_weight: 1 };
    let map = Expander::new(scene, &orbit)?.expand(orders)?;
    let request = ImageRequest { rows, iterations, using: Using::Direct, precision: Precision::Dd };
    let records = images(scene, &orbit, &map, &request)?;
    Ok(records.into_iter().map(|record| record.offsets).collect())
}

/// Answers for rigid stops. The tables measure `x` from the wall, for the beam with `x = -q`.
fn rigid(scene: &Scene, mut table: Table) -> Made {
    let beam = table.path.contains("cantilever");
    let given = table.columns.iter().position(|name| name == "iteration").ok_or("a column")?;
    let mut rows = Vec::new();
    for row in table.rows.iter().step_by(3) {
        let values: Result<Vec<Dd>, _> =
            row[1..given].iter().map(|text| Dd::from_decimal(text)).collect();
        let values = values?;
        let x = if beam { values[2] - values[0] } else { values[0] };
        rows.push(ImageRow { state: vec![x, values[1]], parameters: values[2..].to_vec() });
    }
    let gaps: Vec<Dd> = rows.iter().map(|row| row.parameters[0]).collect();
    for (number, offsets) in iterate(scene, rows, 3)?.into_iter().enumerate() {
        let x = if beam { gaps[number / 3] - offsets[0] } else { offsets[0] };
        let row = &mut table.rows[number];
        row[given + 1] = x.to_string();
        row[given + 2] = offsets[1].to_string();
    }
    Ok(table)
}

fn soft(scene: &Scene, mut table: Table) -> Made {
    let mut rows = Vec::new();
    for row in &table.rows {
        let state = vec![Dd::from_decimal(&row[1])?, Dd::from_decimal(&row[2])?];
        rows.push(ImageRow { state, parameters: vec![Dd::from_decimal(&row[3])?] });
    }
    table.columns.truncate(6);
    for (row, offsets) in table.rows.iter_mut().zip(iterate(scene, rows, 1)?) {
        row.truncate(4);
        row.extend([(offsets[0] - Dd::ONE).to_string(), offsets[1].to_string()]);
    }
    Ok(table)
}

/// Scene of the catalogue with the values of a set, on a section half a period before its graze.
fn soft_scene(set: &str) -> Result<Scene, Box<dyn Error>> {
    let data = reference(&format!("soft/public_strobe_{set}.json"))?;
    let phase = digits(&data["phase_start"]);
    let mut keys: Vec<(String, String)> = vec![
        ("omega".into(), format!("2*sqrt(1 - 0.015^2)/{}", digits(&data["params"]["m"]))),
        ("A".into(), digits(&data["A_g"])),
        ("section.kind".into(), "stroboscopic".into()),
        ("section.phase".into(), phase.clone()),
        ("expansion.active".into(), "[\"A\"]".into()),
        ("grazing.guess.theta".into(), format!("{phase} + pi")),
    ];
    for (name, value) in data["params"].as_object().into_iter().flatten() {
        if ["k2", "R2", "d"].contains(&name.as_str()) {
            keys.push((name.clone(), digits(value)));
        }
    }
    let name = format!("soft_{}", set[..1].to_lowercase());
    let text = catalogue::text(&name).ok_or("a scene")?;
    Ok(Scene::parse_with(text, &name, &keys)?)
}
