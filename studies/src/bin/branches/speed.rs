//! Times of branches.

use std::error::Error;
use std::time::Instant;

use grazemap::analysis::NoProgress;
use grazemap::analysis::branches::BranchRequest;
use grazemap::analysis::periodic::ContactItinerary;
use grazemap::report::{Cell, Column, Table};

use crate::map_of;

/// Scenes, and itinerary of the branch that is timed.
const SCENES: [(&str, &str); 5] = [
    ("linear", "1"),
    ("foale", "10"),
    ("cantilever_2_5", "10"),
    ("mems_scenario3", "1"),
    ("soft_b", "1"),
];
/// Number of runs; the fastest counts.
const RUNS: usize = 3;

/// Table of points and times of branches over the window, by map and by direct simulation.
pub(crate) fn table() -> Result<Table, Box<dyn Error>> {
    let mut columns = vec![Column::text("scene"), Column::text("itinerary")];
    columns.extend(
        ["map: points", "ms", "ms for 1000", "direct: points", "ms", "ms for 1000"]
            .map(Column::number),
    );
    let mut table = Table::new(columns);
    for (name, digits) in SCENES {
        let map = map_of(name)?;
        let width = map.local().window.parameter[0];
        let mut row = vec![Cell::text(format!("`{name}`")), Cell::text(digits)];
        for direct in [false, true] {
            let request = BranchRequest {
                itineraries: vec![ContactItinerary::parse(digits, 1)?],
                longest: digits.len(),
                along: 0,
                range: [-width, width],
                at: vec![0.0; map.local().parameters.len()],
                direct,
                starts: Vec::new(),
            };
            let (mut points, mut fastest) = (0, f64::INFINITY);
            for _ in 0..RUNS {
                let begun = Instant::now();
                let found = map.branches(&request, &NoProgress)?;
                fastest = fastest.min(begun.elapsed().as_secs_f64());
                points = found.branches.iter().map(|branch| branch.points.len()).sum();
            }
            row.push(Cell::Integer(points as i64));
            row.push(Cell::number(1e3 * fastest, 3));
            row.push(Cell::number(1e6 * fastest / points.max(1) as f64, 3));
        }
        table.push(row);
    }
    Ok(table)
}
