//! scratch
use grazemap::analysis::NoProgress;
use grazemap::analysis::branches::{BranchLabel, BranchRequest};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::prelude::{FindGraze, Scene};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string("tests/data/rigid/linear_abc.json")?;
    let data: serde_json::Value = serde_json::from_str(&text)?;
    let table = data["foale"]["loci_table"].as_array().expect("list").clone();
    let only: Vec<String> = std::env::args().skip(1).collect();
    let mut omegas: Vec<String> = Vec::new();
    for p in &table {
        let omega = p["omega"].as_str().expect("s").to_owned();
        if !omegas.contains(&omega)
            && p["physical"] == true
            && (only.is_empty() || only.contains(&omega))
        {
            omegas.push(omega);
        }
    }
    let (mut hit, mut all) = (0, 0);
    for omega in omegas {
        let text = std::fs::read_to_string("scenes/foale.toml")?
            .replace("omega = 1.8 }", &format!("omega = {omega} }}"))
            .replace("smooth_order = 5", "smooth_order = 3")
            .replace("contact_weight = 6", "contact_weight = 4");
        let scene = Scene::parse(&text, "foale")?;
        let map = scene.graze()?.map()?;
        let graze = map.parameter("alpha")?;
        let sign = graze.signum();
        let now = Instant::now();
        for n in 1..=4usize {
            let points: Vec<_> = table
                .iter()
                .filter(|p| p["omega"] == *omega && p["n"] == n && p["physical"] == true)
                .collect();
            if points.is_empty() {
                continue;
            }
            let digits = format!("1{}", "0".repeat(n - 1));
            let request = BranchRequest {
                itineraries: vec![ContactItinerary::parse(&digits, 1)?],
                longest: n,
                along: 0,
                range: [-0.98 * graze, 3.0 * graze],
                at: vec![0.0; 2],
                direct: true,
            };
            let found = map.branches(&request, &NoProgress)?;
            for p in &points {
                let alpha: f64 = p["alpha"].as_str().expect("s").parse()?;
                let alpha = sign * alpha;
                let label = if p["kind"] == "SN" {
                    BranchLabel::SaddleNode
                } else {
                    BranchLabel::PeriodDoubling
                };
                let mine = found.branches.iter().filter(|b| b.itinerary.to_string() == digits);
                let count = mine.clone().count();
                let ends: Vec<_> = mine
                    .clone()
                    .map(|b| {
                        (
                            b.ends,
                            b.points.len(),
                            b.points.first().map(|p| p.orbit.parameters[0] + graze),
                            b.points.last().map(|p| p.orbit.parameters[0] + graze),
                        )
                    })
                    .collect();
                let error = mine
                    .flat_map(|b| &b.points)
                    .filter(|q| q.special.as_ref().is_some_and(|s| s.label == label))
                    .map(|q| (q.orbit.parameters[0] + graze - alpha).abs())
                    .fold(f64::INFINITY, f64::min);
                all += 1;
                if error < 1e-11 {
                    hit += 1;
                } else {
                    println!(
                        "omega {omega} n {n} {} y {} alpha {alpha:.6} graze {graze:.6}: error {error:e}; {count} branches {ends:?}",
                        p["kind"], p["y"]
                    );
                }
            }
        }
        println!("omega {omega}: {hit}/{all} in {:.1?}", now.elapsed());
    }
    Ok(())
}
