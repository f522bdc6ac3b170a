// The answer of a picture, in words and buttons.
import { byId } from "./dom.js";

/** What a remedy of the report leads to: the field of the form, and the words of its button. */
const REMEDIES = {
  fov: ["fov", "Enter the width of the field"],
  pixel_scale: ["pixel_scale", "Enter the pixel scale"],
  near: ["near", "Enter the approximate direction"],
  radius: ["radius", "Enter the search radius"],
  date: ["date", "Enter the date"],
  sigma: ["sigma", "Change the detection threshold"],
  time_limit: ["thorough", "Search longer"],
};
/** The camera whose pixels a link to the camera's model starts from. */
const LINKED = { preset: "imx174-35mm", pixel_um: 5.86 };
/** The model's largest distance from the zenith. */
const LOWEST_DEG = 85;

/** The field's center in words. */
export const direction = ({ ra_deg, dec_deg }) => {
  const minutes = Math.round(ra_deg * 4) % 1440;
  return `right ascension ${Math.floor(minutes / 60)}\u00a0h ${minutes % 60}\u00a0min, declination ${dec_deg.toFixed(1).replace("-", "−")}°`;
};

/** The answer in a sentence. */
export const sentence = (report) => {
  if (report.status !== "identified") return `The stars of ${report.frame} are not identified${report.reason ? `: ${report.reason}` : ""}.`;
  if (report.sentence) return report.sentence;
  const { attitude, optics, match } = report;
  const named = report.stars.filter((star) => star.name).sort((a, b) => a.vmag - b.vmag)[0];
  const field = optics.fov_x_deg && optics.fov_y_deg ? `${optics.fov_x_deg.toFixed(2)}° × ${optics.fov_y_deg.toFixed(2)}°` : "a wide part";
  const brightest = named ? ` The brightest star with a name is ${named.name} (V\u00a0${named.vmag.toFixed(2)}).` : "";
  return `${report.frame} shows ${field} of the sky around ${direction(attitude)}: ${match.matched} stars are identified, the faintest of V\u00a0${report.magnitude.faintest_vmag.toFixed(1)}.${brightest}`;
};

/** The address of the camera's model with what the picture tells of its camera. */
export const cameraLink = (report) => {
  const settings = new URLSearchParams({ preset: LINKED.preset });
  const set = (name, value) => { if (Number.isFinite(value)) settings.set(name, String(Number(value.toPrecision(4)))); };
  if (report.optics?.focal_length_px) set("focal_length_mm", (report.optics.focal_length_px * LINKED.pixel_um) / 1000);
  set("exposure_s", report.exposure_s ?? NaN);
  set("sky_mag_arcsec2", report.sky?.zenith?.mag_arcsec2 ?? NaN);
  const altitude = report.observation?.altitude_deg ?? NaN;
  if (altitude >= 90 - LOWEST_DEG) set("zenith_distance_deg", 90 - altitude);
  return new URL(`#limit?${settings}`, location.href).href;
};

/** @param {string} name @param {[string, (button: HTMLButtonElement) => unknown][]} items */
export const actions = (name, items) => {
  const group = document.createElement("div");
  group.className = "downloads";
  group.setAttribute("role", "group");
  group.setAttribute("aria-label", name);
  for (const [text, act] of items) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.addEventListener("click", () => act(button));
    group.appendChild(button);
  }
  return group;
};

/** Leads to the fields that may help. @param {string[]} names */
export const remedies = (names) => {
  const group = document.createElement("div");
  const known = names.filter((name) => REMEDIES[name]);
  if (!known.length) return group;
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
  return group;
};

/** @param {Blob} blob @param {string} name */
export const save = (blob, name) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
};

/** Copies a link, or shows it where that is not permitted. @param {string} link @param {HTMLButtonElement} button */
export const copyLink = async (link, button) => {
  try {
    await navigator.clipboard.writeText(link);
    button.textContent = "Copied";
  } catch {
    location.href = link;
  }
};

/** Whether the browser shares pictures. */
export const canShare = () => {
  try {
    return navigator.canShare?.({ files: [new File([], "a.png", { type: "image/png" })] }) ?? false;
  } catch {
    return false;
  }
};
