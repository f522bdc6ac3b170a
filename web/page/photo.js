// The tab of photographs: pictures wait in a queue, one is solved at a time, one is shown.
import { byId } from "./dom.js";
import { Engine, Stopped } from "./engine.js";
import { showFrame } from "./views.js";

/** Stages as people are told of them, in their order. */
const STAGES = [
  ["catalog", "Load the catalog"], ["index", "Index it"], ["read", "Read"], ["detect", "Find stars"], ["pointing", "Where it points"],
  ["naming", "Name the stars"], ["photometry", "Measure brightness"],
];
/** What a remedy of the report leads to: the field of the form, and the words of its button. */
const REMEDIES = {
  fov: ["fov", "State the width of the field"],
  pixel_scale: ["pixel_scale", "State the angle of a pixel"],
  near: ["near", "State where it points"],
  radius: ["radius", "State how far from there"],
  date: ["date", "State the date"],
  sigma: ["sigma", "Change the detection threshold"],
  time_limit: ["thorough", "Search longer"],
};
/** Files that browsers show themselves. */
const SHOWN_BY_BROWSER = /\.(jpe?g|png|bmp)$/i;
/** Files that may have several images. */
const HAS_IMAGES = /\.(tiff?|fits?|fts|fz|gz)$/i;

/**
 * @typedef {object} Picture
 * @property {File} file
 * @property {number} number
 * @property {"waits" | "runs" | "done" | "failed"} state
 * @property {string} options
 * @property {Record<string, File>} equipment
 * @property {number} images
 * @property {{ json: string, html: string, data: string } | null} result
 * @property {string} error
 * @property {HTMLButtonElement} button
 */

/** @type {Picture[]} */ const pictures = [];
/** @type {Picture | null} */ let chosen = null;
/** @type {Picture | null} */ let running = null;
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

const tellStage = (stage, share) => {
  const at = STAGES.findIndex(([name]) => name === stage);
  if (at < 0) return;
  const isDone = share >= 1;
  [...byId("stages").children].forEach((item, place) => {
    item.className = place < at || (place === at && isDone) ? "is-done" : place === at || (isDone && place === at + 1) ? "is-now" : "";
  });
  byId("done").value = (at + share) / STAGES.length;
};

const key = ({ number, options, equipment }) => {
  const files = Object.entries(equipment).map(([name, file]) => [name, file.name, file.size, file.lastModified]);
  return JSON.stringify([number, options, files]);
};

const markOf = { waits: "…", runs: "◌", done: "●", failed: "!" };
const label = (picture) => {
  const report = picture.result && JSON.parse(picture.result.json);
  const state = { waits: "waits", runs: "is being solved", failed: "could not be solved", done: report?.status === "identified" ? "identified" : "not identified" }[picture.state];
  const mark = report && report.status !== "identified" ? "○" : markOf[picture.state];
  picture.button.replaceChildren(Object.assign(document.createElement("span"), { className: "mark", textContent: mark, ariaHidden: "true" }), picture.file.name);
  picture.button.setAttribute("aria-label", `${picture.file.name}, ${state}`);
  picture.button.setAttribute("aria-pressed", String(picture === chosen));
};

/** @param {Iterable<File>} files */
const add = (files) => {
  for (const file of files) {
    const button = document.createElement("button");
    button.type = "button";
    /** @type {Picture} */
    const picture = { file, number: pictures.length, state: "waits", options: stated(true), equipment: equipment(), images: 1, result: null, error: "", button };
    button.addEventListener("click", () => choose(picture));
    const item = document.createElement("li");
    item.appendChild(button);
    byId("queue").appendChild(item);
    pictures.push(picture);
    label(picture);
    countImages(picture);
    if (!running && pictures.every((one) => one === picture || one.state !== "waits")) choose(picture);
  }
  next();
};

const choose = (picture) => {
  chosen = picture;
  pictures.forEach(label);
  byId("again").disabled = false;
  byId("answer").replaceChildren();
  byId("preview").hidden = true;
  showImages(picture);
  if (picture.result) showResult(picture);
  else showPreview(picture);
  if (picture.state === "failed") tell(picture.error, true);
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
  const show = (blob) => {
    if (chosen !== picture || picture.result) return;
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(blob);
    byId("preview").hidden = false;
  };
  if (SHOWN_BY_BROWSER.test(picture.file.name)) return show(picture.file);
  try {
    show(new Blob([await scout.call("preview", picture.file, JSON.parse(picture.options).image)], { type: "image/jpeg" }));
  } catch { /* the solution tells why */ }
};

const next = async () => {
  if (running) return;
  const picture = pictures.find((one) => one.state === "waits");
  if (!picture) return;
  running = picture;
  picture.state = "runs";
  label(picture);
  byId("cancel").hidden = false;
  byId("work").setAttribute("aria-busy", "true");
  tell(isReady ? `${picture.file.name} is being solved.` : "The catalog of stars is being prepared.");
  try {
    if (!wasReady) glance(picture);
    const givenUp = new Promise((_, reject) => { giveUp = () => reject(new Stopped("stopped")); });
    await Promise.race([engine.call("prepare"), givenUp]);
    isReady = wasReady = true;
    tell(`${picture.file.name} is being solved.`);
    picture.result = await engine.call("solve", key(picture), picture.file, picture.options, picture.equipment);
    picture.state = "done";
    tell(`${picture.file.name} is done.`);
  } catch (error) {
    picture.state = "failed";
    picture.error = error instanceof Stopped ? `${picture.file.name} was canceled.` : error.message;
    isReady = !(error instanceof Stopped) && isReady;
    tell(picture.error, true);
  }
  running = null;
  byId("cancel").hidden = true;
  byId("work").removeAttribute("aria-busy");
  label(picture);
  if (picture === chosen && picture.result) showResult(picture);
  next();
};

/** What the bright stars alone say, until the catalog is here. */
const glance = async (picture) => {
  try {
    const report = JSON.parse(await scout.call("glance", picture.file, picture.options, picture.equipment));
    if (picture !== running || isReady || report.status !== "identified") return;
    tell(`The bright stars alone say: ${direction(report.attitude)}. The catalog of stars is being prepared for the full answer.`);
  } catch { /* the full search tells why */ }
};

/** The field's centre in words. */
const direction = ({ ra_deg, dec_deg }) => {
  const minutes = Math.round(ra_deg * 4) % 1440;
  return `right ascension ${Math.floor(minutes / 60)}\u00a0h ${minutes % 60}\u00a0min, declination ${dec_deg.toFixed(1).replace("-", "−")}°`;
};

/** The answer in a sentence. */
const sentence = (report) => {
  if (report.status !== "identified") return `The stars of ${report.frame} are not identified${report.reason ? `: ${report.reason}` : ""}.`;
  const { attitude, optics, match } = report;
  const named = report.stars.filter((star) => star.name).sort((a, b) => a.vmag - b.vmag)[0];
  const field = optics.fov_x_deg && optics.fov_y_deg ? `${optics.fov_x_deg.toFixed(2)}° × ${optics.fov_y_deg.toFixed(2)}°` : "a wide part";
  const brightest = named ? ` The brightest star with a name is ${named.name} (V\u00a0${named.vmag.toFixed(2)}).` : "";
  return `${report.frame} shows ${field} of the sky around ${direction(attitude)}: ${match.matched} stars are identified, the faintest of V\u00a0${report.magnitude.faintest_vmag.toFixed(1)}.${brightest}`;
};

const showResult = (picture) => {
  const report = JSON.parse(picture.result.json);
  byId("preview").hidden = true;
  const answer = byId("answer");
  answer.replaceChildren();
  const say = document.createElement("p");
  say.className = "say";
  say.textContent = sentence(report);
  answer.append(say, report.status === "identified" ? downloads(picture, report) : remedies(picture, report));
  const view = document.createElement("div");
  view.className = "frame";
  // Names are escaped where the elements are made.
  view.innerHTML = picture.result.html;
  // The sentence has the reason already.
  if (report.status !== "identified") view.querySelector(".answer")?.remove();
  answer.append(view);
  showFrame(view, JSON.parse(picture.result.data));
  const took = `${(report.timing_ms.total / 1000).toFixed(2)} s`;
  tell(report.status === "identified" ? `${picture.file.name} is solved, in ${took}.` : `${picture.file.name} has no answer, after ${took}.`);
};

const actions = (name, items) => {
  const group = document.createElement("div");
  group.className = "downloads";
  group.setAttribute("role", "group");
  group.setAttribute("aria-label", name);
  for (const [text, act] of items) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.addEventListener("click", act);
    group.appendChild(button);
  }
  return group;
};

const save = (blob, name) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
};

/** The layers of the sky that are shown are those of the annotated picture. */
const layers = () => {
  const isOn = (name) => document.querySelector(`#answer [data-layer="${name}"]:checked`) !== null;
  return JSON.stringify({
    all_rings: isOn("unidentified"), constellations: isOn("constellations"), deep_sky: isOn("deepsky"),
    equatorial: isOn("equatorial"), horizontal: isOn("horizontal"),
  });
};

const downloads = (picture, report) => {
  const stem = picture.file.name.replace(/(\.fits)?\.[^.]*$/i, "");
  const draw = async (kind, type, extension) => {
    try {
      const made = await engine.call("draw", key(picture), picture.file, picture.options, picture.equipment, kind, layers());
      save(new Blob([made], { type }), `${stem}.${extension}`);
    } catch (error) {
      tell(error.message, true);
    }
  };
  const all = [
    ["Annotated picture (PNG)", () => draw("overlay", "image/png", "annotated.png")],
    ["Page (HTML)", () => draw("html", "text/html", "html")],
    ["Stars (CSV)", () => draw("csv", "text/csv", "csv")],
    ["Report (JSON)", () => save(new Blob([`${picture.result.json}\n`], { type: "application/json" }), `${stem}.json`)],
  ];
  if (report.status === "identified") all.push(["Coordinates (FITS header)", () => draw("wcs", "application/fits", "wcs")]);
  return actions("Downloads", all);
};

const remedies = (picture, report) => {
  const known = report.remedies.filter((name) => REMEDIES[name]);
  const group = document.createElement("div");
  if (known.length) {
    const words = document.createElement("p");
    words.textContent = "What may help:";
    group.append(words, actions("What may help", known.map((name) => {
      const [field, text] = REMEDIES[name];
      return [text, () => {
        byId("hints").open = true;
        byId(field).focus();
        byId(field).scrollIntoView({ block: "center" });
      }];
    })));
  }
  group.append(downloads(picture, report));
  return group;
};

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
  byId("cancel").addEventListener("click", () => {
    if (isReady) engine.stop();
    else giveUp();
    scout.stop();
  });
  byId("hint-form").addEventListener("submit", (event) => {
    event.preventDefault();
    if (!chosen || chosen.state === "runs") return;
    Object.assign(chosen, { state: "waits", options: stated(), equipment: equipment(), result: null, error: "" });
    choose(chosen);
    next();
  });
  engine.call("version").then((version) => { byId("version").textContent = version; }, (error) => tell(error.message, true));
  return engine.call("prepare").then(() => {
    isReady = wasReady = true;
    if (!running) tell("Ready for your picture.");
  }, (error) => { if (!(error instanceof Stopped)) tell(error.message, true); });
};
