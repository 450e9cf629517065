import assert from "node:assert/strict";
import { test } from "node:test";
import { ESCAPED, OUTSIDE, WITHOUT_CONTACT } from "../src/classes.js";
import { distanceTo, orbitsOf } from "../src/diagram/branches.js";
import { contactWords, multiplierWords, pointCommand, reachLines } from "../src/diagram/facts.js";
import { periodsInWords } from "../src/diagram/strip.js";
import { kindOf } from "../src/diagram/sweeps.js";
import { csvOf, shown, superscript, ticks, unpacked } from "../src/numbers.js";
import { extentOf } from "../src/panes/orbit-panel.js";
import { scaled } from "../src/view.js";

test("numbers are shown in few digits, with a proper minus and without idle zeros", () => {
  assert.equal(shown(0), "0");
  assert.equal(shown(-0.0555), "−0.0555");
  assert.equal(shown(1.23456789, 4), "1.235");
  assert.equal(shown(1.5e-4), "1.5e−4");
  assert.equal(shown(-2e5), "−2e5");
  assert.equal(shown(1200), "1200");
});

test("powers are written with superscript digits", () => {
  assert.equal(superscript(-12), "⁻¹²");
});

test("ticks are round values within the range, with labels that tell them apart", () => {
  const { values, label, power, step } = ticks(-1e-4, 1.5e-4, 5);
  assert.equal(power, -4);
  assert.ok(Math.abs(step - 5e-5) < 1e-18);
  assert.deepEqual(values.map(label), ["−1.0", "−0.5", "0.0", "0.5", "1.0", "1.5"]);
  const narrow = ticks(2.2471, 2.2472, 4, true);
  assert.equal(new Set(narrow.values.map(narrow.label)).size, narrow.values.length);
  assert.ok(narrow.values.every((value) => value >= 2.2471 - 1e-12 && value <= 2.2472 + 1e-12));
});

test("fields of CSV with commas, quotes or new lines are quoted", () => {
  assert.equal(csvOf([["a", "b,c"], [1, 'say "x"']]), 'a,"b,c"\n1,"say ""x"""\n');
});

test("doubles are unpacked bit by bit", () => {
  const text = Buffer.from(new Float64Array([1.5, -0, 1e-300]).buffer).toString("base64");
  assert.deepEqual([...unpacked(text)], [1.5, -0, 1e-300]);
});

test("points of a branch are offsets with the states of every return", () => {
  const numbers = new Float64Array([0.1, 1, 2, 3, 4, 0.2, 5, 6, 7, 8]);
  assert.deepEqual(orbitsOf(numbers, 2, 2), [
    { offset: 0.1, states: [[1, 2], [3, 4]] },
    { offset: 0.2, states: [[5, 6], [7, 8]] },
  ]);
});

test("the distance from a segment is that from its nearest point", () => {
  assert.equal(distanceTo([1, 1], [0, 0], [2, 0]), 1);
  assert.equal(distanceTo([5, 4], [0, 0], [2, 0]), 5);
  assert.equal(distanceTo([3, 4], [0, 0], [0, 0]), 5);
});

test("columns have the class of what ended them, then of their period", () => {
  const column = { period: 1, touches: false, outside: false, gone: false };
  assert.equal(kindOf(column), WITHOUT_CONTACT);
  assert.equal(kindOf({ ...column, touches: true }), 1);
  assert.equal(kindOf({ ...column, outside: true }), OUTSIDE);
  assert.equal(kindOf({ ...column, outside: true, gone: true }), ESCAPED);
  assert.equal(kindOf({ ...column, period: null, touches: true }), 0);
});

test("a diagram is described by its wide stretches of one period", () => {
  const columns = Array.from({ length: 40 }, (_, n) => ({
    offset: n / 10,
    period: n < 20 ? 1 : n < 24 ? 2 : 3,
    touches: true,
  }));
  assert.equal(
    periodsInWords(columns),
    "From left to right: period 1 from offset 0, period 3 from offset 2.4.",
  );
});

test("an itinerary of a period begins with its contacts; another is left as it is", () => {
  const depths = [[-1], [-1], [1], [1], [-1]];
  assert.match(contactWords(depths, 5), /^11000 /);
  assert.match(contactWords(depths, 0), /^00110 /);
  assert.match(contactWords(Array.from({ length: 64 }, () => [1]), 64), /^1{48}… /);
});

test("multipliers are told from the largest to those that are zero to rounding", () => {
  const words = multiplierWords([[1e-16, 0], [0.5, 0], [0.6, 0.8], [0.6, -0.8]]);
  assert.equal(words, "0.6 + 0.8 i, 0.6 − 0.8 i, 0.5, 0 to rounding");
  assert.equal(multiplierWords([]), "–");
});

test("an interval that ends at the graze says so without rounding", () => {
  const ends = [
    { offset: 1e-18, way: "graze", outside: false },
    { offset: 1e-3, way: "flip", outside: true },
  ];
  const lines = reachLines(ends, { name: "mu", symbol: "μ", grazing: 2, width: null }, 1);
  assert.equal(lines[0], "from μ = 2 (offset 0), graze: a contact begins or ends");
  assert.match(lines[1], /^to μ = 2\.001 \(offset 0\.001\), flip: /);
  assert.match(lines[1], /; outside the measured window$/);
});

test("a point of a diagram is a command with the offsets of all parameters", () => {
  const parameters = [{ name: "Q" }, { name: "beta" }];
  const orbit = { parameters: [1.13e-4, 0], depths: [[-1], [1], [-1]] };
  assert.equal(
    pointCommand("grazemap diagram my.toml", parameters, { ...orbit, period: 3 }),
    "grazemap orbits my.toml --at Q=0.000113,beta=0 --itinerary 010",
  );
  assert.equal(
    pointCommand("grazemap diagram my.toml", parameters, { ...orbit, period: 0 }),
    "grazemap orbits my.toml --at Q=0.000113,beta=0",
  );
});

test("values of one have a range about them, not one of rounding", () => {
  assert.deepEqual(extentOf([2, 2 + 1e-12]).map((end) => Math.round(end * 10)), [18, 22]);
  assert.ok(extentOf([0, 1])[0] < 0);
});

test("a zoom keeps the point about which it scales", () => {
  assert.deepEqual(scaled([0, 10], 2, 0.5), [1, 6]);
});
