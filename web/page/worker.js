// The thread that computes. A message { id, call, values } is answered by { id, value } or { id, error, isFatal };
// { stage, share } between them tells how far it is.
import init, * as starpipe from "./starpipe.js";

globalThis.starpipeProgress = (stage, share) => postMessage({ stage, share });
const ready = init({ module_or_path: new URL("starpipe_bg.wasm", import.meta.url) });
let solver;
/** The frame that was solved last, and what it was solved from. */
let last = { key: "", solved: null };

const solverOf = () => (solver ??= new starpipe.Solver());

const solve = (key, bytes, name, options) => {
  if (last.key !== key) {
    last.solved?.free();
    last = { key: "", solved: null };
    last = { key, solved: solverOf().solve(new Uint8Array(bytes), name, options) };
  }
  return last.solved;
};

const calls = {
  version: () => starpipe.version(),
  prepare: () => { solverOf(); },
  preview: (bytes, name) => starpipe.preview(new Uint8Array(bytes), name),
  solve: (key, bytes, name, options) => {
    const solved = solve(key, bytes, name, options);
    const [html, data] = solved.view();
    return { json: solved.json(), html, data };
  },
  draw: (key, bytes, name, options, kind, layers) => {
    const solved = solve(key, bytes, name, options);
    return kind === "overlay" ? solved.overlay(layers) : solved[kind]();
  },
  limit: (stated) => starpipe.limit(stated),
  limitCurve: (stated, sweep) => starpipe.limit_curve(stated, sweep),
  parameters: () => starpipe.parameters(),
  defocus: (study) => starpipe.defocus(study),
};

onmessage = async ({ data: { id, call, values } }) => {
  try {
    await ready;
    postMessage({ id, value: calls[call](...values) });
  } catch (error) {
    // A trap leaves the module in an unknown state.
    const isFatal = error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
    let text = error.message;
    if (isFatal) {
      try { text = starpipe.latest_panic() ?? `the computation was ended: ${text}`; } catch { /* nothing more is known */ }
    }
    postMessage({ id, error: text, isFatal });
  }
};
