//! Predictions of each order for the orbit born at a codimension-two point, and the true behaviour.

use grazemap::analysis::periodic::PeriodicOrbit;
use grazemap::numeric::{Dd, Real};
use grazemap::report::{Cell, Column, ReportError, Table};

use crate::born::{Born, ORDERS};
use crate::subject::written;

/// Distance of multipliers below which a double multiplier may split into real or complex ones.
const NEAR: f64 = 0.1;

/// Properties of an orbit that is born at a graze.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Verdict {
    /// Whether the orbit exists where the free orbit has met the stop.
    after: bool,
    kind: &'static str,
    /// Number of multipliers outside the unit circle.
    outside: usize,
    values: Vec<[f64; 2]>,
    multipliers: String,
    /// Ratio of the parameter to the depth `y²`.
    curvature: f64,
}

impl Verdict {
    pub(crate) fn of<S: Real>(orbit: &PeriodicOrbit<S>) -> Self {
        let multipliers = orbit.multipliers().expect("a finite Jacobian");
        let outside = multipliers.iter().filter(|m| m.norm() > 1.0).count();
        let turns = multipliers[0].im.abs() > 1e-3;
        let kind = match (outside, turns) {
            (0, false) => "stable node",
            (0, true) => "stable focus",
            (1, _) if multipliers[0].re < 0.0 => "unstable, flipped",
            (1, _) => "saddle",
            (_, false) => "unstable node",
            (_, true) => "unstable focus",
        };
        let written = match multipliers.as_slice() {
            [a, b] if a.im.abs() < 1e-3 => format!("{:.3}, {:.3}", a.re, b.re),
            [a, ..] => format!("{:.3} ± {:.3}i", a.re, a.im.abs()),
            [] => String::new(),
        };
        let parameter = orbit.parameters[0].to_f64();
        Self {
            after: parameter > 0.0,
            kind,
            outside,
            values: multipliers.iter().map(|m| [m.re, m.im.abs()]).collect(),
            multipliers: written,
            curvature: parameter / orbit.states[0][0].to_f64(),
        }
    }

    /// Kind of the bifurcation, as text.
    fn grazing(&self) -> &'static str {
        match (self.after, self.kind.starts_with("stable")) {
            (true, true) => "continuous",
            (true, false) => "unstable orbit after it",
            (false, true) => "stable orbit before it",
            (false, false) => "discontinuous",
        }
    }

    /// Whether side, stability and kind agree with those of another orbit. A node and a focus count
    /// as equal if their multipliers are within [`NEAR`] of each other, because a double multiplier
    /// does not distinguish them.
    pub(crate) fn agrees(&self, truth: &Self) -> bool {
        let pairs = self.values.iter().zip(&truth.values);
        let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) < NEAR;
        let alike = self.kind == truth.kind || pairs.into_iter().all(near);
        (self.after, self.outside) == (truth.after, truth.outside) && alike
    }
}

/// Table of the verdicts at the smallest depth, by order.
pub(crate) fn table(scenes: &[Born<'_>]) -> Result<Table, ReportError> {
    let headings =
        ["scene", "(N, W)", "side", "p/y²", "orbit", "multipliers", "grazing", "verdict"];
    let mut columns: Vec<_> = headings.map(Column::text).into();
    columns[3] = Column::number("p/y²");
    let mut table = Table::new(columns);
    for scene in scenes {
        let truth = Verdict::of(scene.newborn(ORDERS[0]).0);
        table.push(row(scene, "direct".to_owned(), &truth, ""));
        for order in ORDERS.into_iter().take(6) {
            let orbit: &PeriodicOrbit<Dd> = scene.newborn(order).1;
            let verdict = Verdict::of(orbit);
            let word = match verdict.agrees(&truth) {
                false => "wrong",
                true if (verdict.curvature / truth.curvature - 1.0).abs() > 0.01 => "misplaced",
                true => "right",
            };
            table.push(row(scene, written(order), &verdict, word));
        }
    }
    Ok(table)
}

fn row(scene: &Born<'_>, order: String, verdict: &Verdict, word: &str) -> Vec<Cell> {
    let side = if verdict.after { "after" } else { "before" };
    vec![
        Cell::text(scene.subject.name),
        Cell::text(order),
        Cell::text(side),
        Cell::number(verdict.curvature, 4),
        Cell::text(verdict.kind),
        Cell::text(verdict.multipliers.clone()),
        Cell::text(verdict.grazing()),
        Cell::text(word),
    ]
}
