// Branches of periodic orbits and points of direct simulation, as layers over the iterates.

import { writeOver } from "../axes.js";
import { colour } from "../canvas.js";
import { unpacked } from "../numbers.js";

/** @import { LiveBranch, NamedObservable, Pen, Point } from "../types" */
/** @import { Live } from "../live.js" */

/** @typedef {{ itinerary: string, period: number, stable: boolean, points: Point[] }} Curve */
/** @typedef {{ text: string, at: Point }} Label */
/** @typedef {{ stable: boolean, points: Float64Array }} Line */

/**
 * Offset and states of the returns of every point of a line.
 * @param {Float64Array} numbers
 * @param {number} period
 * @param {number} dimension
 */
export const orbitsOf = (numbers, period, dimension) => {
  const width = 1 + period * dimension;
  return Array.from({ length: Math.floor(numbers.length / width) }, (_, n) => ({
    offset: numbers[n * width],
    states: Array.from({ length: period }, (__, k) => {
      const from = n * width + 1 + k * dimension;
      return [...numbers.subarray(from, from + dimension)];
    }),
  }));
};

/**
 * Distance of a point from a segment.
 * @param {Point} point
 * @param {Point} from
 * @param {Point} to
 */
export const distanceTo = ([x, y], [a, b], [c, d]) => {
  const length = (c - a) ** 2 + (d - b) ** 2;
  const along = ((x - a) * (c - a) + (y - b) * (d - b)) / (length || 1);
  const share = Math.min(1, Math.max(0, along));
  return Math.hypot(a + share * (c - a) - x, b + share * (d - b) - y);
};

export class Branches {
  /**
   * @param {Live} live
   * @param {number} axis
   */
  constructor(live, axis) {
    this.live = live;
    this.axis = axis;
    /** @type {(Omit<LiveBranch, "lines"> & { lines: Line[] })[]} */
    this.all = live.data.branches
      .filter((branch) => branch.axis === axis)
      .map((branch) => ({
        ...branch,
        lines: branch.lines.map((line) => ({ ...line, points: unpacked(line.points) })),
      }));
    /** @type {Curve[]} */
    this.curves = [];
    /** @type {Label[]} */
    this.labels = [];
    /** Points by direct simulation of what is drawn. @type {Point[]} */
    this.direct = [];
    /** @type {NamedObservable | null} */
    this.observe = null;
  }

  /**
   * Makes the curves of what is drawn: depths by the map, at the points of the branches.
   * @param {NamedObservable} observe
   */
  async trace(observe) {
    this.observe = observe;
    const { data, workers, observables } = this.live;
    const { axis } = this;
    this.direct = data.direct
      .filter((own) => own.axis === axis && observables[own.observe] === observe)
      .flatMap(({ points }) => orbitsOf(unpacked(points), 1, 1))
      .map(({ offset, states }) => [offset, states[0][0]]);
    const dimension = data.coordinates.length;
    const zero = data.parameters.map(() => 0);
    const orbits = this.all.map(({ period, lines, special }) => ({
      lines: lines.map(({ points }) => orbitsOf(points, period, dimension)),
      special: special.map(({ offset, state }) => ({ offset, states: [state] })),
    }));
    const points = orbits
      .flatMap(({ lines, special }) => [...lines.flat(), ...special])
      .flatMap(({ offset, states }) =>
        states.map((state) => ({ parameters: zero.with(axis, offset), state })),
      );
    let values = points.map(({ state }) => state[observe.coordinate ?? 0]);
    const { depth } = observe;
    if (depth !== undefined && points.length) {
      const { values: images } = await workers.ask("images", { points });
      const width = dimension + data.passages.length;
      values = points.map((_, n) => -images[n * width + dimension + depth]);
    }
    if (this.observe !== observe) return false;
    this.#join(points.map(({ parameters }, n) => [parameters[axis], values[n]]));
    return true;
  }

  /**
   * Joins points to curves, one for every return of a line.
   * @param {Point[]} points
   */
  #join(points) {
    let next = 0;
    const width = 1 + this.live.data.coordinates.length;
    [this.curves, this.labels] = [[], []];
    for (const { itinerary, period, lines, special } of this.all) {
      for (const { stable, points: own } of lines) {
        const count = own.length / (1 + period * (width - 1));
        const taken = points.slice(next, next + count * period);
        next += count * period;
        for (let n = 0; n < period; n++) {
          const line = taken.filter((_, k) => k % period === n);
          this.curves.push({ itinerary, period, stable, points: line });
        }
      }
      for (const { label } of special) this.labels.push({ text: label, at: points[next++] });
    }
  }

  /**
   * Least and largest value of curves between two offsets; of stable ones alone if told so.
   * @param {number} from
   * @param {number} to
   * @param {boolean} stableOnly
   */
  extent(from, to, stableOnly) {
    let [low, high] = [Infinity, -Infinity];
    for (const { stable, points } of this.curves) {
      if (stableOnly && !stable) continue;
      for (const [offset, value] of points) {
        if (offset < from || offset > to) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    return [low, high];
  }

  /**
   * @param {Pen} g
   * @param {(point: Point) => Point} at
   */
  drawDirect(g, at) {
    g.fillStyle = colour("--direct");
    for (const point of this.direct) {
      const [x, y] = at(point);
      g.fillRect(x - 1, y - 1, 2, 2);
    }
  }

  /**
   * @param {Pen} g
   * @param {(point: Point) => Point} at
   */
  draw(g, at) {
    const ink = colour("--ink");
    // Many unstable branches lie side by side: faint, they leave the iterates to be seen.
    const faint = ink + "88";
    for (const { stable, points } of this.curves) {
      g.strokeStyle = stable ? ink : faint;
      g.setLineDash(stable ? [] : [4, 5]);
      g.lineWidth = stable ? 1.6 : 0.7;
      g.beginPath();
      for (const point of points) g.lineTo(...at(point));
      g.stroke();
    }
    g.setLineDash([]);
    g.lineWidth = 1;
    g.strokeStyle = g.fillStyle = ink;
    g.font = "11px system-ui, sans-serif";
    g.textAlign = "left";
    for (const { x, y, words } of this.#together(at)) {
      g.beginPath();
      g.arc(x, y, 3.5, 0, 7);
      g.stroke();
      writeOver(g, [...words].join(", "), x + 6, y - 6);
      g.strokeStyle = ink;
    }
  }

  /**
   * Labels with their places; points that fall together have one.
   * @param {(point: Point) => Point} at
   */
  #together(at) {
    /** @type {{ x: number, y: number, words: Set<string> }[]} */
    const written = [];
    for (const { text, at: point } of this.labels) {
      const [x, y] = at(point);
      const near = written.find((own) => Math.hypot(own.x - x, own.y - y) < 12);
      if (near) near.words.add(text);
      else written.push({ x, y, words: new Set([text]) });
    }
    return written;
  }

  /**
   * Branch that passes near a point, in words.
   * @param {Point} point
   * @param {(point: Point) => Point} at
   */
  near(point, at) {
    const place = at(point);
    /** @type {Curve | null} */
    let nearest = null;
    let least = 8;
    for (const curve of this.curves) {
      const places = curve.points.map(at);
      for (let n = 1; n < places.length; n++) {
        const distance = distanceTo(place, places[n - 1], places[n]);
        if (distance < least) [nearest, least] = [curve, distance];
      }
    }
    if (!nearest) return null;
    const { itinerary, period, stable } = nearest;
    return `branch ${itinerary} of period ${period}, ${stable ? "stable" : "unstable"}`;
  }
}
