// Classes of columns and cells: a period, 0 for no period, or one of the numbers below.

export const WITHOUT_CONTACT = -1;
export const OUTSIDE = -2;
export const ESCAPED = -3;
export const NOT_SETTLED = -4;

/** Colours of periods 1 to 8; the last is that of all longer ones. */
export const PERIODS = [
  "#88ccee",
  "#ddcc77",
  "#cc6677",
  "#117733",
  "#aa4499",
  "#999933",
  "#882255",
  "#44aa99",
  "#332288",
];

/**
 * Words and colours of the classes that are no periods.
 * @type {Record<number, [string, string]>}
 */
const CLASSES = {
  [WITHOUT_CONTACT]: ["period 1 without contact", "#f7eec3"],
  [OUTSIDE]: ["outside the measured window", "#b3b7bc"],
  [NOT_SETTLED]: ["not settled, still converging", "#6a7078"],
  0: ["no period", "#f4a582"],
};

/** @param {number} kind */
export const classWords = (kind) => CLASSES[kind]?.[0] ?? `period ${kind}`;

/** @param {number} kind */
export const classColour = (kind) => CLASSES[kind]?.[1] ?? PERIODS[Math.min(kind, 9) - 1];

/**
 * Whether white letters are read on a colour, and black ones are not.
 * @param {string} tone
 */
export const isDark = (tone) => {
  const weights = [3, 6, 1];
  const parts = weights.map((weight, n) => weight * parseInt(tone.slice(2 * n + 1, 2 * n + 3), 16));
  return parts[0] + parts[1] + parts[2] < 1275;
};
