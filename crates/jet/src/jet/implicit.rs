//! Implicit functions: roots of equations whose unknowns are jets, by Newton's method in the ring.
//!
//! One idea: Newton's step in a ring of jets doubles the number of correct degrees, as it doubles
//! the number of correct digits of a number. Starting from a root of the heads, `⌈log₂(order + 1)⌉`
//! steps give all degrees.

use super::{Jet, JetError, solve_linear};
use crate::numeric::Scalar;

/// Steps beyond the doublings of degree: for a start whose head is not yet a root, and for
/// rounding.
const EXTRA_STEPS: usize = 24;

/// The jet `t` with `f(t) = 0` near `start`; `f` gives the value and the derivative by `t`.
///
/// The head of `start` should be a root of the equation of heads, and is improved by the same steps
/// where it is only near one.
///
/// # Errors
///
/// [`JetError::Singular`] if the head of the derivative is 0 (in some lane),
/// [`JetError::NotFinite`] if a value is not finite, and [`JetError::NoConvergence`] if the steps
/// do not become small.
///
/// ```
/// use grazemap_jet::jet::{implicit_root, Jet, JetSpace};
/// let x = Jet::variable(&JetSpace::uniform(1, 4)?, 0, 0.0_f64);
/// // Lambert's function: w exp(w) = x.
/// let w = implicit_root(&x, |w| {
///     let exp = w.exp();
///     (&(w * &exp) - &x, &w.add_constant(1.0) * &exp)
/// })?;
/// let known = [0.0, 1.0, -1.0, 1.5, -8.0 / 3.0];
/// assert!(w.coefficients().iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-14));
/// # Ok::<(), grazemap_jet::jet::JetError>(())
/// ```
pub fn implicit_root<S: Scalar>(
    start: &Jet<S>,
    mut f: impl FnMut(&Jet<S>) -> (Jet<S>, Jet<S>),
) -> Result<Jet<S>, JetError> {
    let roots = implicit_roots(std::slice::from_ref(start), |roots| {
        let (value, derivative) = f(&roots[0]);
        (vec![value], vec![vec![derivative]])
    })?;
    Ok(roots.into_iter().next().expect("one start gives one root"))
}

/// The jets `t` with `f(t) = 0` near `start`; `f` gives the values and the rows of the Jacobian
/// matrix.
///
/// # Errors
///
/// As [`implicit_root`], and [`JetError::DimensionMismatch`] if `f` has not as many values as
/// unknowns.
pub fn implicit_roots<S: Scalar>(
    start: &[Jet<S>],
    mut f: impl FnMut(&[Jet<S>]) -> (Vec<Jet<S>>, Vec<Vec<Jet<S>>>),
) -> Result<Vec<Jet<S>>, JetError> {
    let mut roots = start.to_vec();
    let Some(first) = start.first() else {
        return Ok(roots);
    };
    let doublings = (first.space().order() + 1).next_power_of_two().ilog2() as usize;
    let mut last_change = f64::INFINITY;
    for step in 0..doublings + EXTRA_STEPS {
        let (values, jacobian) = f(&roots);
        if values.len() != roots.len() {
            return Err(JetError::DimensionMismatch {
                expected: roots.len(),
                found: values.len(),
            });
        }
        let changes = solve_linear(jacobian, values)?;
        roots
            .iter_mut()
            .zip(&changes)
            .for_each(|(root, change)| *root -= change);
        if !roots.iter().all(Jet::is_finite) {
            return Err(JetError::NotFinite { step });
        }
        let change = largest_change(&changes, &roots);
        // NOTE: rounding keeps the change above 0; it is done when small and no longer falling.
        let settled = change <= 4.0 * S::ROUNDOFF
            || (change < S::ROUNDOFF.sqrt() && change > 0.5 * last_change);
        if step + 1 >= doublings && settled {
            return Ok(roots);
        }
        last_change = change;
    }
    Err(JetError::NoConvergence {
        steps: doublings + EXTRA_STEPS,
        change: last_change,
    })
}

/// Largest change of a degree relative to that degree's largest coefficient so far, over all
/// unknowns.
fn largest_change<S: Scalar>(changes: &[Jet<S>], roots: &[Jet<S>]) -> f64 {
    let relative = |(change, root): (&Jet<S>, &Jet<S>)| {
        let mut scale = 0.0_f64;
        let degrees = 0..=change.space().order();
        let of_degree = degrees.map(|degree| {
            scale = scale.max(root.max_abs_of_degree(degree));
            let change = change.max_abs_of_degree(degree);
            if change == 0.0 { 0.0 } else { change / scale }
        });
        of_degree.fold(0.0, f64::max)
    };
    changes.iter().zip(roots).map(relative).fold(0.0, f64::max)
}
