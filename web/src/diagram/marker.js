// The marker of a diagram, and what is known of the orbits at it and under the pointer.

import { shown } from "../numbers.js";
import { NO_PERIOD } from "./facts.js";

/** @import { Parameter, ProbeAnswer, ReachEnd } from "../types" */
/** @import { DiagramPane } from "../panes/diagram.js" */

/** Iterates before an orbit is looked at: from the diagram's state, from a start, at the marker. */
const [FROM_COLUMN, FROM_START, AT_MARKER] = [300, 3000, 20_000];

export class Marker {
  /**
   * @param {DiagramPane} pane
   * @param {Parameter} parameter
   */
  constructor(pane, parameter) {
    this.pane = pane;
    this.parameter = parameter;
    /** @type {number | null} */
    this.offset = null;
    /** Orbit at the marker. @type {ProbeAnswer | null} */
    this.answer = null;
    /** Interval in which its period holds. @type {ReachEnd[] | null} */
    this.reach = null;
    this.busy = false;
    this.dragging = false;
    /** Point under the pointer, while another is being looked at. @type {(() => void) | null} */
    this.next = null;
  }

  /**
   * Orbit at a value of the parameter, and words about it.
   * @param {number} offset
   * @param {number | undefined} value drawn value, if it is chosen too
   */
  async inspect(offset, value, transient = FROM_COLUMN) {
    const { pane, parameter } = this;
    const { diagram, live } = pane;
    const column = pane.sweeps.at(offset);
    const at = column ? column.offset : offset;
    const question = {
      parameters: pane.base.with(diagram.axis, at),
      state: column?.state ?? diagram.start,
      transient: column ? transient : Math.max(transient, FROM_START),
    };
    const answer = await live.workers.ask("probe", question, pane.sweeps.chosen);
    const parts = [
      `${parameter.name} = ${shown(parameter.grazing + at, 10)} (offset ${shown(at)})`,
    ];
    if (value !== undefined) {
      parts.push(`${pane.observe.text} ${shown(value)}`);
      const near = pane.branchNear([offset, value]);
      if (near) parts.push(near);
    }
    return { answer, words: parts.concat(this.#orbitWords(answer)).join(" · ") };
  }

  /** @param {ProbeAnswer} answer */
  #orbitWords({ gone, states, period, exponent, outside }) {
    if (gone) return ["the orbit leaves the map's reach"];
    const last = states[states.length - 1];
    const { coordinates } = this.pane.live.data;
    return [
      coordinates
        .map(({ name, value }, n) => `${name} = ${shown(value + last[n], 8)}`)
        .join(", "),
      period ? `period ${period}` : NO_PERIOD,
      `exponent ${shown(exponent, 3)}`,
      ...(outside ? ["outside the measured window: not to be trusted"] : []),
    ];
  }

  /**
   * Tells of the orbit under the pointer; of the newest point only.
   * @param {number} offset
   * @param {number} value
   */
  async hover(offset, value) {
    this.next = () => this.hover(offset, value);
    if (this.busy) return;
    this.next = null;
    this.busy = true;
    this.pane.readout.textContent = (await this.inspect(offset, value)).words;
    this.busy = false;
    this.#goOn();
  }

  /** Tells of the point under the pointer that came meanwhile. */
  #goOn() {
    this.next?.();
  }

  /**
   * Sets the marker, and shows the orbit there.
   * @param {number} offset
   */
  async set(offset) {
    const { pane } = this;
    this.offset = offset;
    this.answer = this.reach = null;
    pane.redraw();
    // Long enough for an approach that alternates, which would seem to have twice the period.
    const { answer, words } = await this.inspect(offset, undefined, AT_MARKER);
    if (this.offset !== offset) return;
    pane.readout.textContent = words;
    this.answer = answer;
    pane.panels.show(answer, pane.sweeps.chosen);
    if (answer.gone || !answer.period) return;
    const { home, x } = pane.view;
    const { parameters, states, period } = answer;
    const question = {
      axis: pane.diagram.axis,
      low: Math.min(home.x[0], x[0]),
      high: Math.max(home.x[1], x[1]),
      step: (x[1] - x[0]) / 100,
    };
    const orbit = { parameters, states, period };
    const { ends } = await pane.live.workers.ask(
      "reach",
      { ...question, ...orbit },
      pane.sweeps.chosen,
    );
    if (!this.#shows(answer)) return;
    this.reach = ends;
    pane.panels.tellReach(ends, home.x[1] - home.x[0]);
    pane.redraw();
  }

  /** @param {ProbeAnswer} answer */
  #shows(answer) {
    return this.answer === answer;
  }

  /**
   * Follows the pointer as fast as orbits are known.
   * @param {number} offset
   */
  async drag(offset) {
    if (this.dragging) return;
    this.dragging = true;
    await this.set(offset);
    this.dragging = false;
  }

  /** Looks at the orbit again, after another parameter has changed. */
  refresh() {
    if (this.offset !== null) this.set(this.offset);
  }
}
