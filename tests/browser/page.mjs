// The page of a run in a real browser: from a file, without a network.
import assert from "node:assert/strict";
import { existsSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import {
  LARGEST_PAGE,
  SCENE,
  browser,
  emittedText,
  folder,
  live,
  open,
  out,
  places,
  run,
  settled,
} from "./browser.mjs";

// An oscillator without a phase: its section has one coordinate.
const ONE_COORDINATE = `
[model]
name = "van der Pol oscillator with a stop"
states = ["x", "v"]
parameters = { mu = 0.5, delta = 2.0, r = 0.8 }

[model.flow]
x = "v"
v = "mu*(1 - x^2)*v - x"

[[model.surface]]
name = "stop"
event = "delta - x"
impact = { v = "-r*v" }

[grazing]
surface = "stop"
solve_for = "delta"
guess = { x = 2.009, v = 0.0 }

[section]
kind = "tangency"

[expansion]
active = ["delta"]
smooth_order = 3
contact_weight = 4

[window]
depth = 1e-3
state = { x = 1e-2, v = 1e-2 }
parameter = { delta = 1e-2 }

[[diagram]]
parameter = "delta"
range = [-1e-3, 1e-3]
points = 60
transient = 200
keep = 50
observe = "h"
direction = "both"
`;

run(["run", SCENE, "-q", "-o", out]);
const file = join(out, "report.html");
assert.ok(statSync(file).size <= LARGEST_PAGE, `the page has ${statSync(file).size} bytes`);

const checks = [];
const check = (words) => (checks.push(words), console.log(`ok: ${words}`));

const view = (page) => page.evaluate(() => window.grazemap.panes[0].view.ranges);
const readout = (page) => page.locator(".live .readout").first().textContent();
const again = (page) =>
  page.waitForFunction(
    (n) => window.grazemap.panes[0].number > n && window.grazemap.panes[0].done,
    again.number,
    { timeout: 60_000 },
  );
const before = async (page) =>
  (again.number = await page.evaluate(() => window.grazemap.panes[0].number));

{
  const began = Date.now();
  const { page, said, context } = await open(file);
  const opened = Date.now() - began;
  await live(page);
  const times = await page.evaluate(() => ({
    first: window.grazemap.panes[0].sweeps.first,
    all: window.grazemap.panes[0].sweeps.times,
  }));
  check(
    `opens from a file in ${opened} ms; first columns after ${times.first.toFixed(0)} ms, all after ${Object.values(
      times.all,
    )
      .map((t) => t.toFixed(0))
      .join(" + ")} ms`,
  );

  // The verdict and the live diagram stand on the first screen.
  for (const width of [1280, 420]) {
    const first = await open(file, { viewport: { width, height: 900 } });
    await settled(first.page);
    const seen = await first.page.evaluate(() => {
      const places = [".summary", ".live canvas"].map((name) => {
        const { top, bottom } = document.querySelector(name).getBoundingClientRect();
        return [top, bottom];
      });
      const summary = document.querySelector(".summary").textContent;
      return { places, summary, height: innerHeight, scrolled: scrollY };
    });
    const [[, said], [top, bottom]] = seen.places;
    assert.equal(seen.scrolled, 0);
    assert.match(seen.summary, /^The orbit grazes the surface “stop” at Q\* = .*chaos at once\.$/);
    assert.ok(said <= top && top < seen.height / 2, `${width}: the diagram begins at ${top}`);
    assert.ok(bottom <= seen.height, `${width}: the diagram ends at ${bottom}`);
    await first.page.screenshot({ path: join(folder, `first-${width}.png`) });
    await first.context.close();
  }
  check("the verdict and the live diagram stand on the first screen, wide and narrow");

  // Iterates from states of the diagram, page against program.
  const starts = await page.evaluate(() => {
    const columns = [...window.grazemap.panes[0].sweeps.layers.up.values()].filter(
      (column) => !column.outside && !column.gone,
    );
    const few = Array.from(
      { length: 10 },
      (_, n) => columns[Math.floor((n * columns.length) / 10)],
    );
    return few.map(({ state, offset, chunks }) => ({ state, offset, last: chunks.at(-1).at(-1) }));
  });
  // The program's map as it is emitted in JavaScript, which the tests of the emission hold against
  // the interpreter, and its images by `image`.
  const COUNT = 100_000;
  const IMAGES = 500;
  const text = readFileSync(await emittedText());
  const map = await import(`data:text/javascript;base64,${text.toString("base64")}`);
  const states = join(out, "starts.csv");
  writeFileSync(
    states,
    "q,theta,Q\n" +
      starts.map(({ state, offset }) => [...state, offset].join(",")).join("\n") +
      "\n",
  );
  const table = run([
    "image",
    SCENE,
    "--states",
    states,
    "--using",
    "map",
    "--iterations",
    `${IMAGES}`,
    "--csv",
    "-",
    "-q",
  ]);
  const rows = table
    .trim()
    .split("\n")
    .slice(1)
    .map((line) => line.split(",").map(Number));
  for (const [n, { state, offset, last }] of starts.entries()) {
    const found = await page.evaluate(
      async ([own, parameters, count]) => {
        const values = await window.grazemap.iterate(own, parameters, count);
        let text = "";
        const bytes = new Uint8Array(values.buffer);
        for (let at = 0; at < bytes.length; at += 32768)
          text += String.fromCharCode(...bytes.subarray(at, at + 32768));
        return btoa(text);
      },
      [state, [offset, 0], COUNT],
    );
    const values = new Float64Array(Uint8Array.from(Buffer.from(found, "base64")).buffer);
    assert.equal(values.length, 3 * COUNT);
    assert.ok(Object.is(-values[2], last), "what is drawn is −depth of the last state");
    const coefficients = map.freeze([offset, 0]);
    let [from, image, depths] = [state, [], []];
    for (let k = 0; k < COUNT; k++) {
      map.stepFrozen(coefficients, from, image, depths);
      const same =
        image[0] === values[3 * k] &&
        image[1] === values[3 * k + 1] &&
        depths[0] === values[3 * k + 2];
      assert.ok(same, `start ${n}, iterate ${k}`);
      [from, image] = [image, from];
    }
    const images = rows.filter(([row]) => row === rows[IMAGES * n][0]);
    assert.equal(images.length, IMAGES);
    for (const [k, [, , q, theta, contacts]] of images.entries()) {
      assert.ok(q === values[3 * k] && theta === values[3 * k + 1], `image ${k} of start ${n}`);
      assert.equal(contacts, Number(values[3 * k + 2] > 0));
    }
  }
  check(`${COUNT * starts.length} iterates have the bits of the program's map`);
  const rate = await page.evaluate(() => window.grazemap.panes[0].sweeps.rate);
  console.log(
    `    ${rate.toFixed(1)} million iterates a second in a sweep of the page, all that it does included`,
  );

  // What is painted are the iterates.
  const painted = await page.evaluate(() => {
    const { canvas, view, sweeps, plot } = window.grazemap.panes[0];
    const image = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    const paper = [...image.slice(4 * (canvas.width * (plot.y + 3) + plot.x + 3)).slice(0, 3)];
    let [hits, all] = [0, 0];
    for (const { offset, chunks, gone } of sweeps.layers.up.values()) {
      if (gone) continue;
      const x = Math.round(
        plot.x + ((offset - view.x[0]) / (view.x[1] - view.x[0])) * plot.w - 0.5,
      );
      for (const value of chunks[0].slice(0, 8)) {
        const y = Math.round(
          plot.y + plot.h - ((value - view.y[0]) / (view.y[1] - view.y[0])) * plot.h - 0.5,
        );
        let seen = false;
        for (const dx of [-1, 0, 1])
          for (const dy of [-1, 0, 1]) {
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

  // Branches and points of direct simulation.
  const curves = await page.evaluate(() => {
    const { curves: depth, direct: points, labels } = window.grazemap.panes[0].branches;
    return { depth, points, labels };
  });
  for (const stable of [true, false]) assert.ok(curves.depth.some((own) => own.stable === stable));
  assert.ok(curves.labels.some(({ text }) => text === "GR"));
  // The graze is at no depth, and a branch's depths come again after its period.
  const branch = await page.evaluate(async () => {
    const { data, iterate } = window.grazemap;
    const own = data.branches.find(({ itinerary }) => itinerary === "100");
    const bytes = Uint8Array.from(atob(own.lines[0].points), (c) => c.charCodeAt(0));
    const [offset, ...states] = new Float64Array(bytes.buffer).slice(-7);
    const values = await iterate(states.slice(0, 2), [offset, 0], 4);
    return { offset, states, images: [...values], stable: own.lines[0].stable };
  });
  const returns = [3, 4, 6, 7, 9, 10].map((n) => branch.images[n - 3]);
  for (const [n, value] of [...branch.states.slice(2), ...branch.states.slice(0, 2)].entries())
    assert.ok(Math.abs(returns[n] - value) < 1e-12, `${returns[n]} is not ${value}`);
  const drawn = curves.depth.filter(({ itinerary }) => itinerary === "100");
  assert.equal(drawn.length, 3);
  for (const [n, { points }] of drawn.entries()) {
    const [offset, value] = points.at(-1);
    assert.equal(offset, branch.offset);
    assert.ok(Math.abs(value + branch.images[(3 * n + 2) % 12]) < 1e-15);
  }
  const byDirect = JSON.parse(readFileSync(join(out, "diagram.json"), "utf8"))
    .flatMap(({ sweeps }) => sweeps)
    .filter(({ method }) => method === "direct")
    .flatMap(({ points }) => points);
  const known = new Map(byDirect.map(({ offset, values }) => [offset, values]));
  assert.ok(curves.points.length > 500);
  assert.ok(curves.points.every(([offset, value]) => known.get(offset).includes(value)));
  const painting = () =>
    page.evaluate(
      () =>
        new Promise((done) =>
          requestAnimationFrame(() =>
            requestAnimationFrame(() => done(window.grazemap.panes[0].canvas.toDataURL())),
          ),
        ),
    );
  for (const name of ["branches", "direct"]) {
    const box = page.locator(`.live .tools label.${name} input`).first();
    const [pictures, was] = [[await painting()], await box.isChecked()];
    await box.setChecked(!was);
    pictures.push(await painting());
    await box.setChecked(was);
    pictures.push(await painting());
    assert.ok(pictures[0] !== pictures[1] && pictures[0] === pictures[2], `${name} are a layer`);
  }
  check(`${curves.depth.length} curves of branches and ${curves.points.length} points of direct simulation are layers`);

  // Hover, click, keys.
  const canvas = page.locator(".live canvas").first();
  const at = await places(page, canvas);
  await page.mouse.move(...at(0.5, 0.5));
  await page.waitForFunction(() =>
    document.querySelector(".live .readout").textContent.includes("period"),
  );
  assert.match(await readout(page), /^Q = −0\.0555\d+ \(offset /);
  await page.mouse.click(...at(0.1, 0.5));
  await page.waitForFunction(() => window.grazemap.panes[0].marker.answer?.period === 1);
  assert.match(await page.locator(".live .facts").first().textContent(), /Multipliers0\.69289/);
  await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() =>
    document.querySelector(".live .readout").textContent.includes("exponent"),
  );
  check("hover, click and arrow keys read parameter, state, period and multipliers");

  // The basins at two markers, cells against images by the program.
  for (const share of [0.1, 0.5]) {
    await page.mouse.click(...at(share, 0.5));
    const settled = () => window.grazemap.panes[0].marker.answer && window.grazemap.panes[0].panels.basin.done;
    await page.waitForFunction(settled, null, { timeout: 60_000 });
    const basin = await page.evaluate(() => {
      const { panels, marker } = window.grazemap.panes[0];
      const { attractors, grid } = panels.basin;
      const { columns, rows, x, y, cells } = grid;
      const few = Array.from({ length: 24 }, (_, n) => Math.floor(((n + 0.5) / 24) * columns * rows));
      const states = few.map((cell) => [
        x[0] + (((cell % columns) + 0.5) / columns) * (x[1] - x[0]),
        y[0] + ((Math.floor(cell / columns) + 0.5) / rows) * (y[1] - y[0]),
      ]);
      return {
        count: cells.size / columns / rows,
        offset: marker.answer.parameters[0],
        states,
        kinds: few.map((cell) => cells.get(cell)),
        periods: attractors.map(({ period }) => period),
      };
    });
    assert.equal(basin.count, 1, "every cell has a class");
    const starts = join(out, "basin.csv");
    const lines = basin.states.map((state) => [...state, basin.offset].join(","));
    writeFileSync(starts, ["q,theta,Q", ...lines, ""].join("\n"));
    const asked = ["image", SCENE, "--states", starts, "--using", "map", "--iterations", "2128"];
    const all = run([...asked, "--csv", "-", "-q"]).trim().split("\n");
    const names = all[0].split(",");
    const images = all.slice(1).map((line) => line.split(","));
    const inside = names.indexOf("inside");
    for (const [n, kind] of basin.kinds.entries()) {
      const first = images[0][0];
      const own = images.filter(([row]) => Number(row) === n + Number(first));
      const stays = own.length === 2128 && own.every((row) => row[inside] === "1");
      assert.equal(kind >= 0, stays, `cell ${n} of the basin, ${kind}`);
      if (!stays) continue;
      const last = own.slice(-128).map((row) => Number(row[2]));
      const repeats = last.slice(1).every((q) => Math.abs(q - last[0]) < 1e-8 * 1e-3);
      assert.equal(basin.periods[kind], repeats ? 1 : 0, `cell ${n} of the basin`);
    }
    assert.ok(basin.kinds.some((kind) => kind >= 0) && basin.kinds.some((kind) => kind < 0));
  }
  const scrolled = await page.evaluate(() => scrollY);
  await page.locator(".live .panels").first().screenshot({ path: join(folder, "basin.png") });
  await page.evaluate((y) => scrollTo(0, y), scrolled);
  check("the basins at a marker are those of the program's images");

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
    const { sweeps, view } = window.grazemap.panes[0];
    const columns = [...sweeps.layers.up.values()];
    return (
      columns.length > 500 &&
      columns.every(({ offset }) => offset >= view.x[0] && offset <= view.x[1])
    );
  });
  assert.ok(inside, "the columns are those of the view");
  const zoomed = await page.evaluate(() => ({
    first: window.grazemap.panes[0].sweeps.first,
    all: window.grazemap.panes[0].sweeps.times,
  }));
  check(
    `a box zooms: first columns after ${zoomed.first.toFixed(0)} ms, all after ${Object.values(
      zoomed.all,
    )
      .map((t) => t.toFixed(0))
      .join(" + ")} ms`,
  );
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
  for (const back of [
    () => page.locator(".live button", { hasText: "back" }).first().click(),
    () => canvas.press("Backspace"),
  ]) {
    const now = await view(page);
    await before(page);
    await canvas.press("+");
    await again(page);
    assert.notDeepEqual(await view(page), now);
    await before(page);
    await back();
    await again(page);
    assert.deepEqual(await view(page), now, "back to the view before");
  }
  // A drag says what it does, and is let go of.
  await page.mouse.move(...at(0.3, 0.5));
  await page.mouse.down();
  await page.mouse.move(...at(0.5, 0.5), { steps: 4 });
  assert.match(await readout(page), /^Let go to see Q from −0\.0556\d+ /);
  const kept = await view(page);
  await page.keyboard.press("Escape");
  await page.mouse.up();
  assert.deepEqual(await view(page), kept, "Escape lets go of a drag");
  assert.equal(await readout(page), "", "what a drag would do is said while it lasts");
  check("wheel, keys and buttons zoom, and go back; Escape lets go of a drag");

  const values = () =>
    page.evaluate(() => [...window.grazemap.panes[0].sweeps.layers.up.values()].at(-1).chunks[0][0]);
  const still = await values();
  await before(page);
  await page.locator(".live .sliders input").first().fill("40");
  await again(page);
  assert.notEqual(await values(), still, "a slider moves another parameter");
  // The line of the graze goes with the slider, to where the program locates the grazing orbit.
  const graze = () => page.evaluate(() => window.grazemap.panes[0].graze);
  await page.waitForFunction(() => window.grazemap.panes[0].graze);
  const located = await page.evaluate(() => {
    const { base, parameter, live } = window.grazemap.panes[0];
    return { beta: live.data.parameters[1].grazing + base[1], Q: parameter.grazing };
  });
  const orbit = run(["locate", SCENE, "--set", `beta=${located.beta}`, "-q", "--json", "-"]);
  const moved = JSON.parse(orbit).parameters.Q - located.Q;
  assert.ok(Math.abs(moved) > 1e-5, `${moved}`);
  assert.ok(Math.abs((await graze()) / moved - 1) < 1e-6, `${await graze()} is not ${moved}`);
  await page.screenshot({ path: join(folder, "graze.png") });
  await before(page);
  await page.locator(".live .sliders input").first().fill("0");
  await again(page);
  assert.equal(await values(), still, "and back");
  assert.equal(await graze(), 0, "the graze too");
  await before(page);
  await page.locator(".live .tools label.down input").first().uncheck();
  await again(page);
  assert.equal(await page.evaluate(() => window.grazemap.panes[0].sweeps.layers.down), undefined);
  await before(page);
  const reference = await page.evaluate(() =>
    [...window.grazemap.panes[0].sweeps.layers.up.values()]
      .slice(-50)
      .flatMap(({ chunks }) => [...chunks[0]]),
  );
  await page.getByLabel("Orders of the map").first().selectOption({ index: 3 });
  await again(page);
  const lower = await page.evaluate(() =>
    [...window.grazemap.panes[0].sweeps.layers.up.values()]
      .slice(-50)
      .flatMap(({ chunks }) => [...chunks[0]]),
  );
  assert.ok(
    lower.length === reference.length && lower.some((value, n) => value !== reference[n]),
    "lower orders are another map",
  );
  // The map itself beneath them is that of the view, before and after a zoom.
  const beneath = () =>
    page.evaluate(() => {
      const { sweeps, view } = window.grazemap.panes[0];
      const columns = [...sweeps.layers["map up"].values()];
      const inside = columns.every(({ offset }) => offset > view.x[0] && offset < view.x[1]);
      return { inside, values: columns.slice(-50).flatMap(({ chunks }) => [...chunks[0]]) };
    });
  assert.deepEqual((await beneath()).values, reference, "the map itself lies beneath lower orders");
  await page.screenshot({ path: join(folder, "orders.png") });
  await before(page);
  await canvas.focus();
  await page.keyboard.press("+");
  await again(page);
  assert.ok((await beneath()).inside);
  await before(page);
  await page.keyboard.press("0");
  await again(page);
  await before(page);
  await page.getByLabel("Orders of the map").first().selectOption({ index: 0 });
  await again(page);
  check("sliders, toggles and orders answer, and the graze goes with the sliders");

  // One picture at a time: a control offers those that the run drew.
  const views = page.locator(".views").first();
  const choice = views.getByLabel("Picture that is shown");
  const offered = await choice.locator("option").allTextContents();
  for (const words of [/^live: /, /by direct simulation$/, /Lyapunov exponent$/, /^impact speed over Q$/])
    assert.ok(offered.some((own) => words.test(own)), `${words} is not in ${offered}`);
  for (const [n, own] of offered.entries()) {
    await choice.selectOption({ index: n });
    const shown = views.locator(":scope > [data-view]:not([hidden])");
    assert.deepEqual(await shown.evaluateAll((all) => all.map(({ dataset }) => dataset.view)), [own]);
    if (own.startsWith("live")) await shown.locator("canvas").first().waitFor();
    else assert.ok((await shown.locator(".card svg, .card img").boundingBox()).height > 100);
  }
  await choice.selectOption({ index: 0 });
  check(`${offered.length} pictures of the diagrams, one at a time`);

  // The chart: a click goes to its parameters in the diagrams; a box is computed anew.
  const chart = page.locator(".live[data-chart]").first();
  await chart.scrollIntoViewIfNeeded();
  const number = await page.waitForFunction(
    () => window.grazemap.panes.findIndex(({ chart, done }) => chart && done) + 1,
    null,
    { timeout: 60_000 },
  );
  const pane = (await number.jsonValue()) - 1;
  await chart.locator("canvas").scrollIntoViewIfNeeded();
  const onChart = await places(page, chart.locator("canvas"), pane);
  await page.mouse.move(...onChart(0.3, 0.9));
  await page.waitForFunction(() =>
    document.querySelector(".live[data-chart] .readout").textContent.includes("without contact"),
  );
  await before(page);
  await page.mouse.click(...onChart(0.75, 0.9));
  await again(page);
  assert.match(
    await page.locator(".live .sliders output").first().textContent(),
    /offset 1\.[45]\d?e−4/,
  );
  const cells = await page.evaluate(
    (n) =>
      [...window.grazemap.panes[n].grid.cells.values()].filter((kind) => kind === -1).length /
      window.grazemap.panes[n].grid.cells.size,
    pane,
  );
  assert.ok(cells > 0.3 && cells < 0.6, `${cells} of the chart is without contact`);
  await page.mouse.move(...onChart(0.4, 0.1));
  await page.mouse.down();
  await page.mouse.move(...onChart(0.6, 0.4), { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(
    (n) => window.grazemap.panes[n].number === 2 && window.grazemap.panes[n].done,
    pane,
    { timeout: 60_000 },
  );
  const time = await page.evaluate((n) => window.grazemap.panes[n].time, pane);
  check(`the chart reads cells, moves the diagrams, zooms (19200 cells in ${time.toFixed(0)} ms)`);

  const saved = async (button) => {
    const [download] = await Promise.all([page.waitForEvent("download"), button.click()]);
    return [download.suggestedFilename(), readFileSync(await download.path())];
  };
  const kinds = { SVG: /^<svg/, CSV: /^[a-z_]+,/, PNG: /^\x89PNG/ };
  const panels = [1, 2, 3].map((n) => `.live .panels > :nth-child(${n + 1}) .tools`);
  for (const place of [
    ".live > .tools",
    ...panels,
    ".live[data-chart] > .tools",
    "figure:visible:has(script.points) .tools",
    "figure.table .tools",
  ]) {
    for (const [kind, begins] of Object.entries(kinds)) {
      const button = page.locator(place).first().locator("button", { hasText: kind });
      if ((await button.count()) === 0) {
        assert.ok(place.startsWith("figure.table"), `${place} has no ${kind}`);
        continue;
      }
      const [name, bytes] = await saved(button);
      assert.ok(
        name.endsWith(kind.toLowerCase()) && begins.test(bytes.toString("latin1")),
        `${place} ${name}`,
      );
      if (kind !== "SVG") continue;
      const words = await page.evaluate((text) => {
        const { documentElement: svg } = new DOMParser().parseFromString(text, "image/svg+xml");
        return svg.matches("svg") && [...svg.querySelectorAll("text")].map((own) => own.textContent);
      }, bytes.toString());
      assert.ok(words && words.length > 0, `${place} ${name} is a drawing with words`);
      if (place === ".live > .tools") assert.ok(words.includes("Q − Q* / 10⁻⁴"), `${words}`);
    }
  }
  check("diagrams, panels, charts, figures and tables are saved as SVG, PNG and CSV");
  await page.locator(".command button").first().click();
  await page.waitForFunction(
    () => document.querySelector(".command button").textContent === "copied",
  );
  const unnamed = await page.evaluate(
    () =>
      [...document.querySelectorAll("button, input, select, canvas")].filter(
        (own) => !(own.getAttribute("aria-label") || own.closest("label") || own.textContent),
      ).length,
  );
  assert.equal(unnamed, 0, "every control has a name");
  const nameless = await page.locator("[role=img], [role=application]").evaluateAll(
    (all) =>
      all.filter((own) => {
        const named = document.getElementById(own.getAttribute("aria-labelledby"));
        return !(own.getAttribute("aria-label") || own.getAttribute("alt") || named?.textContent);
      }).length,
  );
  assert.equal(nameless, 0, "every picture has a name");
  assert.deepEqual(said, [], "nothing is said, nothing asked for");
  check("no message in the console, no request");
  const sketch = page.locator("section:has(.equations) .card svg[role=img]");
  assert.equal(await sketch.count(), 1, "a sketch");
  const links = await page.locator(".files a").evaluateAll((all) => all.map((own) => own.href));
  assert.ok(links.length > 10);
  for (const link of links) assert.ok(existsSync(fileURLToPath(link)), link);
  check(`a sketch of the stops, ${links.length} links to files beside the page`);
  await context.close();
}

// By the keyboard alone; what is read stands out from what it stands on; on paper.
for (const colorScheme of ["light", "dark"]) {
  const { page, said, context } = await open(file, { colorScheme });
  await live(page);
  // What is alive is made when it comes into sight; the focus begins where all is there.
  const shown = page.locator(".live:not([hidden])");
  for (const own of await shown.all()) {
    await own.scrollIntoViewIfNeeded();
    await own.locator("canvas").first().waitFor();
  }
  await page.evaluate(() => document.activeElement.blur());
  const order = [];
  for (let n = 0; n < 400; n++) {
    await page.keyboard.press("Tab");
    const number = await page.evaluate(() => {
      const own = document.activeElement;
      if (own === document.body) return -1;
      window.reached ??= [];
      window.reached.push(own);
      return [...document.querySelectorAll("*")].indexOf(own);
    });
    if (number < 0 || number === order[0]) break;
    order.push(number);
  }
  assert.deepEqual(order, [...order].sort((a, b) => a - b), "the focus goes down the page");
  const left = await page.evaluate(
    () =>
      [...document.querySelectorAll("a[href], button:enabled, input, select, .live > canvas")].filter(
        (own) => own.checkVisibility() && !window.reached.includes(own),
      ).length,
  );
  assert.equal(left, 0, "everything is reached by the tabulator");
  const canvas = page.locator(".live canvas").first();
  await canvas.focus();
  await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => window.grazemap.panes[0].marker.answer);
  const outline = await canvas.evaluate((own) => getComputedStyle(own).outlineStyle);
  assert.equal(outline, "solid", "the focus is seen");
  // WCAG 2.2, 1.4.3: the contrast of text.
  const pale = await page.evaluate(() => {
    const numbers = (text) => text.match(/[\d.]+/g).map(Number);
    const luminance = (colour) => {
      const [r, g, b] = colour.slice(0, 3).map((own) => {
        const v = own / 255;
        return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
      });
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = (own) => {
      const colour = numbers(getComputedStyle(own).backgroundColor);
      return colour[3] === 0 ? behind(own.parentElement) : colour;
    };
    const found = [];
    for (const own of document.querySelectorAll("main *:not(svg *):not(math *):not(script)")) {
      const words = [...own.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
      if (!words || !own.checkVisibility() || own.disabled) continue;
      const [high, low] = [numbers(getComputedStyle(own).color), behind(own)]
        .map(luminance)
        .sort((a, b) => b - a);
      const ratio = (high + 0.05) / (low + 0.05);
      if (ratio < 4.5) found.push(`${own.className || own.localName}: ${ratio.toFixed(2)}`);
    }
    for (const own of document.querySelectorAll(".card svg text")) {
      const fill = getComputedStyle(own).fill;
      const [high, low] = [numbers(fill), behind(own.closest(".card"))]
        .map(luminance)
        .sort((a, b) => b - a);
      const ratio = (high + 0.05) / (low + 0.05);
      if (ratio < 4.5 && own.textContent.trim()) found.push(`svg ${fill}: ${ratio.toFixed(2)}`);
    }
    return [...new Set(found)];
  });
  assert.deepEqual(pale, [], "text has a contrast of 4.5");
  await page.emulateMedia({ media: "print" });
  assert.equal(await page.locator(".live:visible, button:visible").count(), 0);
  const figures = await page.locator("figure .card").count();
  assert.equal(await page.locator("figure .card:visible").count(), figures, "figures are printed");
  assert.deepEqual(said, []);
  await context.close();
}
check("by the keyboard alone, with a contrast of 4.5, light and dark, and on paper");

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
  const { page, said, context } = await open(file, {
    viewport: { width: 420, height: 800 },
    colorScheme,
  });
  await live(page);
  assert.ok(
    (await page.evaluate(() => document.documentElement.scrollWidth)) <= 420,
    "nothing is wider than the page",
  );
  const cut = await page.evaluate(
    () => [...document.querySelectorAll(".card")].filter((own) => own.scrollWidth > own.clientWidth).length,
  );
  assert.equal(cut, 0, "figures fit");
  const corner = await page.evaluate(() => [
    ...document.querySelector(".live canvas").getContext("2d").getImageData(2, 2, 1, 1).data,
  ]);
  assert.ok(colorScheme === "dark" ? corner[0] < 60 : corner[0] > 200, `${corner}`);
  assert.deepEqual(said, []);
  await page.screenshot({ path: join(folder, `narrow-${colorScheme}.png`) });
  await context.close();
}
check("420 pixels wide, light and dark");

// The steps of docs/reference/page.md, "A window of period adding", with their pictures.
{
  const { page, said, context } = await open(file, { viewport: { width: 700, height: 1000 } });
  const blank = await context.newPage();
  // WebP is an eighth of the browser's PNG.
  const picture = async (name, what) => {
    const png = (await what.screenshot()).toString("base64");
    const webp = await blank.evaluate(async (png) => {
      const image = new Image();
      image.src = `data:image/png;base64,${png}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      canvas.getContext("2d").drawImage(image, 0, 0);
      const blob = await canvas.convertToBlob({ type: "image/webp", quality: 0.6 });
      return [...new Uint8Array(await blob.arrayBuffer())];
    }, png);
    assert.ok(webp.length < 48_000, `${name}: ${webp.length} bytes`);
    writeFileSync(join(folder, `${name}.webp`), Buffer.from(webp));
  };
  await page.bringToFront();
  await live(page);
  const canvas = page.locator(".live canvas").first();
  const facts = page.locator(".live .facts").first();
  // A picture of it would scroll to it, under a pointer that drags.
  await canvas.scrollIntoViewIfNeeded();
  const place = await places(page, canvas);
  const at = async (offset) => {
    const { x } = await view(page);
    return place((offset - x[0]) / (x[1] - x[0]), 0.5)[0];
  };
  const [, middle] = place(0, 0.5);
  await before(page);
  await page.mouse.move(await at(1.08e-4), middle);
  await page.mouse.down();
  await page.mouse.move(await at(1.2e-4), middle + 2, { steps: 5 });
  await page.waitForTimeout(100);
  await picture("box", canvas);
  await page.mouse.up();
  await again(page);
  const read = async (offset) => {
    await page.mouse.click(await at(offset), middle);
    await page.waitForFunction(
      ([offset, near]) =>
        Math.abs(window.grazemap.panes[0].marker.answer?.parameters[0] - offset) < near,
      [offset, 5e-8],
      { timeout: 60_000 },
    );
    return page.evaluate(() => window.grazemap.panes[0].marker.answer);
  };
  // Borders as `grazemap branch` has them.
  const [flip, graze] = JSON.parse(
    run(
      `branch ${SCENE} --along Q --itinerary 1000000 --from 1.1e-4 --to 1.17e-4 -q --json -`.split(" "),
    ),
  )
    .branches[0].points.filter(({ label }) => label)
    .map(({ parameters }) => parameters.Q);
  const inside = [flip + 1e-6, 1.13e-4, graze - 2e-7];
  for (const offset of inside) assert.equal((await read(offset)).period, 7, `${offset}`);
  for (const offset of [flip - 2e-6, graze + 2e-7])
    assert.notEqual((await read(offset)).period, 7, `${offset}`);
  await read(1.13e-4);
  await page.waitForFunction(() => window.grazemap.panes[0].marker.reach);
  // Where the page says that the period ends, against the solved branch.
  const reach = await page.evaluate(() => window.grazemap.panes[0].marker.reach);
  assert.deepEqual(reach.map(({ way, outside }) => [way, outside]), [["flip", false], ["graze", false]]);
  for (const [n, border] of [flip, graze].entries())
    assert.ok(Math.abs(reach[n].offset - border) < 1e-13, `${reach[n].offset} is not ${border}`);
  assert.match(await facts.textContent(), /^Period7Holdsfrom Q = .*Contacts1000000 /);
  // The command of the point finds the orbit that the page shows.
  const command = await facts.locator(".command code").textContent();
  const asked = command.split(" ").slice(1);
  const listed = JSON.parse(run([...asked, "-q", "--json", "-"]));
  assert.deepEqual(listed.orbits.map(({ itinerary }) => itinerary), [asked.at(-1)], command);
  // The strip below the diagram shows it.
  const strip = await page.evaluate(() =>
    [...window.grazemap.panes[0].sweeps.layers.up.values()].map(({ offset, period }) => [offset, period]),
  );
  // Nearer to the flip orbits take longer to settle; the sweep leaves it shortly before the graze.
  const within = strip.filter(([offset]) => offset > flip + 2e-6 && offset < graze - 6e-7);
  assert.ok(within.length > 100 && within.every(([, period]) => period === 7), "the strip has 7");
  const beyond = strip.filter(([offset]) => offset > graze + 1e-8);
  assert.ok(beyond.length > 100 && beyond.every(([, period]) => period !== 7));
  await page.waitForTimeout(300);
  await picture("window", canvas);
  await picture("facts", facts.locator("dl"));
  assert.deepEqual(said, []);
  await context.close();
  check("the window of the guide has period 7 between the borders of its branch");
}

// One coordinate: a cobweb, its steps on the graph of the map.
{
  const scene = join(out, "one_coordinate.toml");
  writeFileSync(scene, ONE_COORDINATE);
  const one = join(out, "one_coordinate");
  run(["run", scene, "-q", "-o", one]);
  const { page, said, context } = await open(join(one, "report.html"));
  await live(page);
  const box = await page.locator(".live canvas").first().boundingBox();
  await page.mouse.click(box.x + 200, box.y + 200);
  await page.waitForFunction(() => window.grazemap.panes[0].panels.cobweb, null, { timeout: 60_000 });
  const { cobweb, parameters, basin } = await page.evaluate(() => {
    const { panels, marker } = window.grazemap.panes[0];
    const { cobweb, basin } = panels;
    return { cobweb, parameters: marker.answer.parameters, basin };
  });
  assert.equal(basin, null);
  for (const [n, [value, image]] of cobweb.steps.entries()) {
    if (n % 2 === 0) assert.equal(value, image, "on the diagonal");
    else assert.equal(image, await page.evaluate(
      async ([own, at]) => (await window.grazemap.iterate([own], at, 1))[0],
      [value, parameters],
    ));
  }
  assert.equal(cobweb.graph.length, 241);
  assert.deepEqual(said, []);
  await page.locator(".live").first().screenshot({ path: join(folder, "cobweb.png") });
  await context.close();
  check("one coordinate has a cobweb");
}

// Names that would be markup or code.
{
  const evil = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&`${alert(3)}";
  const quick = [
    "expansion.smooth_order=2",
    "expansion.contact_weight=3",
    "diagram.0.points=30",
    "diagram.0.transient=50",
    'diagram.0.with=["map"]',
  ];
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
  await page.waitForFunction(() => window.grazemap.panes[0].marker.answer);
  await page.mouse.click(canvas.x + canvas.width * 0.9, canvas.y + 100);
  await page.waitForFunction(() => window.grazemap.panes[0].marker.answer?.gone);
  const facts = page.locator(".live .panels:visible > :visible").first();
  assert.equal(await facts.textContent(), "The orbit leaves the map's reach here.");
  assert.deepEqual(said, [], "hostile names are words");
  await context.close();
  check("hostile names stay words");
}

// Markup that got in all the same: the policy of the page holds its script back.
{
  const path = join(out, "injected.html");
  const markup = "<script>window.injected = 1</script><img src=x onerror='window.injected = 2'>";
  const html = readFileSync(file, "utf8");
  assert.ok(html.endsWith("</body>\n</html>\n"));
  writeFileSync(path, html.replace(/<\/body>\n<\/html>\n$/, `${markup}</body>\n</html>\n`));
  const { page, context } = await open(path);
  await live(page);
  assert.equal(await page.evaluate(() => window.injected), undefined);
  await context.close();
  check("a script that is not the page's own does not run");
}

await browser.close();
console.log(`${checks.length} checks of the page in a browser`);
