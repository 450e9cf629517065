import assert from "node:assert/strict";
import { test } from "node:test";
import { grazeOffset } from "../src/worker/graze.js";

/**
 * Map `x ↦ x/2 + p + q²/5` whose depth is `x + p − 0.3 q`, and which contact pushes away: the
 * orbit without contact grazes at `p = (0.3 q − 0.4 q²) / 3`. `sign` turns p about.
 */
const mapOf = (sign) => {
  let [p, q] = [0, 0];
  return {
    dimension: 1,
    data: { window: { state: [1], parameter: [1, 1], depth: 1 } },
    freezeOne: ([first, second]) => ([p, q] = [sign * first, second]),
    step: ([x]) => {
      const depth = x + p - 0.3 * q;
      const push = depth > 0 ? 3 * Math.sqrt(depth) : 0;
      const slope = depth > 0 ? 1.5 / Math.sqrt(depth) : 0;
      return { image: [x / 2 + p + q * q / 5 + push], depths: [depth], rows: [[0.5 + slope]] };
    },
  };
};

test("the graze moves with another parameter, from either side", () => {
  for (const sign of [1, -1])
    for (const q of [0, 0.2, -0.2, 0.7]) {
      const { offset } = grazeOffset(mapOf(sign), { axis: 0, parameters: [0.5, q], span: 1 });
      const expected = (sign * (0.3 * q - 0.4 * q * q)) / 3;
      assert.ok(Math.abs(offset - expected) < 1e-9, `${offset} is not ${expected}`);
    }
});

test("a map without an orbit has no graze", () => {
  const map = { ...mapOf(1), step: () => ({ image: [NaN], depths: [-1], rows: [[0]] }) };
  assert.deepEqual(grazeOffset(map, { axis: 0, parameters: [0, 0.1], span: 1 }), { offset: null });
});
