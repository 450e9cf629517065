//! Conditions of a grazing bifurcation: how a stretch at one graze moves the orbit off the surface
//! at another.

use nalgebra::{DMatrix, DVector};

use crate::flow::{Field, flow_with_jacobian};
use crate::numeric::Real;

use super::OrbitError;
use super::kick::Kick;
use super::monodromy::dot;
use super::passages::Touch;
use super::system::ExtendedSystem;

/// `xi_1, xi_2, …` from one grazing passage to another.
///
/// `xi_n = ∇h_to · M_n · β_from`, with `M_n` the derivative of the free flow from the graze `from`
/// to the `n`-th graze `to` that follows it, and `β_from` the direction in which `D` stretches
/// there. From a graze to itself that is after `n` periods, to another after `n − 1` periods and
/// the way between. Positive: the gap opens; negative: the surface is met again; zero: a point of
/// codimension two.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GrazingConditions<S> {
    /// The passage that stretches (index into the orbit's passages).
    pub from: usize,
    /// The passage at which the gap is looked at.
    pub to: usize,
    /// `xi_1, xi_2, …`; empty where the contact at `from` is not felt.
    pub values: Vec<S>,
}

/// Derivatives of the free flow from every passage to the next, the last one's to the first of the
/// next period.
pub(super) fn legs<S: Real>(
    field: &Field,
    touches: &[Touch<S>],
    parameters: &[S],
    period: S,
) -> Result<Vec<DMatrix<S>>, OrbitError> {
    let arrivals = touches.iter().skip(1).map(|touch| touch.time);
    let arrivals = arrivals.chain([period]);
    let leg = |(touch, arrival): (&Touch<S>, S)| {
        let inputs: Vec<usize> = (0..touch.state.len()).collect();
        let duration = arrival - touch.time;
        let (_, jacobian) = flow_with_jacobian(field, &touch.state, parameters, duration, &inputs)?;
        Ok(jacobian)
    };
    touches.iter().zip(arrivals).map(leg).collect()
}

/// The derivative of a period's flow at the first passage.
pub(super) fn round<S: Real>(legs: &[DMatrix<S>]) -> DMatrix<S> {
    let whole = legs.iter().skip(1);
    whole.fold(legs[0].clone(), |so_far, leg| leg * so_far)
}

/// The conditions between all passages, `count` each.
pub(super) fn conditions<S: Real>(
    system: &ExtendedSystem,
    kicks: &[Kick],
    touches: &[Touch<S>],
    legs: &[DMatrix<S>],
    parameters: &[S],
    count: usize,
) -> Result<Vec<GrazingConditions<S>>, OrbitError> {
    let dimension = system.dimension();
    let local = |passage: usize| {
        let geometry = system.geometry(passage);
        geometry.at(&touches[passage].state, parameters)
    };
    let passages = touches.len();
    let slopes: Vec<Vec<S>> = (0..passages)
        .map(|passage| local(passage).event_gradient()[..dimension].to_vec())
        .collect();
    let mut found = Vec::new();
    for (from, kick) in kicks.iter().enumerate() {
        let mut values = vec![Vec::new(); passages];
        let state = &touches[from].state;
        if let Some(direction) = kick.direction(&local(from), state, parameters)? {
            let mut stretch = DVector::from_vec(direction);
            for leg in (from..).take(count * passages) {
                stretch = &legs[leg % passages] * stretch;
                let to = (leg + 1) % passages;
                values[to].push(dot(&slopes[to], stretch.as_slice()));
            }
        }
        let from_here = values.into_iter().enumerate();
        found.extend(from_here.map(|(to, values)| GrazingConditions { from, to, values }));
    }
    Ok(found)
}
