//! Complex numbers in double-double: amplitudes of linear systems.

use std::ops::{Add, Mul, Sub};

use grazemap::numeric::Dd;

/// `re + i im`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Complex {
    pub(crate) re: Dd,
    pub(crate) im: Dd,
}

impl Complex {
    pub(crate) fn new(re: Dd, im: Dd) -> Self {
        Self { re, im }
    }

    pub(crate) fn conjugate(self) -> Self {
        Self::new(self.re, -self.im)
    }

    pub(crate) fn magnitude(self) -> Dd {
        (self.re * self.re + self.im * self.im).sqrt()
    }

    pub(crate) fn inverse(self) -> Self {
        let square = self.re * self.re + self.im * self.im;
        self.conjugate() * (Dd::ONE / square)
    }
}

impl Add for Complex {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl Sub for Complex {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let re = self.re * other.re - self.im * other.im;
        Self::new(re, self.re * other.im + self.im * other.re)
    }
}

impl Mul<Dd> for Complex {
    type Output = Self;

    fn mul(self, factor: Dd) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }
}

/// Solution of a small linear system by elimination with column pivoting.
pub(crate) fn solve(mut rows: Vec<Vec<Complex>>, mut right: Vec<Complex>) -> Vec<Complex> {
    let size = right.len();
    let magnitude = |value: Complex| value.magnitude().hi;
    for column in 0..size {
        let pivot = (column..size)
            .max_by(|&a, &b| magnitude(rows[a][column]).total_cmp(&magnitude(rows[b][column])))
            .unwrap_or(column);
        rows.swap(column, pivot);
        right.swap(column, pivot);
        let (row, value) = (rows[column].clone(), right[column]);
        for other in (0..size).filter(|&other| other != column) {
            let factor = rows[other][column] * row[column].inverse();
            for (entry, &pivot) in rows[other].iter_mut().zip(&row) {
                *entry = *entry - factor * pivot;
            }
            right[other] = right[other] - factor * value;
        }
    }
    (0..size).map(|row| right[row] * rows[row][row].inverse()).collect()
}
