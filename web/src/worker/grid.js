// Cells of a plane in passes that become finer: classes over two parameters, and basins.

import { ESCAPED, NOT_SETTLED, OUTSIDE, WITHOUT_CONTACT } from "../classes.js";
import {
  APPROACH_TOLERANCE,
  LONGEST_PERIOD,
  approached,
  converges,
  distances,
  periodOf,
} from "./periods.js";

/** @import { Attractor, BasinRequest, Cell, ChartRequest, GridRequest } from "../types" */
/** @import { LaneMap } from "./lanes.js" */

/** Distance, in half-widths, below which periodic states are of one attractor. */
const SAME_ATTRACTOR = 1e-5;

/**
 * Coordinate of the middle of cell `number` of `count` between two ends.
 * @param {[number, number]} ends
 * @param {number} number
 * @param {number} count
 */
export const middle = (ends, number, count) =>
  ends[0] + ((number + 0.5) / count) * (ends[1] - ends[0]);

/**
 * Cells of 4, 2 and 1 columns and rows, in batches of lanes. The last cell of a batch is repeated
 * if lanes are left; `count` is the number without repeats.
 * @param {number} columns
 * @param {number} rows
 * @param {number} lanes
 */
export function* batches(columns, rows, lanes) {
  for (const every of [4, 2, 1]) {
    /** @type {[number, number][]} */
    const all = [];
    for (let row = 0; row < rows; row += every) {
      for (let column = 0; column < columns; column += every) all.push([column, row]);
    }
    for (let first = 0; first < all.length; first += lanes) {
      const count = Math.min(lanes, all.length - first);
      const own = Array.from({ length: lanes }, (_, n) => all[first + Math.min(n, count - 1)]);
      yield { every, own, count };
    }
  }
}

/**
 * Cells of a request, batch by batch: `classes(points, every)` returns the classes of the middles
 * of the cells of a batch.
 * @param {LaneMap} map
 * @param {GridRequest} request
 * @param {(points: [number, number][], every: number) => number[]} classes
 * @returns {Generator<Cell[], void, boolean>}
 */
function* cells(map, request, classes) {
  const { x, y, columns, rows } = request;
  /** @type {Cell[]} */
  let found = [];
  for (const { every, own, count } of batches(columns, rows, map.lanes)) {
    const half = every / 2 - 0.5;
    /** @type {[number, number][]} */
    const points = own.map(([column, row]) => [
      middle(x, column + half, columns),
      middle(y, row + half, rows),
    ]);
    const kinds = classes(points, every);
    for (const [n, [column, row]] of own.slice(0, count).entries())
      found.push([column, row, every, kinds[n]]);
    if (yield found) found = [];
  }
  yield found;
}

/**
 * Class of kept states that stayed within the window.
 * @param {number[][]} states
 * @param {boolean} touches
 * @param {(number | null)[]} widths
 */
export function settledClass(states, touches, widths) {
  const apart = distances(states, widths);
  const count = states.length;
  const period = periodOf(states, widths) || approached(count, apart, APPROACH_TOLERANCE);
  if (!period && converges(count, apart)) return NOT_SETTLED;
  return period === 1 && !touches ? WITHOUT_CONTACT : period;
}

/**
 * Classes of what the map settles on, over two parameters.
 * @param {LaneMap} map
 * @param {ChartRequest} request
 */
export function chart(map, request) {
  const { axes, start } = request;
  const kept = 2 * Math.min(request.longest, LONGEST_PERIOD);
  return cells(map, request, (points, every) => {
    const transient = every === 1 ? request.transient : Math.min(request.transient, 500);
    const parameters = points.map(([a, b]) => request.parameters.with(axes[0], a).with(axes[1], b));
    map.freeze(parameters);
    map.start(points.map(() => start));
    map.iterate(transient, false);
    const lost = points.map((_, n) => map.escaped(n));
    lost.forEach((is, n) => is && map.put(map.places.states, n, start));
    map.iterate(kept, true);
    return parameters.map((own, n) =>
      lost[n] || map.escaped(n) || map.outside(n, own)
        ? OUTSIDE
        : settledClass(map.kept(n, kept), map.touches(n), map.data.window.state),
    );
  });
}

/**
 * Attractor that the map takes every state of a plane to, as its number in the request's list.
 * @param {LaneMap} map
 * @param {BasinRequest} request
 */
export function basin(map, request) {
  const { axes, parameters, state, attractors } = request;
  const kept = 2 * request.longest;
  const widths = map.data.window.state;
  return cells(map, request, (points) => {
    map.freeze(new Array(map.lanes).fill(parameters));
    const starts = points.map(([a, b]) => state.with(axes[0], a).with(axes[1], b));
    map.start(starts);
    map.iterate(request.transient, false);
    const lost = starts.map((_, n) => map.escaped(n));
    // A start may lie outside by itself; extents hold the states that follow it.
    const left = starts.map(
      (start, n) =>
        map.outside(n, parameters) ||
        start.some((value, k) => Math.abs(value) > (widths[k] ?? Infinity)),
    );
    lost.forEach((is, n) => is && map.put(map.places.states, n, state));
    map.iterate(kept, true);
    return starts.map((_, n) => {
      if (lost[n] || map.escaped(n)) return ESCAPED;
      if (left[n] || map.outside(n, parameters)) return OUTSIDE;
      return attractorOf(attractors, map.kept(n, kept), map.touches(n), widths);
    });
  });
}

/**
 * Number of the attractor of an orbit's states among those known, to which it is added if new.
 * @param {Attractor[]} known
 * @param {number[][]} states
 * @param {boolean} touches
 * @param {(number | null)[]} widths
 */
export function attractorOf(known, states, touches, widths) {
  const period = periodOf(states, widths);
  /** @type {(a: number[], b: number[]) => boolean} */
  const near = (a, b) =>
    a.every((value, n) => {
      const scale = Math.max(widths[n] ?? 0, Math.abs(value));
      return Math.abs(value - b[n]) <= SAME_ATTRACTOR * scale;
    });
  /** @type {(a: number[], b: number[]) => number} */
  const distance = (a, b) =>
    Math.max(...a.map((value, n) => Math.abs(value - b[n]) / (widths[n] ?? 1)));
  // A multiplier of modulus near 1 leaves an orbit long on its way: it comes nearer.
  /** @param {Attractor} other */
  const approaches = (other) => {
    const far = other.states.map((own) => distance(own, states[0]));
    const first = far.indexOf(Math.min(...far));
    const turns = 2 * other.period * Math.floor((states.length - 1) / (2 * other.period));
    const then = distance(other.states[first], states[turns]);
    return turns > 0 && far[first] < 0.05 && then < 0.98 * far[first];
  };
  const number = known.findIndex(
    (other) =>
      (other.period === period &&
        (!period || other.states.some((own) => near(own, states[0])))) ||
      (other.period && approaches(other)),
  );
  if (number >= 0) return number;
  return known.push({ period, touches, states: states.slice(0, period || undefined) }) - 1;
}
