//! A local map evaluated over any number: what its coefficients say, without the rounding of a step.

use crate::expansion::{Contact, Leg, LocalMap, Stage};
use crate::jet::Jet;
use crate::numeric::Real;

/// A local map with its coefficients as `S`, evaluated stage by stage.
///
/// In double-double the image is exact to the map's own coefficients: what remains is truncation and the
/// rounding of the coefficients to `f64`.
#[derive(Clone, Debug)]
pub struct MapEvaluation<S: Real> {
    stages: Vec<StageOf<S>>,
    dimension: usize,
}

#[derive(Clone, Debug)]
enum StageOf<S: Real> {
    Leg(Vec<Jet<S>>),
    Contact(Contact<S>),
}

/// `−h_min` of the first passage after a section point.
#[derive(Clone, Debug)]
pub struct DepthEvaluation<S: Real> {
    arrival: MapEvaluation<S>,
    depth: Option<Jet<S>>,
}

impl<S: Real> DepthEvaluation<S> {
    /// The depth at a section point, everything in offsets; minus infinity for a map without contacts.
    pub fn at(&self, offsets: &[S], parameters: &[S]) -> S {
        let mut point = self.arrival.image(offsets, parameters).offsets;
        point.extend_from_slice(parameters);
        let depth = self.depth.as_ref().map(|depth| depth.evaluate(&point));
        depth.unwrap_or(S::from_f64(f64::NEG_INFINITY))
    }
}

/// The image of one point under a local map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapImage<S> {
    /// Offsets of the image.
    pub offsets: Vec<S>,
    /// Passages that made contact.
    pub contacts: usize,
    /// Largest `−h_min` of the passages (negative without contact).
    pub depth: S,
}

impl<S: Real> MapEvaluation<S> {
    /// All stages of a map.
    pub fn new(map: &LocalMap) -> Self {
        Self::of(map, |_| true)
    }

    /// The legs alone: `P_smooth`.
    pub fn smooth(map: &LocalMap) -> Self {
        Self::of(map, |stage| matches!(stage, Stage::Leg(_)))
    }

    /// The contacts alone: `D`.
    pub fn discontinuity(map: &LocalMap) -> Self {
        Self::of(map, |stage| matches!(stage, Stage::Contact(_)))
    }

    /// One contact alone, its coefficients as they are.
    pub fn contact(contact: Contact<S>) -> Self {
        let dimension = contact.linear.len();
        Self {
            stages: vec![StageOf::Contact(contact)],
            dimension,
        }
    }

    /// One leg alone.
    pub fn leg(leg: &Leg) -> Self {
        Self {
            stages: vec![StageOf::Leg(convert(&leg.image))],
            dimension: leg.image.len(),
        }
    }

    /// The stages before the first contact, and its depth: `−h_min` as the section sees it.
    pub fn depth(map: &LocalMap) -> DepthEvaluation<S> {
        let is_contact = |stage: &Stage| matches!(stage, Stage::Contact(_));
        let count = map.stages.iter().position(is_contact).unwrap_or(0);
        DepthEvaluation {
            arrival: Self {
                stages: map.stages[..count].iter().map(stage_of).collect(),
                dimension: map.dimension(),
            },
            depth: map.stages.get(count).and_then(|stage| match stage {
                Stage::Contact(contact) => Some(contact.depth.map_scalars(S::from_f64)),
                Stage::Leg(_) => None,
            }),
        }
    }

    fn of(map: &LocalMap, keep: impl Fn(&Stage) -> bool) -> Self {
        let stages = map.stages.iter().filter(|stage| keep(stage));
        Self {
            stages: stages.map(stage_of).collect(),
            dimension: map.dimension(),
        }
    }

    /// The image of a point, everything in offsets.
    pub fn image(&self, offsets: &[S], parameters: &[S]) -> MapImage<S> {
        let mut point = [offsets, parameters].concat();
        let mut contacts = 0;
        let mut depth = S::from_f64(f64::NEG_INFINITY);
        for stage in &self.stages {
            let image = match stage {
                StageOf::Leg(jets) => jets.iter().map(|jet| jet.evaluate(&point)).collect(),
                StageOf::Contact(contact) => {
                    let here = contact.depth.evaluate(&point);
                    depth = depth.max(here);
                    contacts += usize::from(here > S::zero());
                    act(contact, &point, here, self.dimension)
                }
            };
            point[..self.dimension].copy_from_slice(&image);
        }
        point.truncate(self.dimension);
        MapImage {
            offsets: point,
            contacts,
            depth,
        }
    }
}

fn act<S: Real>(contact: &Contact<S>, point: &[S], depth: S, dimension: usize) -> Vec<S> {
    if depth <= S::zero() {
        return point[..dimension].to_vec();
    }
    let y = depth.sqrt();
    let parts = contact.linear.iter().zip(&contact.quadratic);
    parts
        .zip(point)
        .map(|((linear, quadratic), &start)| {
            let correction = linear.evaluate(point) + y * quadratic.evaluate(point);
            start + y * correction
        })
        .collect()
}

fn stage_of<S: Real>(stage: &Stage) -> StageOf<S> {
    match stage {
        Stage::Leg(leg) => StageOf::Leg(convert(&leg.image)),
        Stage::Contact(contact) => StageOf::Contact(Contact {
            depth: contact.depth.map_scalars(S::from_f64),
            linear: convert(&contact.linear),
            quadratic: convert(&contact.quadratic),
        }),
    }
}

fn convert<S: Real>(jets: &[Jet<f64>]) -> Vec<Jet<S>> {
    jets.iter()
        .map(|jet| jet.map_scalars(S::from_f64))
        .collect()
}
