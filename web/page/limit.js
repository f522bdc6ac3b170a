// The tab of the sensitivity model.
import { byId, factsOf, pathThrough } from "./dom.js";
import { Engine } from "./engine.js";
import { hideSky, setUpSky, showSky } from "./sky.js";
import { make, makeFigure } from "./views.js";

/**
 * @typedef {object} Slider
 * @property {string[]} names
 * @property {string} title
 * @property {[number, number]} ends
 * @property {boolean} log
 * @property {HTMLInputElement} [range]
 * @property {HTMLInputElement} [number]
 */

/** The sliders: parameters that one sets, title, ends, and whether its scale is logarithmic. @type {Slider[]} */
const SLIDERS = [
  { names: ["aperture_mm"], title: "Aperture (mm)", ends: [1, 1000], log: true },
  { names: ["focal_length_mm"], title: "Focal length (mm)", ends: [2, 4000], log: true },
  { names: ["pitch_x_um", "pitch_y_um"], title: "Pixel (µm)", ends: [1, 30], log: true },
  { names: ["quantum_efficiency"], title: "Quantum efficiency, the same at every wavelength", ends: [0.05, 1], log: false },
  { names: ["exposure_s"], title: "Exposure (s)", ends: [0.001, 300], log: true },
  { names: ["sky_mag_arcsec2"], title: "Sky (V mag / square arcsec)", ends: [14, 22.5], log: false },
  { names: ["zenith_distance_deg"], title: "Zenith distance (°)", ends: [0, 85], log: false },
  { names: ["extinction_mag_per_airmass"], title: "Extinction (mag / airmass)", ends: [0, 1], log: false },
  { names: ["motion_px"], title: "Smear during the exposure (px)", ends: [0, 30], log: false },
];
const STEPS = 1000, WAIT_MS = 120, CURVE_WAIT_MS = 300, CURVE_POINTS = 31, CURVE_REACH = 8;
const engine = new Engine(() => {});
/** @type {{ name: string, about: string, parameters: { name: string, value: number | null }[] }[]} */ let presets = [];
/** The values that differ from the preset, by parameter. @type {Record<string, number>} */ let values = {};
/** The part of the sky that was chosen; without one, that which fits the field. @type {string | undefined} */ let place;
/** @type {Promise<void> | null} */ let isSetUp = null;
let areStarsAsked = false;

/** @param {Slider} slider @param {number} step */
const valueAt = ({ ends: [low, high], log }, step) => {
  const share = step / STEPS;
  const value = log ? low * (high / low) ** share : low + (high - low) * share;
  return Number(value.toPrecision(3));
};
/** @param {Slider} slider @param {number} value */
const stepOf = ({ ends: [low, high], log }, value) => {
  const share = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.round(Math.min(Math.max(share, 0), 1) * STEPS);
};
const preset = () => byId("limit-preset").value;
const presetValue = (name) => presets.find((one) => one.name === preset())?.parameters.find((one) => one.name === name)?.value ?? null;
const stated = () => JSON.stringify({ preset: preset(), values });

const makeSliders = () => {
  for (const slider of SLIDERS) {
    const row = document.createElement("div");
    row.className = "slider";
    const [id, first] = [`limit-${slider.names[0]}`, slider.names[0]];
    const label = Object.assign(document.createElement("label"), { htmlFor: id, textContent: slider.title });
    slider.range = Object.assign(document.createElement("input"), { type: "range", min: "0", max: String(STEPS), id: `${id}-range` });
    slider.range.setAttribute("aria-label", slider.title);
    slider.number = Object.assign(document.createElement("input"), { type: "number", step: "any", id, name: first });
    const set = (value) => {
      for (const name of slider.names) values[name] = value;
      changed();
    };
    slider.range.addEventListener("input", () => {
      const value = valueAt(slider, Number(slider.range.value));
      slider.number.value = String(value);
      slider.range.setAttribute("aria-valuetext", String(value));
      set(value);
    });
    slider.number.addEventListener("input", () => {
      if (slider.number.value === "" || !Number.isFinite(slider.number.valueAsNumber)) return;
      slider.range.value = String(stepOf(slider, slider.number.valueAsNumber));
      set(slider.number.valueAsNumber);
    });
    row.append(label, slider.range, slider.number);
    byId("limit-sliders").appendChild(row);
  }
};

const fillSliders = () => {
  for (const slider of SLIDERS) {
    const value = values[slider.names[0]] ?? presetValue(slider.names[0]);
    slider.number.value = value === null ? "" : String(Number(value.toPrecision(6)));
    slider.number.placeholder = value === null ? "curve" : "";
    slider.range.value = String(value === null ? STEPS / 2 : stepOf(slider, value));
    slider.range.setAttribute("aria-valuetext", value === null ? "varies with wavelength, as in the preset" : String(value));
  }
};

let timer = 0;
const changed = () => {
  const settings = new URLSearchParams({ preset: preset(), ...Object.fromEntries(Object.entries(values).map(([k, v]) => [k, String(v)])) });
  if (place) settings.set("place", place);
  history.replaceState(null, "", `#limit?${settings}`);
  clearTimeout(timer);
  timer = setTimeout(predict, WAIT_MS);
};

/** The catalog, for the faintest star to be expected and the frame: the rest of the model needs none. */
const stars = async () => {
  try {
    await engine.call("stars");
    predict();
  } catch { /* that one number stays away, and faint stars */ }
};
const askForStars = () => { areStarsAsked ||= Boolean(stars()); };

let asked = 0;
const predict = async () => {
  const number = ++asked;
  try {
    const text = await engine.call("limit", stated());
    if (number !== asked) return;
    const row = JSON.parse(text);
    show(row);
    byId("limit-json").textContent = JSON.stringify(row, null, 1);
    await drawSky(number);
    // Not after the curves: those of smeared stars take seconds.
    askForStars();
    await drawCurves(row, number);
  } catch (error) {
    if (number !== asked) return;
    byId("limit-answer").textContent = error.message;
    hideSky("No simulated frame.");
    byId("limit-facts").replaceChildren();
    byId("limit-figures").replaceChildren();
    byId("limit-budget").tBodies[0].replaceChildren();
    byId("limit-json").textContent = "";
  }
};

const mag = (value) => (value === null || value === undefined ? "none" : `V ${value.toFixed(2)}`);
const short = (value) => String(Number(value.toPrecision(5)));

const show = (row) => {
  byId("limit-answer").textContent = `This camera detects half of the stars of ${mag(row.detector.limit50_vmag)}. For a star of ${mag(row.limit_vmag)}, the brightest pixel has a signal-to-noise ratio of ${short(row.snr)}.`;
  const facts = [
    ["50 % of stars detected at", mag(row.detector.limit50_vmag)], ["90 % of stars detected at", mag(row.detector.limit90_vmag)],
    ["Limit for the brightest pixel alone", mag(row.limit_vmag)], ["Signal of that star in the brightest pixel", `${short(row.star_e)} e`],
    ["Sky background per pixel", `${short(row.background_e)} e`], ["Noise of the brightest pixel", `${short(row.noise_e)} e`], ["Airmass", short(row.airmass)],
    ["Equations", row.reading === "paper" ? "as in the paper" : "physical"],
  ];
  if (row.faintest) facts.splice(3, 0, ["Expected faintest star in a field", `V ${row.faintest.mean_vmag.toFixed(2)} ± ${row.faintest.sigma_mag.toFixed(2)}`]);
  byId("limit-facts").replaceChildren(...factsOf(facts));
  const body = byId("limit-budget").tBodies[0];
  body.replaceChildren();
  for (const [name, value] of Object.entries(row.budget)) {
    if (typeof value !== "number") continue;
    const line = body.insertRow();
    line.insertCell().textContent = name;
    line.insertCell().textContent = short(value);
  }
};

const drawSky = async (number) => {
  if (number !== asked) return;
  try {
    const { about, rgba } = await engine.call("simulate", stated(), place);
    if (number === asked) showSky(JSON.parse(about), rgba);
  } catch (error) {
    if (number === asked) hideSky(error.message);
  }
};

const drawCurves = async (row, number) => {
  // Curves take longer than all else: while sliders move, the frame is not to wait for them.
  await new Promise((done) => setTimeout(done, CURVE_WAIT_MS));
  if (number !== asked) return;
  const drawn = [];
  for (const name of ["exposure_s", "aperture_mm"]) {
    const value = row.parameters[name];
    const sweep = { parameter: name, from: value / CURVE_REACH, to: value * CURVE_REACH, count: CURVE_POINTS, log: true };
    const rows = JSON.parse(await engine.call("limitCurve", stated(), JSON.stringify(sweep)));
    if (number !== asked) return;
    drawn.push([name, value, rows]);
  }
  const holder = document.createDocumentFragment();
  for (const [name, value, rows] of drawn) {
    const points = rows.map((one) => [Math.log10(one.swept.value), one.detector.limit50_vmag]).filter(([, v]) => v !== null);
    if (points.length < 2) continue;
    const slider = SLIDERS.find((one) => one.names[0] === name);
    const all = points.map(([, v]) => v);
    const plot = makeFigure(holder, `Magnitude at which half of the stars are detected, against ${slider.title.toLowerCase()}; dot: this camera`,
      [`log10 ${slider.title.toLowerCase()}`, points[0][0], points[points.length - 1][0]], ["V (mag)", Math.min(...all) - 0.2, Math.max(...all) + 0.2]);
    make(plot.svg, "path", { class: "line", d: pathThrough(plot, points) });
    if (row.detector.limit50_vmag !== null) make(plot.svg, "circle", { class: "point", cx: plot.x(Math.log10(value)), cy: plot.y(row.detector.limit50_vmag), r: 4 });
  }
  byId("limit-figures").replaceChildren(holder);
};

const setUp = async () => {
  presets = JSON.parse(await engine.call("parameters"));
  for (const { name, about } of presets) byId("limit-preset").appendChild(new Option(`${name}: ${about}`, name));
  makeSliders();
  byId("limit-preset").addEventListener("change", () => { values = {}; fillSliders(); changed(); });
  byId("limit-reset").addEventListener("click", () => { values = {}; place = undefined; fillSliders(); changed(); });
  byId("limit-link").addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(location.href);
      byId("limit-link").textContent = "Copied";
    } catch {
      byId("limit-link").textContent = "Copy the link from the address bar";
    }
  });
  setUpSky((chosen) => { place = chosen; changed(); });
  byId("limit-form").addEventListener("submit", (event) => event.preventDefault());
};

/** Shows the model with the settings of a link. @param {URLSearchParams} settings */
export const showLimit = async (settings) => {
  try {
    await (isSetUp ??= setUp());
  } catch (error) {
    byId("limit-answer").textContent = error.message;
    return;
  }
  const known = new Set(presets[0].parameters.map((one) => one.name));
  byId("limit-preset").value = presets.some((one) => one.name === settings.get("preset")) ? settings.get("preset") : "imx174-35mm";
  place = [...byId("limit-place").options].map((one) => one.value).find((one) => one === settings.get("place"));
  values = {};
  for (const [name, text] of settings) if (known.has(name) && text !== "" && Number.isFinite(Number(text))) values[name] = Number(text);
  fillSliders();
  await predict();
  askForStars();
};
