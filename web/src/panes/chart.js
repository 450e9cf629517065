// A live chart: what the map settles on over two parameters.

import { drawAxes, place, writeOver } from "../axes.js";
import { colour, drawOn, savers } from "../canvas.js";
import { PERIODS, classColour, classWords } from "../classes.js";
import {
  drawnAgain,
  element,
  nextFrame,
  pictured,
  readout,
  tellLegend,
  toolbar,
} from "../dom.js";
import { Grid } from "../grid.js";
import { shown } from "../numbers.js";
import { View } from "../view.js";

/** @import { Box, Cell, LiveChart, Pen, Point, SweepMessage } from "../types" */
/** @import { Live } from "../live.js" */

const [COLUMNS, ROWS] = [160, 120];

const HINT =
  "Drag a box to zoom in, click to go to these parameters in the diagrams above, double click " +
  "for the whole; the wheel zooms after a click. Keys: arrows move the marker, + and − zoom, " +
  "0 shows the whole, Backspace the view before. By the map alone, each cell from the same start.";

export class ChartPane {
  /**
   * @param {Live} live
   * @param {HTMLElement} host
   * @param {LiveChart} chart
   */
  constructor(live, host, chart) {
    this.live = live;
    this.chart = chart;
    this.across = live.data.parameters[chart.axes[0]];
    this.upwards = live.data.parameters[chart.axes[1]];
    const names = `${this.across.name} and ${this.upwards.name}`;
    const keys = "Arrow keys move the marker, plus and minus zoom, 0 shows the whole.";
    const about = `Chart of the periods of the map over ${names}. ${keys}`;
    this.canvas = pictured("application", about);
    this.canvas.tabIndex = 0;
    this.readout = readout();
    this.legend = element("div", { className: "legend" });
    this.grid = new Grid(COLUMNS, ROWS);
    /** Grids that are painted, the one before beneath. */
    this.layers = [this.grid];
    this.number = 0;
    this.done = false;
    this.time = 0;
    /** @type {Point | null} */
    this.marker = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
    this.paint = this.paint.bind(this);
    this.redraw = nextFrame(() => drawOn(this.canvas, this.#size, this.paint));
    this.view = this.#newView();
    this.worker = live.workers.start(
      /** @param {SweepMessage<Cell>} message */ (message) => this.#receive(message),
    );
    const name = `${live.data.scene}-${this.across.name}-${this.upwards.name}`;
    const pane = { canvas: this.canvas, paint: this.paint, csv: () => this.#csv() };
    const controls = toolbar(
      ...this.view.buttons("chart"),
      ...savers("the chart that is seen", () => name, pane),
    );
    const hint = element("p", { className: "hint", textContent: HINT });
    host.append(hint, controls, this.canvas, this.legend, this.readout);
    live.panes.push(this);
    drawnAgain(this.canvas, this.redraw);
  }

  #newView() {
    const { x, y } = this.chart;
    /** @param {number} grazing */
    const least = (grazing) => 1e-13 * (Math.abs(grazing) || 1e-3);
    return new View(this.canvas, { x, y }, {
      plot: () => this.plot,
      least: [least(this.across.grazing), least(this.upwards.grazing)],
      changed: (delay) => this.#compute(delay),
      redraw: this.redraw,
      marker: () => this.marker,
      click: (point) => this.mark(point),
      hover: (point) => this.grid.kindAt(point) !== undefined && this.#say(point),
      keys: () => this.#keys(),
    });
  }

  /** @returns {[number, number]} */
  get #size() {
    const width = Math.max(280, this.canvas.clientWidth || 700);
    return [width, Math.round(Math.min(480, width * 0.66))];
  }

  /** @returns {Box} */
  get plot() {
    const [width, height] = this.#size;
    return { x: 68, y: 40, w: width - 152, h: height - 82 };
  }

  /** @param {SweepMessage<Cell>} message */
  #receive(message) {
    if (message.kind === "ready") {
      this.#compute(0);
    } else if (message.number !== this.number) {
      return;
    } else if (message.kind === "done") {
      this.done = true;
      this.time = message.time;
    } else {
      this.grid.take(message.found, classColour);
      this.#tellLegend();
      this.redraw();
    }
  }

  /** @param {number} delay */
  #compute(delay) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.number += 1;
      this.done = false;
      this.grid = new Grid(COLUMNS, ROWS);
      this.grid.begin(...this.view.axes);
      this.layers = [...this.layers.slice(-1), this.grid];
      const { x, y } = this.grid;
      const { axes, start, transient, longest } = this.chart;
      const parameters = this.live.data.parameters.map(() => 0);
      const cells = { axes, x, y, columns: COLUMNS, rows: ROWS, parameters };
      const sweep = { course: "chart", ...cells, start, transient, longest };
      this.worker.postMessage({ kind: "sweeps", number: this.number, sweeps: [sweep] });
    }, delay);
  }

  /** @param {number} kind */
  #wordsOf(kind) {
    return classWords(kind) + (kind ? "" : ` up to ${this.chart.longest}`);
  }

  #tellLegend() {
    /** @param {number} kind */
    const order = (kind) => (kind < 1 ? 100 - kind : kind);
    const kinds = this.grid.kinds.sort((a, b) => order(a) - order(b));
    /** @type {[string, string][]} */
    const entries = kinds
      .filter((kind) => kind < 9)
      .map((kind) => [classColour(kind), this.#wordsOf(kind)]);
    if (kinds.some((kind) => kind >= 9))
      entries.push([PERIODS[8], `period 9 to ${this.chart.longest}`]);
    tellLegend(this.legend, entries);
  }

  /** @param {Pen} g */
  paint(g) {
    const { plot } = this;
    const ranges = this.view.axes;
    g.save();
    g.beginPath();
    g.rect(plot.x, plot.y, plot.w, plot.h);
    g.clip();
    for (const { x, y, picture } of this.layers) {
      const [x0, y1] = place(plot, ranges, [x[0], y[1]]);
      const [x1, y0] = place(plot, ranges, [x[1], y[0]]);
      g.drawImage(picture, x0, y1, x1 - x0, y0 - y1);
    }
    this.#paintGraze(g, place(plot, ranges, [0, 0]));
    if (this.marker) this.#paintMarker(g, place(plot, ranges, this.marker));
    this.view.paintBox(g);
    g.restore();
    const names = [this.across, this.upwards].map(({ symbol }) => `${symbol} − ${symbol}*`);
    drawAxes(g, plot, ranges, names, { top: this.across, right: this.upwards });
  }

  /** @type {(g: Pen, at: Point) => void} */
  #paintGraze(g, [x, y]) {
    g.fillStyle = colour("--paper");
    g.strokeStyle = colour("--ink");
    g.beginPath();
    g.arc(x, y, 4, 0, 7);
    g.fill();
    g.stroke();
    g.fillStyle = colour("--ink");
    g.font = "11px system-ui, sans-serif";
    g.textAlign = "left";
    writeOver(g, "graze", x + 8, y + 4);
  }

  /** @type {(g: Pen, at: Point) => void} */
  #paintMarker(g, [x, y]) {
    for (const [tone, width] of /** @type {const} */ ([["--paper", 4], ["--accent", 2]])) {
      g.strokeStyle = colour(tone);
      g.lineWidth = width;
      g.beginPath();
      g.arc(x, y, 6, 0, 7);
      g.stroke();
    }
    g.lineWidth = 1;
  }

  /** @param {Point} point */
  #say(point) {
    const values = [this.across, this.upwards].map(({ name, grazing }, n) => {
      const value = shown(grazing + point[n], 8);
      return `${name} = ${value} (offset ${shown(point[n], 4)})`;
    });
    const kind = this.grid.kindAt(point);
    if (kind !== undefined) values.push(this.#wordsOf(kind));
    this.readout.textContent = values.join(" · ");
  }

  /**
   * Moves the marker, and the diagrams over one of the parameters to its values.
   * @param {Point} point
   */
  mark(point) {
    this.marker = point;
    this.#say(point);
    this.redraw();
    const { axes } = this.chart;
    const parameters = this.live.data.parameters
      .map(() => 0)
      .with(axes[0], point[0])
      .with(axes[1], point[1]);
    for (const pane of this.live.panes)
      if ("diagram" in pane && axes.includes(pane.diagram.axis)) pane.goTo(parameters);
  }

  #keys() {
    const [a, b] = this.marker ?? this.view.middle;
    const [x, y] = this.view.axes;
    const [dx, dy] = [(x[1] - x[0]) / COLUMNS, (y[1] - y[0]) / ROWS];
    return {
      ArrowLeft: () => this.mark([a - dx, b]),
      ArrowRight: () => this.mark([a + dx, b]),
      ArrowUp: () => this.mark([a, b + dy]),
      ArrowDown: () => this.mark([a, b - dy]),
    };
  }

  #csv() {
    const [a, b] = [this.across, this.upwards];
    const names = [a.name, b.name, `${a.name}_value`, `${b.name}_value`, "class"];
    return this.grid.csv(names, (at, kind) => [
      ...at,
      a.grazing + at[0],
      b.grazing + at[1],
      classWords(kind),
    ]);
  }
}
