// What can be chosen at a diagram, and what is said about it.

import { chooser, element } from "../dom.js";
import { shown } from "../numbers.js";

/** @import { Data, Parameter } from "../types" */

/** Steps of a slider to each side. */
const STEPS = 100;

/**
 * Box that switches a layer.
 * @param {string} name
 * @param {boolean} checked
 * @param {(is: boolean) => void} changed
 */
export function toggle(name, checked, changed) {
  const box = element("input", { type: "checkbox", checked });
  box.onchange = () => changed(box.checked);
  return element("label", { className: name }, box, name);
}

/**
 * Choice among the orders of the modules.
 * @param {Data} data
 * @param {(number: number) => void} choose
 */
export const orderChooser = ({ orders }, choose) =>
  chooser(
    "Orders of the map that is drawn; below it in a colour of its own the map itself",
    orders.map(([n, w], k) => `N ${n}, W ${w}${k ? "" : " (the map)"}`),
    choose,
  );

/** Slider of a parameter that is not swept. */
export class Slider {
  /**
   * @param {Parameter} parameter
   * @param {(offset: number) => void} moved
   */
  constructor(parameter, moved) {
    this.parameter = parameter;
    this.reach = parameter.width ?? Math.abs(parameter.grazing) * 1e-3;
    const ends = { min: `${-STEPS}`, max: `${STEPS}`, step: "1", value: "0" };
    this.input = element("input", { type: "range", ...ends });
    this.input.setAttribute("aria-label", parameter.name);
    this.says = element("output");
    this.input.oninput = () => {
      const offset = (Number(this.input.value) / STEPS) * this.reach;
      this.#tell(offset);
      moved(offset);
    };
    const name = element("span", { textContent: parameter.name });
    this.node = element("div", {}, name, this.input, this.says);
    this.#tell(0);
  }

  /**
   * Follows a value chosen elsewhere.
   * @param {number} offset
   */
  follow(offset) {
    this.input.value = `${Math.round((offset / this.reach) * STEPS)}`;
    this.#tell(offset);
  }

  /** @param {number} offset */
  #tell(offset) {
    const { symbol, grazing } = this.parameter;
    const words = `${symbol} = ${shown(grazing + offset, 8)} (offset ${shown(offset, 3)})`;
    this.says.textContent = words;
    this.input.setAttribute("aria-valuetext", words);
  }
}

export const HINT =
  "Drag across the diagram to zoom in. Click to see the orbit there and where its period ends. " +
  "The strip below it is the period: salmon for none, pale without contact, grey outside the " +
  "measured window.";

/**
 * Explanation of a diagram, of mouse and keys.
 * @param {Data} data
 * @param {Parameter} parameter
 * @param {boolean} hasBranches
 */
export function helpOf(data, { name, symbol, grazing }, hasBranches) {
  const rest = data.branches_left_out;
  const left = rest ? ` Of longer periods ${rest} ${rest > 1 ? "are" : "is"} left out.` : "";
  const more = [
    `By the map alone, over offsets of ${name} from its value at the graze, ` +
      `${symbol}* = ${shown(grazing, 12)}; its values stand above. ` +
      "The gap h is negative where the free flow would pass the stop: h = −y².",
    "A flat drag chooses the parameter alone, a higher one a box; Shift and drag moves the view; " +
      "the wheel zooms after a click, with Alt the parameter alone; " +
      "a double click shows the whole.",
    "Keys: left and right move the marker (with Shift faster), + and − zoom about it, page up " +
      "and page down move the view, 0 shows the whole, Backspace the view before, " +
      "Escape lets go of a drag.",
  ];
  if (hasBranches)
    more.push(
      "Branches are periodic orbits of the map, solid where stable, dashed where not, with the " +
        "other parameters at the graze. " +
        `GR graze, SN fold, PD flip, NS closed curve, BP branch point.${left}`,
    );
  return element(
    "details",
    { className: "hint" },
    element("summary", { textContent: "What is drawn, mouse and keys" }),
    ...more.map((textContent) => element("p", { textContent })),
  );
}
