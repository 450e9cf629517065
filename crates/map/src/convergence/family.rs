//! Maps of all orders from one expansion: lower orders are truncations, not new expansions.

use std::sync::{Arc, OnceLock};

use super::ConvergenceError;
use crate::expansion::{
    ComposedMap, Contact, DEVIATION_WEIGHT, Expander, ExpansionError, Leg, Legs, LocalMap,
    MapOrders, PowerCorrections, PowerTerm, Stage, Variables,
};
use crate::jet::{Jet, JetSpace};
use crate::model::Scene;
use crate::numeric::Real;
use crate::orbit::GrazingOrbit;

impl ConvergenceError {
    /// Whether an expansion overflowed; see [`ExpansionError::is_overflow`].
    pub fn is_overflow(&self) -> bool {
        matches!(self, Self::Expansion(error) if error.is_overflow())
    }
}

/// Orders of the first expansion: it shows how terms fall, and how deep passages are.
pub(super) const PROBE: MapOrders = MapOrders::new(4, 8);

/// A scene expanded once to the highest orders; every map of lower orders is a truncation.
///
/// A coefficient of a truncated series does not depend on the order of truncation, so a truncation
/// equals the expansion at the lower orders up to rounding.
#[derive(Clone, Debug)]
pub struct MapFamily<'a> {
    expander: Expander<'a>,
    legs: Legs,
    contacts: Vec<Contact>,
    /// Passages with flown contacts, by weight: a flight is planned for its weight, at its first
    /// use.
    flown: Vec<OnceLock<Result<Vec<Stage>, ExpansionError>>>,
    highest: MapOrders,
}

impl<'a> MapFamily<'a> {
    /// Expands a scene to the highest orders.
    ///
    /// # Errors
    ///
    /// As [`Expander::expand`].
    pub fn new(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        highest: MapOrders,
    ) -> Result<Self, ExpansionError> {
        Self::sharing(scene, orbit, highest, &[])
    }

    /// Expands as [`new`](Self::new), but reuses expansions of other families of the scene.
    pub(super) fn sharing(
        scene: &'a Scene,
        orbit: &'a GrazingOrbit,
        highest: MapOrders,
        others: &[&Self],
    ) -> Result<Self, ExpansionError> {
        let expander = Expander::new(scene, orbit)?;
        let (order, weight) = (highest.smooth_order, highest.contact_weight);
        let with_legs = others.iter().find(|other| other.highest.smooth_order >= order);
        let with_contacts = others.iter().find(|other| other.highest.contact_weight >= weight);
        Ok(Self {
            legs: match with_legs {
                Some(other) => cut_legs(&expander, &other.legs, order)?,
                None => expander.legs(order)?,
            },
            contacts: match with_contacts {
                Some(other) => cut_contacts(&expander, &other.contacts, weight)?,
                None => expander.contacts(weight)?,
            },
            flown: (0..=highest.contact_weight).map(|_| OnceLock::new()).collect(),
            expander,
            highest,
        })
    }

    /// The expander of the scene.
    pub fn expander(&self) -> &Expander<'a> {
        &self.expander
    }

    /// The orders of the expansion.
    pub fn highest(&self) -> MapOrders {
        self.highest
    }

    /// The map at lower orders.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if a space is too large.
    pub fn map(&self, orders: MapOrders) -> Result<LocalMap, ExpansionError> {
        let legs = cut_legs(&self.expander, &self.legs, orders.smooth_order)?;
        let contacts = cut_contacts(&self.expander, &self.contacts, orders.contact_weight)?;
        Ok(self.expander.assemble(orders, legs, contacts))
    }

    /// The map at lower orders, with its contacts flown.
    ///
    /// # Errors
    ///
    /// As [`Expander::flown`].
    pub fn flown_map(&self, orders: MapOrders) -> Result<LocalMap, ExpansionError> {
        let weight = orders.contact_weight.min(self.highest.contact_weight);
        let plan = || self.expander.flown_passages(weight);
        let passages = self.flown[weight as usize].get_or_init(plan).clone()?;
        let legs = cut_legs(&self.expander, &self.legs, orders.smooth_order)?;
        Ok(self.expander.assemble_stages(orders, legs, passages))
    }

    /// The map at lower orders, with weights of the active parameters that are at least the
    /// scene's. Heavier parameters are cut at lower powers.
    ///
    /// # Errors
    ///
    /// [`ExpansionError::Jet`] if a space is too large.
    ///
    /// # Panics
    ///
    /// If there is not one weight per active parameter.
    pub fn weighted_map(
        &self,
        orders: MapOrders,
        parameters: &[u32],
    ) -> Result<LocalMap, ExpansionError> {
        let weighted = |variables: &Variables| {
            let mut variables = variables.clone();
            variables.weights[variables.coordinates..].copy_from_slice(parameters);
            variables
        };
        let section = weighted(self.expander.variables());
        let passages =
            (0..self.expander.passages()).map(|passage| self.expander.variables_at(passage));
        let passages: Vec<_> = passages.map(weighted).collect();
        let order = orders.smooth_order;
        let before = self.legs.before.as_ref();
        let after = self.legs.after.iter().zip(&passages);
        let legs = Legs {
            before: before.map(|leg| cut_leg(leg, &section, order)).transpose()?,
            after: after
                .map(|(leg, variables)| cut_leg(leg, variables, order))
                .collect::<Result<_, _>>()?,
        };
        let contacts = self.contacts.iter().zip(&passages);
        let contacts = contacts
            .map(|(contact, variables)| cut_contact(variables, contact, orders.contact_weight));
        let contacts = contacts.collect::<Result<_, _>>()?;
        Ok(self.expander.assemble(orders, legs, contacts))
    }

    /// Composed form of a map.
    ///
    /// # Errors
    ///
    /// As [`Expander::compose`].
    pub fn compose(&self, map: &LocalMap) -> Result<ComposedMap, ExpansionError> {
        self.expander.compose(map)
    }
}

/// Cuts legs at a degree no higher than their own.
///
/// # Errors
///
/// [`ExpansionError::Jet`] if a space is too large.
pub fn cut_legs<S: Real>(
    expander: &Expander<'_>,
    legs: &Legs<S>,
    smooth_order: u32,
) -> Result<Legs<S>, ExpansionError> {
    let cut = |leg, variables| cut_leg(leg, variables, smooth_order);
    let before = legs.before.as_ref();
    let after = legs.after.iter().enumerate();
    Ok(Legs {
        before: before.map(|leg| cut(leg, expander.variables())).transpose()?,
        after: after
            .map(|(passage, leg)| cut(leg, expander.variables_at(passage)))
            .collect::<Result<_, _>>()?,
    })
}

fn cut_leg<S: Real>(
    leg: &Leg<S>,
    variables: &Variables,
    smooth_order: u32,
) -> Result<Leg<S>, ExpansionError> {
    let space = variables.smooth_space(DEVIATION_WEIGHT * smooth_order)?;
    Ok(Leg { image: cut_all(&leg.image, &space) })
}

/// Cuts all contacts at a weight.
pub(super) fn cut_contacts<S: Real>(
    expander: &Expander<'_>,
    contacts: &[Contact<S>],
    weight: u32,
) -> Result<Vec<Contact<S>>, ExpansionError> {
    let contacts = contacts.iter().enumerate();
    contacts
        .map(|(passage, contact)| cut_contact(expander.variables_at(passage), contact, weight))
        .collect()
}

/// Cuts a contact at a weight.
pub(super) fn cut_contact<S: Real>(
    variables: &Variables,
    contact: &Contact<S>,
    weight: u32,
) -> Result<Contact<S>, ExpansionError> {
    let depth_space = variables.smooth_space(weight + 1)?;
    let linear_space = variables.smooth_space(weight.saturating_sub(1))?;
    let quadratic_space = variables.smooth_space(weight.saturating_sub(2))?;
    let mut quadratic = cut_all(&contact.quadratic, &quadratic_space);
    if weight < 2 {
        quadratic = quadratic.iter().map(|jet| Jet::zero(jet.space())).collect();
    }
    let cut_at = |jets: &[Jet<S>], left: f64| -> Result<Vec<Jet<S>>, ExpansionError> {
        let space = variables.smooth_space(left.max(0.0) as u32)?;
        Ok(match left >= 0.0 {
            true => cut_all(jets, &space),
            false => jets.iter().map(|_| Jet::zero(&space)).collect(),
        })
    };
    let mut terms = Vec::new();
    for (exponent, term) in contact.powers.with_exponents() {
        let left = f64::from(weight) - exponent;
        if left >= 1.0 {
            terms.push(PowerTerm {
                powers: term.powers.clone(),
                linear: cut_at(&term.linear, left - 1.0)?,
                quadratic: cut_at(&term.quadratic, left - 2.0)?,
            });
        }
    }
    Ok(Contact {
        depth: cut(&contact.depth, &depth_space),
        linear: cut_all(&contact.linear, &linear_space),
        quadratic,
        powers: PowerCorrections { exponents: contact.powers.exponents.clone(), terms },
        // The composition cuts the depth form.
        depth_form: contact.depth_form.clone(),
    })
}

fn cut_all<S: Real>(jets: &[Jet<S>], space: &Arc<JetSpace>) -> Vec<Jet<S>> {
    jets.iter().map(|jet| cut(jet, space)).collect()
}

fn cut<S: Real>(jet: &Jet<S>, space: &Arc<JetSpace>) -> Jet<S> {
    let same: Vec<_> = (0..space.variables()).map(Some).collect();
    jet.reinterpret(space, &same)
}
