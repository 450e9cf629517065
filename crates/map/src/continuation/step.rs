//! Points of a curve: corrector, tangent, and zeros of test functions between two points.

use nalgebra::{DMatrix, DVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::vectors::{largest, moved, norm, unit_vector};
use super::{CurveEquations, Linearised, TestValue};
use crate::numeric::linear::{factorize, inverse, solve};
use crate::numeric::{Bracket, NewtonOutcome, NumericError, Real, damped_newton};

/// A point of a curve.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound(
    serialize = "S: Real + Serialize + DeserializeOwned, X: Serialize",
    deserialize = "S: Real + Serialize + DeserializeOwned, X: Deserialize<'de>"
))]
pub struct ContinuationPoint<S, X = ()> {
    /// Unknowns at the point.
    pub unknowns: Vec<S>,
    /// Unit tangent.
    pub tangent: Vec<S>,
    /// Residuals and derivatives.
    pub linearised: Linearised<S, X>,
    /// Values of the test functions.
    pub tests: Vec<TestValue<S>>,
}

/// Unknowns that solve the equations, with the residuals and derivatives there.
pub type Solution<S, X> = (Vec<S>, Linearised<S, X>);

/// Lengths of steps, in units of the scaled unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepControl {
    /// First step.
    pub first: f64,
    /// Longest step.
    pub longest: f64,
    /// Shortest step.
    pub shortest: f64,
    /// Largest number of steps.
    pub most: usize,
    /// Most consecutive steps in which the zeros of test functions are not all known, even with the
    /// shortest step.
    pub unresolved: usize,
    /// Size of an unknown beyond which the longest step grows in proportion to it, if it does.
    pub far: Option<f64>,
}

impl StepControl {
    /// Step lengths that suit most curves.
    pub const DEFAULT: Self =
        Self { first: 0.02, longest: 0.4, shortest: 1e-9, most: 400, unresolved: 400, far: None };

    /// Longest step from a point.
    pub(super) fn longest_at<S: Real>(&self, unknowns: &[S]) -> f64 {
        match self.far {
            Some(far) => self.longest * largest(unknowns).max(far) / far,
            None => self.longest,
        }
    }
}

/// Most Newton steps of a corrector.
const STEPS: usize = 8;
/// Most steps with one Jacobian for all.
const CHORDS: usize = 60;
/// Largest residual after the last step of a convergent iteration, in lengths of that step along
/// the steepest equation.
const LEFT: f64 = 16.0;
/// Least ratio of successive steps, below the root of the roundoff, that counts as stalled.
const STALLED: f64 = 0.25;

/// Solution on the plane through `origin` normal to `normal`, by Newton's method from a start near
/// it; `None` if it does not converge.
///
/// Iteration ends at a step below `ε^(3/4)`, or when steps of the size of rounding no longer
/// shrink.
pub fn corrected<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    start: &[S],
    origin: &[S],
    normal: &[S],
) -> Option<Solution<S, C::Extra>> {
    let mut unknowns = start.to_vec();
    let mut last = f64::INFINITY;
    for _ in 0..STEPS {
        let here = curve.linearised(&unknowns)?;
        let size = unknowns.len();
        let matrix = bordered(&here.jacobian, normal);
        let mut right = DVector::from_element(size, S::zero());
        for (row, &value) in here.residual.iter().enumerate() {
            right[row] = -value;
        }
        right[size - 1] = -offset(&unknowns, origin, normal);
        let step = solve(&matrix, &right).ok()?;
        let length = largest(&step);
        if !length.is_finite() || (length > 2.0 * last && length > S::ROUNDOFF.sqrt()) {
            return None;
        }
        for (value, &change) in unknowns.iter_mut().zip(step.iter()) {
            *value += change;
        }
        let converged = length <= S::ROUNDOFF.powf(0.75);
        let stalled = length >= STALLED * last && length <= S::ROUNDOFF.sqrt();
        if converged || stalled {
            return solved(curve, unknowns, converged);
        }
        last = length;
    }
    None
}

/// Solution on the plane through `unknowns` normal to `normal`, by Newton steps with one given
/// Jacobian: for points without derivatives of their own. `residual` returns additional data, which
/// is returned with the last residual.
pub fn by_chords<S: Real, X>(
    jacobian: &DMatrix<S>,
    normal: &[S],
    mut unknowns: Vec<S>,
    mut residual: impl FnMut(&[S]) -> Option<(X, DVector<S>)>,
) -> Option<(Vec<S>, X, DVector<S>)> {
    let inverse = inverse(&bordered(jacobian, normal)).ok()?;
    let size = unknowns.len();
    let mut last = f64::INFINITY;
    for _ in 0..CHORDS {
        let (found, lacking) = residual(&unknowns)?;
        let right = lacking.iter().copied().chain([S::zero()]);
        let step = &inverse * DVector::from_iterator(size, right);
        let length = largest(&step);
        let stalled = length >= STALLED * last && length <= S::ROUNDOFF.sqrt();
        if length <= S::ROUNDOFF.powf(0.9) || stalled {
            return Some((unknowns, found, lacking));
        }
        if !length.is_finite() || length >= last {
            return None;
        }
        unknowns.iter_mut().zip(step.iter()).for_each(|(value, &change)| *value -= change);
        last = length;
    }
    None
}

/// Solution at unknowns at which steps converged or stalled; `None` for a large residual.
///
/// NOTE: a last step next to a graze may lead across it, to where the equations are others: it
/// converged on its own side alone.
fn solved<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    unknowns: Vec<S>,
    converged: bool,
) -> Option<Solution<S, C::Extra>> {
    let there = curve.linearised(&unknowns)?;
    // Steps stall at the rounding of the residual, or where the residual is not smooth.
    let most = match converged {
        true => S::ROUNDOFF.powf(0.65) + LEFT * S::ROUNDOFF.powf(0.75) * largest(&there.jacobian),
        false => S::ROUNDOFF.sqrt(),
    };
    (largest(&there.residual) <= most).then_some((unknowns, there))
}

/// Largest ratio of successive steps with a Jacobian from another point.
const SHRINKING: f64 = 0.1;

/// Solution as by [`corrected`], with a Jacobian from near the solution, so that steps need
/// residuals only. Falls back to Newton's method if steps do not shrink fast.
fn corrected_with<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    start: &[S],
    origin: &[S],
    normal: &[S],
    jacobian: &DMatrix<S>,
) -> Option<Solution<S, C::Extra>> {
    let mut unknowns = start.to_vec();
    let factors = factorize(&bordered(jacobian, normal)).ok();
    let mut last = f64::INFINITY;
    while let Some(residual) = factors.as_ref().and_then(|_| curve.residual(&unknowns)) {
        let right = residual.insert_row(unknowns.len() - 1, offset(&unknowns, origin, normal));
        let step = factors.as_ref()?.solve(&-right).ok()?;
        let length = largest(&step);
        let converged = length <= S::ROUNDOFF.powf(0.75);
        let shrinks = length <= SHRINKING * last;
        // Slow steps may be rounding or a Jacobian that is no longer right: Newton's method tells.
        if !converged && !shrinks {
            break;
        }
        for (value, &change) in unknowns.iter_mut().zip(step.iter()) {
            *value += change;
        }
        if converged {
            return solved(curve, unknowns, true);
        }
        last = length;
    }
    curve.solution(start, [origin, normal])
}

/// Signed distance of a point from the plane through `origin` normal to `normal`.
fn offset<S: Real>(unknowns: &[S], origin: &[S], normal: &[S]) -> S {
    let pairs = unknowns.iter().zip(origin).zip(normal);
    pairs.map(|((&u, &o), &n)| (u - o) * n).sum()
}

/// Most Newton steps of a search, and most halvings of each.
const SEARCHED: [usize; 2] = [40, 12];

/// Solution with one unknown held fixed, by damped Newton steps from a start that may be far;
/// `None` if they do not converge.
pub fn searched<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    start: &[S],
    held: usize,
) -> Option<Solution<S, C::Extra>> {
    let size = |here: &Linearised<S, C::Extra>| largest(&here.residual);
    let normal = unit_vector(start.len(), held);
    let here = curve.linearised(start)?;
    let mut last = f64::INFINITY;
    let outcome = damped_newton(
        (start.to_vec(), here),
        SEARCHED,
        |(_, here)| {
            let mut right = here.residual.clone().insert_row(start.len() - 1, S::zero());
            right.iter_mut().for_each(|value| *value = -*value);
            let step = solve(&bordered(&here.jacobian, &normal), &right)?;
            let length = largest(&step);
            Ok::<_, NumericError>((step, length))
        },
        |(unknowns, here), (step, length), share| {
            let share = S::from_f64(share);
            let next = moved(unknowns, step.as_slice(), share);
            let there = curve.linearised(&next)?;
            let nearer = *length <= S::ROUNDOFF.sqrt() || size(&there) < size(here);
            nearer.then_some((next, there))
        },
        |_, &(_, length)| {
            let stalled = length >= STALLED * last && length <= S::ROUNDOFF.sqrt();
            last = length;
            length <= S::ROUNDOFF.powf(0.75) || stalled
        },
    );
    match outcome {
        // Steps stall at the rounding of the residual, or where the residual is not smooth.
        NewtonOutcome::Root(found) if size(&found.1) <= S::ROUNDOFF.sqrt() => Some(found),
        _ => None,
    }
}

/// Unit tangent with a positive component along `along`; `None` if it is not determined.
pub fn tangent_at<S: Real>(jacobian: &DMatrix<S>, along: &[S]) -> Option<Vec<S>> {
    let size = along.len();
    let mut right = DVector::from_element(size, S::zero());
    right[size - 1] = S::one();
    let direction = factorize(&bordered(jacobian, along)).ok()?.solve(&right).ok()?;
    let length = norm(direction.as_slice());
    let unit: Vec<S> = direction.iter().map(|&value| value / length).collect();
    unit.iter().all(|value| value.is_finite()).then_some(unit)
}

/// Unit tangent along which the last unknown grows, or if that is impossible the one before it, and
/// so on.
pub(crate) fn any_tangent(jacobian: &DMatrix<f64>) -> Option<Vec<f64>> {
    let size = jacobian.ncols();
    (0..size).rev().find_map(|place| tangent_at(jacobian, &unit_vector(size, place)))
}

/// Jacobian of a curve with another row.
pub(crate) fn bordered<S: Real>(jacobian: &DMatrix<S>, row: &[S]) -> DMatrix<S> {
    let size = row.len();
    DMatrix::from_fn(size, size, |i, j| if i + 1 < size { jacobian[(i, j)] } else { row[j] })
}

/// Point of the curve on the plane through `origin` normal to `normal`, with its tangent on the
/// side of `along`.
pub(crate) fn point_on<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    start: &[S],
    plane: [&[S]; 2],
    along: &[S],
) -> Option<ContinuationPoint<S, C::Extra>> {
    let found = curve.solution(start, plane)?;
    point_of(curve, found, along)
}

/// Completes a solution to a point of the curve.
fn point_of<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    (unknowns, linearised): Solution<S, C::Extra>,
    along: &[S],
) -> Option<ContinuationPoint<S, C::Extra>> {
    let tangent = tangent_at(&linearised.jacobian, along)?;
    let mut point = ContinuationPoint { unknowns, tangent, linearised, tests: Vec::new() };
    if !curve.complete(&mut point) {
        return None;
    }
    point.tests = curve.tests(&point);
    let finite = point.tests.iter().all(|test| test.value.is_finite());
    finite.then_some(point)
}

/// Chord between two points of a curve, used with planes normal to it.
pub(super) struct Chord<'a, S, X> {
    ends: [&'a ContinuationPoint<S, X>; 2],
    length: S,
    normal: Vec<S>,
}

impl<'a, S: Real, X: Clone> Chord<'a, S, X> {
    pub(super) fn new(ends: [&'a ContinuationPoint<S, X>; 2]) -> Option<Self> {
        let pairs = ends[1].unknowns.iter().zip(&ends[0].unknowns);
        let chord: Vec<S> = pairs.map(|(&b, &a)| b - a).collect();
        let length = norm(&chord);
        let normal = chord.iter().map(|&value| value / length).collect();
        (length > S::zero()).then_some(Self { ends, length, normal })
    }

    /// Fraction of the chord at which the normal plane through a point lies.
    pub(super) fn share_of(&self, unknowns: &[S]) -> S {
        let pairs = unknowns.iter().zip(&self.ends[0].unknowns).zip(&self.normal);
        pairs.map(|((&u, &a), &n)| (u - a) * n).sum::<S>() / self.length
    }

    /// Solution on the normal plane at a fraction of the chord; the start is the cubic with the
    /// tangents at the ends.
    fn solution<C: CurveEquations<S, Extra = X> + ?Sized>(
        &self,
        curve: &mut C,
        share: S,
    ) -> Option<Solution<S, X>> {
        let rest = S::one() - share;
        let [a, b] = self.ends;
        let pairs = a.unknowns.iter().zip(&b.unknowns);
        let origin: Vec<S> = pairs.map(|(&a, &b)| a + share * (b - a)).collect();
        let tangents = a.tangent.iter().zip(&b.tangent).zip(&self.normal);
        let bend = tangents.map(|((&a, &b), &normal)| {
            self.length * share * rest * (rest * (a - normal) - share * (b - normal))
        });
        let start: Vec<S> = origin.iter().zip(bend).map(|(&origin, bend)| origin + bend).collect();
        let jacobian = &a.linearised.jacobian * rest + &b.linearised.jacobian * share;
        corrected_with(curve, &start, &origin, &self.normal, &jacobian)
    }

    /// Point of the curve on the normal plane at a fraction of the chord.
    pub(super) fn point<C: CurveEquations<S, Extra = X> + ?Sized>(
        &self,
        curve: &mut C,
        share: S,
    ) -> Option<ContinuationPoint<S, X>> {
        let found = self.solution(curve, share)?;
        point_of(curve, found, &self.ends[0].tangent)
    }

    /// Zero of a function with these values at the ends, to rounding: what `found` gives at the
    /// fraction of the chord with the smallest value; `None` if the values have one sign.
    fn zero<T>(&self, values: [S; 2], mut found: impl FnMut(S) -> Option<(S, T)>) -> Option<T> {
        let bracket = Bracket::new(S::zero(), S::one(), values[0], values[1]).ok()?;
        let mut best: Option<(f64, T)> = None;
        let tolerance = S::from_f64(0.5 * S::ROUNDOFF) / self.length;
        bracket.itp((values[0], values[1]), tolerance, |share| {
            let Some((value, there)) = found(share) else {
                return S::from_f64(f64::NAN);
            };
            if best.as_ref().is_none_or(|(least, _)| value.magnitude() < *least) {
                best = Some((value.magnitude(), there));
            }
            value
        });
        best.map(|(_, there)| there)
    }
}

/// Zero of a function of points between two points of a curve, to rounding; `None` if the function
/// has the same sign at both or no curve is found in between.
pub fn zero_between<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    ends: [&ContinuationPoint<S, C::Extra>; 2],
    value: impl Fn(&ContinuationPoint<S, C::Extra>) -> S,
) -> Option<ContinuationPoint<S, C::Extra>> {
    let values = [value(ends[0]), value(ends[1])];
    if values[1] == S::zero() {
        return Some(ends[1].clone());
    }
    let chord = Chord::new(ends)?;
    chord.zero(values, |share| {
        let point = chord.point(curve, share)?;
        Some((value(&point), point))
    })
}

/// Zero as by [`zero_between`], of a function of unknowns that need not have a point of the curve:
/// what `value` gives there beside the value.
pub(crate) fn zero_on_chord<S: Real, C: CurveEquations<S> + ?Sized, T>(
    curve: &mut C,
    ends: [&ContinuationPoint<S, C::Extra>; 2],
    values: [S; 2],
    value: impl Fn(&mut C, &[S]) -> Option<(S, T)>,
) -> Option<(S, T)> {
    let chord = Chord::new(ends)?;
    chord.zero(values, |share| {
        let (unknowns, _) = chord.solution(curve, share)?;
        let (value, there) = value(curve, &unknowns)?;
        Some((value, (value, there)))
    })
}

/// Most secant steps to a zero.
const SECANTS: usize = 12;

/// Zero of a function of points near a point of a curve, by secant steps along its tangent, to
/// rounding: refines a zero found in `f64` in double-double.
pub fn zero_near<S: Real, C: CurveEquations<S> + ?Sized>(
    curve: &mut C,
    unknowns: &[S],
    tangent: &[S],
    value: impl Fn(&ContinuationPoint<S, C::Extra>) -> S,
) -> Option<ContinuationPoint<S, C::Extra>> {
    let mut at = |along: S| {
        let origin = moved(unknowns, tangent, along);
        let point = point_on(curve, &origin, [&origin, tangent], tangent)?;
        let found = value(&point);
        Some((along, found, point))
    };
    let (mut before, mut here) = (at(S::zero())?, at(S::from_f64(f64::EPSILON.sqrt()))?);
    if before.1.magnitude() < here.1.magnitude() {
        std::mem::swap(&mut before, &mut here);
    }
    for _ in 0..SECANTS {
        let slope = (here.1 - before.1) / (here.0 - before.0);
        let step = here.1 / slope;
        if here.1 == S::zero() || !step.is_finite() {
            break;
        }
        let next = at(here.0 - step)?;
        let nearer = next.1.magnitude() < here.1.magnitude();
        if !nearer {
            break;
        }
        before = std::mem::replace(&mut here, next);
    }
    Some(here.2)
}
