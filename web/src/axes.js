// Axes of a plot: round values of offsets below and on the left, of values on the other sides.

import { colour } from "./canvas.js";
import { superscript, ticks } from "./numbers.js";

/** @import { Box, Parameter, Pen, Point, Range } from "./types" */

/**
 * Place of a point in a plot.
 * @param {Box} room
 * @param {[Range, Range]} ranges
 * @param {Point | number[]} point
 * @returns {Point}
 */
export const place = (room, [rx, ry], [a, b]) => [
  room.x + ((a - rx[0]) / (rx[1] - rx[0])) * room.w,
  room.y + room.h - ((b - ry[0]) / (ry[1] - ry[0])) * room.h,
];

/**
 * Words with a rim of the paper, legible over everything.
 * @param {Pen} g
 * @param {string} text
 * @param {number} x
 * @param {number} y
 */
export const writeOver = (g, text, x, y) => {
  g.strokeStyle = colour("--paper");
  g.lineWidth = 3;
  g.strokeText(text, x, y);
  g.lineWidth = 1;
  g.fillText(text, x, y);
};

/** @type {(g: Pen, text: string, x: number, y: number, align: CanvasTextAlign) => void} */
const write = (g, text, x, y, align) => {
  g.textAlign = align;
  g.fillText(text, x, y);
};

/** @type {(g: Pen, text: string, x: number, y: number) => void} */
const writeSideways = (g, text, x, y) => {
  g.save();
  g.translate(x, y);
  g.rotate(-Math.PI / 2);
  write(g, text, 0, 0, "center");
  g.restore();
};

/**
 * Writes a label in the middle of a tick, or beside it at the right border.
 * @type {(g: Pen, room: Box, text: string, x: number, y: number) => void}
 */
const writeAt = (g, room, text, x, y) => {
  const half = 3.3 * text.length;
  write(g, text, Math.min(x, room.x + room.w + 10 - half), y, "center");
};

/**
 * Name of an axis with the power of ten that its labels leave out.
 * @param {string} name
 * @param {number} power
 */
const named = (name, power) => name + (power ? ` / 10${superscript(power)}` : "");

/**
 * Values of a parameter along the top.
 * @param {Pen} g
 * @param {Box} room
 * @param {[Range, Range]} ranges
 * @param {Parameter} parameter
 */
function drawTop(g, room, ranges, parameter) {
  const [from, to] = ranges[0].map((end) => parameter.grazing + end);
  // Fewer if they are long; none if doubles cannot tell them apart.
  let count = Math.floor(room.w / 60);
  let found = ticks(from, to, Math.max(1, count), true);
  const fits = () => found.values.length * (7 * found.label(from).length + 14) <= room.w;
  while (count > 0 && !fits()) found = ticks(from, to, Math.max(1, --count), true);
  if (!count || found.step < 1e-15 * Math.abs(parameter.grazing)) return;
  for (const value of found.values) {
    const [x] = place(room, ranges, [value - parameter.grazing, 0]);
    g.fillRect(x - 0.5, room.y - 4, 1, 4);
    writeAt(g, room, found.label(value), x, room.y - 7);
  }
  write(g, named(parameter.symbol, found.power), room.x + room.w / 2, room.y - 23, "center");
}

/**
 * Values of a parameter on the right.
 * @param {Pen} g
 * @param {Box} room
 * @param {[Range, Range]} ranges
 * @param {Parameter} parameter
 * @param {number} beside pixels from the plot to the name
 */
function drawRight(g, room, ranges, parameter, beside) {
  const [from, to] = ranges[1].map((end) => parameter.grazing + end);
  const found = ticks(from, to, Math.max(1, Math.floor(room.h / 50)), true);
  if (found.step < 1e-15 * Math.abs(parameter.grazing)) return;
  const edge = room.x + room.w;
  for (const value of found.values) {
    const [, y] = place(room, ranges, [0, value - parameter.grazing]);
    g.fillRect(edge, y - 0.5, 4, 1);
    write(g, found.label(value), edge + 7, y + 4, "left");
  }
  const name = named(parameter.symbol, found.power);
  writeSideways(g, name, edge + beside, room.y + room.h / 2);
}

/**
 * Draws a frame with offsets below, `foot` pixels lower, and on the left; on the other sides the
 * values of the parameters that they are offsets of.
 * @param {Pen} g
 * @param {Box} room
 * @param {[Range, Range]} ranges
 * @param {string[]} labels
 * @param {{ top?: Parameter, right?: Parameter, beside?: number, foot?: number }} sides
 */
export function drawAxes(g, room, ranges, labels, { top, right, beside = 76, foot = 0 } = {}) {
  g.font = "12px system-ui, sans-serif";
  g.lineWidth = 1;
  g.strokeStyle = colour("--soft");
  g.strokeRect(room.x, room.y, room.w, room.h);
  g.fillStyle = colour("--ink");
  const x = ticks(...ranges[0], Math.max(4, Math.floor(room.w / 80)));
  const bottom = room.y + room.h + foot;
  for (const value of x.values) {
    const [at] = place(room, ranges, [value, 0]);
    g.fillRect(at - 0.5, bottom, 1, 4);
    writeAt(g, room, x.label(value), at, bottom + 16);
  }
  write(g, named(labels[0], x.power), room.x + room.w / 2, bottom + 34, "center");
  const y = ticks(...ranges[1], Math.max(4, Math.floor(room.h / 50)));
  for (const value of y.values) {
    const [, at] = place(room, ranges, [0, value]);
    g.fillRect(room.x - 4, at - 0.5, 4, 1);
    write(g, y.label(value), room.x - 7, at + 4, "right");
  }
  writeSideways(g, named(labels[1], y.power), 13, room.y + room.h / 2);
  g.fillStyle = colour("--soft");
  if (top) drawTop(g, room, ranges, top);
  if (right) drawRight(g, room, ranges, right, beside);
}
