//! Coefficients of the normal forms at folds, flips and Neimark–Sacker points.
//!
//! One idea: the coefficients need second and third derivatives of the map `F` of the period along
//! a few directions, which differences in double-double give accurately. Coordinates are in
//! half-widths of the window, `q` has unit length there, `⟨p, q⟩ = 1` (Kuznetsov, *Elements of
//! Applied Bifurcation Theory*, 2004, sections 4.3, 4.6 and 5.4):
//!
//! ```text
//! SN   b = ½ ⟨p, B(q, q)⟩                                         ξ ↦ β + ξ + b ξ²
//! PD   c = ⅙ ⟨p, C(q, q, q) + 3 B(q, (I − A)⁻¹ B(q, q))⟩          ξ ↦ −(1 + β) ξ + c ξ³
//! NS   a = ½ Re e^{−iθ} ⟨p, C(q, q, q̄) + 2 B(q, (I − A)⁻¹ B(q, q̄))
//!                            + B(q̄, (e^{2iθ} I − A)⁻¹ B(q, q))⟩
//! ```
//!
//! The doubled orbits are stable if `c > 0`, the closed curve if `a < 0`.

use nalgebra::{Complex, DMatrix, DVector};

use super::data::BranchLabel;
use crate::analysis::periodic::SectionMap;
use crate::numeric::Dd;
use crate::numeric::linear::eigenvalues;

/// Step of differences, relative to the length scale of the map.
const SHARE: f64 = 1e-6;

type ComplexVector = DVector<Complex<f64>>;

/// A periodic orbit with its map in double-double.
pub(super) struct NormalForm<'a, M: ?Sized> {
    pub(super) map: &'a mut M,
    /// First point and all active parameters, in offsets.
    pub(super) state: Vec<Dd>,
    pub(super) parameters: Vec<Dd>,
    /// Number of returns in the period.
    pub(super) returns: usize,
    /// Half-widths of the window.
    pub(super) units: Vec<f64>,
    /// Jacobian of the map of the period, in offsets.
    pub(super) jacobian: DMatrix<f64>,
    /// Length scale of the map about the orbit, in half-widths: its distance from a graze.
    pub(super) length: f64,
}

impl<M: SectionMap<Dd> + ?Sized> NormalForm<'_, M> {
    /// Coefficient of a special point; `None` for grazes, branch points and Hopf points.
    pub(super) fn of(&mut self, label: BranchLabel) -> Option<f64> {
        match label {
            BranchLabel::SaddleNode => self.fold(),
            BranchLabel::PeriodDoubling => self.flip(),
            BranchLabel::NeimarkSacker => {
                let multipliers = eigenvalues(&self.jacobian).ok()?;
                self.torus(multipliers.into_iter().find(|value| value.im > 0.0)?)
            }
            BranchLabel::Graze | BranchLabel::BranchPoint | BranchLabel::Hopf => None,
        }
    }

    /// Coefficient `b` of a fold.
    pub(super) fn fold(&mut self) -> Option<f64> {
        let (q, p) = self.vectors(Complex::new(1.0, 0.0))?;
        let second = self.second(&real(&q))?;
        Some(0.5 * real(&p).dot(&second))
    }

    /// Coefficient `c` of a flip.
    pub(super) fn flip(&mut self) -> Option<f64> {
        let (q, p) = self.vectors(Complex::new(-1.0, 0.0))?;
        let (q, p) = (real(&q), real(&p));
        let (second, third) = (self.second(&q)?, self.third(&q)?);
        let size = q.len();
        let followed = (DMatrix::identity(size, size) - self.scaled()).lu().solve(&second)?;
        let mixed = self.bilinear(&q, &followed)?;
        Some(p.dot(&(third + 3.0 * mixed)) / 6.0)
    }

    /// Coefficient `a` of a Neimark–Sacker point with the given multiplier.
    pub(super) fn torus(&mut self, multiplier: Complex<f64>) -> Option<f64> {
        let (q, p) = self.vectors(multiplier)?;
        let conjugate = q.map(|value| value.conj());
        let matrix = self.scaled().map(|value| Complex::new(value, 0.0));
        let size = q.len();
        let identity = DMatrix::<Complex<f64>>::identity(size, size);
        let (own, mean) = (self.complex_bilinear(&q, &q)?, self.complex_bilinear(&q, &conjugate)?);
        let mean = (&identity - &matrix).lu().solve(&mean)?;
        let own = (identity * (multiplier * multiplier) - matrix).lu().solve(&own)?;
        let cubic = self.complex_cubic(&q)?;
        let sum = cubic
            + self.complex_bilinear(&q, &mean)? * Complex::new(2.0, 0.0)
            + self.complex_bilinear(&conjugate, &own)?;
        Some(0.5 * (p.dotc(&sum) * multiplier.conj()).re)
    }

    /// Jacobian in half-widths.
    fn scaled(&self) -> DMatrix<f64> {
        let (jacobian, units) = (&self.jacobian, &self.units);
        DMatrix::from_fn(units.len(), units.len(), |i, j| jacobian[(i, j)] * units[j] / units[i])
    }

    /// Unit eigenvector `q` of a multiplier, and the eigenvector `p` of the transposed matrix with
    /// `⟨p, q⟩ = 1`, where `p` is conjugated in the product.
    fn vectors(&self, multiplier: Complex<f64>) -> Option<(ComplexVector, ComplexVector)> {
        let matrix = self.scaled().map(|value| Complex::new(value, 0.0));
        let q = eigenvector(&matrix, multiplier)?;
        let p = eigenvector(&matrix.transpose(), multiplier.conj())?;
        let product = p.dotc(&q);
        let p = p.map(|value| value / product.conj());
        p.iter().all(|value| value.re.is_finite() && value.im.is_finite()).then_some((q, p))
    }

    /// Image of the point at a distance along a direction; both in half-widths, relative to the
    /// first point.
    fn image(&mut self, along: &DVector<f64>, distance: Dd) -> Option<Vec<Dd>> {
        let moved = self.state.iter().zip(along.iter()).zip(&self.units);
        let moved = moved.map(|((&x, &a), &unit)| x + Dd::from(a) * distance * Dd::from(unit));
        let mut state: Vec<Dd> = moved.collect();
        for _ in 0..self.returns {
            state = self.map.image(&state, &self.parameters)?.offsets;
        }
        let pairs = state.iter().zip(&self.state).zip(&self.units);
        Some(pairs.map(|((&end, &start), &unit)| (end - start) / Dd::from(unit)).collect())
    }

    /// `Σ w_k F(x + k h u) / h^order` with weights `w_k` at `k = −3 … 3`.
    fn difference(
        &mut self,
        along: &DVector<f64>,
        weights: [f64; 7],
        order: i32,
    ) -> Option<DVector<f64>> {
        let length = along.norm();
        if length == 0.0 {
            return Some(DVector::zeros(along.len()));
        }
        let step = SHARE * self.length / length;
        let mut sum = vec![Dd::ZERO; along.len()];
        for (k, weight) in (-3..=3).zip(weights).filter(|(_, weight)| *weight != 0.0) {
            // Offsets rounded to `f64` would not be evenly spaced.
            let image = self.image(along, Dd::from(f64::from(k)) * Dd::from(step))?;
            for (sum, value) in sum.iter_mut().zip(image) {
                *sum += Dd::from(weight) * value;
            }
        }
        let factor = step.powi(order);
        Some(DVector::from_iterator(along.len(), sum.iter().map(|value| value.to_f64() / factor)))
    }

    /// `B(u, u)`.
    fn second(&mut self, u: &DVector<f64>) -> Option<DVector<f64>> {
        let weights = [0.0, -1.0, 16.0, -30.0, 16.0, -1.0, 0.0];
        Some(self.difference(u, weights, 2)? / 12.0)
    }

    /// `C(u, u, u)`.
    fn third(&mut self, u: &DVector<f64>) -> Option<DVector<f64>> {
        let weights = [1.0, -8.0, 13.0, 0.0, -13.0, 8.0, -1.0];
        Some(self.difference(u, weights, 3)? / 8.0)
    }

    /// `B(u, w) = (B(u + w, u + w) − B(u − w, u − w))/4`.
    fn bilinear(&mut self, u: &DVector<f64>, w: &DVector<f64>) -> Option<DVector<f64>> {
        Some((self.second(&(u + w))? - self.second(&(u - w))?) / 4.0)
    }

    fn complex_bilinear(&mut self, u: &ComplexVector, w: &ComplexVector) -> Option<ComplexVector> {
        let (a, b) = (u.map(|value| value.re), u.map(|value| value.im));
        let (c, d) = (w.map(|value| value.re), w.map(|value| value.im));
        let re = self.bilinear(&a, &c)? - self.bilinear(&b, &d)?;
        let im = self.bilinear(&a, &d)? + self.bilinear(&b, &c)?;
        Some(re.zip_map(&im, Complex::new))
    }

    /// `C(q, q, q̄)` of `q = a + i b`: `C(a,a,a) + C(a,b,b) + i (C(a,a,b) + C(b,b,b))`.
    fn complex_cubic(&mut self, q: &ComplexVector) -> Option<ComplexVector> {
        let (a, b) = (q.map(|value| value.re), q.map(|value| value.im));
        let (aaa, bbb) = (self.third(&a)?, self.third(&b)?);
        let (sum, difference) = (self.third(&(&a + &b))?, self.third(&(&a - &b))?);
        // T(a ± b) = aaa ± 3 aab + 3 abb ± bbb.
        let abb = (&sum + &difference - 2.0 * &aaa) / 6.0;
        let aab = (sum - difference - 2.0 * &bbb) / 6.0;
        Some((aaa + abb).zip_map(&(aab + bbb), Complex::new))
    }
}

fn real(vector: &ComplexVector) -> DVector<f64> {
    vector.map(|value| value.re)
}

/// Unit eigenvector of an eigenvalue, by inverse iteration; real for a real eigenvalue.
fn eigenvector(matrix: &DMatrix<Complex<f64>>, value: Complex<f64>) -> Option<ComplexVector> {
    let size = matrix.nrows();
    let largest = matrix.iter().fold(1.0_f64, |most, entry| most.max(entry.norm()));
    let shift = value + Complex::new(1e-11 * largest, 0.0);
    let shifted = (matrix - DMatrix::identity(size, size) * shift).lu();
    let mut vector =
        ComplexVector::from_fn(size, |place, _| Complex::new(1.0 / (1.0 + place as f64), 0.0));
    for _ in 0..4 {
        vector = shifted.solve(&vector)?;
        let length = vector.norm();
        vector /= Complex::new(length, 0.0);
    }
    vector.iter().all(|value| value.re.is_finite() && value.im.is_finite()).then_some(vector)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::periodic::SectionStep;
    use crate::iteration::PassageSet;

    /// `x ↦ f(x)` in two coordinates.
    struct Plane<F>(F);

    impl<F: FnMut([Dd; 2]) -> [Dd; 2]> SectionMap<Dd> for Plane<F> {
        fn image(&mut self, state: &[Dd], _: &[Dd]) -> Option<SectionStep<Dd>> {
            let offsets = (self.0)([state[0], state[1]]).to_vec();
            let contacts = PassageSet::default();
            Some(SectionStep { offsets, contacts, depth: Dd::ZERO, extra_contacts: 0 })
        }
    }

    fn form<M: SectionMap<Dd>>(map: &mut M, jacobian: [f64; 4]) -> NormalForm<'_, M> {
        NormalForm {
            map,
            state: vec![Dd::ZERO; 2],
            parameters: Vec::new(),
            returns: 1,
            units: vec![1.0, 1.0],
            jacobian: DMatrix::from_row_slice(2, 2, &jacobian),
            length: 1.0,
        }
    }

    #[test]
    fn folds_and_flips_have_the_coefficients_of_their_normal_forms() {
        // x ↦ x + 3 x² + y x, y ↦ y/2 + x²: b = 3.
        let number = Dd::from;
        let mut fold =
            Plane(|[x, y]: [Dd; 2]| [x + number(3.0) * x * x + y * x, number(0.5) * y + x * x]);
        let found = form(&mut fold, [1.0, 0.0, 0.0, 0.5]).fold().expect("vectors");
        assert!((found - 3.0).abs() < 1e-9, "{found}");
        // x ↦ −x + 2 x³ + y x, y ↦ y/2 + x²: on y = 2 x² + …, c = 2 + 2.
        let mut flip =
            Plane(|[x, y]: [Dd; 2]| [number(2.0) * x * x * x + y * x - x, number(0.5) * y + x * x]);
        let found = form(&mut flip, [-1.0, 0.0, 0.0, 0.5]).flip().expect("vectors");
        assert!((found - 4.0).abs() < 1e-9, "{found}");
    }

    #[test]
    fn a_neimark_sacker_point_has_the_lyapunov_coefficient_of_its_normal_form() {
        // z ↦ e^{iθ} (1 − 3 |z|²) z, z = x + i y; with |q| = 1 and q = (1, −i)/√2, z = √2 w.
        let (sin, cos) = 0.7_f64.sin_cos();
        let (sin, cos) = (Dd::from(sin), Dd::from(cos));
        let mut torus = Plane(|[x, y]: [Dd; 2]| {
            let factor = Dd::ONE - Dd::from(3.0) * (x * x + y * y);
            [factor * (cos * x - sin * y), factor * (sin * x + cos * y)]
        });
        let (s, c) = 0.7_f64.sin_cos();
        let found = form(&mut torus, [c, -s, s, c]).torus(Complex::new(c, s)).expect("vectors");
        assert!((found + 6.0).abs() < 1e-8, "{found}");
    }
}
