// A sweep of a diagram: the last state is carried from value to value.

import { going } from "./lanes.js";
import { periodSeen } from "./periods.js";

/** @import { Column, SweepRequest } from "../types" */
/** @import { LaneMap } from "./lanes.js" */

/** A sweep in as many stretches as there are lanes. */
class Sweep {
  /**
   * @param {LaneMap} map
   * @param {SweepRequest} request
   */
  constructor(map, request) {
    this.map = map;
    this.request = request;
    const { columns, from, to } = request;
    this.width = (to - from) / columns;
    this.stretch = Math.ceil(columns / map.lanes);
    this.down = request.heading === "down";
    /**
     * Last state of every column; null if its orbit escaped.
     * @type {(number[] | null)[]}
     */
    this.last = new Array(columns).fill(null);
  }

  /** @param {number} column */
  offset(column) {
    return this.request.from + (column + 0.5) * this.width;
  }

  /**
   * Column of a place on the way of the sweep.
   * @param {number} place
   */
  ordered(place) {
    return this.down ? this.request.columns - 1 - place : place;
  }

  /**
   * Sets the parameters of every lane, the swept one at these offsets.
   * @param {number[]} offsets
   */
  freeze(offsets) {
    const { parameters, axis } = this.request;
    this.map.freeze(offsets.map((offset) => parameters.with(axis, offset)));
  }

  /** States at the beginning of each stretch: from the end of the diagram to the view and on. */
  begin() {
    const { map } = this;
    const { start, anchor, columns } = this.request;
    let carried = start.slice();
    /** @param {number} value */
    const settle = (value) => {
      this.freeze(new Array(map.lanes).fill(value));
      map.start(new Array(map.lanes).fill(carried));
      map.iterate(300, false);
      carried = map.escaped(0)
        ? start.slice()
        : going(map.take(map.places.states, 0, map.dimension));
    };
    const entry = this.offset(this.ordered(0));
    if ((entry - anchor) * (this.down ? -1 : 1) > 0) {
      for (let n = 0; n <= 40; n++) settle(anchor + ((entry - anchor) * n) / 40);
    }
    return Array.from({ length: map.lanes }, (_, n) => {
      let first = carried;
      for (let part = 0; part < 4; part++) {
        const place = Math.min(columns - 1, Math.floor((n + part / 4) * this.stretch));
        settle(this.offset(this.ordered(place)));
        if (part === 0) first = carried;
      }
      return first;
    });
  }

  /**
   * Columns of every lane at one place of their stretches, and the states to carry on.
   * @param {number} place
   * @param {number[][]} states
   * @param {{ number: number, every: number, transient: number, keep: number }} pass
   */
  columns(place, states, pass) {
    const { map, request, stretch } = this;
    const { start, columns } = request;
    const taken = states.map((_, n) => this.ordered(Math.min(n * stretch + place, columns - 1)));
    const offsets = taken.map((column) => this.offset(column));
    this.freeze(offsets);
    map.start(states);
    map.iterate(pass.transient, false);
    const lost = states.map((_, n) => map.escaped(n));
    lost.forEach((is, n) => is && map.put(map.places.states, n, start));
    map.iterate(pass.keep + 1, true);
    /** @type {Column[]} */
    const found = [];
    const carried = states.map((_, n) => {
      const gone = lost[n] || map.escaped(n);
      const state = gone ? start.slice() : going(map.lastKept(n, pass.keep));
      if (n * stretch + place >= columns) return state;
      const values = gone ? new Float64Array(0) : map.observed(n, request.observe, pass.keep);
      found.push({
        offset: offsets[n],
        width: this.width * pass.every,
        values,
        state,
        outside: map.outside(n, request.parameters.with(request.axis, offsets[n])),
        touches: map.touches(n),
        gone,
        period: gone ? null : periodSeen(values, request.observe, map.data.window),
        pass: pass.number,
        column: taken[n],
      });
      if (pass.every === 1) this.last[taken[n]] = gone ? null : state;
      return state;
    });
    return { found, carried };
  }

  /**
   * Further iterates of as many columns as there are lanes.
   * @param {number} first
   */
  further(first) {
    const { map, last } = this;
    const { columns, keep, start, observe } = this.request;
    const lanes = Array.from({ length: map.lanes }, (_, n) => Math.min(first + n, columns - 1));
    this.freeze(lanes.map((column) => this.offset(column)));
    map.start(lanes.map((column) => last[column] ?? start));
    map.iterate(keep + 1, true);
    /** @type {Column[]} */
    const found = [];
    lanes.forEach((column, n) => {
      if (first + n >= columns || !last[column] || map.escaped(n)) return;
      const values = map.observed(n, observe, keep);
      const state = going(map.lastKept(n, keep));
      last[column] = state;
      const offset = this.offset(column);
      found.push({ offset, width: this.width, values, state, pass: 2, column });
    });
    return found;
  }
}

/**
 * Columns of a sweep: a preview, the sweep, then further iterates of every column. It yields the
 * columns found since the caller last took them, which `yield` returns.
 * @param {LaneMap} map
 * @param {SweepRequest} request
 * @returns {Generator<Column[] | undefined, void, boolean>}
 */
export function* sweep(map, request) {
  const { columns, transient, keep, more } = request;
  const own = new Sweep(map, request);
  const begun = own.begin();
  yield;
  /** @type {Column[]} */
  let found = [];
  const passes = [
    { number: 0, every: 8, transient: Math.min(300, transient), keep: Math.min(96, keep) },
    { number: 1, every: 1, transient, keep },
  ];
  for (const pass of passes) {
    let states = begun.map((state) => state.slice());
    for (let place = 0; place < own.stretch; place += pass.every) {
      const next = own.columns(place, states, pass);
      states = next.carried;
      found.push(...next.found);
      if (yield found) found = [];
    }
  }
  for (let n = 0; n < more; n++) {
    for (let first = 0; first < columns; first += map.lanes) {
      found.push(...own.further(first));
      if (yield found) found = [];
    }
  }
  yield found;
}
