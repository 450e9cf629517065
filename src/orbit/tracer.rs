//! One pass along a grazing curve: steps, points, and the special points between them.

use crate::model::Scene;
use crate::numeric::Dd;

use super::OrbitError;
use super::continuation::{correct, correct_dd, tangent};
use super::curve::{CurveEnd, CurveOptions, CurvePoint, GrazingCurve, SpecialKind, SpecialPoint};
use super::describe::{clearance, points};
use super::grazes::Grazes;
use super::monodromy::{full_monodromy, multipliers, on_section, xi};
use super::outcome::NotLocated;
use super::passages::passages;
use super::point::GrazingOrbit;
use super::section::PoincareSection;
use super::system::ExtendedSystem;

/// What is followed along a curve.
pub(super) struct Tracer<'a> {
    scene: &'a Scene,
    free: Vec<usize>,
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

/// Largest `|h|` of a passage that no equation holds, relative to the range of `h`: the roundoff of an `f64` root.
const TOUCHING: f64 = 1e-8;

/// Cosine of the largest turn of the tangent in one step.
const STRAIGHT: f64 = 0.98;

impl<'a> Tracer<'a> {
    /// A tracer of the curve through an orbit, in the parameters it was adjusted in and `with`.
    pub(super) fn new(
        scene: &'a Scene,
        orbit: &GrazingOrbit,
        with: usize,
        options: &'a CurveOptions,
    ) -> Result<Self, OrbitError> {
        let adjusted = scene.grazing.solve_for.iter().copied();
        let free: Vec<usize> = adjusted.chain([with]).collect();
        let system = ExtendedSystem::new(scene, Grazes::of(scene)?, orbit.parameters(), &free);
        Ok(Self {
            scene,
            free,
            system,
            options,
        })
    }

    /// Unknowns of a located orbit.
    pub(super) fn start(&self, orbit: &GrazingOrbit) -> Vec<f64> {
        let graze = orbit.grazing_point();
        let independent = &orbit.passages[1..self.system.grazes.independent];
        let times: Vec<Dd> = independent.iter().map(|passage| passage.time).collect();
        let unknowns = self
            .system
            .assemble(&graze.state, orbit.period, &times, &graze.parameters);
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
            free: self.free.clone(),
            points: Vec::new(),
            special: Vec::new(),
            end: CurveEnd::StepLimit,
        };
        let mut here = match self.station(start.to_vec(), &along)? {
            Ok(here) => here,
            Err(end) => {
                curve.end = end;
                return Ok((curve, start.to_vec()));
            }
        };
        curve.points.push(here.point.clone());
        let mut ds = self.options.ds;
        for _ in 0..self.options.max_steps {
            if here.unknowns[last] == to {
                curve.end = CurveEnd::Reached;
                break;
            }
            let (mut next, taken) = match self.step(&here, ds)? {
                Ok(step) => step,
                Err(end) => {
                    curve.end = end;
                    break;
                }
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

    /// The next station and the step that led there, or how the curve ends.
    fn step(
        &self,
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
            if let Some(found) = correct(&self.system, &predicted, &here.tangent)?
                && distance(&found, &predicted) < 0.3 * ds
            {
                match self.station(found, &here.tangent)? {
                    Ok(next) if dot(&next.tangent, &here.tangent) > STRAIGHT => {
                        return Ok(Ok((next, ds)));
                    }
                    Ok(_) => {}
                    Err(reason) => end = reason,
                }
            }
            ds *= 0.5;
        }
        Ok(Err(end))
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
        Ok(self.station(found, &here.tangent)?.ok())
    }

    /// Everything about a point of the curve, or why the curve ends there.
    fn station(
        &self,
        unknowns: Vec<f64>,
        along: &[f64],
    ) -> Result<Result<Station, CurveEnd>, OrbitError> {
        let Some(tangent) = tangent(&self.system, &unknowns, along)? else {
            return Ok(Err(CurveEnd::StepTooSmall { ds: 0.0 }));
        };
        let (point, discriminant) = match self.describe(&unknowns)? {
            Ok(described) => described,
            Err(end) => return Ok(Err(end)),
        };
        let xi = point
            .xi
            .iter()
            .enumerate()
            .map(|(n, &value)| (SpecialKind::Codimension2 { n: n + 1 }, value));
        let turning = tangent[self.system.first_parameter()..].iter();
        let folds = self
            .free
            .iter()
            .zip(turning)
            .map(|(&parameter, &component)| (SpecialKind::Fold { parameter }, component));
        let switch = discriminant.map(|value| (SpecialKind::MultiplierSwitch, value));
        let signs = xi.chain(folds).chain(switch).collect();
        Ok(Ok(Station {
            unknowns,
            tangent,
            signs,
            point,
        }))
    }

    /// The orbit at a point, and the discriminant of its two multipliers where there are two.
    fn describe(
        &self,
        unknowns: &[f64],
    ) -> Result<Result<(CurvePoint, Option<f64>), CurveEnd>, OrbitError> {
        let touches = match passages(self.scene, &self.system, unknowns, TOUCHING)? {
            Ok(found) => found.touches,
            Err(reason) => return Ok(Err(lost(&reason))),
        };
        let parameters = self.system.parameters(unknowns);
        let period = self.system.period(unknowns);
        let exact: Vec<Dd> = parameters.iter().map(|&value| Dd::from(value)).collect();
        let passages = points(self.scene, &self.system, &touches, &exact)?;
        let (graze, state) = (&passages[0], touches[0].state.clone());
        let local = self.system.geometry(0).at(&state, &parameters);
        let full = full_monodromy(&self.system.field, &state, &parameters, period)?;
        let model = &self.scene.model;
        let section = PoincareSection::tangency(model, graze.surface, &graze.state, &exact);
        let monodromy = on_section(&full, &section, &local);
        let discriminant = match monodromy.as_slice() {
            [a, b] => {
                let half_difference = (a[0] - b[1]) * 0.5;
                Some(half_difference * half_difference + a[1] * b[0])
            }
            _ => None,
        };
        let point = CurvePoint {
            normal_acceleration: local.acceleration(),
            multipliers: multipliers(&monodromy),
            xi: xi(&full, &local, self.options.xi_count),
            clearance: clearance(self.scene, &passages, Dd::from(period))?,
            parameters,
            state,
        };
        Ok(Ok((point, discriminant)))
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
            let Ok(station) = self.station(found, &here.tangent)? else {
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
        let Ok((point, _)) = self.describe(&unknowns)? else {
            return Ok(None);
        };
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

/// The end of a curve where a passage ceases to graze.
fn lost(reason: &NotLocated) -> CurveEnd {
    match *reason {
        NotLocated::OutOfOrder { passage, .. }
        | NotLocated::NoMinimum { passage, .. }
        | NotLocated::DoesNotTouch { passage, .. }
        | NotLocated::NotMirrored { passage, .. } => CurveEnd::PassageLost { passage },
        _ => CurveEnd::StepTooSmall { ds: 0.0 },
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
