//! Contacts flown exactly, against exact images (tests/data/soft; README there) and direct simulation.

use grazemap::analysis::MapEvaluation;
use grazemap::expansion::{Expander, FlownContact, MapOrders, Stage};
use grazemap::model::{Scene, catalogue};
use grazemap::numeric::{Dd, Scalar};
use grazemap::orbit::locate;
use serde_json::Value;

fn text(value: &Value) -> String {
    value.as_str().expect("a decimal string").to_owned()
}

fn number(value: &Value) -> f64 {
    value.as_str().map_or(0.0, |t| t.parse().expect("a number"))
}

#[test]
fn grid() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/soft/zdm_images.json");
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let weight = std::env::var("W").map_or(8, |w| w.parse().unwrap());
    let every = std::env::var("EVERY").map_or(9, |w| w.parse().unwrap());
    for (k, row) in file["cases"].as_array().unwrap().iter().enumerate() {
        if k % every != 0 { continue; }
        let mut overrides = vec![
            ("section.kind".to_owned(), "stroboscopic".to_owned()),
            ("window.depth".to_owned(), "1.2e-3".to_owned()),
            ("expansion.active".to_owned(), "[]".to_owned()),
            ("omega".to_owned(), format!("2*sqrt(1 - 0.015^2)/{}", text(&row["m"]))),
            ("A".to_owned(), text(&row["A_g"])),
            ("grazing.guess.theta".to_owned(), text(&row["phase_g"])),
        ];
        for key in ["k2", "R2", "d"].iter().filter(|key| !row[**key].is_null()) {
            overrides.push(((*key).to_owned(), text(&row[*key])));
        }
        let system = text(&row["system"]);
        let name = format!("soft_{}", system.to_lowercase());
        let source = catalogue::text(&name).unwrap();
        let scene = Scene::parse_with(source, &name, &overrides).unwrap_or_else(|e| panic!("{e}"));
        let orbit = locate(&scene).unwrap().into_result().unwrap();
        let t = std::time::Instant::now();
        let expander = Expander::new(&scene, &orbit).unwrap();
        let flown = match expander.flown_contact(0, weight) { Ok(f) => f.unwrap(), Err(e) => { println!("{system} k2 {} R2 {} d {} : {e}", row["k2"], row["R2"], row["d"]); continue; } };
        let plan = flown.plan();
        let t = t.elapsed();
        let mut worst = [0.0_f64; 2];
        let mut rel = 0.0_f64;
        for image in row["images"].as_array().unwrap() {
            let y = number(&image[0]);
            if y > 0.035 { continue; }
            let yy = Dd::from_decimal(image[0].as_str().unwrap()).unwrap();
            let f = flown.map_scalars(|x| x);
            let (found, _) = f.act(&mut grazemap::expansion::Numbers::<f64>::new(), &[(yy*yy).hi, 0.0]);
            let du = found[0] - (yy*yy).hi;
            for (c, (a, b)) in [(du, number(&image[1])), (found[1], number(&image[2]))].into_iter().enumerate() {
                worst[c] = worst[c].max((a - b).abs());
            }
            rel = rel.max((found[1] - number(&image[2])).abs() / number(&image[2]).abs());
        }
        println!("{system} m {} k2 {} R2 {} d {} : du {:.1e} dv {:.1e} rel {:.1e} {:?} {:?}", row["m"], row["k2"], row["R2"], row["d"], worst[0], worst[1], rel, plan, t);
    }
    let _ = (|_: &Stage, _: &FlownContact, _: MapOrders, _: MapEvaluation<Dd>, x: Dd| x.magnitude(), 1);
}
