// What the checks of pages in headless Chromium share: scripts/check-web.mjs and scripts/check-pages.mjs.
//
// CHROMIUM names the browser, by default /usr/bin/chromium. The packages playwright-core and axe-core are those
// of the directory NODE_MODULES, by default the current one.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const require = createRequire(path.join(process.env.NODE_MODULES ?? process.cwd(), "package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

/** How long animations take. */
export const SETTLE_MS = 300;

/** What the command line has beside options. */
export const words = process.argv.slice(2);
/** The value of an option, which is taken off the words. */
export const option = (name) => {
  const at = words.indexOf(name);
  return at < 0 ? null : words.splice(at, 2)[1];
};

let failed = 0;
export const check = (isRight, what) => {
  if (isRight) return;
  failed += 1;
  console.error(`  wrong: ${what}`);
};
/** Says how it went, and sets the exit status. */
export const conclude = (whenRight) => {
  console.log(failed ? `${failed} wrong` : whenRight);
  process.exitCode = failed ? 1 : 0;
};

export const launch = (...flags) => chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync", ...flags],
});

/** Errors and warnings of the page's scripts are wrong, and so are requests for what it may not ask for. */
export const watch = (page, mayAsk) => {
  page.on("console", (message) => check(!["error", "warning"].includes(message.type()), message.text()));
  page.on("pageerror", (error) => check(false, String(error)));
  page.context().on("request", (request) => check(mayAsk(request.url()), `asks for ${request.url()}`));
};

/** axe-core finds nothing. */
export const accessible = async (page, where) => {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  check(violations.length === 0, `${where}: ${violations.map((v) => `${v.id}: ${v.nodes[0].html}`).join("; ")}`);
};

/** The wheel zooms into the picture of a frame; after `whileZoomed`, the key 0 shows it whole. */
export const zoom = async (page, whileZoomed = async () => {}) => {
  const view = page.locator("#view");
  const box = () => view.getAttribute("viewBox");
  const whole = await box();
  await view.hover();
  await page.mouse.wheel(0, -800);
  await page.waitForTimeout(SETTLE_MS);
  check((await box()) !== whole, "the wheel does not zoom");
  await whileZoomed();
  await view.focus();
  await page.keyboard.press("0");
  await page.waitForTimeout(SETTLE_MS);
  check((await box()) === whole, "the key 0 does not show the whole frame");
};

/** Opens all that is folded. */
export const unfold = (page) => page.evaluate(() => { for (const fold of document.querySelectorAll("details")) fold.open = true; });

/** Constellations are drawn at first, other layers of the sky when they are wanted. */
export const showLayer = async (page, layer) => {
  const lines = page.locator(`#view .${layer} path`).first(), box = page.locator(`[data-layer=${layer}]`);
  const isFirst = layer === "constellations";
  check((await lines.isVisible()) === isFirst, `${layer} is ${isFirst ? "not shown" : "shown"} at first`);
  await box.uncheck();
  check(!(await lines.isVisible()), `${layer} is not hidden`);
  await box.check();
  check(await lines.isVisible(), `${layer} is not shown`);
};
