// The strip below a diagram: the period at every value, in colours and, where there is room, words.

import { colour } from "../canvas.js";
import { ESCAPED, OUTSIDE, WITHOUT_CONTACT, classColour, classWords, isDark } from "../classes.js";
import { shown } from "../numbers.js";
import { clamp } from "../view.js";
import { kindOf } from "./sweeps.js";

/** @import { Box, Heading, Pen } from "../types" */
/** @import { KeptColumn } from "./sweeps.js" */

/** @typedef {{ kind: number, period: number | null, left: number, right: number }} Stretch */

/** Height of a strip, and its distance from the plot. */
export const STRIP = 14;
export const GAP = 6;

/**
 * Stretches of pixels with one class and period.
 * @param {KeptColumn[]} columns from left to right
 * @param {Box} plot
 * @param {(offset: number) => number} toX
 */
function stretchesOf(columns, plot, toX) {
  /** @type {Stretch[]} */
  const found = [];
  for (const column of columns) {
    const { offset, width, period = null } = column;
    const kind = kindOf(column);
    const [left, right] = [offset - width / 2, offset + width / 2].map((end) =>
      clamp(toX(end), plot.x, plot.x + plot.w),
    );
    const last = found.at(-1);
    if (last?.kind === kind && last.period === period && left - last.right < 1) last.right = right;
    else found.push({ kind, period, left, right });
  }
  return found;
}

/**
 * Words for a stretch, the longest first.
 * @param {Stretch} stretch
 */
const wordsOf = ({ kind, period }) => {
  if (kind === ESCAPED) return ["leaves the map’s reach", "leaves"];
  const short = period ? `${period}` : "no period";
  if (kind === WITHOUT_CONTACT) return ["1, no contact", short];
  return kind === OUTSIDE ? [`${short}, outside the window`, short] : [short];
};

/**
 * Draws the strip of a sweep.
 * @param {Pen} g
 * @param {Box} plot
 * @param {KeptColumn[]} columns from left to right
 * @param {{ top: number, words: string, toX: (offset: number) => number }} strip
 */
export function drawStrip(g, plot, columns, { top, words, toX }) {
  g.fillStyle = colour("--soft");
  g.font = "11px system-ui, sans-serif";
  g.textAlign = "right";
  g.fillText(words, plot.x - 4, top + 11);
  const stretches = stretchesOf(columns, plot, toX);
  /** @param {number} kind */
  const toneOf = (kind) => (kind === ESCAPED ? colour("--rule") : classColour(kind));
  for (const { kind, left, right } of stretches) {
    g.fillStyle = toneOf(kind);
    g.fillRect(left, top + 1, right - left, STRIP - 2);
  }
  g.textAlign = "center";
  for (const stretch of stretches) {
    const { kind, left, right } = stretch;
    const text = wordsOf(stretch).find((own) => 8 + 6 * own.length < right - left);
    if (!text) continue;
    if (kind === ESCAPED) g.fillStyle = colour("--ink");
    else g.fillStyle = isDark(classColour(kind)) ? "#fff" : "#000";
    g.fillText(text, (left + right) / 2, top + 11);
  }
}

/**
 * Periods of a sweep in words.
 * @param {KeptColumn[]} columns from left to right
 */
export function periodsInWords(columns) {
  /** @type {{ kind: number, from: number, count: number }[]} */
  const runs = [];
  for (const column of columns) {
    const kind = kindOf(column);
    const last = runs.at(-1);
    if (last?.kind === kind) last.count += 1;
    else runs.push({ kind, from: column.offset, count: 1 });
  }
  const wide = runs.filter(({ count }) => count >= 8).slice(0, 12);
  const words = wide.map(({ kind, from }) => `${classWords(kind)} from offset ${shown(from, 3)}`);
  return `From left to right: ${words.join(", ")}.`;
}

/**
 * Label of the strip of a sweep.
 * @param {Heading} heading
 * @param {Heading[]} headings
 */
export const stripWords = (heading, headings) =>
  headings.length > 1 ? `period ${heading === "up" ? "↑" : "↓"}` : "period";
