//! Newton's method on the extended system, in units, the period matched at its end or at its
//! middle.

use super::OrbitError;
use super::newton::{Root, Solve, refine, solve};
use super::system::{ExtendedSystem, Matching};

/// Newton's method with the period matched at its end, then at its middle; the end's failure if
/// both fail. The tolerance is one of residuals in the units of the start.
pub(super) fn solve_either(
    system: &ExtendedSystem,
    start: &[f64],
    tolerance: f64,
) -> Result<Solve<Vec<f64>>, OrbitError> {
    let matched = |matching| {
        let system = system.matched(matching);
        let scaled = system.scaled(start);
        scaled.solve(start, |scaled, start| solve(scaled, start, tolerance))
    };
    match matched(Matching::AtEnd)? {
        Solve::Root(root) => Ok(Solve::Root(root)),
        Solve::Failed(failure) => Ok(match matched(Matching::AtMiddle)? {
            Solve::Root(root) => Solve::Root(root),
            Solve::Failed(_) => Solve::Failed(failure),
        }),
    }
}

/// Refinement with the period matched at its end, then at its middle, to a tolerance relative to
/// the size of the unknowns in units of their own.
pub(super) fn refine_either(
    system: &ExtendedSystem,
    start: &[f64],
    tolerance: f64,
) -> Result<Solve<Root>, OrbitError> {
    let matched = |matching| {
        let system = system.matched(matching);
        let scaled = system.scaled(start);
        let unknowns = scaled.in_units(start);
        let size = unknowns
            .iter()
            .fold(1.0_f64, |size, value| size.max(value.abs()));
        scaled.refine(start, |scaled, start| {
            refine(scaled, start, tolerance * size)
        })
    };
    match matched(Matching::AtEnd) {
        Ok(Solve::Root(root)) => Ok(Solve::Root(root)),
        _ => matched(Matching::AtMiddle),
    }
}
