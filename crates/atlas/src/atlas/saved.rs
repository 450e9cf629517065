//! Atlases as data: the tree of boxes with its polynomials, without the map.
//!
//! Boxes are not stored: they follow from the region and the halvings.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::cell::Cell;
use super::patch::{Patch, Piece};
use super::tree::{Atlas, AtlasOptions, Leaf, Node, OptionsError, Tabulated, Tree};
use crate::jet::JetSpace;

/// Tree of an atlas, to be written to a file and read back bit by bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedAtlas {
    ranges: Vec<[f64; 2]>,
    options: AtlasOptions,
    expanded: usize,
    /// Weights and order of the spaces of all polynomials.
    spaces: Vec<(Vec<u32>, usize)>,
    /// Nodes; the two halves of a box stand side by side, behind it.
    nodes: Vec<SavedNode>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum SavedNode {
    Open,
    Halved { axis: usize, first: usize },
    Smooth(SavedPatch),
    Grazed { depth: SavedPatch, missing: SavedPatch, touching: SavedPatch },
    Direct,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SavedPatch {
    /// Index of the space.
    space: usize,
    coefficients: Vec<f64>,
}

/// A saved atlas that a map cannot use.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RestoreError {
    /// The region of the saved atlas is not that of the map.
    #[error("the saved atlas holds the region {found:?}, and the map has {expected:?}")]
    Region {
        /// Ranges of the map.
        expected: Vec<[f64; 2]>,
        /// Ranges of the saved atlas.
        found: Vec<[f64; 2]>,
    },
    /// The saved settings cannot be used.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The tree is not one that an atlas writes.
    #[error("node {node} of the saved atlas is damaged")]
    Damaged {
        /// Index of the node.
        node: usize,
    },
}

impl SavedAtlas {
    /// Settings of the atlas.
    pub fn options(&self) -> &AtlasOptions {
        &self.options
    }

    /// Ranges of the region, axis by axis.
    pub fn ranges(&self) -> &[[f64; 2]] {
        &self.ranges
    }

    fn space(&mut self, space: &JetSpace) -> usize {
        let known = |(weights, order): &(Vec<u32>, usize)| {
            weights == space.weights() && *order == space.order()
        };
        self.spaces.iter().position(known).unwrap_or_else(|| {
            self.spaces.push((space.weights().to_vec(), space.order()));
            self.spaces.len() - 1
        })
    }

    fn patch(&mut self, patch: &Patch) -> SavedPatch {
        SavedPatch { space: self.space(patch.space()), coefficients: patch.coefficients().to_vec() }
    }
}

impl<M: Tabulated> Atlas<M> {
    /// Tree with its polynomials, as data.
    pub fn saved(&self) -> SavedAtlas {
        let tree = self.tree();
        let mut saved = SavedAtlas {
            ranges: self.ranges.clone(),
            options: self.options.clone(),
            expanded: tree.expanded,
            spaces: Vec::new(),
            nodes: Vec::with_capacity(tree.nodes.len()),
        };
        for node in &tree.nodes {
            let node = match node {
                Node::Open(_) => SavedNode::Open,
                Node::Direct => SavedNode::Direct,
                &Node::Halved { axis, first, .. } => SavedNode::Halved { axis, first },
                Node::Leaf(leaf) => match &leaf.piece {
                    Piece::Smooth(patch) => SavedNode::Smooth(saved.patch(patch)),
                    Piece::Grazed { depth, missing, touching } => SavedNode::Grazed {
                        depth: saved.patch(depth),
                        missing: saved.patch(missing),
                        touching: saved.patch(touching),
                    },
                },
            };
            saved.nodes.push(node);
        }
        saved
    }

    /// Atlas of a map that goes on with a saved tree; `boxes` is the most boxes that it expands
    /// from here on.
    ///
    /// # Errors
    ///
    /// [`RestoreError`].
    pub fn restore(map: M, saved: &SavedAtlas, boxes: usize) -> Result<Self, RestoreError> {
        let boxes = saved.expanded.saturating_add(boxes);
        let atlas = Self::new(map, AtlasOptions { boxes, ..saved.options.clone() })?;
        if atlas.ranges != saved.ranges {
            let (expected, found) = (atlas.ranges, saved.ranges.clone());
            return Err(RestoreError::Region { expected, found });
        }
        let nodes = saved.nodes_of(atlas.scales.len());
        let nodes = nodes.map_err(|node| RestoreError::Damaged { node })?;
        *atlas.tree() = Tree { nodes, expanded: saved.expanded };
        Ok(atlas)
    }
}

impl SavedAtlas {
    /// Nodes of a map with this many components; fails with the index of a damaged node.
    fn nodes_of(&self, components: usize) -> Result<Vec<Node>, usize> {
        let axes = self.ranges.len();
        let is_usable = |(weights, order): &&(Vec<u32>, usize)| {
            (axes..=axes + 1).contains(&weights.len()) && *order <= 4 * self.options.order
        };
        let spaces = self.spaces.iter().filter(is_usable);
        let spaces = spaces.map(|(weights, order)| JetSpace::new(weights, *order));
        let spaces: Vec<_> = spaces.collect::<Result<_, _>>().map_err(|_| 0_usize)?;
        if spaces.len() != self.spaces.len() {
            return Err(0);
        }
        let patch = |saved: &SavedPatch, variables: usize, components: usize| {
            let space = spaces.get(saved.space)?;
            let fits = space.variables() == variables
                && saved.coefficients.len() == space.len() * components;
            fits.then(|| Patch::of(Arc::clone(space), components, saved.coefficients.clone()))
        };
        let mut cells: Vec<Option<Cell>> = vec![None; self.nodes.len()];
        *cells.first_mut().ok_or(0_usize)? = Some(Cell::whole(&self.ranges));
        let mut nodes = Vec::with_capacity(self.nodes.len());
        for (place, node) in self.nodes.iter().enumerate() {
            let cell = cells[place].take().ok_or(place)?;
            let leaf = |piece: Option<Piece>| {
                let leaf = Leaf::new(&cell, piece.ok_or(place)?, 0);
                Ok::<_, usize>(Node::Leaf(Arc::new(leaf)))
            };
            let node = match node {
                SavedNode::Open => Node::Open(Box::new(cell)),
                SavedNode::Direct => Node::Direct,
                &SavedNode::Halved { axis, first } => {
                    let behind = place < first && first + 1 < cells.len() && axis < axes;
                    if !behind || cells[first..first + 2].iter().any(Option::is_some) {
                        return Err(place);
                    }
                    for (at, half) in cells[first..].iter_mut().zip(cell.halves(axis)) {
                        *at = Some(half);
                    }
                    Node::Halved { axis, at: cell.centre[axis], first }
                }
                SavedNode::Smooth(saved) => {
                    leaf(patch(saved, axes, components).map(Piece::Smooth))?
                }
                SavedNode::Grazed { depth, missing, touching } => {
                    let depth = patch(depth, axes, 1);
                    let missing = patch(missing, axes, components);
                    let touching = patch(touching, axes + 1, components);
                    let all = depth.zip(missing).zip(touching);
                    leaf(all.map(|((depth, missing), touching)| Piece::Grazed {
                        depth,
                        missing,
                        touching,
                    }))?
                }
            };
            nodes.push(node);
        }
        Ok(nodes)
    }
}
