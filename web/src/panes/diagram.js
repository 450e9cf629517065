// A live diagram: the iterates of the map over a parameter, computed anew for what is seen.

import { drawOn, savers, sharpness } from "../canvas.js";
import { Branches } from "../diagram/branches.js";
import { HINT, Slider, helpOf, orderChooser, toggle } from "../diagram/controls.js";
import { Density } from "../diagram/density.js";
import { DIAGRAM } from "../diagram/facts.js";
import { Marker } from "../diagram/marker.js";
import { Panels } from "../diagram/panels.js";
import { paintDiagram } from "../diagram/picture.js";
import { GAP, STRIP, periodsInWords } from "../diagram/strip.js";
import { Sweeps } from "../diagram/sweeps.js";
import {
  chooser,
  drawnAgain,
  element,
  nextFrame,
  pictured,
  readout,
  toolbar,
} from "../dom.js";
import { shown } from "../numbers.js";
import { View } from "../view.js";

/** @import { Box, Heading, LiveDiagram, Pen, Point, Range } from "../types" */
/** @import { Live } from "../live.js" */

/** @type {Heading[]} */
const HEADINGS = ["up", "down"];
/** Most values of the parameter at which iterates are computed. */
const COLUMNS = 1000;

export class DiagramPane {
  /**
   * @param {Live} live
   * @param {HTMLElement} host
   * @param {LiveDiagram} diagram
   */
  constructor(live, host, diagram) {
    this.live = live;
    this.diagram = diagram;
    this.parameter = live.data.parameters[diagram.axis];
    /** Offsets of all parameters. */
    this.base = live.data.parameters.map(() => 0);
    this.observe = live.observables[diagram.observe] ?? live.observables[0];
    /** Layers that are seen. */
    this.show = {
      up: diagram.headings.includes("up"),
      down: diagram.headings.includes("down"),
      branches: true,
      direct: false,
    };
    this.status = "";
    /** Offset of the swept parameter at the graze; null where it is not known. */
    this.graze = /** @type {number | null} */ (0);
    /** Number of the sweeps whose height is shown. */
    this.fitted = 0;
    const keys = "Arrow keys move the marker, plus and minus zoom, page up and page down move, ";
    this.about =
      `Bifurcation diagram of the map over ${this.parameter.name}. ` + keys + "0 shows the whole.";
    this.canvas = pictured("application", this.about);
    this.canvas.tabIndex = 0;
    this.readout = readout();
    /** @param {Pen} g */
    this.paint = (g) => paintDiagram(g, this);
    this.redraw = nextFrame(() => this.#draw());
    this.view = this.#newView();
    this.sweeps = this.#newSweeps();
    this.density = new Density(this.sweeps);
    this.branches = new Branches(live, diagram.axis);
    const commands = host.closest("section")?.querySelectorAll(".command code") ?? [];
    this.panels = new Panels(live, this.parameter, diagramCommand(commands));
    this.marker = new Marker(this, this.parameter);
    this.sliders = live.data.parameters.map((parameter, axis) =>
      axis === diagram.axis ? null : new Slider(parameter, (offset) => this.#slide(axis, offset)),
    );
    this.#trace();
    this.#append(host);
    live.panes.push(this);
    drawnAgain(this.canvas, () => {
      this.density.refresh();
      this.redraw();
    });
  }

  /** @returns {View} */
  #newView() {
    const { from, to } = this.diagram;
    const least = 1e-13 * Math.max(Math.abs(this.parameter.grazing), to - from);
    return new View(this.canvas, { x: [from, to], y: null }, {
      plot: () => this.plot,
      least: [least, 0],
      changed: (delay) => this.sweeps.compute(delay),
      redraw: this.redraw,
      marker: () => (this.marker.offset === null ? null : [this.marker.offset]),
      click: ([offset]) => this.marker.set(offset),
      hover: ([offset, value]) => this.view.y && this.marker.hover(offset, value),
      grips: ([x]) =>
        this.marker.offset !== null && Math.abs(this.view.toX(this.marker.offset) - x) < 6,
      drag: ([offset]) => this.marker.drag(offset),
      boxed: (x) => this.#tellBox(x),
      keys: (event) => this.#keys(event.shiftKey),
    });
  }

  #newSweeps() {
    return new Sweeps(this.live, this.diagram, {
      asked: () => ({
        columns: Math.min(COLUMNS, Math.round(this.plot.w * sharpness())),
        x: this.view.x,
        base: this.base,
        observe: this.observe,
        headings: this.headings,
      }),
      begun: () => {
        this.density.keep();
        this.density.clear();
        this.status = "computing …";
        this.redraw();
      },
      took: (name, columns) => {
        this.density.take(name, columns);
        this.#fit();
        this.redraw();
      },
      finished: () => {
        this.status = "";
        this.density.old = null;
        // The same height in the end, whatever came first.
        this.fitted = 0;
        this.#fit();
        const words = periodsInWords(this.sweeps.sorted(this.headings[0] ?? "up"));
        this.canvas.setAttribute("aria-label", `${this.about} ${words}`);
        this.redraw();
      },
    });
  }

  /** @param {HTMLElement} host */
  #append(host) {
    const { data } = this.live;
    const controls = toolbar(
      ...HEADINGS.map((name) => this.#toggle(name, () => this.sweeps.compute())),
      ...(this.branches.all.length ? [this.#toggle("branches", this.redraw)] : []),
      ...(this.branches.direct.length ? [this.#toggle("direct", this.redraw)] : []),
      ...(this.live.observables.length > 1 ? [this.#observableChooser()] : []),
      ...(data.orders.length > 1 ? [orderChooser(data, (n) => this.#chooseOrders(n))] : []),
      ...this.view.buttons("diagram"),
      ...savers("what is seen", () => `${data.scene}-${this.parameter.name}`, {
        canvas: this.canvas,
        paint: this.paint,
        csv: () => this.sweeps.csv(this.parameter),
      }),
    );
    const sliders = element("div", { className: "sliders" });
    sliders.append(...this.sliders.flatMap((slider) => slider?.node ?? []));
    const hint = element("p", { className: "hint", textContent: HINT });
    const help = helpOf(data, this.parameter, this.branches.all.length > 0);
    host.append(controls, this.canvas, sliders, this.readout, hint, help, this.panels.node);
  }

  /** @type {(name: keyof DiagramPane["show"], changed: () => void) => HTMLElement} */
  #toggle(name, changed) {
    return toggle(name, this.show[name], (is) => {
      this.show[name] = is;
      changed();
    });
  }

  #observableChooser() {
    const { observables } = this.live;
    const words = observables.map(({ text }) => text);
    const choice = chooser("What is drawn", words, (number) => {
      this.observe = observables[number];
      this.view.auto = true;
      this.sweeps.compute();
      this.#trace();
    });
    choice.selectedIndex = observables.indexOf(this.observe);
    return choice;
  }

  /** @param {number} number */
  #chooseOrders(number) {
    this.sweeps.choose(number);
    this.#followGraze();
    this.marker.refresh();
  }

  /** @type {(axis: number, offset: number) => void} */
  #slide(axis, offset) {
    this.base = this.base.with(axis, offset);
    this.#followGraze();
    this.sweeps.compute(30);
    this.marker.refresh();
  }

  /** Moves the graze to where it is with the other parameters. */
  async #followGraze() {
    const { base, diagram } = this;
    const { axis, from, to } = diagram;
    const question = { axis, parameters: base, span: to - from };
    const { offset } = this.othersMoved
      ? await this.live.workers.ask("graze", question, this.sweeps.chosen)
      : { offset: 0 };
    if (this.base !== base) return;
    this.graze = offset;
    this.redraw();
  }

  async #trace() {
    if (!(await this.branches.trace(this.observe))) return;
    this.#fit();
    this.redraw();
  }

  /** Headings that are seen. */
  get headings() {
    return HEADINGS.filter((heading) => this.show[heading]);
  }

  get done() {
    return this.sweeps.done;
  }

  get number() {
    return this.sweeps.number;
  }

  /** Whether another parameter than the swept one is not at the graze. */
  get othersMoved() {
    return this.base.some((offset, n) => n !== this.diagram.axis && offset !== 0);
  }

  /** Height of the strips. */
  get strips() {
    return GAP + STRIP * this.headings.length;
  }

  /** @returns {[number, number]} */
  get #size() {
    const width = Math.max(280, this.canvas.clientWidth || 700);
    return [width, Math.round(Math.min(460, Math.max(320, width * 0.6))) + this.strips];
  }

  /** @returns {Box} */
  get plot() {
    const [width, height] = this.#size;
    return { x: 68, y: 40, w: width - 82, h: height - 80 - this.strips };
  }

  /** Least and largest value of the iterates, and of branches if iterates have no height. */
  #extent() {
    let { low, high } = this.sweeps;
    const [from, to] = this.view.x;
    const seen = this.show.branches && !this.othersMoved;
    for (const stableOnly of seen ? [true, false] : []) {
      const [least, most] = this.branches.extent(from, to, stableOnly);
      if (!(high - low >= 1e-3 * (most - least)))
        [low, high] = [Math.min(low, least), Math.max(high, most)];
      if (high > low) break;
    }
    return [low, high];
  }

  /** Chooses the height that shows all iterates, and the branches where iterates have none. */
  #fit() {
    const { view, sweeps } = this;
    if (!view.auto) return;
    const [low, high] = this.#extent();
    if (!(low <= high)) return;
    const holds = view.y && low >= view.y[0] && high <= view.y[1];
    if (holds && this.fitted === sweeps.number) return;
    this.fitted = sweeps.number;
    const edge = 0.04 * (high - low) || Math.abs(high) * 0.1 || 1e-12;
    /** @type {Range} */
    const found = [low - edge, high + edge];
    if (view.y?.every((end, n) => end === found[n])) return;
    view.y = found;
    this.density.clear();
  }

  #draw() {
    const { x, y } = this.view.ranges;
    if (y) this.density.update(this.plot, { x, y });
    drawOn(this.canvas, this.#size, this.paint);
  }

  /** @param {Range | null} x */
  #tellBox(x) {
    const { parameter } = this;
    if (!x) {
      this.readout.textContent = "";
      return;
    }
    const ends = x.map((end) => describe(parameter.grazing, end));
    this.readout.textContent = `Let go to see ${parameter.symbol} from ${ends.join(" to ")}`;
  }

  /**
   * Branch that passes near a point, in words; null if none is seen.
   * @param {Point} point
   */
  branchNear(point) {
    if (!this.show.branches || this.othersMoved) return null;
    return this.branches.near(point, (own) => this.view.toPixels(own));
  }

  /** @param {boolean} fast */
  #keys(fast) {
    const { x, middle } = this.view;
    const columns = Math.min(COLUMNS, Math.round(this.plot.w * sharpness()));
    const step = ((x[1] - x[0]) / columns) * (fast ? 10 : 1);
    const from = this.marker.offset ?? middle[0];
    return {
      ArrowLeft: () => void this.marker.set(Math.max(x[0], from - step)),
      ArrowRight: () => void this.marker.set(Math.min(x[1], from + step)),
    };
  }

  /**
   * Goes to values of all parameters.
   * @param {number[]} parameters
   */
  goTo(parameters) {
    const { axis } = this.diagram;
    this.base = parameters.with(axis, 0);
    for (const [n, slider] of this.sliders.entries()) slider?.follow(this.base[n]);
    this.#followGraze();
    this.sweeps.compute();
    this.marker.set(parameters[axis]);
  }
}

/**
 * Command of the diagrams of a section.
 * @param {Iterable<Element>} commands
 */
const diagramCommand = (commands) =>
  Array.from(commands, (own) => own.textContent ?? "").find((text) => DIAGRAM.test(text));

/** @type {(grazing: number, offset: number) => string} */
const describe = (grazing, offset) =>
  `${shown(grazing + offset, 8)} (offset ${shown(offset, 4)})`;
