//! Folds and flips from a codimension-two point, by order against direct simulation.

use grazemap::analysis::MapEvaluation;
use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::periodic::{PeriodicOrbit, PeriodicProblem, SectionMap};
use grazemap::convergence::fit_slope;
use grazemap::numeric::{Dd, Scalar};
use grazemap::report::figure::{Axis, Figure, Marker, Series};
use grazemap::report::{Cell, Column, ReportError, Table};
use grazemap_studies::held::bifurcation;

use crate::born::{Graze, ORDERS};
use crate::subject::{HIGHEST, Maps, Subject, depths, one_impact, written};

/// Values of the second parameter, of both signs, as shares of the window's half-width.
const SHARES: [f64; 5] = [1.0, 0.3, 0.1, 0.03, 0.01];
/// Number of decades of depth, up to ten times the window's depth, in which a branch is searched.
const DECADES: i32 = 9;
/// Ratio that brackets the direct bifurcation around that of a map.
const BESIDE: f64 = 1.02;

/// Bifurcation by direct simulation, and its place by each order.
pub(crate) struct Locus {
    pub(crate) scene: &'static str,
    pub(crate) kind: BifurcationKind,
    /// Offset of the second parameter, absolute and as a share of the window.
    pub(crate) unfolding: f64,
    pub(crate) share: f64,
    /// Offset of the first parameter at which the free orbit grazes.
    grazing: f64,
    /// Depth and parameter by direct simulation.
    truth: Place,
    maps: Vec<Option<Place>>,
}

/// Depth `y²`, and offset of the first parameter.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) depth: f64,
    pub(crate) parameter: Dd,
}

impl Place {
    fn of(orbit: &PeriodicOrbit<Dd>) -> Self {
        Self { depth: orbit.states[0][0].to_f64(), parameter: orbit.parameters[0] }
    }
}

impl Locus {
    /// Relative error of the distance to the grazing curve.
    fn error(&self, order: usize) -> Option<f64> {
        let place = self.maps[order]?;
        let distance = (self.truth.parameter.to_f64() - self.grazing).abs();
        Some((place.parameter - self.truth.parameter).magnitude() / distance)
    }
}

/// Bifurcations of one-impact orbits of period one near a codimension-two point.
pub(crate) fn loci(subject: &Subject) -> Vec<Locus> {
    let maps = subject.maps();
    let problem = maps.problem(1);
    let width = maps.window().parameter[1];
    let signed = SHARES.iter().flat_map(|share| [*share, -share]);
    signed.flat_map(|share| at(subject, &maps, &problem, share, share * width)).collect()
}

fn at(
    subject: &Subject,
    maps: &Maps<'_>,
    problem: &PeriodicProblem,
    share: f64,
    unfolding: f64,
) -> Vec<Locus> {
    let depths = depths(10.0 * maps.window().depth, DECADES);
    let find = |order| found(&mut maps.exact(order), problem, unfolding, &depths);
    let by_order: Vec<_> = ORDERS.iter().map(|&order| find(order)).collect();
    let grazing = grazing(maps, unfolding);
    let mut direct = subject.exact();
    let highest = by_order.last().into_iter().flatten();
    let loci = highest.filter_map(|&(kind, near)| {
        let beside = [near.depth / BESIDE, near.depth * BESIDE];
        let truth = found(&mut direct, problem, unfolding, &beside);
        let truth = truth.into_iter().find(|(other, _)| *other == kind)?.1;
        let nearest = |places: &Vec<(BifurcationKind, Place)>| {
            let same = places.iter().filter(|(other, _)| *other == kind);
            let apart = |place: &Place| (place.depth / truth.depth).ln().abs();
            same.map(|(_, place)| *place).min_by(|a, b| apart(a).total_cmp(&apart(b)))
        };
        Some(Locus {
            scene: subject.name,
            kind,
            unfolding,
            share,
            grazing,
            truth,
            maps: by_order.iter().map(nearest).collect(),
        })
    });
    loci.collect()
}

/// Folds and flips between neighbours of a branch.
fn found(
    map: &mut (impl SectionMap<Dd> + ?Sized),
    problem: &PeriodicProblem,
    unfolding: f64,
    depths: &[f64],
) -> Vec<(BifurcationKind, Place)> {
    let orbits = one_impact(map, problem, unfolding, depths);
    let mut found = Vec::new();
    for pair in orbits.windows(2) {
        for kind in [BifurcationKind::Fold, BifurcationKind::Flip] {
            let point = bifurcation(map, problem, kind, 0, [&pair[0], &pair[1]]);
            found.extend(point.map(|point| (kind, Place::of(&point.orbit))));
        }
    }
    found
}

/// First parameter at which the free orbit reaches the stop: the fixed point of `P_smooth` at depth
/// zero.
fn grazing(maps: &Maps<'_>, unfolding: f64) -> f64 {
    let mut smooth = MapEvaluation::<Dd>::smooth(&maps.local(HIGHEST));
    let problem = PeriodicProblem { itinerary: None, ..maps.problem(1) };
    let orbits = one_impact(&mut smooth, &problem, unfolding, &[0.0]);
    orbits[0].parameters[0].to_f64()
}

/// Table of the bifurcations, with the error of each order.
pub(crate) fn table(loci: &[&Locus], shown: &[(u32, u32)]) -> Result<Table, ReportError> {
    let mut columns = vec![
        Column::text("scene"),
        Column::text("bifurcation"),
        Column::number("d omega"),
        Column::number("y² direct"),
        Column::number("p - p_graze direct"),
    ];
    columns.extend(shown.iter().map(|&order| Column::text(written(order))));
    let mut table = Table::new(columns);
    for locus in loci {
        let mut row = vec![
            Cell::text(locus.scene),
            Cell::text(name(locus.kind)),
            Cell::number(locus.unfolding, 2),
            Cell::number(locus.truth.depth, 4),
            Cell::number(locus.truth.parameter.to_f64() - locus.grazing, 4),
        ];
        row.extend(shown.iter().map(|order| {
            let place = ORDERS.iter().position(|known| known == order);
            match place.and_then(|place| locus.error(place)) {
                Some(error) => Cell::number(error, 2),
                None => Cell::text("none"),
            }
        }));
        table.push(row);
    }
    Ok(table)
}

pub(crate) fn name(kind: BifurcationKind) -> &'static str {
    match kind {
        BifurcationKind::Fold => "fold",
        BifurcationKind::Flip => "flip",
    }
}

/// Table of the powers of the unfolding in the relative errors: expected, and measured for each
/// family of bifurcations.
pub(crate) fn slope_table(families: &[Vec<&Locus>]) -> Result<Table, ReportError> {
    let mut columns = vec![Column::text("(N, W)"), Column::number("expected")];
    for family in families {
        let heading = format!("{}, {}", name(family[0].kind), family[0].scene);
        columns.push(Column::text(heading));
    }
    let mut table = Table::new(columns);
    for (place, &order) in ORDERS.iter().enumerate() {
        let expected = Graze::CodimensionTwo.parameter_slope(order) - 2;
        let mut row = vec![Cell::text(written(order)), Cell::number(f64::from(expected), 2)];
        for family in families {
            row.push(slope(family, place));
        }
        table.push(row);
    }
    Ok(table)
}

fn slope(family: &[&Locus], place: usize) -> Cell {
    if family.iter().all(|locus| locus.maps[place].is_none()) {
        return Cell::text("none");
    }
    let points = family.iter().filter_map(|locus| {
        let floor = 1e-12 / locus.share.abs();
        Some((locus.share.abs(), locus.error(place)?, floor))
    });
    let fit = fit_slope(&points.collect::<Vec<_>>());
    fit.map_or(Cell::text("-"), |fit| Cell::number(fit.slope, 3))
}

/// Families of bifurcations, of one kind and scene each, by descending unfolding.
pub(crate) fn families(loci: &[Locus]) -> Vec<Vec<&Locus>> {
    let mut families: Vec<Vec<&Locus>> = Vec::new();
    for locus in loci {
        let same = |family: &&mut Vec<&Locus>| {
            let first = family[0];
            first.scene == locus.scene && first.kind == locus.kind
        };
        match families.iter_mut().find(same) {
            Some(family) => family.push(locus),
            None => families.push(vec![locus]),
        }
    }
    families
}

/// Figure of the relative errors against the unfolding.
pub(crate) fn figure(family: &[&Locus], drawn: &[(u32, u32)]) -> Figure {
    let mut figure =
        Figure::new(Axis::log10("|ω − ω*|"), Axis::log10("error of p − p_{graze}, relative"));
    let (kind, scene) = (name(family[0].kind), family[0].scene);
    figure.title = format!("Where the {kind} of {scene} is");
    for (number, &order) in drawn.iter().enumerate() {
        let place = ORDERS.iter().position(|&known| known == order);
        let points = family.iter().filter_map(|locus| {
            let error = locus.error(place?)?;
            Some([locus.unfolding.abs(), error])
        });
        figure.series.push(Series::line_with_markers(
            written(order),
            Marker::numbered(number),
            points.collect(),
        ));
    }
    figure
}
