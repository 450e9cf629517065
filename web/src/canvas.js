// Drawing on canvases, and saving what they show.

import { button, element } from "./dom.js";
import { SvgContext } from "./svg-context.js";

/** @import { Pen } from "./types" */

/** @param {HTMLCanvasElement} canvas */
export const contextOf = (canvas) =>
  /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));

/**
 * Value of a colour of the style.
 * @param {string} name
 */
export const colour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Pixels of the screen for one of the page, at most 2. */
export const sharpness = () => Math.min(2, devicePixelRatio || 1);

/**
 * Draws on the colour of the paper.
 * @param {Pen} g
 * @param {[number, number]} size
 * @param {(g: Pen) => void} paint
 */
const onPaper = (g, [width, height], paint) => {
  g.fillStyle = colour("--paper");
  g.fillRect(0, 0, width, height);
  paint(g);
};

/**
 * Draws on a canvas of so many pixels of the page, sharply.
 * @param {HTMLCanvasElement} canvas
 * @param {[number, number]} size
 * @param {(g: Pen) => void} paint
 */
export const drawOn = (canvas, size, paint) => {
  const ratio = sharpness();
  const [width, height] = size.map((side) => Math.round(side * ratio));
  if (canvas.width !== width || canvas.height !== height)
    [canvas.width, canvas.height] = [width, height];
  canvas.style.height = `${size[1]}px`;
  const g = contextOf(canvas);
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.imageSmoothingEnabled = false;
  onPaper(g, size, paint);
};

/**
 * Hands out a file.
 * @param {string} name
 * @param {BlobPart} content
 * @param {string} type
 */
export const save = (name, content, type) => {
  const url = URL.createObjectURL(new Blob([content], { type }));
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
};

/**
 * Hands out the pixels of a canvas.
 * @param {string} name
 * @param {HTMLCanvasElement} canvas
 */
export const savePixels = (name, canvas) =>
  canvas.toBlob((blob) => blob && save(name, blob, "image/png"));

/**
 * Buttons that save what a canvas shows: drawn anew as SVG, as pixels, as numbers.
 * @param {string} what
 * @param {() => string} name
 * @param {{ canvas: HTMLCanvasElement, paint: (g: Pen) => void, csv: () => string }} pane
 */
export const savers = (what, name, { canvas, paint, csv }) => [
  button("SVG", `Save ${what} as SVG`, () => {
    /** @type {[number, number]} */
    const size = [canvas.clientWidth, canvas.clientHeight];
    const g = new SvgContext(...size);
    onPaper(g, size, paint);
    save(`${name()}.svg`, new XMLSerializer().serializeToString(g.svg), "image/svg+xml");
  }),
  button("PNG", `Save ${what} as PNG`, () => savePixels(`${name()}.png`, canvas)),
  button("CSV", `Save the numbers of ${what} as CSV`, () =>
    save(`${name()}.csv`, csv(), "text/csv"),
  ),
];
