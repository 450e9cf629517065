import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const read = (path) => readFileSync(new URL(path, import.meta.url), "utf8");
const RUST = read("../../src/report/live.rs");
const TYPES = read("../src/types.d.ts");

/** Structs of the data, and their names as types of the scripts where these differ. */
const NAMES = { Window: "MeasuredWindow" };

/** Names of the fields in the body of a struct or an interface, in alphabetical order. */
const fields = (body) =>
  [...body.matchAll(/^ +(?:pub(?:\(super\))? )?(\w+): /gm)].map(([, name]) => name).sort();

/** Fields by the name of each declaration that `pattern` finds. */
const declared = (text, pattern) =>
  new Map([...text.matchAll(pattern)].map(([, name, body]) => [name, fields(body)]));

test("the types of the page's data have the fields that the program writes", () => {
  const structs = declared(RUST, /#\[derive\(Serialize\)\]\nstruct (\w+)[^{]*\{\n([^}]*)\}/g);
  const types = declared(TYPES, /^export interface (\w+)[^{]*\{\n([^}]*)\}/gm);
  assert.ok(structs.size >= 10, `${[...structs.keys()]}`);
  for (const [name, own] of structs) assert.deepEqual(types.get(NAMES[name] ?? name), own, name);
});
