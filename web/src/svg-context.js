// A context that writes an SVG in place of painting a canvas.

/** @import { Pen } from "./types" */

/**
 * SVG element with attributes.
 * @param {string} name
 * @param {Record<string, unknown>} attributes
 * @param {SVGElement} [parent]
 */
const make = (name, attributes, parent) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  parent?.append(made);
  return /** @type {SVGElement} */ (made);
};

/** @param {number} value */
const round = (value) => Math.round(value * 100) / 100;

/** @type {(x: number, y: number, w: number, h: number) => Record<string, number>} */
const box = (x, y, w, h) => ({
  x: round(Math.min(x, x + w)),
  y: round(Math.min(y, y + h)),
  width: round(Math.abs(w)),
  height: round(Math.abs(h)),
});

/** @type {Record<string, string>} */
const ANCHORS = { left: "start", center: "middle", right: "end" };

/** @implements {Pen} */
export class SvgContext {
  /** @type {Pen["fillStyle"]} */
  fillStyle = "#000";
  /** @type {Pen["strokeStyle"]} */
  strokeStyle = "#000";
  lineWidth = 1;
  font = "12px sans-serif";
  /** @type {CanvasTextAlign} */
  textAlign = "left";
  /** @type {number[]} */
  #dash = [];
  #path = "";
  #clips = 0;
  /** @type {(() => void)[]} */
  #kept = [];
  #group;

  /**
   * @param {number} width
   * @param {number} height
   */
  constructor(width, height) {
    this.svg = make("svg", { width, height, viewBox: `0 0 ${width} ${height}` });
    this.#group = this.svg;
  }

  save() {
    const [group, dash] = [this.#group, this.#dash];
    const { fillStyle, strokeStyle, lineWidth, font, textAlign } = this;
    this.#kept.push(() => {
      [this.#group, this.#dash] = [group, dash];
      Object.assign(this, { fillStyle, strokeStyle, lineWidth, font, textAlign });
    });
  }

  restore() {
    this.#kept.pop()?.();
  }

  /** @type {Pen["translate"]} */
  translate(x, y) {
    this.#shift(`translate(${round(x)} ${round(y)})`);
  }

  /** @type {Pen["rotate"]} */
  rotate(angle) {
    this.#shift(`rotate(${round((angle * 180) / Math.PI)})`);
  }

  beginPath() {
    this.#path = "";
  }

  /** @type {Pen["moveTo"]} */
  moveTo(x, y) {
    this.#path += `M${round(x)} ${round(y)}`;
  }

  /** @type {Pen["lineTo"]} */
  lineTo(x, y) {
    this.#path += `${this.#path ? "L" : "M"}${round(x)} ${round(y)}`;
  }

  /**
   * Circle, whatever the angles are.
   * @type {Pen["arc"]}
   */
  arc(x, y, r) {
    const half = `a${r} ${r} 0 1 0`;
    this.#path += `M${round(x - r)} ${round(y)}${half} ${2 * r} 0${half} ${-2 * r} 0`;
  }

  /** @type {Pen["rect"]} */
  rect(x, y, w, h) {
    this.#path += `M${x} ${y}h${w}v${h}h${-w}z`;
  }

  clip() {
    const id = `clip-${++this.#clips}`;
    make("path", { d: this.#path }, make("clipPath", { id }, this.#group));
    this.#group = make("g", { "clip-path": `url(#${id})` }, this.#group);
  }

  /** @param {number[]} dash */
  setLineDash(dash) {
    this.#dash = dash;
  }

  stroke() {
    make("path", { d: this.#path, ...this.#outline() }, this.#group);
  }

  fill() {
    make("path", { d: this.#path, fill: this.fillStyle }, this.#group);
  }

  /** @type {Pen["fillRect"]} */
  fillRect(x, y, w, h) {
    make("rect", { ...box(x, y, w, h), fill: this.fillStyle }, this.#group);
  }

  /** @type {Pen["strokeRect"]} */
  strokeRect(x, y, w, h) {
    make("rect", { ...box(x, y, w, h), ...this.#outline() }, this.#group);
  }

  /** @type {Pen["fillText"]} */
  fillText(text, x, y) {
    this.#write(text, x, y, { fill: this.fillStyle });
  }

  /** @type {Pen["strokeText"]} */
  strokeText(text, x, y) {
    this.#write(text, x, y, this.#outline());
  }

  /** @type {Pen["drawImage"]} */
  drawImage(picture, x, y, w, h) {
    const drawn = { preserveAspectRatio: "none", style: "image-rendering: pixelated" };
    make("image", { ...box(x, y, w, h), ...drawn, href: picture.toDataURL() }, this.#group);
  }

  #outline() {
    return {
      fill: "none",
      stroke: this.strokeStyle,
      "stroke-width": this.lineWidth,
      "stroke-linejoin": "round",
      ...(this.#dash.length ? { "stroke-dasharray": this.#dash.join(" ") } : {}),
    };
  }

  /** @param {string} transform */
  #shift(transform) {
    this.#group = make("g", { transform }, this.#group);
  }

  /**
   * @param {string} text
   * @param {number} x
   * @param {number} y
   * @param {Record<string, unknown>} ink
   */
  #write(text, x, y, ink) {
    const [, size, family] = this.font.match(/(\d+)px (.*)/) ?? ["", "12", "sans-serif"];
    const place = { x: round(x), y: round(y), "text-anchor": ANCHORS[this.textAlign] };
    const font = { "font-size": size, "font-family": family };
    make("text", { ...place, ...font, ...ink }, this.#group).textContent = text;
  }
}
