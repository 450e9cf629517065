// The part of a plane that a plot shows: zoom, pan, keys and history, the same in all panes.

import { place } from "./axes.js";
import { colour } from "./canvas.js";
import { button } from "./dom.js";

/** @import { Box, Pen, Point, Range } from "./types" */

/**
 * What a pane hands to its view.
 * @typedef {object} Hooks
 * @property {() => Box} plot
 * @property {[number, number]} least shortest ranges
 * @property {(delay: number) => void} changed computes what is seen, after some milliseconds
 * @property {() => void} redraw
 * @property {() => (number | undefined)[] | null} marker point about which keys zoom
 * @property {(point: Point) => void} click point in the plane
 * @property {(point: Point) => void} hover point in the plane
 * @property {(point: Point) => boolean} [grips] whether a press in pixels takes the marker
 * @property {(point: Point) => void} [drag] moves the marker to a point in the plane
 * @property {(x: Range | null) => void} [boxed] tells of a box that is being drawn; null: let go
 * @property {(event: KeyboardEvent) => Record<string, () => void>} keys actions by key
 */

/**
 * Press that is being held: its pixels, the ranges then, and what it does.
 * @typedef {{ x: number, y: number, ranges: View["ranges"], does: "box" | "pan" | "mark" }} Grip
 */

/** Height in pixels below which a box chooses a range of the horizontal axis alone. */
const FLAT = 24;
/** Most views that are kept to go back to. */
const KEPT = 50;
/** Milliseconds within which moves that follow each other are one. */
const TOGETHER = 500;

/** @type {(ends: Range, middle: number, factor: number) => Range} */
export const scaled = ([low, high], middle, factor) => [
  middle + (low - middle) * factor,
  middle + (high - middle) * factor,
];

/** @type {(value: number, low: number, high: number) => number} */
export const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

export class View {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ x: Range, y: Range | null }} home y is null if the pane chooses the height
   * @param {Hooks} hooks
   */
  constructor(canvas, home, hooks) {
    this.canvas = canvas;
    this.home = home;
    this.hooks = hooks;
    /** @type {Range} */
    this.x = [...home.x];
    /** @type {Range | null} */
    this.y = home.y && [...home.y];
    /** Whether the pane chooses the height. */
    this.auto = home.y === null;
    /** @type {{ x: Range, y: Range | null, auto: boolean }[]} */
    this.past = [];
    /** @type {{ x: number, y: number, x1: number, y1: number } | null} */
    this.box = null;
    /** @type {Grip | null} */
    this.grip = null;
    this.moved = -Infinity;
    this.undo = button("back", "Back to the view before", () => this.back());
    this.undo.disabled = true;
    this.#listen();
  }

  /** Copy of both ranges. @returns {{ x: Range, y: Range | null }} */
  get ranges() {
    return { x: [...this.x], y: this.y && [...this.y] };
  }

  /** Range of each axis, of an undecided height 0 to 1. @returns {[Range, Range]} */
  get axes() {
    return [this.x, this.y ?? [0, 1]];
  }

  /** @param {Point | number[]} point */
  toPixels(point) {
    return place(this.hooks.plot(), this.axes, point);
  }

  /** @param {number} a */
  toX(a) {
    return this.toPixels([a, 0])[0];
  }

  /**
   * @param {Point} pixels
   * @returns {Point}
   */
  fromPixels([x, y]) {
    const plot = this.hooks.plot();
    const [a, b] = this.axes;
    return [
      a[0] + ((x - plot.x) / plot.w) * (a[1] - a[0]),
      b[0] + ((plot.y + plot.h - y) / plot.h) * (b[1] - b[0]),
    ];
  }

  /** @returns {Point} */
  get middle() {
    const [a, b] = this.axes;
    return [(a[0] + a[1]) / 2, (b[0] + b[1]) / 2];
  }

  /**
   * Shows other ranges; y is null if the height stays.
   * @param {Range} x
   * @param {Range | null} y
   * @param {number} delay
   */
  look(x, y, delay) {
    const [leastX, leastY] = this.hooks.least;
    if (!(x[1] - x[0] > leastX) || (y && !(y[1] - y[0] > leastY))) return;
    if (!(delay > 0 && performance.now() - this.moved < TOGETHER))
      this.past.push({ ...this.ranges, auto: this.auto });
    this.past = this.past.slice(-KEPT);
    this.undo.disabled = false;
    this.moved = delay > 0 ? performance.now() : -Infinity;
    this.x = x;
    if (y) {
      this.y = y;
      this.auto = false;
    }
    this.hooks.redraw();
    this.hooks.changed(delay);
  }

  /** Goes back to the view before. */
  back() {
    const last = this.past.pop();
    if (!last) return;
    Object.assign(this, last);
    this.undo.disabled = !this.past.length;
    this.moved = -Infinity;
    this.hooks.redraw();
    this.hooks.changed(0);
  }

  /** Shows the whole. */
  reset() {
    const { x, y } = this.home;
    this.look([...x], y && [...y], 0);
    this.auto = y === null;
  }

  /**
   * Scales about a point, else about the marker, else about the middle.
   * @param {number} factor
   * @param {(number | undefined)[]} [point]
   */
  zoom(factor, point, onlyX = false) {
    const about = point ?? this.hooks.marker() ?? [];
    const x = scaled(this.x, about[0] ?? this.middle[0], factor);
    const y = onlyX || !this.y ? null : scaled(this.y, about[1] ?? this.middle[1], factor);
    this.look(x, y, 60);
  }

  /**
   * Moves by shares of the ranges.
   * @param {number} across
   */
  shift(across) {
    const by = across * (this.x[1] - this.x[0]);
    this.look([this.x[0] + by, this.x[1] + by], null, 60);
  }

  /** Buttons that zoom and go back. @param {string} what */
  buttons(what) {
    return [
      button("+", "Zoom in", () => this.zoom(0.6)),
      button("−", "Zoom out", () => this.zoom(1 / 0.6)),
      this.undo,
      button("whole", `Show the whole ${what}`, () => this.reset()),
    ];
  }

  /**
   * Pixels of the box that is being drawn; a flat one is as high as the plot.
   * @returns {Box | null}
   */
  get boxPixels() {
    if (!this.box) return null;
    const plot = this.hooks.plot();
    const { x, y, x1, y1 } = this.box;
    const [left, right] = [x, x1].map((end) => clamp(end, plot.x, plot.x + plot.w));
    const [top, bottom] = [y, y1].map((end) => clamp(end, plot.y, plot.y + plot.h));
    const across = { x: Math.min(left, right), w: Math.abs(right - left) };
    return Math.abs(y1 - y) <= FLAT
      ? { ...across, y: plot.y, h: plot.h }
      : { ...across, y: Math.min(top, bottom), h: Math.abs(bottom - top) };
  }

  /** Ranges of the box that is being drawn. @returns {[Range, Range | null]} */
  get #boxRanges() {
    const box = this.boxPixels ?? this.hooks.plot();
    const [left, top] = this.fromPixels([box.x, box.y]);
    const [right, bottom] = this.fromPixels([box.x + box.w, box.y + box.h]);
    const flat = !this.box || Math.abs(this.box.y1 - this.box.y) <= FLAT;
    return [[left, right], flat ? null : [bottom, top]];
  }

  /** @param {Pen} g */
  paintBox(g) {
    const box = this.boxPixels;
    if (!box) return;
    g.fillStyle = colour("--accent") + "33";
    g.strokeStyle = colour("--accent");
    g.fillRect(box.x, box.y, box.w, box.h);
    g.strokeRect(box.x, box.y, box.w, box.h);
  }

  /** Lets go of a drag. */
  cancel() {
    this.grip = this.box = null;
    this.hooks.boxed?.(null);
    this.hooks.redraw();
  }

  /** @type {(point: Point, event: PointerEvent) => void} */
  #press([x, y], event) {
    const marks = this.hooks.grips?.([x, y]);
    const does = marks ? "mark" : event.shiftKey ? "pan" : "box";
    this.grip = { x, y, ranges: this.ranges, does };
  }

  /** @param {Point} point */
  #move(point) {
    const plot = this.hooks.plot();
    const [x, y] = point;
    const { grip } = this;
    if (!grip) {
      if (x >= plot.x && x <= plot.x + plot.w) this.hooks.hover(this.fromPixels(point));
    } else if (grip.does === "mark") {
      this.hooks.drag?.(this.#within(point));
    } else if (grip.does === "pan") {
      const { x: across, y: up } = grip.ranges;
      const dx = ((grip.x - x) / plot.w) * (across[1] - across[0]);
      const dy = up ? ((y - grip.y) / plot.h) * (up[1] - up[0]) : 0;
      this.look([across[0] + dx, across[1] + dx], up && [up[0] + dy, up[1] + dy], 60);
    } else if (Math.hypot(x - grip.x, y - grip.y) > 5) {
      this.box = { x: grip.x, y: grip.y, x1: x, y1: y };
      this.hooks.boxed?.(this.#boxRanges[0]);
      this.hooks.redraw();
    }
  }

  /**
   * Point in the plane of pixels moved into the plot.
   * @param {Point} point
   */
  #within([x, y]) {
    const plot = this.hooks.plot();
    return this.fromPixels([clamp(x, plot.x, plot.x + plot.w), y]);
  }

  /** @param {Point} point */
  #release(point) {
    const held = this.grip;
    this.grip = null;
    if (!held || held.does === "pan") return;
    const plot = this.hooks.plot();
    if (held.does === "mark") {
      this.hooks.click(this.#within(point));
    } else if (this.box) {
      [this.box.x1, this.box.y1] = point;
      const ranges = this.#boxRanges;
      this.box = null;
      this.hooks.boxed?.(null);
      this.look(...ranges, 0);
    } else if (point[0] >= plot.x && point[0] <= plot.x + plot.w) {
      this.hooks.click(this.fromPixels(point));
    }
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const closer = () => this.zoom(0.6);
    const reset = () => this.reset();
    /** @type {Record<string, () => void>} */
    const actions = {
      "+": closer,
      "=": closer,
      "-": () => this.zoom(1 / 0.6),
      0: reset,
      Home: reset,
      Escape: () => this.cancel(),
      Backspace: () => this.back(),
      PageUp: () => this.shift(-0.25),
      PageDown: () => this.shift(0.25),
      ...this.hooks.keys(event),
    };
    const action = actions[event.key];
    if (!action || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    action();
  }

  #listen() {
    const { canvas } = this;
    /** @type {(event: MouseEvent) => Point} */
    const point = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      this.#press(point(event), event);
    });
    canvas.addEventListener("pointermove", (event) => this.#move(point(event)));
    canvas.addEventListener("pointerup", (event) => this.#release(point(event)));
    canvas.addEventListener("pointercancel", () => this.cancel());
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener(
      "wheel",
      (event) => {
        // The page scrolls over a picture that is not being worked with.
        if (document.activeElement !== canvas && !event.ctrlKey) return;
        event.preventDefault();
        const factor = Math.exp(Math.sign(event.deltaY) * 0.25);
        this.zoom(factor, this.fromPixels(point(event)), event.altKey);
      },
      { passive: false },
    );
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }
}
