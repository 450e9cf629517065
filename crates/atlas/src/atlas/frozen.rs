//! Leaves at fixed parameters: polynomials of the coordinates alone.
//!
//! A polynomial of order `n` in `d` coordinates and `p` parameters has `(n+d+p choose n)`
//! coefficients. With the parameters fixed, `(n+d choose n)` are left.

use std::sync::Arc;

use super::patch::{Patch, Piece, SharedSpaces};
use super::tree::{Answer, Atlas, Node, Tabulated};
use crate::jet::{JetError, JetSpace};

/// Leaves of an atlas at fixed parameters, each reduced when a point first comes to it.
///
/// Images are those of the atlas, to rounding.
#[derive(Clone, Debug)]
pub struct FrozenLeaves {
    parameters: Vec<f64>,
    /// Reduced pieces by node.
    pieces: Vec<Option<Box<Piece>>>,
    spaces: SharedSpaces,
    point: Vec<f64>,
    local: Vec<f64>,
    monomials: Vec<f64>,
}

impl FrozenLeaves {
    /// Leaves at values of the parameters of a region, in the order of its axes.
    pub fn new(parameters: &[f64]) -> Self {
        Self {
            parameters: parameters.to_vec(),
            pieces: Vec::new(),
            spaces: SharedSpaces::default(),
            point: Vec::new(),
            local: Vec::new(),
            monomials: Vec::new(),
        }
    }

    /// Image of a state; as [`Atlas::image`] of the state and the parameters.
    ///
    /// # Panics
    ///
    /// If state and parameters are not one value per axis, or the image not one per component.
    pub fn image<M: Tabulated>(
        &mut self,
        atlas: &mut Atlas<M>,
        state: &[f64],
        image: &mut [f64],
    ) -> Answer {
        self.point.clear();
        self.point.extend(state.iter().chain(&self.parameters));
        assert_eq!(self.point.len(), atlas.ranges.len(), "one coordinate per axis");
        let node = match atlas.leaf_of(&self.point) {
            Ok(node) => node,
            Err(source) => return atlas.direct(&self.point, image, source),
        };
        let Node::Leaf(leaf) = &atlas.nodes[node] else {
            return atlas.direct(&self.point, image, Answer::Direct);
        };
        leaf.local(&self.point, &mut self.local);
        if self.pieces.len() <= node {
            self.pieces.resize(node + 1, None);
        }
        if self.pieces[node].is_none() {
            let Ok(piece) = frozen_piece(&leaf.piece, &self.local[state.len()..], &mut self.spaces)
            else {
                return atlas.direct(&self.point, image, Answer::Direct);
            };
            self.pieces[node] = Some(Box::new(piece));
        }
        self.local.truncate(state.len());
        let piece = self.pieces[node].as_deref().unwrap_or(&leaf.piece);
        Answer::Tabulated(piece.evaluate(&mut self.local, &mut self.monomials, image))
    }
}

/// Piece with its last axes fixed at local coordinates.
fn frozen_piece(
    piece: &Piece,
    fixed: &[f64],
    spaces: &mut SharedSpaces,
) -> Result<Piece, JetError> {
    let mut freeze = |patch: &Patch, axes: usize| {
        let states = axes - fixed.len();
        let weights: Vec<u32> = kept(patch.space().weights(), states, axes).collect();
        let space = spaces.of(&weights, patch.space().order())?;
        Ok(patch.frozen(&space, states, fixed))
    };
    Ok(match piece {
        Piece::Smooth(patch) => {
            let axes = patch.space().variables();
            Piece::Smooth(freeze(patch, axes)?)
        }
        Piece::Grazed { depth, missing, touching } => {
            let axes = depth.space().variables();
            Piece::Grazed {
                depth: freeze(depth, axes)?,
                missing: freeze(missing, axes)?,
                touching: freeze(touching, axes)?,
            }
        }
    })
}

/// Entries of all variables but the axes from `states` on.
fn kept<T: Copy>(entries: &[T], states: usize, axes: usize) -> impl Iterator<Item = T> {
    entries[..states].iter().chain(&entries[axes..]).copied()
}

impl Patch {
    /// Patch in `space`, whose variables are the first `states` and those behind the fixed ones.
    fn frozen(&self, space: &Arc<JetSpace>, states: usize, fixed: &[f64]) -> Self {
        let (components, axes) = (self.components(), states + fixed.len());
        let mut coefficients = vec![0.0; space.len() * components];
        for (monomial, row) in self.coefficients().chunks_exact(components).enumerate() {
            let exponents = self.space().exponents(monomial);
            let powers = fixed.iter().zip(&exponents[states..axes]);
            let factor: f64 = powers.map(|(value, &power)| value.powi(i32::from(power))).product();
            let left: Vec<u8> = kept(exponents, states, axes).collect();
            let place = space.monomial(&left).expect("a lower degree is in the space");
            for (sum, value) in coefficients[place * components..].iter_mut().zip(row) {
                *sum += factor * value;
            }
        }
        Self::of(Arc::clone(space), components, coefficients)
    }
}
