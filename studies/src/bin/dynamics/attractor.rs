//! Attractors by order against direct simulation: extremes, Lyapunov exponent, distance of
//! densities.

use std::collections::BTreeMap;

use grazemap::iteration::{
    DiscreteMap, HornerMap, MapOrbit, OrbitEnd, OrbitRequest, Period, largest_lyapunov_exponent,
};
use grazemap::report::figure::{Axis, Figure, Series, Stroke};
use grazemap::report::{Cell, Column, ReportError, Table};
use rayon::prelude::*;

use crate::subject::{Maps, Subject, written};

/// Number of runs from different starts.
const RUNS: usize = 8;
/// Numbers of iterates dropped and kept in each run.
const TRANSIENT: usize = 2000;
const KEPT: usize = 5000;
/// Number of iterates of each run used for the exponent of direct simulation, where a Jacobian
/// costs twenty images.
const JACOBIANS: usize = 1500;
/// Number of cells of a density.
const CELLS: usize = 60;

/// Scene and parameters of an attractor.
pub(crate) struct Site {
    pub(crate) subject: Subject,
    /// Offsets of the active parameters.
    pub(crate) parameters: [f64; 2],
    pub(crate) label: &'static str,
}

/// Attractor found by one method.
pub(crate) struct Attractor {
    /// First coordinates of all runs, sorted.
    values: Vec<f64>,
    period: Option<usize>,
    contacts: BTreeMap<usize, usize>,
    /// Mean over the runs, and its standard error.
    exponent: [f64; 2],
    /// First coordinates of the two halves of the runs, sorted: their distance is that of two
    /// samples of one density.
    halves: [Vec<f64>; 2],
}

impl Attractor {
    pub(crate) fn of(
        map: &dyn DiscreteMap,
        site: &Site,
        scales: &[f64],
        jacobians: usize,
    ) -> Option<Self> {
        let request = OrbitRequest::new(TRANSIENT, KEPT, scales);
        let start = |run: usize| {
            let share = (run as f64 + 0.5) / RUNS as f64 - 0.5;
            [0.1 * share * scales[0], 0.1 * share * scales[1]]
        };
        let orbits: Vec<_> = (0..RUNS)
            .into_par_iter()
            .map(|run| MapOrbit::of(map, &start(run), &site.parameters, &request))
            .collect();
        if orbits.iter().any(|orbit| orbit.end != OrbitEnd::Completed) {
            return None;
        }
        let exponents: Vec<f64> = (0..RUNS)
            .into_par_iter()
            .filter_map(|run| {
                let state = &orbits[run].last;
                let found = largest_lyapunov_exponent(map, state, &site.parameters, 10, jacobians);
                found.map(|exponent| exponent.value)
            })
            .collect();
        let first = |orbit: &MapOrbit| orbit.states().map(|state| state[0]).collect::<Vec<_>>();
        let runs: Vec<_> = orbits.iter().map(first).collect();
        let mut contacts = BTreeMap::new();
        for step in orbits.iter().flat_map(|orbit| &orbit.steps) {
            *contacts.entry(step.contacts() as usize).or_default() += 1;
        }
        Some(Self {
            period: match orbits[0].period {
                Period::Periodic(period) => Some(period),
                Period::NotFound => None,
            },
            values: sorted(runs.concat()),
            halves: [0, 1]
                .map(|half| sorted(runs.iter().skip(half).step_by(2).flatten().copied().collect())),
            contacts,
            exponent: mean(&exponents),
        })
    }

    fn ends(&self) -> [f64; 2] {
        [self.values[0], self.values[self.values.len() - 1]]
    }

    fn width(&self) -> f64 {
        self.ends()[1] - self.ends()[0]
    }

    /// Share of iterates with contact.
    fn contact_share(&self) -> f64 {
        let all: usize = self.contacts.values().sum();
        let none = self.contacts.get(&0).copied().unwrap_or(0);
        1.0 - none as f64 / all as f64
    }
}

/// Wasserstein distance of two samples of equal size: mean distance of their sorted values.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

fn mean(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    [mean, (spread / (count - 1.0) / count).sqrt()]
}

/// Attractors of direct simulation and of maps of several orders at a site.
pub(crate) struct Compared {
    pub(crate) direct: Attractor,
    pub(crate) maps: Vec<((u32, u32), Option<Attractor>)>,
}

pub(crate) fn compared(site: &Site, maps: &Maps<'_>, orders: &[(u32, u32)]) -> Compared {
    let scales = maps.window().state;
    let direct = Attractor::of(&site.subject.double(), site, &scales, JACOBIANS);
    let of = |&order: &(u32, u32)| {
        let map = HornerMap::new(&maps.local(order));
        (order, Attractor::of(&map, site, &scales, KEPT))
    };
    Compared {
        direct: direct.expect("direct simulation stays bounded"),
        maps: orders.iter().map(of).collect(),
    }
}

/// Table of the attractors of sites.
pub(crate) fn table(sites: &[(&Site, &Compared)]) -> Result<Table, ReportError> {
    let headings = [
        "site",
        "map",
        "attractor",
        "contacts per return",
        "smallest x",
        "largest x",
        "Lyapunov exponent",
        "distance of densities",
    ];
    let mut columns: Vec<_> = headings.map(Column::number).into();
    for text in [0, 1, 2, 6] {
        columns[text] = Column::text(headings[text]);
    }
    let mut table = Table::new(columns);
    for (site, compared) in sites {
        let direct = &compared.direct;
        let floor = distance(&direct.halves[0], &direct.halves[1]) / direct.width();
        table.push(row(site, "direct".to_owned(), direct, floor));
        for (order, attractor) in &compared.maps {
            match attractor {
                Some(attractor) => {
                    let apart = distance(&attractor.values, &direct.values) / direct.width();
                    table.push(row(site, written(*order), attractor, apart));
                }
                None => {
                    let mut row = vec![Cell::text(site.label), Cell::text(written(*order))];
                    row.push(Cell::text("escapes"));
                    row.extend(vec![Cell::Missing; 5]);
                    table.push(row);
                }
            }
        }
    }
    Ok(table)
}

fn row(site: &Site, map: String, attractor: &Attractor, apart: f64) -> Vec<Cell> {
    let kind = match attractor.period {
        Some(period) => format!("period {period}"),
        None => "chaos".to_owned(),
    };
    let [smallest, largest] = attractor.ends();
    let [exponent, error] = attractor.exponent;
    vec![
        Cell::text(site.label),
        Cell::text(map),
        Cell::text(kind),
        Cell::number(attractor.contact_share(), 4),
        Cell::number(smallest, 6),
        Cell::number(largest, 6),
        Cell::text(format!("{exponent:.4} ± {error:.4}")),
        Cell::number(apart, 2),
    ]
}

/// Figure of the densities of the first coordinate.
pub(crate) fn density_figure(site: &Site, compared: &Compared, drawn: &[(u32, u32)]) -> Figure {
    let [low, high] = compared.direct.ends();
    let margin = 0.02 * (high - low);
    let range = [low - margin, high + margin];
    let mut figure = Figure::new(
        Axis::linear("distance beyond the stop at the section, x"),
        Axis::log10("share of the iterates in a cell"),
    );
    figure.title = format!("Density of the attractor ({})", site.label);
    let mut draw = |name: String, stroke, attractor: &Attractor| {
        figure.series.push(Series::line(name, stroke, density(&attractor.values, range)));
    };
    draw("direct".to_owned(), Stroke::Solid, &compared.direct);
    for order in drawn {
        let found = compared.maps.iter().find(|(known, _)| known == order);
        if let Some((_, Some(attractor))) = found {
            draw(written(*order), Stroke::Dashed, attractor);
        }
    }
    figure
}

fn density(values: &[f64], [low, high]: [f64; 2]) -> Vec<[f64; 2]> {
    let width = (high - low) / CELLS as f64;
    let mut counts = [0usize; CELLS];
    for value in values {
        let cell = ((value - low) / width).floor();
        if (0.0..CELLS as f64).contains(&cell) {
            counts[cell as usize] += 1;
        }
    }
    let share = |(cell, &count): (usize, &usize)| {
        [low + (cell as f64 + 0.5) * width, count as f64 / values.len() as f64]
    };
    counts.iter().enumerate().map(share).collect()
}

/// Figure of the attractor's depths against the first parameter, by direct simulation and by a map
/// that predicts a single orbit.
pub(crate) fn sweep_figure(
    site: &Site,
    maps: &Maps<'_>,
    range: [f64; 2],
    drawn: (u32, u32),
) -> Figure {
    const POINTS: usize = 160;
    const SHOWN: usize = 60;
    let scales = maps.window().state;
    let request = OrbitRequest::new(1000, SHOWN, &scales);
    let sweep = |map: &dyn DiscreteMap| -> Vec<[f64; 2]> {
        let at = |number: usize| {
            let share = number as f64 / (POINTS - 1) as f64;
            let parameter = range[0] + share * (range[1] - range[0]);
            let parameters = [parameter, site.parameters[1]];
            let orbit = MapOrbit::of(map, &[0.0, 0.0], &parameters, &request);
            let states = orbit.states().map(|state| [parameter, state[0]]);
            states.collect::<Vec<_>>()
        };
        (0..POINTS).into_par_iter().flat_map_iter(at).collect()
    };
    let mut figure = Figure::new(
        Axis::linear("α − α*"),
        Axis::log10("depth y^{2} of the contacts").with_range(1e-9, 2e-3),
    );
    figure.title = format!("From grazing to beyond the flip ({})", site.label);
    let direct = sweep(&site.subject.double());
    figure.series.push(Series::dots("direct", direct));
    let map = sweep(&HornerMap::new(&maps.local(drawn)));
    let line = map.into_iter().step_by(SHOWN).collect();
    figure.series.push(Series::line(written(drawn), Stroke::Solid, line));
    figure
}
