// Periods of runs of states. The rules are those of the program's `iteration` modules.

/** @import { MeasuredWindow, Observable } from "../types" */

/**
 * Distance of a state from the one `shift` later.
 * @typedef {(number: number, shift: number) => number} Apart
 */

export const LONGEST_PERIOD = 256;
export const APPROACH_TOLERANCE = 1e-5;
const PERIOD_TOLERANCE = 1e-8;
/** Share of its first amplitude below which an alternation has shrunk. */
const SHRUNK = 0.95;
/** Largest distance of states a period apart, in scales, of an orbit that converges. */
const NEARBY = 0.1;
/** Fewest and most parts of a run in which its states come nearer. */
const PARTS = [4, 8];

/**
 * Largest distance of the states `first` to `end - 1` from those `shift` later.
 * @param {Apart} apart
 * @param {number} shift
 * @param {number} first
 * @param {number} end
 */
function farthest(apart, shift, first, end) {
  let most = 0;
  for (let n = first; n < end; n++) most = Math.max(most, apart(n, shift));
  return most;
}

/**
 * Period of a run of `count` states that repeat; 0 if they do not. An orbit that approaches a
 * period by alternating about it seems to have twice that period: if the alternation shrinks, the
 * period is the half.
 * @param {number} count
 * @param {Apart} apart
 * @param {number} tolerance
 */
export function periodIn(count, apart, tolerance, longest = count >> 1) {
  for (let period = 1; period <= Math.min(longest, count >> 1); period++) {
    let n = 0;
    while (n + period < count && apart(n, period) <= tolerance) n++;
    if (n + period < count) continue;
    const half = period / 2;
    if (period % 2 || count < half + 2 * period) return period;
    const began = farthest(apart, half, 0, period);
    const ended = farthest(apart, half, count - half - period, count - half);
    return ended < SHRUNK * began ? half : period;
  }
  return 0;
}

/**
 * Period that a run of states approaches; 0 if there is none.
 * @param {number} count
 * @param {Apart} apart
 * @param {number} tolerance
 */
export function approached(count, apart, tolerance) {
  for (let shift = 1; shift <= count / 3; shift++) {
    const pairs = count - shift;
    const began = farthest(apart, shift, 0, pairs >> 1);
    if (!(began <= tolerance)) continue;
    if (farthest(apart, shift, pairs - (pairs >> 1), pairs) < SHRUNK * began) return shift;
  }
  return 0;
}

/**
 * Whether states come nearer to later ones, by some period, in every part of a run.
 * @param {number} count
 * @param {Apart} apart
 */
export function converges(count, apart) {
  /** @param {number} shift */
  const comesNearer = (shift) => {
    const pairs = count - shift;
    const parts = Math.min(Math.floor(pairs / shift), PARTS[1]);
    /** @param {number} part */
    const end = (part) => Math.floor((part * pairs) / parts);
    let before = NEARBY;
    for (let part = 0; part < parts; part++) {
      const distance = farthest(apart, shift, end(part), end(part + 1));
      if (!(distance < before)) return false;
      before = distance;
    }
    return true;
  };
  for (let shift = 1; shift <= count / (PARTS[0] + 1); shift++) if (comesNearer(shift)) return true;
  return false;
}

/**
 * Distances of states from later ones, in half-widths of the window or, if larger, extents.
 * @param {number[][]} states
 * @param {(number | null)[]} widths
 * @returns {Apart}
 */
export function distances(states, widths) {
  const scales = states[0].map((_, n) => {
    const own = states.map((state) => state[n]);
    return Math.max(widths[n] ?? 1, Math.max(...own) - Math.min(...own));
  });
  return (number, shift) => {
    const [a, b] = [states[number], states[number + shift]];
    let most = 0;
    for (let n = 0; n < a.length; n++) {
      const distance = Math.abs(a[n] - b[n]) / scales[n];
      if (!(distance <= most)) most = distance;
    }
    return most;
  };
}

/**
 * Period of states that repeat; 0 if they do not.
 * @param {number[][]} states
 * @param {(number | null)[]} widths
 */
export const periodOf = (states, widths) =>
  periodIn(states.length, distances(states, widths), PERIOD_TOLERANCE);

/**
 * Period of drawn values, as seen in a picture.
 * @param {Float64Array} values
 * @param {Observable} observable
 * @param {MeasuredWindow} window
 */
export function periodSeen(values, { depth, coordinate }, window) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const width = depth === undefined ? window.state[coordinate ?? 0] : window.depth;
  if (!(high - low > 1e-9 * (width ?? 1))) return 1;
  /** @type {Apart} */
  const apart = (n, shift) => Math.abs(values[n] - values[n + shift]);
  return periodIn(values.length, apart, 1e-3 * (high - low), 64);
}
