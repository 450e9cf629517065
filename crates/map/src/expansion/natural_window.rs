//! The natural sizes of the variables of a map: on what lengths its polynomials vary.
//!
//! One idea: a window that is to be measured needs a shape before it has a size. A variable has the
//! size at which some monomial of it alone moves an image by the size of a state, or its own size
//! where that is smaller. The depth has that of a period of the free motion, `h'' (T/2π)²`. Under
//! the weights of the expansion (`y` has weight 1) one factor scales them all.

use super::expand::Expander;
use super::local_map::{LocalMap, MapWindow, Stage};
use super::variables::DEVIATION_WEIGHT;
use crate::jet::Jet;

/// Natural sizes of the depth and of the variables of a map, with the weights they are scaled by.
#[derive(Clone, Debug, PartialEq)]
pub struct NaturalWindow {
    /// Largest `y²` within the radius of convergence of every series in `y`; `None` where they end
    /// or there is none.
    pub reach: Option<f64>,
    depth: f64,
    coordinates: usize,
    widths: Vec<f64>,
    weights: Vec<u32>,
}

impl NaturalWindow {
    /// The window scaled by a factor: the depth and variables of weight 2 by the factor itself, a
    /// variable of weight `w` by its power `w/2`.
    pub fn scaled(&self, factor: f64) -> MapWindow {
        let pairs = self.widths.iter().zip(&self.weights);
        let scaled = pairs.map(|(width, &weight)| {
            width * factor.powf(f64::from(weight) / f64::from(DEVIATION_WEIGHT))
        });
        let mut state: Vec<f64> = scaled.collect();
        let parameter = state.split_off(self.coordinates);
        MapWindow { depth: self.depth * factor, state, parameter }
    }
}

impl Expander<'_> {
    /// The natural sizes of a map of this scene; its depth no larger than `reach`, the square of
    /// the least radius of its series in `y`.
    pub fn natural_window(&self, map: &LocalMap, reach: Option<f64>) -> NaturalWindow {
        let passage = self.section_passage();
        let units = self.units(passage);
        let depths = (0..self.passages()).map(|passage| self.depth_unit(passage));
        let depth = depths.chain(reach).fold(f64::INFINITY, f64::min);
        let coordinates = map.dimension();
        let mut widths = units.clone();
        let mut limit = |jets: &[Jet<f64>], share: f64| {
            for (jet, unit) in jets.iter().zip(&units[..coordinates]) {
                narrow(&mut widths, jet, unit / share);
            }
        };
        for stage in &map.stages {
            match stage {
                Stage::Leg(leg) => limit(&leg.image, 1.0),
                Stage::Contact(contact) => {
                    limit(&contact.linear, depth.sqrt());
                    limit(&contact.quadratic, depth);
                }
                // Its polynomials are not those of an image.
                Stage::Flown(_) => {}
            }
        }
        let weights = self.variables().weights.clone();
        NaturalWindow { reach, depth, coordinates, widths, weights }
    }
}

/// Narrows every width to where a monomial of that variable alone reaches a size.
fn narrow(widths: &mut [f64], jet: &Jet<f64>, size: f64) {
    for (powers, value) in jet.terms() {
        let mut varied = (0..powers.len()).filter(|&variable| powers[variable] > 0);
        if let (Some(variable), None) = (varied.next(), varied.next()) {
            let reached = (size / value.abs()).powf(1.0 / f64::from(powers[variable]));
            widths[variable] = widths[variable].min(reached);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::JetSpace;

    #[test]
    fn a_variable_is_as_large_as_its_steepest_monomial_allows() {
        // 2 a + 16 a^4 + 5 a b reaches 1 at a = 1/2 by either; mixed monomials say nothing of b.
        let space = JetSpace::uniform(2, 4).expect("a small space");
        let [a, b] = [0, 1].map(|at| Jet::variable(&space, at, 0.0));
        let fourth = &(&a * &a) * &(&a * &a);
        let [two, sixteen, five] = [2.0, 16.0, 5.0].map(|value| Jet::constant(&space, value));
        let jet = &(&(&two * &a) + &(&sixteen * &fourth)) + &(&five * &(&a * &b));
        let mut widths = [3.0, 3.0];
        narrow(&mut widths, &jet, 1.0);
        assert_eq!(widths, [0.5, 3.0]);
    }
}
