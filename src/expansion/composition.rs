//! The composed form: the whole map as one polynomial pass in `(y; coordinates; parameters)`.

use std::sync::Arc;

use super::variables::{DEVIATION_WEIGHT, Variables, fold_depth_powers, lift};
use super::{ComposedMap, Contact, ExpansionError, Leg, LocalMap, Stage};
use crate::jet::{Jet, JetSpace, substitute_all};

/// Composes a local map of one grazing passage.
///
/// With `P = L₂ ∘ D ∘ L₁` the result is `P_smooth + y B̂ + y² Ĉ`, `P_smooth = L₂ ∘ L₁` to the legs'
/// degree, `B̂` and `Ĉ` to the larger of the contact's weight and the legs' degree (after a contact a
/// state deviation is `O(y)`, so degree `N` of a leg acts at weight `N`).
///
/// # Errors
///
/// [`ExpansionError::SeveralPassages`] unless the map has exactly one passage; [`ExpansionError::Jet`]
/// if the space would be too large.
pub fn compose(map: &LocalMap, variables: &Variables) -> Result<ComposedMap, ExpansionError> {
    let (before, contact, after) = split_at_contact(map)?;
    let smooth_space = variables.smooth_space(DEVIATION_WEIGHT * map.orders.smooth_order)?;
    let weight = map.orders.contact_weight.max(map.orders.smooth_order);
    let space = variables.contact_space(weight)?;
    let arrival = fly(&identity(variables, &smooth_space), &before, variables);
    let depth_at_start =
        substitute_all(std::slice::from_ref(&contact.depth), &arrival).swap_remove(0);
    let smooth = fly(&arrival, &after, variables);
    let departed = act(contact, &arrival, variables, &space);
    let image = fly(&departed, &after, variables);
    let linear_space = variables.smooth_space(weight.saturating_sub(1))?;
    let quadratic_space = variables.smooth_space(weight.saturating_sub(2))?;
    let fold = |first: u8, target| {
        image[..variables.coordinates]
            .iter()
            .map(|jet| fold_depth_powers(jet, first, weight, &depth_at_start, target))
            .collect()
    };
    Ok(ComposedMap {
        linear: fold(1, &linear_space),
        quadratic: fold(2, &quadratic_space),
        smooth: smooth[..variables.coordinates].to_vec(),
        depth: depth_at_start,
    })
}

/// The legs before the contact, the contact, and the legs after it.
fn split_at_contact(map: &LocalMap) -> Result<(Vec<&Leg>, &Contact, Vec<&Leg>), ExpansionError> {
    let (mut before, mut contact, mut after) = (Vec::new(), None, Vec::new());
    for stage in &map.stages {
        match stage {
            Stage::Leg(leg) if contact.is_none() => before.push(leg),
            Stage::Leg(leg) => after.push(leg),
            Stage::Contact(passage) => contact = Some(passage),
        }
    }
    match contact {
        Some(contact) if map.passages() == 1 => Ok((before, contact, after)),
        _ => Err(ExpansionError::SeveralPassages {
            operation: "the composed form",
            passages: map.passages(),
        }),
    }
}

/// Every variable as itself.
fn identity(variables: &Variables, space: &Arc<JetSpace>) -> Vec<Jet<f64>> {
    (0..variables.len())
        .map(|variable| Jet::variable(space, variable, 0.0))
        .collect()
}

/// The (coordinates; parameters) after the legs; parameters are carried along unchanged.
fn fly(start: &[Jet<f64>], legs: &[&Leg], variables: &Variables) -> Vec<Jet<f64>> {
    legs.iter().fold(start.to_vec(), |state, leg| {
        let mut image = substitute_all(&leg.image, &state);
        image.extend_from_slice(&state[variables.coordinates..]);
        image
    })
}

/// The contact on an arrival state, in the space with `y` (its depth is that of the arrival).
fn act(
    contact: &Contact,
    arrival: &[Jet<f64>],
    variables: &Variables,
    space: &Arc<JetSpace>,
) -> Vec<Jet<f64>> {
    let y = Jet::variable(space, 0, 0.0);
    let raised: Vec<_> = arrival.iter().map(|jet| lift(jet, space)).collect();
    let linear = substitute_all(&contact.linear, &raised);
    let quadratic = substitute_all(&contact.quadratic, &raised);
    let mut image = raised.clone();
    for coordinate in 0..variables.coordinates {
        let correction = &linear[coordinate] + &(&y * &quadratic[coordinate]);
        image[coordinate] += &(&y * &correction);
    }
    image
}
