//! Orbits from a saddle back to it, as solutions of as many equations as unknowns.
//!
//! One idea: an orbit on both manifolds of a saddle leaves it along the unstable direction and
//! returns along the stable one. All its section points are linked by returns, and the first and
//! the last satisfy one linear condition each. Where the manifolds are tangent, the equations are
//! singular; where they touch at a corner, the image of a graze, a depth variable is 0. Loci of
//! periodic orbits have the same two conditions. Reference: `BeynKleinkauf1997`.

use nalgebra::{DMatrix, DVector};

use super::equations::{OrbitEquations, Unfolding};
use crate::analysis::periodic::{PrescribedReturn, PrescribedReturns};
use crate::continuation::{ContinuationPoint, CurveEquations, Linearised, TestValue};
use crate::numeric::Real;
use crate::numeric::linear::inverse;

/// A saddle of two coordinates with one unstable multiplier, and an orbit from it back to it:
///
/// ```text
/// P(s_k) = s_{k+1}, s_n = s_0;    P(x_k) = x_{k+1};    x_0 − s_0 ∥ v,    ℓ (P(x_N) − s_e) = 0
/// ```
///
/// where `v` is the unstable direction at `s_0` and `ℓ` the left eigenvector at `s_e`. The error of
/// the linear conditions is of second order in the distances of both ends from the saddle.
#[derive(Clone, Debug)]
pub(super) struct Connection<R> {
    pub(super) returns: R,
    /// Number of returns of the saddle, which come first.
    pub(super) period: usize,
}

/// Data of a connection beside its equations.
#[derive(Clone, Debug)]
pub(super) struct ConnectionPoints<S> {
    /// All returns, the saddle's first.
    pub(super) returns: Vec<PrescribedReturn<S>>,
    /// Unstable multiplier.
    pub(super) multiplier: S,
}

/// Unstable direction of a saddle and the left eigenvector, with `left · right = 1`.
pub(super) struct Unstable<S> {
    pub(super) multiplier: S,
    pub(super) right: [S; 2],
    pub(super) left: [S; 2],
}

impl<S: Real> Unstable<S> {
    /// Eigenvectors of a 2 × 2 matrix for its largest multiplier; `None` if that is not real.
    pub(super) fn of(matrix: &DMatrix<S>) -> Option<Self> {
        let [a, b, c, d] = [matrix[(0, 0)], matrix[(0, 1)], matrix[(1, 0)], matrix[(1, 1)]];
        let half = S::from_f64(0.5) * (a + d);
        let root = (half * half - (a * d - b * c)).sqrt();
        let multiplier = if half < S::zero() { half - root } else { half + root };
        if !multiplier.is_finite() {
            return None;
        }
        // Both rows have the same kernel; the larger row gives it more accurately.
        let larger = |x: [S; 2], y: [S; 2]| {
            let size = |v: [S; 2]| v[0].magnitude().max(v[1].magnitude());
            if size(x) >= size(y) { x } else { y }
        };
        let right = larger([b, multiplier - a], [multiplier - d, c]);
        let left = larger([c, multiplier - a], [multiplier - d, b]);
        let length = (right[0] * right[0] + right[1] * right[1]).sqrt();
        let right = right.map(|value| value / length);
        let product = left[0] * right[0] + left[1] * right[1];
        let left = left.map(|value| value / product);
        let finite = right.iter().chain(&left).all(|value| value.is_finite());
        finite.then_some(Self { multiplier, right, left })
    }

    /// `ℓ · x`.
    pub(super) fn along(&self, vector: [S; 2]) -> S {
        self.left[0] * vector[0] + self.left[1] * vector[1]
    }
}

/// Jacobian of a return by its section point.
pub(super) fn jacobian<S: Real>(
    flown: &PrescribedReturn<S>,
    dimension: usize,
) -> Option<DMatrix<S>> {
    let (d, own) = (dimension, dimension + flown.lacking.len());
    let mut constraint = flown.slopes.view((0, 0), (own, own)).into_owned();
    constraint
        .view_mut((d, 0), (own - d, own))
        .copy_from(&flown.slopes.view((2 * d, 0), (own - d, own)));
    let by_point = inverse(&constraint).ok()?.columns(0, d).into_owned();
    Some(flown.slopes.view((d, 0), (d, own)) * by_point)
}

/// Term of a residual: a share of a component of a return. Components are the section point, then
/// its image, then the depth residuals.
struct Term<S> {
    row: usize,
    share: S,
    number: usize,
    part: usize,
}

/// Conditions at both ends.
pub(super) struct Ends<S> {
    /// Unstable multiplier.
    pub(super) multiplier: S,
    /// Normal to the unstable direction at the saddle's first point.
    across: [S; 2],
    /// Left eigenvector at the saddle's point that the last image is compared with.
    left: [S; 2],
}

impl Ends<f64> {
    /// Conditions converted to another number type.
    pub(super) fn converted<S: Real>(&self) -> Ends<S> {
        Ends {
            multiplier: S::from_f64(self.multiplier),
            across: self.across.map(S::from_f64),
            left: self.left.map(S::from_f64),
        }
    }
}

impl<R> Connection<R> {
    /// Conditions at both ends of a connection.
    pub(super) fn ends<S: Real>(&self, flown: &[PrescribedReturn<S>]) -> Option<Ends<S>> {
        let n = self.period;
        let from = Self::unstable(&flown[..n], 0)?;
        let to = Self::unstable(&flown[..n], (flown.len() - n) % n)?;
        let across = [-from.right[1], from.right[0]];
        Some(Ends { multiplier: from.multiplier, across, left: to.left })
    }

    /// All terms of the residuals; `lacking` has the number of depth residuals of each return.
    fn terms<S: Real>(&self, d: usize, lacking: &[usize], ends: &Ends<S>) -> Vec<Term<S>> {
        let (n, last) = (self.period, lacking.len() - 1);
        let end = (last + 1 - n) % n;
        let (plus, minus) = (S::one(), -S::one());
        let (mut terms, mut row) = (Vec::new(), 0);
        for (number, &contacts) in lacking.iter().enumerate() {
            for part in 0..contacts {
                terms.push(Term { row, share: plus, number, part: 2 * d + part });
                row += 1;
            }
            let next = match number {
                _ if number + 1 == n => 0,
                _ if number == last => continue,
                _ => number + 1,
            };
            for part in 0..d {
                terms.push(Term { row, share: plus, number, part: d + part });
                terms.push(Term { row, share: minus, number: next, part });
                row += 1;
            }
        }
        for part in 0..d {
            let (across, left) = (ends.across[part], ends.left[part]);
            terms.push(Term { row, share: across, number: n, part });
            terms.push(Term { row, share: -across, number: 0, part });
            terms.push(Term { row: row + 1, share: left, number: last, part: d + part });
            terms.push(Term { row: row + 1, share: -left, number: end, part });
        }
        terms
    }

    /// Residuals of returns, without slopes.
    pub(super) fn residual<S: Real>(
        &self,
        flown: &[PrescribedReturn<S>],
        ends: &Ends<S>,
    ) -> DVector<S> {
        let d = flown[0].point.len();
        let lacking: Vec<usize> = flown.iter().map(|one| one.lacking.len()).collect();
        let terms = self.terms(d, &lacking, ends);
        let rows = terms.iter().map(|term| term.row + 1).max().unwrap_or(0);
        let mut residual = DVector::from_element(rows, S::zero());
        for Term { row, share, number, part } in terms {
            residual[row] += share * flown[number].value(part);
        }
        residual
    }

    /// Multiplier and directions of the saddle at one of its points.
    fn unstable<S: Real>(returns: &[PrescribedReturn<S>], from: usize) -> Option<Unstable<S>> {
        let n = returns.len();
        let mut product = jacobian(&returns[from % n], 2)?;
        for later in 1..n {
            product = jacobian(&returns[(from + later) % n], 2)? * product;
        }
        Unstable::of(&product)
    }

    /// Index of the first unknown of a return.
    pub(super) fn first<S: Real>(&self, number: usize) -> usize
    where
        R: PrescribedReturns<S>,
    {
        (0..number).map(|before| self.returns.variables(before)).sum()
    }
}

impl<S: Real, R: PrescribedReturns<S>> CurveEquations<S> for Connection<R> {
    type Extra = ConnectionPoints<S>;

    fn linearised(&mut self, unknowns: &[S]) -> Option<Linearised<S, Self::Extra>> {
        let (d, size) = (self.returns.dimension(), unknowns.len());
        let mut firsts = Vec::new();
        let mut flown = Vec::new();
        let mut first = 0;
        for number in 0..self.returns.returns() {
            firsts.push(first);
            flown.push(self.returns.at(number, first, unknowns)?);
            first += self.returns.variables(number);
        }
        let ends = self.ends(&flown)?;
        let rows = size - 2;
        let mut residual = DVector::from_element(rows, S::zero());
        let mut jacobian = DMatrix::from_element(rows, size, S::zero());
        let lacking: Vec<usize> = flown.iter().map(|one| one.lacking.len()).collect();
        for Term { row, share, number, part } in self.terms(d, &lacking, &ends) {
            let one: &PrescribedReturn<S> = &flown[number];
            residual[row] += share * one.value(part);
            let own = one.slopes.ncols() - 2;
            for column in 0..own + 2 {
                let place = match column < own {
                    true => firsts[number] + column,
                    false => rows + column - own,
                };
                jacobian[(row, place)] += share * one.slopes[(part, column)];
            }
        }
        let finite = residual.iter().chain(jacobian.iter()).all(|value| value.is_finite());
        let extra = ConnectionPoints { returns: flown, multiplier: ends.multiplier };
        finite.then_some(Linearised { residual, jacobian, extra })
    }

    /// Returns none: the condition with which a connection is followed has the test functions.
    fn tests(&self, _: &ContinuationPoint<S, Self::Extra>) -> Vec<TestValue<S>> {
        Vec::new()
    }

    fn range(&self, unknown: usize) -> [f64; 2] {
        let mut first = 0;
        for number in 0..self.returns.returns() {
            let own = self.returns.variables(number);
            if unknown < first + own {
                return self.returns.range(number, unknown - first);
            }
            first += own;
        }
        self.returns.parameter_range(unknown - first)
    }
}

impl<S: Real, R: PrescribedReturns<S>> OrbitEquations<S> for Connection<R> {
    fn closes(&self) -> bool {
        false
    }

    fn first_point(&self, there: &Linearised<S, Self::Extra>) -> DMatrix<S> {
        let (rows, columns) = there.jacobian.shape();
        DMatrix::from_element(rows, columns, S::zero())
    }

    fn count(&self) -> usize {
        self.first(self.returns.returns()) + 2
    }

    fn depth_variables(&self) -> Vec<usize> {
        let returns = 0..self.returns.returns();
        let places = returns.flat_map(|number| {
            let first = self.first(number);
            let own = self.returns.depth_variables(number).into_iter();
            own.map(move |(_, place)| first + place).collect::<Vec<_>>()
        });
        places.collect()
    }

    fn grazes(&self, unknowns: &[S], extra: &Self::Extra) -> Vec<(Option<usize>, S)> {
        let depths = self.depth_variables().into_iter().enumerate();
        let depths = depths.map(|(contact, place)| (Some(contact), unknowns[place]));
        let free = extra.returns.iter().flat_map(|flown| flown.free.iter());
        depths.chain(free.map(|&depth| (None, depth))).collect()
    }

    fn without(
        &mut self,
        _: &[S],
        _: &Linearised<S, Self::Extra>,
        _: usize,
    ) -> Option<[DMatrix<S>; 2]> {
        None
    }

    fn unfolding(&mut self, _: &[S], _: &Linearised<S, Self::Extra>) -> Option<Unfolding<S>> {
        None
    }

    fn rounding() -> f64 {
        R::rounding()
    }
}
