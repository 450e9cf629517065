//! Integrals over the time of a contact, `u` from 0 to 1, of functions with powers of the distance
//! from a surface.
//!
//! Half-whole powers: with `u = sin² φ`, or `u = φ²` where the contact ends before the surface,
//! such functions are analytic in `φ`: they are known at the nodes of Chebyshev in `φ`, and their
//! integrals are those of the polynomial through them. Any powers: in `ln u`, and `ln (1 − u)` for
//! the half beside the end, they are sums of exponentials; the nodes are those of pieces that
//! double in length.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector};

use crate::numeric::linear::inverse;
use crate::numeric::{Dd, NumericError, Real, Scalar};

/// Places in the time of a contact, with the integrals up to each.
pub(super) struct Quadrature<S: Scalar> {
    /// The places: the nodes, then the end for a contact that ends before the surface.
    pub(super) places: Vec<ContactPlace<S>>,
    /// `∫_0^u A du'` at each node, or `∫_u^1 A du'` at a node beside the end.
    pub(super) primitive: Vec<Primitive<S>>,
    /// `∫_0^1 A du`.
    pub(super) total: Row<S>,
    /// `∫_0^1 (1 − u) A du`.
    pub(super) moment: Row<S>,
}

/// Integral from an end of the contact to a node.
pub(super) struct Primitive<S: Scalar> {
    /// Whether the integral is that to the end of the contact.
    pub(super) to_end: bool,
    /// The row.
    pub(super) row: Row<S>,
}

/// Weights of the values of a function at consecutive nodes.
#[derive(Clone)]
pub(super) struct Row<S: Scalar> {
    first: usize,
    weights: Vec<S>,
}

impl<S: Real> Row<S> {
    /// Weights of the nodes from `first` on.
    fn new(first: usize, weights: impl Iterator<Item = S>) -> Self {
        Self { first, weights: weights.collect() }
    }

    /// Sum over values at all nodes.
    pub(super) fn of(&self, values: &[S]) -> S {
        let pairs = self.weights.iter().zip(&values[self.first..]);
        pairs.fold(S::zero(), |sum, (&weight, &value)| sum + weight * value)
    }
}

/// Rows of a matrix, as integrals from the beginning.
fn rows<S: Real>(matrix: &DMatrix<S>) -> Vec<Primitive<S>> {
    let rows = matrix.row_iter();
    rows.map(|row| Primitive { to_end: false, row: Row::new(0, row.iter().copied()) }).collect()
}

/// One place, with the penetration over `y²` there: `base · H`, and for the rate `σ` of the
/// penetration at the beginning or the end of the contact
///
/// ```text
/// H = T (share σ − T A),    A = mean · h''
/// ```
pub(super) struct ContactPlace<S: Scalar> {
    /// `u (1 − u)`, or `u` for a contact that ends before the surface.
    pub(super) base: S,
    /// Whether `H` is found from the end of the contact.
    pub(super) from_end: bool,
    /// Time from there over `base`.
    pub(super) share: S,
    /// Row on the values of `h''` at the nodes: `∫ (u − u') h'' du'` from there, over `base`.
    pub(super) mean: Row<S>,
}

impl<S: Real> Quadrature<S> {
    /// A quadrature for a contact between two zeros of the penetration, with a number of nodes.
    ///
    /// # Errors
    ///
    /// [`NumericError`] as the inverse of a matrix.
    pub(super) fn between(count: usize) -> Result<Self, NumericError> {
        let half_turn = S::from_dd(Dd::PI * Dd::from_f64(0.5));
        let nodes = Nodes::new(count, half_turn);
        let circle: Vec<(S, S)> = nodes.at.iter().map(|&angle| angle.sin_cos()).collect();
        let times: Vec<[S; 2]> = circle.iter().map(|&(s, c)| [s * s, c * c]).collect();
        let two = S::from_f64(2.0);
        let weights = circle.iter().map(|&(s, c)| two * s * c);
        let (primitive, total) = nodes.integrals(&weights.collect::<Vec<_>>())?;
        let places = (0..count).map(|node| {
            let [since, until] = times[node];
            let from_end = nodes.at[node].to_f64() > 0.5 * FRAC_PI_2;
            let base = since * until;
            let mean = (0..count).map(|column| {
                // The nodes are symmetric: the integral from the end is that of the mirror image.
                let [own, from] = match from_end {
                    false => [primitive[(node, column)], since - times[column][0]],
                    true => [
                        primitive[(count - 1 - node, count - 1 - column)],
                        until - times[column][1],
                    ],
                };
                own * from / base
            });
            let share = if from_end { S::one() / since } else { S::one() / until };
            ContactPlace { base, from_end, share, mean: Row::new(0, mean) }
        });
        let places = places.collect();
        let moment = total.iter().zip(&times).map(|(&total, time)| total * time[1]);
        Ok(Self {
            places,
            primitive: rows(&primitive),
            moment: Row::new(0, moment),
            total: Row::new(0, total.iter().copied()),
        })
    }

    /// A quadrature for a contact between two zeros of the penetration with any powers of it, the
    /// smallest `least`.
    ///
    /// # Errors
    ///
    /// As [`between`](Self::between).
    pub(super) fn between_any(least: f64) -> Result<Self, NumericError> {
        let Graded { at, rows: own, total: half } = Graded::new(0.5, 1.0, least)?;
        let count = at.len();
        // The nodes beside the entry, then their mirror images.
        let mirrored = |node: usize| (node >= count, node % count);
        let times = |node: usize| {
            let (is_mirrored, place) = mirrored(node);
            let [near, far] = [at[place], S::one() - at[place]];
            if is_mirrored { [far, near] } else { [near, far] }
        };
        let first = |node: usize| if mirrored(node).0 { count } else { 0 };
        let primitive = (0..2 * count).map(|node| {
            let (to_end, place) = mirrored(node);
            Primitive { to_end, row: Row::new(first(node), own[place].iter().copied()) }
        });
        let primitive = primitive.collect();
        let places = (0..2 * count).map(|node| {
            let ((from_end, place), [since, until]) = (mirrored(node), times(node));
            let base = since * until;
            let weights = own[place].iter().zip(&at);
            let weights = weights.map(|(&weight, &time)| weight * (at[place] - time) / base);
            let share = if from_end { S::one() / since } else { S::one() / until };
            ContactPlace { base, from_end, share, mean: Row::new(first(node), weights) }
        });
        let places = places.collect();
        let total = (0..2 * count).map(|node| half[mirrored(node).1]);
        let moment = (0..2 * count).map(|node| half[mirrored(node).1] * times(node)[1]);
        Ok(Self { places, primitive, moment: Row::new(0, moment), total: Row::new(0, total) })
    }

    /// A quadrature for a contact that begins at a zero of the penetration and ends before the
    /// next.
    ///
    /// # Errors
    ///
    /// As [`between`](Self::between).
    pub(super) fn after(count: usize) -> Result<Self, NumericError> {
        let nodes = Nodes::new(count, S::one());
        let times: Vec<S> = nodes.at.iter().map(|&at| at * at).collect();
        let weights: Vec<S> = nodes.at.iter().map(|&at| S::from_f64(2.0) * at).collect();
        let (primitive, total) = nodes.integrals(&weights)?;
        Ok(Self::until_release(times, rows(&primitive), total))
    }

    /// A quadrature for a contact with any powers of the penetration, the smallest `least`, that
    /// ends at a share of the time to the surface.
    ///
    /// # Errors
    ///
    /// As [`between`](Self::between).
    pub(super) fn after_any(share: f64, least: f64) -> Result<Self, NumericError> {
        let Graded { at, rows, total } = Graded::new(1.0, 1.0 / share, least)?;
        let rows = rows.into_iter().map(|weights| Row::new(0, weights.into_iter()));
        let primitive = rows.map(|row| Primitive { to_end: false, row });
        Ok(Self::until_release(at, primitive.collect(), total))
    }

    fn until_release(times: Vec<S>, primitive: Vec<Primitive<S>>, total: DVector<S>) -> Self {
        let count = times.len();
        let moment = total.iter().zip(&times).map(|(&total, &time)| total * (S::one() - time));
        let moment = Row::new(0, moment);
        let nodes = (0..count).map(|node| ContactPlace {
            base: times[node],
            from_end: false,
            share: S::one(),
            mean: {
                let weights = primitive[node].row.weights.iter().zip(&times);
                let at = times[node];
                Row::new(0, weights.map(|(&weight, &time)| weight * (at - time) / at))
            },
        });
        let end =
            ContactPlace { base: S::one(), from_end: false, share: S::one(), mean: moment.clone() };
        let places = nodes.chain([end]).collect();
        Self { places, primitive, total: Row::new(0, total.iter().copied()), moment }
    }
}

/// Nodes in the time since a surface, for functions with any powers of that time.
struct Graded<S: Scalar> {
    /// Times from 0 to `end`.
    at: Vec<S>,
    /// Weights of `∫_0^u A du'` at each node, up to the end of its piece.
    rows: Vec<Vec<S>>,
    /// `∫_0^end A du`.
    total: DVector<S>,
}

impl<S: Real> Graded<S> {
    /// Nodes up to a time. `beyond` is the time of the next singularity, `least` the smallest
    /// power.
    fn new(end: f64, beyond: f64, least: f64) -> Result<Self, NumericError> {
        let nats = -S::ROUNDOFF.ln();
        // What lies before the first piece is less than rounding.
        let first = end * (-nats / (1.0 + least.min(1.0))).exp();
        let (mut pieces, mut right) = (Vec::new(), end);
        while right > first {
            // As long as the distance to the singularity, in the logarithm.
            let left = (right * right / beyond).max(first);
            pieces.push((left, right));
            right = left;
        }
        let (mut at, mut rows, mut total): (Vec<S>, Vec<Vec<S>>, Vec<S>) = Default::default();
        let mut add = |nodes: Nodes<S>, times: Vec<S>, weights: &[S]| {
            let (primitive, over) = nodes.integrals(weights)?;
            for row in 0..times.len() {
                let own = (0..times.len()).map(|column| primitive[(row, column)]);
                rows.push(total.iter().copied().chain(own).collect());
            }
            total.extend(over.iter());
            at.extend(times);
            Ok(())
        };
        let start = Nodes::new(FIRST_NODES, S::from_f64(first));
        let times = start.at.clone();
        add(start, times, &[S::one(); FIRST_NODES])?;
        for &(left, right) in pieces.iter().rev() {
            let length = S::from_f64(right).ln() - S::from_f64(left).ln();
            let growth = growth(1.0 + 2.0 * (beyond / right).ln() / length.to_f64());
            let needed = nats / growth.ln() + 4.0;
            let nodes = Nodes::new(needed.ceil() as usize, length);
            let times = nodes.at.iter().map(|&at| S::from_f64(left) * at.exp());
            let times: Vec<S> = times.collect();
            let weights = times.clone();
            add(nodes, times, &weights)?;
        }
        Ok(Self { rows, total: DVector::from_vec(total), at })
    }
}

/// Rate at which the error falls from node to node for a function on `(−1, 1)` that is singular at
/// `place` beyond 1.
pub(super) fn growth(place: f64) -> f64 {
    place + (place * place - 1.0).sqrt()
}

/// Number of nodes before the first piece.
const FIRST_NODES: usize = 6;

/// Nodes on `(0, length)`: the zeros of a polynomial of Chebyshev.
struct Nodes<S: Scalar> {
    at: Vec<S>,
    length: S,
    /// Row that interpolates from the nodes to the end of the interval.
    end: DVector<S>,
    /// Matrix of `x d/dx` at the nodes.
    euler: DMatrix<S>,
}

impl<S: Real> Nodes<S> {
    fn new(count: usize, length: S) -> Self {
        let angle = |node: usize| {
            let odd = Dd::from_f64((2 * node + 1) as f64);
            S::from_dd(odd * Dd::PI / Dd::from_f64((2 * count) as f64))
        };
        let half = S::from_f64(0.5);
        // The node is sin² and its distance from the end cos² of half the angle.
        let halves: Vec<(S, S)> = (0..count).map(|node| (angle(node) * half).sin_cos()).collect();
        let unit: Vec<S> = halves.iter().map(|&(sine, _)| sine * sine).collect();
        // Weights of the barycentric formula.
        let weights: Vec<S> = (0..count)
            .map(|node| {
                let (sine, _) = angle(node).sin_cos();
                if node % 2 == 0 { sine } else { -sine }
            })
            .collect();
        let shares = halves.iter().zip(&weights);
        let shares = shares.map(|(&(_, cosine), &weight)| weight / (cosine * cosine));
        let shares: Vec<S> = shares.collect();
        let sum = shares.iter().fold(S::zero(), |sum, &share| sum + share);
        let mut euler = DMatrix::from_fn(count, count, |row, column| match row == column {
            true => S::zero(),
            false => unit[row] * weights[column] / (weights[row] * (unit[row] - unit[column])),
        });
        for row in 0..count {
            let others = (0..count).map(|column| euler[(row, column)]);
            euler[(row, row)] = -others.fold(S::zero(), |sum, value| sum + value);
        }
        Self {
            at: unit.iter().map(|&at| at * length).collect(),
            length,
            end: DVector::from_iterator(count, shares.into_iter().map(|share| share / sum)),
            euler,
        }
    }

    /// Integrals of a function with weights at the nodes: up to each node, and up to the end. From
    /// `∫_0^x f = x C`, `(1 + x d/dx) C = f`.
    fn integrals(&self, weights: &[S]) -> Result<(DMatrix<S>, DVector<S>), NumericError> {
        let count = self.at.len();
        let mut equation = self.euler.clone();
        for node in 0..count {
            equation[(node, node)] += S::one();
        }
        let solution = inverse(&equation)?;
        let primitive = DMatrix::from_fn(count, count, |row, column| {
            self.at[row] * solution[(row, column)] * weights[column]
        });
        let total = DVector::from_fn(count, |column, _| {
            let terms = (0..count).map(|row| self.end[row] * solution[(row, column)]);
            self.length * weights[column] * terms.fold(S::zero(), |sum, term| sum + term)
        });
        Ok((primitive, total))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The beta function `B(p + 1, p + 1)` at `p` = 3/2, 1/2, 5/2: `3π/128`, `π/8`, `5π/1024`.
    const BETAS: [(f64, f64, f64); 3] = [(1.5, 3.0, 128.0), (0.5, 1.0, 8.0), (2.5, 5.0, 1024.0)];

    #[test]
    fn integrals_of_half_whole_powers_are_exact_to_rounding() {
        let quadrature = Quadrature::<Dd>::between(56).unwrap();
        for (power, numerator, denominator) in BETAS {
            let values: Vec<Dd> =
                quadrature.places.iter().map(|place| place.base.powf(Dd::from(power))).collect();
            let expected = Dd::PI * Dd::from(numerator) / Dd::from(denominator);
            let close = |found: Dd, expected: Dd| {
                let error = ((found - expected) / expected).magnitude();
                assert!(error < 1e-29, "{power}: {error:e}");
            };
            close(quadrature.total.of(&values), expected);
            // By symmetry the mean of 1 − u is one half.
            close(quadrature.moment.of(&values), expected * Dd::from(0.5));
        }
    }

    #[test]
    fn integrals_of_any_powers_are_exact_to_rounding() {
        let quadrature = Quadrature::<Dd>::between_any(0.3).unwrap();
        let after = Quadrature::<Dd>::after_any(0.8, 0.3).unwrap();
        let one = Dd::from(1.0);
        for power in [0.3, 1.1, 3.7, 12.4] {
            // ∫ u^p du = 1/(p + 1), and the same of 1 − u; ∫ u^p (1 − u) du = 1/((p + 1)(p + 2)).
            let next = one / (Dd::from(power) + one);
            let then = next / (Dd::from(power) + one + one);
            let close = |found: Dd, expected: Dd| {
                let error = ((found - expected) / expected).magnitude();
                assert!(error < 1e-27, "{power}: {error:e}");
            };
            let times = |place: &ContactPlace<Dd>| match place.from_end {
                true => one / place.share,
                false => one - one / place.share,
            };
            let values = |place: &ContactPlace<Dd>| times(place).powf(Dd::from(power));
            let values: Vec<Dd> = quadrature.places.iter().map(values).collect();
            close(quadrature.total.of(&values), next);
            close(quadrature.moment.of(&values), then);
            let places = &after.places[..after.primitive.len()];
            let values: Vec<Dd> =
                places.iter().map(|place| place.base.powf(Dd::from(power))).collect();
            close(after.total.of(&values), next);
            close(after.moment.of(&values), then);
        }
    }

    #[test]
    fn the_penetration_of_a_constant_acceleration_is_found_from_either_end() {
        // h'' = 2: ∫ (u − u') h'' du' = u², over u (1 − u).
        for (quadrature, is_graded) in [
            (Quadrature::<Dd>::between(56), false),
            (Quadrature::<Dd>::after(60), false),
            (Quadrature::<Dd>::between_any(1.1), true),
            (Quadrature::<Dd>::after_any(0.8, 1.1), true),
        ] {
            let quadrature = quadrature.unwrap();
            let values = vec![Dd::from(2.0); quadrature.primitive.len()];
            for place in &quadrature.places {
                let time = place.share * place.base;
                let expected = time * time / place.base;
                // Relative errors grow where the penetration, and with it its share in an
                // integral, vanishes. Graded nodes lie where the mean vanishes beside the share.
                let found = place.mean.of(&values);
                let scale = if is_graded { Dd::from(1.0) } else { expected };
                let error = (found - expected) / scale * place.base;
                assert!(error.magnitude() < 1e-26, "{:?}: {error}", place.base);
            }
        }
    }
}
