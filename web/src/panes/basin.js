// Basins of attraction about the orbit at a marker, over two coordinates of the section.

import { drawAxes, place } from "../axes.js";
import { colour, drawOn, savers } from "../canvas.js";
import { ESCAPED, OUTSIDE, PERIODS, WITHOUT_CONTACT, classColour, classWords } from "../classes.js";
import { drawnAgain, element, pictured, readout, tellLegend, toolbar } from "../dom.js";
import { Grid } from "../grid.js";
import { shown } from "../numbers.js";
import { panelRoom, panelSize } from "./orbit-panel.js";

/** @import { Attractor, Cell, Pen, Point, ProbeAnswer, Range, SweepMessage } from "../types" */
/** @import { Live } from "../live.js" */

/** Points on each side of the plane at which the map is asked whether it stays in its window. */
const PROBES = 48;

/** Longest period that is told apart. */
const LONGEST = 64;

/** @param {Attractor} attractor */
const classOf = ({ period, touches }) => (period === 1 && !touches ? WITHOUT_CONTACT : period);

export class BasinPane {
  /**
   * @param {Live} live
   * @param {HTMLElement} host
   */
  constructor(live, host) {
    this.live = live;
    this.grid = new Grid(96, 72);
    this.canvas = pictured("img");
    this.canvas.tabIndex = 0;
    this.legend = element("div", { className: "legend" });
    this.says = readout();
    /** @type {[number, number]} */
    this.axes = [0, 1];
    /** @type {Attractor[]} */
    this.attractors = [];
    this.number = 0;
    /** @type {ProbeAnswer | null} */
    this.marked = null;
    /** Number of the module. */
    this.chosen = 0;
    /** @type {Worker[]} */
    this.workers = [];
    this.done = false;
    this.time = 0;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
    this.paint = this.paint.bind(this);
    const file = () => `${live.data.scene}-basin`;
    const csv = () => this.#csv();
    const { canvas, paint, legend, says } = this;
    const tools = toolbar(...savers("the basins", file, { canvas, paint, csv }));
    const title = element("h3", { textContent: "Basins of attraction about the orbit" });
    this.node = element("div", { className: "basin" }, title, canvas, tools, legend, says);
    host.append(this.node);
    canvas.addEventListener("pointermove", (event) => this.#say(event));
    drawnAgain(canvas, () => this.marked && this.#draw());
  }

  /**
   * Computes the basins at a marker whose orbit stays; a moment later, in case the marker moves on.
   * @param {ProbeAnswer} answer
   * @param {number} chosen
   */
  mark(answer, chosen) {
    [this.marked, this.chosen] = [answer, chosen];
    clearTimeout(this.timer);
    this.done = false;
    this.timer = setTimeout(() => this.#compute(answer), 150);
  }

  /**
   * Chooses the coordinates of the plane.
   * @param {[number, number]} axes
   */
  choose(axes) {
    this.axes = axes;
    if (this.marked) this.#compute(this.marked);
  }

  /** @param {ProbeAnswer} marked */
  async #compute(marked) {
    const number = ++this.number;
    this.done = false;
    const { x, y } = await this.#plane(marked);
    if (number !== this.number) return;
    this.grid.begin(x, y);
    this.attractors = [];
    this.workers[this.chosen] ??= this.live.workers.start(
      /** @param {SweepMessage<Cell>} message */ (message) => this.#receive(message),
      this.chosen,
    );
    const { columns, rows } = this.grid;
    const sweep = {
      course: "basin",
      axes: this.axes,
      x,
      y,
      columns,
      rows,
      parameters: marked.parameters,
      state: marked.states[0],
      transient: 2000,
      longest: LONGEST,
      attractors: this.#known(marked),
    };
    this.workers[this.chosen].postMessage({ kind: "sweeps", number, sweeps: [sweep] });
  }

  /** @param {SweepMessage<Cell>} message */
  #receive(message) {
    if (message.kind === "ready" || message.number !== this.number) return;
    if (message.kind === "done") {
      this.done = true;
      this.time = message.time;
    } else {
      this.attractors = message.attractors ?? [];
      const tones = this.#tones();
      this.grid.take(message.found, (kind) => this.#toneOf(kind, tones));
    }
    this.#draw();
  }

  /**
   * Attractor of the orbit at the marker, if it is periodic.
   * @param {ProbeAnswer} marked
   * @returns {Attractor[]}
   */
  #known({ period, states, depths }) {
    const touches = depths.slice(0, period).some((own) => own.some((depth) => depth > 0));
    return period ? [{ period, touches, states: states.slice(0, period) }] : [];
  }

  /**
   * Part of the plane in which a step of the map stays inside the measured window.
   * @param {ProbeAnswer} marked
   * @returns {Promise<{ x: Range, y: Range }>}
   */
  async #plane({ states, parameters }) {
    const { data, workers } = this.live;
    const { axes } = this;
    const reach = axes.map((axis) => {
      const far = Math.max(...states.map((state) => Math.abs(state[axis])));
      return data.window.state[axis] ?? (4 * far || data.escape[axis] || 1);
    });
    /** @type {(n: number, axis: number) => number} */
    const middle = (n, axis) => reach[axis] * ((2 * n + 1) / PROBES - 1);
    const points = Array.from({ length: PROBES ** 2 }, (_, n) => {
      const [a, b] = [middle(n % PROBES, 0), middle(Math.floor(n / PROBES), 1)];
      return { parameters, state: states[0].with(axes[0], a).with(axes[1], b) };
    });
    const { values } = await workers.ask("images", { points }, this.chosen);
    const bounds = [
      ...data.coordinates.map((_, n) => data.window.state[n] ?? Infinity),
      ...data.passages.map(() => data.window.depth ?? Infinity),
    ];
    const stays = points.filter((_, n) =>
      bounds.every((bound, k) => {
        const value = values[n * bounds.length + k];
        return (k < data.coordinates.length ? Math.abs(value) : value) <= bound;
      }),
    );
    const inside = stays.map(({ state }) => state).concat(states);
    /** @type {(side: number) => Range} */
    const range = (side) => {
      const own = inside.map((state) => state[axes[side]]);
      const cell = reach[side] / PROBES;
      return [Math.min(...own) - cell, Math.max(...own) + cell];
    };
    return { x: range(0), y: range(1) };
  }

  /** Colour of each attractor's period; of a second one of a period a colour that no other has. */
  #tones() {
    /** @type {string[]} */
    const taken = [];
    for (const own of this.attractors) {
      const wanted = classColour(classOf(own));
      const free = PERIODS.find((tone) => !taken.includes(tone));
      taken.push(taken.includes(wanted) ? (free ?? wanted) : wanted);
    }
    return taken;
  }

  /**
   * @param {number} kind
   * @param {string[]} tones
   */
  #toneOf(kind, tones) {
    if (kind >= 0) return tones[kind];
    return kind === OUTSIDE ? classColour(OUTSIDE) : colour("--paper");
  }

  /** @param {number} kind */
  #wordsOf(kind) {
    if (kind === ESCAPED) return "the orbit leaves the map's reach";
    if (kind === OUTSIDE) return "leaves the measured window";
    const own = classOf(this.attractors[kind]);
    const same = this.attractors.slice(0, kind).filter((other) => classOf(other) === own).length;
    const words = own ? classWords(own) : `${classWords(own)} up to ${LONGEST}`;
    return words + (same ? `, another (${same + 1})` : "");
  }

  get #names() {
    return this.axes.map((axis) => this.live.data.coordinates[axis].name);
  }

  /** @param {Pen} g */
  paint(g) {
    const plot = panelRoom(this.canvas);
    g.drawImage(this.grid.picture, plot.x, plot.y, plot.w, plot.h);
    /** @type {[Range, Range]} */
    const ranges = [this.grid.x, this.grid.y];
    g.strokeStyle = colour("--paper");
    g.fillStyle = colour("--ink");
    for (const { period, states } of this.attractors) {
      for (const state of period ? states : []) {
        const [x, y] = place(plot, ranges, [state[this.axes[0]], state[this.axes[1]]]);
        g.beginPath();
        g.arc(x, y, 2.5, 0, 7);
        g.fill();
        g.stroke();
      }
    }
    drawAxes(g, plot, ranges, this.axes.map((axis) => this.live.offsetOf(axis)));
  }

  #draw() {
    drawOn(this.canvas, panelSize(this.canvas), this.paint);
    const kinds = this.grid.kinds.sort((a, b) => b - a);
    const tones = this.#tones();
    tellLegend(
      this.legend,
      kinds.map((kind) => [this.#toneOf(kind, tones), this.#wordsOf(kind)]),
    );
    const words = kinds.map((kind) => this.#wordsOf(kind)).join(", ");
    const [a, b] = this.#names;
    const label = `Basins of attraction at the marker over ${a} and ${b}: ${words}`;
    this.canvas.setAttribute("aria-label", label);
  }

  /** @param {PointerEvent} event */
  #say(event) {
    const [plot, box] = [panelRoom(this.canvas), this.canvas.getBoundingClientRect()];
    const { x, y } = this.grid;
    const [a, b] = [
      (event.clientX - box.left - plot.x) / plot.w,
      (plot.y + plot.h - event.clientY + box.top) / plot.h,
    ];
    /** @type {Point} */
    const point = [x[0] + a * (x[1] - x[0]), y[0] + b * (y[1] - y[0])];
    const kind = this.grid.kindAt(point);
    if (kind === undefined) return;
    const at = this.#names.map((name, n) => `${name} ${shown(point[n], 4)}`);
    this.says.textContent = [...at, this.#wordsOf(kind)].join(" · ");
  }

  #csv() {
    return this.grid.csv([...this.#names, "class"], (at, kind) => [...at, this.#wordsOf(kind)]);
  }
}
