//! Evaluation of a local map over any number type, from its coefficients.

use std::ops::Range;

use crate::expansion::{
    Arithmetic, ComposedMap, Contact, DepthPolynomial, FlownContact, Legs, LocalMap, Numbers,
    PowerCorrections, Stage, omitted_exponent, power_of_depth,
};
use crate::jet::Jet;
use crate::numeric::{Real, Scalar};

/// A local map with its coefficients as `S`, evaluated stage by stage.
///
/// In double-double the errors left are truncation and the rounding of the map's coefficients to
/// `f64`.
#[derive(Clone, Debug)]
pub struct MapEvaluation<S: Real> {
    stages: Vec<StageOf<S>>,
    dimension: usize,
}

#[derive(Clone, Debug)]
enum StageOf<S: Real> {
    Leg(Vec<Jet<S>>),
    Contact(Contact<S>),
    Flown(Box<FlownContact<S>>),
    Composed(ComposedMap<S>),
}

/// Evaluates the depths `−h_min` of all passages after a section point.
#[derive(Clone, Debug)]
pub struct DepthEvaluation<S: Real> {
    until_last: MapEvaluation<S>,
    passages: usize,
}

impl<S: Real> DepthEvaluation<S> {
    /// Depths of a section point, in the order in which the passages are met; arguments are
    /// offsets.
    pub fn at(&self, offsets: &[S], parameters: &[S]) -> Vec<S> {
        // Nothing depends on the image of the last contact.
        let image = self.until_last.image_with(offsets, parameters, |arrival| {
            let before_last = arrival.passage + 1 < self.passages;
            (before_last && arrival.depth > S::zero()).then(|| arrival.depth.sqrt())
        });
        image.depths
    }
}

/// The image of one point under a local map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapImage<S> {
    /// Offsets of the image.
    pub offsets: Vec<S>,
    /// `−h_min` of every passage; negative without contact.
    pub depths: Vec<S>,
}

/// Point at which a passage is reached.
#[derive(Clone, Copy, Debug)]
pub struct Arrival<'a, S> {
    /// Number of the passage, in the order in which they follow the section.
    pub passage: usize,
    /// The point (coordinates; parameters) before the contact; for a composed map the section
    /// point.
    pub point: &'a [S],
    /// `−h_min`.
    pub depth: S,
}

impl<S: Real> MapImage<S> {
    /// Number of passages that made contact.
    pub fn contacts(&self) -> usize {
        let made = |depth: &&S| **depth > S::zero();
        self.depths.iter().filter(made).count()
    }
}

impl<S: Real> MapEvaluation<S> {
    /// All stages of a map.
    pub fn new(map: &LocalMap) -> Self {
        Self::of(map, &map.stages)
    }

    /// Consecutive stages of a map.
    pub fn stages(map: &LocalMap, numbers: Range<usize>) -> Self {
        Self::of(map, &map.stages[numbers])
    }

    /// The legs alone: `P_smooth`.
    pub fn smooth(map: &LocalMap) -> Self {
        let legs = map.stages.iter().filter(|stage| !stage.is_passage());
        Self::of(map, legs)
    }

    /// The contact of the first passage alone: its `D`.
    pub fn discontinuity(map: &LocalMap) -> Self {
        let first = map.stages.iter().find(|stage| stage.is_passage());
        Self::of(map, first)
    }

    /// One contact alone.
    pub fn contact(contact: Contact<S>) -> Self {
        let dimension = contact.linear.len();
        Self { stages: vec![StageOf::Contact(contact)], dimension }
    }

    /// A map in its composed form.
    pub fn composed(map: &ComposedMap) -> Self {
        let convert = |polynomials: &[DepthPolynomial]| {
            let polynomials = polynomials.iter();
            polynomials.map(|p| p.map_scalars(S::from_f64)).collect()
        };
        Self {
            stages: vec![StageOf::Composed(ComposedMap {
                depths: convert(&map.depths),
                image: convert(&map.image),
                powers: map.powers.clone(),
            })],
            dimension: map.image.len(),
        }
    }

    /// Legs with contacts between them.
    pub fn of_parts(legs: Legs<S>, contacts: Vec<Contact<S>>) -> Self {
        let dimension = contacts.first().map_or(0, |contact| contact.linear.len());
        let before = legs.before.map(|leg| StageOf::Leg(leg.image));
        let rest = contacts.into_iter().zip(legs.after);
        let rest =
            rest.flat_map(|(contact, leg)| [StageOf::Contact(contact), StageOf::Leg(leg.image)]);
        Self { stages: before.into_iter().chain(rest).collect(), dimension }
    }

    /// Legs alone.
    pub fn legs(legs: Legs<S>) -> Self {
        let stages = legs.before.into_iter().chain(legs.after);
        let stages: Vec<_> = stages.map(|leg| leg.image).collect();
        Self {
            dimension: stages.first().map_or(0, Vec::len),
            stages: stages.into_iter().map(StageOf::Leg).collect(),
        }
    }

    /// Depths of all passages as functions of the section point.
    ///
    /// If contacts are not [expanded](LocalMap::has_contacts), the depths of the free flight.
    pub fn depths(map: &LocalMap) -> DepthEvaluation<S> {
        let last = map.stages.iter().rposition(Stage::is_passage);
        let mut until_last = Self::of(map, &map.stages[..last.map_or(0, |last| last + 1)]);
        if !map.has_contacts() {
            until_last.ignore_contacts();
        }
        DepthEvaluation { until_last, passages: map.passages() }
    }

    /// Sets all corrections of contacts to zero.
    fn ignore_contacts(&mut self) {
        for stage in &mut self.stages {
            if let StageOf::Contact(contact) = stage {
                let corrections = contact.linear.iter_mut().chain(&mut contact.quadratic);
                corrections.for_each(|jet| *jet = Jet::zero(jet.space()));
                contact.powers = PowerCorrections::default();
            }
        }
    }

    /// The stages before the first contact.
    pub fn arrival(map: &LocalMap) -> Self {
        let first = map.stages.iter().position(Stage::is_passage);
        Self::of(map, &map.stages[..first.unwrap_or(0)])
    }

    fn of<'m>(map: &LocalMap, stages: impl IntoIterator<Item = &'m Stage>) -> Self {
        Self { stages: stages.into_iter().map(stage_of).collect(), dimension: map.dimension() }
    }

    /// Number of coefficients of all polynomials.
    pub(super) fn terms(&self) -> u64 {
        let of = |jets: &[Jet<S>]| jets.iter().map(|jet| jet.coefficients().len()).sum::<usize>();
        let terms = self.stages.iter().map(|stage| match stage {
            StageOf::Leg(jets) => of(jets),
            StageOf::Contact(contact) => {
                let powers = contact.powers.polynomials().map(|jet| jet.coefficients().len());
                let others = contact.depth.coefficients().len() + powers.sum::<usize>();
                of(&contact.linear) + of(&contact.quadratic) + others
            }
            StageOf::Flown(flown) => flown.terms(),
            StageOf::Composed(map) => {
                let polynomials = map.depths.iter().chain(&map.image);
                let terms = polynomials.flat_map(|polynomial| &polynomial.terms);
                terms.map(|term| term.coefficient.coefficients().len()).sum()
            }
        });
        terms.sum::<usize>() as u64
    }

    /// Lowest power of `y` beyond an order: the next whole one, or one of a contact with powers of
    /// the penetration.
    pub fn omitted_exponent(&self, order: u32) -> f64 {
        let of = |stage: &StageOf<S>| match stage {
            StageOf::Contact(contact) => omitted_exponent(&contact.powers.exponents, order),
            StageOf::Leg(_) | StageOf::Flown(_) => f64::from(order + 1),
            StageOf::Composed(map) => {
                let own: Vec<_> = map.powers.iter().map(|power| power.exponent).collect();
                omitted_exponent(&own, order)
            }
        };
        self.stages.iter().map(of).fold(f64::from(order + 1), f64::min)
    }

    /// Image of a point; arguments are offsets.
    pub fn image(&self, offsets: &[S], parameters: &[S]) -> MapImage<S> {
        self.image_with(offsets, parameters, |arrival| {
            let free = arrival.depth <= S::zero();
            (!free).then(|| arrival.depth.sqrt())
        })
    }

    /// Image of a point with depth variables given by `root` in place of the roots of the depths;
    /// `None` means no contact.
    ///
    /// A negative depth variable selects the other branch of the root. With depth variables given,
    /// the map is a polynomial (with flown contacts, or powers of `y` that are not whole, a
    /// function of `y ≥ 0`).
    pub fn image_with(
        &self,
        offsets: &[S],
        parameters: &[S],
        mut root: impl FnMut(Arrival<'_, S>) -> Option<S>,
    ) -> MapImage<S> {
        let mut arithmetic = Numbers::new();
        let mut depths = Vec::new();
        let point = [offsets, parameters].concat();
        let offsets = self.image_in(&mut arithmetic, point, |point, &depth| {
            let passage = depths.len();
            depths.push(depth);
            root(Arrival { passage, point, depth })
        });
        MapImage { offsets, depths }
    }

    /// Image of a point (coordinates; parameters) in any arithmetic. `root` gives the depth
    /// variable of every passage, in order, from the point at which it is reached and its depth.
    pub(super) fn image_in<A: Arithmetic<Scalar = S>>(
        &self,
        arithmetic: &mut A,
        mut point: Vec<A::Value>,
        mut root: impl FnMut(&[A::Value], &A::Value) -> Option<A::Value>,
    ) -> Vec<A::Value> {
        for stage in &self.stages {
            let image = match stage {
                StageOf::Leg(jets) => {
                    jets.iter().map(|jet| arithmetic.polynomial(jet, &point)).collect()
                }
                StageOf::Contact(contact) => {
                    let depth = arithmetic.polynomial(&contact.depth, &point);
                    match root(&point, &depth) {
                        Some(y) => act(arithmetic, contact, &point, &y),
                        None => point[..self.dimension].to_vec(),
                    }
                }
                StageOf::Flown(flown) => {
                    let depth = arithmetic.polynomial(&flown.depth, &point);
                    let y = root(&point, &depth);
                    let y = y.unwrap_or_else(|| arithmetic.constant(S::zero()));
                    flown.act_at(arithmetic, &y, &point)
                }
                StageOf::Composed(map) => {
                    let mut roots: Vec<A::Value> = Vec::new();
                    let mut y = arithmetic.constant(S::zero());
                    for (passage, exponent) in map.depth_variables() {
                        if let Some(exponent) = exponent {
                            roots.push(power_of_depth(arithmetic, &y, exponent));
                            continue;
                        }
                        let polynomial = &map.depths[passage];
                        let depth = depth_polynomial(arithmetic, polynomial, &roots, &point);
                        let found = root(&point, &depth);
                        y = found.unwrap_or_else(|| arithmetic.constant(S::zero()));
                        roots.push(y.clone());
                    }
                    let image = map.image.iter();
                    image.map(|p| depth_polynomial(arithmetic, p, &roots, &point)).collect()
                }
            };
            point.splice(..self.dimension, image);
        }
        point.truncate(self.dimension);
        point
    }
}

/// `start + y (linear + y quadratic)`, and the terms with powers of `y` that are not whole.
fn act<A: Arithmetic>(
    arithmetic: &mut A,
    contact: &Contact<A::Scalar>,
    point: &[A::Value],
    y: &A::Value,
) -> Vec<A::Value> {
    let parts = contact.linear.iter().zip(&contact.quadratic).zip(point);
    let moved = parts.map(|((linear, quadratic), start)| {
        let linear = arithmetic.polynomial(linear, point);
        let quadratic = arithmetic.polynomial(quadratic, point);
        let quadratic = arithmetic.multiply(y, &quadratic);
        let correction = arithmetic.add(&linear, &quadratic);
        let correction = arithmetic.multiply(y, &correction);
        arithmetic.add(start, &correction)
    });
    let mut image: Vec<_> = moved.collect();
    contact.powers.add_to(arithmetic, y, point, &mut image);
    image
}

/// Value of a polynomial in depth variables with coefficients that depend on a point (coordinates;
/// parameters).
fn depth_polynomial<A: Arithmetic>(
    arithmetic: &mut A,
    polynomial: &DepthPolynomial<A::Scalar>,
    depths: &[A::Value],
    point: &[A::Value],
) -> A::Value {
    let zero = arithmetic.constant(A::Scalar::from_f64(0.0));
    polynomial.terms.iter().fold(zero, |sum, term| {
        let mut product = arithmetic.polynomial(&term.coefficient, point);
        for (&power, y) in term.powers.iter().zip(depths) {
            for _ in 0..power {
                product = arithmetic.multiply(&product, y);
            }
        }
        arithmetic.add(&sum, &product)
    })
}

fn stage_of<S: Real>(stage: &Stage) -> StageOf<S> {
    match stage {
        Stage::Leg(leg) => StageOf::Leg(convert(&leg.image)),
        Stage::Flown(flown) => StageOf::Flown(Box::new(flown.map_scalars(S::from_f64))),
        Stage::Contact(contact) => StageOf::Contact(Contact {
            depth: contact.depth.map_scalars(S::from_f64),
            linear: convert(&contact.linear),
            quadratic: convert(&contact.quadratic),
            powers: contact.powers.map(|jet| jet.map_scalars(S::from_f64)),
            depth_form: None,
        }),
    }
}

fn convert<S: Real>(jets: &[Jet<f64>]) -> Vec<Jet<S>> {
    jets.iter().map(|jet| jet.map_scalars(S::from_f64)).collect()
}
