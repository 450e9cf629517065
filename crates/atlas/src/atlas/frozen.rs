//! Leaves at fixed parameters: polynomials of the coordinates alone.
//!
//! A polynomial of order `n` in `d` coordinates and `p` parameters has `(n+d+p choose n)`
//! coefficients. With the parameters fixed, `(n+d choose n)` are left.

use std::sync::Arc;

use super::patch::{Patch, Piece, SharedSpaces, Side};
use super::tree::{Answer, Atlas, Leaf, Node, Tabulated};
use crate::jet::{JetError, JetSpace};

/// Boxes of an atlas at fixed parameters: a tree of the coordinates alone, copied where points
/// come, with reduced leaves.
///
/// Images are those of the atlas, to rounding. A step in a box that is known takes no lock.
#[derive(Clone, Debug)]
pub struct FrozenLeaves {
    parameters: Vec<f64>,
    nodes: Vec<FrozenNode>,
    spaces: SharedSpaces,
    point: Vec<f64>,
    local: Vec<f64>,
    monomials: Vec<f64>,
}

/// Node at fixed parameters.
#[derive(Clone, Debug)]
enum FrozenNode {
    /// Node of the atlas that no point has come to.
    Unknown(usize),
    /// Halved box, as in the atlas.
    Halved { axis: usize, at: f64, first: usize },
    /// Leaf with reduced polynomials.
    Leaf(Box<Leaf>),
    /// Leaf whose points are simulated.
    Direct,
}

impl FrozenLeaves {
    /// Leaves at values of the parameters of a region, in the order of its axes.
    pub fn new(parameters: &[f64]) -> Self {
        Self {
            parameters: parameters.to_vec(),
            nodes: vec![FrozenNode::Unknown(0)],
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
        match self.tabulated(atlas, state, image) {
            Ok((side, _)) => Answer::Tabulated(side),
            Err(source) => {
                self.point.clear();
                self.point.extend(state.iter().chain(&self.parameters));
                atlas.direct(&self.point, image, source)
            }
        }
    }

    /// Image of a state by the polynomials of its leaf, with the label of the leaf.
    ///
    /// # Errors
    ///
    /// The source of an image where there are no polynomials; nothing is simulated.
    ///
    /// # Panics
    ///
    /// As [`image`](Self::image).
    pub fn tabulated<M: Tabulated>(
        &mut self,
        atlas: &mut Atlas<M>,
        state: &[f64],
        image: &mut [f64],
    ) -> Result<(Side, u64), Answer> {
        let axes = state.len() + self.parameters.len();
        assert_eq!(axes, atlas.ranges.len(), "one coordinate per axis");
        if !atlas.holds(state.iter().chain(&self.parameters)) {
            return Err(Answer::Outside);
        }
        let mut node = 0;
        loop {
            match &self.nodes[node] {
                FrozenNode::Halved { axis, at, first } => {
                    node = first + usize::from(state[*axis] >= *at);
                }
                FrozenNode::Direct => return Err(Answer::Direct),
                FrozenNode::Leaf(leaf) => {
                    leaf.local(state, &mut self.local);
                    let side = leaf.piece.evaluate(&mut self.local, &mut self.monomials, image);
                    return Ok((side, leaf.label));
                }
                &FrozenNode::Unknown(known) => self.learn(node, known, atlas, state)?,
            }
        }
    }

    /// Copies the node `known` of an atlas, which holds a state, to `node`, if need be halving and
    /// making leaves there.
    ///
    /// # Errors
    ///
    /// The source of the image of the state beyond the most boxes.
    fn learn<M: Tabulated>(
        &mut self,
        node: usize,
        known: usize,
        atlas: &mut Atlas<M>,
        state: &[f64],
    ) -> Result<(), Answer> {
        self.point.clear();
        self.point.extend(state.iter().chain(&self.parameters));
        let made = atlas.leaf_of(&self.point).map(drop);
        let tree = atlas.tree();
        self.nodes[node] = match &tree.nodes[known] {
            Node::Open(_) => {
                // NOTE: an atlas that makes no more leaves makes none here later.
                self.nodes[node] = FrozenNode::Direct;
                return made;
            }
            Node::Direct => FrozenNode::Direct,
            &Node::Halved { axis, at, first } => match axis.checked_sub(state.len()) {
                Some(fixed) => {
                    FrozenNode::Unknown(first + usize::from(self.parameters[fixed] >= at))
                }
                None => {
                    let own = self.nodes.len();
                    self.nodes.extend([first, first + 1].map(FrozenNode::Unknown));
                    FrozenNode::Halved { axis, at, first: own }
                }
            },
            Node::Leaf(leaf) => {
                leaf.local(&self.point, &mut self.local);
                let piece = frozen_piece(&leaf.piece, &self.local[state.len()..], &mut self.spaces);
                match piece {
                    Ok(piece) => FrozenNode::Leaf(Box::new(Leaf {
                        centre: leaf.centre[..state.len()].to_vec(),
                        inverse: leaf.inverse[..state.len()].to_vec(),
                        piece,
                        label: leaf.label,
                    })),
                    Err(_) => FrozenNode::Direct,
                }
            }
        };
        Ok(())
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
