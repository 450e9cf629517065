//! One pass along a grazing curve: steps, points, and the special points between them.

use crate::model::Scene;
use crate::numeric::{Dd, Real};

use super::OrbitError;
use super::continuation::{correct, correct_dd, tangent};
use super::curve::{CurveEnd, CurveOptions, CurvePoint, GrazingCurve, SpecialKind, SpecialPoint};
use super::describe::clearance;
use super::monodromy::{full_monodromy, multipliers, on_section, xi};
use super::point::{GrazingOrbit, GrazingPoint};
use super::section::{PoincareSection, reduced};
use super::system::ExtendedSystem;

/// What is followed along a curve.
pub(super) struct Tracer<'a> {
    scene: &'a Scene,
    surface: usize,
    free: [usize; 2],
    system: ExtendedSystem,
    options: &'a CurveOptions,
}

/// A point on the way, with the functions whose zeros are special points.
#[derive(Clone, Debug)]
struct Station {
    unknowns: Vec<f64>,
    tangent: Vec<f64>,
    signs: Vec<(SpecialKind, f64)>,
    point: CurvePoint,
}

/// Cosine of the largest turn of the tangent in one step.
const STRAIGHT: f64 = 0.98;

impl<'a> Tracer<'a> {
    /// A tracer of the curve through an orbit, in the parameter it was adjusted in and `with`.
    pub(super) fn new(
        scene: &'a Scene,
        orbit: &GrazingOrbit,
        with: usize,
        options: &'a CurveOptions,
    ) -> Self {
        let free = [scene.grazing.solve_for[0], with];
        let surface = orbit.grazing_point().surface;
        let system = ExtendedSystem::new(scene, surface, orbit.parameters(), &free);
        Self {
            scene,
            surface,
            free,
            system,
            options,
        }
    }

    /// Unknowns of a located orbit.
    pub(super) fn start(&self, orbit: &GrazingOrbit) -> Vec<f64> {
        let graze = orbit.grazing_point();
        let unknowns = self
            .system
            .assemble(&graze.state, orbit.period, &graze.parameters);
        unknowns.iter().map(|value| value.to_f64()).collect()
    }

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
            free: self.free,
            points: Vec::new(),
            special: Vec::new(),
            end: CurveEnd::StepLimit,
        };
        let Some(mut here) = self.station(start.to_vec(), &along)? else {
            curve.end = CurveEnd::StepTooSmall { ds: 0.0 };
            return Ok((curve, start.to_vec()));
        };
        curve.points.push(here.point.clone());
        let mut ds = self.options.ds;
        for _ in 0..self.options.max_steps {
            if here.unknowns[last] == to {
                curve.end = CurveEnd::Reached;
                break;
            }
            let Some((mut next, taken)) = self.step(&here, ds)? else {
                curve.end = CurveEnd::StepTooSmall {
                    ds: self.options.ds_min,
                };
                break;
            };
            ds = (taken * 1.3).min(self.options.ds_max);
            if (here.unknowns[last] - to) * (next.unknowns[last] - to) <= 0.0
                && let Some(end) = self.at_value(&here, &next, to)?
            {
                next = end;
            }
            curve.special.extend(self.special_between(&here, &next)?);
            curve.points.push(next.point.clone());
            here = next;
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

    /// The next station and the step that led there.
    fn step(&self, here: &Station, mut ds: f64) -> Result<Option<(Station, f64)>, OrbitError> {
        while ds >= self.options.ds_min {
            let predicted: Vec<f64> = here
                .unknowns
                .iter()
                .zip(&here.tangent)
                .map(|(u, t)| u + ds * t)
                .collect();
            if let Some(found) = correct(&self.system, &predicted, &here.tangent)?
                && distance(&found, &predicted) < 0.3 * ds
                && let Some(next) = self.station(found, &here.tangent)?
                && dot(&next.tangent, &here.tangent) > STRAIGHT
            {
                return Ok(Some((next, ds)));
            }
            ds *= 0.5;
        }
        Ok(None)
    }

    /// The station between two where the second parameter has a value.
    fn at_value(
        &self,
        here: &Station,
        next: &Station,
        to: f64,
    ) -> Result<Option<Station>, OrbitError> {
        let last = here.unknowns.len() - 1;
        let (a, b) = (here.unknowns[last], next.unknowns[last]);
        let share = if a == b { 1.0 } else { (to - a) / (b - a) };
        let mut origin = between(&here.unknowns, &next.unknowns, share);
        origin[last] = to;
        let mut normal = vec![0.0; last + 1];
        normal[last] = 1.0;
        let Some(mut found) = correct(&self.system, &origin, &normal)? else {
            return Ok(None);
        };
        found[last] = to;
        self.station(found, &here.tangent)
    }

    /// Everything about a point of the curve.
    fn station(&self, unknowns: Vec<f64>, along: &[f64]) -> Result<Option<Station>, OrbitError> {
        let Some(tangent) = tangent(&self.system, &unknowns, along)? else {
            return Ok(None);
        };
        let (point, discriminant) = self.describe(&unknowns)?;
        let first = unknowns.len() - 2;
        let xi = point
            .xi
            .iter()
            .enumerate()
            .map(|(n, &value)| (SpecialKind::Codimension2 { n: n + 1 }, value));
        let folds = (0..2).map(|k| {
            (
                SpecialKind::Fold {
                    parameter: self.free[k],
                },
                tangent[first + k],
            )
        });
        let switch = discriminant.map(|value| (SpecialKind::MultiplierSwitch, value));
        let signs = xi.chain(folds).chain(switch).collect();
        Ok(Some(Station {
            unknowns,
            tangent,
            signs,
            point,
        }))
    }

    /// The orbit at a point, and the discriminant of its two multipliers where there are two.
    fn describe<S: Real>(&self, unknowns: &[S]) -> Result<(CurvePoint, Option<f64>), OrbitError> {
        let parameters = self.system.parameters(unknowns);
        let mut state = unknowns[..self.system.dimension()].to_vec();
        if let (Some(phase), Some(value)) = (&self.scene.model.phase, state.last_mut()) {
            *value = S::from_dd(reduced(value.to_dd(), phase.period));
        }
        let local = self.system.geometry.at(&state, &parameters);
        let period = self.system.period(unknowns);
        let full = full_monodromy(&self.system.field, &state, &parameters, period)?;
        let to_dd = |values: &[S]| {
            values
                .iter()
                .map(|value| value.to_dd())
                .collect::<Vec<Dd>>()
        };
        let (point, values) = (to_dd(&state), to_dd(&parameters));
        let section = PoincareSection::tangency(&self.scene.model, self.surface, &point, &values);
        let monodromy = on_section(&full, &section, &local);
        let graze = GrazingPoint {
            surface: self.surface,
            state: point,
            parameters: values,
            normal_acceleration: local.acceleration().to_dd(),
            time: Dd::ZERO,
            section,
        };
        let discriminant = match monodromy.as_slice() {
            [a, b] => {
                let half_difference = (a[0] - b[1]) * S::from_f64(0.5);
                Some((half_difference * half_difference + a[1] * b[0]).to_f64())
            }
            _ => None,
        };
        let rounded = |values: &[S]| {
            values
                .iter()
                .map(|value| value.to_f64())
                .collect::<Vec<f64>>()
        };
        let point = CurvePoint {
            normal_acceleration: local.acceleration().to_f64(),
            multipliers: multipliers(&monodromy),
            xi: rounded(&xi(&full, &local, self.options.xi_count)),
            clearance: clearance(self.scene, &graze, period.to_dd())?,
            parameters: rounded(&parameters),
            state: rounded(&state),
        };
        Ok((point, discriminant))
    }

    /// Special points between two stations, in order along the curve.
    fn special_between(
        &self,
        here: &Station,
        next: &Station,
    ) -> Result<Vec<SpecialPoint>, OrbitError> {
        let mut found = Vec::new();
        for (index, (&(kind, a), &(_, b))) in here.signs.iter().zip(&next.signs).enumerate() {
            if a * b < 0.0
                && let Some(special) = self.refined(here, next, index, kind)?
            {
                found.push(special);
            }
        }
        found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok(found.into_iter().map(|(_, special)| special).collect())
    }

    /// The zero of one function between two stations: Illinois' false position in the share of the chord.
    fn refined(
        &self,
        here: &Station,
        next: &Station,
        index: usize,
        kind: SpecialKind,
    ) -> Result<Option<(f64, SpecialPoint)>, OrbitError> {
        let (mut low, mut high) = ((0.0, here.signs[index].1), (1.0, next.signs[index].1));
        let chord: Vec<f64> = next
            .unknowns
            .iter()
            .zip(&here.unknowns)
            .map(|(b, a)| b - a)
            .collect();
        let length = dot(&chord, &chord).sqrt();
        let normal: Vec<f64> = chord.iter().map(|value| value / length).collect();
        let mut best: Option<(f64, Vec<f64>)> = None;
        for _ in 0..60 {
            let share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let origin = between(&here.unknowns, &next.unknowns, share);
            let Some(found) = correct(&self.system, &origin, &normal)? else {
                break;
            };
            let Some(station) = self.station(found, &here.tangent)? else {
                break;
            };
            let value = station.signs[index].1;
            best = Some((share, station.unknowns));
            if value == 0.0 || (high.0 - low.0).abs() * length < 1e-14 || value.abs() < 1e-14 {
                break;
            }
            if value * high.1 < 0.0 {
                low = high;
            } else {
                low.1 *= 0.5;
            }
            high = (share, value);
        }
        let Some((share, unknowns)) = best else {
            return Ok(None);
        };
        let origin = between(&here.unknowns, &next.unknowns, share);
        let parameters = match correct_dd(&self.system, &unknowns, &origin, &normal)? {
            Some(root) => self.system.parameters(&root.unknowns),
            None => self
                .system
                .parameters(&unknowns)
                .into_iter()
                .map(Dd::from)
                .collect(),
        };
        let point = self.describe(&unknowns)?.0;
        Ok(Some((
            share,
            SpecialPoint {
                kind,
                parameters,
                point,
            },
        )))
    }
}

fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
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
