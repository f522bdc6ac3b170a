// Uses the page in web/dist as a visitor does, in headless Chromium, and compares its numbers with the program's.
//
// scripts/check-web runs it. Without frames: two fixtures, and frames of
// ../shared/frames where they are.
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import os from "node:os";
import path from "node:path";
import { brotliCompressSync, gzipSync } from "node:zlib";
import { SETTLE_MS, accessible, check, conclude, launch, option, showLayer, unfold, watch, words, zoom } from "./in-chromium.mjs";

const SOLVE_MS = 300_000;
// What a visitor waits for before the page can be used, compressed with gzip.
const FIRST_LOAD_MB = 5;
// Settings of the camera that are compared with the program's.
const RANDOM_SETTINGS = 200;
// The slowest simulated frame of the camera's model: a slow machine may take a multiple of what it should.
const SLOWEST_MS = 5000;
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

const scratch = mkdtempSync(path.join(os.tmpdir(), "starpipe-web-"));
/** Bytes per second that are sent; all at once without a limit. */
let sentPerSecond = Infinity;
/** The files that were sent, and their bodies. @type {Map<string, Buffer>} */
const sent = new Map();
/** What is sent of a file: with gzip, as most servers do, but for what is of unknown type. */
const packed = (name) => {
  if (!sent.has(name)) {
    const plain = readFileSync(path.join(dist, name));
    sent.set(name, path.extname(name) in TYPES ? gzipSync(plain) : plain);
  }
  return { body: sent.get(name), encoding: path.extname(name) in TYPES ? { "content-encoding": "gzip" } : {} };
};

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".svg": "image/svg+xml", ".webmanifest": "application/manifest+json" };
const server = createServer((request, response) => {
  const name = decodeURIComponent(new URL(request.url, "http://localhost").pathname).replace(/\/$/, "/index.html");
  const file = path.join(dist, name);
  if (!file.startsWith(dist) || !existsSync(file)) return response.writeHead(404).end();
  // Whether this server solves pictures, which it does not.
  if (request.method === "HEAD") return response.writeHead(200).end();
  const { body, encoding } = packed(path.relative(dist, file));
  response.writeHead(200, { "content-type": TYPES[path.extname(file)] ?? "application/octet-stream", "cache-control": "max-age=600", "content-length": body.length, ...encoding });
  send(response, body);
});
/** When the line is free. */
let freeAt = 0;
/** Sends on one line, which all requests share. */
const send = async (response, body) => {
  const STEP = 8192;
  if (sentPerSecond === Infinity) return response.end(body);
  for (let at = 0; at < body.length && !response.destroyed; at += STEP) {
    const part = body.subarray(at, at + STEP);
    freeAt = Math.max(freeAt, Date.now()) + (1000 * part.length) / sentPerSecond;
    await new Promise((done) => setTimeout(done, freeAt - Date.now()));
    response.write(part);
  }
  response.end();
};
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const trusted = `http://localhost:${server.address().port}/`;
// A place that browsers do not trust: without a service worker and without storage for files.
const UNTRUSTED = "starpipe.test";

const browser = await launch(`--host-resolver-rules=MAP ${UNTRUSTED} 127.0.0.1`);

const open = async (viewport, colorScheme, hash = "", address = trusted, prepare = async () => {}, device = {}) => {
  const context = await browser.newContext({ viewport, colorScheme, acceptDownloads: true, ...device });
  const page = await context.newPage();
  await prepare(page);
  watch(page, (url) => url.startsWith(address) || /^(data|blob):/.test(url));
  await page.addInitScript(() => {
    Object.assign(globalThis, { shift: 0, longTasks: [] });
    // The largest sum of 5 s without a pause of 1 s, as the measure of layout shift is defined.
    let [sum, first, last] = [0, 0, -Infinity];
    const add = ({ startTime, value, hadRecentInput }) => {
      if (hadRecentInput) return;
      if (startTime - last > 1000 || startTime - first > 5000) [sum, first] = [0, startTime];
      last = startTime;
      sum += value;
      globalThis.shift = Math.max(globalThis.shift, sum);
    };
    new PerformanceObserver((list) => list.getEntries().forEach(add)).observe({ type: "layout-shift", buffered: true });
    new PerformanceObserver((list) => { for (const entry of list.getEntries()) globalThis.longTasks.push(entry.duration); }).observe({ type: "longtask", buffered: true });
  });
  await page.goto(address + hash);
  return page;
};
/** The whole page at the width of a phone, too. */
const shotOfPhone = async (page, name) => {
  const size = page.viewportSize();
  await page.setViewportSize({ width: 360, height: 740 });
  await page.emulateMedia({ colorScheme: "dark" });
  await page.waitForTimeout(SETTLE_MS);
  await shot(page, name);
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${name} is wider than 360 px`);
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize(size);
};
const shot = async (page, name) => { if (shots) await page.screenshot({ path: path.join(shots, `${name}.png`), fullPage: true }); };
const state = (page) => page.locator("#state").textContent();
const settled = (page) => page.waitForFunction(() => !document.querySelector("#work[aria-busy]") && !document.querySelector(".queue button[aria-label$='waits']"), null, { timeout: SOLVE_MS });
const ready = async (page) => {
  await page.waitForFunction(() => !document.querySelector("#state").textContent.includes("Loading"), null, { timeout: SOLVE_MS });
  check((await state(page)).startsWith("Ready"), await state(page));
};
/** Gives files as a visitor does: what moves at once is no shift of the layout. */
const give = async (page, files) => {
  await page.mouse.click(2, 2);
  await page.locator("#files").setInputFiles(files);
};
/** Whether the picture that is shown is identified. */
const isIdentified = async (page) => (await page.locator("#answer .say").count()) === 1 && (await page.locator("#queue button[aria-pressed=true][aria-label$=', identified']").count()) === 1;
const download = async (page, name) => {
  await unfold(page);
  const [file] = await Promise.all([page.waitForEvent("download", { timeout: SOLVE_MS }), page.getByRole("button", { name }).first().click()]);
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
  if (!found.length) return "the same in every digit";
  const told = `${found.length} values differ, first ${JSON.stringify(found[0])}`;
  check(false, `${what}: ${told}`);
  return told;
};

const MB = (bytes) => (bytes / 1e6).toFixed(2);
const seconds = (ms) => `${(ms / 1000).toFixed(2)} s`;

/** What a first visit and a later one load, and how soon they can be used. */
async function useTwice() {
  const page = await open({ width: 360, height: 740 }, "light");
  await page.waitForFunction(() => document.querySelector("#version").textContent, null, { timeout: SOLVE_MS });
  const usableMs = await page.evaluate(() => performance.now());
  await shot(page, "start-phone");
  await ready(page);
  const figures = await page.evaluate(() => ({
    readyMs: performance.now(), shift: globalThis.shift, longTasks: globalThis.longTasks,
    paintMs: performance.getEntriesByName("first-contentful-paint")[0]?.startTime,
  }));
  const isCatalog = (name) => name.endsWith(".bin");
  const [first, later] = [[...sent.keys()].filter((name) => !isCatalog(name)), [...sent.keys()].filter(isCatalog)];
  const sum = (names, size) => names.reduce((sum, name) => sum + size(name), 0);
  const bytes = (name) => sent.get(name)?.length ?? 0, plain = (name) => readFileSync(path.join(dist, name));
  console.log(`first load: ${MB(sum(first, bytes))} MB with gzip, ${MB(sum(first, (name) => brotliCompressSync(plain(name)).length))} MB with brotli, ${MB(sum(first, (name) => plain(name).length))} MB unpacked; then the catalog: ${MB(sum(later, bytes))} MB`);
  console.log(`first paint ${seconds(figures.paintMs)}, computes after ${seconds(usableMs)}, catalog and index after ${seconds(figures.readyMs)}; layout shift ${figures.shift.toFixed(3)}, long tasks of ${figures.longTasks.map((ms) => ms.toFixed(0)).join(", ") || "no"} ms`);
  check(sum(first, bytes) < FIRST_LOAD_MB * 1e6, `the first load is ${MB(sum(first, bytes))} MB`);
  check(later.length === 2, `files of the catalog: ${later.length}`);
  check(figures.shift < 0.1, `the layout shifts by ${figures.shift.toFixed(3)}`);

  await page.waitForFunction(() => document.querySelector("#offline").textContent.startsWith("Ready"), null, { timeout: SOLVE_MS });
  await page.waitForFunction(async () => (await (await caches.open("index-of-starpipe")).keys()).length === 1, null, { timeout: SOLVE_MS });
  await page.reload();
  await ready(page);
  const againMs = await page.evaluate(() => performance.now());
  console.log(`the next visit: catalog and index after ${seconds(againMs)}`);
  check(againMs < figures.readyMs, "the index was not kept");
  await page.context().close();
}

/** Where the browser has no room left, the page works all the same. */
async function useWithoutRoom() {
  const page = await open({ width: 800, height: 700 }, "light", "", trusted, async (page) => {
    const session = await page.context().newCDPSession(page);
    await session.send("Storage.overrideQuotaForOrigin", { origin: new URL(trusted).origin, quotaSize: 1000 });
  });
  await ready(page);
  await give(page, frames[0]);
  await settled(page);
  check(await isIdentified(page), "no answer without room");
  await page.waitForFunction(() => document.querySelector("#offline").textContent, null, { timeout: SOLVE_MS });
  const told = await page.locator("#offline").textContent();
  check(told.includes("does not store"), `without room: ${told}`);
  await page.context().close();
}

/** Where the browser keeps nothing, the page works all the same. */
async function useUntrusted() {
  const page = await open({ width: 360, height: 740 }, "dark", "", trusted.replace("localhost", UNTRUSTED));
  check(!(await page.evaluate(() => "caches" in globalThis)), "storage where there should be none");
  const start = Date.now();
  const until = async (what) => {
    await page.waitForFunction(([selector, words]) => document.querySelector(selector)?.textContent.includes(words), what, { timeout: SOLVE_MS });
    return seconds(Date.now() - start);
  };
  await give(page, frames[0]);
  // While the index is built, which takes seconds. A cancel does not end that.
  const bright = await until(["#state", "brightest stars"]);
  await shot(page, "progress-phone-dark");
  await page.locator("#cancel").click();
  await settled(page);
  check((await state(page)).includes("canceled"), `canceled while the index is built: ${await state(page)}`);
  await page.locator("#hints summary").click();
  await page.locator("#again").click();
  console.log(`${path.basename(frames[0])} at the first visit: the bright stars answer after ${bright}, the whole catalog after ${await until(["#state", "was solved"])}`);
  await page.context().close();
}

/** On a line of 200 kB/s: what is loaded is counted, and the bright stars answer first. */
async function useSlowly() {
  sentPerSecond = 200_000;
  const page = await openPhone("light");
  const start = Date.now();
  await give(page, frames[0]);
  await page.waitForFunction(() => /^[1-9]\.\d of \d\.\d MB$/.test(document.querySelector("#amount").textContent), null, { timeout: SOLVE_MS });
  await screenOf(page, "phone-slow");
  await page.waitForFunction(() => document.querySelector("#state").textContent.includes("brightest stars"), null, { timeout: SOLVE_MS });
  console.log(`at 200 kB/s the first answer comes after ${seconds(Date.now() - start)}`);
  sentPerSecond = Infinity;
  await page.context().close();
}

/** The largest memory of the processes of pages, so far. */
const memoryMb = async () => {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const peak = ({ id }) => Number(/VmHWM:\s*(\d+)/.exec(readFileSync(`/proc/${id}/status`, "utf8"))?.[1] ?? 0) / 1000;
  return Math.max(...processInfo.filter(({ type }) => type === "renderer").map(peak));
};

/** A camera's data sheet, a dark, a flat, and a file of several images. */
async function useEquipment() {
  const page = await open({ width: 1280, height: 900 }, "light");
  await ready(page);
  await unfold(page);
  const solve = async (frame, args) => {
    await give(page, path.join(scratch, frame));
    await settled(page);
    const ours = JSON.parse((await download(page, "Report (JSON)")).toString());
    const theirs = JSON.parse(programJson(["process", "--threads", "1", "--format", "json", ...args, frame], scratch));
    console.log(`${frame} ${args.join(" ")}: ${ours.status}, ${compare(frame, ours, theirs)}`);
  };
  for (const name of ["camera.toml", "cygnus.tif"]) copyFileSync(path.join(root, "fixtures/cygnus", name), path.join(scratch, name));
  await page.locator("#camera-file").setInputFiles(path.join(scratch, "camera.toml"));
  await solve("cygnus.tif", ["--camera", "camera.toml"]);

  const [width, height] = [512, 384];
  const graymap = (name, value) => {
    const pixels = Buffer.from(Array.from({ length: width * height }, (_, i) => value(i % width, i)));
    writeFileSync(path.join(scratch, name), Buffer.concat([Buffer.from(`P5 ${width} ${height} 255\n`), pixels]));
  };
  graymap("dark.pgm", (x, i) => 20 + ((i * 7919) % 5));
  graymap("flat.pgm", (x) => 180 + Math.round((40 * x) / width));
  await page.locator("#dark-file").setInputFiles(path.join(scratch, "dark.pgm"));
  await page.locator("#flat-file").setInputFiles(path.join(scratch, "flat.pgm"));
  await solve("cygnus.tif", ["--camera", "camera.toml", "--dark", "dark.pgm", "--flat", "flat.pgm"]);
  await shot(page, "equipment");
  for (const name of ["camera", "dark", "flat"]) await page.locator(`#${name}-file`).setInputFiles([]);

  writeFileSync(path.join(scratch, "two.fits"), twoImages(width, height));
  await give(page, path.join(scratch, "two.fits"));
  await settled(page);
  await page.locator("#image").fill("2");
  await page.locator("#again").click();
  await settled(page);
  const ours = JSON.parse((await download(page, "Report (JSON)")).toString());
  const theirs = JSON.parse(programJson(["process", "--threads", "1", "--format", "json", "--page", "2", "two.fits"], scratch));
  console.log(`two.fits --page 2: ${compare("two.fits --page 2", ours, theirs)}`);
  await page.context().close();
}

/** A FITS file with two images that hold nothing but noise, of different sizes. */
const twoImages = (width, height) => {
  const card = (name, value) => `${name.padEnd(8)}= ${String(value).padStart(20)}`.padEnd(80);
  const block = (bytes) => Buffer.concat([bytes, Buffer.alloc((2880 - (bytes.length % 2880)) % 2880)]);
  const image = (first, width, height) => {
    const header = [...first, card("BITPIX", 8), card("NAXIS", 2), card("NAXIS1", width), card("NAXIS2", height), ...(first.length > 1 ? [card("PCOUNT", 0), card("GCOUNT", 1)] : []), "END".padEnd(80)].join("");
    const text = header.padEnd(Math.ceil(header.length / 2880) * 2880);
    return Buffer.concat([Buffer.from(text), block(Buffer.from(Array.from({ length: width * height }, (_, i) => 20 + ((i * 7919) % 13))))]);
  };
  // The first card of the second names its kind; the other two are there in every extension.
  return Buffer.concat([image([card("SIMPLE", "T")], width, height), image(["XTENSION= 'IMAGE   '".padEnd(80), ""], width / 2, height / 2)]);
};

async function usePhotographs() {
  const page = await open({ width: 1280, height: 900 }, "light");
  await ready(page);
  const readyMs = await page.evaluate(() => performance.now());
  console.log(`ready after ${seconds(readyMs)}`);
  await accessible(page, "empty");
  await shot(page, "empty-desktop");
  for (const frame of frames) {
    const name = path.basename(frame);
    await give(page, frame);
    await settled(page);
    const ours = JSON.parse((await download(page, "Report (JSON)")).toString());
    // A single thread, as the page has.
    const theirs = JSON.parse(programJson(["process", "--threads", "1", "--format", "json", name], path.dirname(frame)));
    console.log(`${name}: ${compare(name, ours, theirs)}`);
    console.log(`  ${ours.status}, ${ours.timing_ms.total.toFixed(0)} ms here, ${theirs.timing_ms.total.toFixed(0)} ms natively on one thread; ${(await memoryMb()).toFixed(0)} MB so far`);
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
  await unfold(page);
  await zoom(page);
  for (const layer of ["constellations", "equatorial"]) await showLayer(page, layer);
  await page.locator("section.table tbody tr").first().click();
  check((await page.locator("#under").textContent()).includes("SNR"), "a row tells nothing");
  await shot(page, "layers");
  for (const [name, begins] of [["Save the annotated picture", "\x89PNG"], ["Page (HTML)", "<!doctype"], ["Stars (CSV)", "frame,"], ["Coordinates", "SIMPLE"]]) {
    const bytes = await download(page, name);
    check(bytes.subarray(0, begins.length).toString("latin1") === begins, `${name} begins with ${bytes.subarray(0, 12).toString("latin1")}`);
  }
}

async function useOddly() {
  const page = await open({ width: 360, height: 740 }, "dark");
  const bad = path.join(scratch, "broken.fits");
  writeFileSync(bad, "SIMPLE  =                    T");
  await give(page, bad);
  await settled(page);
  check(/truncated|header|END/i.test(await state(page)), `a broken file: ${await state(page)}`);
  await give(page, path.join(root, "Cargo.toml"));
  await settled(page);
  check((await state(page)).includes("Cargo.toml"), `no picture: ${await state(page)}`);

  // Cancel, then solve: by the keyboard alone.
  await give(page, frames[0]);
  await page.locator("#cancel").waitFor();
  await page.locator("#cancel").focus();
  await page.keyboard.press("Enter");
  await settled(page);
  check((await state(page)).includes("canceled"), `canceled: ${await state(page)}`);
  await page.locator("#hints summary").focus();
  await page.keyboard.press("Enter");
  await page.locator("#again").focus();
  const start = Date.now();
  await page.keyboard.press("Enter");
  await settled(page);
  console.log(`the answer after a cancelled search: ${seconds(Date.now() - start)}, with the index from storage`);
  check(await isIdentified(page), "no answer after a cancel");
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "the page is wider than 360 px");
  await shot(page, "phone-dark");
  await accessible(page, "phone, dark");
  await page.setViewportSize({ width: 320, height: 640 });
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "the page is wider than 320 px");

  // Without stars: the reason and buttons.
  const dark = path.join(scratch, "dark.pgm");
  const noise = Buffer.from(Array.from({ length: 300 * 200 }, (_, i) => 20 + ((i * 7919) % 13)));
  writeFileSync(dark, Buffer.concat([Buffer.from("P5 300 200 255\n"), noise]));
  await give(page, dark);
  await settled(page);
  await page.locator("#queue button").last().click();
  check((await page.locator(".say").textContent()).includes("not identified"), "a frame without stars is not said to be one");
  check((await page.locator("#answer .answer").count()) === 0, "the reason is there twice");
  await shot(page, "no-answer-phone-dark");
  const hint = page.locator("[aria-label='What may help'] button").first();
  await hint.click();
  check(await page.evaluate(() => document.activeElement?.matches("#hints input") ?? false), "a hint does not lead to its field");

  // Tabs by arrow keys.
  await page.locator("#tab-photo").focus();
  await page.keyboard.press("ArrowRight");
  await page.locator("#limit").waitFor({ state: "visible", timeout: 5000 });
  await page.context().close();
}

/** The simulated frame: its numbers, its pixels, and how long they take. */
async function useSky(page) {
  const seen = page.locator("#limit-seen");
  const shown = async (words) => {
    await page.waitForFunction((words) => document.querySelector("#limit-seen").textContent.includes(words), words, { timeout: SOLVE_MS });
    const text = await seen.textContent();
    const label = await page.locator("#limit-sky").getAttribute("aria-label");
    const [count, brighter] = [/(\d+) stars? of the catalog/, /(\d+) of them/].map((words) => Number(words.exec(text)?.[1]));
    check(label.includes(`${count} star`) && label.includes(`${brighter} of them`), `the frame is called ${label}`);
    return { count, brighter };
  };
  /** Sum of grey, how much of it is white, and colored pixels. */
  const pixels = () => page.evaluate(() => {
    /** @type {HTMLCanvasElement} */ const canvas = document.querySelector("#limit-sky");
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
    copy.drawImage(canvas, 0, 0);
    const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
    let [grey, white, colored] = [0, 0, 0];
    for (let at = 0; at < data.length; at += 4) {
      grey += data[at];
      if (data[at] === 255) white += 1;
      if (data[at] !== data[at + 2]) colored += 1;
    }
    return { mean: (grey / data.length) * 4, white, colored };
  });
  // With the whole catalog, whose stars are asked for after the first prediction.
  const short = await shown("The limit is fainter than the catalog");
  const before = await pixels();
  const box = async () => JSON.stringify(await page.locator("#limit-sky").boundingBox());
  const place = await box();
  check(before.mean > 30 && before.mean < 90 && before.white > 10 && before.colored === 0, `the frame: ${JSON.stringify(before)}`);
  await page.locator("#limit-rings").check();
  check((await pixels()).colored > 100, "stars have no rings");
  await shot(page, "limit-rings");
  await page.locator("#limit-rings").uncheck();
  const limitOf = async (exposure) => {
    const start = await seen.textContent();
    await page.locator("#limit-exposure_s").fill(exposure);
    await page.waitForFunction((start) => document.querySelector("#limit-seen").textContent !== start, start, { timeout: SOLVE_MS });
    return { ...await shown("limit of V"), ...await pixels() };
  };
  const shorter = await limitOf("0.02"), again = await limitOf("0.5");
  check(await box() === place, "the frame moves when a setting changes");
  check(shorter.count === short.count && shorter.brighter < short.brighter, `stars above the limit at 0.02 s: ${shorter.brighter} of ${shorter.count}, at 0.5 s: ${short.brighter} of ${short.count}`);
  check(shorter.white < before.white && again.white === before.white && again.brighter === short.brighter, `white pixels at 0.02 s: ${shorter.white}, at 0.5 s: ${before.white}, then ${again.white}`);
  await page.locator("#limit-place").selectOption("pleiades");
  await page.waitForFunction(() => document.querySelector("#limit-sky").getAttribute("aria-label").includes("Pleiades"), null, { timeout: SOLVE_MS });
  check(page.url().includes("place=pleiades"), "the link does not carry the part of the sky");
  const size = page.viewportSize();
  await page.setViewportSize({ width: 320, height: 640 });
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "the model is wider than 320 px");
  await page.setViewportSize(size);
  await page.locator("#limit-place").selectOption("orion");
  await page.waitForFunction(() => document.querySelector("#limit-sky").getAttribute("aria-label").includes("Orion"), null, { timeout: SOLVE_MS });
  console.log(`simulated frame: ${short.brighter} of ${short.count} stars above the limit at 0.5 s, ${shorter.brighter} at 0.02 s; ${(await timesOfSky(page)).join(", ")}`);
}

/** How long frames take: as the preset has it, and the slowest that sliders make. */
const timesOfSky = async (page) => {
  const settings = {
    "imx174-35mm": {}, "nanosat-tracker": {}, "asi183mm-135mm": {}, "a lens of 2 mm": { focal_length_mm: 2 },
    "a lens of 2 mm, smeared, at 300 s": { focal_length_mm: 2, motion_px: 30, exposure_s: 300 },
  };
  const times = await page.evaluate(async (settings) => {
    // @ts-ignore
    const { Engine } = await import("./engine.js");
    const engine = new Engine(() => {});
    await engine.call("stars");
    const times = [];
    for (const [name, values] of settings) {
      const stated = JSON.stringify({ preset: Object.keys(values).length ? "imx174-35mm" : name, values });
      // The code is compiled well only after it ran for a while.
      for (const isFirst of [true, false]) {
        const start = performance.now();
        await engine.call("simulate", stated, undefined);
        if (!isFirst || !times.length) times.push(performance.now() - start);
      }
    }
    engine.stop();
    return times;
  }, Object.entries(settings));
  check(Math.max(...times) < SLOWEST_MS, `a simulated frame takes ${Math.max(...times).toFixed(0)} ms`);
  return ["the first", ...Object.keys(settings)].map((name, at) => `${name} ${times[at].toFixed(0)} ms`);
};

/** Random cameras: the page's prediction is the program's. */
async function useLimits(page) {
  const ranges = {
    aperture_mm: [2, 200], focal_length_mm: [8, 400], pitch_x_um: [1, 30], pitch_y_um: [1, 30], quantum_efficiency: [0.05, 1],
    exposure_s: [0.001, 10], sky_mag_arcsec2: [16, 22.5], zenith_distance_deg: [1, 85], extinction_mag_per_airmass: [0.01, 1], motion_px: [0.1, 30],
  };
  const options = { exposure_s: "exposure", zenith_distance_deg: "zenith-distance", extinction_mag_per_airmass: "extinction" };
  let seed = 1;
  const random = () => (seed = (seed * 48_271) % 2_147_483_647) / 2_147_483_647;
  const presets = ["experiment-1", "experiment-2", "nanosat-tracker", "imx174-35mm", "asi183mm-135mm"];
  const settings = Array.from({ length: RANDOM_SETTINGS }, () => {
    const chosen = Object.entries(ranges).filter(() => random() < 0.5);
    const values = chosen.map(([name, [low, high]]) => [name, Number((low * (high / low) ** random()).toPrecision(3))]);
    return { preset: presets[Math.floor(random() * presets.length)], values: Object.fromEntries(values) };
  });
  const ours = await page.evaluate(async (settings) => {
    // @ts-ignore
    const { Engine } = await import("./engine.js");
    const engine = new Engine(() => {});
    await engine.call("stars");
    const rows = await Promise.all(settings.map((one) => engine.call("limit", JSON.stringify(one)).catch(() => null)));
    engine.stop();
    return rows;
  }, settings);
  let refused = 0, same = 0;
  for (const [at, { preset, values }] of settings.entries()) {
    const args = Object.entries(values).flatMap(([name, value]) => [`--${options[name] ?? name.replaceAll("_", "-")}`, String(value)]);
    let theirs = null;
    try { theirs = JSON.parse(programJson(["limit", "--format", "json", "--preset", preset, ...args])); } catch { /* refused */ }
    if (theirs === null || ours[at] === null) {
      check(theirs === null && ours[at] === null, `limit of ${JSON.stringify(settings[at])}: only one of both refuses it`);
      refused += 1;
    } else if (compare(`limit of ${JSON.stringify(settings[at])}`, JSON.parse(ours[at]), theirs).startsWith("the same")) same += 1;
  }
  console.log(`limit: of ${RANDOM_SETTINGS} random settings, ${same} the same in every digit, ${refused} refused by both`);
}

/** The paper's experiments by their links. */
async function useLinks(page) {
  for (const link of await page.locator("#limit-paper a").all()) {
    const before = await page.locator("#limit-json").textContent();
    const preset = new URLSearchParams((await link.getAttribute("href")).split("?")[1]).get("preset");
    await link.click();
    await page.waitForFunction((before) => {
      const now = document.querySelector("#limit-json").textContent;
      return now !== before && now.includes("mean_vmag");
    }, before, { timeout: SOLVE_MS });
    const linked = JSON.parse(await page.locator("#limit-json").textContent());
    compare(`limit of ${preset}`, linked, JSON.parse(programJson(["limit", "--format", "json", "--preset", preset])));
  }
}

/** Writes what a canvas makes of a picture as this type. */
const converted = async (page, file, type, quality) => {
  const base64 = await page.evaluate(async ([base64, type, quality]) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    canvas.getContext("2d").drawImage(bitmap, 0, 0);
    const bytes = new Uint8Array(await (await canvas.convertToBlob({ type, quality })).arrayBuffer());
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  }, [readFileSync(file).toString("base64"), type, quality]);
  return Buffer.from(base64, "base64");
};

/** Exif attributes with a date in UTC, a place, and a camera that was turned. */
const exifBlock = () => {
  const ascii = (text) => Buffer.from(`${text}\0`);
  const rationals = (...values) => Buffer.concat(values.map((value) => { const pair = Buffer.alloc(8); pair.writeUInt32LE(value, 0); pair.writeUInt32LE(1, 4); return pair; }));
  const short = (value) => { const bytes = Buffer.alloc(2); bytes.writeUInt16LE(value); return bytes; };
  const long = (value) => { const bytes = Buffer.alloc(4); bytes.writeUInt32LE(value); return bytes; };
  const SIZES = { 2: 1, 3: 2, 4: 4, 5: 8 };
  /** A directory at this place, with its data behind it. */
  const directory = (place, entries) => {
    const head = Buffer.alloc(2 + 12 * entries.length + 4), data = [];
    head.writeUInt16LE(entries.length);
    let to = place + head.length;
    entries.forEach(([tag, type, value], at) => {
      const entry = 2 + 12 * at;
      head.writeUInt16LE(tag, entry);
      head.writeUInt16LE(type, entry + 2);
      head.writeUInt32LE(value.length / SIZES[type], entry + 4);
      if (value.length <= 4) return value.copy(head, entry + 8);
      head.writeUInt32LE(to, entry + 8);
      data.push(value);
      to += value.length;
    });
    return Buffer.concat([head, ...data]);
  };
  const exif = directory(100, [[0x9003, 2, ascii("2026:01:15 22:30:00")], [0x9011, 2, ascii("+00:00")]]);
  const gps = directory(200, [[1, 2, ascii("N")], [2, 5, rationals(52, 6, 0)], [3, 2, ascii("E")], [4, 5, rationals(5, 12, 0)]]);
  const first = directory(8, [[0x0112, 3, short(6)], [0x8769, 4, long(100)], [0x8825, 4, long(200)]]);
  const block = Buffer.alloc(200 + gps.length);
  Buffer.from([0x49, 0x49, 42, 0, 8, 0, 0, 0]).copy(block);
  for (const [part, at] of [[first, 8], [exif, 100], [gps, 200]]) part.copy(block, at);
  return block;
};

/** A WebP file with Exif attributes. */
const withExif = (webp, width, height) => {
  const chunk = (name, data) => {
    const head = Buffer.alloc(8);
    head.write(name);
    head.writeUInt32LE(data.length, 4);
    return Buffer.concat([head, data, Buffer.alloc(data.length % 2)]);
  };
  const isExtended = webp.toString("latin1", 12, 16) === "VP8X";
  const extended = isExtended ? Buffer.from(webp.subarray(20, 30)) : Buffer.alloc(10);
  extended[0] |= 0x08;
  extended.writeUIntLE(width - 1, 4, 3);
  extended.writeUIntLE(height - 1, 7, 3);
  const body = Buffer.concat([Buffer.from("WEBP"), chunk("VP8X", extended), webp.subarray(isExtended ? 30 : 12), chunk("EXIF", exifBlock())]);
  const head = Buffer.alloc(8);
  head.write("RIFF");
  head.writeUInt32LE(body.length, 4);
  return Buffer.concat([head, body]);
};

/** The boxes of a HEIC file that lead to its Exif attributes. */
const heicExif = () => {
  const box = (name, ...parts) => {
    const content = Buffer.concat(parts), head = Buffer.alloc(8);
    head.writeUInt32BE(content.length + 8);
    head.write(name, 4);
    return Buffer.concat([head, content]);
  };
  const bytes = (...values) => Buffer.from(values);
  const exif = Buffer.concat([bytes(0, 0, 0, 6), Buffer.from("Exif\0\0"), exifBlock()]);
  const made = (offset) => {
    const place = Buffer.alloc(8);
    place.writeUInt32BE(offset);
    place.writeUInt32BE(exif.length, 4);
    const iinf = box("iinf", bytes(0, 0, 0, 0, 0, 1), box("infe", bytes(2, 0, 0, 0, 0, 1, 0, 0), Buffer.from("Exif\0")));
    const iloc = box("iloc", bytes(1, 0, 0, 0, 0x44, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1), place);
    return Buffer.concat([box("ftyp", Buffer.from("heic\0\0\0\0")), box("meta", bytes(0, 0, 0, 0), iinf, iloc)]);
  };
  return Buffer.concat([made(made(0).length), exif]);
};

const report = async (page) => JSON.parse((await download(page, "Report (JSON)")).toString());

/** Formats that the browser decodes, and a file that is cut off. */
async function useFormats() {
  const page = await open({ width: 800, height: 700 }, "light");
  await ready(page);
  const png = path.join(root, "fixtures/orion/orion.png");
  const [width, height] = [readFileSync(png).readUInt32BE(16), readFileSync(png).readUInt32BE(20)];
  const solve = async (name, buffer) => {
    await give(page, { name, mimeType: "", buffer });
    await settled(page);
    check(await isIdentified(page), `${name}: ${await state(page)}`);
    return report(page);
  };
  const plain = await solve("orion.png", readFileSync(png));
  const webp = await solve("orion.webp", withExif(await converted(page, png, "image/webp", 1), width, height));
  check(webp.date?.iso === "2026-01-15T22:30:00Z", `WebP: date ${webp.date?.iso}`);
  check(Boolean(webp.observation), "WebP: the place is not used");
  check(Math.abs(webp.match.matched - plain.match.matched) <= 0.1 * plain.match.matched, `WebP: ${webp.match.matched} stars, PNG: ${plain.match.matched}`);

  const jpeg = await converted(page, png, "image/jpeg", 0.95);
  const cut = await solve("cut.jpg", jpeg.subarray(0, Math.round(jpeg.length * 0.8)));
  const said = await page.locator("#told .notes").textContent();
  check(cut.height < height && cut.height > height / 2 && said.includes(`first ${cut.height} of ${height} rows`), `cut off: ${cut.height} rows, ${said}`);
  console.log(`WebP: ${webp.match.matched} stars, PNG: ${plain.match.matched}; the first ${cut.height} of ${height} rows of a JPEG: ${cut.match.matched}`);

  const exif = await page.evaluate(async (bytes) => {
    // @ts-ignore
    const { exifOf, formatOf } = await import("./exif.js");
    const file = Uint8Array.from(bytes), format = formatOf(file);
    return { format, exif: [...exifOf(file, format) ?? []] };
  }, [...heicExif()]);
  const upright = exifBlock();
  upright[8 + 2 + 8] = 1;
  check(exif.format === "HEIC" && Buffer.from(exif.exif).equals(upright), `the attributes of HEIC: ${exif.exif.length} bytes`);
  await give(page, { name: "a.heic", mimeType: "", buffer: heicExif() });
  await settled(page);
  check((await state(page)).includes("does not open HEIC"), `HEIC: ${await state(page)}`);
  await page.context().close();
}

const PHONE = { width: 390, height: 844 };
const openPhone = (colorScheme, prepare) => open(PHONE, colorScheme, "", trusted, prepare, { hasTouch: true, isMobile: true, deviceScaleFactor: 2, permissions: ["clipboard-read", "clipboard-write"] });
/** Without the whole page, as a phone shows it. */
const screenOf = async (page, name) => { if (shots) await page.screenshot({ path: path.join(shots, `${name}.png`) }); };
const boxOf = async (page, selector) => (await page.locator(selector).boundingBox()) ?? { x: NaN, y: NaN, width: NaN, height: NaN };

/** Five stars by touch: each has its card there, and nothing scrolls. */
async function tapStars(page) {
  const rings = page.locator("#view circle.identified:visible");
  check((await rings.count()) >= 5 && (await rings.count()) <= 40, `${await rings.count()} rings at first`);
  const scrolled = await page.evaluate(() => scrollY);
  const titles = new Set();
  for (let at = 0; at < 5; at += 1) {
    const ring = await rings.nth(at).boundingBox();
    await page.touchscreen.tap(ring.x + ring.width / 2, ring.y + ring.height / 2);
    const card = await boxOf(page, "#card");
    titles.add(await page.locator("#card b").textContent());
    const isNear = Math.abs(card.y - ring.y) < 400 && card.x >= 0 && card.x + card.width <= PHONE.width && card.y >= 0 && card.y < PHONE.height;
    check(isNear, `star ${at}: the card is at ${JSON.stringify(card)}, its star at ${JSON.stringify(ring)}`);
    if (at === 0) await screenOf(page, "phone-card");
    await page.getByRole("button", { name: "Close" }).tap();
    check(!(await page.locator("#card").isVisible()), "the card stays");
  }
  check(titles.size === 5, `cards of ${[...titles].join(", ")}`);
  check(await page.evaluate(() => scrollY) === scrolled, "a tap scrolls the page");
}

/** A phone: an example, its picture first, cards, buttons, and what a reload keeps. */
async function usePhone() {
  const page = await openPhone("dark", (page) => page.addInitScript(() => {
    Object.assign(navigator, { canShare: () => true, share: async (data) => { Object.assign(globalThis, { shared: data }); } });
  }));
  await ready(page);
  await screenOf(page, "phone-empty");
  for (const name of ["Orion", "Cygnus", "Big Dipper"]) {
    await page.evaluate(() => document.documentElement.classList.remove("has-pictures"));
    await page.getByRole("button", { name, exact: true }).tap();
    await page.waitForFunction(() => !document.querySelector("#work[aria-busy]") && document.querySelector(".queue button:last-child"), null, { timeout: SOLVE_MS });
    await page.waitForFunction((name) => document.querySelector("#queue button[aria-pressed=true]")?.textContent.includes(name), name.toLowerCase().split(" ").at(-1), { timeout: SOLVE_MS });
    await settled(page);
    await page.waitForTimeout(3 * SETTLE_MS);
    check(await isIdentified(page), `the example ${name}: ${await state(page)}`);
    await screenOf(page, `phone-${name}`);
  }
  const view = await boxOf(page, "#view");
  check(view.y > -2 && view.y < 60 && view.width === PHONE.width, `the picture is at ${JSON.stringify(view)}`);
  check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "the page is wider than the phone");
  await tapStars(page);
  await page.locator("#wipe").fill("50");
  check(await page.locator("#view .chart circle").first().isVisible(), "the slider shows no drawing");
  await screenOf(page, "phone-drawing");
  await page.locator("#wipe").fill("0");
  await page.getByRole("button", { name: "Share", exact: true }).tap();
  await page.waitForFunction(() => "shared" in globalThis, null, { timeout: SOLVE_MS });
  // @ts-ignore
  const shared = await page.evaluate(() => ({ type: globalThis.shared.files[0].type, size: globalThis.shared.files[0].size, text: globalThis.shared.text }));
  check(shared.type === "image/png" && shared.size > 10_000 && shared.text === await page.locator(".say").textContent(), `shared: ${JSON.stringify(shared)}`);
  await page.getByRole("button", { name: /Copy link/ }).tap();
  await page.waitForFunction(async () => (await navigator.clipboard.readText()).includes("#limit?"), null, { timeout: SOLVE_MS });
  check((await page.evaluate(() => navigator.clipboard.readText())).includes("focal_length_mm="), "the link has no focal length");
  await accessible(page, "phone");
  await unfold(page);
  await accessible(page, "phone, unfolded");
  await shot(page, "phone-unfolded");

  const said = await page.locator(".say").textContent();
  await page.reload();
  await page.waitForSelector("#answer .say", { timeout: 5000 });
  check((await page.locator("#queue button[aria-label$=', identified']").count()) === 3, "a reload loses answers");
  await page.locator("#queue button").last().tap();
  await page.waitForFunction((said) => document.querySelector(".say")?.textContent === said, said, { timeout: 5000 });
  await useAnnotations(page);
  await useQueue(page);
  await useShareTarget(page);
  const layoutShift = await page.evaluate(() => globalThis.shift);
  console.log(`on a phone: layout shift ${layoutShift.toFixed(3)}`);
  check(layoutShift < 0.1, `the layout shifts by ${layoutShift.toFixed(3)} on a phone`);
  await page.context().close();
}

/** What a report says in a sentence and names without a detection. */
async function useAnnotations(page) {
  await page.evaluate(() => new Promise((done) => {
    const request = indexedDB.open("starpipe");
    request.onsuccess = () => {
      const store = request.result.transaction("answers", "readwrite").objectStore("answers");
      store.get(1).onsuccess = ({ target }) => {
        const answer = target.result;
        const named = { kind: "star", name: "A star", label: "A star", x: 200, y: 150, vmag: 1.2, id: null, detection: null, why: "saturated" };
        answer.json = JSON.stringify({ ...JSON.parse(answer.json), sentence: "Orion, north is up." });
        answer.data = JSON.stringify({ ...JSON.parse(answer.data), annotations: [named] });
        store.put(answer, 1).onsuccess = () => { request.result.close(); done(); };
      };
    };
  }));
  await page.reload();
  await page.waitForFunction(() => document.querySelector(".say")?.textContent === "Orion, north is up.", null, { timeout: 5000 });
  const ring = await page.locator("#view circle.unmeasured").boundingBox();
  await page.touchscreen.tap(ring.x + ring.width / 2, ring.y + ring.height / 2);
  const said = await page.locator("#card").textContent();
  check(said.includes("A star") && said.includes("V 1.20") && said.includes("Not measured: saturated"), `the card of a star that was not measured: ${said}`);
}

/** Thirty pictures: a cancel and a reload keep what was answered, and a button clears all. */
async function useQueue(page) {
  const [before, count, buffer] = [await page.locator("#queue button").count(), 30, readFileSync(path.join(root, "fixtures/orion/orion.png"))];
  await give(page, Array.from({ length: count }, (_, at) => ({ name: `many-${at}.png`, mimeType: "image/png", buffer })));
  const solved = (least) => page.waitForFunction((least) => document.querySelectorAll("#queue button[aria-label$=', identified']").length >= least, least, { timeout: SOLVE_MS });
  await solved(before + 3);
  await page.locator("#cancel").tap();
  await solved(before + 6);
  const already = await page.locator("#queue button[aria-label$=', identified']").count();
  await page.reload();
  await page.waitForFunction((already) => document.querySelectorAll("#queue button[aria-label$=', identified']").length >= already, already, { timeout: 10_000 });
  check(await page.locator("#queue button").count() === before + count, "a reload loses pictures");
  await settled(page);
  const [all, canceled] = [await page.locator("#queue button[aria-label$=', identified']").count(), await page.locator("#queue button[aria-label$='could not be solved']").count()];
  check(all + canceled === before + count && canceled <= 1, `of ${before + count} pictures ${all} are identified, ${canceled} canceled`);
  check((await page.locator("#queue-count").textContent()).includes(`${all} of ${before + count}`), await page.locator("#queue-count").textContent());
  await screenOf(page, "phone-queue");
  page.once("dialog", (dialog) => dialog.accept());
  await page.locator("#clear").tap();
  await page.waitForFunction(() => !document.querySelector("#queue button"));
  await page.reload();
  await ready(page);
  check(await page.locator("#queue button").count() === 0, "what was cleared comes back");
  console.log(`a queue of ${count}: ${all - before} answers after a cancel and a reload`);
}

/** What another app shares: the service worker takes it, the page solves it. */
async function useShareTarget(page) {
  const manifest = await page.evaluate(async () => (await fetch(/** @type {HTMLLinkElement} */ (document.querySelector("link[rel=manifest]")).href)).json());
  for (const { src } of manifest.icons) check(existsSync(path.join(dist, src)), `no icon ${src}`);
  await page.waitForFunction(() => navigator.serviceWorker.controller, null, { timeout: SOLVE_MS });
  await page.evaluate(async ([action, base64]) => {
    const form = new FormData();
    form.append("pictures", new File([Uint8Array.from(atob(base64), (byte) => byte.charCodeAt(0))], "a shared picture.png", { type: "image/png" }));
    await fetch(action, { method: "POST", body: form, redirect: "manual" });
  }, [manifest.share_target.action, readFileSync(path.join(root, "fixtures/orion/orion.png")).toString("base64")]);
  await page.goto(`${trusted}?shared`);
  await page.waitForSelector("#queue button[aria-label='a shared picture.png, identified']", { timeout: SOLVE_MS });
  await page.waitForSelector("#answer .say", { timeout: SOLVE_MS });
}

async function useModels() {
  const page = await open({ width: 1280, height: 900 }, "light", "#limit?preset=imx174-35mm&exposure_s=0.5&sky_mag_arcsec2=20");
  await page.waitForFunction(() => document.querySelector("#limit-json").textContent.includes("mean_vmag"), null, { timeout: SOLVE_MS });
  const ours = JSON.parse(await page.locator("#limit-json").textContent());
  const options = ["--preset", "imx174-35mm", "--exposure", "0.5", "--sky-mag-arcsec2", "20"];
  const limits = compare("limit", ours, JSON.parse(programJson(["limit", "--format", "json", ...options])));
  console.log(`limit: ${limits}`);
  await page.waitForSelector("#limit-figures svg >> nth=1", { timeout: SOLVE_MS });
  await shot(page, "limit-desktop");
  await shotOfPhone(page, "limit-phone-dark");
  await accessible(page, "limit");
  await useSky(page);
  const before = await page.locator("#limit-answer").textContent();
  await useLimits(page);
  await page.locator("#limit-aperture_mm-range").focus();
  await page.keyboard.press("PageUp");
  await page.waitForFunction((before) => document.querySelector("#limit-answer").textContent !== before, before, { timeout: SOLVE_MS });
  check(page.url().includes("aperture_mm="), "the link does not carry the aperture");
  await useLinks(page);

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
  await shotOfPhone(page, "defocus-phone-dark");
  await accessible(page, "defocus");
  await page.context().close();
}

async function useOffline() {
  const page = await open({ width: 800, height: 700 }, "light");
  await page.waitForFunction(() => document.querySelector("#offline").textContent.startsWith("Ready"), null, { timeout: SOLVE_MS });
  await page.context().setOffline(true);
  await page.reload();
  await ready(page);
  await give(page, frames[0]);
  await settled(page);
  check(await isIdentified(page), "no answer without a network");
  await page.context().close();
}

try {
  for (const use of [useTwice, usePhotographs, usePhone, useFormats, useEquipment, useOddly, useModels, useOffline, useWithoutRoom, useUntrusted, useSlowly]) await use();
} catch (error) {
  check(false, error.stack);
}
await browser.close();
server.close();
rmSync(scratch, { recursive: true });
conclude("the page does what it should");
