// Opens pages that `--html` wrote in headless Chromium, uses them as a reader does, and checks them for errors of
// scripts, for requests (they need no network) and for accessibility (axe-core).
//
//     npm install playwright-core axe-core
//     node scripts/check-pages.mjs PAGE.html... [--shots DIR]
import { readFileSync, statSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";
import { SETTLE_MS, accessible, check, conclude, launch, option, showLayer, unfold, watch, words, zoom } from "./in-chromium.mjs";

// Of a page without its pictures.
const MOST_KB = 1500;
const shots = option("--shots");

// The tables of any page sort and filter.
async function useTables(page) {
  for (const table of await page.locator("section.table").all()) {
    const title = await table.getAttribute("aria-label");
    const rows = table.locator("tbody tr");
    const before = await rows.count();
    if (before === 0) continue;
    const heads = table.locator("thead th");
    for (const at of [0, (await heads.count()) - 1]) {
      for (const order of ["ascending", "descending"]) {
        await heads.nth(at).locator("button").press("Enter");
        check((await heads.nth(at).getAttribute("aria-sort")) === order, `${title}: no ${order} order`);
      }
      const cells = await rows.evaluateAll((all, at) => all.map((row) => row.cells[at].textContent), at);
      const isText = (await heads.nth(at).getAttribute("class")) === "text";
      const known = cells.filter((cell) => cell !== "");
      const falls = (one, next) => (isText ? one >= next : Number(one) >= Number(next));
      check(known.every((cell, i) => i === 0 || falls(known[i - 1], cell)), `${title}: column ${at} does not fall`);
    }
    const filter = table.locator("input[type=search]");
    await filter.fill("nothing has this name");
    check((await rows.count()) === 0, `${title}: the filter leaves rows`);
    const number = await heads.evaluateAll((all) => all.findIndex((head) => head.className !== "text"));
    if (number >= 0) {
      await filter.fill(`${await heads.nth(number).textContent()} > 1e300`);
      check((await rows.count()) === 0, `${title}: a comparison leaves rows`);
    }
    await filter.fill("");
    check((await rows.count()) === before, `${title}: the filter keeps rows`);
  }
}

/** A click on a star opens its card there. */
async function useCard(page) {
  const card = page.locator("#card");
  const rings = page.locator("#view circle.identified:visible");
  const count = await rings.count();
  check(count <= 40, `${count} rings at first`);
  if (count === 0) return;
  await rings.first().click();
  check(await card.isVisible() && (await card.locator("b").textContent()) !== "", "a click on a star opens no card");
  await page.locator("#view").focus();
  await page.keyboard.press("n");
  check(await card.isVisible(), "the key N tells of no star");
  await page.keyboard.press("Escape");
  check(!(await card.isVisible()), "Escape does not close the card");
  const wipe = page.locator("#wipe");
  if (!(await wipe.count())) return;
  await wipe.fill("60");
  check(await page.locator("#view .chart circle").first().isVisible(), "the slider shows no drawing");
  await wipe.fill("0");
  check(!(await page.locator("#view .chart circle").first().isVisible()), "the slider leaves the drawing");
}

async function useFrame(page, shot) {
  await useCard(page);
  await unfold(page);
  const box = () => page.locator("#view").getAttribute("viewBox");
  const whole = await box();
  await zoom(page, async () => {
    await page.locator("[data-layer=residuals]").check();
    await page.locator("[data-layer=unidentified]").check();
    if (shot) await page.screenshot({ path: shot });
  });
  const sky = page.locator("[data-layer=constellations]");
  if (await sky.count()) {
    await showLayer(page, "constellations");
    await sky.uncheck();
  }
  await page.locator("[data-layer=identified]").uncheck();
  const hidden = await page.locator("#view g[style*='none'] circle.shape").count();
  check(hidden === (await page.locator("#view circle.shape").count()), "a layer stays");
  await page.locator("[data-layer=identified]").check();

  const rows = page.locator("section.table tbody tr");
  if ((await rows.count()) === 0) return;
  await rows.first().click();
  check((await page.locator("#under").textContent()).includes("SNR"), "a row tells nothing");
  // The view follows in the next picture of the browser, which may be late.
  for (let waited = 0; waited < SETTLE_MS && (await box()) === whole; waited += 50) await page.waitForTimeout(50);
  check((await box()) !== whole, "a row does not show its star");
}

/** On paper: dark on white, without what one presses. */
async function printed(page, name) {
  await page.emulateMedia({ media: "print" });
  const back = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  check(back === "rgb(255, 255, 255)", `${name} is printed on ${back}`);
  check((await page.locator("[data-zoom]:visible, #wipe:visible, input:visible").count()) === 0, `${name}: buttons are printed`);
  const pdf = await page.pdf({ format: "A4", ...(shots ? { path: path.join(shots, `${name}.pdf`) } : {}) });
  check(pdf.length > 1000, `${name} is not printed`);
}

/** A click in a drawing tells the value that is there. */
async function tellValues(page) {
  const isTouched = await page.evaluate(() => {
    const title = document.querySelector(".drawing svg * > title");
    title?.parentNode.dispatchEvent(new MouseEvent("click", { bubbles: true }));
    return Boolean(title);
  });
  if (!isTouched) return;
  check((await page.locator(".told").first().textContent()) !== "", "a touched value is not told");
}

const browser = await launch();
for (const file of words) {
  const name = path.basename(file, ".html");
  for (const colorScheme of ["light", "dark"]) {
    const page = await browser.newPage({ viewport: { width: 1200, height: 1000 }, colorScheme });
    watch(page, (url) => /^(file|data):/.test(url));
    await page.goto(pathToFileURL(path.resolve(file)).href);
    await page.waitForTimeout(SETTLE_MS);
    if (shots) await page.screenshot({ path: path.join(shots, `${name}-${colorScheme}.png`), fullPage: true });
    check((await page.locator("h1").count()) === 1, "one title");
    check(await page.locator("header .answer").isVisible(), "no answer");
    // The picture is on the first screen.
    const view = await page.locator("#view").boundingBox().catch(() => null);
    check(!view || view.y < 300, `the picture begins at ${view?.y}`);
    if (await page.locator("#view").count()) await useFrame(page, shots && colorScheme === "dark" ? path.join(shots, `${name}-zoomed.png`) : null);
    await useTables(page);
    await unfold(page);
    await tellValues(page);
    await accessible(page, name);
    if (colorScheme === "dark") await printed(page, name);
    await page.close();
  }
  const html = readFileSync(file, "utf8");
  const pictures = (html.match(/data:image\/jpeg;base64,[^"]*/g) ?? []).join("").length;
  const kilobytes = (statSync(file).size - pictures) / 1000;
  check(kilobytes <= MOST_KB, `${kilobytes} kB beside pictures`);
  console.log(`${name}: ${kilobytes.toFixed(0)} kB beside pictures of ${(pictures / 1000).toFixed(0)} kB`);
}
await browser.close();
conclude("the pages do what they should");
