import assert from "node:assert/strict";
import { test } from "node:test";
import {
  characteristic,
  eigenvalues,
  quadratic,
  roots,
  solve,
  spectralRadius,
  times,
} from "../src/worker/linear.js";

const near = (found, expected, tolerance = 1e-12) =>
  assert.ok(Math.abs(found - expected) <= tolerance, `${found} is not ${expected}`);

/** Eigenvalues in the order of their real parts, then imaginary parts. */
const ordered = (values) =>
  [...values].sort(([a, b], [c, d]) => (Math.abs(a - c) > 1e-9 ? a - c : b - d));

/** Reproducible numbers in [-1, 1). */
const numbers = (seed) => {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 31 - 1;
  };
};

test("elimination solves systems that need a change of rows", () => {
  assert.deepEqual(solve([[0, 2], [4, 0]], [6, 8]), [2, 3]);
  assert.equal(solve([[1, 2], [2, 4]], [1, 1]), null);
});

test("solutions satisfy random systems to rounding", () => {
  const next = numbers(1);
  for (let size = 1; size <= 8; size++) {
    const matrix = Array.from({ length: size }, () => Array.from({ length: size }, next));
    const right = Array.from({ length: size }, next);
    const found = solve(matrix, right);
    const back = times(matrix, found.map((value) => [value]));
    for (const [n, [value]] of back.entries()) near(value, right[n], 1e-12);
  }
});

test("the characteristic polynomial of a companion matrix is its last row", () => {
  // x³ − 6 x² + 11 x − 6 = (x − 1)(x − 2)(x − 3).
  assert.deepEqual(characteristic([[0, 1, 0], [0, 0, 1], [6, -11, 6]]), [1, -6, 11, -6]);
});

test("a root of a quadratic beside a far larger one keeps its digits", () => {
  // Roots 1e8 and 1e-8.
  const found = quadratic(-(1e8 + 1e-8), 1).map(([re]) => re);
  assert.deepEqual(found.sort((a, b) => a - b), [1e-8, 1e8]);
  assert.deepEqual(quadratic(0, 1), [[-0, 1], [-0, -1]]);
  assert.deepEqual(quadratic(0, 0).map(([re]) => Math.abs(re)), [0, 0]);
});

test("roots of a polynomial are found with complex pairs", () => {
  // (x² + 1)(x − 2)(x + 3) = x⁴ + x³ − 5 x² + x − 6.
  const found = ordered(roots([1, 1, -5, 1, -6]));
  const expected = [[-3, 0], [0, -1], [0, 1], [2, 0]];
  for (const [n, [re, im]] of found.entries()) {
    near(re, expected[n][0]);
    near(im, expected[n][1]);
  }
});

test("eigenvalues of a rotation with contraction have its angle and modulus", () => {
  const [c, s] = [0.9 * Math.cos(1), 0.9 * Math.sin(1)];
  for (const [re, im] of eigenvalues([[c, -s], [s, c]])) {
    near(re, c, 1e-15);
    near(Math.abs(im), s, 1e-15);
  }
});

test("eigenvalues of similar matrices of up to six coordinates are the diagonal", () => {
  const next = numbers(7);
  for (let size = 1; size <= 6; size++) {
    const values = Array.from({ length: size }, (_, n) => 0.9 - 0.31 * n);
    const change = Array.from({ length: size }, () => Array.from({ length: size }, next));
    change.forEach((row, n) => (row[n] += 3));
    // Columns of the inverse.
    const columns = change.map((_, n) => solve(change, change.map((__, m) => Number(m === n))));
    const inverse = change.map((_, i) => columns.map((column) => column[i]));
    const scaled = change.map((row) => row.map((value, n) => value * values[n]));
    const found = ordered(eigenvalues(times(scaled, inverse))).map(([re]) => re);
    const expected = [...values].sort((a, b) => a - b);
    for (const [n, value] of found.entries()) near(value, expected[n], 1e-9);
  }
});

test("the spectral radius is that of a complex pair", () => {
  near(spectralRadius([[0.5, 0], [0.3, 0.4], [0.6, -0.8]]), 1);
});
