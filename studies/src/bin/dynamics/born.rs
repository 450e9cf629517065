//! Orbit born at the graze: position and multipliers by depth and order, against direct simulation.

use grazemap::analysis::periodic::PeriodicOrbit;
use grazemap::convergence::fit_slope;
use grazemap::numeric::{Dd, Scalar};
use grazemap::report::figure::{Axis, Figure, Marker, Series};
use grazemap::report::{Cell, Column, ReportError, Table};

use crate::subject::{Subject, depths, one_impact, written};

/// Orders of the tables.
pub(crate) const ORDERS: [(u32, u32); 11] =
    [(1, 1), (1, 2), (2, 1), (2, 2), (2, 3), (3, 3), (3, 4), (3, 5), (4, 6), (5, 8), (7, 10)];
/// Orders of the figures.
const DRAWN: [(u32, u32); 7] = [(1, 2), (2, 1), (2, 2), (2, 3), (3, 4), (4, 6), (5, 8)];
/// Number of decades of depth below the window's depth.
const DECADES: i32 = 6;
/// Rounding of a coefficient, and its effect on a parameter and on a trace, relative to the
/// largest.
const ROUNDING: f64 = 1e-14;

/// Orbits of one scene, by direct simulation and by order.
pub(crate) struct Born<'a> {
    pub(crate) subject: &'a Subject,
    depths: Vec<f64>,
    truth: Vec<PeriodicOrbit<Dd>>,
    maps: Vec<Vec<PeriodicOrbit<Dd>>>,
}

/// Kind of a graze. The linear part of the kick affects the next depth if `ξ₁ ≠ 0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Graze {
    Generic,
    CodimensionTwo,
}

impl Graze {
    /// Power of `y` in the error of the orbit's parameter.
    pub(crate) fn parameter_slope(self, (n, w): (u32, u32)) -> u32 {
        match self {
            Self::Generic => (n + 1).min(1 + w.div_ceil(2)),
            Self::CodimensionTwo if w < 2 => 2,
            Self::CodimensionTwo => (n + 1).min(2 + w.div_ceil(2)),
        }
    }
}

impl<'a> Born<'a> {
    pub(crate) fn new(subject: &'a Subject) -> Self {
        let maps = subject.maps();
        let problem = maps.problem(1);
        let depths = depths(maps.window().depth, DECADES);
        let truth = one_impact(&mut subject.exact(), &problem, 0.0, &depths);
        let by_order =
            ORDERS.map(|order| one_impact(&mut maps.exact(order), &problem, 0.0, &depths));
        assert_eq!(truth.len(), depths.len(), "{}: branch", subject.name);
        assert!(
            truth.iter().all(|orbit| orbit.extra_contacts == 0),
            "{}: physical orbits",
            subject.name
        );
        Self { subject, depths, truth, maps: by_order.into() }
    }

    /// Orbits at the smallest depth, by direct simulation and by a map.
    pub(crate) fn newborn(&self, order: (u32, u32)) -> (&PeriodicOrbit<Dd>, &PeriodicOrbit<Dd>) {
        (&self.truth[0], &self.maps[place(order)][0])
    }

    /// Errors of a map at every depth: `y`, error of the parameter, error of the trace.
    fn errors(&self, order: (u32, u32)) -> Vec<[f64; 3]> {
        let orbits = self.truth.iter().zip(&self.maps[place(order)]);
        let error = |((truth, map), depth): ((&PeriodicOrbit<Dd>, &PeriodicOrbit<Dd>), &f64)| {
            [
                depth.sqrt(),
                (map.parameters[0] - truth.parameters[0]).magnitude(),
                (map.trace() - truth.trace()).magnitude(),
            ]
        };
        orbits.zip(&self.depths).map(error).collect()
    }

    /// Powers of `y` in the errors of the parameter and of the trace.
    fn slopes(&self, order: (u32, u32)) -> [Option<f64>; 2] {
        let errors = self.errors(order);
        let floors: [fn(f64) -> f64; 2] = [|y| ROUNDING * y, |y| ROUNDING / y];
        [0, 1].map(|column| {
            let points = errors.iter().rev();
            let points =
                points.map(|error| (error[0], error[column + 1], floors[column](error[0])));
            fit_slope(&points.collect::<Vec<_>>()).map(|fit| fit.slope)
        })
    }
}

fn place(order: (u32, u32)) -> usize {
    let found = ORDERS.iter().position(|&known| known == order);
    found.expect("an order of the tables")
}

/// Table of the expected and measured powers of both errors, by order, with scenes side by side.
pub(crate) fn slope_table(graze: Graze, scenes: &[Born<'_>]) -> Result<Table, ReportError> {
    let mut columns = vec![
        Column::text("(N, W)"),
        Column::number("error of p: expected"),
        Column::number("of tr: expected"),
    ];
    for scene in scenes {
        columns.push(Column::number(format!("p, {}", scene.subject.name)));
        columns.push(Column::number(format!("tr, {}", scene.subject.name)));
    }
    let mut table = Table::new(columns);
    for order in ORDERS {
        let expected = f64::from(graze.parameter_slope(order));
        let mut row = vec![
            Cell::text(written(order)),
            Cell::number(expected, 3),
            Cell::number(expected - 2.0, 3),
        ];
        for scene in scenes {
            let cell = |slope: Option<f64>| slope.map_or(Cell::Missing, |s| Cell::number(s, 3));
            row.extend(scene.slopes(order).map(cell));
        }
        table.push(row);
    }
    Ok(table)
}

/// Table of the relative errors of the parameter and absolute errors of the trace, at a share of
/// the window's depth.
pub(crate) fn error_table(scenes: &[Born<'_>], decade: i32) -> Result<Table, ReportError> {
    let mut columns = vec![Column::text("(N, W)")];
    for scene in scenes {
        columns.push(Column::number(format!("dp/p, {}", scene.subject.name)));
        columns.push(Column::number(format!("dtr, {}", scene.subject.name)));
    }
    let mut table = Table::new(columns);
    let number = |scene: &Born<'_>| scene.depths.len() - 1 - 4 * decade as usize;
    let mut truth = vec![Cell::text("p, tr direct")];
    for scene in scenes {
        let orbit = &scene.truth[number(scene)];
        truth.push(Cell::number(orbit.parameters[0].to_f64(), 4));
        truth.push(Cell::number(orbit.trace().to_f64(), 4));
    }
    table.push(truth);
    for order in ORDERS {
        let mut row = vec![Cell::text(written(order))];
        for scene in scenes {
            let number = number(scene);
            let parameter = scene.truth[number].parameters[0].to_f64();
            match scene.errors(order).get(number) {
                Some([_, p, trace]) => {
                    row.push(Cell::number(p / parameter.abs(), 2));
                    row.push(Cell::number(*trace, 2));
                }
                None => row.extend([Cell::Missing, Cell::Missing]),
            }
        }
        table.push(row);
    }
    Ok(table)
}

/// Table of all errors by depth, for programs.
pub(crate) fn data_table(scenes: &[&Born<'_>]) -> Result<Table, ReportError> {
    let mut table = Table::new(vec![
        Column::text("scene"),
        Column::text("(N, W)"),
        Column::number("y"),
        Column::number("p direct"),
        Column::number("tr direct"),
        Column::number("error of p"),
        Column::number("error of tr"),
    ]);
    for scene in scenes {
        for order in ORDERS {
            for (error, truth) in scene.errors(order).iter().zip(&scene.truth) {
                table.push(vec![
                    Cell::text(scene.subject.name),
                    Cell::text(written(order)),
                    Cell::number(error[0], 5),
                    Cell::number(truth.parameters[0].to_f64(), 16),
                    Cell::number(truth.trace().to_f64(), 16),
                    Cell::number(error[1], 4),
                    Cell::number(error[2], 4),
                ]);
            }
        }
    }
    Ok(table)
}

/// Figure of the errors of the trace against `y`, by order.
pub(crate) fn trace_figure(scene: &Born<'_>, heading: &str) -> Figure {
    let mut figure = Figure::new(
        Axis::log10("y"),
        Axis::log10("error of the trace of the orbit born, relative").with_range(1e-10, 1e2),
    );
    figure.title = format!("{heading} ({})", scene.subject.name);
    for (number, order) in DRAWN.into_iter().enumerate() {
        let truth = scene.truth.iter();
        let points = scene.errors(order).into_iter().zip(truth);
        let points = points.map(|(error, truth)| [error[0], error[2] / truth.trace().magnitude()]);
        figure.series.push(Series::line_with_markers(
            written(order),
            Marker::numbered(number),
            points.collect(),
        ));
    }
    figure
}
