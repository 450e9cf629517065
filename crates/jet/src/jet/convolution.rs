//! Sums of products of coefficients, a run of the result at a time.
//!
//! One idea: the coefficients of a run are summed side by side, in registers where the run is
//! short. Each is one chain of sums, its terms in the order of the table whatever the scalar, so
//! that lanes give the bits of single numbers.

mod terms;
mod whole;

pub(super) use self::whole::FullProduct;

use self::terms::Terms;
use super::Span;
use super::product_table::{ProductTable, Run};
use super::selection::Selection;
use crate::numeric::{Kernel, Scalar, one_by_one};

/// Longest run that is summed in registers.
const LONGEST_IN_REGISTERS: usize = 8;

/// A factor of which the coefficients before `first`, the first of a degree, are known to vanish.
#[derive(Clone, Copy)]
pub(super) struct Factor<'a, S> {
    pub(super) coefficients: &'a [S],
    pub(super) first: u32,
}

impl<'a, S> Factor<'a, S> {
    /// A factor whose coefficients may all differ from zero.
    pub(super) fn full(coefficients: &'a [S]) -> Self {
        Self {
            coefficients,
            first: 0,
        }
    }

    /// The same, its head left out or not.
    #[inline(always)]
    fn from(self, leaves_head: bool) -> Self {
        Self {
            first: self.first.max(u32::from(leaves_head)),
            ..self
        }
    }
}

/// What becomes of a sum of products.
#[derive(Clone, Copy)]
pub(super) enum Finish<'a, S> {
    /// It is the coefficient.
    Set,
    /// It is added to the coefficient there is.
    Add,
    /// It is multiplied by a factor.
    Scale(S),
    /// It is subtracted from the coefficient of an element, and the difference multiplied by a
    /// factor.
    Subtract { from: &'a [S], factor: S },
}

impl<S: Scalar> Finish<'_, S> {
    /// Stores the sums of some monomials, the first of them given.
    #[inline(always)]
    fn store<const LEN: usize>(&self, first: usize, sums: [S; LEN], out: &mut [S; LEN]) {
        match *self {
            Finish::Set => *out = sums,
            Finish::Add => {
                for k in 0..LEN {
                    one_by_one::<S>(k);
                    out[k] += sums[k];
                }
            }
            Finish::Scale(factor) => {
                for k in 0..LEN {
                    one_by_one::<S>(k);
                    out[k] = sums[k] * factor;
                }
            }
            Finish::Subtract { from, factor } => {
                let Some(from) = from.get(first..).and_then(|from| from.first_chunk::<LEN>())
                else {
                    return;
                };
                for k in 0..LEN {
                    one_by_one::<S>(k);
                    out[k] = (from[k] - sums[k]) * factor;
                }
            }
        }
    }
}

/// A product, or part of one: what is added to the coefficients of some runs.
pub(super) struct Convolution<'a, S> {
    pub(super) table: &'a ProductTable,
    /// Neighbouring runs, whose coefficients `out` holds.
    pub(super) runs: &'a [Run],
    pub(super) span: Span,
    pub(super) a: Factor<'a, S>,
    pub(super) b: Factor<'a, S>,
    pub(super) finish: Finish<'a, S>,
    pub(super) out: &'a mut [S],
    /// The runs whose sums can differ from zero, if not all.
    pub(super) selection: Option<Selection<'a>>,
}

impl<S: Scalar> Convolution<'_, S> {
    /// Forms the product.
    ///
    /// NOTE: the one place of the program where the loops are compiled, once per scalar and
    /// instruction set, and apart for the common kinds: a sum with no choice in it stays in
    /// registers.
    #[inline(never)]
    pub(super) fn form(self) {
        let square = self.is_square();
        match (self.span, square) {
            _ if self.a.first.max(self.b.first) > 0 => S::dispatch(Formed(self, Any { square })),
            (Span::Full, false) => S::dispatch(Formed(self, All::<false, false>)),
            (Span::Full, true) => S::dispatch(Formed(self, All::<false, true>)),
            (Span::WithoutFirst, false) => S::dispatch(Formed(self, All::<true, false>)),
            _ => S::dispatch(Formed(self, Any { square })),
        }
    }

    /// Whether it is the square of an element, of which half the products are formed.
    #[inline(always)]
    fn is_square(&self) -> bool {
        std::ptr::eq(self.a.coefficients, self.b.coefficients)
            && matches!(self.span, Span::Full | Span::Interior)
    }

    /// Adds to every run that is asked for.
    #[inline(always)]
    fn add<A: Addition>(self, addition: A) {
        let first = self.runs.first().map_or(0, |run| run.monomials.start);
        for run in self.runs {
            let place = run.monomials.start - first;
            let out = &mut self.out[place..place + run.monomials.len()];
            let reaches = |selection: Selection| selection.reaches(&run.monomials);
            if !self.selection.is_none_or(reaches) {
                if !matches!(self.finish, Finish::Add) {
                    out.fill(S::zero());
                }
                continue;
            }
            let terms = Terms {
                table: self.table,
                run,
                a: self.a.from(self.span.leaves_first()),
                b: self.b.from(self.span.leaves_last()),
                finish: self.finish,
            };
            addition.add(&terms, out);
        }
    }
}

/// A way to add to a run.
///
/// NOTE: not a closure, for these are not always inlined, and what is not is compiled for the least
/// machine.
trait Addition {
    fn add<S: Scalar>(&self, terms: &Terms<'_, S>, out: &mut [S]);
}

/// Any product, or the square of an element.
struct Any {
    square: bool,
}

impl Addition for Any {
    #[inline(always)]
    fn add<S: Scalar>(&self, terms: &Terms<'_, S>, out: &mut [S]) {
        match out.len() {
            1 => terms.add_some::<1>(self.square, out),
            2 => terms.add_some::<2>(self.square, out),
            3 => terms.add_some::<3>(self.square, out),
            4 => terms.add_some::<4>(self.square, out),
            5 => terms.add_some::<5>(self.square, out),
            6 => terms.add_some::<6>(self.square, out),
            7 => terms.add_some::<7>(self.square, out),
            LONGEST_IN_REGISTERS => terms.add_some::<LONGEST_IN_REGISTERS>(self.square, out),
            _ => terms.add_in_memory(self.square, out),
        }
    }
}

/// A product of elements that may differ from zero everywhere: all of it, all but the head of the
/// left one, or a square.
struct All<const WITHOUT_FIRST: bool, const SQUARE: bool>;

impl<const WITHOUT_FIRST: bool, const SQUARE: bool> Addition for All<WITHOUT_FIRST, SQUARE> {
    #[inline(always)]
    fn add<S: Scalar>(&self, terms: &Terms<'_, S>, out: &mut [S]) {
        match out.len() {
            1 => terms.add_all::<1, WITHOUT_FIRST, SQUARE>(out),
            2 => terms.add_all::<2, WITHOUT_FIRST, SQUARE>(out),
            3 => terms.add_all::<3, WITHOUT_FIRST, SQUARE>(out),
            4 => terms.add_all::<4, WITHOUT_FIRST, SQUARE>(out),
            5 => terms.add_all::<5, WITHOUT_FIRST, SQUARE>(out),
            6 => terms.add_all::<6, WITHOUT_FIRST, SQUARE>(out),
            7 => terms.add_all::<7, WITHOUT_FIRST, SQUARE>(out),
            LONGEST_IN_REGISTERS => {
                terms.add_all::<LONGEST_IN_REGISTERS, WITHOUT_FIRST, SQUARE>(out);
            }
            _ => terms.add_in_memory(SQUARE, out),
        }
    }
}

/// A product and the way to form it.
struct Formed<'a, S, A>(Convolution<'a, S>, A);

impl<S: Scalar, A: Addition> Kernel for Formed<'_, S, A> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.add(self.1);
    }
}
