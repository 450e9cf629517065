//! The impulse of a damper, taken out of a contact law where it is zero at the release.
//!
//! A force `b h'` adds `O(y²)` on the way in and takes it back on the way out: nothing of it is
//! left where the contact ends on the surface, and a spring's `O(y³)` is all there is. As a
//! difference of its own terms that kick has lost a share `1/y` of its digits, and an error in the
//! time of the release counts as much again.
//!
//! With `ρ` the release function, a multiple `c` of the gap along the free flow, let
//!
//! ```text
//! u = z − β (ρ(x_f) + r·z),   β = b/c
//! ```
//!
//! It is `z` at the entry and at the release, where the parenthesis vanishes, and obeys a law of
//! the same form without `b h'`: with `r·β = 0`,
//!
//! ```text
//! u' = (I − β rᵀ) A (I + β rᵀ) u + (I − β rᵀ) A β c h + c_0 + a h,   release where ρ(x_f) + r·u = 0.
//! ```

use num_traits::Zero;

use super::contact::{Drive, LinearLaw};
use super::smooth::{VANISHING, rounded_away};
use crate::numeric::{Dd, Scalar};

impl LinearLaw<Dd> {
    /// The law of `u`; the law itself where it has no such force or its release is another function
    /// than the gap.
    pub(super) fn without_passing_impulse(mut self) -> Self {
        let Some(share) = self.passing_share() else {
            return self;
        };
        let row = self.release_row.clone();
        let onto_release = columns(&self.matrix).map(|column| dot(&row, &column));
        let onto_release: Vec<_> = onto_release.collect();
        for (entries, &share) in self.matrix.iter_mut().zip(&share) {
            for (entry, &slope) in entries.iter_mut().zip(&onto_release) {
                *entry = sum(*entry, -(share * slope));
            }
        }
        let rates: Vec<_> = self.matrix.iter().map(|row| dot(row, &share)).collect();
        for (entries, &rate) in self.matrix.iter_mut().zip(&rates) {
            for (entry, &slope) in entries.iter_mut().zip(&row) {
                *entry = sum(*entry, rate * slope);
            }
        }
        let slope = self.release.gap;
        for (component, rate) in rates.into_iter().enumerate() {
            self.press(component, rate * slope);
        }
        self
    }

    /// `β`, if a force is proportional to the gap's rate and the release function to the gap.
    fn passing_share(&self) -> Option<Vec<Dd>> {
        let release = &self.release;
        let by_gap = release.constant.is_zero()
            && release.gap_rate.is_zero()
            && !release.gap.is_zero()
            && release.rest.is_empty();
        let mut forces = self.forces.iter();
        // A force on the release function itself would move it at once.
        let apart = forces.all(|&(component, _)| self.release_row[component].is_zero());
        let mut share = vec![Dd::ZERO; self.matrix.len()];
        for (component, force) in &self.forces {
            share[*component] = force.gap_rate / release.gap;
        }
        let damped = share.iter().any(|share| !share.is_zero());
        (by_gap && apart && damped).then_some(share)
    }

    /// Puts a spring on the gap in the place of a component's damper.
    fn press(&mut self, component: usize, stiffness: Dd) {
        let mut forces = self.forces.iter();
        if let Some(own) = forces.position(|&(forced, _)| forced == component) {
            let force = &mut self.forces[own].1;
            force.gap_rate = Dd::ZERO;
            force.gap = sum(force.gap, stiffness);
        } else if !stiffness.is_zero() {
            let spring = Drive {
                constant: Dd::ZERO,
                gap: stiffness,
                gap_rate: Dd::ZERO,
                rest: Vec::new(),
            };
            self.forces.push((component, spring));
        }
    }
}

fn columns(matrix: &[Vec<Dd>]) -> impl Iterator<Item = Vec<Dd>> {
    (0..matrix.len()).map(|column| matrix.iter().map(|row| row[column]).collect())
}

fn dot(a: &[Dd], b: &[Dd]) -> Dd {
    let terms = a.iter().zip(b).map(|(&a, &b)| a * b);
    terms.fold(Dd::ZERO, sum)
}

/// `a + b`, and 0 where they cancel to rounding: a term that is none costs operations.
fn sum(a: Dd, b: Dd) -> Dd {
    rounded_away(a + b, VANISHING * a.magnitude().max(b.magnitude()))
}
