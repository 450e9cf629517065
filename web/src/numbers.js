// Numbers as text, round values on axes, and numbers that the page holds packed.

/**
 * Number in so many digits, with a proper minus.
 * @param {number} value
 */
export const shown = (value, digits = 6) => {
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text =
    size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  const [mantissa, power] = text.split("e");
  const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
  return (power ? `${short}e${Number(power)}` : short).replaceAll("-", "−");
};

/**
 * Integer in superscript digits.
 * @param {number} power
 */
export const superscript = (power) =>
  String(power)
    .replace("-", "⁻")
    .replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(digit)]);

/**
 * Round values on an axis, their labels, and the power of ten that the labels leave out.
 * @param {number} from
 * @param {number} to
 * @param {number} count least number of steps
 * @param {boolean} plain whether powers are left out of very large and small values only
 */
export const ticks = (from, to, count, plain = false) => {
  const rough = (to - from) / count;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = unit * ([1, 2, 5].find((n) => n * unit >= rough * 0.999) ?? 10);
  const first = Math.ceil(from / step - 1e-9);
  /** @type {number[]} */
  const values = [];
  for (let n = first; n * step <= to + 1e-9 * step && values.length < 50; n++)
    values.push(n * step);
  const largest = Math.max(Math.abs(from), Math.abs(to));
  const leaves = largest >= (plain ? 1e6 : 1e4) || largest < (plain ? 1e-4 : 1e-2);
  const power = leaves ? Math.floor(Math.log10(largest)) : 0;
  const digits = Math.max(0, Math.ceil(power - Math.log10(step) - 1e-9));
  /** @param {number} value */
  const label = (value) =>
    (value / 10 ** power)
      .toFixed(Math.min(digits, 17))
      .replace(/^-(?=[0.]*$)/, "")
      .replace("-", "−");
  return { values, power, label, step };
};

/**
 * Bytes of text in base64.
 * @param {string} text
 */
export const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/**
 * Doubles of text in base64.
 * @param {string} text
 */
export const unpacked = (text) => new Float64Array(bytesOf(text).buffer);

/**
 * Field of CSV, quoted if needed.
 * @param {string | number} value
 */
const field = (value) => {
  const text = String(value);
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};

/**
 * Rows as CSV.
 * @param {(string | number)[][]} rows
 */
export const csvOf = (rows) => rows.map((row) => row.map(field).join(",")).join("\n") + "\n";
