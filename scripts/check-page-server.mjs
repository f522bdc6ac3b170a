// Uses the page in web/dist at `starpipe serve --page` in headless Chromium: pictures are solved by the server, and
// by the browser where the visitor wants that. Compares the answers with the program's.
//
// scripts/check-web runs it.
import { execFileSync, spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import os from "node:os";
import path from "node:path";
import { createInterface } from "node:readline";
import { accessible, check, conclude, launch, option, unfold, watch, words } from "./in-chromium.mjs";

const SOLVE_MS = 300_000;
const root = path.resolve(import.meta.dirname, "..");
const dist = path.resolve(option("--dist") ?? path.join(root, "web/dist"));
const shots = option("--shots");
if (shots) mkdirSync(shots, { recursive: true });
const [program] = words;
const frame = path.join(root, "fixtures/orion/orion.png"), name = path.basename(frame);
const scratch = mkdtempSync(path.join(os.tmpdir(), "starpipe-page-"));
const browser = await launch();

/** Starts a server, and ends it after `use` of its address. */
const withServer = async (options, use) => {
  const folder = mkdtempSync(path.join(scratch, "jobs-"));
  const server = spawn(program, ["serve", "--listen", "127.0.0.1:0", "--page", dist, "--folder", folder, ...options], { stdio: ["ignore", "inherit", "pipe"] });
  const ended = new Promise((done) => { server.on("exit", done); });
  const address = await new Promise((done, fail) => {
    createInterface(server.stderr).on("line", (line) => { const found = /http:\/\/\S+/.exec(line); if (found) done(`${found[0]}/`); });
    ended.then(() => fail(new Error("the server does not start")));
  });
  try {
    await use(address);
  } finally {
    server.kill();
    await ended;
  }
};

/** The page, and the requests that bring a picture to the server. Its console must be silent unless it may complain. */
const open = async (address, mayComplain = false) => {
  const context = await browser.newContext({ viewport: { width: 1000, height: 800 }, acceptDownloads: true });
  const page = await context.newPage();
  if (!mayComplain) watch(page, (url) => url.startsWith(address) || /^(data|blob):/.test(url));
  const sent = [];
  page.on("request", (request) => { if (request.method() === "POST") sent.push(new URL(request.url())); });
  await page.goto(address);
  await ready(page);
  return { page, sent };
};
const ready = (page) => page.waitForFunction(() => document.querySelector("#state")?.textContent.startsWith("Ready"), null, { timeout: SOLVE_MS });
const give = (page, files) => page.locator("#files").setInputFiles(files);
const settled = (page) => page.waitForFunction(() => document.querySelector("#queue button") && !document.querySelector("#work[aria-busy]"), null, { timeout: SOLVE_MS });
const state = (page) => page.locator("#state").textContent();
const download = async (page, button) => {
  await unfold(page);
  const [file] = await Promise.all([page.waitForEvent("download", { timeout: SOLVE_MS }), page.getByRole("button", { name: button }).first().click()]);
  return readFileSync(await file.path());
};
const shot = async (page, as) => { if (shots) await page.screenshot({ path: path.join(shots, `${as}.png`), fullPage: true }); };

/** What the program writes of the frame. */
const written = (() => {
  const out = path.join(scratch, "out");
  execFileSync(program, ["process", "--quiet", "--out", out, name], { cwd: path.dirname(frame) });
  return (extension) => readFileSync(path.join(out, name.replace(".png", `.${extension}`)));
})();
/** A report without its times. */
const plain = (json) => JSON.stringify({ ...JSON.parse(json), timing_ms: null });
const cards = (header) => (header.toString("latin1").match(/.{80}/gs) ?? []).filter((card) => !card.startsWith("HISTORY")).join("\n");

async function solveOnServer(address) {
  const { page, sent } = await open(address);
  const told = await page.locator("#where").innerText();
  check(told.includes("are sent to this server"), `where pictures go: ${told}`);
  check(!/nothing is uploaded/i.test(await page.locator("body").innerText()), "the page promises that nothing is uploaded");
  await accessible(page, "the page at a server");
  await shot(page, "server-start");
  await give(page, frame);
  await settled(page);
  check(sent.length === 1 && sent[0].pathname === "/solve", `requests: ${sent}`);
  check((await page.locator("#queue button[aria-label$=', identified']").count()) === 1, await state(page));
  check((await page.locator("#where").innerText()).includes("are sent"), "beside a picture the page does not say where it goes");
  const report = await download(page, "Report (JSON)"), expected = written("json");
  for (const part of ["ra_deg", "dec_deg"]) {
    const [found, right] = [report, expected].map((json) => JSON.parse(json.toString()).attitude[part]);
    console.log(`${part}: ${found}, process ${right}`);
  }
  check(plain(report) === plain(expected), "the report is not that of process");
  check((await download(page, "Stars (CSV)")).equals(written("csv")), "the table is not that of process");
  check(cards(await download(page, "Coordinates (FITS header)")) === cards(written("wcs")), "the header is not that of process");
  check((await download(page, "Page (HTML)")).toString().includes("<meta name=\"generator\" content=\"starpipe\">"), "the page of process is not saved");
  const usual = await download(page, "Save the annotated picture");
  check(usual.equals(written("png")), "the annotated picture is not that of process");
  await page.locator("[data-layer=equatorial]").check();
  check(!(await download(page, "Save the annotated picture")).equals(usual), "the layers are not drawn");
  check(sent.length === 6 && sent[5].searchParams.get("draw")?.includes("grid"), `requests: ${sent}`);
  await shot(page, "server-solved");

  await page.locator("#fov").fill("5");
  await page.locator("#again").click();
  await settled(page);
  check(sent[6]?.searchParams.get("fov") === "5", `hints: ${sent[6]}`);
  check((await page.locator("#queue button[aria-label$=', not identified']").count()) === 1, `with a wrong hint: ${await state(page)}`);
  await page.context().close();
}

async function solveInBrowser(address) {
  const { page, sent } = await open(address);
  await page.locator("#where-link").click();
  await page.waitForURL("**/?browser");
  await ready(page);
  check((await page.locator("#promise").innerText()).includes("nothing is uploaded"), "the promise is not shown");
  await give(page, frame);
  await settled(page);
  check(plain(await download(page, "Report (JSON)")) === plain(written("json")), "the browser's report is not that of process");
  // Back on the page that sends, what was given here is drawn here.
  await page.locator("#where-link").click();
  await page.waitForURL(address);
  await page.waitForSelector("#answer .say", { timeout: SOLVE_MS });
  await download(page, "Stars (CSV)");
  check(sent.length === 0, `sent though it should stay: ${sent}`);
  await page.context().close();
}

/** The words for what a server refuses, of which browsers complain in their console. */
async function refusals(address) {
  const { page } = await open(address, true);
  const large = path.join(scratch, "large.png"), text = path.join(scratch, "text.png");
  writeFileSync(large, Buffer.concat([readFileSync(frame), Buffer.alloc(3_000_000)]));
  writeFileSync(text, "Hello World");
  await give(page, frame);
  await settled(page);
  check((await state(page)).includes("a key is needed"), `without a key: ${await state(page)}`);
  await page.locator("#server-key").fill("alpha");
  await unfold(page);
  await page.locator("#again").click();
  await settled(page);
  check((await page.locator("#queue button[aria-label$=', identified']").count()) === 1, `with a key: ${await state(page)}`);
  for (const [file, expected] of [[text, /picture|format/i], [large, /too large|large/i]]) {
    await give(page, file);
    await settled(page);
    const told = await state(page);
    console.log(`${path.basename(file)}: ${told}`);
    check(expected.test(told) && told.startsWith("The server"), `${path.basename(file)}: ${told}`);
  }
  await shot(page, "server-refused");
  const answers = [
    [{ status: 503, headers: { "retry-after": "5" }, json: { error: "the queue is full; ask again later" } }, /queue is full.*in 5 s/],
    [{ status: 502, contentType: "text/html", body: "<h1>Bad Gateway</h1>" }, /status 502/],
    [null, /was not reached/],
  ];
  for (const [answer, expected] of answers) {
    await page.route("**/solve?*", (route) => (answer ? route.fulfill(answer) : route.abort()));
    await page.locator("#again").click();
    await settled(page);
    check(expected.test(await state(page)), `${answer?.status}: ${await state(page)}`);
    await page.unroute("**/solve?*");
  }
  await page.context().close();
}

try {
  await withServer([], async (address) => {
    await solveOnServer(address);
    await solveInBrowser(address);
  });
  const keys = path.join(scratch, "keys");
  writeFileSync(keys, "alpha\n");
  await withServer(["--keys", keys, "--max-upload", "1"], refusals);
} catch (error) {
  check(false, error.stack);
}
await browser.close();
rmSync(scratch, { recursive: true });
conclude("the page at a server does what it should");
