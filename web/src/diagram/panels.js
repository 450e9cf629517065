// Panels about the orbit at a marker: facts, states on the section, gaps, basins.

import { chooser, element } from "../dom.js";
import { addCopy } from "../figures.js";
import { BasinPane } from "../panes/basin.js";
import { OrbitPanel } from "../panes/orbit-panel.js";
import { factsOf, pointCommand, reachLines } from "./facts.js";

/** @import { Parameter, ProbeAnswer, ReachEnd } from "../types" */
/** @import { Live } from "../live.js" */

/** Most returns that are drawn one after another. */
const RETURNS = 60;
/** Steps of the graph of a map of one coordinate. */
const GRAPH = 240;

export class Panels {
  /**
   * @param {Live} live
   * @param {Parameter} parameter
   * @param {string} [command] command of the diagram
   */
  constructor(live, parameter, command) {
    this.live = live;
    this.command = command;
    this.parameter = parameter;
    this.node = element("div", { className: "panels", hidden: true });
    this.facts = element("div", { className: "facts" });
    this.single = live.data.coordinates.length === 1;
    /** @param {string} what */
    const file = (what) => () => `${live.data.scene}-${parameter.name}-${what}`;
    this.portrait = this.single
      ? new OrbitPanel("the cobweb of the orbit on the graph of the map", file("cobweb"))
      : new OrbitPanel("the states of the orbit on the section", file("section"));
    this.series = new OrbitPanel("the gap in each return", file("gaps"));
    this.node.append(this.facts, this.portrait.node, this.series.node);
    this.basin = this.single ? null : new BasinPane(live, this.node);
    /** Coordinates of the plane that is drawn. @type {[number, number]} */
    this.plane = [0, 1];
    /**
     * Graph and steps of a map of one coordinate.
     * @type {{ graph: number[][], steps: number[][] } | null}
     */
    this.cobweb = null;
    /** @type {ProbeAnswer | null} */
    this.answer = null;
    /** Number of the module. */
    this.chosen = 0;
    this.#offerPlanes();
  }

  #offerPlanes() {
    const { coordinates } = this.live.data;
    /** @type {[number, number][]} */
    const planes = coordinates.flatMap((_, b) =>
      coordinates.slice(0, b).map((__, a) => /** @type {[number, number]} */ ([a, b])),
    );
    if (planes.length < 2) return;
    const words = planes.map((own) => own.map((axis) => coordinates[axis].symbol).join(", "));
    const label = "Coordinates of the plane of states and basins";
    const choice = chooser(label, words, (number) => {
      this.plane = planes[number];
      this.#drawPortrait();
      this.basin?.choose(this.plane);
    });
    this.portrait.tools.prepend(choice);
  }

  /**
   * Shows an orbit, by one of the modules.
   * @param {ProbeAnswer} answer
   * @param {number} chosen
   */
  show(answer, chosen) {
    [this.answer, this.chosen] = [answer, chosen];
    this.node.hidden = false;
    for (const own of [this.portrait.node, this.series.node, this.basin?.node])
      if (own) own.hidden = answer.gone;
    if (answer.gone) {
      const words = "The orbit leaves the map's reach here.";
      this.facts.replaceChildren(element("p", { textContent: words }));
      return;
    }
    const { coordinates, passages } = this.live.data;
    this.facts.replaceChildren(factsOf(answer, coordinates));
    if (this.command) this.#offerCommand(this.command, answer);
    this.#drawPortrait();
    const lines = passages.map((_, passage) => ({
      points: answer.depths.slice(0, RETURNS).map((own, n) => [n, -own[passage]]),
      tone: ["--up", "--down", "--direct"][passage % 3],
      joined: true,
    }));
    const name = passages.length > 1 ? `gaps h at ${passages.join(", ")}` : "gap h";
    this.series.show(lines, ["return", name], answer.outside);
    this.basin?.mark(answer, chosen);
  }

  /**
   * Shows the command that computes the orbit at the marker.
   * @param {string} command
   * @param {ProbeAnswer} answer
   */
  #offerCommand(command, answer) {
    const textContent = pointCommand(command, this.live.data.parameters, answer);
    const line = element("p", { className: "command" }, element("code", { textContent }));
    addCopy(line);
    this.facts.append(line);
  }

  /**
   * Tells where the period begins and ends.
   * @param {ReachEnd[]} ends
   * @param {number} span range of the whole diagram
   */
  tellReach(ends, span) {
    const lines = reachLines(ends, this.parameter, span);
    this.facts
      .querySelector(".reach")
      ?.replaceChildren(...lines.map((textContent) => element("div", { textContent })));
  }

  #drawPortrait() {
    const { answer, plane } = this;
    if (!answer || answer.gone) return;
    const kept = answer.states.slice(0, answer.period ? Math.max(answer.period, 2) : undefined);
    if (this.single) {
      this.#drawCobweb(answer, kept);
      return;
    }
    const points = kept.map((state) => plane.map((axis) => state[axis]));
    const names = plane.map((axis) => this.live.offsetOf(axis));
    this.portrait.show([{ points, tone: "--up" }], names, answer.outside);
  }

  /**
   * Draws steps between the graph of a map of one coordinate and the diagonal.
   * @param {ProbeAnswer} answer
   * @param {number[][]} kept
   */
  async #drawCobweb(answer, kept) {
    const { data, workers } = this.live;
    const { parameters, states } = answer;
    const values = states.map(([value]) => value);
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const width = data.window.state[0] ?? Math.abs(high);
    const edge = Math.max(0.1 * (high - low), 0.02 * width) || 1e-12;
    const span = high - low + 2 * edge;
    const across = Array.from({ length: GRAPH + 1 }, (_, n) => low - edge + (span * n) / GRAPH);
    const points = across.map((value) => ({ parameters, state: [value] }));
    const { values: images } = await workers.ask("images", { points }, this.chosen);
    if (this.answer !== answer) return;
    const graph = across.map((value, n) => [value, images[n * (1 + data.passages.length)]]);
    const steps = kept.slice(0, RETURNS).flatMap(([value], n) => [
      [value, value],
      [value, states[n + 1][0]],
    ]);
    this.cobweb = { graph, steps };
    const diagonal = [across[0], across[GRAPH]].map((end) => [end, end]);
    const beneath = [graph, diagonal];
    this.portrait.show(
      [
        ...beneath.map((line) => ({ points: line, tone: "--soft", joined: true, bare: true })),
        { points: steps, tone: "--up", joined: true },
      ],
      [`${this.live.offsetOf(0)}: a return`, "the next"],
      answer.outside,
    );
  }
}
