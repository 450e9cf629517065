// Linear algebra of small matrices, given as arrays of rows.

/** @import { Complex } from "../types" */

/**
 * Identity matrix.
 * @param {number} size
 */
export const identity = (size) =>
  Array.from({ length: size }, (_, i) =>
    Array.from({ length: size }, (__, j) => Number(i === j)),
  );

/**
 * Product of two matrices.
 * @param {number[][]} rows
 * @param {number[][]} other
 */
export const times = (rows, other) =>
  rows.map((row) => other[0].map((_, j) => row.reduce((sum, v, i) => sum + v * other[i][j], 0)));

/**
 * Solution of a linear system, by Gauss and Jordan's elimination with row pivots; null if the
 * matrix is singular.
 * @param {number[][]} matrix
 * @param {number[]} right
 */
export function solve(matrix, right) {
  const rows = matrix.map((row, n) => [...row, right[n]]);
  const size = rows.length;
  for (let n = 0; n < size; n++) {
    let pivot = n;
    for (let k = n + 1; k < size; k++)
      if (Math.abs(rows[k][n]) > Math.abs(rows[pivot][n])) pivot = k;
    [rows[n], rows[pivot]] = [rows[pivot], rows[n]];
    if (!rows[n][n]) return null;
    for (let k = 0; k < size; k++) {
      if (k === n) continue;
      const share = rows[k][n] / rows[n][n];
      for (let j = n; j <= size; j++) rows[k][j] -= share * rows[n][j];
    }
  }
  return rows.map((row, n) => row[size] / row[n]);
}

/**
 * Coefficients of the characteristic polynomial, the leading one first, by Faddeev and LeVerrier.
 * @param {number[][]} matrix
 */
export function characteristic(matrix) {
  const coefficients = [1];
  let power = matrix.map((row) => row.map(() => 0));
  for (let k = 1; k <= matrix.length; k++) {
    const last = coefficients[k - 1];
    const shifted = power.map((row, i) => row.map((v, j) => v + (i === j ? last : 0)));
    power = times(matrix, shifted);
    coefficients.push(-power.reduce((sum, row, n) => sum + row[n], 0) / k);
  }
  return coefficients;
}

/**
 * Roots of `x² + b x + c`.
 * @param {number} b
 * @param {number} c
 * @returns {Complex[]}
 */
export function quadratic(b, c) {
  const root = b * b - 4 * c;
  if (root < 0) {
    const imaginary = Math.sqrt(-root) / 2;
    return [
      [-b / 2, imaginary],
      [-b / 2, -imaginary],
    ];
  }
  const larger = -(b + (b < 0 ? -1 : 1) * Math.sqrt(root)) / 2;
  return [
    [larger, 0],
    [larger === 0 ? 0 : c / larger, 0],
  ];
}

/** @type {(a: Complex, b: Complex) => Complex} */
const product = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];

/** @type {(a: Complex, b: Complex) => Complex} */
const quotient = ([a, b], [c, d]) => {
  const norm = c * c + d * d || 1e-300;
  return [(a * c + b * d) / norm, (b * c - a * d) / norm];
};

/** @type {(a: Complex, b: Complex) => Complex} */
const difference = ([a, b], [c, d]) => [a - c, b - d];

/**
 * Roots of a polynomial with leading coefficient 1, by Durand and Kerner.
 * @param {number[]} coefficients the leading one first
 */
export function roots(coefficients) {
  /** @type {Complex[]} */
  let found = coefficients.slice(1).map((_, n) => [Math.cos(1 + 2 * n), Math.sin(1 + 2 * n)]);
  for (let step = 0; step < 200; step++) {
    found = found.map((root, n) => {
      /** @type {Complex} */
      let value = [0, 0];
      for (const c of coefficients) {
        value = product(value, root);
        value[0] += c;
      }
      /** @type {Complex} */
      let rest = [1, 0];
      for (const [m, other] of found.entries())
        if (m !== n) rest = product(rest, difference(root, other));
      return difference(root, quotient(value, rest));
    });
  }
  return found;
}

/**
 * Eigenvalues of a small matrix, as roots of its characteristic polynomial.
 * @param {number[][]} matrix
 * @returns {Complex[]}
 */
export function eigenvalues(matrix) {
  const coefficients = characteristic(matrix);
  if (matrix.length === 1) return [[-coefficients[1], 0]];
  if (matrix.length === 2) return quadratic(coefficients[1], coefficients[2]);
  return roots(coefficients);
}

/**
 * Largest modulus of some eigenvalues.
 * @param {Complex[]} values
 */
export const spectralRadius = (values) => Math.max(...values.map(([re, im]) => Math.hypot(re, im)));
