//! Tables of the page.

use grazemap::convergence::{Choice, Polynomials};
use grazemap::model::Shape;
use grazemap::report::{Cell, Column, ReportError, Table, limit_words};

use crate::TOLERANCES;
use crate::measure::Row;

/// Table of every scene at every tolerance.
pub(crate) fn choices(rows: &[Row]) -> Result<Table, ReportError> {
    let mut columns = vec![Column::text("scene"), Column::number("tolerance")];
    columns.extend(
        ["met", "(N, W)", "predicted", "weights", "shape", "coefficients"].map(Column::text),
    );
    let numbers = [
        "how many",
        "operations",
        "step [ns]",
        "its floor [ns]",
        "largest error",
        "over tolerance",
        "points",
        "above 1.1",
        "direct [ns]",
        "direct over step",
        "f32 error over tolerance",
        "choice [s]",
    ];
    columns.extend(numbers.map(Column::number));
    let mut table = Table::new(columns);
    for row in rows {
        table.push(line(row));
    }
    Ok(table)
}

fn line(row: &Row) -> Vec<Cell> {
    let choice = &row.choice;
    let predicted = choice.predicted;
    let weights: Vec<_> =
        choice.weights.iter().map(|(name, weight)| format!("{name} {weight}")).collect();
    let mut line = vec![Cell::text(&row.scene), Cell::number(choice.tolerance, 1)];
    line.extend([
        Cell::text(if choice.met { "yes" } else { "no" }),
        Cell::text(pair(choice.orders.smooth_order, choice.orders.contact_weight)),
        match choice.shape {
            Shape::Flown => Cell::Missing,
            _ => Cell::text(pair(predicted.smooth_order, predicted.contact_weight)),
        },
        if weights.is_empty() { Cell::Missing } else { Cell::text(weights.join(", ")) },
        Cell::text(shape(choice)),
        Cell::text(coefficients(choice)),
        Cell::Integer(choice.coefficients as i64),
        Cell::Integer(choice.operations as i64),
        Cell::number(row.step_ns, 3),
        Cell::number(row.floor_ns, 3),
        number(row.error, 2),
        number(row.error / choice.tolerance, 2),
        Cell::Integer(row.points as i64),
        Cell::Integer(row.exceeding as i64),
        Cell::number(row.direct_ns, 3),
        Cell::number(row.direct_ns / row.step_ns, 2),
        choice
            .single_precision_error
            .map_or(Cell::Missing, |error| number(error / choice.tolerance, 2)),
        Cell::number(choice.seconds, 2),
    ]);
    line
}

fn pair(n: u32, w: u32) -> String {
    format!("({n}, {w})")
}

fn shape(choice: &Choice) -> &'static str {
    match choice.shape {
        Shape::Composed => "composed",
        Shape::Flown => "flown",
        Shape::Factored | Shape::Auto => "factored",
    }
}

fn coefficients(choice: &Choice) -> &'static str {
    match choice.polynomials {
        Polynomials::Taylor => "Taylor",
        Polynomials::Economised => "economised",
    }
}

fn number(value: f64, digits: usize) -> Cell {
    if value.is_finite() { Cell::number(value, digits) } else { Cell::Missing }
}

/// Table by tolerance: number of scenes that meet it, and costs.
pub(crate) fn summary(rows: &[Row]) -> Result<Table, ReportError> {
    let headings = [
        "tolerance",
        "scenes",
        "met",
        "of them composed",
        "flown",
        "economised",
        "median operations",
        "median step [ns]",
        "median of step over floor",
        "median of direct over step",
        "least",
        "largest error over tolerance",
        "scenes with points above 1.1",
        "f32 would do",
        "median choice [s]",
        "longest [s]",
    ];
    let mut table = Table::new(headings.into_iter().map(Column::number).collect());
    for tolerance in TOLERANCES {
        let of: Vec<&Row> = rows.iter().filter(|row| row.choice.tolerance == tolerance).collect();
        let met: Vec<&Row> = of.iter().copied().filter(|row| row.choice.met).collect();
        let count = |holds: &dyn Fn(&Row) -> bool| {
            Cell::Integer(met.iter().filter(|row| holds(row)).count() as i64)
        };
        let all = |value: &dyn Fn(&Row) -> f64| sorted(met.iter().map(|row| value(row)));
        let ratios = all(&|row| row.direct_ns / row.step_ns);
        let excess = all(&|row| row.error / tolerance);
        let seconds = sorted(of.iter().map(|row| row.choice.seconds));
        table.push(vec![
            Cell::number(tolerance, 1),
            Cell::Integer(of.len() as i64),
            Cell::Integer(met.len() as i64),
            count(&|row| row.choice.shape == Shape::Composed),
            count(&|row| row.choice.shape == Shape::Flown),
            count(&|row| row.choice.polynomials == Polynomials::Economised),
            Cell::number(median(&all(&|row| row.choice.operations as f64)), 3),
            Cell::number(median(&all(&|row| row.step_ns)), 3),
            Cell::number(median(&all(&|row| row.step_ns / row.floor_ns)), 3),
            Cell::number(median(&ratios), 2),
            Cell::number(ratios.first().copied().unwrap_or(f64::NAN), 2),
            number(excess.last().copied().unwrap_or(f64::NAN), 3),
            count(&|row| row.exceeding > 0),
            count(&|row| {
                let single = row.choice.single_precision_error;
                single.is_some_and(|error| error <= tolerance)
            }),
            Cell::number(median(&seconds), 2),
            Cell::number(seconds.last().copied().unwrap_or(f64::NAN), 2),
        ]);
    }
    Ok(table)
}

/// Table of the cases that no map meets, with the smallest error.
pub(crate) fn refusals(rows: &[Row]) -> Result<Table, ReportError> {
    let mut columns =
        vec![Column::text("scene"), Column::number("tolerance"), Column::text("nearest (N, W)")];
    columns.extend([Column::number("largest error"), Column::text("why")]);
    let mut table = Table::new(columns);
    for row in rows.iter().filter(|row| !row.choice.met) {
        let choice = &row.choice;
        table.push(vec![
            Cell::text(&row.scene),
            Cell::number(choice.tolerance, 1),
            Cell::text(pair(choice.orders.smooth_order, choice.orders.contact_weight)),
            number(row.error, 2),
            choice
                .limit
                .map_or(Cell::Missing, |limit| Cell::text(limit_words(limit, choice.precision))),
        ]);
    }
    Ok(table)
}

/// Table of the largest error over each met tolerance, at points where two passages make contact.
pub(crate) fn joint(rows: &[Row]) -> Result<Table, ReportError> {
    let tolerances = TOLERANCES.map(|tolerance| Column::number(format!("at {tolerance:e}")));
    let mut columns = vec![Column::text("scene"), Column::number("points")];
    columns.extend(tolerances);
    let mut table = Table::new(columns);
    let scenes = rows.chunk_by(|a, b| a.scene == b.scene);
    for scene in scenes.filter(|scene| scene[0].joint_points > 0) {
        let mut line =
            vec![Cell::text(&scene[0].scene), Cell::Integer(scene[0].joint_points as i64)];
        line.extend(scene.iter().map(|row| match row.choice.met {
            true => number(row.joint_error / row.choice.tolerance, 2),
            false => Cell::Missing,
        }));
        table.push(line);
    }
    Ok(table)
}

/// Table of the scenes whose window contains points with `xi_1` near 0.
pub(crate) fn least(rows: &[Row]) -> Result<Table, ReportError> {
    let mut columns = vec![Column::text("scene")];
    let numbers = ["term in y", "its change over the parameters", "term in y²", "largest y"];
    columns.extend(numbers.map(Column::number));
    let mut table = Table::new(columns);
    for scene in rows.chunk_by(|a, b| a.scene == b.scene) {
        if let Some(least) = scene[0].choice.least_orders {
            let numbers = [least.linear, least.spread, least.quadratic, least.largest];
            let mut line = vec![Cell::text(&scene[0].scene)];
            line.extend(numbers.map(|value| number(value, 2)));
            table.push(line);
        }
    }
    Ok(table)
}

/// Table of the differences between predicted and chosen orders, for maps of series.
pub(crate) fn rule(rows: &[Row]) -> Result<Table, ReportError> {
    let headings = [
        "tolerance",
        "choices",
        "N predicted less chosen, mean",
        "within 1",
        "within 2",
        "W predicted less chosen, mean",
        "within 1",
        "within 2",
        "both within 1",
        "both within 2",
    ];
    let mut table = Table::new(headings.into_iter().map(Column::number).collect());
    let series = |row: &&Row| row.choice.met && row.choice.shape != Shape::Flown;
    let gaps = |row: &Row| {
        let (choice, predicted) = (&row.choice, row.choice.predicted);
        let gap = |a: u32, b: u32| f64::from(a) - f64::from(b);
        [
            gap(predicted.smooth_order, choice.orders.smooth_order),
            gap(predicted.contact_weight, choice.orders.contact_weight),
        ]
    };
    for tolerance in TOLERANCES.map(Some).into_iter().chain([None]) {
        let of = rows.iter().filter(series);
        let of =
            of.filter(|row| tolerance.is_none_or(|tolerance| row.choice.tolerance == tolerance));
        let gaps: Vec<[f64; 2]> = of.map(gaps).collect();
        let count = gaps.len() as f64;
        let share = |within: &dyn Fn(&[f64; 2]) -> bool| {
            Cell::number(gaps.iter().filter(|gap| within(gap)).count() as f64 / count, 2)
        };
        let mean = |of: usize| Cell::number(gaps.iter().map(|gap| gap[of]).sum::<f64>() / count, 2);
        table.push(vec![
            tolerance.map_or(Cell::text("all"), |tolerance| Cell::number(tolerance, 1)),
            Cell::Integer(gaps.len() as i64),
            mean(0),
            share(&|gap| gap[0].abs() <= 1.0),
            share(&|gap| gap[0].abs() <= 2.0),
            mean(1),
            share(&|gap| gap[1].abs() <= 1.0),
            share(&|gap| gap[1].abs() <= 2.0),
            share(&|gap| gap.iter().all(|gap| gap.abs() <= 1.0)),
            share(&|gap| gap.iter().all(|gap| gap.abs() <= 2.0)),
        ]);
    }
    Ok(table)
}

pub(crate) fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

pub(crate) fn median(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
