// The iterates of a diagram, counted by pixel and painted as a density.

import { place } from "../axes.js";
import { colour, contextOf, sharpness } from "../canvas.js";
import { element } from "../dom.js";

/** @import { Box, Column, Pen, Range } from "../types" */
/** @import { Sweeps } from "./sweeps.js" */

/** @typedef {{ counts: Uint8Array, outside: Uint8Array }} Counts by pixel; by column of pixels */
/** @typedef {{ x: Range, y: Range }} Ranges */

/** Colours of the style: up, down, both, outside the window, the map beneath lower orders. */
const TONES = ["--up", "--down", "--both", "--outside", "--reference"];

/**
 * Colours of a pixel by its count, from pale to full, of each tone.
 * @returns {number[][]}
 */
const shades = () =>
  TONES.map((name) => {
    const tone = colour(name);
    const [red, green, blue] = [1, 3, 5].map((n) => parseInt(tone.slice(n, n + 2), 16));
    return Array.from({ length: 16 }, (_, count) => {
      const opaque = Math.min(255, Math.round(90 + 45 * Math.log2(1 + count)));
      return ((opaque << 24) | (blue << 16) | (green << 8) | red) >>> 0;
    });
  });

/** Counts of the iterates of one view. */
class Sums {
  /**
   * @param {number} w
   * @param {number} h
   * @param {Ranges} ranges
   */
  constructor(w, h, ranges) {
    this.w = w;
    this.h = h;
    this.ranges = ranges;
    /** @type {Record<string, Counts>} */
    this.layers = {};
    this.image = new ImageData(w, h);
    /** Columns of pixels with counts, and those painted before their last. */
    this.fresh = new Uint8Array(w);
    this.stale = new Uint8Array(w).fill(1);
  }

  /**
   * Pixels of a column, from and to.
   * @param {Column} column
   * @returns {[number, number]}
   */
  #pixels({ offset, width }) {
    const [from, to] = this.ranges.x;
    const scale = this.w / (to - from);
    const [middle, half] = [(offset - from) * scale, (width * scale) / 2];
    const left = Math.max(0, Math.round(middle - half));
    return [left, Math.min(this.w, Math.max(left + 1, Math.round(middle + half)))];
  }

  /**
   * Adds values of a column; those of the first passes replace others.
   * @param {string} name
   * @param {Column} column
   * @param {Float64Array} values
   * @param {boolean} replaces
   */
  add(name, column, values, replaces) {
    const { w, h } = this;
    const own = (this.layers[name] ??= {
      counts: new Uint8Array(w * h),
      outside: new Uint8Array(w),
    });
    const [left, right] = this.#pixels(column);
    if (replaces) {
      own.counts.fill(0, left * h, right * h);
      own.outside.fill(Number(Boolean(column.outside)), left, right);
      this.fresh.fill(1, left, right);
    }
    this.stale.fill(1, left, right);
    const [low, high] = this.ranges.y;
    const scale = h / (high - low);
    for (let n = 0; n < values.length; n++) {
      const y = h - 1 - Math.floor((values[n] - low) * scale);
      if (y < 0 || y >= h) continue;
      for (let x = left; x < right; x++) {
        const at = x * h + y;
        if (own.counts[at] < 255) own.counts[at]++;
      }
    }
  }

  /**
   * Paints the columns of pixels whose counts have changed: up, down, the map beneath them.
   * @param {string[]} seen names of the sweeps
   */
  paint(seen) {
    const { w, h } = this;
    const pixels = new Uint32Array(this.image.data.buffer);
    const tones = shades();
    const none = { counts: new Uint8Array(w * h), outside: new Uint8Array(w) };
    const [up, down, mapUp, mapDown] = ["up", "down", "map up", "map down"].map(
      (name) => (seen.includes(name) && this.layers[name]) || none,
    );
    for (let x = 0; x < w; x++) {
      if (!this.stale[x]) continue;
      for (let y = 0; y < h; y++) {
        const at = x * h + y;
        const [a, b] = [up.counts[at], down.counts[at]];
        let count = a + b;
        let tone = (a && !up.outside[x] ? 1 : 0) + (b && !down.outside[x] ? 2 : 0) - 1;
        if (tone < 0) tone = 3;
        if (!count) {
          tone = 4;
          count = mapUp.counts[at] + mapDown.counts[at];
        }
        pixels[y * w + x] = count ? tones[tone][Math.min(15, count)] : 0;
      }
    }
    this.stale.fill(0);
  }
}

export class Density {
  /** @param {Sweeps} sweeps */
  constructor(sweeps) {
    this.sweeps = sweeps;
    /** @type {Sums | null} */
    this.sums = null;
    this.picture = element("canvas");
    /** Ranges of the picture. @type {Ranges | null} */
    this.painted = null;
    /** Picture of an earlier view, until this one has columns. */
    this.old = /** @type {(Ranges & { picture: HTMLCanvasElement }) | null} */ (null);
  }

  /**
   * Counts columns that were found.
   * @param {string} name
   * @param {Column[]} found
   */
  take(name, found) {
    for (const column of found) this.sums?.add(name, column, column.values, column.pass < 2);
  }

  /** Forgets the counts. */
  clear() {
    this.sums = null;
  }

  /** Paints all columns again, whose colours have changed. */
  refresh() {
    this.sums?.stale.fill(1);
  }

  /** Keeps the picture, to be seen until another view has columns. */
  keep() {
    const { sums, painted, picture } = this;
    if (!sums || !painted || !picture.width) return;
    if (sums.fresh.reduce((sum, is) => sum + is, 0) < 0.5 * sums.w) return;
    const copy = element("canvas", { width: picture.width, height: picture.height });
    contextOf(copy).drawImage(picture, 0, 0);
    this.old = { picture: copy, ...painted };
  }

  /**
   * Brings the picture up to date.
   * @param {Box} plot
   * @param {Ranges} ranges
   */
  update(plot, ranges) {
    const [w, h] = [plot.w, plot.h].map((side) => Math.round(side * sharpness()));
    /** @type {(a: Range, b: Range) => boolean} */
    const same = (a, b) => a[0] === b[0] && a[1] === b[1];
    let { sums } = this;
    const { x, y } = ranges;
    const holds = sums?.w === w && sums.h === h && same(sums.ranges.x, x) && same(sums.ranges.y, y);
    if (!sums || !holds) {
      this.keep();
      sums = this.sums = new Sums(w, h, ranges);
      for (const name of this.sweeps.names) {
        for (const column of this.sweeps.layers[name]?.values() ?? []) {
          for (const [n, values] of column.chunks.entries())
            sums.add(name, column, values, n === 0);
        }
      }
    }
    if (!sums.stale.includes(1)) return;
    sums.paint(this.sweeps.names);
    [this.picture.width, this.picture.height] = [w, h];
    contextOf(this.picture).putImageData(sums.image, 0, 0);
    this.painted = sums.ranges;
  }

  /**
   * Draws the picture, over that of an earlier view where it has no columns yet.
   * @param {Pen} g
   * @param {Box} plot
   * @param {[Range, Range]} ranges
   */
  draw(g, plot, ranges) {
    const { old, sums } = this;
    if (old && sums) {
      const [x0, y1] = place(plot, ranges, [old.x[0], old.y[1]]);
      const [x1, y0] = place(plot, ranges, [old.x[1], old.y[0]]);
      g.save();
      g.beginPath();
      const step = plot.w / sums.w;
      for (let x = 0; x < sums.w; x++)
        if (!sums.fresh[x]) g.rect(plot.x + x * step, plot.y, step, plot.h);
      g.clip();
      g.drawImage(old.picture, x0, y1, x1 - x0, y0 - y1);
      g.restore();
    }
    g.drawImage(this.picture, plot.x, plot.y, plot.w, plot.h);
  }
}
