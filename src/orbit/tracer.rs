//! One pass along a grazing curve: steps, points, and the special points between them.

use super::OrbitError;
use super::continuation::correct;
use super::curve::{CurveEnd, CurveOptions, GrazingCurve, SpecialKind};
use super::special::{corner_between, special_between};
use super::station::{Station, Stations};

/// What is followed along a curve.
pub(super) struct Tracer<'a> {
    pub(super) stations: Stations<'a>,
    pub(super) options: &'a CurveOptions,
}

/// Cosine of the largest turn of the tangent in one step.
const STRAIGHT: f64 = 0.98;

/// Largest departure of a condition from its linear extrapolation in one step, as a share of its
/// size nearby: a sinusoid's phase then advances by a third of a radian at most, and two zeros do
/// not fit between two points.
const CURVED: f64 = 0.1;

/// A condition below this share of the largest is not followed in steps of its own.
const FAINT: f64 = 1e-9;

/// Steps are not made smaller than this share of the largest step for the sake of the conditions.
const FINEST: f64 = 1e-3;

impl Tracer<'_> {
    /// Follows the curve until the second parameter is `to`; also the last unknowns.
    pub(super) fn trace(
        &self,
        start: &[f64],
        to: f64,
    ) -> Result<(GrazingCurve, Vec<f64>), OrbitError> {
        let last = start.len() - 1;
        let from = start[last];
        let mut along = vec![0.0; start.len()];
        along[last] = if to < from { -1.0 } else { 1.0 };
        let mut curve = GrazingCurve {
            free: self.stations.system.free().to_vec(),
            points: Vec::new(),
            special: Vec::new(),
            end: CurveEnd::StepLimit,
        };
        let mut here = match self.stations.at(start.to_vec(), &along)? {
            Ok(here) => here,
            Err(end) => {
                curve.end = end;
                return Ok((curve, start.to_vec()));
            }
        };
        curve.points.push(here.point.clone());
        let mut before: Option<Station> = None;
        let mut ds = self.options.ds;
        for _ in 0..self.options.max_steps {
            if here.unknowns[last] == to {
                curve.end = CurveEnd::Reached;
                break;
            }
            let (mut next, taken) = match self.step(before.as_ref(), &here, ds)? {
                Ok(step) => step,
                Err(end) => {
                    curve.end = end;
                    break;
                }
            };
            ds = (taken * 1.3).min(self.options.ds_max);
            if (here.unknowns[last] - to) * (next.unknowns[last] - to) <= 0.0 {
                match self.at_value(&here, &next, to)? {
                    Ok(there) => next = there.unwrap_or(next),
                    Err(end) => {
                        curve.end = end;
                        break;
                    }
                }
            }
            curve
                .special
                .extend(special_between(&self.stations, &here, &next)?);
            curve.points.push(next.point.clone());
            before = Some(std::mem::replace(&mut here, next));
            if here.point.normal_acceleration <= 0.0 {
                curve.end = CurveEnd::DegenerateGraze {
                    normal_acceleration: here.point.normal_acceleration,
                };
                break;
            }
            if ((here.unknowns[last] - from) * 2.0 - (to - from)).abs() > 3.0 * (to - from).abs() {
                curve.end = CurveEnd::LeftRange;
                break;
            }
            if here.unknowns[last] == to {
                curve.end = CurveEnd::Reached;
                break;
            }
        }
        Ok((curve, here.unknowns))
    }

    /// The next station and the step that led there, or how the curve ends.
    fn step(
        &self,
        before: Option<&Station>,
        here: &Station,
        mut ds: f64,
    ) -> Result<Result<(Station, f64), CurveEnd>, OrbitError> {
        let mut end = CurveEnd::StepTooSmall {
            ds: self.options.ds_min,
        };
        while ds >= self.options.ds_min {
            let predicted: Vec<f64> = here
                .unknowns
                .iter()
                .zip(&here.tangent)
                .map(|(u, t)| u + ds * t)
                .collect();
            if let Some(found) = correct(&self.stations.system, &predicted, &here.tangent)?
                && distance(&found, &predicted) < 0.3 * ds
            {
                match self.stations.at(found, &here.tangent)? {
                    Ok(next)
                        if dot(&next.tangent, &here.tangent) > STRAIGHT
                            && (ds <= FINEST * self.options.ds_max
                                || before.is_none_or(|before| resolved(before, here, &next))) =>
                    {
                        match corner_between(&self.stations, here, &next)? {
                            None => return Ok(Ok((next, ds))),
                            Some(corner) => end = corner,
                        }
                    }
                    Ok(_) => {}
                    Err(reason) => end = reason,
                }
            }
            ds *= 0.5;
        }
        Ok(Err(end))
    }

    /// The station between two where the second parameter has a value; none where there is no orbit
    /// to be found, the end of the curve where its orbit has a corner.
    fn at_value(
        &self,
        here: &Station,
        next: &Station,
        to: f64,
    ) -> Result<Result<Option<Station>, CurveEnd>, OrbitError> {
        let last = here.unknowns.len() - 1;
        let (a, b) = (here.unknowns[last], next.unknowns[last]);
        let share = if a == b { 1.0 } else { (to - a) / (b - a) };
        let ends = here.unknowns.iter().zip(&next.unknowns);
        let mut origin: Vec<f64> = ends.map(|(a, b)| a + share * (b - a)).collect();
        origin[last] = to;
        let mut normal = vec![0.0; last + 1];
        normal[last] = 1.0;
        let Some(mut found) = correct(&self.stations.system, &origin, &normal)? else {
            return Ok(Ok(None));
        };
        found[last] = to;
        Ok(match self.stations.at(found, &here.tangent)? {
            Err(end @ CurveEnd::Corner { .. }) => Err(end),
            station => Ok(station.ok()),
        })
    }
}

/// Whether the conditions bend little enough over two steps that none of them vanishes twice in the
/// second.
fn resolved(before: &Station, here: &Station, next: &Station) -> bool {
    let grown =
        distance(&next.unknowns, &here.unknowns) / distance(&here.unknowns, &before.unknowns);
    let values = |station: &Station| {
        let conditions = station.signs.iter();
        let of = |(kind, value): &(SpecialKind, f64)| match kind {
            SpecialKind::Codimension2 { .. } => Some(*value),
            _ => None,
        };
        conditions.filter_map(of).collect::<Vec<f64>>()
    };
    let (a, b, c) = (values(before), values(here), values(next));
    let largest = b.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    a.iter().zip(&b).zip(&c).all(|((a, b), c)| {
        let size = a.abs().max(b.abs()).max(c.abs());
        let extrapolated = b + (b - a) * grown;
        size < FAINT * largest || (c - extrapolated).abs() <= CURVED * size
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}
