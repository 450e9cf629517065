//! Flip that ends a window of 1/n orbits of the cantilever: leading formula, maps, direct
//! simulation.

use grazemap::analysis::orbits::BifurcationKind;
use grazemap::analysis::periodic::{Guess, PeriodicOrbit, PeriodicProblem, SectionMap};
use grazemap::iteration::{DiscreteMap, HornerMap};
use grazemap::numeric::Dd;
use grazemap::report::{Cell, Column, ReportError, Table};
use grazemap_studies::held::{bifurcation, branch};

use crate::born::ORDERS;
use crate::subject::{HIGHEST, Maps, Subject, written};

/// Returns of an orbit, and an offset of the wall at which it is stable.
const WINDOWS: [(usize, f64); 2] = [(6, 2.45e-4), (7, 1.145e-4)];
/// Iterates until the orbit has settled.
const TRANSIENT: usize = 20_000;
/// Step of the section coordinate along a branch, as a share of it, and number of steps on each
/// side.
const STEP: f64 = 0.01;
const STEPS: i32 = 50;

/// Table of the flip by direct simulation, by every order, and by the formula of lowest order.
pub(crate) fn table() -> Result<Table, ReportError> {
    let subject = Subject::new("cantilever_3_5_soft");
    let maps = subject.maps();
    let mut table = Table::new(vec![
        Column::text("(N, W)"),
        Column::number("1/6: mu of the flip"),
        Column::number("over the direct one"),
        Column::number("1/7: mu of the flip"),
        Column::number("over the direct one"),
    ]);
    let guesses = WINDOWS.map(|(returns, wall)| settled(&maps, returns, wall));
    let flips = |map: &mut dyn SectionMap<Dd>| {
        [0, 1].map(|number| flip(map, &maps.problem(WINDOWS[number].0), &guesses[number]))
    };
    let direct = flips(&mut subject.exact());
    let mut push = |name: String, values: [Option<f64>; 2]| {
        let mut row = vec![Cell::text(name)];
        for (value, direct) in values.iter().zip(&direct) {
            match (value, direct) {
                (Some(value), Some(direct)) => {
                    row.extend([Cell::number(*value, 6), Cell::number(value / direct, 5)]);
                }
                _ => row.extend([Cell::text("none"), Cell::Missing]),
            }
        }
        table.push(row)
    };
    push("direct".to_owned(), direct);
    push("leading law".to_owned(), WINDOWS.map(|(returns, _)| Some(leading(&subject, returns))));
    for order in ORDERS {
        push(written(order), flips(&mut maps.exact(order)));
    }
    Ok(table)
}

/// Offset of the wall at which the multiplier of the leading law is −1.
///
/// ```text
/// Λ = −ξ_n² / (a_G μ (λ1ⁿ − 1)(λ2ⁿ − 1)),   ξ_n = ξ_1 (λ1ⁿ − λ2ⁿ)/(λ1 − λ2),   ξ_1 = (1 + r) a_G γ
/// ```
fn leading(subject: &Subject, returns: usize) -> f64 {
    let orbit = &subject.orbit;
    let acceleration = orbit.grazing_point().normal_acceleration.to_f64();
    let (first, second) = (orbit.multipliers[0][0], orbit.multipliers[1][0]);
    let powers = [first.powi(returns as i32), second.powi(returns as i32)];
    let xi = orbit.xi[0].to_f64() * (powers[0] - powers[1]) / (first - second);
    xi * xi / (acceleration * (powers[0] - 1.0) * (powers[1] - 1.0))
}

/// Orbit on which the most accurate map settles, beginning with the return that makes contact.
fn settled(maps: &Maps<'_>, returns: usize, wall: f64) -> Guess<Dd> {
    let map = HornerMap::new(&maps.local(HIGHEST));
    let (mut state, parameters) = (vec![0.0, 0.0], [wall, 0.0]);
    let mut image = vec![0.0, 0.0];
    for iterate in 0..TRANSIENT + returns {
        let info = map.step(&state, &parameters, &mut image);
        if iterate >= TRANSIENT && info.contacts() > 0 {
            break;
        }
        state.copy_from_slice(&image);
    }
    Guess {
        state: state.into_iter().map(Dd::from).collect(),
        parameters: parameters.map(Dd::from).into(),
    }
}

/// Flip of a 1/n orbit. The branch is followed in the first coordinate, downwards to the last orbit
/// of the map, then upwards from there.
fn flip(map: &mut dyn SectionMap<Dd>, problem: &PeriodicProblem, guess: &Guess<Dd>) -> Option<f64> {
    let value = |step: i32| guess.state[0] * Dd::from(1.0 - STEP * f64::from(step));
    let down: Vec<Dd> = (0..STEPS).map(value).collect();
    let (first, orbits) = (0..down.len())
        .map(|first| (first, branch(map, problem, 0, &down[first..], guess)))
        .find(|(_, orbits)| orbits.len() > 1)?;
    let up: Vec<Dd> = (-STEPS..=first as i32).rev().map(value).collect();
    let start = orbits[0].guess();
    turned(map, problem, &orbits).or_else(|| {
        let orbits = branch(map, problem, 0, &up, &start);
        turned(map, problem, &orbits)
    })
}

/// Parameter of the first flip between neighbours.
fn turned(
    map: &mut dyn SectionMap<Dd>,
    problem: &PeriodicProblem,
    orbits: &[PeriodicOrbit<Dd>],
) -> Option<f64> {
    let between = |pair: &[PeriodicOrbit<Dd>]| {
        bifurcation(map, problem, BifurcationKind::Flip, 0, [&pair[0], &pair[1]])
    };
    let found = orbits.windows(2).find_map(between)?;
    Some(found.orbit.parameters[0].to_f64())
}
