// Pictures of one thing, of which one is seen at a time.

import { chooser, element, toolbar } from "./dom.js";

/** @param {Element} place */
function arrange(place) {
  /** @type {HTMLElement[]} */
  const views = [...place.querySelectorAll(":scope > [data-view]")].flatMap((own) =>
    own instanceof HTMLElement ? [own] : [],
  );
  /** @param {number} shown */
  const show = (shown) => views.forEach((own, n) => (own.hidden = n !== shown));
  show(0);
  if (views.length < 2) return;
  const words = views.map((own) => own.dataset.view ?? "");
  const choice = chooser("Picture that is shown", words, show);
  place.prepend(toolbar(element("label", {}, "Show ", choice)));
}

/** Shows one of the pictures of each place, and offers the others. */
export const arrangeViews = () => document.querySelectorAll(".views").forEach(arrange);
