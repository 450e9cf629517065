//! Charts refined along borders, compared with charts in which every cell is computed: numbers of
//! cells computed and of cells that differ, and times.
//!
//! `cargo run --release -p grazemap-studies --bin charts -- [POINTS...]` prints the table of
//! docs/studies/charts.md for these numbers of points along each axis.

use std::error::Error;
use std::time::Instant;

use grazemap::analysis::chart::{Chart, ChartCell};
use grazemap::model::{ChartRequest, Scene, catalogue};
use grazemap::prelude::*;

/// Default numbers of points along each axis.
const POINTS: [usize; 3] = [50, 100, 200];

/// Chart with its name, its scene of the catalogue and the overrides.
struct Subject {
    name: &'static str,
    scene: &'static str,
    set: &'static [(&'static str, &'static str)],
    chart: &'static str,
}

/// Charts with wide regions, with thin regions, and by each method.
const SUBJECTS: [Subject; 4] = [
    Subject {
        name: "system A of Kundu et al. 2012, Fig. 14, k2 = 33, direct",
        scene: "soft_a",
        set: &[
            ("omega", "0.8"),
            ("A", "0.360799"),
            ("grazing.guess", "{u=1.0,v=0.0,theta=0.066568}"),
            ("section.kind", "\"stroboscopic\""),
        ],
        chart: "parameters = [\"omega\", \"A\"]\nranges = [[-0.4, 0.4], [-0.340799, 2.639201]]\n\
                transient = 300\nkeep = 16\nwith = [\"direct\"]\n",
    },
    Subject {
        name: "linear rigid oscillator, map inside its window",
        scene: "linear",
        set: &[],
        chart: "parameters = [\"omega\", \"alpha\"]\nranges = [[-1e-3, 1e-3], [-1e-3, 1e-3]]\n\
                transient = 500\nkeep = 16\nwith = [\"map\"]\n",
    },
    Subject {
        name: "cantilever beam, zeta = 0.09, map inside its window",
        scene: "cantilever_0_09",
        set: &[],
        chart: "parameters = [\"Q\", \"beta\"]\nranges = [[-1e-4, 8e-4], [-1e-3, 1e-3]]\n\
                transient = 500\nkeep = 16\nwith = [\"map\"]\n",
    },
    Subject {
        name: "soft impacts with a step in the force, guarded",
        scene: "soft_c",
        set: &[],
        chart: "parameters = [\"omega\", \"A\"]\nranges = [[-2e-2, 2e-2], [-5e-3, 3e-2]]\n\
                transient = 300\nkeep = 16\nwith = [\"guarded\"]\n",
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let points = std::env::args().skip(1).map(|text| text.parse());
    let mut points = points.collect::<Result<Vec<usize>, _>>()?;
    if points.is_empty() {
        points = POINTS.to_vec();
    }
    println!("| chart | cells | computed, % | differ, % | along borders, s | every cell, s |");
    println!("|---|---|---|---|---|---|");
    for subject in &SUBJECTS {
        let map = subject.map()?;
        for &points in &points {
            println!("{}", subject.row(&map, points)?);
        }
    }
    Ok(())
}

impl Subject {
    fn map(&self) -> Result<Map, Box<dyn Error>> {
        let text = catalogue::text(self.scene).ok_or("no such scene")?;
        let text = format!("{text}\n[[chart]]\n{}", self.chart);
        let set: Vec<_> =
            self.set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Ok(Scene::parse_with(&text, self.scene, &set)?.graze()?.map()?)
    }

    /// Row of the table for both charts with a number of points along each axis.
    fn row(&self, map: &Map, points: usize) -> Result<String, Box<dyn Error>> {
        let own = map.scene().charts.last().ok_or("no chart")?;
        let chart = |every_cell| -> Result<(Chart, f64), grazemap::Error> {
            let request = ChartRequest { points: [points; 2], every_cell, ..own.clone() };
            let begun = Instant::now();
            let chart = map.chart(&request)?.remove(0);
            Ok((chart, begun.elapsed().as_secs_f64()))
        };
        let ((all, whole), (borders, refined)) = (chart(true)?, chart(false)?);
        let pairs = all.cells.iter().zip(&borders.cells);
        let class = |cell: &ChartCell| all.class(&cell.attractor);
        let differ = pairs.filter(|(all, own)| class(all) != class(own)).count();
        let share = |count: usize| 100.0 * count as f64 / all.cells.len() as f64;
        Ok(format!(
            "| {} | {points} x {points} | {:.1} | {:.2} | {refined:.2} | {whole:.2} |",
            self.name,
            share(borders.computed),
            share(differ)
        ))
    }
}
