//! The composed form: the whole map as one polynomial pass in `(y_1 … y_K; coordinates;
//! parameters)`.

use super::depth_chart::DepthChart;
use super::depth_polynomial::DepthSpace;
use super::variables::{DEVIATION_WEIGHT, Variables, coefficient_of_depth_power, respace};
use super::{
    ComposedMap, Contact, DepthPolynomial, ExpansionError, Leg, LocalMap, MapOrders, Stage,
};
use crate::jet::{Jet, substitute_all};

/// Composes a local map.
///
/// With one passage and `P = L₂ ∘ D ∘ L₁` the result is `P_smooth + y B̂ + y² Ĉ`, `P_smooth = L₂ ∘
/// L₁`; where the contact is what a return begins with, `P = L ∘ D`, it is `P_smooth + Σ_k y^k
/// P_k`, the `P_k` free of the coordinate along which the depth is steepest. In general what has no
/// depth variable is kept to the legs' degree, what has any to the larger of the contacts' weight
/// and the legs' degree (after a contact a state deviation is `O(y)`, so degree `N` of a leg acts
/// at weight `N`).
///
/// # Errors
///
/// [`ExpansionError::Jet`] if the space would be too large, [`ExpansionError::FlownIsNoPolynomial`]
/// for a map with a flown contact.
pub fn compose(map: &LocalMap, variables: &Variables) -> Result<ComposedMap, ExpansionError> {
    let weight = map.orders.contact_weight.max(map.orders.smooth_order);
    let smooth_space = variables.smooth_space(DEVIATION_WEIGHT * map.orders.smooth_order)?;
    let start = (0..variables.len())
        .map(|variable| Jet::variable(&smooth_space, variable, 0.0))
        .collect();
    let smooth = Composition::of(map, start, |state, _, _| state)?;
    if let Some((Stage::Contact(contact), rest)) = map.stages.split_first()
        && let Some(legs) = only_legs(rest)
    {
        return after_contact(contact, &legs, variables, (weight, map.orders), smooth);
    }
    of_any(map, variables, weight, smooth)
}

/// The stages as legs; `None` where there is a contact among them.
fn only_legs(stages: &[Stage]) -> Option<Vec<&Leg>> {
    let legs = stages.iter().map(|stage| match stage {
        Stage::Leg(leg) => Some(leg),
        Stage::Contact(_) | Stage::Flown(_) => None,
    });
    legs.collect()
}

/// Of a map that begins with its one contact: in `(y; c', p)`, the depth variable in the place of a
/// coordinate, the contact is one substitution for that coordinate, and what it corrects is left in
/// these variables.
///
/// NOTE: written in all coordinates instead, by `y² = −h_min`, the correction would be a sum of
/// large terms that cancel where coordinates and parameters are larger than what they leave of the
/// depth: `(Q − q)^k` for `y^{2k}`.
fn after_contact(
    contact: &Contact,
    legs: &[&Leg],
    variables: &Variables,
    (weight, orders): (u32, MapOrders),
    smooth: Composition,
) -> Result<ComposedMap, ExpansionError> {
    let chart = DepthChart::new(&contact.depth, variables, weight)?;
    let before = chart.variables();
    let mut after = before.clone();
    let corrections = corrections(contact, &chart, orders.contact_weight);
    after
        .iter_mut()
        .zip(&corrections)
        .for_each(|(value, correction)| *value += correction);
    let fly_all = |state: Vec<Jet<f64>>| legs.iter().fold(state, |state, leg| fly(leg, &state));
    let pairs = fly_all(after).into_iter().zip(fly_all(before));
    let image = smooth.image.into_iter().zip(pairs);
    let spaces = (1..=weight).map(|power| variables.smooth_space(weight - power));
    let spaces: Vec<_> = spaces.collect::<Result<_, _>>()?;
    let image = image.map(|(smooth, (with, without))| {
        let correction = &with - &without;
        let corrections = (1u8..).zip(&spaces).map(|(power, space)| {
            let coefficient = coefficient_of_depth_power(&correction, power, space);
            (vec![power], coefficient)
        });
        DepthPolynomial::of(std::iter::once((vec![0], smooth)).chain(corrections))
    });
    let depths = smooth.depths.into_iter();
    Ok(ComposedMap {
        image: image.collect(),
        depths: depths
            .map(|depth| DepthPolynomial::of([(vec![0], depth)]))
            .collect(),
    })
}

/// What a contact adds to each coordinate, in the variables of a chart and up to a weight: as it
/// was found, or from the canonical form.
fn corrections(contact: &Contact, chart: &DepthChart<f64>, weight: u32) -> Vec<Jet<f64>> {
    let found = contact.depth_form.as_ref();
    if let Some(form) = found.filter(|form| form.replaced == chart.replaced) {
        let cut = |jet: &Jet<f64>| respace(jet, &chart.space).truncate(weight as usize);
        return form.corrections.iter().map(cut).collect();
    }
    let y = Jet::variable(&chart.space, 0, 0.0);
    let (linear, quadratic) = (
        chart.raise(&contact.linear),
        chart.raise(&contact.quadratic),
    );
    let parts = linear.iter().zip(&quadratic);
    parts
        .map(|(linear, quadratic)| &y * &(linear + &(&y * quadratic)))
        .collect()
}

/// Of any map: in `(y_1 … y_K; coordinates; parameters)`, the depth variables beside the others.
fn of_any(
    map: &LocalMap,
    variables: &Variables,
    weight: u32,
    smooth: Composition,
) -> Result<ComposedMap, ExpansionError> {
    let spaces = DepthSpace::new(map.passages(), variables, weight)?;
    let whole = Composition::of(map, spaces.identity(), |state, contact, passage| {
        act(contact, state, &spaces.depth_variable(passage))
    })?;
    let mut reduced = Vec::new();
    for depth in &whole.depths {
        reduced.push(spaces.reduced(depth, &reduced));
    }
    let image = whole.image.iter().map(|jet| spaces.reduced(jet, &reduced));
    let polynomials = |smooth: Vec<Jet<f64>>, jets: Vec<Jet<f64>>| {
        let pairs = smooth.into_iter().zip(&jets);
        pairs
            .map(|(smooth, jet)| spaces.polynomial(smooth, jet))
            .collect::<Result<_, _>>()
    };
    Ok(ComposedMap {
        image: polynomials(smooth.image, image.collect())?,
        depths: polynomials(smooth.depths, reduced)?,
    })
}

/// All stages of a map, one substituted into the next.
struct Composition {
    /// `−h_min` of each passage.
    depths: Vec<Jet<f64>>,
    /// The image of each coordinate.
    image: Vec<Jet<f64>>,
}

impl Composition {
    /// From (coordinates; parameters) as jets; `act` is what a contact, with its number, does to a
    /// state.
    fn of(
        map: &LocalMap,
        start: Vec<Jet<f64>>,
        act: impl Fn(Vec<Jet<f64>>, &Contact, usize) -> Vec<Jet<f64>>,
    ) -> Result<Self, ExpansionError> {
        let (mut state, mut depths) = (start, Vec::new());
        for stage in &map.stages {
            state = match stage {
                Stage::Leg(leg) => fly(leg, &state),
                Stage::Flown(_) => return Err(ExpansionError::FlownIsNoPolynomial),
                Stage::Contact(contact) => {
                    let depth = substitute_all(std::slice::from_ref(&contact.depth), &state);
                    depths.extend(depth);
                    act(state, contact, depths.len() - 1)
                }
            };
        }
        state.truncate(map.dimension());
        Ok(Self {
            depths,
            image: state,
        })
    }
}

/// The (coordinates; parameters) after a leg; parameters are carried along unchanged.
fn fly(leg: &Leg, state: &[Jet<f64>]) -> Vec<Jet<f64>> {
    let mut image = substitute_all(&leg.image, state);
    image.extend_from_slice(&state[leg.image.len()..]);
    image
}

/// `x ↦ x + y (linear + y quadratic)`.
fn act(contact: &Contact, mut state: Vec<Jet<f64>>, y: &Jet<f64>) -> Vec<Jet<f64>> {
    let linear = substitute_all(&contact.linear, &state);
    let quadratic = substitute_all(&contact.quadratic, &state);
    for (value, (linear, quadratic)) in state.iter_mut().zip(linear.iter().zip(&quadratic)) {
        *value += &(y * &(linear + &(y * quadratic)));
    }
    state
}
