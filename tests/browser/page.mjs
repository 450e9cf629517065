// The page of a run in a real browser: from a file, without a network.
//
// node page.mjs PROGRAM CHROMIUM FOLDER, playwright-core beside it; FOLDER takes runs and pictures.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, statSync, writeFileSync, mkdirSync } from "node:fs";
import { join } from "node:path";
import { createRequire } from "node:module";

const [program, executablePath, folder] = process.argv.slice(2);
const { chromium } = createRequire(join(folder, "package.json"))("playwright-core");
const SCENE = "cantilever_3_5_soft";
const LARGEST_PAGE = 1.5e6;

const run = (arguments_) => execFileSync(program, arguments_, { maxBuffer: 1 << 30, encoding: "utf8" });
const out = join(folder, "out");
mkdirSync(out, { recursive: true });
run(["run", SCENE, "-q", "-o", out]);
const file = join(out, "report.html");
assert.ok(statSync(file).size <= LARGEST_PAGE, `the page has ${statSync(file).size} bytes`);

const browser = await chromium.launch({
  executablePath,
  args: ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"],
});
const checks = [];
const check = (words) => (checks.push(words), console.log(`ok: ${words}`));

/** Opens a page without a network; what it says and asks for is collected. */
async function open(path, options = {}) {
  const context = await browser.newContext({ offline: true, acceptDownloads: true, viewport: { width: 1100, height: 900 }, ...options });
  const page = await context.newPage();
  const said = [];
  page.on("console", (message) => said.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => said.push(String(error)));
  page.on("dialog", (dialog) => said.push(`dialog: ${dialog.message()}`));
  page.on("request", (request) => {
    const url = request.url();
    if (url !== `file://${path}` && !/^(blob|data):/.test(url)) said.push(`request: ${url}`);
  });
  await page.goto(`file://${path}`);
  return { page, said, context };
}
const settled = (page, pane = 0) =>
  page.waitForFunction((n) => window.grazemap?.panes[n]?.done, pane, { timeout: 60_000 });
const live = async (page) => {
  await page.locator(".live").first().scrollIntoViewIfNeeded();
  await settled(page);
  await page.waitForTimeout(100);
};
const view = (page) => page.evaluate(() => structuredClone(window.grazemap.panes[0].view));
const readout = (page) => page.locator(".live .readout").first().textContent();
const again = (page) => page.waitForFunction((n) => window.grazemap.panes[0].number > n && window.grazemap.panes[0].done, again.number, { timeout: 60_000 });
const before = async (page) => (again.number = await page.evaluate(() => window.grazemap.panes[0].number));

{
  const began = Date.now();
  const { page, said, context } = await open(file);
  const opened = Date.now() - began;
  await live(page);
  const times = await page.evaluate(() => ({ first: window.grazemap.panes[0].first, all: window.grazemap.panes[0].times }));
  check(`opens from a file in ${opened} ms; first columns after ${times.first.toFixed(0)} ms, all after ${Object.values(times.all).map((t) => t.toFixed(0)).join(" + ")} ms`);

  // Iterates from states of the diagram, page against program.
  const starts = await page.evaluate(() => {
    const columns = [...window.grazemap.panes[0].layers().up.values()].filter((column) => !column.outside && !column.gone);
    const few = Array.from({ length: 10 }, (_, n) => columns[Math.floor((n * columns.length) / 10)]);
    return few.map(({ state, offset, chunks }) => ({ state, offset, last: chunks.at(-1).at(-1) }));
  });
  // The program's map as it is emitted in JavaScript, which the tests of the emission hold against the interpreter; and,
  // since `image` sums in another order, its images to rounding.
  const COUNT = 100_000;
  run(["emit", SCENE, "--target", "javascript", "--set", "emit.shape=factored", "--no-measure", "-q", "-o", out]);
  const text = readFileSync(join(out, `map_${SCENE}.js`));
  const map = await import(`data:text/javascript;base64,${text.toString("base64")}`);
  const states = join(out, "starts.csv");
  writeFileSync(states, "q,theta,Q\n" + starts.map(({ state, offset }) => [...state, offset].join(",")).join("\n") + "\n");
  const table = run(["image", SCENE, "--states", states, "--using", "map", "--iterations", "1", "--csv", "-", "-q"]);
  const rows = table.trim().split("\n").slice(1).map((line) => line.split(",").map(Number));
  for (const [n, { state, offset, last }] of starts.entries()) {
    const found = await page.evaluate(async ([own, parameters, count]) => {
      const values = await window.grazemap.iterate(own, parameters, count);
      let text = "";
      const bytes = new Uint8Array(values.buffer);
      for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
      return btoa(text);
    }, [state, [offset, 0], COUNT]);
    const values = new Float64Array(Uint8Array.from(Buffer.from(found, "base64")).buffer);
    assert.equal(values.length, 3 * COUNT);
    assert.ok(Object.is(-values[2], last), "what is drawn is −depth of the last state");
    const coefficients = map.freeze([offset, 0]);
    let [from, image, depths] = [state, [], []];
    for (let k = 0; k < COUNT; k++) {
      map.stepFrozen(coefficients, from, image, depths);
      const same = image[0] === values[3 * k] && image[1] === values[3 * k + 1] && depths[0] === values[3 * k + 2];
      assert.ok(same, `start ${n}, iterate ${k}`);
      [from, image] = [image, from];
    }
    const [, , q, theta, contacts] = rows[n];
    assert.ok(Math.abs(q - values[0]) < 1e-17 && Math.abs(theta - values[1]) < 1e-17, `image of start ${n}`);
    assert.equal(contacts, Number(values[2] > 0));
  }
  check(`${COUNT * starts.length} iterates have the bits of the program's map`);
  const rate = await page.evaluate(() => window.grazemap.panes[0].rate);
  console.log(`    ${rate.toFixed(1)} million iterates a second in a sweep of the page, all that it does included`);

  // What is painted are the iterates.
  const painted = await page.evaluate(() => {
    const { canvas, view, layers } = window.grazemap.panes[0];
    const ratio = Math.min(2, devicePixelRatio);
    const [width, height] = [canvas.width / ratio, canvas.height / ratio];
    const plot = { x: 64, y: 34, w: width - 76, h: height - 76 };
    const image = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    const paper = [...image.slice(4 * (canvas.width * (plot.y + 3) + plot.x + 3)).slice(0, 3)];
    let [hits, all] = [0, 0];
    for (const { offset, chunks, gone } of layers().up.values()) {
      if (gone) continue;
      const x = Math.round(plot.x + ((offset - view.x[0]) / (view.x[1] - view.x[0])) * plot.w - 0.5);
      for (const value of chunks[0].slice(0, 8)) {
        const y = Math.round(plot.y + plot.h - ((value - view.y[0]) / (view.y[1] - view.y[0])) * plot.h - 0.5);
        let seen = false;
        for (const dx of [-1, 0, 1]) for (const dy of [-1, 0, 1]) {
          const at = 4 * ((y + dy) * canvas.width + x + dx);
          seen ||= [0, 1, 2].some((n) => Math.abs(image[at + n] - paper[n]) > 12);
        }
        hits += Number(seen);
        all += 1;
      }
    }
    return { hits, all };
  });
  assert.ok(painted.all > 1000 && painted.hits === painted.all, JSON.stringify(painted));
  check(`${painted.all} iterates are painted where they belong`);

  // Hover, click, keys.
  const canvas = page.locator(".live canvas").first();
  const box = await canvas.boundingBox();
  const at = (x, y) => [box.x + 64 + x * (box.width - 76), box.y + 34 + y * (box.height - 76)];
  await page.mouse.move(...at(0.5, 0.5));
  await page.waitForFunction(() => document.querySelector(".live .readout").textContent.includes("period"));
  assert.match(await readout(page), /^Q = −0\.0555\d+ \(offset /);
  await page.mouse.click(...at(0.1, 0.5));
  await page.waitForFunction(() => window.grazemap.panes[0].marked?.period === 1);
  assert.match(await page.locator(".live .facts").first().textContent(), /Multipliers0\.69289/);
  await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => document.querySelector(".live .readout").textContent.includes("exponent"));
  check("hover, click and arrow keys read parameter, state, period and multipliers");

  const whole = await view(page);
  await before(page);
  await page.mouse.move(...at(0.3, 0.2));
  await page.mouse.down();
  await page.mouse.move(...at(0.45, 0.6), { steps: 4 });
  await page.mouse.up();
  await again(page);
  const close = await view(page);
  const width = ({ x }) => x[1] - x[0];
  assert.ok(Math.abs(width(close) / width(whole) - 0.15) < 0.01, "a box is zoomed to");
  const inside = await page.evaluate(() => {
    const { layers, view } = window.grazemap.panes[0];
    const columns = [...layers().up.values()];
    return columns.length > 500 && columns.every(({ offset }) => offset >= view.x[0] && offset <= view.x[1]);
  });
  assert.ok(inside, "the columns are those of the view");
  const zoomed = await page.evaluate(() => ({ first: window.grazemap.panes[0].first, all: window.grazemap.panes[0].times }));
  check(`a box zooms: first columns after ${zoomed.first.toFixed(0)} ms, all after ${Object.values(zoomed.all).map((t) => t.toFixed(0)).join(" + ")} ms`);
  await page.screenshot({ path: join(folder, "zoomed.png") });
  await before(page);
  await page.mouse.wheel(0, -100);
  await again(page);
  assert.ok(width(await view(page)) < width(close), "the wheel zooms");
  await before(page);
  await page.keyboard.press("0");
  await again(page);
  assert.ok(Math.abs(width(await view(page)) / width(whole) - 1) < 1e-9, "0 shows the whole");
  await before(page);
  await page.keyboard.press("+");
  await again(page);
  assert.ok(width(await view(page)) < width(whole), "+ zooms");
  await before(page);
  await page.locator(".live button", { hasText: "whole" }).first().click();
  await again(page);
  check("wheel, keys and buttons zoom");

  const values = () => page.evaluate(() => [...window.grazemap.panes[0].layers().up.values()].at(-1).chunks[0][0]);
  const still = await values();
  await before(page);
  await page.locator(".live .sliders input").first().fill("40");
  await again(page);
  assert.notEqual(await values(), still, "a slider moves another parameter");
  await before(page);
  await page.locator(".live .sliders input").first().fill("0");
  await again(page);
  assert.equal(await values(), still, "and back");
  await before(page);
  await page.locator(".live .tools label.down input").first().uncheck();
  await again(page);
  assert.equal(await page.evaluate(() => window.grazemap.panes[0].layers().down.size), 0);
  check("sliders and toggles answer");

  // The chart: a click goes to its parameters in the diagrams; a box is computed anew.
  const chart = page.locator(".live[data-chart]").first();
  await chart.scrollIntoViewIfNeeded();
  const number = await page.waitForFunction(() => window.grazemap.panes.findIndex(({ chart, done }) => chart && done) + 1, null, { timeout: 60_000 });
  const pane = (await number.jsonValue()) - 1;
  const place = await chart.locator("canvas").boundingBox();
  const onChart = (x, y) => [place.x + 60 + x * (place.width - 72), place.y + 12 + y * (place.height - 56)];
  await page.mouse.move(...onChart(0.3, 0.9));
  await page.waitForFunction(() => document.querySelector(".live[data-chart] .readout").textContent.includes("without contact"));
  await before(page);
  await page.mouse.click(...onChart(0.75, 0.9));
  await again(page);
  assert.match(await page.locator(".live .sliders output").first().textContent(), /offset 1\.[45]\de−4/);
  const cells = await page.evaluate((n) => [...window.grazemap.panes[n].cells().values()].filter((kind) => kind === -1).length / window.grazemap.panes[n].cells().size, pane);
  assert.ok(cells > 0.3 && cells < 0.6, `${cells} of the chart is without contact`);
  await page.mouse.move(...onChart(0.4, 0.1));
  await page.mouse.down();
  await page.mouse.move(...onChart(0.6, 0.4), { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction((n) => window.grazemap.panes[n].number === 2 && window.grazemap.panes[n].done, pane, { timeout: 60_000 });
  const time = await page.evaluate((n) => window.grazemap.panes[n].time, pane);
  check(`the chart reads cells, moves the diagrams, zooms (19200 cells in ${time.toFixed(0)} ms)`);

  const saved = async (button) => {
    const [download] = await Promise.all([page.waitForEvent("download"), button.click()]);
    return [download.suggestedFilename(), readFileSync(await download.path())];
  };
  const kinds = { SVG: /^<svg/, CSV: /^[a-z_]+,/, PNG: /^\x89PNG/ };
  for (const place of [".live .tools", "figure:not(.table) .tools", "figure.table .tools"]) {
    for (const [kind, begins] of Object.entries(kinds)) {
      const button = page.locator(place).first().locator("button", { hasText: kind });
      if ((await button.count()) === 0) {
        assert.ok(place.startsWith("figure.table"), `${place} has no ${kind}`);
        continue;
      }
      const [name, bytes] = await saved(button);
      assert.ok(name.endsWith(kind.toLowerCase()) && begins.test(bytes.toString("latin1")), `${place} ${name}`);
    }
  }
  check("diagrams, figures and tables are saved as SVG, PNG and CSV");
  await page.locator(".command button").first().click();
  await page.waitForFunction(() => document.querySelector(".command button").textContent === "copied");
  const unnamed = await page.evaluate(() => [...document.querySelectorAll("button, input, select, canvas")].filter((own) => !(own.getAttribute("aria-label") || own.closest("label") || own.textContent)).length);
  assert.equal(unnamed, 0, "every control has a name");
  assert.deepEqual(said, [], "nothing is said, nothing asked for");
  check("no message in the console, no request");
  await context.close();
}

// Without a script, narrow, dark.
{
  const { page, said, context } = await open(file, { javaScriptEnabled: false });
  assert.equal(await page.locator(".live:visible").count(), 0);
  assert.ok((await page.locator("figure .card").count()) > 5);
  assert.equal(await page.locator("button").count(), 0);
  assert.deepEqual(said, []);
  await context.close();
  check("whole without a script");
}
for (const colorScheme of ["light", "dark"]) {
  const { page, said, context } = await open(file, { viewport: { width: 420, height: 800 }, colorScheme });
  await live(page);
  assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 420, "nothing is wider than the page");
  const corner = await page.evaluate(() => [...document.querySelector(".live canvas").getContext("2d").getImageData(2, 2, 1, 1).data]);
  assert.ok(colorScheme === "dark" ? corner[0] < 60 : corner[0] > 200, `${corner}`);
  assert.deepEqual(said, []);
  await page.screenshot({ path: join(folder, `narrow-${colorScheme}.png`) });
  await context.close();
}
check("420 pixels wide, light and dark");

// Names that would be markup or code.
{
  const evil = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&`${alert(3)}";
  const quick = ["expansion.smooth_order=2", "expansion.contact_weight=3", "diagram.0.points=30", "diagram.0.transient=50"];
  const scene = readFileSync(process.env.GRAZEMAP_SCENES + "/linear.toml", "utf8")
    .replace(/^name *= *"[^"]*"/m, `name = ${JSON.stringify(evil)}`)
    .replace(/^source *= *"[^"]*"/m, `source = ${JSON.stringify(evil)}`);
  const path = join(out, "hostile.toml");
  writeFileSync(path, scene);
  const hostile = join(out, "hostile");
  run(["run", path, "-q", "-o", hostile, ...quick.flatMap((set) => ["--set", set])]);
  const { page, said, context } = await open(join(hostile, "report.html"));
  assert.ok((await page.title()).includes(evil), "the name is there");
  await live(page);
  const canvas = await page.locator(".live canvas").first().boundingBox();
  await page.mouse.click(canvas.x + 200, canvas.y + 100);
  await page.waitForFunction(() => window.grazemap.panes[0].marked);
  assert.deepEqual(said, [], "hostile names are words");
  await context.close();
  check("hostile names stay words");
}

await browser.close();
console.log(`${checks.length} checks of the page in a browser`);
