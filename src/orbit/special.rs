//! Special points between two stations of a grazing curve: zeros of functions along it.

use nalgebra::DMatrix;

use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::continuation::{bordered, correct, correct_dd};
use super::curve::{SpecialKind, SpecialPoint};
use super::newton::{Equations, Solve, refine};
use super::station::{Station, Stations};

/// Trials of a false position.
const TRIALS: usize = 60;
/// Part of the chord, and value of the function, at which a false position ends.
const ENOUGH: f64 = 1e-14;
/// Step of a difference quotient, relative to the unknown.
const DIFFERENCE: f64 = 1e-7;
/// Largest residual of a point refined in double-double.
const REFINED: f64 = 1e-22;

/// Special points between two stations, in order along the curve.
pub(super) fn special_between(
    stations: &Stations<'_>,
    here: &Station,
    next: &Station,
) -> Result<Vec<SpecialPoint>, OrbitError> {
    let mut found = Vec::new();
    for (index, (&(kind, a), &(_, b))) in here.signs.iter().zip(&next.signs).enumerate() {
        if a * b < 0.0
            && let Some((share, unknowns)) = Chord::new(here, next).zero(stations, index)?
            && let Some(special) = refined(stations, here, next, kind, share, &unknowns)?
        {
            found.push((share, special));
        }
    }
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(found.into_iter().map(|(_, special)| special).collect())
}

/// The chord between two stations, with planes across it.
struct Chord<'a> {
    here: &'a Station,
    next: &'a Station,
    length: f64,
    normal: Vec<f64>,
}

impl<'a> Chord<'a> {
    fn new(here: &'a Station, next: &'a Station) -> Self {
        let ends = next.unknowns.iter().zip(&here.unknowns);
        let chord: Vec<f64> = ends.map(|(b, a)| b - a).collect();
        let length = chord.iter().map(|value| value * value).sum::<f64>().sqrt();
        Self {
            here,
            next,
            length,
            normal: chord.iter().map(|value| value / length).collect(),
        }
    }

    fn origin(&self, share: f64) -> Vec<f64> {
        let ends = self.here.unknowns.iter().zip(&self.next.unknowns);
        ends.map(|(a, b)| a + share * (b - a)).collect()
    }

    /// The zero of one function: Illinois' false position in the share of the chord, every trial corrected onto the
    /// curve.
    fn zero(
        &self,
        stations: &Stations<'_>,
        index: usize,
    ) -> Result<Option<(f64, Vec<f64>)>, OrbitError> {
        let mut low = (0.0, self.here.signs[index].1);
        let mut high = (1.0, self.next.signs[index].1);
        let mut best = None;
        for _ in 0..TRIALS {
            let share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let origin = self.origin(share);
            let Some(found) = correct(&stations.system, &origin, &self.normal)? else {
                break;
            };
            let Ok(station) = stations.at(found, &self.here.tangent)? else {
                break;
            };
            let value = station.signs[index].1;
            best = Some((share, station.unknowns));
            if (high.0 - low.0).abs() * self.length < ENOUGH || value.abs() < ENOUGH {
                break;
            }
            if value * high.1 < 0.0 {
                low = high;
            } else {
                low.1 *= 0.5;
            }
            high = (share, value);
        }
        Ok(best)
    }
}

/// A special point to the roundoff of double-double: a condition's zero itself, of other functions the point of the curve.
fn refined(
    stations: &Stations<'_>,
    here: &Station,
    next: &Station,
    kind: SpecialKind,
    share: f64,
    unknowns: &[f64],
) -> Result<Option<SpecialPoint>, OrbitError> {
    let Ok((point, _)) = stations.describe(unknowns)? else {
        return Ok(None);
    };
    let root = match kind {
        SpecialKind::Codimension2 { n, from, to } => {
            let zero = Zero {
                stations,
                from,
                to,
                n,
            };
            refine(&zero, unknowns, REFINED)?
        }
        _ => {
            let chord = Chord::new(here, next);
            let origin = chord.origin(share);
            correct_dd(&stations.system, unknowns, &origin, &chord.normal)?
        }
    };
    let unknowns = match root {
        Solve::Root(root) => root.unknowns,
        Solve::Failed(_) => unknowns.iter().map(|&value| Dd::from(value)).collect(),
    };
    Ok(Some(SpecialPoint {
        kind,
        parameters: stations.system.parameters(&unknowns),
        point,
    }))
}

/// The extended system with one condition required to vanish.
struct Zero<'a> {
    stations: &'a Stations<'a>,
    from: usize,
    to: usize,
    n: usize,
}

impl Zero<'_> {
    fn condition<S: Real>(&self, unknowns: &[S]) -> Result<S, OrbitError> {
        self.stations
            .condition(unknowns, self.from, self.to, self.n)
    }

    fn all<S: Real>(&self, unknowns: &[S]) -> Result<Vec<S>, OrbitError> {
        let mut residual = self.stations.system.evaluate(unknowns)?;
        residual.push(self.condition(unknowns)?);
        Ok(residual)
    }
}

impl Equations for Zero<'_> {
    /// The condition's row by differences: a correction needs few digits.
    fn linearised(&self, unknowns: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), OrbitError> {
        let (mut residual, jacobian) = self.stations.system.differentiate(unknowns)?;
        let value = self.condition(unknowns)?;
        residual.push(value);
        let slope = |position: usize| {
            let mut moved = unknowns.to_vec();
            let step = DIFFERENCE * moved[position].abs().max(1.0);
            moved[position] += step;
            Ok((self.condition(&moved)? - value) / step)
        };
        let row: Result<Vec<f64>, OrbitError> = (0..unknowns.len()).map(slope).collect();
        Ok((residual, bordered(&jacobian, &row?)))
    }

    fn residual(&self, unknowns: &[f64]) -> Result<Vec<f64>, OrbitError> {
        self.all(unknowns)
    }

    fn residual_dd(&self, unknowns: &[Dd]) -> Result<Vec<Dd>, OrbitError> {
        self.all(unknowns)
    }
}
