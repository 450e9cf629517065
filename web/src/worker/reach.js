// The interval of a parameter in which a stable periodic orbit keeps its contacts.

import { beyond } from "./lanes.js";
import { eigenvalues, identity, solve, spectralRadius, times } from "./linear.js";

/** @import { Complex, MeasuredWindow, ReachAnswer, ReachQuestion, ReachWay } from "../types" */
/** @import { LaneMap } from "./lanes.js" */

/**
 * @typedef {object} PeriodicOrbit
 * @property {number[]} parameters
 * @property {number[][]} states
 * @property {number[][]} depths
 * @property {Complex[]} multipliers
 * @property {string} contacts 1 for each passage with contact, else 0, one return after another
 */

/**
 * Returns of a state over one period, its last image and the product of the Jacobians.
 * @param {LaneMap} map
 * @param {number[]} state
 * @param {number} period
 */
function flown(map, state, period) {
  const states = [];
  const depths = [];
  let product = identity(map.dimension);
  let own = state;
  for (let n = 0; n < period; n++) {
    const step = map.step(own);
    product = times(step.rows, product);
    states.push(own);
    depths.push(step.depths);
    own = step.image;
  }
  return { states, depths, product, image: own };
}

/**
 * Periodic orbit near a state, by Newton's method on one period; null if there is none.
 * @param {LaneMap} map
 * @param {number[]} parameters
 * @param {number[]} state
 * @param {number} period
 * @returns {PeriodicOrbit | null}
 */
export function periodicOrbit(map, parameters, state, period) {
  const widths = map.data.window.state;
  map.freezeOne(parameters);
  let from = state;
  let last = Infinity;
  for (let turn = 0; turn < 30; turn++) {
    const { states, depths, product, image } = flown(map, from, period);
    const residual = image.map((value, n) => value - from[n]);
    const matrix = product.map((row, i) => row.map((v, j) => (i === j ? 1 - v : -v)));
    const step = solve(matrix, residual);
    if (!step?.every(Number.isFinite)) return null;
    const scales = from.map((value, n) => widths[n] ?? Math.abs(value) + 1e-6);
    const size = Math.max(...step.map((value, n) => Math.abs(value) / scales[n]));
    // Rounding ends the fall of the steps.
    if (size < 1e-15 || (size < 1e-11 && size >= last)) {
      const signs = depths.map((row) => row.map((depth) => Number(depth > 0)).join(""));
      const multipliers = eigenvalues(product);
      return { parameters, states, depths, multipliers, contacts: signs.join() };
    }
    if (!(size < 1e3)) return null;
    last = size;
    from = from.map((value, n) => value + step[n]);
  }
  return null;
}

/**
 * Bifurcation that ends a stable orbit.
 * @param {PeriodicOrbit} orbit last orbit that holds
 * @param {PeriodicOrbit} first orbit where the search began
 * @param {PeriodicOrbit | null} failed orbit beyond the end
 * @param {MeasuredWindow} window
 * @returns {ReachWay}
 */
export function ending(orbit, first, failed, window) {
  /** @param {PeriodicOrbit} own */
  const sizes = (own) => own.depths.flat().map(Math.abs);
  const deepest = Math.max(window.depth ?? 0, ...sizes(first));
  const radius = spectralRadius(orbit.multipliers);
  if (radius > 0.99) {
    const [re, im] =
      orbit.multipliers.find(([a, b]) => Math.hypot(a, b) === radius) ?? orbit.multipliers[0];
    return Math.abs(im) > 1e-6 ? "torus" : re < 0 ? "flip" : "fold";
  }
  return Math.min(...sizes(orbit)) < 1e-5 * deepest || failed ? "graze" : "lost";
}

/**
 * Whether a periodic orbit leaves the measured window.
 * @param {PeriodicOrbit} orbit
 * @param {MeasuredWindow} window
 */
export const isOutside = ({ parameters, states, depths }, window) =>
  parameters.some((value, n) => beyond(value, window.parameter[n])) ||
  states.some((state) => state.some((value, n) => beyond(value, window.state[n]))) ||
  depths.flat().some((value) => !(value <= (window.depth ?? Infinity)));

/**
 * Last orbit on the way to one end of the parameter, by steps that shorten until the border is
 * known.
 * @param {LaneMap} map
 * @param {ReachQuestion} question
 * @param {PeriodicOrbit} first
 * @param {number} end
 * @returns {{ orbit: PeriodicOrbit, way: ReachWay }}
 */
function follow(map, { axis, step, parameters, period }, first, end) {
  const least = 1e-13 * Math.max(step, Math.abs(parameters[axis]));
  const way = Math.sign(end - parameters[axis]);
  /** @param {PeriodicOrbit} own */
  const value = (own) => own.parameters[axis];
  let here = first;
  let length = step;
  /** @type {PeriodicOrbit | null} */
  let before = null;
  /** @type {PeriodicOrbit | null} */
  let failed = null;
  for (let turn = 0; turn < 2000 && length > least; turn++) {
    const left = (end - value(here)) * way;
    if (left <= least) return { orbit: here, way: "end" };
    length = Math.min(length, left);
    const next = length < left ? value(here) + way * length : end;
    // Along the line through the last two.
    const [now, past] = [here.states[0], before?.states[0] ?? here.states[0]];
    const share = before ? (next - value(here)) / (value(here) - value(before)) : 0;
    const from = now.map((v, n) => v + share * (v - past[n]));
    const orbit = periodicOrbit(map, parameters.with(axis, next), from, period);
    if (orbit && holds(orbit, first)) {
      [before, here] = [here, orbit];
      length = failed ? length : 1.5 * length;
    } else {
      failed = orbit ?? failed;
      length /= 2;
    }
  }
  return { orbit: here, way: ending(here, first, failed, map.data.window) };
}

/**
 * Whether an orbit is stable and has the contacts of the first.
 * @param {PeriodicOrbit} orbit
 * @param {PeriodicOrbit} first
 */
const holds = (orbit, first) =>
  orbit.contacts === first.contacts && spectralRadius(orbit.multipliers) < 1;

/**
 * Ends of the interval in which a stable periodic orbit keeps its contacts; none if it is not
 * stable.
 * @param {LaneMap} map
 * @param {ReachQuestion} question
 * @returns {ReachAnswer}
 */
export function reach(map, question) {
  const { axis, low, high, parameters, states, period } = question;
  const first = periodicOrbit(map, parameters, states[0], period);
  if (!first || !holds(first, first)) return { ends: [] };
  const ends = [low, high].map((end) => {
    const { orbit, way } = follow(map, question, first, end);
    const outside = isOutside(orbit, map.data.window);
    return { offset: orbit.parameters[axis], way, outside };
  });
  return { ends };
}
