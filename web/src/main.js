// The script of the page of a run. Without it the page is whole: pictures, tables and words.
// Everything that names something is data of the page, and is shown as text.

import { byId } from "./dom.js";
import { addButtons } from "./figures.js";
import { Live } from "./live.js";
import { bytesOf } from "./numbers.js";
import { ChartPane } from "./panes/chart.js";
import { DiagramPane } from "./panes/diagram.js";
import { arrangeViews } from "./views.js";
import { Workers } from "./workers.js";

/** @import { Data } from "./types" */

/**
 * Makes a pane when it comes into sight.
 * @param {Live} live
 * @param {HTMLElement} host
 */
function makeInSight(live, host) {
  const diagram = live.data.diagrams[Number(host.dataset.diagram)];
  const chart = live.data.charts[Number(host.dataset.chart)];
  if (!diagram && !chart) {
    host.remove();
    return;
  }
  const observer = new IntersectionObserver(
    (entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      if (diagram) new DiagramPane(live, host, diagram);
      else if (chart) new ChartPane(live, host, chart);
    },
    { rootMargin: "200px" },
  );
  host.hidden = false;
  observer.observe(host);
}

/** Makes the diagrams and charts of the run alive, if it has a map. */
function begin() {
  const modules = byId("map-module")?.textContent;
  const worker = byId("map-worker")?.textContent;
  const text = byId("map-data")?.textContent;
  if (!modules || !worker || !text) throw new Error("it holds no map");
  /** @type {Data} */
  const data = JSON.parse(text);
  const workers = new Workers(worker, modules.trim().split(" ").map(bytesOf), data);
  const live = new Live(data, workers);
  // For a console: images of a state and their depths, one after another.
  Object.assign(window, {
    grazemap: {
      data,
      panes: live.panes,
      /** @type {(state: number[], parameters: number[], count: number) => Promise<Float64Array>} */
      iterate: async (state, parameters, count) =>
        (await workers.ask("orbit", { state, parameters, count })).values,
      /** @type {(parameters: number[], count: number) => Promise<number>} */
      speed: async (parameters, count) =>
        (await workers.ask("speed", { parameters, count })).time,
    },
  });
  for (const host of document.querySelectorAll(".live"))
    if (host instanceof HTMLElement) makeInSight(live, host);
}

addButtons();
try {
  begin();
} catch (error) {
  console.warn("the page stays as the run drew it:", error);
  document.querySelectorAll(".live").forEach((host) => host.remove());
}
arrangeViews();
