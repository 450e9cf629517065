//! Method of Gragg, Bulirsch and Stoer: the explicit midpoint rule, extrapolated to step length
//! zero. It needs no table of coefficients, and works in any precision.

use super::number::{Function, Number};

/// Largest number of times that steps are halved before an integration fails.
const HALVINGS: usize = 40;

/// Flow, given by its rates at a state.
pub(super) struct Flow<'a, N> {
    /// Function that writes the rates at a state.
    pub(super) rates: &'a dyn Fn(&[N], &mut [N]),
}

impl<N: Number> Flow<'_, N> {
    /// State after a time, by as many steps as necessary; `None` if it is not finite.
    pub(super) fn after(&self, state: &[N], time: N) -> Option<Vec<N>> {
        self.halved(state, time, HALVINGS)
    }

    fn halved(&self, state: &[N], time: N, halvings: usize) -> Option<Vec<N>> {
        if let Some(found) = self.step(state, time) {
            return Some(found);
        }
        let half = time / N::of(2.0);
        let middle = self.halved(state, half, halvings.checked_sub(1)?)?;
        self.halved(&middle, time - half, halvings - 1)
    }

    /// State after one step; `None` if the extrapolation does not converge.
    pub(super) fn step(&self, state: &[N], time: N) -> Option<Vec<N>> {
        if time.double() == 0.0 {
            return Some(state.to_vec());
        }
        let mut first = vec![N::zero(); state.len()];
        (self.rates)(state, &mut first);
        let mut row: Vec<Vec<N>> = Vec::new();
        for column in 0..N::COLUMNS {
            let mut next = vec![self.midpoint(state, &first, time, 2 * (column + 1))];
            for (lower, before) in row.iter().enumerate() {
                let divisor = N::of((column + 1) as f64) / N::of((column - lower) as f64);
                let divisor = divisor * divisor - N::of(1.0);
                let known = &next[lower];
                let better =
                    known.iter().zip(before).map(|(&a, &b)| a + (a - b) / divisor).collect();
                next.push(better);
            }
            if column > 0 && self.is_settled(state, &next[column], &next[column - 1]) {
                let moved = state.iter().zip(&next[column]).map(|(&x, &d)| x + d).collect();
                return Some(moved);
            }
            row = next;
        }
        None
    }

    fn is_settled(&self, state: &[N], last: &[N], before: &[N]) -> bool {
        state.iter().zip(last.iter().zip(before)).all(|(x, (&a, &b))| {
            let size = x.size().max(a.size()).max(1e-3);
            (a - b).size() <= 8.0 * N::EPSILON * size
        })
    }

    /// Displacement after a number of substeps of the midpoint rule.
    fn midpoint(&self, state: &[N], first: &[N], time: N, substeps: usize) -> Vec<N> {
        let length = time / N::of(substeps as f64);
        let double = length + length;
        let mut before = vec![N::zero(); state.len()];
        let mut now: Vec<N> = first.iter().map(|&rate| length * rate).collect();
        let (mut at, mut slopes) = (state.to_vec(), first.to_vec());
        for _ in 1..substeps {
            for ((at, &x), &d) in at.iter_mut().zip(state).zip(&now) {
                *at = x + d;
            }
            (self.rates)(&at, &mut slopes);
            for ((before, now), slope) in before.iter_mut().zip(&mut now).zip(&slopes) {
                let next = *before + double * *slope;
                *before = *now;
                *now = next;
            }
        }
        now
    }
}

/// Zero of a function between two points of opposite sign, by Ridders' method.
pub(super) fn zero<N: Number>(
    mut function: impl FnMut(N) -> Option<N>,
    (mut a, mut at_a): (N, N),
    (mut b, mut at_b): (N, N),
) -> Option<N> {
    let width = (b - a).size();
    let half = N::of(0.5);
    for _ in 0..200 {
        if at_a.double() == 0.0 || (b - a).size() <= 2.0 * N::EPSILON * width {
            return Some(a);
        }
        let middle = (a + b) * half;
        let at_middle = function(middle)?;
        let root = (at_middle * at_middle - at_a * at_b).apply(Function::Sqrt);
        let share = if root.double() > 0.0 { at_middle / root } else { N::zero() };
        let turn = if (at_a - at_b).is_negative() { -share } else { share };
        let c = middle + (middle - a) * turn;
        let at_c = function(c)?;
        // The four places, of which two neighbours hold the zero.
        let mut places = [(a, at_a), (middle, at_middle), (c, at_c), (b, at_b)];
        let falls = (b - a).is_negative();
        if (places[2].0 - places[1].0).is_negative() != falls {
            places.swap(1, 2);
        }
        let before = (b - a).size();
        let pair = places.windows(2).find(|pair| {
            pair[0].1.is_negative() != pair[1].1.is_negative() || pair[0].1.double() == 0.0
        })?;
        (a, at_a) = pair[0];
        (b, at_b) = pair[1];
        // Rounding alone is left where the brackets stop shrinking.
        if (b - a).size() >= before {
            return Some(a);
        }
    }
    Some(a)
}
