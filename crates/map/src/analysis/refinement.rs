//! Classes of all cells of a grid, computed mostly near borders between classes.
//!
//! One idea: a block of cells whose corners and probes have the same class is filled with it; any
//! other block is cut in four. Afterwards a filled cell that touches a cell of another class is
//! computed, repeatedly, so that every border that is met is followed to its end.
//!
//! Nothing is proved about a filled cell: a region is missed if it holds no corner and no probe and
//! touches no border that was met. [`BlockProbes`] bound what is missed by what the probes found.

use serde::{Deserialize, Serialize};

use super::progress::Share;

/// Sides of the first blocks, in cells.
pub const BLOCK: usize = 8;

/// Guess of the part of all cells that is computed.
pub(super) const COMPUTED: f64 = 0.1;

/// Number of inner cells of a block for each of its probes: one probe in a whole first block, none
/// in the blocks that it is cut into, which lie along borders.
const INNER: usize = 32;

/// Steps of the sequence of probes in a block, in its width and its height: multiples of the
/// inverse of the plastic number, so that the probes of all blocks fill a block evenly.
const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// Cells computed inside blocks whose corners are alike, to look for regions that the corners miss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockProbes {
    /// Number of probes.
    pub count: usize,
    /// Number of probes of another class than their block's corners.
    pub differing: usize,
}

impl BlockProbes {
    /// Upper bound, at 95 % confidence, on the fraction of the cells filled in these blocks whose
    /// class is another: the regions found are computed, and those missed are not larger together
    /// than those found. 1 without probes.
    ///
    /// ```
    /// use grazemap_map::analysis::basin::BlockProbes;
    ///
    /// let none_differs = BlockProbes { count: 1000, differing: 0 };
    /// assert_eq!(none_differs.missed_at_most(), 3e-3);
    /// ```
    #[must_use]
    pub fn missed_at_most(&self) -> f64 {
        // NOTE: above the quantile of Poisson's distribution for every number that differs.
        let differing = self.differing as f64;
        let most = differing + 2.0 * differing.sqrt() + 3.0;
        (most / self.count as f64).min(1.0)
    }
}

/// Classes of all cells, row by row.
#[derive(Clone, Debug)]
pub(super) struct RefinedCells<C> {
    cells: Vec<Class<C>>,
    probes: BlockProbes,
}

impl<C> RefinedCells<C> {
    /// Number of cells that were computed; the others were filled from their neighbours.
    pub(super) fn computed(&self) -> usize {
        self.cells.iter().filter(|cell| matches!(cell, Class::Computed(_))).count()
    }

    /// Probes of the blocks whose corners were alike.
    pub(super) fn probes(&self) -> BlockProbes {
        self.probes
    }

    /// All classes; `filled` is applied to those that were not computed.
    pub(super) fn into_cells(self, filled: impl Fn(C) -> C) -> Vec<C> {
        let known = |cell| match cell {
            Class::Unknown => None,
            Class::Filled(class) => Some(filled(class)),
            Class::Computed(class) => Some(class),
        };
        self.cells.into_iter().filter_map(known).collect()
    }
}

/// Classes of a grid of so many columns and rows; cell index `row * columns + column`.
///
/// `compute` returns the classes of cells, given by increasing indices, and is called at most once
/// for each cell. `alike` tells whether two classes are equal.
pub(super) fn refine<C: Clone>(
    size: [usize; 2],
    alike: impl Fn(&C, &C) -> bool,
    compute: impl FnMut(&[usize]) -> Vec<C>,
) -> RefinedCells<C> {
    refine_share(size, None, alike, compute)
}

/// [`refine`] restricted to the tiles of one share: computes the cells that borders within its
/// tiles need; the other cells stay unknown.
pub(super) fn refine_share<C: Clone>(
    [columns, rows]: [usize; 2],
    share: Option<Share>,
    alike: impl Fn(&C, &C) -> bool,
    compute: impl FnMut(&[usize]) -> Vec<C>,
) -> RefinedCells<C> {
    let cells = vec![Class::Unknown; columns * rows];
    let mut grid = RefinementGrid { columns, rows, cells, alike, compute };
    let mut probes = BlockProbes::default();
    let mut blocks = blocks([columns, rows]);
    if let Some(share) = share {
        let tiles = Tiles::of([columns, rows]);
        blocks.retain(|block| tiles.are_taken(share, [block.columns[0], block.rows[0]]));
    }
    grid.ask(corners(&blocks, columns));
    while !blocks.is_empty() {
        let (same, mut other): (Vec<Block>, Vec<Block>) =
            blocks.into_iter().partition(|block| grid.is_uniform(block));
        grid.ask(same.iter().flat_map(|block| block.probes(columns)).collect());
        let (same, found): (Vec<Block>, Vec<Block>) =
            same.into_iter().partition(|block| grid.probe(block, &mut probes));
        other.extend(found);
        blocks = other.iter().flat_map(Block::parts).collect();
        grid.ask(corners(&blocks, columns));
        same.iter().for_each(|block| grid.fill(block));
    }
    let mut doubtful: Vec<usize> = (0..columns * rows).collect();
    while !doubtful.is_empty() {
        doubtful.retain(|&cell| grid.is_doubtful(cell));
        doubtful = grid.ask(doubtful).into_iter().flat_map(|cell| grid.neighbours(cell)).collect();
    }
    RefinedCells { cells: grid.cells, probes }
}

/// Cells that [`refine`] computes first, sorted.
pub(super) fn first_asked(size: [usize; 2]) -> Vec<usize> {
    let mut first = corners(&blocks(size), size[0]);
    first.sort_unstable();
    first.dedup();
    first
}

/// Squares of cells that are dealt out to the shares of a grid: large, so that little is computed
/// on both sides of their edges, yet many and scattered, so that all shares have about as much of
/// the borders.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tiles {
    /// Numbers of columns and rows of cells.
    size: [usize; 2],
    side: usize,
    columns: usize,
    count: usize,
    /// Distance between consecutive tiles of a share, in tiles.
    step: usize,
}

impl Tiles {
    /// Largest and smallest side in first blocks, and number of tiles along the grid's longer side
    /// within these sides.
    const LARGEST: usize = 8;
    const SMALLEST: usize = 2;
    const ALONG: usize = 12;

    /// Tiles of a grid of so many columns and rows.
    pub(super) fn of(size: [usize; 2]) -> Self {
        let [columns, rows] = size;
        let blocks = columns.max(rows) / (BLOCK * Self::ALONG);
        let side = BLOCK * blocks.clamp(Self::SMALLEST, Self::LARGEST);
        let (columns, rows) = (columns.div_ceil(side), rows.div_ceil(side));
        let count = columns * rows;
        // Steps of the golden section scatter the tiles most evenly.
        let near = (0.618 * count as f64) as usize + 1;
        let step = (near..).find(|&step| gcd(step, count) == 1).unwrap_or(1);
        Self { size, side, columns, count, step }
    }

    /// Cells of the tiles of a share.
    pub(super) fn cells(self, share: Share) -> Vec<usize> {
        let [columns, rows] = self.size;
        let own = |cell: &usize| self.are_taken(share, [cell % columns, cell / columns]);
        (0..columns * rows).filter(own).collect()
    }

    /// Whether the tile at a column and a row belongs to a share.
    pub(super) fn are_taken(self, share: Share, [column, row]: [usize; 2]) -> bool {
        let number = row / self.side * self.columns + column / self.side;
        share.range(self.count).contains(&(number * self.step % self.count))
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// State of knowledge about a cell.
#[derive(Clone, Debug)]
enum Class<C> {
    Unknown,
    /// Filled from its neighbours.
    Filled(C),
    Computed(C),
}

impl<C> Class<C> {
    fn known(&self) -> Option<&C> {
        match self {
            Self::Unknown => None,
            Self::Filled(class) | Self::Computed(class) => Some(class),
        }
    }
}

/// Block of cells: first and last column, first and last row.
#[derive(Clone, Copy, Debug)]
struct Block {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Block {
    fn corners(&self, columns: usize) -> [usize; 4] {
        let ([left, right], [low, high]) = (self.columns, self.rows);
        [(low, left), (low, right), (high, left), (high, right)]
            .map(|(row, column)| row * columns + column)
    }

    /// Inner cells that are probed: the next points of a sequence that fills a block evenly, from a
    /// start that differs from block to block.
    fn probes(&self, columns: usize) -> Vec<usize> {
        let ([left, right], [low, high]) = (self.columns, self.rows);
        let inner = [right - left, high - low].map(|width| width.saturating_sub(1));
        let count = inner[0] * inner[1] / INNER;
        let number = low / BLOCK * columns.div_ceil(BLOCK) + left / BLOCK;
        let place = |index: usize, axis: usize| {
            let along = (0.5 + STEPS[axis] * index as f64).fract();
            1 + (along * inner[axis] as f64) as usize
        };
        let cell = |index: usize| (low + place(index, 1)) * columns + left + place(index, 0);
        (count * number..count * (number + 1)).map(cell).collect()
    }

    /// The block halved in each direction in which it has inner cells; empty if all its cells are
    /// corners.
    fn parts(&self) -> Vec<Self> {
        let halves = |[first, last]: [usize; 2]| match last - first {
            0 | 1 => vec![[first, last]],
            width => vec![[first, first + width / 2], [first + width / 2, last]],
        };
        let (columns, rows) = (halves(self.columns), halves(self.rows));
        if columns.len() * rows.len() == 1 {
            return Vec::new();
        }
        let part = |&rows: &[usize; 2]| columns.iter().map(move |&columns| Self { columns, rows });
        rows.iter().flat_map(part).collect()
    }
}

/// First blocks; neighbours share their edges.
fn blocks([columns, rows]: [usize; 2]) -> Vec<Block> {
    let spans = |count: usize| -> Vec<[usize; 2]> {
        let last = count.saturating_sub(1);
        let firsts = (0..last.max(1)).step_by(BLOCK);
        firsts.map(|first| [first, last.min(first + BLOCK)]).collect()
    };
    let (columns, rows) = (spans(columns), spans(rows));
    let row = |&rows: &[usize; 2]| columns.iter().map(move |&columns| Block { columns, rows });
    rows.iter().flat_map(row).collect()
}

/// Corners of blocks, with repetitions.
fn corners(blocks: &[Block], columns: usize) -> Vec<usize> {
    blocks.iter().flat_map(|block| block.corners(columns)).collect()
}

struct RefinementGrid<C, A, F> {
    columns: usize,
    rows: usize,
    cells: Vec<Class<C>>,
    alike: A,
    compute: F,
}

impl<C: Clone, A: Fn(&C, &C) -> bool, F: FnMut(&[usize]) -> Vec<C>> RefinementGrid<C, A, F> {
    /// Computes the cells of `wanted` that are not computed yet, and returns them.
    fn ask(&mut self, mut wanted: Vec<usize>) -> Vec<usize> {
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|&cell| !matches!(self.cells[cell], Class::Computed(_)));
        if !wanted.is_empty() {
            let classes = (self.compute)(&wanted);
            for (&cell, class) in wanted.iter().zip(classes) {
                self.cells[cell] = Class::Computed(class);
            }
        }
        wanted
    }

    fn is_uniform(&self, block: &Block) -> bool {
        let [first, rest @ ..] = block.corners(self.columns);
        rest.iter().all(|&corner| self.are_alike(first, corner))
    }

    /// Whether all probes of a block are of the class of its corners; counts them.
    fn probe(&self, block: &Block, counted: &mut BlockProbes) -> bool {
        let (first, probes) = (block.corners(self.columns)[0], block.probes(self.columns));
        let differing = probes.iter().filter(|&&probe| !self.are_alike(first, probe)).count();
        counted.count += probes.len();
        counted.differing += differing;
        differing == 0
    }

    fn are_alike(&self, a: usize, b: usize) -> bool {
        match (self.cells[a].known(), self.cells[b].known()) {
            (Some(a), Some(b)) => (self.alike)(a, b),
            _ => false,
        }
    }

    /// Fills the unknown cells of a block with the class of its first corner.
    fn fill(&mut self, block: &Block) {
        let first = block.corners(self.columns)[0];
        let Some(class) = self.cells[first].known().cloned() else { return };
        for row in block.rows[0]..=block.rows[1] {
            for column in block.columns[0]..=block.columns[1] {
                let cell = &mut self.cells[row * self.columns + column];
                if matches!(cell, Class::Unknown) {
                    *cell = Class::Filled(class.clone());
                }
            }
        }
    }

    /// Whether a filled cell touches a cell of another class.
    fn is_doubtful(&self, cell: usize) -> bool {
        let differs = |&other: &usize| {
            // Cells of other shares stay unknown.
            self.cells[other].known().is_some() && !self.are_alike(cell, other)
        };
        let filled = matches!(self.cells[cell], Class::Filled(_));
        filled && self.neighbours(cell).iter().any(differs)
    }

    /// Cells that touch a cell, at most eight.
    fn neighbours(&self, cell: usize) -> Vec<usize> {
        neighbours([self.columns, self.rows], cell)
    }
}

/// Cells of a grid that touch a cell, at most eight.
pub(super) fn neighbours([columns, rows]: [usize; 2], cell: usize) -> Vec<usize> {
    let (row, column) = (cell / columns, cell % columns);
    let near = |at: usize, count: usize| at.saturating_sub(1)..count.min(at + 2);
    let touching = near(row, rows)
        .flat_map(|row| near(column, columns).map(move |column| row * columns + column));
    touching.filter(|&other| other != cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Refines a grid with the class at each column and row; returns all classes and the number of
    /// cells computed.
    fn refined(
        [columns, rows]: [usize; 2],
        class: impl Fn(usize, usize) -> u8,
    ) -> (Vec<u8>, usize) {
        let mut asked = vec![0; columns * rows];
        let refined = refine([columns, rows], u8::eq, |cells| {
            cells.iter().for_each(|&cell| asked[cell] += 1);
            cells.iter().map(|&cell| class(cell % columns, cell / columns)).collect()
        });
        assert!(asked.iter().all(|&times| times <= 1), "no cell is computed twice");
        let computed = refined.computed();
        assert_eq!(asked.iter().sum::<usize>(), computed);
        (refined.into_cells(|class| class), computed)
    }

    fn uniform([columns, rows]: [usize; 2], class: impl Fn(usize, usize) -> u8) -> Vec<u8> {
        (0..columns * rows).map(|cell| class(cell % columns, cell / columns)).collect()
    }

    #[test]
    fn borders_that_are_met_are_followed_to_their_ends() {
        // A disk, a line one cell wide that leaves it, and a corner: all touch one another.
        let class = |column: usize, row: usize| {
            let (x, y) = (column as f64 - 70.3, row as f64 - 60.8);
            let disk = x.hypot(y) < 33.0;
            let line = row == 61 && column > 70;
            u8::from(disk) + 2 * u8::from(line) + 4 * u8::from(column + row > 230)
        };
        let size = [150, 131];
        let (found, computed) = refined(size, class);
        assert_eq!(found, uniform(size, class));
        assert!(computed < 150 * 131 / 5, "{computed} computed");
    }

    #[test]
    fn grids_of_any_shape_are_filled() {
        for size in [[1, 1], [1, 9], [9, 1], [2, 2], [8, 8], [9, 10], [17, 3], [16, 25]] {
            let class = |column: usize, row: usize| u8::from(2 * column > size[0] + row);
            assert_eq!(refined(size, class).0, uniform(size, class), "{size:?}");
        }
    }

    #[test]
    fn most_islands_of_six_cells_inside_one_block_are_found() {
        // At both places of eight blocks; the corners alone find none.
        let (size, side) = ([65, 9], 6);
        let found = (0..8).flat_map(|block| (1..3).map(move |at| (8 * block + at, at)));
        let found = found.filter(|&(left, low)| {
            let class = |column: usize, row: usize| {
                let inside = (left..left + side).contains(&column);
                u8::from(inside && (low..low + side).contains(&row))
            };
            refined(size, class).0 == uniform(size, class)
        });
        assert_eq!(found.count(), 12);
    }

    #[test]
    fn probes_of_blocks_fill_a_block_evenly() {
        let columns = 400;
        let probes = blocks([columns, columns]).into_iter().map(|block| block.probes(columns));
        let mut counts = [[0; BLOCK]; BLOCK];
        for cell in probes.flatten() {
            counts[cell / columns % BLOCK][cell % columns % BLOCK] += 1;
        }
        // 2500 probes over 49 inner cells: 51 each.
        let inner = counts[1..].iter().flat_map(|row| &row[1..]);
        let (least, most) = inner.fold((usize::MAX, 0), |(least, most), &count: &usize| {
            (least.min(count), most.max(count))
        });
        assert!(least > 35 && most < 68, "{least} to {most}");
    }

    #[test]
    fn single_cells_that_are_missed_are_no_more_than_the_probes_allow() {
        // A cell of another class in so many; none touches another.
        for one_of in [7, 40, 300, 2000] {
            let size = [241, 241];
            let class = |column: usize, row: usize| {
                let (pair, is_even) = (column / 2 * 9973 + row / 2 * 7919, column % 2 + row % 2);
                u8::from(is_even == 0 && (pair * pair / 64) % one_of == 0)
            };
            let truth = uniform(size, class);
            let refined = refine(size, u8::eq, |cells| {
                cells.iter().map(|&cell| class(cell % size[0], cell / size[0])).collect()
            });
            let probes = refined.probes();
            let filled = truth.len() - refined.computed();
            let found = refined.into_cells(|class| class);
            let missed = found.iter().zip(&truth).filter(|(a, b)| a != b).count();
            let share = missed as f64 / filled as f64;
            assert!(share <= probes.missed_at_most(), "{one_of}: {share}, {probes:?}");
        }
    }

    #[test]
    fn a_region_between_corners_and_probes_is_missed_as_it_is_said() {
        let class = |column: usize, row: usize| u8::from(column == 2 && row == 3);
        assert_eq!(refined([17, 17], class).0, [0; 289]);
    }
}
