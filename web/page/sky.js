// The simulated frame of the sensitivity model's tab.
import { byId } from "./dom.js";

/** Grey levels: as `web/src/simulated.rs` has them. */
const GREY = "Black is 3 noise standard deviations below the sky level, white is 12 above.";
/** The faintest stars that are all there: of the bright stars, and of the whole catalog. */
const BRIGHT_VMAG = 6.5, WHOLE_VMAG = 9;
const RING_PX = 9;

/**
 * @typedef {object} About
 * @property {string} place
 * @property {number} width_px
 * @property {number} height_px
 * @property {[number, number]} detector_px
 * @property {number} focal_length_px
 * @property {boolean} is_full
 * @property {boolean} is_whole_catalog
 * @property {number | null} faintest_vmag
 * @property {number} star_count
 * @property {number | null} limit50_vmag
 * @property {[number, number][]} brighter_px
 */

/** The frame that is shown. @type {{ about: About, image: ImageData } | null} */ let shown = null;

/** @param {number} count */
const stars = (count) => `${count} ${count === 1 ? "star" : "stars"}`;

/** @param {About} about */
const counted = ({ star_count, limit50_vmag, brighter_px, is_full }) => {
  const brighter = limit50_vmag === null ? "The camera has no limiting magnitude." : `${brighter_px.length} of them ${brighter_px.length === 1 ? "is" : "are"} brighter than the limit of V ${limit50_vmag.toFixed(2)}.`;
  return `${stars(star_count)} of the catalog ${star_count === 1 ? "is" : "are"} drawn. ${brighter}${is_full ? " The sky background alone saturates the pixels, so no star can be seen; the limit does not account for this." : ""}`;
};

/** @param {About} about */
const caption = (about) => {
  const { width_px, height_px, detector_px: [width, height], focal_length_px, is_whole_catalog, limit50_vmag } = about;
  const degrees = (px) => ((360 / Math.PI) * Math.atan(px / 2 / focal_length_px)).toPrecision(2);
  const size = `${width_px} × ${height_px} pixels, ${degrees(width_px)}° × ${degrees(height_px)}°`;
  const isPart = width_px < width || height_px < height;
  const said = [isPart ? `The middle of the frame: ${size}, of ${width} × ${height} pixels.` : `The whole frame: ${size}.`, counted(about)];
  const complete = is_whole_catalog ? WHOLE_VMAG : BRIGHT_VMAG;
  if (limit50_vmag > complete) said.push(is_whole_catalog ? `The limit is fainter than the catalog: beyond V ${complete} many stars are missing.` : `Stars fainter than V ${complete} are drawn once the catalog is loaded.`);
  if (about.faintest_vmag !== null) said.push(`Stars fainter than V ${about.faintest_vmag.toFixed(1)} are not drawn: there are too many to simulate quickly.`);
  said.push(GREY);
  return said.join(" ");
};

const paint = () => {
  const canvas = byId("limit-sky"), pen = canvas.getContext("2d");
  if (!shown) {
    pen.clearRect(0, 0, canvas.width, canvas.height);
    return;
  }
  const { about, image } = shown;
  // To set a size clears the canvas, even if it is the same.
  [canvas.width, canvas.height] = [about.width_px, about.height_px];
  pen.putImageData(image, 0, 0);
  if (!byId("limit-rings").checked) return;
  pen.strokeStyle = "#6bb8ff";
  for (const [x, y] of about.brighter_px) {
    pen.beginPath();
    // (0, 0) is the middle of a pixel.
    pen.arc(x + 0.5, y + 0.5, RING_PX, 0, 2 * Math.PI);
    pen.stroke();
  }
};

/** Shows a frame. @param {About} about @param {Uint8Array} rgba */
export const showSky = (about, rgba) => {
  shown = { about, image: new ImageData(new Uint8ClampedArray(rgba), about.width_px, about.height_px) };
  const place = byId("limit-place");
  place.value = about.place;
  byId("limit-seen").textContent = caption(about);
  byId("limit-sky").setAttribute("aria-label", `A simulated frame of ${place.selectedOptions[0].text}. ${counted(about)}`);
  paint();
};

/** Shows none. @param {string} why */
export const hideSky = (why) => {
  shown = null;
  byId("limit-seen").textContent = why;
  byId("limit-sky").setAttribute("aria-label", "No simulated frame");
  paint();
};

/** @param {(place: string) => void} onPlace */
export const setUpSky = (onPlace) => {
  byId("limit-place").addEventListener("change", () => onPlace(byId("limit-place").value));
  byId("limit-rings").addEventListener("change", paint);
};
