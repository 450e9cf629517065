//! A local map evaluated over any number: what its coefficients say, without the rounding of a step.

use crate::expansion::{ComposedMap, Contact, Legs, LocalMap, Stage};
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
    /// The smooth part, and what it is corrected by.
    Composed(Vec<Jet<S>>, Contact<S>),
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

    /// A map in its composed form.
    pub fn composed(map: &ComposedMap) -> Self {
        let contact = Contact {
            depth: map.depth.map_scalars(S::from_f64),
            linear: convert(&map.linear),
            quadratic: convert(&map.quadratic),
        };
        Self {
            stages: vec![StageOf::Composed(convert(&map.smooth), contact)],
            dimension: map.smooth.len(),
        }
    }

    /// A contact between legs.
    pub fn of_parts(legs: Legs<S>, contact: Contact<S>) -> Self {
        let dimension = legs.after.image.len();
        let before = legs.before.map(|leg| StageOf::Leg(leg.image));
        let rest = [StageOf::Contact(contact), StageOf::Leg(legs.after.image)];
        Self {
            stages: before.into_iter().chain(rest).collect(),
            dimension,
        }
    }

    /// Legs alone.
    pub fn legs(legs: Legs<S>) -> Self {
        let dimension = legs.after.image.len();
        let stages = legs.before.into_iter().chain([legs.after]);
        Self {
            stages: stages.map(|leg| StageOf::Leg(leg.image)).collect(),
            dimension,
        }
    }

    /// The stages before the first contact, and its depth: `−h_min` as the section sees it.
    pub fn depth(map: &LocalMap) -> DepthEvaluation<S> {
        let contact = map.stages.iter().find_map(|stage| match stage {
            Stage::Contact(contact) => Some(contact.depth.map_scalars(S::from_f64)),
            Stage::Leg(_) => None,
        });
        DepthEvaluation {
            arrival: Self::arrival(map),
            depth: contact,
        }
    }

    /// The stages before the first contact.
    pub fn arrival(map: &LocalMap) -> Self {
        let is_contact = |stage: &Stage| matches!(stage, Stage::Contact(_));
        let count = map.stages.iter().position(is_contact).unwrap_or(0);
        Self {
            stages: map.stages[..count].iter().map(stage_of).collect(),
            dimension: map.dimension(),
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
                StageOf::Leg(jets) => evaluate(jets, &point),
                StageOf::Contact(contact) => {
                    let here = contact.depth.evaluate(&point);
                    depth = depth.max(here);
                    contacts += usize::from(here > S::zero());
                    act(contact, &point, here, &point[..self.dimension])
                }
                StageOf::Composed(smooth, contact) => {
                    let here = contact.depth.evaluate(&point);
                    depth = depth.max(here);
                    contacts += usize::from(here > S::zero());
                    act(contact, &point, here, &evaluate(smooth, &point))
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

fn evaluate<S: Real>(jets: &[Jet<S>], point: &[S]) -> Vec<S> {
    jets.iter().map(|jet| jet.evaluate(point)).collect()
}

/// `start + y linear + y² quadratic`.
fn act<S: Real>(contact: &Contact<S>, point: &[S], depth: S, start: &[S]) -> Vec<S> {
    if depth <= S::zero() {
        return start.to_vec();
    }
    let y = depth.sqrt();
    let parts = contact.linear.iter().zip(&contact.quadratic);
    parts
        .zip(start)
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
