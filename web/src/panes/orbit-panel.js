// A panel that draws lines and points of the orbit at a marker.

import { drawAxes, place } from "../axes.js";
import { colour, drawOn, savers } from "../canvas.js";
import { drawnAgain, element, pictured, toolbar } from "../dom.js";
import { csvOf } from "../numbers.js";

/** @import { Box, Pen, Range } from "../types" */

/**
 * @typedef {object} Line
 * @property {number[][]} points
 * @property {string} tone name of a colour of the style
 * @property {boolean} [joined]
 * @property {boolean} [bare] without its points
 */

/** Height of a panel, in pixels. */
const PANEL = 230;

/**
 * Size of a panel's canvas.
 * @param {HTMLCanvasElement} canvas
 * @returns {[number, number]}
 */
export const panelSize = (canvas) => [canvas.clientWidth || 300, PANEL];

/**
 * Plot of a panel.
 * @param {HTMLCanvasElement} canvas
 * @returns {Box}
 */
export const panelRoom = (canvas) => ({
  x: 62,
  y: 10,
  w: panelSize(canvas)[0] - 76,
  h: PANEL - 50,
});

/**
 * Range of values with an edge.
 * @param {number[]} values
 * @returns {Range}
 */
export const extentOf = (values) => {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  // A period of one has an extent of rounding.
  const moves = high - low > 1e-6 * Math.max(Math.abs(high), Math.abs(low));
  const edge = moves ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1e-12;
  return [low - edge, high + edge];
};

export class OrbitPanel {
  /**
   * @param {string} what
   * @param {() => string} name of a file
   */
  constructor(what, name) {
    this.canvas = pictured("img", what[0].toUpperCase() + what.slice(1));
    /** @type {Line[]} */
    this.lines = [];
    this.names = ["", ""];
    this.pale = false;
    this.paint = this.paint.bind(this);
    const csv = () => this.#csv();
    this.tools = toolbar(...savers(what, name, { canvas: this.canvas, paint: this.paint, csv }));
    const title = element("h3", { textContent: what[0].toUpperCase() + what.slice(1) });
    this.node = element("div", {}, title, this.canvas, this.tools);
    drawnAgain(this.canvas, () => this.#draw());
  }

  /**
   * Shows lines.
   * @param {Line[]} lines
   * @param {string[]} names of both axes
   * @param {boolean} pale whether the orbit is outside the measured window
   */
  show(lines, names, pale) {
    [this.lines, this.names, this.pale] = [lines, names, pale];
    this.#draw();
  }

  #draw() {
    drawOn(this.canvas, panelSize(this.canvas), this.paint);
  }

  /** @param {Pen} g */
  paint(g) {
    if (!this.lines.length) return;
    const room = panelRoom(this.canvas);
    const all = this.lines.flatMap(({ points }) => points);
    /** @type {[Range, Range]} */
    const ranges = [extentOf(all.map(([x]) => x)), extentOf(all.map(([, y]) => y))];
    drawAxes(g, room, ranges, this.names);
    for (const { points, tone, joined, bare } of this.lines) {
      g.fillStyle = g.strokeStyle = colour(this.pale ? "--outside" : tone);
      if (joined) {
        g.beginPath();
        for (const point of points) g.lineTo(...place(room, ranges, point));
        g.stroke();
      }
      for (const point of bare ? [] : points) {
        const [x, y] = place(room, ranges, point);
        g.fillRect(x - 1.5, y - 1.5, 3, 3);
      }
    }
  }

  #csv() {
    const rows = this.lines.flatMap(({ points }, n) => points.map((point) => [n + 1, ...point]));
    return csvOf([["line", ...this.names], ...rows]);
  }
}
