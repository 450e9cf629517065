// Cells of a plane, painted, and kept by number: what the chart and the basins show.

import { contextOf } from "./canvas.js";
import { element } from "./dom.js";
import { csvOf } from "./numbers.js";

/** @import { Cell, Point, Range } from "./types" */

export class Grid {
  /**
   * @param {number} columns
   * @param {number} rows
   */
  constructor(columns, rows) {
    this.columns = columns;
    this.rows = rows;
    this.picture = element("canvas", { width: columns, height: rows });
    /** @type {Range} */
    this.x = [0, 1];
    /** @type {Range} */
    this.y = [0, 1];
    /** @type {Map<number, number>} */
    this.cells = new Map();
  }

  /**
   * Forgets all classes; the picture stays until it is painted over.
   * @param {Range} x
   * @param {Range} y
   */
  begin(x, y) {
    [this.x, this.y] = [[...x], [...y]];
    this.cells = new Map();
  }

  /**
   * Takes cells in.
   * @param {Cell[]} found
   * @param {(kind: number) => string} toneOf
   */
  take(found, toneOf) {
    const g = contextOf(this.picture);
    for (const [column, row, every, kind] of found) {
      g.fillStyle = toneOf(kind);
      g.fillRect(column, this.rows - row - every, every, every);
      for (let n = 0; n < every * every; n++)
        this.cells.set((row + Math.floor(n / every)) * this.columns + column + (n % every), kind);
    }
  }

  /** Classes that some cell has. */
  get kinds() {
    return [...new Set(this.cells.values())];
  }

  /**
   * Class at a point; undefined outside and before it is known.
   * @param {Point} point
   */
  kindAt([a, b]) {
    const column = Math.floor(((a - this.x[0]) / (this.x[1] - this.x[0])) * this.columns);
    const row = Math.floor(((b - this.y[0]) / (this.y[1] - this.y[0])) * this.rows);
    return column < 0 || column >= this.columns || row < 0 || row >= this.rows
      ? undefined
      : this.cells.get(row * this.columns + column);
  }

  /**
   * Middle of a cell.
   * @param {number} cell
   * @returns {Point}
   */
  middle(cell) {
    const [column, row] = [cell % this.columns, Math.floor(cell / this.columns)];
    return [
      this.x[0] + ((column + 0.5) / this.columns) * (this.x[1] - this.x[0]),
      this.y[0] + ((row + 0.5) / this.rows) * (this.y[1] - this.y[0]),
    ];
  }

  /**
   * Cells as CSV.
   * @param {string[]} names
   * @param {(middle: Point, kind: number) => (string | number)[]} row
   */
  csv(names, row) {
    const cells = [...this.cells].sort(([a], [b]) => a - b);
    return csvOf([names, ...cells.map(([cell, kind]) => row(this.middle(cell), kind))]);
  }
}
