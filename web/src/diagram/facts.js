// Words about the orbit at a marker.

import { element } from "../dom.js";
import { shown } from "../numbers.js";
import { LONGEST_PERIOD } from "../worker/periods.js";

/** @import { Complex, Coordinate, Parameter, ProbeAnswer, ReachEnd, ReachWay } from "../types" */

/** @type {Record<ReachWay, string>} */
const WAYS = {
  flip: "flip: a multiplier goes to −1",
  fold: "fold: a multiplier goes to 1",
  torus: "closed curve: a pair of multipliers goes to modulus 1",
  graze: "graze: a contact begins or ends",
  end: "the diagram's end",
  lost: "lost there",
};

/** Beginning of the command of a diagram. */
export const DIAGRAM = /^grazemap diagram /;

/** Words for an orbit whose period is longer than those that are looked for, or that has none. */
export const NO_PERIOD = `no period up to ${LONGEST_PERIOD}`;

/** Longest itinerary that is shown whole. */
const LONGEST = 48;

/**
 * Multipliers, the largest first.
 * @param {Complex[]} multipliers
 */
export function multiplierWords(multipliers) {
  /** @param {Complex} value */
  const modulus = ([re, im]) => Math.hypot(re, im);
  const sorted = [...multipliers].sort((a, b) => modulus(b) - modulus(a));
  const largest = sorted.length ? modulus(sorted[0]) : 0;
  const words = sorted.map((value) => {
    const [re, im] = value;
    if (modulus(value) < 1e-13 * largest) return "0 to rounding";
    if (Math.abs(im) <= 1e-9 * modulus(value)) return shown(re, 5);
    return `${shown(re, 5)} ${im < 0 ? "−" : "+"} ${shown(Math.abs(im), 5)} i`;
  });
  return words.join(", ") || "–";
}

/**
 * Contacts of the returns of an orbit. An itinerary of a period begins with its contacts, since the
 * start decides which return comes first.
 * @param {number[][]} depths
 * @param {number} period
 */
export function contactWords(depths, period) {
  const touched = depths
    .slice(0, period || 32)
    .map((own) => (own.some((depth) => depth > 0) ? "1" : "0"))
    .join("");
  const turned = Array.from(touched, (_, n) => touched.slice(n) + touched.slice(0, n));
  const contacts = (period && turned.sort().at(-1)) || touched;
  const short = contacts.slice(0, LONGEST) + (contacts.length > LONGEST ? "…" : "");
  return `${short} (1: a return with contact)`;
}

/**
 * List of what is known of an orbit; the interval in which it holds is left empty.
 * @param {ProbeAnswer} answer
 * @param {Coordinate[]} coordinates
 */
export function factsOf(answer, coordinates) {
  const { period, depths, multipliers, exponent, outside } = answer;
  const origin = coordinates.map(({ symbol, value }) => `${symbol}* = ${shown(value, 8)}`);
  const rows = [
    ["Period", period ? `${period}` : NO_PERIOD],
    ...(period ? [["Holds", ""]] : []),
    ["Contacts", contactWords(depths, period)],
    ["Multipliers", multiplierWords(multipliers)],
    ["Exponent", shown(exponent, 5)],
    ["Offsets from", origin.join(", ")],
    ["Window", outside ? "outside: not to be trusted" : "inside"],
  ];
  const parts = rows.flatMap(([name, text]) => [
    element("dt", { textContent: name }),
    element("dd", { textContent: text, className: text ? "" : "reach" }),
  ]);
  return element("dl", {}, ...parts);
}

/**
 * Command that computes a periodic orbit, or those of short periods at the parameters of another.
 * @param {string} diagram command of the diagram
 * @param {Parameter[]} parameters
 * @param {Pick<ProbeAnswer, "parameters" | "depths" | "period">} orbit
 */
export const pointCommand = (diagram, parameters, { parameters: offsets, depths, period }) => {
  const at = parameters.map(({ name }, n) => `${name}=${offsets[n]}`).join(",");
  const digits = depths.slice(0, period).flat().map((depth) => Number(depth > 0));
  const itinerary = period ? ` --itinerary ${digits.join("")}` : "";
  return `${diagram.replace(DIAGRAM, "grazemap orbits ")} --at ${at}${itinerary}`;
};

/**
 * Where the period at a marker begins and ends, and why.
 * @param {ReachEnd[]} ends
 * @param {Parameter} parameter
 * @param {number} span range of the whole diagram
 */
export const reachLines = (ends, { symbol, grazing }, span) =>
  ends.map(({ offset: found, way, outside }, n) => {
    // The graze itself, to rounding.
    const offset = Math.abs(found) < 1e-9 * span ? 0 : found;
    const at = `${symbol} = ${shown(grazing + offset, 12)} (offset ${shown(offset, 8)})`;
    const beyond = outside ? "; outside the measured window" : "";
    return `${n ? "to" : "from"} ${at}, ${WAYS[way]}${beyond}`;
  });
