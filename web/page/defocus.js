// The tab of the radius of spots.
import { byId, factsOf, pathThrough } from "./dom.js";
import { Engine, Stopped } from "./engine.js";
import { make, makeFigure } from "./views.js";

const PAPER = "paper";
const engine = new Engine((_, share) => { byId("defocus-done").value = share; });
let isSetUp = null;

const numberIn = (id) => (byId(id).value === "" ? [] : [byId(id).valueAsNumber]);

const study = () => {
  const name = byId("defocus-preset").value;
  const count = byId("defocus-count").valueAsNumber || 100;
  const required_error_px = numberIn("defocus-required");
  if (name === PAPER) return { required_error_px, count };
  return { camera: { preset: name }, vmag: numberIn("defocus-vmag"), required_error_px, count };
};

const spot = (radius) => {
  const um = radius.radius_um === null ? "" : `, ${radius.radius_um.toFixed(2)} µm`;
  const out = radius.defocus_um === null ? "" : `, ${radius.defocus_um.toFixed(1)} µm out of focus`;
  return `${radius.radius_px.toFixed(2)} px${um}${out}`;
};

const run = async (event) => {
  event.preventDefault();
  const [start, cancel] = [byId("defocus-run"), byId("defocus-cancel")];
  start.disabled = true;
  cancel.hidden = false;
  byId("defocus-answer").textContent = "Measuring simulated stars.";
  try {
    const report = JSON.parse(await engine.call("defocus", JSON.stringify(study())));
    byId("defocus-json").textContent = JSON.stringify(report, null, 1);
    show(report);
  } catch (error) {
    byId("defocus-answer").textContent = error instanceof Stopped ? "Canceled." : error.message;
  }
  byId("defocus-done").value = 0;
  start.disabled = false;
  cancel.hidden = true;
};

const show = (report) => {
  const [star] = report.stars;
  const whose = star.vmag === null ? "Spots with the same brightest pixel" : `A star of V ${star.vmag}`;
  byId("defocus-answer").textContent = `${whose}: the centroid error is smallest, ${star.best.error_px.toFixed(4)} px, with a spot radius of ${spot(star.best)}.`;
  const facts = [["Radii with at most 5 % more error", `${star.best.nearly_px.map((px) => px.toFixed(2)).join(" to ")} px`]];
  for (const { required_error_px, smallest, largest } of star.required) {
    facts.push([`Error of ${required_error_px} px or less`, smallest ? `from ${spot(smallest)} to ${spot(largest)}` : "no radius"]);
  }
  if (star.present) facts.push(["This camera as described", `${spot(star.present)}: error ${star.present.error_px.toFixed(4)} px`]);
  byId("defocus-facts").replaceChildren(...factsOf(facts));
  draw(star);
};

const draw = (star) => {
  const holder = document.createDocumentFragment();
  const measured = star.curve.filter((row) => row.error_px !== null);
  const most = Math.max(...measured.map((row) => row.error_px)) * 1.05;
  const radii = measured.map((row) => row.radius_px);
  const plot = makeFigure(holder, "Centroid error against spot radius; dashed: Cramér-Rao bound", ["radius σ (px)", Math.min(...radii), Math.max(...radii)], ["error (px)", 0, most]);
  const path = (key, kind) => {
    const rows = measured.filter((row) => row[key] !== null && row[key] <= most);
    if (rows.length > 1) make(plot.svg, "path", { class: kind, d: pathThrough(plot, rows.map((row) => [row.radius_px, row[key]])) });
  };
  path("bound_px", "bound");
  path("smooth_error_px", "line");
  for (const row of measured) make(plot.svg, "circle", { class: "dot", cx: plot.x(row.radius_px), cy: plot.y(row.error_px), r: 2 });
  make(plot.svg, "circle", { class: "point", cx: plot.x(star.best.radius_px), cy: plot.y(star.best.error_px), r: 4 });
  const limits = star.curve.filter((row) => row.limit_vmag !== null);
  if (limits.length > 1) {
    const all = limits.map((row) => row.limit_vmag);
    const reach = makeFigure(holder, "Limiting magnitude against spot radius: half of the stars of this magnitude are detected", ["radius σ (px)", limits[0].radius_px, limits[limits.length - 1].radius_px], ["V (mag)", Math.min(...all) - 0.1, Math.max(...all) + 0.1]);
    make(reach.svg, "path", { class: "line", d: pathThrough(reach, limits.map((row) => [row.radius_px, row.limit_vmag])) });
  }
  byId("defocus-figures").replaceChildren(holder);
};

const setUp = async () => {
  const presets = JSON.parse(await engine.call("parameters"));
  for (const { name, about } of presets) byId("defocus-preset").appendChild(new Option(`${name}: ${about}`, name));
  byId("defocus-preset").appendChild(new Option("the experiment of Wang et al. 2019: spots with the same brightest pixel", PAPER));
  byId("defocus-preset").value = "nanosat-tracker";
  byId("defocus-form").addEventListener("submit", run);
  byId("defocus-cancel").addEventListener("click", () => engine.stop());
};

/** Shows the tab. */
export const showDefocus = async () => {
  try {
    await (isSetUp ??= setUp());
  } catch (error) {
    byId("defocus-answer").textContent = error.message;
  }
};
