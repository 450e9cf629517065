// What the live panes of a page share.

/** @import { Data, NamedObservable } from "./types" */
/** @import { Workers } from "./workers.js" */
/** @import { DiagramPane } from "./panes/diagram.js" */
/** @import { ChartPane } from "./panes/chart.js" */

export class Live {
  /**
   * @param {Data} data
   * @param {Workers} workers
   */
  constructor(data, workers) {
    this.data = data;
    this.workers = workers;
    /** @type {(DiagramPane | ChartPane)[]} */
    this.panes = [];
    const { passages, coordinates } = data;
    /** @type {NamedObservable[]} */
    this.observables = [
      ...passages.map((name, depth) => ({
        text: passages.length > 1 ? `gap h at “${name}”` : "gap h",
        depth,
      })),
      ...coordinates.map((_, coordinate) => ({ text: this.offsetOf(coordinate), coordinate })),
    ];
  }

  /**
   * Label of a coordinate's offset.
   * @param {number} coordinate
   */
  offsetOf(coordinate) {
    const { symbol } = this.data.coordinates[coordinate];
    return `${symbol} − ${symbol}*`;
  }
}
