// Buttons beside what the run drew: saving figures and tables, copying commands.

import { contextOf, save, savePixels } from "./canvas.js";
import { button, element, toolbar } from "./dom.js";
import { bytesOf, csvOf } from "./numbers.js";

/** @param {SVGSVGElement} svg */
const textOf = (svg) => new XMLSerializer().serializeToString(svg);

/**
 * Hands out a drawing as a bitmap of twice its size.
 * @param {string} name
 * @param {SVGSVGElement} svg
 */
const savePicture = (name, svg) => {
  const image = new Image();
  image.onload = () => {
    const { width, height } = svg.viewBox.baseVal;
    const canvas = element("canvas", { width: 2 * width, height: 2 * height });
    contextOf(canvas).drawImage(image, 0, 0, 2 * width, 2 * height);
    savePixels(name, canvas);
  };
  image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(textOf(svg));
};

/**
 * Adds buttons to a figure.
 * @param {Element} figure
 * @param {number} number
 */
function addToFigure(figure, number) {
  /** @type {SVGSVGElement | null} */
  const svg = figure.querySelector(".card svg");
  /** @type {HTMLImageElement | null} */
  const bitmap = figure.querySelector(".card img");
  const bar = toolbar();
  const name = `figure-${number}`;
  /** @type {(kind: string, action: () => void) => void} */
  const add = (kind, action) =>
    bar.append(button(kind, `Save figure ${number} as ${kind}`, action));
  if (svg) {
    add("SVG", () => save(name + ".svg", textOf(svg), "image/svg+xml"));
    add("PNG", () => savePicture(name + ".png", svg));
  } else if (bitmap) {
    add("PNG", () => save(name + ".png", bytesOf(bitmap.src.split(",")[1]), "image/png"));
  }
  const points = figure.querySelector("script.points")?.textContent;
  if (points) {
    const label = `Save the points of figure ${number} as CSV`;
    bar.append(button("CSV", label, () => save(name + ".csv", JSON.parse(points), "text/csv")));
  }
  if (bar.children.length) figure.append(bar);
}

/**
 * Adds a button to a table.
 * @param {Element} figure
 * @param {number} number
 */
function addToTable(figure, number) {
  const rows = () =>
    [...figure.querySelectorAll("tr")].map((row) =>
      [...row.cells].map((cell) => (cell.textContent ?? "").trim()),
    );
  const label = `Save table ${number} as CSV`;
  figure.append(
    toolbar(button("CSV", label, () => save(`table-${number}.csv`, csvOf(rows()), "text/csv"))),
  );
}

/**
 * Adds a button that copies the words of a line.
 * @param {Element} line
 */
export function addCopy(line) {
  const code = /** @type {Element} */ (line.querySelector("code, p"));
  const what = line.matches(".quote") ? "Copy these words" : "Copy the command";
  const copy = button("copy", what, async () => {
    try {
      await navigator.clipboard.writeText(code.textContent ?? "");
    } catch {
      getSelection()?.selectAllChildren(code);
      document.execCommand("copy");
    }
    copy.textContent = "copied";
    setTimeout(() => (copy.textContent = "copy"), 1500);
  });
  line.append(copy);
}

/** Adds all buttons beside what the run drew. */
export function addButtons() {
  document
    .querySelectorAll("figure:not(.table)")
    .forEach((figure, n) => addToFigure(figure, n + 1));
  document.querySelectorAll("figure.table").forEach((figure, n) => addToTable(figure, n + 1));
  document.querySelectorAll(".command, .quote").forEach(addCopy);
}
