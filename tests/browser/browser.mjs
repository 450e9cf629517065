// What the tests of the page and its figures share: Chromium, driven by playwright-core, and a
// page opened from a file without a network.
//
// node NAME.mjs PROGRAM CHROMIUM FOLDER, playwright-core beside FOLDER's package.json; FOLDER takes
// runs and pictures.
import { execFileSync } from "node:child_process";
import { mkdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

export const [program, executablePath, folder] = process.argv.slice(2);
const { chromium } = createRequire(join(folder, "package.json"))("playwright-core");
export const SCENE = "cantilever_3_5_soft";
export const LARGEST_PAGE = 1.4e6;

export const run = (arguments_) =>
  execFileSync(program, arguments_, { maxBuffer: 1 << 30, encoding: "utf8" });
export const out = join(folder, "out");
mkdirSync(out, { recursive: true });

export const browser = await chromium.launch({
  executablePath,
  args: ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"],
});

/** Opens a page without a network; what it says and asks for is collected. */
export async function open(path, options = {}) {
  const context = await browser.newContext({
    offline: true,
    acceptDownloads: true,
    viewport: { width: 1100, height: 900 },
    ...options,
  });
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

export const settled = (page, pane = 0) =>
  page.waitForFunction((n) => window.grazemap?.panes[n]?.done, pane, { timeout: 60_000 });

/** Goes to the first live diagram, and waits for all of its iterates. */
export const live = async (page) => {
  await page.locator(".live").first().scrollIntoViewIfNeeded();
  await settled(page);
  await page.waitForTimeout(100);
};

/** The module of JavaScript text that the program emits for the scene. */
export async function emittedText() {
  const shape = "emit.shape=factored";
  const asked = ["emit", SCENE, "--target", "javascript", "--set", shape, "--no-measure", "-q"];
  run([...asked, "-o", out]);
  return join(out, `map_${SCENE}.js`);
}

/** Places of the plot of a pane, by shares of its width and height from its upper left. */
export async function places(page, canvas, pane = 0) {
  const box = await canvas.boundingBox();
  const plot = await page.evaluate((n) => window.grazemap.panes[n].plot, pane);
  return (x, y) => [box.x + plot.x + x * plot.w, box.y + plot.y + y * plot.h];
}
