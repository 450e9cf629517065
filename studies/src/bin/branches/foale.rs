//! Saddle-nodes and flips of Foale's closed form, compared with branches of direct simulation from
//! the graze.

use std::error::Error;
use std::fs;

use grazemap::analysis::NoProgress;
use grazemap::analysis::orbits::{BifurcationKind, BifurcationRequest, OrbitsRequest};
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::model::catalogue;
use grazemap::prelude::{FindGraze, Scene};
use grazemap::report::figure::{Axis, Figure, Series};
use grazemap::report::{Cell, Column, Table};
use grazemap_studies::root;
use serde_json::Value;

/// Largest distance of a found point, in the amplitude.
const FOUND: f64 = 1e-11;

/// Physical point of the closed form (tests/data/rigid/README.md).
#[derive(Clone)]
pub(crate) struct Point {
    omega: String,
    period: usize,
    kind: BifurcationKind,
    speed: f64,
    alpha: f64,
}

pub(crate) fn points() -> Result<Vec<Point>, Box<dyn Error>> {
    let text = fs::read_to_string(root().join("tests/data/rigid/linear_abc.json"))?;
    let data: Value = serde_json::from_str(&text)?;
    let number = |value: &Value| value.as_str().and_then(|text| text.parse().ok());
    let rows = data["foale"]["loci_table"].as_array().ok_or("no table")?;
    let rows = rows.iter().filter(|row| row["physical"] == true).map(|row| {
        Some(Point {
            omega: row["omega"].as_str()?.to_owned(),
            period: row["n"].as_u64()? as usize,
            kind: match row["kind"].as_str()? {
                "SN" => BifurcationKind::Fold,
                _ => BifurcationKind::Flip,
            },
            speed: number(&row["y"])?,
            alpha: number(&row["alpha"])?,
        })
    });
    rows.collect::<Option<_>>().ok_or_else(|| "a row without its numbers".into())
}

/// Points with their distances from the nearest point found.
pub(crate) fn errors(points: &[Point]) -> Result<Vec<(&Point, f64)>, Box<dyn Error>> {
    let mut errors = Vec::new();
    let mut omegas: Vec<&str> = points.iter().map(|point| point.omega.as_str()).collect();
    omegas.dedup();
    for omega in omegas {
        let mine: Vec<&Point> = points.iter().filter(|point| point.omega == omega).collect();
        errors.extend(found(omega, &mine)?);
    }
    Ok(errors)
}

/// Table of the points found, by period and kind.
pub(crate) fn table(errors: &[(&Point, f64)]) -> Result<Table, Box<dyn Error>> {
    let mut columns = vec![Column::number("period"), Column::text("kind")];
    columns.extend(["points", "found", "largest error"].map(Column::number));
    let mut table = Table::new(columns);
    for period in 1..=4 {
        for kind in [BifurcationKind::Fold, BifurcationKind::Flip] {
            let of =
                errors.iter().filter(|(point, _)| (point.period, point.kind) == (period, kind));
            let of: Vec<f64> = of.map(|(_, error)| *error).collect();
            let found = of.iter().copied().filter(|error| *error < FOUND);
            if of.is_empty() {
                continue;
            }
            table.push(vec![
                Cell::Integer(period as i64),
                Cell::text(kind.word()),
                Cell::Integer(of.len() as i64),
                Cell::Integer(found.clone().count() as i64),
                Cell::number(found.fold(0.0, f64::max), 2),
            ]);
        }
    }
    Ok(table)
}

/// Figure of the points found and missed over the frequency.
pub(crate) fn figure(errors: &[(&Point, f64)]) -> Figure {
    let mut figure = Figure::new(Axis::linear("ω"), Axis::log10("α"));
    for kind in [BifurcationKind::Fold, BifurcationKind::Flip] {
        for (state, is_found) in [("found", true), ("missed", false)] {
            let of = errors
                .iter()
                .filter(|(point, error)| point.kind == kind && (*error < FOUND) == is_found);
            let places = of.filter_map(|(point, _)| Some([point.omega.parse().ok()?, point.alpha]));
            let places: Vec<[f64; 2]> = places.collect();
            if !places.is_empty() {
                figure.series.push(Series::dots(format!("{}, {state}", kind.word()), places));
            }
        }
    }
    figure
}

/// Points with their distances from the nearest point of the same kind and itinerary.
fn found<'p>(omega: &str, points: &[&'p Point]) -> Result<Vec<(&'p Point, f64)>, Box<dyn Error>> {
    let text = catalogue::text("foale").ok_or("no scene")?;
    let text = text.replace("omega = 1.8 }", &format!("omega = {omega} }}"));
    let map = Scene::parse(&text, "foale")?.graze()?.map()?;
    let graze = map.parameter("alpha")?;
    let mut periods: Vec<usize> = points.iter().map(|point| point.period).collect();
    periods.sort_unstable();
    periods.dedup();
    let mut errors = Vec::new();
    for period in periods {
        let digits = format!("1{}", "0".repeat(period - 1));
        let request = OrbitsRequest {
            itineraries: vec![ContactItinerary::parse(&digits, 1)?],
            at: Vec::new(),
            direct: true,
            far: true,
            loci: Some(BifurcationRequest {
                kinds: vec![BifurcationKind::Fold, BifurcationKind::Flip],
                free: 0,
                stepped: None,
                at: vec![0.0; 2],
            }),
        };
        let loci = map.orbits(&request, &NoProgress)?.loci.unwrap_or_default();
        for &point in points.iter().filter(|point| point.period == period) {
            // NOTE: for an orbit that grazes at the opposite phase the amplitude has the other
            // sign.
            let alpha = point.alpha * graze.signum();
            let same = loci.iter().filter(|locus| locus.kind == point.kind);
            let places = same.flat_map(|locus| &locus.points);
            let error = places
                .map(|orbit| (graze + orbit.parameters[0] - alpha).abs())
                .fold(f64::INFINITY, f64::min);
            if error >= FOUND {
                let Point { kind, speed, .. } = point;
                eprintln!(
                    "omega {omega} {digits} {} at {alpha}, speed {speed}: {error:e}",
                    kind.word()
                );
            }
            errors.push((point, error));
        }
    }
    Ok(errors)
}
