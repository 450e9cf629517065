//! Newton's method with damped steps, for systems of equations.

use std::iter;

/// How a search by [`damped_newton`] ended, with the last iterate.
#[derive(Clone, Debug, PartialEq)]
pub enum NewtonOutcome<P, T, E> {
    /// At a root.
    Root(P),
    /// At an iterate that has no step, after so many steps.
    NoStep {
        /// The iterate.
        at: P,
        /// Why it has none.
        reason: E,
        /// Steps made.
        steps: usize,
    },
    /// At an iterate from which no share of the step leads nearer to a root.
    NotNearer {
        /// The iterate.
        at: P,
        /// The step.
        step: T,
    },
    /// After the most steps allowed.
    StepLimit(P),
}

/// Newton's method from an iterate, each step halved until it leads nearer to a root.
///
/// `step` gives Newton's step at an iterate. `moved` gives the iterate a share (1, 1/2, 1/4, …) of
/// a step away if that is nearer to a root by enough, and `is_root` says of an iterate and of the
/// step that led there whether the search ends.
///
/// ```
/// use grazemap_jet::numeric::{NewtonOutcome, damped_newton};
/// // Without damping the method diverges on the arc tangent from here.
/// let outcome = damped_newton(
///     3.0_f64,
///     [20, 10],
///     |x| Ok::<_, ()>(x.atan() * (1.0 + x * x)),
///     |x, step, share| Some(x - share * step).filter(|next| next.abs() < x.abs()),
///     |x, _| x.abs() < 1e-12,
/// );
/// assert!(matches!(outcome, NewtonOutcome::Root(_)));
/// ```
pub fn damped_newton<P, T, E>(
    start: P,
    [most_steps, most_halvings]: [usize; 2],
    mut step: impl FnMut(&P) -> Result<T, E>,
    mut moved: impl FnMut(&P, &T, f64) -> Option<P>,
    mut is_root: impl FnMut(&P, &T) -> bool,
) -> NewtonOutcome<P, T, E> {
    let mut at = start;
    for steps in 0..most_steps {
        let step = match step(&at) {
            Ok(step) => step,
            Err(reason) => return NewtonOutcome::NoStep { at, reason, steps },
        };
        let shares = iter::successors(Some(1.0), |share| Some(0.5 * share));
        let mut shares = shares.take(most_halvings + 1);
        let Some(next) = shares.find_map(|share| moved(&at, &step, share)) else {
            return NewtonOutcome::NotNearer { at, step };
        };
        at = next;
        if is_root(&at, &step) {
            return NewtonOutcome::Root(at);
        }
    }
    NewtonOutcome::StepLimit(at)
}
