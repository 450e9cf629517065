// Sweeps of a diagram: what is asked of the workers, and the columns that they find.

import { ESCAPED, OUTSIDE, WITHOUT_CONTACT } from "../classes.js";

/**
 * @import { Column, Heading, LiveDiagram, NamedObservable, Parameter, SweepMessage,
 *   SweepRequest } from "../types"
 */
/** @import { Live } from "../live.js" */

/**
 * Column with the values of all passes so far.
 * @typedef {Column & { chunks: Float64Array[] }} KeptColumn
 */

/**
 * What is asked for.
 * @typedef {object} Asked
 * @property {number} columns
 * @property {[number, number]} x
 * @property {number[]} base offsets of all parameters
 * @property {NamedObservable} observe
 * @property {Heading[]} headings
 */

/**
 * @typedef {object} SweepHooks
 * @property {() => Asked} asked
 * @property {() => void} begun
 * @property {(name: string, columns: Column[]) => void} took
 * @property {() => void} finished
 */

/** Least number of iterates of a column in the end. */
const ITERATES = 1200;

/**
 * Class of the orbit of a column.
 * @param {Column} column
 */
export const kindOf = ({ gone, outside, period, touches }) => {
  if (gone) return ESCAPED;
  if (outside) return OUTSIDE;
  return period === 1 && !touches ? WITHOUT_CONTACT : (period ?? 0);
};

export class Sweeps {
  /**
   * @param {Live} live
   * @param {LiveDiagram} diagram
   * @param {SweepHooks} hooks
   */
  constructor(live, diagram, hooks) {
    this.live = live;
    this.diagram = diagram;
    this.hooks = hooks;
    /**
     * Columns by their number, of each sweep: by heading, and with "map " before it those of the
     * map itself if one of lower orders is drawn.
     * @type {Record<string, Map<number, KeptColumn>>}
     */
    this.layers = {};
    /** Least and largest value. */
    this.low = Infinity;
    this.high = -Infinity;
    this.number = 0;
    /** Number of the module that is drawn. */
    this.chosen = 0;
    this.started = 0;
    /** Milliseconds to the first columns and to all, and those of each sweep. */
    this.first = 0;
    this.whole = 0;
    /** @type {Record<string, number>} */
    this.times = {};
    /** Iterates a second, in millions. */
    this.rate = 0;
    this.done = false;
    /** @type {Set<string>} */
    this.finished = new Set();
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
    this.worker = this.#worker("");
    /** @type {Worker | null} */
    this.other = null;
  }

  /**
   * Worker whose sweeps have names that begin so.
   * @param {string} before
   */
  #worker(before) {
    return this.live.workers.start(
      /** @param {SweepMessage<Column>} message */ (message) => this.#receive(before, message),
    );
  }

  /** Names of the sweeps that are seen, those beneath the others first. */
  get names() {
    const { headings } = this.hooks.asked();
    const own = ["down", "up"].filter((name) => headings.some((heading) => heading === name));
    return this.chosen ? [...own.map((heading) => "map " + heading), ...own] : own;
  }

  get isEmpty() {
    return !(this.low <= this.high);
  }

  /**
   * Columns of a sweep from left to right.
   * @param {string} name
   */
  sorted(name) {
    return [...(this.layers[name]?.values() ?? [])].sort((a, b) => a.offset - b.offset);
  }

  /**
   * Draws one of the modules.
   * @param {number} chosen
   */
  choose(chosen) {
    this.chosen = chosen;
    this.live.workers.begin(this.worker, chosen);
  }

  /** Asks for the iterates of what is seen, after some milliseconds. */
  compute(delay = 0) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.number += 1;
      this.started = performance.now();
      this.first = 0;
      this.done = false;
      this.times = {};
      this.finished.clear();
      this.hooks.begun();
      this.layers = {};
      [this.low, this.high] = [Infinity, -Infinity];
      this.#post(this.worker);
      if (this.chosen) this.#beneath();
    }, delay);
  }

  /** Asks for the map's own iterates, beneath those of lower orders. */
  #beneath() {
    this.other ??= this.#worker("map ");
    this.#post(this.other);
  }

  /** @param {Worker} worker */
  #post(worker) {
    worker.postMessage({ kind: "sweeps", number: this.number, sweeps: this.#requests() });
  }

  /** @returns {SweepRequest[]} */
  #requests() {
    const { axis, from, to, transient, start } = this.diagram;
    const { columns, x, base, observe, headings } = this.hooks.asked();
    const keep = Math.min(this.diagram.keep, 400);
    return headings.map((heading) => ({
      course: "sweep",
      axis,
      parameters: base,
      columns,
      from: x[0],
      to: x[1],
      observe: { depth: observe.depth, coordinate: observe.coordinate },
      transient,
      keep,
      more: Math.max(0, Math.ceil(ITERATES / keep) - 1),
      start,
      heading,
      anchor: heading === "up" ? Math.min(from, to) : Math.max(from, to),
    }));
  }

  /**
   * @param {string} before
   * @param {SweepMessage<Column>} message
   */
  #receive(before, message) {
    if (message.kind === "ready") {
      if (before) this.#beneath();
      else this.compute();
      return;
    }
    if (message.number !== this.number) return;
    const name = before + message.heading;
    if (message.kind === "found") {
      this.first ||= performance.now() - this.started;
      this.#take(name, message.found);
      this.hooks.took(name, message.found);
      return;
    }
    if (!before) {
      this.times[name] = message.time;
      this.rate = message.iterates / message.time / 1000;
    }
    this.finished.add(name);
    if (!this.names.every((own) => this.finished.has(own))) return;
    this.whole = performance.now() - this.started;
    this.done = true;
    this.hooks.finished();
  }

  /**
   * Takes columns in: those of a later pass replace a preview, those of the last add to it.
   * @param {string} name
   * @param {Column[]} found
   */
  #take(name, found) {
    const layer = (this.layers[name] ??= new Map());
    for (const column of found) {
      const known = layer.get(column.column);
      if (column.pass === 2 && known) {
        known.chunks.push(column.values);
        known.state = column.state;
        continue;
      }
      layer.set(column.column, { ...column, chunks: [column.values] });
      for (const value of column.values) {
        if (value < this.low) this.low = value;
        if (value > this.high) this.high = value;
      }
    }
  }

  /**
   * Column at an offset, of a sweep that is seen.
   * @param {number} offset
   */
  at(offset) {
    for (const heading of this.hooks.asked().headings) {
      for (const column of this.layers[heading]?.values() ?? []) {
        if (!column.gone && Math.abs(column.offset - offset) <= 0.5 * column.width) return column;
      }
    }
    return null;
  }

  /**
   * All iterates as CSV.
   * @param {Parameter} parameter
   */
  csv({ grazing }) {
    // NOTE: a million rows; text of rows is faster than rows of fields.
    const rows = ["heading,offset,value,outside,observed"];
    for (const heading of this.hooks.asked().headings) {
      for (const { offset, outside, chunks } of this.sorted(heading)) {
        const begins = `${heading},${offset},${grazing + offset},${Number(Boolean(outside))},`;
        for (const chunk of chunks) for (const value of chunk) rows.push(begins + value);
      }
    }
    return rows.join("\n") + "\n";
  }
}
