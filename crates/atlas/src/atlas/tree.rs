//! The tree of boxes: made where points come, with splits that depend on the box alone.
//!
//! A box gets a piece if the estimated error of its polynomials and their measured error at some
//! points of the box are within the tolerance. Otherwise it is halved along the axis that lowers
//! the error most. A box that was halved too often stays *direct*: its points are simulated.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use super::cell::Cell;
use super::patch::{Piece, Side};
use crate::interruption::check;
use crate::jet::Jet;
use crate::numeric::low_discrepancy;

/// A map that an [`Atlas`] can hold.
pub trait Tabulated {
    /// Lowest and highest value along each axis of the region.
    fn ranges(&self) -> Vec<[f64; 2]>;

    /// Size of each component of an image, in which errors are measured.
    fn scales(&self) -> Vec<f64>;

    /// Image of a point, exact to rounding; returns whether there is one.
    fn image(&mut self, point: &[f64], image: &mut [f64]) -> bool;

    /// Expands the map on a box to an order.
    fn expand(&mut self, cell: &Cell, order: usize) -> Expansion;

    /// Label of the last expansion, which its leaf keeps, as for a word of contacts; 0 unless the
    /// map has labels. Labels are not saved.
    fn label(&self) -> u64 {
        0
    }
}

/// Result of an expansion on a box.
#[derive(Clone, Debug)]
pub enum Expansion {
    /// Polynomials, with an estimate of their error in the map's scales; without one, they hold if
    /// their terms fall fast enough.
    Piece(Piece, Option<f64>),
    /// No polynomial describes the map on the box.
    Unresolved {
        /// Jet that should keep its sign on the box and does not.
        crossing: Option<Jet<f64>>,
    },
}

/// Settings of an atlas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtlasOptions {
    /// Largest error of an image, in the map's scales.
    pub tolerance: f64,
    /// Order of the polynomials, at least 3.
    pub order: usize,
    /// Most halvings of the region in a row; a box beyond is direct.
    pub depth: u32,
    /// Points of each box at which its polynomials are compared with direct images.
    pub samples: usize,
    /// Most boxes that are expanded; points of other boxes are then direct.
    pub boxes: usize,
}

impl Default for AtlasOptions {
    /// Tolerance 1e-6, order 6, 30 halvings, 12 samples a box, 100 000 boxes.
    fn default() -> Self {
        Self { tolerance: 1e-6, order: 6, depth: 30, samples: 12, boxes: 100_000 }
    }
}

/// A setting of an atlas that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OptionsError {
    /// The tolerance is no positive number.
    #[error("the tolerance of an atlas must be a positive number; {found} was given")]
    Tolerance {
        /// Tolerance given.
        found: f64,
    },
    /// The order is too low for an estimate of the error, or too high.
    #[error("the order of an atlas must be from 3 to {most}; {found} was given")]
    Order {
        /// Order given.
        found: usize,
        /// Largest order.
        most: usize,
    },
}

/// Largest order of polynomials.
const MOST_ORDER: usize = 20;

/// Source of an image of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The polynomials of a box.
    Tabulated(Side),
    /// A direct image, in a box that stays direct or is beyond the most boxes.
    Direct,
    /// A direct image of a point outside the region.
    Outside,
    /// No image: direct simulation does not return.
    NoImage,
}

/// Number of leaves by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeafCounts {
    /// Leaves without a graze.
    pub smooth: usize,
    /// Leaves cut by a graze.
    pub grazed: usize,
    /// Leaves whose points are simulated.
    pub direct: usize,
    /// Boxes that were halved.
    pub halved: usize,
    /// Boxes to which no point has come.
    pub open: usize,
}

/// Kind of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafKind {
    /// One polynomial.
    Smooth,
    /// Two polynomials, cut by a graze.
    Grazed,
    /// Points are simulated.
    Direct,
    /// No point has come to the box.
    Open,
}

/// Leaf, or a box to which no point has come.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafBox {
    /// Box.
    pub cell: Cell,
    /// Kind.
    pub kind: LeafKind,
    /// Index of the node.
    pub node: usize,
}

/// Shares of a region by kind of leaf; with the boxes to which no point has come they add up to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafShares {
    /// Share of leaves without a graze.
    pub smooth: f64,
    /// Share of leaves cut by a graze.
    pub grazed: f64,
    /// Share of leaves whose points are simulated.
    pub direct: f64,
}

/// Errors of an atlas at points that cover its region evenly.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Points with an image from polynomials.
    pub tabulated: usize,
    /// Points with a direct image.
    pub direct: usize,
    /// Points without an image.
    pub without_image: usize,
    /// Largest error of an image from polynomials, in the map's scales.
    pub largest_error: f64,
    /// Points whose image errs by more than the tolerance.
    pub violations: Vec<Vec<f64>>,
}

/// Tree of boxes, which the copies of an atlas share.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// Boxes expanded so far.
    pub(super) expanded: usize,
}

/// Node of the tree.
#[derive(Clone, Debug)]
pub(super) enum Node {
    /// Box to which no point has come.
    Open(Box<Cell>),
    /// Halved box: points below `at` belong to the node `first`, others to the one after it.
    Halved { axis: usize, at: f64, first: usize },
    /// Leaf with polynomials.
    Leaf(Arc<Leaf>),
    /// Leaf whose points are simulated.
    Direct,
}

/// Fate of a box to which a point has come.
enum Settled {
    Leaf(Arc<Leaf>),
    Direct,
    /// Halved along an axis.
    Halved(usize),
}

#[derive(Clone, Debug)]
pub(super) struct Leaf {
    pub(super) centre: Vec<f64>,
    /// Reciprocals of the half-widths.
    pub(super) inverse: Vec<f64>,
    pub(super) piece: Piece,
    /// Label of its expansion.
    pub(super) label: u64,
}

impl Node {
    /// Kind of a leaf; `None` for a halved box.
    fn kind(&self) -> Option<LeafKind> {
        match self {
            Self::Open(_) => Some(LeafKind::Open),
            Self::Halved { .. } => None,
            Self::Direct => Some(LeafKind::Direct),
            Self::Leaf(leaf) => Some(match leaf.piece {
                Piece::Smooth(_) => LeafKind::Smooth,
                Piece::Grazed { .. } => LeafKind::Grazed,
            }),
        }
    }
}

impl Leaf {
    pub(super) fn new(cell: &Cell, piece: Piece, label: u64) -> Self {
        let inverse = cell.half.iter().map(|half| 1.0 / half).collect();
        Self { centre: cell.centre.clone(), inverse, piece, label }
    }

    /// Coordinates of a point, `−1` to `1` across the box.
    pub(super) fn local(&self, point: &[f64], local: &mut Vec<f64>) {
        local.clear();
        let sides = point.iter().zip(&self.centre).zip(&self.inverse);
        local.extend(sides.map(|((value, centre), inverse)| (value - centre) * inverse));
    }
}

/// A map held over a region, to a tolerance.
///
/// The image of a point is the same whichever points came before it, unless the most boxes were
/// reached. A clone has a map of its own and shares the boxes, so that several threads may make
/// them.
#[derive(Clone, Debug)]
pub struct Atlas<M> {
    map: M,
    pub(super) options: AtlasOptions,
    pub(super) scales: Vec<f64>,
    pub(super) ranges: Vec<[f64; 2]>,
    pub(super) shared: Arc<Mutex<Tree>>,
    /// Point in the coordinates of a box, and its monomials.
    local: Vec<f64>,
    monomials: Vec<f64>,
}

impl<M: Tabulated> Atlas<M> {
    /// An atlas without leaves.
    ///
    /// # Errors
    ///
    /// [`OptionsError`].
    pub fn new(map: M, options: AtlasOptions) -> Result<Self, OptionsError> {
        let tolerance = options.tolerance;
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(OptionsError::Tolerance { found: tolerance });
        }
        if !(3..=MOST_ORDER).contains(&options.order) {
            return Err(OptionsError::Order { found: options.order, most: MOST_ORDER });
        }
        let ranges = map.ranges();
        let nodes = vec![Node::Open(Box::new(Cell::whole(&ranges)))];
        Ok(Self {
            scales: map.scales(),
            shared: Arc::new(Mutex::new(Tree { nodes, expanded: 0 })),
            ranges,
            map,
            options,
            local: Vec::new(),
            monomials: Vec::new(),
        })
    }

    /// The map that the atlas holds.
    pub fn map(&mut self) -> &mut M {
        &mut self.map
    }

    /// Whether a point lies in the region.
    pub fn holds<'p>(&self, point: impl IntoIterator<Item = &'p f64>) -> bool {
        let mut sides = self.ranges.iter().zip(point);
        sides.all(|([low, high], value)| (low..=high).contains(&value))
    }

    /// Image of a point; makes the leaf of the point if there is none. Without an image the
    /// components are NaN.
    ///
    /// # Panics
    ///
    /// If the point has not one coordinate per axis, or the image not one value per component.
    pub fn image(&mut self, point: &[f64], image: &mut [f64]) -> Answer {
        assert_eq!(point.len(), self.ranges.len(), "one coordinate per axis");
        assert_eq!(image.len(), self.scales.len(), "one value per component");
        let leaf = match self.leaf_of(point) {
            Ok(Some(leaf)) => leaf,
            Ok(None) => return self.direct(point, image, Answer::Direct),
            Err(source) => return self.direct(point, image, source),
        };
        leaf.local(point, &mut self.local);
        Answer::Tabulated(leaf.piece.evaluate(&mut self.local, &mut self.monomials, image))
    }

    /// Iterates the map; the coordinates beyond those of an image are parameters and stay. Calls
    /// `look` with each image and its source until it returns false or an image is missing.
    pub fn iterate(&mut self, start: &[f64], mut look: impl FnMut(&[f64], Answer) -> bool) {
        let mut point = start.to_vec();
        let mut image = vec![0.0; self.scales.len()];
        loop {
            let answer = self.image(&point, &mut image);
            if !look(&image, answer) || answer == Answer::NoImage {
                return;
            }
            point[..image.len()].copy_from_slice(&image);
        }
    }

    /// Makes all leaves, up to the most boxes.
    pub fn make_all(&mut self) {
        let mut node = 0;
        while node < self.tree().nodes.len() && !self.is_exhausted() {
            self.expand(node);
            node += 1;
        }
    }

    /// Open boxes with the number of these points in each, in the order in which the points come to
    /// them.
    pub fn visited(&self, points: &[Vec<f64>]) -> Vec<(usize, usize)> {
        let tree = self.tree();
        let mut boxes: Vec<(usize, usize)> = Vec::new();
        let mut places = BTreeMap::new();
        for point in points.iter().filter(|point| self.holds(*point)) {
            let node = tree.below(0, point);
            if matches!(tree.nodes[node], Node::Open(_)) {
                let place = *places.entry(node).or_insert(boxes.len());
                match boxes.get_mut(place) {
                    Some((_, count)) => *count += 1,
                    None => boxes.push((node, 1)),
                }
            }
        }
        boxes
    }

    /// Makes a leaf of an open box, or halves it; of another node nothing.
    pub fn expand(&mut self, node: usize) {
        let open = match self.tree().nodes.get(node) {
            Some(Node::Open(cell)) => Some(cell.clone()),
            _ => None,
        };
        if let Some(cell) = open {
            self.settle(node, &cell);
        }
    }

    /// Ends the making of leaves: points of open boxes are direct from now on.
    pub fn close(&mut self) {
        self.options.boxes = 0;
    }

    /// The tree, locked.
    pub(super) fn tree(&self) -> MutexGuard<'_, Tree> {
        // NOTE: a box is settled in one assignment, so that a panic leaves a whole tree.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Settings.
    pub fn options(&self) -> &AtlasOptions {
        &self.options
    }

    /// Number of boxes expanded so far.
    pub fn expanded(&self) -> usize {
        self.tree().expanded
    }

    /// Whether the most boxes were expanded.
    pub fn is_exhausted(&self) -> bool {
        self.expanded() >= self.options.boxes
    }

    /// Shares of the region by kind of leaf.
    pub fn shares(&self) -> LeafShares {
        let mut shares = LeafShares::default();
        for LeafBox { cell, kind, .. } in self.boxes() {
            let size = 0.5_f64.powi(cell.depth() as i32);
            match kind {
                LeafKind::Open => {}
                LeafKind::Direct => shares.direct += size,
                LeafKind::Smooth => shares.smooth += size,
                LeafKind::Grazed => shares.grazed += size,
            }
        }
        shares
    }

    /// Number of leaves by kind.
    pub fn counts(&self) -> LeafCounts {
        let mut counts = LeafCounts::default();
        for node in &self.tree().nodes {
            *match node.kind() {
                None => &mut counts.halved,
                Some(LeafKind::Open) => &mut counts.open,
                Some(LeafKind::Direct) => &mut counts.direct,
                Some(LeafKind::Smooth) => &mut counts.smooth,
                Some(LeafKind::Grazed) => &mut counts.grazed,
            } += 1;
        }
        counts
    }

    /// Leaves, and boxes to which no point has come, in the order in which they were made.
    pub fn boxes(&self) -> Vec<LeafBox> {
        let tree = self.tree();
        let mut cells = vec![None; tree.nodes.len()];
        cells[0] = Some(Cell::whole(&self.ranges));
        let mut boxes = Vec::new();
        for (node, own) in tree.nodes.iter().enumerate() {
            let Some(cell) = cells[node].take() else { continue };
            match (own, own.kind()) {
                (Node::Halved { axis, first, .. }, _) => {
                    let [low, high] = cell.halves(*axis);
                    cells[*first] = Some(low);
                    cells[first + 1] = Some(high);
                }
                (_, Some(kind)) => boxes.push(LeafBox { cell, kind, node }),
                (_, None) => {}
            }
        }
        boxes
    }

    /// Kind of the leaf of a point of the region; makes none.
    pub fn kind_at(&self, point: &[f64]) -> LeafKind {
        let tree = self.tree();
        tree.nodes[tree.below(0, point)].kind().unwrap_or(LeafKind::Open)
    }

    /// Depth `−h_min` of the graze that cuts a leaf, relative to the deepest on its box; NaN for a
    /// node without a graze.
    pub fn depth_in(&mut self, node: usize, point: &[f64]) -> f64 {
        let mut depth = [f64::NAN];
        let leaf = match &self.tree().nodes[node] {
            Node::Leaf(leaf) => Some(Arc::clone(leaf)),
            _ => None,
        };
        if let Some(leaf) = leaf
            && let Piece::Grazed { depth: patch, .. } = &leaf.piece
        {
            leaf.local(point, &mut self.local);
            patch.evaluate(&self.local, &mut self.monomials, &mut depth);
        }
        depth[0]
    }

    /// Bytes of all nodes and coefficients.
    pub fn bytes(&self) -> usize {
        let held = |node: &Node| match node {
            Node::Open(cell) => {
                size_of::<Cell>() + cell.centre.len() * (2 * size_of::<f64>() + size_of::<u32>())
            }
            Node::Leaf(leaf) => {
                let sides = 2 * leaf.centre.len() * size_of::<f64>();
                size_of::<Leaf>() + sides + leaf.piece.bytes()
            }
            Node::Halved { .. } | Node::Direct => 0,
        };
        let tree = self.tree();
        size_of_val(&tree.nodes[..]) + tree.nodes.iter().map(held).sum::<usize>()
    }

    /// Compares images with direct ones at points that cover the region evenly, other points than
    /// those at which leaves were checked. Makes the leaves of the points; calls `look` after each.
    pub fn measure(&mut self, points: usize, mut look: impl FnMut()) -> Measurement {
        let mut found = Measurement {
            tabulated: 0,
            direct: 0,
            without_image: 0,
            largest_error: 0.0,
            violations: Vec::new(),
        };
        let mut image = vec![0.0; self.scales.len()];
        let mut exact = image.clone();
        for index in 0..points {
            let point = self.spread(index);
            match self.image(&point, &mut image) {
                Answer::NoImage => found.without_image += 1,
                Answer::Direct | Answer::Outside => found.direct += 1,
                Answer::Tabulated(_) => {
                    found.tabulated += 1;
                    let error = match self.map.image(&point, &mut exact) {
                        true => distance(&image, &exact, &self.scales),
                        false => f64::INFINITY,
                    };
                    found.largest_error = found.largest_error.max(error);
                    if error > self.options.tolerance {
                        found.violations.push(point);
                    }
                }
            }
            look();
        }
        found
    }

    /// Point of a sequence that covers the region evenly.
    pub fn spread(&self, index: usize) -> Vec<f64> {
        Cell::whole(&self.ranges).point(&low_discrepancy(index, self.ranges.len()))
    }

    pub(super) fn direct(&mut self, point: &[f64], image: &mut [f64], answer: Answer) -> Answer {
        if self.map.image(point, image) {
            return answer;
        }
        image.fill(f64::NAN);
        Answer::NoImage
    }

    /// Leaf of a point, made if there is none; `None` for a box whose points are simulated.
    ///
    /// # Errors
    ///
    /// The source of the image where there is no leaf: outside the region, or beyond the most
    /// boxes.
    pub(super) fn leaf_of(&mut self, point: &[f64]) -> Result<Option<Arc<Leaf>>, Answer> {
        if !self.holds(point) {
            return Err(Answer::Outside);
        }
        let mut node = 0;
        loop {
            let cell = {
                let tree = self.tree();
                node = tree.below(node, point);
                match &tree.nodes[node] {
                    Node::Leaf(leaf) => return Ok(Some(Arc::clone(leaf))),
                    Node::Direct | Node::Halved { .. } => return Ok(None),
                    Node::Open(_) if tree.expanded >= self.options.boxes => {
                        return Err(Answer::Direct);
                    }
                    Node::Open(cell) => cell.clone(),
                }
            };
            self.settle(node, &cell);
        }
    }

    /// Makes a leaf of an open box, or halves it. Another copy of the atlas that came first did the
    /// same.
    fn settle(&mut self, node: usize, cell: &Cell) {
        check();
        let settled = self.settled(cell);
        let mut tree = self.tree();
        if !matches!(tree.nodes[node], Node::Open(_)) {
            return;
        }
        tree.expanded += 1;
        tree.nodes[node] = match settled {
            Settled::Leaf(leaf) => Node::Leaf(leaf),
            Settled::Direct => Node::Direct,
            Settled::Halved(axis) => {
                let first = tree.nodes.len();
                let halves = cell.halves(axis);
                tree.nodes.extend(halves.map(|half| Node::Open(Box::new(half))));
                Node::Halved { axis, at: cell.centre[axis], first }
            }
        };
    }

    /// Fate of a box, by the box alone.
    fn settled(&mut self, cell: &Cell) -> Settled {
        let axes = cell.centre.len();
        let allowed = SHARE * self.options.tolerance;
        let gains = match self.map.expand(cell, self.options.order) {
            Expansion::Piece(piece, error) => {
                let error = error.unwrap_or_else(|| piece.error(&self.scales));
                if error <= allowed && self.is_confirmed(cell, &piece) {
                    return Settled::Leaf(Arc::new(Leaf::new(cell, piece, self.map.label())));
                }
                piece.gains(axes, &self.scales, allowed)
            }
            Expansion::Unresolved { crossing } => {
                crossing.map_or_else(Vec::new, |jet| reach(&jet, axes))
            }
        };
        match cell.depth() >= self.options.depth {
            true => Settled::Direct,
            false => Settled::Halved(best(&gains).unwrap_or_else(|| cell.widest())),
        }
    }

    /// Whether the polynomials of a box agree with direct images at the box's samples.
    fn is_confirmed(&mut self, cell: &Cell, piece: &Piece) -> bool {
        let mut image = vec![0.0; self.scales.len()];
        let mut exact = image.clone();
        (0..self.options.samples).all(|index| {
            let unit = low_discrepancy(index, cell.centre.len());
            self.local.clear();
            self.local.extend(unit.iter().map(|share| 2.0 * share - 1.0));
            piece.evaluate(&mut self.local, &mut self.monomials, &mut image);
            self.map.image(&cell.point(&unit), &mut exact)
                && distance(&image, &exact, &self.scales) <= SHARE * self.options.tolerance
        })
    }
}

impl Tree {
    /// Node at or below another one that holds a point of its box and is not halved.
    fn below(&self, mut node: usize, point: &[f64]) -> usize {
        while let Node::Halved { axis, at, first } = &self.nodes[node] {
            node = first + usize::from(point[*axis] >= *at);
        }
        node
    }
}

/// Share of the tolerance that estimates and samples of a leaf may use.
const SHARE: f64 = 0.25;

/// Largest difference of two images, in scales; NaN counts as infinite.
pub(super) fn distance(image: &[f64], exact: &[f64], scales: &[f64]) -> f64 {
    let apart = image.iter().zip(exact).zip(scales);
    apart.fold(0.0, |largest: f64, ((value, exact), scale)| {
        let apart = (value - exact).abs() / scale;
        if apart.is_nan() { f64::INFINITY } else { largest.max(apart) }
    })
}

/// Decrease of the sum of a jet's coefficients beyond its head, if the box is halved along each
/// axis.
fn reach(jet: &Jet<f64>, axes: usize) -> Vec<f64> {
    let mut gains = vec![0.0; axes];
    for (exponents, value) in jet.terms() {
        for (gain, &power) in gains.iter_mut().zip(exponents) {
            *gain += value.abs() * (1.0 - 0.5_f64.powi(i32::from(power)));
        }
    }
    gains
}

/// Axis of the largest gain, the first of several; `None` if none is positive and finite.
fn best(gains: &[f64]) -> Option<usize> {
    let usable = gains.iter().enumerate().filter(|(_, gain)| **gain > 0.0 && gain.is_finite());
    let first = |best: Option<(usize, f64)>, (axis, &gain): (usize, &f64)| match best {
        Some((_, most)) if most >= gain => best,
        _ => Some((axis, gain)),
    };
    usable.fold(None, first).map(|(axis, _)| axis)
}
