// The thread that computes. Its first message is { module }, the program. A message { id, call, values } is answered by { id, value } or { id, error, isFatal };
// { stage, share } between them tells how far it is.
import { isTruncated, wholeRows } from "./cut.js";
import { NUMBERS, STARS } from "./files.js";
import { readable } from "./readable.js";
import { drawThere, solveThere } from "./server.js";
import init, * as starpipe from "./starpipe.js";

/** The browser's storage for the index of the catalog. */
const INDEX_CACHE = "index-of-starpipe";

const progress = (stage, share) => postMessage({ stage, share });
Object.assign(globalThis, { starpipeProgress: progress });
/** @type {(module: WebAssembly.Module) => void} */ let begin = () => {};
const ready = new Promise((done) => { begin = done; }).then((module) => init({ module_or_path: module }));

/** What `make` resolves to: made once, or again after it failed. @template T @param {() => Promise<T>} make */
const once = (make) => {
  /** @type {Promise<T> | null} */ let made = null;
  return () => (made ??= make().catch((error) => { made = null; throw error; }));
};

/**
 * The content of a file of the page that is compressed with gzip.
 * @param {{ name: string }} file
 * @param {(bytes: number) => void} onBytes
 */
const unpacked = async ({ name }, onBytes) => {
  const failed = (why) => new Error(`the catalog of stars could not be loaded: ${why}`);
  const response = await fetch(new URL(name, import.meta.url)).catch((error) => { throw failed(error.message); });
  if (!response.ok || !response.body) throw failed(`${response.status} ${response.statusText}`);
  const count = new TransformStream({
    transform(chunk, out) {
      onBytes(chunk.byteLength);
      out.enqueue(chunk);
    },
  });
  const content = response.body.pipeThrough(count).pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(content).arrayBuffer().catch((error) => { throw failed(error.message); }));
};

const openCatalog = once(async () => starpipe.open_catalog(await unpacked(STARS, () => {})));

/** The catalog, and the numbers of its stars. */
const openAll = once(async () => {
  let received = 0;
  const onBytes = (bytes) => {
    received += bytes;
    progress("catalog", Math.min(received / (STARS.bytes + NUMBERS.bytes), 1));
  };
  const [stars, numbers] = await Promise.all([STARS, NUMBERS].map((file) => unpacked(file, onBytes)));
  starpipe.open_catalog(stars);
  starpipe.open_numbers(numbers);
  progress("catalog", 1);
});

const keptIndex = async (name) => {
  try {
    const kept = await (await caches.open(INDEX_CACHE)).match(name);
    return kept && new Uint8Array(await kept.arrayBuffer());
  } catch {
    return undefined;
  }
};

/** Where the browser has no room for it, the index is built again at the next visit. */
const keepIndex = async (name, bytes) => {
  try {
    const cache = await caches.open(INDEX_CACHE);
    const old = (await cache.keys()).filter(({ url }) => !url.endsWith(`/${name}`));
    await Promise.all(old.map((request) => cache.delete(request)));
    await cache.put(name, new Response(bytes));
  } catch { /* as it was before */ }
};

/** The whole catalog, indexed. */
const openSolver = once(async () => {
  await openAll();
  const name = starpipe.index_name();
  const solver = new starpipe.Solver(await keptIndex(name));
  const built = solver.built_index();
  if (built) keepIndex(name, built);
  progress("index", 1);
  return solver;
});

/** The bright stars, indexed: within the module, and soon done. @type {starpipe.Solver | null} */
let brightSolver = null;
/** The frame that was solved last, and what it was solved from. */
let last = { key: "", solved: null, said: "" };

/** The message of what fails; nothing where it does not. @param {() => void} act */
const whyNot = (act) => {
  try {
    act();
    return "";
  } catch (error) {
    if (!(error instanceof Error) || error instanceof WebAssembly.RuntimeError) throw error;
    return error.message;
  }
};

/** @param {File} file */
const bytesOf = async (file) => new Uint8Array(await file.arrayBuffer());

/** @typedef {{ camera?: File, dark?: File, flat?: File }} EquipmentFiles */

/** @param {EquipmentFiles} files */
const equipmentOf = async ({ camera, dark, flat }) => {
  const [ofCamera, ofDark, ofFlat] = await Promise.all([camera, dark, flat].map(async (file) => file && new starpipe.GivenFile(file.name, await bytesOf(file))));
  return new starpipe.Equipment(ofCamera, ofDark, ofFlat);
};

/**
 * What `solve` makes of a file, and what is to be said of the file.
 * @template T @param {File} file @param {(bytes: Uint8Array) => T | Promise<T>} solve
 */
const solveFile = async (file, solve) => {
  const { bytes, said } = await readable(file);
  try {
    return { solved: await solve(bytes), said };
  } catch (error) {
    if (!isTruncated(error)) throw error;
    await ready;
    const part = wholeRows(bytes, (bytes) => whyNot(() => starpipe.preview(bytes, file.name)));
    if (!part) throw error;
    return { solved: await solve(part.bytes), said: `The file is cut off: this is the answer for its first ${part.rows} of ${part.height} rows.` };
  }
};

/**
 * The frame, and what is to be said of its file.
 * @param {starpipe.Solver} solver @param {File} file @param {string} options @param {EquipmentFiles} files
 */
const solveWith = async (solver, file, options, files) => {
  const equipment = await equipmentOf(files);
  try {
    return await solveFile(file, (bytes) => solver.solve(bytes, file.name, options, equipment));
  } finally {
    equipment.free();
  }
};

const solve = async (key, file, options, files) => {
  const solver = await openSolver();
  if (last.key !== key) {
    last.solved?.free();
    last = { key: "", solved: null, said: "" };
    last = { key, ...await solveWith(solver, file, options, files) };
  }
  return last;
};

const calls = {
  version: () => starpipe.version(),
  prepare: async () => { await openSolver(); },
  stars: openCatalog,
  images: async (file) => starpipe.image_count(await bytesOf(file)),
  preview: async (file, image) => starpipe.preview((await readable(file)).bytes, file.name, image),
  /** The report of a search among the bright stars alone. */
  glance: async (file, options, files) => {
    brightSolver ??= starpipe.Solver.of_bright_stars();
    const { solved } = await solveWith(brightSolver, file, options, files);
    const report = solved.json();
    solved.free();
    return report;
  },
  solve: async (key, file, options, files) => {
    const { solved, said } = await solve(key, file, options, files);
    const [html, data] = solved.view();
    return { json: solved.json(), html, data, said };
  },
  draw: async (key, file, options, files, kind, layers) => {
    const { solved } = await solve(key, file, options, files);
    return kind === "overlay" ? solved.overlay(layers) : solved[kind]();
  },
  limit: (stated) => starpipe.limit(stated),
  simulate: (stated, place) => {
    const frame = starpipe.simulate(stated, place);
    const [about, rgba] = [frame.about(), frame.rgba()];
    frame.free();
    return { about, rgba };
  },
  limitCurve: (stated, sweep) => starpipe.limit_curve(stated, sweep),
  parameters: () => starpipe.parameters(),
  defocus: (study) => starpipe.defocus(study),
};

/** What the server does: it needs no program here. */
const callsOfServer = {
  solveThere: async (file, options, key) => {
    const { solved, said } = await solveFile(file, (bytes) => solveThere(bytes, file.name, options, key));
    return { ...solved, said };
  },
  drawThere: async (file, options, key, kind, layers) => {
    const { solved } = await solveFile(file, (bytes) => drawThere(bytes, file.name, options, key, kind, layers));
    return solved;
  },
};

onmessage = async ({ data: { id, call, values, module } }) => {
  if (module) return begin(module);
  try {
    if (!(call in callsOfServer)) await ready;
    postMessage({ id, value: await (callsOfServer[call] ?? calls[call])(...values) });
  } catch (error) {
    // A trap leaves the module in an unknown state.
    const isFatal = error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
    let text = error.message;
    if (isFatal) {
      try { text = starpipe.latest_panic() ?? `the computation was aborted: ${text}`; } catch { /* nothing more is known */ }
    }
    postMessage({ id, error: text, isFatal });
  }
};
