// Uses the page in web/dist as a visitor does, in headless Chromium, and compares its numbers with the program's.
//
// scripts/check-web runs it. Without frames: two fixtures, and frames of
// ../shared/frames where they are.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";

const require = createRequire(path.join(process.env.NODE_MODULES ?? process.cwd(), "package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const SOLVE_MS = 300_000, SETTLE_MS = 300;
// Functions of the system's library differ from those of the page in the last bit; see docs/web.md. Of values
// above 1 this is a part, of others the difference itself.
const LARGEST_DIFFERENCE = 1e-5;
const words = process.argv.slice(2);
const option = (name) => { const at = words.indexOf(name); return at < 0 ? null : words.splice(at, 2)[1]; };
const root = path.resolve(import.meta.dirname, "..");
const dist = path.resolve(option("--dist") ?? path.join(root, "web/dist"));
const shots = option("--shots");
if (shots) mkdirSync(shots, { recursive: true });
const [program, ...given] = words;
const shared = path.join(root, "../shared/frames");
const usual = ["fixtures/orion/orion.png", "fixtures/cygnus/cygnus.tif"].map((name) => path.join(root, name));
for (const name of ["2019-07-29T204726_Alt40_Azi-135_Try1.tiff", "2019-07-29T204726_Alt60_Azi135_Try1.tiff", "pleiades.jpg", "hard/orion-phone.jpg"]) {
  if (existsSync(path.join(shared, name))) usual.push(path.join(shared, name));
}
const frames = given.length ? given.map((name) => path.resolve(name)) : usual;

let failed = 0;
const check = (isRight, what) => {
  if (isRight) return;
  failed += 1;
  console.error(`  wrong: ${what}`);
};

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".svg": "image/svg+xml" };
const server = createServer((request, response) => {
  const name = decodeURIComponent(new URL(request.url, "http://localhost").pathname).replace(/\/$/, "/index.html");
  const file = path.join(dist, name);
  if (!file.startsWith(dist) || !existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, { "content-type": TYPES[path.extname(file)] ?? "application/octet-stream", "cache-control": "no-store" }).end(readFileSync(file));
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const address = `http://localhost:${server.address().port}/`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync", "--enable-precise-memory-info"],
});

const open = async (viewport, colorScheme, hash = "") => {
  const context = await browser.newContext({ viewport, colorScheme, acceptDownloads: true });
  const page = await context.newPage();
  page.on("console", (message) => check(!["error", "warning"].includes(message.type()), message.text()));
  page.on("pageerror", (error) => check(false, String(error)));
  context.on("request", (request) => check(request.url().startsWith(address) || /^(data|blob):/.test(request.url()), `asks for ${request.url()}`));
  await page.addInitScript(() => {
    globalThis.shift = 0;
    new PerformanceObserver((list) => { for (const entry of list.getEntries()) if (!entry.hadRecentInput) globalThis.shift += entry.value; }).observe({ type: "layout-shift", buffered: true });
  });
  await page.goto(address + hash);
  return page;
};
const accessible = async (page, where) => {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  check(violations.length === 0, `${where}: ${violations.map((v) => `${v.id}: ${v.nodes[0].html}`).join("; ")}`);
};
const shot = async (page, name) => { if (shots) await page.screenshot({ path: path.join(shots, `${name}.png`), fullPage: true }); };
const state = (page) => page.locator("#state").textContent();
const settled = (page) => page.waitForFunction(() => !document.querySelector("#work[aria-busy]") && !document.querySelector(".queue button[aria-label$='waits']"), null, { timeout: SOLVE_MS });
const ready = async (page) => {
  await page.waitForFunction(() => !document.querySelector("#state").textContent.includes("prepared"), null, { timeout: SOLVE_MS });
  check((await state(page)).startsWith("Ready"), await state(page));
};
const download = async (page, name) => {
  const [file] = await Promise.all([page.waitForEvent("download", { timeout: SOLVE_MS }), page.getByRole("button", { name }).click()]);
  return readFileSync(await file.path());
};

// Where two values of JSON differ, and by which part of themselves.
const differences = (one, other, at = "") => {
  if (at === ".timing_ms") return [];
  if (one !== null && other !== null && typeof one === "object" && typeof other === "object") {
    const keys = new Set([...Object.keys(one), ...Object.keys(other)]);
    return [...keys].flatMap((key) => differences(one[key], other[key], `${at}.${key}`));
  }
  return one === other ? [] : [{ at, one, other }];
};
const programJson = (args, cwd) => {
  try {
    return execFileSync(program, args, { cwd, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"], maxBuffer: 1 << 28 });
  } catch (error) {
    // 3: a frame is not identified, or no radius meets an error.
    if (error.status === 3) return error.stdout;
    throw error;
  }
};
const compare = (what, ours, theirs) => {
  const found = differences(ours, theirs);
  const numbers = found.filter(({ one, other }) => typeof one === "number" && typeof other === "number");
  const most = numbers.reduce((most, { one, other }) => Math.max(most, Math.abs(one - other) / Math.max(Math.abs(one), Math.abs(other), 1)), 0);
  if (!found.length) return "the same in every digit";
  const told = `${found.length} values differ, ${numbers.length} of them numbers, by up to ${most.toExponential(1)}; first ${JSON.stringify(found[0])}`;
  check(numbers.length === found.length && most < LARGEST_DIFFERENCE, `${what}: ${told}`);
  return told;
};

async function usePhotographs() {
  const page = await open({ width: 1280, height: 900 }, "light");
  await ready(page);
  const readyMs = await page.evaluate(() => performance.now());
  console.log(`ready after ${(readyMs / 1000).toFixed(1)} s`);
  await accessible(page, "empty");
  await shot(page, "empty-desktop");
  for (const frame of frames) {
    const name = path.basename(frame);
    await page.locator("#files").setInputFiles(frame);
    await settled(page);
    const ours = JSON.parse((await download(page, "Report (JSON)")).toString());
    // A single thread, as the page has.
    const theirs = JSON.parse(programJson(["process", "--threads", "1", "--format", "json", name], path.dirname(frame)));
    console.log(`${name}: ${compare(name, ours, theirs)}`);
    console.log(`  ${ours.status}, ${ours.timing_ms.total.toFixed(0)} ms here, ${theirs.timing_ms.total.toFixed(0)} ms natively on one thread`);
    await page.locator("#queue button").last().click();
    await page.waitForTimeout(SETTLE_MS);
    await shot(page, `frame-${name}`);
  }
  await accessible(page, "solved");
  const layoutShift = await page.evaluate(() => globalThis.shift);
  check(layoutShift < 0.1, `the layout shifts by ${layoutShift.toFixed(3)}`);
  await useFrame(page);
  await page.context().close();
}

async function useFrame(page) {
  await page.locator("#queue button").first().click();
  const view = page.locator("#view");
  const box = () => view.getAttribute("viewBox");
  const whole = await box();
  await view.hover();
  await page.mouse.wheel(0, -800);
  await page.waitForTimeout(SETTLE_MS);
  check((await box()) !== whole, "the wheel does not zoom");
  await view.focus();
  await page.keyboard.press("0");
  await page.waitForTimeout(SETTLE_MS);
  check((await box()) === whole, "the key 0 does not show the whole frame");
  for (const layer of ["constellations", "equatorial"]) {
    const input = page.locator(`[data-layer=${layer}]`);
    const lines = page.locator(`#view .${layer} path`).first();
    check(!(await lines.isVisible()), `${layer} is shown before it is wanted`);
    await input.check();
    check(await lines.isVisible(), `${layer} is not shown`);
  }
  await page.locator("section.table tbody tr").first().click();
  check((await page.locator("#under").textContent()).includes("SNR"), "a row tells nothing");
  await shot(page, "layers");
  for (const [name, begins] of [["Annotated picture", "\x89PNG"], ["Page (HTML)", "<!doctype"], ["Stars (CSV)", "frame,"], ["Coordinates", "SIMPLE"]]) {
    const bytes = await download(page, name);
    check(bytes.subarray(0, begins.length).toString("latin1") === begins, `${name} begins with ${bytes.subarray(0, 12).toString("latin1")}`);
  }
}

async function useOddly() {
  const page = await open({ width: 360, height: 740 }, "dark");
  const bad = path.join(os.tmpdir(), `starpipe-broken-${process.pid}.fits`);
  writeFileSync(bad, "SIMPLE  =                    T");
  await page.locator("#files").setInputFiles(bad);
  await settled(page);
  check(/truncated|header|END/i.test(await state(page)), `a broken file: ${await state(page)}`);
  await page.locator("#files").setInputFiles(path.join(root, "Cargo.toml"));
  await settled(page);
  check((await state(page)).includes("Cargo.toml"), `no picture: ${await state(page)}`);

  // Cancel, then solve: by the keyboard alone.
  await page.locator("#files").setInputFiles(frames[0]);
  await page.locator("#cancel").focus();
  await page.keyboard.press("Enter");
  await settled(page);
  check((await state(page)).includes("canceled"), `canceled: ${await state(page)}`);
  await page.locator("#hints summary").focus();
  await page.keyboard.press("Enter");
  await page.locator("#again").focus();
  await page.keyboard.press("Enter");
  await settled(page);
  check((await page.locator(".say").textContent()).includes("identified"), "no answer after a cancel");
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "the page is wider than 360 px");
  await shot(page, "phone-dark");
  await accessible(page, "phone, dark");
  await page.setViewportSize({ width: 320, height: 640 });
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "the page is wider than 320 px");

  // Without stars: the reason and buttons.
  const dark = path.join(os.tmpdir(), `starpipe-dark-${process.pid}.pgm`);
  const noise = Buffer.from(Array.from({ length: 300 * 200 }, (_, i) => 20 + ((i * 7919) % 13)));
  writeFileSync(dark, Buffer.concat([Buffer.from("P5 300 200 255\n"), noise]));
  await page.locator("#files").setInputFiles(dark);
  await settled(page);
  await page.locator("#queue button").last().click();
  check((await page.locator(".say").textContent()).includes("not identified"), "a frame without stars is not said to be one");
  const hint = page.locator("[aria-label='What may help'] button").first();
  await hint.click();
  check(await page.evaluate(() => document.activeElement?.matches("#hints input") ?? false), "a hint does not lead to its field");

  // Tabs by arrow keys.
  await page.locator("#tab-photo").focus();
  await page.keyboard.press("ArrowRight");
  await page.locator("#limit").waitFor({ state: "visible", timeout: 5000 });
  await page.context().close();
}

async function useModels() {
  const page = await open({ width: 1280, height: 900 }, "light", "#limit?preset=imx174-35mm&exposure_s=0.5&sky_mag_arcsec2=20");
  await page.waitForFunction(() => document.querySelector("#limit-json").textContent, null, { timeout: SOLVE_MS });
  const ours = JSON.parse(await page.locator("#limit-json").textContent());
  const options = ["--preset", "imx174-35mm", "--exposure", "0.5", "--sky-mag-arcsec2", "20"];
  const limits = compare("limit", ours, JSON.parse(programJson(["limit", "--format", "json", ...options])));
  console.log(`limit: ${limits}`);
  await page.waitForSelector("#limit-figures svg >> nth=1", { timeout: SOLVE_MS });
  await shot(page, "limit-desktop");
  await accessible(page, "limit");
  const before = await page.locator("#limit-answer").textContent();
  await page.locator("#limit-aperture_mm-range").focus();
  await page.keyboard.press("PageUp");
  await page.waitForFunction((before) => document.querySelector("#limit-answer").textContent !== before, before, { timeout: SOLVE_MS });
  check(page.url().includes("aperture_mm="), "the link does not carry the aperture");

  await page.locator("#tab-defocus").click();
  await page.waitForSelector("#defocus-preset option", { state: "attached", timeout: SOLVE_MS });
  await page.locator("#defocus-vmag").fill("5");
  await page.locator("#defocus-count").fill("20");
  const start = Date.now();
  await page.locator("#defocus-run").click();
  await page.waitForFunction(() => document.querySelector("#defocus-json").textContent, null, { timeout: SOLVE_MS });
  console.log(`defocus: ${((Date.now() - start) / 1000).toFixed(1)} s for 20 stars at each point`);
  const study = JSON.parse(await page.locator("#defocus-json").textContent());
  const asked = ["defocus", "--format", "json", "--preset", "nanosat-tracker", "--vmag", "5", "--count", "20", "--required-error", "0.05"];
  console.log(`defocus: ${compare("defocus", study, JSON.parse(programJson(asked)))}`);
  await shot(page, "defocus-desktop");
  await accessible(page, "defocus");
  await page.context().close();
}

async function useOffline() {
  const page = await open({ width: 800, height: 700 }, "light");
  await page.waitForFunction(() => document.querySelector("#offline").textContent.startsWith("Ready"), null, { timeout: SOLVE_MS });
  await page.context().setOffline(true);
  await page.reload();
  await ready(page);
  await page.locator("#files").setInputFiles(frames[0]);
  await settled(page);
  check((await page.locator(".say").textContent()).includes("identified"), "no answer without a network");
  await page.context().close();
}

try {
  for (const use of [usePhotographs, useOddly, useModels, useOffline]) await use();
} catch (error) {
  check(false, error.stack);
}
await browser.close();
server.close();
console.log(failed ? `${failed} wrong` : "the page does what it should");
process.exitCode = failed ? 1 : 0;
