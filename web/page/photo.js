// The tab of photographs: pictures wait in a queue, one is solved at a time, one is shown. All are kept.
import { actions, cameraLink, canShare, copyLink, direction, remedies, save, sentence } from "./answer.js";
import { byId } from "./dom.js";
import { Engine, Stopped } from "./engine.js";
import { BUILD, NUMBERS, STARS } from "./files.js";
import { bytesOf } from "./program.js";
import { isSolving, wantsKey } from "./server.js";
import { clearAll, keepAnswer, keepPicture, keptAnswer, keptPictures } from "./store.js";
import { showFrame } from "./views.js";

/** Stages as people are told of them, in their order. */
const STAGES = [
  ["program", "Load the program"], ["catalog", "Load the catalog"], ["index", "Index the catalog"], ["read", "Read"], ["detect", "Find stars"], ["pointing", "Where it points"],
  ["naming", "Name the stars"], ["photometry", "Measure brightness"],
];
/** Files that browsers show themselves. */
const SHOWN_BY_BROWSER = /\.(jpe?g|png|bmp|webp|avif|hei[cf])$/i;
/** Where the service worker leaves what other apps share. */
const SHARED_CACHE = "shared-with-starpipe";
/** A picture that ended the page this often is left alone. */
const MOST_TRIES = 2;
/** Files that may have several images. */
const HAS_IMAGES = /\.(tiff?|fits?|fts|fz|gz)$/i;

/**
 * @typedef {{ json: string, html: string, data: string, said: string }} Answer
 * @typedef {object} Picture
 * @property {File} file
 * @property {number} id
 * @property {"waits" | "runs" | "done" | "failed"} state
 * @property {string} status
 * @property {number} tries
 * @property {string} options
 * @property {Record<string, File>} equipment
 * @property {number} images
 * @property {boolean} isRemote Whether the server solves it. Who gave it was told so.
 * @property {Answer | null} result What is in storage is not in memory, too.
 * @property {string} error
 * @property {HTMLButtonElement} button
 */

/** @type {Picture[]} */ const pictures = [];
/** @type {Picture | null} */ let chosen = null;
/** @type {Picture | null} */ let running = null;
/** Whether the server of this page solves what is given. */
let isRemote = false;
/** The address of the page that solves on the device, though its server could. */
const HERE = "?browser";
let isReady = false;
/** Whether it ever was: the index is kept since, and soon there. */
let wasReady = false;
/** Ends the wait for the catalog, of which the preparation goes on. */
let giveUp = () => {};
const engine = new Engine((stage, share) => tellStage(stage, share));
/** Shows and searches pictures among the bright stars, while the catalog is on its way. */
const scout = new Engine(() => {});

/** The options that the form states, as JSON: those of the chosen picture, or of a new one. */
const stated = (isNew = false) => {
  const form = byId("hint-form");
  const options = {};
  for (const [name, given] of new FormData(form)) {
    const text = given instanceof File ? "" : given.trim().replaceAll("−", "-");
    if (!text || (isNew && name === "image")) continue;
    // The numbers of a pair may also stand side by side.
    const isPair = (name === "near" || name === "site") && !text.includes(",");
    options[name] = name === "image" ? Number(text) : isPair ? text.replace(/\s+/, ",") : text;
  }
  return JSON.stringify(options);
};

/** The files that the form names: of the camera, and those that calibrate. */
const equipment = () => {
  const files = {};
  for (const [name, given] of new FormData(byId("hint-form"))) if (given instanceof File && given.size) files[name] = given;
  return files;
};

const tell = (text, isError = false) => {
  byId("state").textContent = text;
  byId("state").className = isError ? "error" : "";
};

/** What is prepared, in words. */
let preparing = "Loading the program.";

/** How much of what is loaded is here. */
const tellAmount = (stage, share) => {
  const isProgram = stage === "program" && share < 1;
  const now = isProgram ? "Loading the program." : "Loading the star catalog.";
  if (byId("state").textContent === preparing && now !== preparing) tell(now);
  preparing = now;
  const all = bytesOf(stage, [STARS, NUMBERS]) / 1e6;
  byId("amount").textContent = all && share < 1 ? `${(all * share).toFixed(1)} of ${all.toFixed(1)} MB` : "";
};

const tellStage = (stage, share) => {
  // The server does not tell how far it is.
  if (running ? running.isRemote : isRemote) return;
  tellAmount(stage, share);
  const at = STAGES.findIndex(([name]) => name === stage);
  if (at < 0) return;
  const isDone = share >= 1;
  [...byId("stages").children].forEach((item, place) => {
    item.className = place < at || (place === at && isDone) ? "is-done" : place === at || (isDone && place === at + 1) ? "is-now" : "";
  });
  byId("done").value = (at + share) / STAGES.length;
};

const key = ({ id, options, equipment }) => {
  const files = Object.entries(equipment).map(([name, file]) => [name, file.name, file.size, file.lastModified]);
  return JSON.stringify([id, options, files]);
};

const markOf = { waits: "…", runs: "◌", done: "●", failed: "!" };
const label = (picture) => {
  const isIdentified = picture.status === "identified";
  const state = { waits: "waits", runs: "is being solved", failed: "could not be solved", done: isIdentified ? "identified" : "not identified" }[picture.state];
  const mark = picture.state === "done" && !isIdentified ? "○" : markOf[picture.state];
  picture.button.replaceChildren(Object.assign(document.createElement("span"), { className: "mark", textContent: mark, ariaHidden: "true" }), picture.file.name);
  picture.button.setAttribute("aria-label", `${picture.file.name}, ${state}`);
  picture.button.setAttribute("aria-pressed", String(picture === chosen));
  const waiting = pictures.filter(({ state }) => state === "waits").length;
  byId("queue-count").textContent = pictures.length > 1 ? `${pictures.filter(({ state }) => state === "done").length} of ${pictures.length} are solved.` : "";
  byId("cancel-all").hidden = !running || !waiting;
  tellWhetherEmpty();
};

/** The next visit leaves room for what is kept, see early.js. */
const tellWhetherEmpty = () => {
  const has = pictures.length > 0;
  document.documentElement.classList.toggle("has-pictures", has);
  try {
    localStorage.setItem("has-pictures", has ? "1" : "");
  } catch { /* it jumps a little */ }
};

const keep = ({ file, id, state, status, tries, options, equipment, images, isRemote, error }) => keepPicture({ file, id, state, status, tries, options, equipment, images, isRemote, error, build: BUILD });

/** @param {Partial<Picture> & { file: File }} given @returns {Picture} */
const enqueue = (given) => {
  const button = document.createElement("button");
  button.type = "button";
  const id = pictures.reduce((most, { id }) => Math.max(most, id), 0) + 1;
  /** @type {Picture} */
  const picture = { id, state: "waits", status: "", tries: 0, options: stated(true), equipment: equipment(), images: 1, isRemote, result: null, error: "", button, ...given };
  button.addEventListener("click", () => choose(picture));
  const item = document.createElement("li");
  item.appendChild(button);
  byId("queue").appendChild(item);
  pictures.push(picture);
  label(picture);
  return picture;
};

/** @param {Iterable<File>} files */
const add = async (files) => {
  await restored;
  const isIdle = !running;
  const added = [...files].map((file) => enqueue({ file }));
  for (const picture of added) {
    keep(picture);
    countImages(picture);
  }
  if (added.length && isIdle) choose(added[0], true);
  next();
};

/** What an earlier visit left. */
const restore = async () => {
  for (const { build, ...kept } of await keptPictures()) {
    const wasSolving = kept.state === "runs";
    // Answers of another version do not fit this one.
    if (wasSolving || (kept.state === "done" && build !== BUILD)) kept.state = "waits";
    if (wasSolving && kept.tries >= MOST_TRIES) Object.assign(kept, { state: "failed", error: `${kept.file.name} was not solved: the page was closed or crashed during each attempt.` });
    // What was given to be solved on the device stays there.
    enqueue({ ...kept, isRemote: isRemote && kept.isRemote === true });
  }
  if (pictures.length) choose(pictures.find(({ state }) => state === "done") ?? pictures[0]);
  next();
};

const clear = async () => {
  if (!confirm("Remove all pictures and results from this page?")) return;
  for (const picture of pictures.splice(0)) picture.state = "failed";
  stop();
  [chosen, byId("again").disabled] = [null, true];
  byId("queue").replaceChildren();
  byId("answer").replaceChildren();
  byId("preview").hidden = true;
  tellWhetherEmpty();
  await clearAll();
  tell("Ready for your picture.");
};

/** @param {Picture} picture @param {boolean} [isNew] */
const choose = async (picture, isNew = false) => {
  chosen = picture;
  pictures.forEach(label);
  byId("again").disabled = false;
  byId("answer").replaceChildren();
  byId("preview").hidden = true;
  showImages(picture);
  if (picture.state === "done") await showResult(picture);
  else showPreview(picture);
  if (picture.state === "failed") tell(picture.error, true);
  if (isNew) bringToTop("work");
};

/** @param {string} id */
const bringToTop = (id) => {
  const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
  byId(id)?.scrollIntoView({ block: "start", behavior: isStill ? "auto" : "smooth" });
};

/** The choice of an image, in files with several. */
const showImages = (picture) => {
  byId("image-label").hidden = picture.images < 2;
  byId("image").max = picture.images;
  byId("image").disabled = picture.images < 2;
  byId("image").value = JSON.parse(picture.options).image ?? "";
  byId("image-count").textContent = String(picture.images);
};

const countImages = async (picture) => {
  if (!HAS_IMAGES.test(picture.file.name)) return;
  try {
    picture.images = await scout.call("images", picture.file);
  } catch { /* the solution tells why */ }
  if (picture === chosen) showImages(picture);
};

const showPreview = async (picture) => {
  const image = byId("preview").querySelector("img");
  const show = async (blob) => {
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(blob);
    // Its size is known before its place is taken.
    const isShown = await image.decode().then(() => true, () => false);
    if (chosen === picture && picture.state !== "done") byId("preview").hidden = !isShown;
  };
  if (SHOWN_BY_BROWSER.test(picture.file.name)) return show(picture.file);
  try {
    show(new Blob([await scout.call("preview", picture.file, JSON.parse(picture.options).image)], { type: "image/jpeg" }));
  } catch { /* the solution tells why */ }
};

/** What is done with a picture, in words. @param {Picture} picture */
const doing = ({ file, isRemote }) => (isRemote ? `${file.name} is sent to the server, which solves it.` : `${file.name} is being solved.`);

/** What a call takes of a picture that is solved on the device. @param {Picture} picture */
const given = (picture) => [key(picture), picture.file, picture.options, picture.equipment];

/** The same for the server. @param {Picture} picture */
const givenThere = ({ file, options }) => [file, options, byId("server-key").value.trim()];

/** Prepares the catalog. @param {Picture} picture */
const prepare = async (picture) => {
  if (!wasReady) glance(picture);
  const givenUp = new Promise((_, reject) => { giveUp = () => reject(new Stopped("stopped")); });
  await Promise.race([engine.call("prepare"), givenUp]);
  isReady = wasReady = true;
  tell(doing(picture));
};

/** @param {Picture} picture */
const solve = async (picture) => {
  if (!picture.isRemote) await prepare(picture);
  const answer = await (picture.isRemote ? engine.call("solveThere", ...givenThere(picture)) : engine.call("solve", ...given(picture)));
  Object.assign(picture, { state: "done", status: JSON.parse(answer.json).status, tries: 0, result: answer });
  const isKept = await keepAnswer(picture.id, answer);
  // Without storage, memory has to do.
  if (isKept && picture !== chosen) picture.result = null;
};

const next = async () => {
  if (running) return;
  const picture = pictures.find((one) => one.state === "waits");
  if (!picture) return;
  running = picture;
  picture.state = "runs";
  picture.tries += 1;
  label(picture);
  byId("cancel").hidden = false;
  byId("work").setAttribute("aria-busy", "true");
  byId("work").classList.toggle("on-server", picture.isRemote);
  if (picture.isRemote) byId("done").removeAttribute("value");
  else byId("done").value = 0;
  tell(isReady || picture.isRemote ? doing(picture) : preparing);
  keep(picture);
  try {
    await solve(picture);
    tell(`${picture.file.name} is done.`);
  } catch (error) {
    picture.state = "failed";
    picture.error = error instanceof Stopped ? `${picture.file.name} was canceled.` : error.message;
    isReady = !(error instanceof Stopped) && isReady;
    if (pictures.includes(picture)) tell(picture.error, true);
    if (wantsKey(picture.error)) byId("key-label").hidden = false;
  }
  running = null;
  byId("cancel").hidden = true;
  byId("work").removeAttribute("aria-busy");
  if (pictures.includes(picture)) {
    label(picture);
    keep(picture);
    if (picture === chosen && picture.result) await showResult(picture, true);
  }
  next();
};

/** Ends what runs. */
const stop = () => {
  if (isReady || running?.isRemote) engine.stop();
  else giveUp();
  scout.stop();
};

/** What the bright stars alone say, until the catalog is here. */
const glance = async (picture) => {
  try {
    const report = JSON.parse(await scout.call("glance", picture.file, picture.options, picture.equipment));
    if (picture !== running || isReady || report.status !== "identified") return;
    tell(`First result, from the brightest stars only: ${direction(report.attitude)}. Loading the star catalog for the full result.`);
  } catch { /* the full search tells why */ }
};

/** @param {Picture} picture @returns {Promise<Answer | null>} */
const answerOf = async (picture) => picture.result ?? (await keptAnswer(picture.id)) ?? null;

/** @param {Picture} picture @param {boolean} [isNew] */
const showResult = async (picture, isNew = false) => {
  const result = await answerOf(picture);
  if (picture !== chosen) return;
  if (!result) {
    // The browser took its storage back.
    picture.state = "waits";
    return next();
  }
  const report = JSON.parse(result.json);
  const view = document.createElement("div");
  view.className = "frame";
  // Names are escaped where the elements are made.
  view.innerHTML = result.html;
  // The page has its own headline, below the picture.
  view.querySelector(".answer")?.remove();
  const told = view.querySelector("#told");
  const say = Object.assign(document.createElement("p"), { className: "say", textContent: sentence(report) });
  told?.append(say);
  if (result.said) told?.append(Object.assign(document.createElement("p"), { className: "notes", textContent: result.said }));
  if (report.status !== "identified") told?.append(remedies(report.remedies));
  told?.append(...buttons(picture, report, result));
  byId("preview").hidden = true;
  byId("answer").replaceChildren(view);
  showFrame(view, JSON.parse(result.data));
  const took = `${(report.timing_ms.total / 1000).toFixed(2)} s`;
  if (!running) tell(report.status === "identified" ? `${picture.file.name} was solved in ${took}.` : `${picture.file.name} was not identified after ${took}.`);
  if (isNew) bringToTop("answer");
};

/** The layers of the sky that are shown are those of the annotated picture. */
const layers = () => {
  const isOn = (name) => document.querySelector(`#answer [data-layer="${name}"]:checked`) !== null;
  return JSON.stringify({
    all_rings: isOn("unidentified"), constellations: isOn("constellations"), deep_sky: isOn("deepsky"),
    equatorial: isOn("equatorial"), horizontal: isOn("horizontal"),
  });
};

/** Buttons for the answer: what many want, then the files. @param {Picture} picture @param {any} report @param {Answer} result */
const buttons = (picture, report, result) => {
  const stem = picture.file.name.replace(/(\.fits)?\.[^.]*$/i, "");
  /** @param {string} kind */
  const made = (kind) => (picture.isRemote ? engine.call("drawThere", ...givenThere(picture), kind, layers()) : engine.call("draw", ...given(picture), kind, layers()));
  const draw = async (kind, type) => new Blob([await made(kind)], { type });
  const saveDrawn = (kind, type, extension) => draw(kind, type).then((blob) => save(blob, `${stem}.${extension}`), (error) => tell(error.message, true));
  /** @type {[string, (button: HTMLButtonElement) => unknown][]} */
  const first = [["Save the annotated picture", () => saveDrawn("overlay", "image/png", "annotated.png")]];
  if (canShare()) first.unshift(["Share", () => share(() => draw("overlay", "image/png"), `${stem}.png`, sentence(report))]);
  if (report.status === "identified") first.push(["Copy link: what would this camera see?", (button) => copyLink(cameraLink(report), button)]);
  /** @type {[string, () => unknown][]} */
  const files = [
    ["Page (HTML)", () => saveDrawn("html", "text/html", "html")],
    ["Stars (CSV)", () => saveDrawn("csv", "text/csv", "csv")],
    ["Report (JSON)", () => save(new Blob([`${result.json}\n`], { type: "application/json" }), `${stem}.json`)],
  ];
  if (report.status === "identified") files.push(["Coordinates (FITS header)", () => saveDrawn("wcs", "application/fits", "wcs")]);
  const fold = Object.assign(document.createElement("details"), { id: "download-fold" });
  fold.append(Object.assign(document.createElement("summary"), { textContent: "Download results" }), actions("Downloads", files));
  return [actions("Answer", first), fold];
};

/** The picture that is drawn, until it was shared: to draw may take longer than a browser waits. */
let drawn = { name: "", /** @type {File | null} */ file: null };

/** @param {() => Promise<Blob>} draw @param {string} name @param {string} text */
const share = async (draw, name, text) => {
  try {
    if (drawn.name !== name + layers()) drawn = { name: name + layers(), file: new File([await draw()], name, { type: "image/png" }) };
    await navigator.share({ files: drawn.file ? [drawn.file] : [], text });
  } catch (error) {
    if (error.name === "NotAllowedError") tell("The picture is ready. Press Share again.");
    else if (error.name !== "AbortError") tell(error.message, true);
  }
};

/** An example, which is a drawing of the simulator. @param {string} name */
const addExample = async (name) => {
  try {
    const response = await fetch(name);
    if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
    add([new File([await response.blob()], name.replace("example-", ""))]);
  } catch (error) {
    tell(`The example could not be loaded: ${error.message}`, true);
  }
};

/** What another app shared with this one. */
const takeShared = async () => {
  try {
    const cache = await caches.open(SHARED_CACHE);
    if (location.search === "?shared") history.replaceState(null, "", location.pathname + location.hash);
    const files = await Promise.all((await cache.keys()).map(async (request) => {
      const response = await cache.match(request);
      await cache.delete(request);
      const name = decodeURIComponent(new URL(request.url).pathname.replace(/^.*\//, ""));
      return response && new File([await response.blob()], name);
    }));
    if (files.length) await add(files.filter((file) => file !== undefined));
  } catch { /* a browser without such storage has no such apps */ }
};

/** Finds out who solves what is given, and says so before anything is. */
const tellWhere = async () => {
  const isServed = await isSolving();
  isRemote = isServed && location.search !== HERE;
  byId("promise").hidden = isRemote;
  byId("promise").classList.remove("unknown");
  byId("where").hidden = !isServed;
  byId("where-text").textContent = isRemote ? `Pictures are sent to this server, ${location.host}, which solves them.` : "Pictures are solved in this browser, and stay on this device.";
  byId("where-link").textContent = isRemote ? "Solve in this browser instead" : `Solve on ${location.host} instead`;
  byId("where-link").href = isRemote ? HERE : "./";
  // The server takes pictures alone.
  for (const label of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-here]"))) {
    label.hidden = isRemote;
    label.querySelector("input").disabled = isRemote;
  }
};

/** What is there before any picture. @type {Promise<void>} */ let restored = Promise.resolve();

/** Sets the tab up, and prepares the catalog while the visitor looks for a picture: resolves when that is over. */
export const photo = () => {
  for (const [, text] of STAGES) byId("stages").appendChild(Object.assign(document.createElement("li"), { textContent: text }));
  for (const id of ["files", "camera"]) {
    byId(id).addEventListener("change", () => { add([...byId(id).files]); byId(id).value = ""; });
  }
  const drop = byId("drop");
  addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
  addEventListener("dragleave", () => drop.classList.remove("over"));
  addEventListener("drop", (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    add([...(event.dataTransfer?.files ?? [])]);
  });
  byId("cancel").addEventListener("click", stop);
  byId("cancel-all").addEventListener("click", () => {
    for (const picture of pictures.filter(({ state }) => state === "waits")) {
      Object.assign(picture, { state: "failed", error: `${picture.file.name} was canceled.` });
      label(picture);
      keep(picture);
    }
    stop();
  });
  byId("clear").addEventListener("click", clear);
  for (const button of document.querySelectorAll("[data-example]")) button.addEventListener("click", () => addExample(button.getAttribute("data-example") ?? ""));
  byId("hint-form").addEventListener("submit", (event) => {
    event.preventDefault();
    if (!chosen || chosen.state === "runs") return;
    Object.assign(chosen, { state: "waits", options: stated(), equipment: equipment(), isRemote, result: null, error: "", tries: 0 });
    choose(chosen, true);
    next();
  });
  const told = tellWhere();
  restored = told.then(restore);
  restored.then(takeShared).then(tellWhetherEmpty);
  engine.call("version").then((version) => { byId("version").textContent = version; }, (error) => tell(error.message, true));
  return told.then(() => (isRemote ? undefined : engine.call("prepare"))).then(() => {
    if (!isRemote) isReady = wasReady = true;
    if (!running) tell("Ready for your picture.");
  }, (error) => { if (!(error instanceof Stopped)) tell(error.message, true); });
};
