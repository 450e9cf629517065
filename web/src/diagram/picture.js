// The picture of a diagram: iterates, branches, strips, axes, the graze and the marker.

import { drawAxes, writeOver } from "../axes.js";
import { colour } from "../canvas.js";
import { clamp } from "../view.js";
import { GAP, STRIP, drawStrip, stripWords } from "./strip.js";

/** @import { Box, Pen, Point } from "../types" */
/** @import { DiagramPane } from "../panes/diagram.js" */

/** @typedef {(g: Pen, plot: Box, pane: DiagramPane) => void} Painter */

/**
 * Paints the part of the plot beyond the measured window of the parameter.
 * @type {Painter}
 */
const paintBeyond = (g, plot, { parameter, view }) => {
  if (parameter.width === null) return;
  const [left, right] = [-parameter.width, parameter.width].map((offset) =>
    clamp(view.toX(offset), plot.x, plot.x + plot.w),
  );
  g.fillStyle = colour("--panel");
  g.fillRect(plot.x, plot.y, left - plot.x, plot.h);
  g.fillRect(right, plot.y, plot.x + plot.w - right, plot.h);
};

/**
 * Paints branches and points of direct simulation, which belong to the graze's other parameters.
 * @type {Painter}
 */
const paintLayers = (g, plot, { othersMoved, view, show, branches }) => {
  if (othersMoved) return;
  /** @param {Point} point */
  const at = (point) => view.toPixels(point);
  g.save();
  g.beginPath();
  g.rect(plot.x, plot.y, plot.w, plot.h);
  g.clip();
  if (show.direct) branches.drawDirect(g, at);
  if (show.branches) branches.draw(g, at);
  g.restore();
};

/**
 * Paints the graze, the marker, and where its period ends.
 * @type {Painter}
 */
const paintLines = (g, plot, { view, marker, strips, graze }) => {
  /** @type {(offset: number, tone: string, dash: number[], width: number) => void} */
  const line = (offset, tone, dash, width) => {
    if (!(offset >= view.x[0] && offset <= view.x[1])) return;
    g.strokeStyle = colour(tone);
    g.lineWidth = width;
    g.setLineDash(dash);
    g.beginPath();
    g.moveTo(view.toX(offset), plot.y);
    g.lineTo(view.toX(offset), plot.y + plot.h + strips);
    g.stroke();
    g.setLineDash([]);
    g.lineWidth = 1;
  };
  if (graze !== null) line(graze, "--soft", [3, 3], 1);
  for (const { offset } of marker.reach ?? []) line(offset, "--accent", [6, 3], 1);
  if (marker.offset !== null) line(marker.offset, "--accent", [], 1.5);
  g.font = "11px system-ui, sans-serif";
  if (graze === null || !(view.x[0] < graze && view.x[1] > graze)) return;
  g.fillStyle = colour("--soft");
  g.textAlign = "center";
  writeOver(g, "graze", view.toX(graze), plot.y + 14);
};

/** @type {Painter} */
const paintStatus = (g, plot, { sweeps, status }) => {
  if (sweeps.done && sweeps.isEmpty) {
    g.textAlign = "center";
    g.fillStyle = colour("--ink");
    const words = "The orbit leaves the map's reach here.";
    writeOver(g, words, plot.x + plot.w / 2, plot.y + plot.h / 2);
  }
  if (!status) return;
  g.textAlign = "right";
  g.fillStyle = colour("--soft");
  writeOver(g, status, plot.x + plot.w - 6, plot.y + plot.h - 8);
};

/**
 * Paints a diagram.
 * @param {Pen} g
 * @param {DiagramPane} pane
 */
export function paintDiagram(g, pane) {
  const { plot, view, headings, strips, parameter } = pane;
  paintBeyond(g, plot, pane);
  if (view.y) {
    pane.density.draw(g, plot, view.axes);
    paintLayers(g, plot, pane);
  }
  for (const [n, heading] of headings.entries()) {
    const top = plot.y + plot.h + GAP + n * STRIP;
    const words = stripWords(heading, headings);
    /** @param {number} offset */
    const toX = (offset) => view.toX(offset);
    drawStrip(g, plot, pane.sweeps.sorted(heading), { top, words, toX });
  }
  const names = [`${parameter.symbol} − ${parameter.symbol}*`, pane.observe.text];
  drawAxes(g, plot, view.axes, names, { top: parameter, foot: strips });
  paintLines(g, plot, pane);
  view.paintBox(g);
  paintStatus(g, plot, pane);
}
