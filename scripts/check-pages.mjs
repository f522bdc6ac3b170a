// Opens pages that `--html` wrote in headless Chromium, uses them as a reader does, and checks them for errors of
// scripts, for requests (they need no network) and for accessibility (axe-core).
//
//     npm install playwright-core axe-core
//     node scripts/check-pages.mjs PAGE.html... [--shots DIR]
//
// CHROMIUM names the browser, by default /usr/bin/chromium.
import { readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";

// The packages are those of the current directory.
const require = createRequire(path.join(process.cwd(), "package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const SETTLE_MS = 250;
const words = process.argv.slice(2);
const at = words.indexOf("--shots");
const shots = at < 0 ? null : words.splice(at, 2)[1];
let failed = 0;
const check = (isRight, what) => {
  if (!isRight) {
    failed += 1;
    console.error(`  wrong: ${what}`);
  }
};

async function use(page, shot) {
  const view = page.locator("#view");
  const box = () => view.getAttribute("viewBox");
  const whole = await box();
  await view.hover();
  await page.mouse.wheel(0, -800);
  await page.waitForTimeout(SETTLE_MS);
  check((await box()) !== whole, "the wheel does not zoom");
  await page.locator("[data-layer=residuals]").check();
  await page.locator("[data-layer=unidentified]").check();
  if (shot) await page.screenshot({ path: shot });
  await view.focus();
  await page.keyboard.press("0");
  await page.waitForTimeout(SETTLE_MS);
  check((await box()) === whole, "the key 0 does not show the whole frame");
  await page.locator("[data-layer=identified]").uncheck();
  const hidden = await page.locator("#view g[style*='none'] circle").count();
  check(hidden === (await page.locator("#view circle").count()), "a layer stays");
  await page.locator("[data-layer=identified]").check();

  const rows = page.locator("#rows tr");
  if ((await rows.count()) === 0) return;
  await page.locator("#head button").nth(3).click();
  check((await page.locator("#head th").nth(3).getAttribute("aria-sort")) === "ascending", "no order");
  await rows.first().click();
  check((await page.locator("#under").textContent()).includes("SNR"), "a row tells nothing");
  check((await box()) !== whole, "a row does not show its star");
  await page.fill("#filter", "nothing has this name");
  check((await rows.count()) === 0, "the filter leaves rows");
  await page.fill("#filter", "");
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync"],
});
for (const file of words) {
  const name = path.basename(file, ".html");
  for (const colorScheme of ["light", "dark"]) {
    const page = await browser.newPage({ viewport: { width: 1200, height: 1000 }, colorScheme });
    page.on("console", (message) => check(!["error", "warning"].includes(message.type()), message.text()));
    page.on("pageerror", (error) => check(false, String(error)));
    page.on("request", (request) => check(/^(file|data):/.test(request.url()), `asks for ${request.url()}`));
    await page.goto(pathToFileURL(path.resolve(file)).href);
    await page.waitForTimeout(SETTLE_MS);
    if (shots) await page.screenshot({ path: path.join(shots, `${name}-${colorScheme}.png`), fullPage: true });
    await use(page, shots && colorScheme === "dark" ? path.join(shots, `${name}-zoomed.png`) : null);
    await page.evaluate(axe);
    const { violations } = await page.evaluate(() => globalThis.axe.run());
    check(violations.length === 0, violations.map((v) => `${v.id}: ${v.nodes[0].html}`).join("; "));
    await page.close();
  }
  const html = readFileSync(file, "utf8");
  const picture = html.match(/data:image\/jpeg;base64,[^"]*/)?.[0].length ?? 0;
  const kilobytes = (statSync(file).size - picture) / 1000;
  check(kilobytes <= 600, `${kilobytes} kB beside its picture`);
  console.log(`${name}: ${kilobytes.toFixed(0)} kB beside its picture of ${(picture / 1000).toFixed(0)} kB`);
}
await browser.close();
process.exitCode = failed ? 1 : 0;
