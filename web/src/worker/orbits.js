// Answers about single orbits: images, a settled orbit with its multipliers, the speed of the map.

import { eigenvalues, identity, spectralRadius, times } from "./linear.js";
import { LONGEST_PERIOD, periodOf } from "./periods.js";

/**
 * @import { ImagesQuestion, OrbitQuestion, ProbeAnswer, ProbeQuestion, SpeedQuestion,
 *   ValuesAnswer } from "../types"
 */
/** @import { LaneMap } from "./lanes.js" */

/**
 * Puts one point into every lane.
 * @param {LaneMap} map
 * @param {{ parameters: number[], state: number[] }} point
 */
function startAll(map, { parameters, state }) {
  map.start(new Array(map.lanes).fill(state));
  map.freeze(new Array(map.lanes).fill(parameters));
}

/**
 * Multipliers of a periodic orbit and the largest Lyapunov exponent of any, by Jacobians along it.
 * @param {LaneMap} map
 * @param {number[]} parameters
 * @param {number[][]} states
 * @param {number} period 0 for an orbit without
 */
function stability(map, parameters, states, period) {
  map.freezeOne(parameters);
  let product = identity(map.dimension);
  if (period) {
    for (const state of states.slice(0, period)) product = times(map.step(state).rows, product);
    const multipliers = eigenvalues(product);
    return { multipliers, exponent: Math.log(spectralRadius(multipliers)) / period };
  }
  let tangent = states[0].map((_, n) => 1 / (n + 1));
  let exponent = 0;
  for (const state of states) {
    const { rows } = map.step(state);
    const moved = rows.map((row) => row.reduce((sum, v, i) => sum + v * tangent[i], 0));
    const size = Math.hypot(...moved) || 1e-300;
    exponent += Math.log(size / Math.hypot(...tangent));
    tangent = moved.map((v) => v / size);
  }
  return { multipliers: [], exponent: exponent / states.length };
}

/**
 * Orbit on which the map settles at one value of the parameters.
 * @param {LaneMap} map
 * @param {ProbeQuestion} question
 * @returns {ProbeAnswer}
 */
export function probe(map, question) {
  const { parameters } = question;
  startAll(map, question);
  map.iterate(question.transient, false);
  const lost = map.escaped(0);
  const count = 2 * LONGEST_PERIOD;
  map.iterate(count + 1, true);
  if (lost || map.escaped(0)) {
    const nothing = { outside: true, period: 0, exponent: NaN };
    return { parameters, gone: true, ...nothing, multipliers: [], states: [], depths: [] };
  }
  const states = map.kept(0, count);
  const { places, record, dimension, lanes, passages } = map;
  // The depth in a record is that of the state before the step.
  const depths = states.map((_, n) =>
    map.take(places.records + (n + 1) * record + 8 * dimension * lanes, 0, passages),
  );
  const outside = map.outside(0, parameters);
  const period = periodOf(states, map.data.window.state);
  const stable = stability(map, parameters, states, period);
  return { parameters, gone: false, outside, period, ...stable, states, depths };
}

/**
 * Images of a state one after another, with depths, as `grazemap image --iterations` writes them.
 * @param {LaneMap} map
 * @param {OrbitQuestion} question
 * @returns {ValuesAnswer}
 */
export function orbit(map, question) {
  startAll(map, question);
  const { width } = map;
  const values = new Float64Array(question.count * width);
  for (let first = 0; first < question.count; first += map.records) {
    const count = Math.min(map.records, question.count - first);
    map.iterate(count, true);
    for (let n = 0; n < count; n++) {
      const row = map.take(map.places.records + n * map.record, 0, width);
      values.set(row, (first + n) * width);
    }
  }
  return { values };
}

/**
 * Image of every point, each with its own parameters, and its depths.
 * @param {LaneMap} map
 * @param {ImagesQuestion} question
 * @returns {ValuesAnswer}
 */
export function images(map, { points }) {
  const { lanes, width } = map;
  const values = new Float64Array(points.length * width);
  for (let first = 0; first < points.length; first += lanes) {
    const last = points.length - 1;
    const own = Array.from({ length: lanes }, (_, n) => points[Math.min(first + n, last)]);
    map.freeze(own.map(({ parameters }) => parameters));
    map.start(own.map(({ state }) => state));
    map.iterate(1, true);
    for (let n = 0; n < lanes && first + n < points.length; n++)
      values.set(map.take(map.places.records, n, width), (first + n) * width);
  }
  return { values };
}

/**
 * Milliseconds that so many iterates take that are not kept.
 * @param {LaneMap} map
 * @param {SpeedQuestion} question
 */
export function speed(map, { parameters, count }) {
  startAll(map, { parameters, state: map.data.coordinates.map(() => 0) });
  const began = performance.now();
  map.iterate(Math.ceil(count / map.lanes), false);
  return { time: performance.now() - began };
}
