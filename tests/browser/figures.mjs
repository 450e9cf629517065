// Figures of the page in a browser: how fast it opens, iterates and zooms, and how large it is.
// Times are the best of several, which other work on the machine disturbs least.
//
// bash .ci/browser --figures
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { SCENE, browser, emittedText, live, open, out, places, run } from "./browser.mjs";

run(["run", SCENE, "-q", "-o", out]);
const file = join(out, "report.html");
const rows = [];
const row = (what, found, aim) => rows.push([what, found, aim]);
const best = (values) => Math.min(...values);
const repeat = async (count, once) => {
  const found = [];
  for (let n = 0; n < count; n++) found.push(await once());
  return found;
};

// From the navigation to what is painted first, and to the first iterates of a diagram.
const opened = await repeat(5, async () => {
  const { page, context } = await open(`${file}`);
  const paint = await page.evaluate(
    () => performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? performance.now(),
  );
  await context.close();
  return paint;
});
row("opens from the disk, first figure", `${best(opened).toFixed(0)} ms`, "1000 ms");
const begun = await repeat(3, async () => {
  const { page, context } = await open(file);
  await page.evaluate(() => document.querySelector(".live").scrollIntoView());
  await page.waitForFunction(() => window.grazemap?.panes[0]?.sweeps.first);
  const time = await page.evaluate(() => performance.now());
  await context.close();
  return time;
});
row("opens from the disk, first iterates of a live diagram", `${best(begun).toFixed(0)} ms`, "");

const { page, context, said } = await open(file, { deviceScaleFactor: 2 });
await live(page);

// The map alone, as the page has it and as text.
const STEPS = 4_000_000;
const sixty = await repeat(7, () => page.evaluate((count) => window.grazemap.speed([1e-4, 0], count), STEPS));
row(
  "iterates a second, f64x2 interleaved",
  `${(STEPS / best(sixty) / 1000).toFixed(0)} million`,
  "15 million",
);
const blank = await context.newPage();
const text = readFileSync(await emittedText()).toString("base64");
const byText = await repeat(5, () =>
  blank.evaluate(
    async ([source, count]) => {
      const map = await import(`data:text/javascript;base64,${source}`);
      const coefficients = map.freeze([1e-4, 0]);
      let [from, image] = [new Float64Array(2), new Float64Array(2)];
      const depths = new Float64Array(1);
      const began = performance.now();
      for (let n = 0; n < count; n++) {
        map.stepFrozen(coefficients, from, image, depths);
        [from, image] = [image, from];
      }
      return performance.now() - began;
    },
    [text, STEPS / 4],
  ),
);
row(
  "the same, JavaScript alone",
  `${(STEPS / 4 / best(byText) / 1000).toFixed(1)} million`,
  "beside it",
);
await blank.close();
await page.bringToFront();

// Zooms of 1000 values, 1200 iterates each, one sweep; tasks of the page meanwhile.
await page.locator(".live .tools label.down input").first().uncheck();
const canvas = page.locator(".live canvas").first();
await page.evaluate(() => {
  window.tasks = [];
  new PerformanceObserver((list) => window.tasks.push(...list.getEntries())).observe({
    type: "longtask",
  });
});
const zooms = await repeat(8, async () => {
  await page.keyboard.press("0");
  await page.waitForFunction(() => window.grazemap.panes[0].done);
  const at = await places(page, canvas);
  const number = await page.evaluate(() => window.grazemap.panes[0].number);
  await page.mouse.move(...at(0.3, 0.5));
  await page.mouse.down();
  await page.mouse.move(...at(0.6, 0.5), { steps: 8 });
  await page.mouse.up();
  await page.waitForFunction(
    (n) => window.grazemap.panes[0].number > n && window.grazemap.panes[0].done,
    number,
  );
  return page.evaluate(() => {
    const { first, whole, layers } = window.grazemap.panes[0].sweeps;
    const columns = [...layers.up.values()];
    const sizes = columns.map(({ chunks }) => chunks.reduce((sum, own) => sum + own.length, 0));
    return { first, whole, columns: columns.length, iterates: Math.min(...sizes) };
  });
});
const [{ columns, iterates }] = zooms;
const size = `a zoom of ${columns} x ${iterates} iterates`;
row(`${size}, first picture`, `${best(zooms.map(({ first }) => first)).toFixed(0)} ms`, "100 ms");
row(`${size}, whole`, `${best(zooms.map(({ whole }) => whole)).toFixed(0)} ms`, "500 ms");
const longest = await page.evaluate(() =>
  Math.max(0, ...window.tasks.map(({ duration }) => duration)),
);
row("longest task of the page in those zooms", `${longest.toFixed(0)} ms`, "");

// Sizes.
const html = readFileSync(file, "utf8");
const scripts = await page.evaluate(() => ({
  page: document.querySelector("script:not([type])").textContent.length,
  worker: document.getElementById("map-worker").textContent.length,
  modules: document.getElementById("map-module").textContent.length,
  data: document.getElementById("map-data").textContent.length,
}));
const kilo = (bytes) => `${(bytes / 1000).toFixed(1)} kB`;
row("the page", kilo(Buffer.byteLength(html)), "1500 kB");
row("libraries", "none", "60 kB");
row("scripts: page, worker", `${kilo(scripts.page)}, ${kilo(scripts.worker)}`, "");
row("modules of the map in base64, data", `${kilo(scripts.modules)}, ${kilo(scripts.data)}`, "");
if (said.length) throw new Error(said.join("\n"));
await browser.close();

const lines = [["what", "found", "aim"], ["---", "---", "---"], ...rows];
const table = lines.map((cells) => `| ${cells.join(" | ")} |`).join("\n") + "\n";
writeFileSync(join(out, "figures.md"), table);
console.log(table);
