// The graze beside other values of the parameters: where the orbit without contact just touches.

import { periodicOrbit } from "./reach.js";

/** @import { GrazeAnswer, GrazeQuestion } from "../types" */
/** @import { LaneMap } from "./lanes.js" */

/** @typedef {{ offset: number, depth: number, state: number[] }} FreeOrbit depth: minus the gap */

/** First distance from the graze, and the most, in half-widths of the window. */
const [FIRST, MOST] = [1e-3, 64];
/** Distance in half-widths at which the graze counts as found. */
const NEAR = 1e-10;

/**
 * Orbit without contact at an offset of the swept parameter; null if there is none.
 * @param {LaneMap} map
 * @param {GrazeQuestion} question
 * @param {number} offset
 * @param {number[]} guess
 * @returns {FreeOrbit | null}
 */
function freeOrbit(map, { axis, parameters }, offset, guess) {
  const orbit = periodicOrbit(map, parameters.with(axis, offset), guess, 1);
  const depth = Math.max(...(orbit?.depths[0] ?? []));
  return orbit && depth <= 0 ? { offset, depth, state: orbit.states[0] } : null;
}

/**
 * First orbits without contact beside the graze, nearer and farther on the free side; null if
 * neither side has them.
 * @param {LaneMap} map
 * @param {GrazeQuestion} question
 * @param {number} side
 * @param {number} width
 * @returns {[FreeOrbit, FreeOrbit] | null}
 */
function firstOrbits(map, question, side, width) {
  const origin = new Array(map.dimension).fill(0);
  for (let length = FIRST * width; length < MOST * width; length *= 2) {
    const near = freeOrbit(map, question, side * length, origin);
    const far = near && freeOrbit(map, question, 2 * side * length, near.state);
    if (near && far) return [near, far];
  }
  return null;
}

/**
 * Offset of the swept parameter at which the orbit without contact grazes, by secants from the
 * free side: beyond the graze the map has contact. Null if it is not found.
 * @param {LaneMap} map
 * @param {GrazeQuestion} question
 * @returns {GrazeAnswer}
 */
export function grazeOffset(map, question) {
  const { axis, parameters, span } = question;
  const width = map.data.window.parameter[axis] ?? span;
  const atGraze = { ...question, parameters: parameters.map(() => 0) };
  const side = [1, -1].find((own) => firstOrbits(map, atGraze, own, width));
  const first = side && firstOrbits(map, question, side, width);
  if (!first) return { offset: null };
  let [near, far] = first;
  for (let turn = 0; turn < 60; turn++) {
    const slope = (near.depth - far.depth) / (near.offset - far.offset);
    const root = near.offset - near.depth / slope;
    const distance = Math.abs(near.offset - root);
    if (!(distance > NEAR * width)) return { offset: root };
    // A tenth of the way is left; less is gone if there is contact already.
    let share = 0.9;
    let next = null;
    for (; !next && share > 1e-3; share /= 2)
      next = freeOrbit(map, question, near.offset + share * (root - near.offset), near.state);
    if (!next) return { offset: null };
    [near, far] = [next, near];
  }
  return { offset: null };
}
