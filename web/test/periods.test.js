import assert from "node:assert/strict";
import { test } from "node:test";
import { NOT_SETTLED, WITHOUT_CONTACT } from "../src/classes.js";
import { attractorOf, batches, middle, settledClass } from "../src/worker/grid.js";
import {
  approached,
  converges,
  distances,
  periodIn,
  periodOf,
  periodSeen,
} from "../src/worker/periods.js";

const COUNT = 128;
const WIDTHS = [1];
/** States of one coordinate by their number. */
const run = (value, count = COUNT) => Array.from({ length: count }, (_, n) => [value(n)]);

test("states that repeat have their least period", () => {
  for (const period of [1, 2, 3, 5, 7, 16, 64])
    assert.equal(periodOf(run((n) => Math.sin((n % period) + 1)), WIDTHS), period);
  assert.equal(periodOf(run((n) => Math.sin(n)), WIDTHS), 0);
});

test("a period longer than half the run is not seen", () => {
  assert.equal(periodOf(run((n) => n % 65), WIDTHS), 0);
});

test("an alternation that shrinks has the half of its period", () => {
  const states = run((n) => 5e-9 * (-0.98) ** n);
  assert.equal(periodIn(COUNT, distances(states, WIDTHS), 1e-9), 1);
  const stays = run((n) => 5e-9 * (-1) ** n);
  assert.equal(periodIn(COUNT, distances(stays, WIDTHS), 1e-9), 2);
});

test("an approach to a period is recognised below its tolerance", () => {
  const apart = distances(run((n) => (n % 3) + 1e-6 * 0.98 ** n), WIDTHS);
  assert.equal(approached(COUNT, apart, 1e-5), 3);
  assert.equal(approached(COUNT, apart, 1e-9), 0);
  const stays = distances(run((n) => (n % 3) + 1e-6 * (n % 2)), WIDTHS);
  assert.notEqual(approached(COUNT, stays, 1e-5), 3);
});

test("convergence is told from a closed curve", () => {
  assert.ok(converges(COUNT, distances(run((n) => (n % 4) + 0.01 * 0.97 ** n), WIDTHS)));
  assert.ok(!converges(COUNT, distances(run((n) => Math.sin(n)), WIDTHS)));
});

test("distances are in half-widths, or in extents that are larger", () => {
  assert.equal(distances([[0], [1], [2]], [10])(0, 1), 0.1);
  assert.equal(distances([[0], [1], [2]], [1])(0, 1), 0.5);
  assert.equal(distances([[0], [NaN]], [null])(0, 1), NaN);
});

test("drawn values have the period that is seen", () => {
  const window = { state: [1], parameter: [], depth: 1 };
  const values = (value) => Float64Array.from({ length: 96 }, (_, n) => value(n));
  assert.equal(periodSeen(values((n) => n % 3), { coordinate: 0 }, window), 3);
  assert.equal(periodSeen(values((n) => 1e-12 * (n % 2)), { depth: 0 }, window), 1);
  assert.equal(periodSeen(values((n) => Math.sin(n)), { coordinate: 0 }, window), 0);
});

test("a cell has the class of the states on which it settles", () => {
  const states = run((n) => n % 2);
  assert.equal(settledClass(states, true, WIDTHS), 2);
  assert.equal(settledClass(run(() => 3), true, WIDTHS), 1);
  assert.equal(settledClass(run(() => 3), false, WIDTHS), WITHOUT_CONTACT);
  assert.equal(settledClass(run((n) => 0.05 * 0.97 ** n), true, WIDTHS), NOT_SETTLED);
  assert.equal(settledClass(run((n) => Math.sin(n)), true, WIDTHS), 0);
});

test("an attractor is known again at any of its states, and on the way to them", () => {
  const known = [];
  assert.equal(attractorOf(known, run((n) => n % 2), true, WIDTHS), 0);
  assert.equal(attractorOf(known, run((n) => (n + 1) % 2), true, WIDTHS), 0);
  assert.equal(attractorOf(known, run((n) => (n % 2) + 0.01 * 0.99 ** n), true, WIDTHS), 0);
  assert.equal(attractorOf(known, run(() => 5), false, WIDTHS), 1);
  assert.deepEqual(known.map(({ period, touches }) => [period, touches]), [[2, true], [1, false]]);
});

test("every cell of a grid is in a batch once for each fineness", () => {
  const counts = new Map();
  for (const { every, own, count } of batches(10, 7, 4)) {
    assert.equal(own.length, 4);
    for (const [column, row] of own.slice(0, count)) {
      const name = [every, column, row].join();
      counts.set(name, (counts.get(name) ?? 0) + 1);
    }
  }
  assert.ok([...counts.values()].every((count) => count === 1));
  assert.equal([...counts.keys()].filter((name) => name.startsWith("1,")).length, 70);
});

test("middles of cells divide a range evenly", () => {
  assert.deepEqual([0, 1, 2, 3].map((n) => middle([-1, 1], n, 4)), [-0.75, -0.25, 0.25, 0.75]);
});
