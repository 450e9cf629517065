//! Maps chosen for a tolerance: orbits, folds and flips, compared with direct simulation.

use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::periodic::{PeriodicOrbit, PeriodicProblem, SectionMap, Stepped};
use grazemap::convergence::{Choice, ChoiceOptions, choose, chosen_map};
use grazemap::numeric::{Dd, Real};
use grazemap::report::{Cell, Column, ReportError, Table};
use grazemap_studies::held::{Bifurcation, bifurcation};

use crate::conclusions::Verdict;
use crate::subject::{Maps, Subject, one_impact};

/// Tolerances, as shares of the window's depth.
const SHARES: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-5, 1e-7];
/// Number of new points on which a choice is checked.
const FRESH: usize = 300;
/// Depths of the orbits compared, as shares of the window's depth, ascending.
const DEPTHS: [f64; 7] = [1e-4, 1e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0];

/// Predictions of a map: orbits by depth, and its bifurcation at an unfolding.
struct Said<S> {
    orbits: Vec<PeriodicOrbit<S>>,
    locus: Option<Bifurcation<S>>,
}

/// Table with one row per scene and tolerance.
pub(crate) fn table(
    subjects: &[(Subject, Option<(BifurcationKind, f64)>)],
) -> Result<Table, ReportError> {
    let headings = [
        "scene",
        "tolerance/depth",
        "N",
        "W",
        "shape",
        "error/depth",
        "dp/p at the edge",
        "dtr at the edge",
        "dp/p newborn",
        "orbit born",
        "fold or flip: dy²/y²",
    ];
    let mut columns: Vec<_> = headings.map(Column::number).into();
    for text in [0, 4, 9] {
        columns[text] = Column::text(headings[text]);
    }
    let mut table = Table::new(columns);
    for (subject, locus) in subjects {
        let maps = subject.maps();
        let truth = said(&mut subject.exact(), &maps, *locus);
        for share in SHARES {
            let depth = subject.scene.window.depth;
            let options = ChoiceOptions { tolerance: share * depth, fresh: FRESH };
            let choice =
                choose(&subject.scene, &subject.orbit, &options).expect("a scene with a window");
            let (_, run) =
                chosen_map(&choice, &subject.scene, &subject.orbit).expect("an expansion");
            let chosen = said(&mut Stepped(&run), &maps, *locus);
            table.push(row(subject, share, &choice, &truth, &chosen));
        }
    }
    Ok(table)
}

fn said<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    maps: &Maps<'_>,
    locus: Option<(BifurcationKind, f64)>,
) -> Said<S> {
    let problem = maps.problem(1);
    let window = maps.window();
    let depths = DEPTHS.map(|share| share * window.depth);
    let locus = locus.and_then(|(kind, share)| {
        first(map, &problem, kind, share * window.parameter[1], window.depth)
    });
    Said { orbits: one_impact(map, &problem, 0.0, &depths), locus }
}

/// The first bifurcation of a kind along a branch.
fn first<S: Real>(
    map: &mut (impl SectionMap<S> + ?Sized),
    problem: &PeriodicProblem,
    kind: BifurcationKind,
    unfolding: f64,
    deepest: f64,
) -> Option<Bifurcation<S>> {
    let depths: Vec<f64> = (-24..=4).map(|k| deepest * 10f64.powf(f64::from(k) / 4.0)).collect();
    let orbits = one_impact(map, problem, unfolding, &depths);
    orbits.windows(2).find_map(|pair| bifurcation(map, problem, kind, 0, [&pair[0], &pair[1]]))
}

fn row(
    subject: &Subject,
    share: f64,
    choice: &Choice,
    truth: &Said<Dd>,
    chosen: &Said<f64>,
) -> Vec<Cell> {
    let depth = subject.scene.window.depth;
    let errors = |number: usize| {
        let (truth, chosen) = (truth.orbits.get(number)?, chosen.orbits.get(number)?);
        let parameter = truth.parameters[0].to_f64();
        Some([
            (chosen.parameters[0] / parameter - 1.0).abs(),
            (chosen.trace() - truth.trace().to_f64()).abs(),
        ])
    };
    let cell = |value: Option<f64>| value.map_or(Cell::Missing, |value| Cell::number(value, 2));
    let verdict = match chosen.orbits.first() {
        Some(orbit) if Verdict::of(orbit).agrees(&Verdict::of(&truth.orbits[0])) => "right",
        Some(_) => "wrong",
        None => "not found",
    };
    let edge = errors(DEPTHS.len() - 1);
    let locus = match (&truth.locus, &chosen.locus) {
        (Some(truth), Some(chosen)) => Cell::number(locus_error(truth, chosen), 2),
        (Some(_), None) => Cell::text("none"),
        (None, _) => Cell::Missing,
    };
    vec![
        Cell::text(subject.name),
        Cell::number(share, 1),
        Cell::Integer(choice.orders.smooth_order.into()),
        Cell::Integer(choice.orders.contact_weight.into()),
        Cell::text(format!("{:?}", choice.shape).to_lowercase()),
        cell(choice.fresh_error.or(choice.error).map(|error| error / depth)),
        cell(edge.map(|errors| errors[0])),
        cell(edge.map(|errors| errors[1])),
        cell(errors(0).map(|errors| errors[0])),
        Cell::text(verdict),
        locus,
    ]
}

/// Relative difference of the depths of the bifurcating orbits.
fn locus_error(truth: &Bifurcation<Dd>, chosen: &Bifurcation<f64>) -> f64 {
    (chosen.orbit.states[0][0] / truth.orbit.states[0][0].to_f64() - 1.0).abs()
}
