// The server of this page, if it solves pictures: `starpipe serve`.

/** The header by which it is known. */
const SIGN = "starpipe";
/** A server that does not say so in this time is taken for one that only has the files. */
const PATIENCE_MS = 5000;
/** What the page draws, in the words of `starpipe process --draw`. */
const LAYERS = { constellations: "constellations", deep_sky: "deep-sky", equatorial: "grid", horizontal: "altaz-grid" };
/** What the page asks for, in the words of the server. */
const ANSWERS = { overlay: "png", html: "html", csv: "csv", wcs: "wcs" };

/** Whether the server of this page solves pictures, too. No file is asked for that other servers do not have. */
export const isSolving = () => {
  const asked = fetch("./", { method: "HEAD", cache: "no-store" }).then(({ headers }) => headers.get(SIGN) === "serve", () => false);
  const waited = new Promise((done) => { setTimeout(() => done(false), PATIENCE_MS); });
  return Promise.race([asked, waited]);
};

/** Whether an answer says that the server wants a key. @param {string} error */
export const wantsKey = (error) => /a key is needed/.test(error);

/** Why the server refuses a picture. @param {Response} response */
const whyRefused = async (response) => {
  const told = await response.json().then(({ error }) => error, () => "");
  if (!told) return `status ${response.status} ${response.statusText}`.trim();
  const wait = response.headers.get("retry-after");
  return wait ? `${told} (in ${wait} s)` : told;
};

/**
 * What the server answers to a picture.
 * @param {Record<string, string>} parameters
 * @param {Uint8Array} bytes
 * @param {string} key
 */
const post = async (parameters, bytes, key) => {
  const address = new URL("solve", import.meta.url);
  for (const [name, value] of Object.entries(parameters)) address.searchParams.set(name.replaceAll("_", "-"), value);
  const request = { method: "POST", body: new Blob([/** @type {BlobPart} */ (bytes)]), headers: key ? { authorization: `Bearer ${key}` } : {} };
  const response = await fetch(address, request).catch(() => {
    throw new Error("The server was not reached, or ended the connection. It may be switched off, or the picture may be too large for it.");
  });
  if (!response.ok) throw new Error(`The server did not solve the picture: ${await whyRefused(response)}.`);
  return response;
};

/** The hints of the page as parameters. @param {string} name @param {string} options */
const parametersOf = (name, options) => {
  const { image, ...hints } = JSON.parse(options);
  return image ? { ...hints, name, page: String(image) } : { ...hints, name };
};

/** The report and the view of a picture. @param {Uint8Array} bytes @param {string} name @param {string} options @param {string} key */
export const solveThere = async (bytes, name, options, key) => {
  const response = await post({ ...parametersOf(name, options), answer: "view" }, bytes, key);
  return response.json();
};

/**
 * A file that is made of a picture. The server keeps nothing: it solves the picture again.
 * @param {Uint8Array} bytes
 * @param {string} name
 * @param {string} options
 * @param {string} key
 * @param {string} kind
 * @param {string} layers
 */
export const drawThere = async (bytes, name, options, key, kind, layers) => {
  const parameters = { ...parametersOf(name, options), answer: ANSWERS[kind] };
  if (kind === "overlay") {
    const shown = JSON.parse(layers);
    parameters.rings = shown.all_rings ? "all" : "named";
    parameters.draw = Object.keys(LAYERS).filter((layer) => shown[layer]).map((layer) => LAYERS[layer]).join() || "none";
  }
  const response = await post(parameters, bytes, key);
  return response.arrayBuffer();
};
