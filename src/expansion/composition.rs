//! The composed form: the whole map as one polynomial pass in `(y_1 … y_K; coordinates; parameters)`.

use super::depth_polynomial::DepthSpace;
use super::variables::{DEVIATION_WEIGHT, Variables};
use super::{ComposedMap, Contact, ExpansionError, Leg, LocalMap, Stage};
use crate::jet::{Jet, substitute_all};

/// Composes a local map.
///
/// With one passage and `P = L₂ ∘ D ∘ L₁` the result is `P_smooth + y B̂ + y² Ĉ`, `P_smooth = L₂ ∘ L₁`. In general
/// what has no depth variable is kept to the legs' degree, what has any to the larger of the contacts' weight and
/// the legs' degree (after a contact a state deviation is `O(y)`, so degree `N` of a leg acts at weight `N`).
///
/// # Errors
///
/// [`ExpansionError::Jet`] if the space would be too large, [`ExpansionError::FlownIsNoPolynomial`] for a map with a
/// flown contact.
pub fn compose(map: &LocalMap, variables: &Variables) -> Result<ComposedMap, ExpansionError> {
    let weight = map.orders.contact_weight.max(map.orders.smooth_order);
    let spaces = DepthSpace::new(map.passages(), variables, weight)?;
    let smooth_space = variables.smooth_space(DEVIATION_WEIGHT * map.orders.smooth_order)?;
    let start = (0..variables.len())
        .map(|variable| Jet::variable(&smooth_space, variable, 0.0))
        .collect();
    let smooth = Composition::of(map, start, |state, _, _| state)?;
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
    /// From (coordinates; parameters) as jets; `act` is what a contact, with its number, does to a state.
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
