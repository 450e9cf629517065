//! Rows over the extended state, single or as tables that are multiplied with it.

use crate::numeric::{Lanes, Real, Scalar};

/// Default number of rows that are computed together, to fill the processor's lanes.
pub(super) const BLOCK: usize = 4;

/// Rows over the extended state, one after another.
#[derive(Clone, Debug)]
pub(super) struct Rows<S> {
    columns: usize,
    values: Vec<S>,
}

impl<S: Scalar> Rows<S> {
    /// Rows from their entries, row by row.
    pub(super) fn new(columns: usize, values: Vec<S>) -> Self {
        Self { columns, values }
    }

    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    pub(super) fn len(&self) -> usize {
        self.values.len() / self.columns
    }

    pub(super) fn iter(&self) -> std::slice::ChunksExact<'_, S> {
        self.values.chunks_exact(self.columns)
    }
}

/// Rows over the extended state that are multiplied with it together, such as the coefficients of a
/// power series.
///
/// Rows are stored in blocks. Each block holds all columns, one after another.
#[derive(Clone, Debug)]
pub struct RowTable<S, const N: usize = BLOCK> {
    rows: usize,
    columns: usize,
    blocks: Vec<[S; N]>,
}

/// Padded length of a series: whole blocks.
pub(super) fn padded(coefficients: usize) -> usize {
    coefficients.next_multiple_of(BLOCK)
}

impl<S: Scalar, const N: usize> RowTable<S, N> {
    /// Table of rows of equal lengths; padded with zeros to whole blocks.
    ///
    /// # Panics
    ///
    /// If a row has fewer entries than `columns`.
    pub fn new<'r>(rows: impl ExactSizeIterator<Item = &'r [S]>, columns: usize) -> Self
    where
        S: 'r,
    {
        let mut table = Self::zeros(rows.len(), columns);
        for (number, row) in rows.enumerate() {
            table.set(number, row);
        }
        table
    }

    fn set(&mut self, number: usize, row: &[S]) {
        let block = &mut self.blocks[number / N * self.columns..][..self.columns];
        for (lanes, &value) in block.iter_mut().zip(&row[..self.columns]) {
            lanes[number % N] = value;
        }
    }

    /// Appends rows to the table.
    #[must_use]
    pub fn followed_by(mut self, rows: &[&[S]]) -> Self {
        let first = self.rows;
        self.pad(first + rows.len());
        for (number, row) in (first..).zip(rows) {
            self.set(number, row);
        }
        self
    }

    /// Table of the first `count` rows, padded with zeros to `count` rows and to whole blocks.
    pub(super) fn first(rows: &Rows<S>, count: usize) -> Self {
        let mut table = Self::new(rows.iter().take(count), rows.columns);
        table.pad(count);
        table
    }

    /// Table from a function that gives the block for a block index and a column, both from 0.
    pub(super) fn from_blocks(
        rows: usize,
        columns: usize,
        mut block: impl FnMut(usize, usize) -> [S; N],
    ) -> Self {
        let mut blocks = Vec::with_capacity(rows.div_ceil(N) * columns);
        for first in 0..rows.div_ceil(N) {
            blocks.extend((0..columns).map(|column| block(first, column)));
        }
        Self { rows, columns, blocks }
    }

    fn zeros(rows: usize, columns: usize) -> Self {
        Self::from_blocks(rows, columns, |_, _| [S::zero(); N])
    }

    fn pad(&mut self, rows: usize) {
        let len = rows.div_ceil(N) * self.columns;
        self.blocks.resize(len, [S::zero(); N]);
        self.rows = rows;
    }

    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    /// Blocks of rows; each block holds all columns, one after another.
    pub(super) fn blocks(&self) -> &[[S; N]] {
        &self.blocks
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Entries of a column, including the padding.
    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = S> + '_ {
        let blocks = self.blocks.iter().skip(column).step_by(self.columns);
        blocks.flatten().copied()
    }

    /// The rows after a flow: their product with the flow's matrix, given without its last row,
    /// that of the number 1.
    pub(super) fn after<const M: usize>(&self, flow: &RowTable<S, M>) -> Self {
        let columns = self.columns;
        Self::from_blocks(self.rows, columns, |block, column| {
            let block = &self.blocks[block * columns..][..columns];
            let constant = column + 1 == columns;
            let mut sum = if constant { block[column] } else { [S::zero(); N] };
            let factors = flow.blocks[column..].iter().step_by(columns);
            for (lanes, factors) in block[..columns - 1].chunks(M).zip(factors) {
                for (lanes, &factor) in lanes.iter().zip(factors) {
                    if factor != S::zero() {
                        accumulate(&mut sum, factor, lanes);
                    }
                }
            }
            sum
        })
    }

    /// The table in `f64`.
    pub(super) fn rounded(&self) -> RowTable<f64, N>
    where
        S: Real,
    {
        let rounded = |lanes: &[S; N]| lanes.map(Real::to_f64);
        RowTable {
            rows: self.rows,
            columns: self.columns,
            blocks: self.blocks.iter().map(rounded).collect(),
        }
    }

    /// Products of all rows with the extended state, into `out`, which has the padded length.
    #[inline(always)]
    pub(super) fn combine(&self, extended: &[S], out: &mut [S]) {
        self.combine_as(extended, |&y| y, out);
    }

    /// Products of all rows with an extended state whose components are converted by `number`.
    #[inline(always)]
    pub(super) fn combine_as<Y>(&self, extended: &[Y], number: impl Fn(&Y) -> S, out: &mut [S]) {
        let (out, _) = out.as_chunks_mut::<N>();
        self.products(extended, number, out.iter_mut(), |out, products| {
            *out = products;
        });
    }

    /// Products of the first rows with the extended state, as many as fit into `out`.
    #[inline(always)]
    pub fn multiply(&self, extended: &[S], out: &mut [S]) {
        self.products(
            extended,
            |&y| y,
            out.chunks_mut(N),
            |out, products| {
                for (out, product) in out.iter_mut().zip(products) {
                    *out = product;
                }
            },
        );
    }

    /// Passes the products of the rows with the extended state to `put`, block by block.
    ///
    /// NOTE: systems of one or two masses under one force have code without loops over columns,
    /// with half as many instructions.
    #[inline(always)]
    fn products<Y, O>(
        &self,
        extended: &[Y],
        number: impl Fn(&Y) -> S,
        places: impl Iterator<Item = O>,
        put: impl Fn(O, [S; N]),
    ) {
        match self.columns {
            5 => {
                let (blocks, _) = self.blocks.as_chunks::<5>();
                for (place, block) in places.zip(blocks) {
                    put(place, product(&extended[..5], &number, block));
                }
            }
            7 => {
                let (blocks, _) = self.blocks.as_chunks::<7>();
                for (place, block) in places.zip(blocks) {
                    put(place, product(&extended[..7], &number, block));
                }
            }
            columns => {
                let blocks = self.blocks.chunks_exact(columns);
                for (place, block) in places.zip(blocks) {
                    put(place, product(&extended[..columns], &number, block));
                }
            }
        }
    }
}

impl<const N: usize, const L: usize> RowTable<Lanes<L>, N> {
    /// One table whose lanes are the given tables, which have equal shapes, padded with zeros to
    /// `rows` rows.
    pub(crate) fn interleaved(tables: [&RowTable<f64, N>; L], rows: usize) -> Self {
        let columns = tables[0].columns;
        Self::from_blocks(rows, columns, |block, column| {
            let place = block * columns + column;
            std::array::from_fn(|row| {
                let entry = |lane: usize| tables[lane].blocks.get(place).map_or(0.0, |b| b[row]);
                Lanes::from_fn(entry)
            })
        })
    }
}

/// Products of a block's rows with an extended state, whose last component is 1.
#[inline(always)]
pub(super) fn product<S: Scalar, Y, const N: usize>(
    extended: &[Y],
    number: impl Fn(&Y) -> S,
    block: &[[S; N]],
) -> [S; N] {
    let Some((&constant, block)) = block.split_last() else {
        return [S::zero(); N];
    };
    let mut sum = constant;
    for (y, lanes) in extended.iter().zip(block) {
        accumulate(&mut sum, number(y), lanes);
    }
    sum
}

/// Adds a multiple of some lanes to a sum.
#[inline(always)]
pub(super) fn accumulate<S: Scalar, const N: usize>(sum: &mut [S; N], factor: S, lanes: &[S; N]) {
    for lane in 0..N {
        sum[lane] = factor.mul_add(lanes[lane], sum[lane]);
    }
}
