// The program, loaded and compiled once for all threads of the page.
import { PROGRAM } from "./files.js";

/** @type {Promise<WebAssembly.Module> | null} */ let loading = null;
/** @type {Set<(stage: string, share: number) => void>} */ const listeners = new Set();
/** How much of it is here. */ let share = 0;
/** Bytes that are sent: most servers compress the file. */ let sentBytes = PROGRAM.packed;

/** Counts what arrives. @param {ReadableStream<Uint8Array>} body */
const count = async (body) => {
  const reader = body.getReader();
  let received = 0;
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    received += part.value.byteLength;
    share = Math.min(received / PROGRAM.bytes, 1);
    for (const listener of listeners) listener("program", share);
  }
};

const load = async () => {
  const failed = (why) => new Error(`the program could not be loaded: ${why}`);
  const response = await fetch(new URL(PROGRAM.name, import.meta.url)).catch((error) => { throw failed(error.message); });
  if (!response.ok || !response.body) throw failed(`${response.status} ${response.statusText}`);
  sentBytes = response.headers.has("content-encoding") ? PROGRAM.packed : PROGRAM.bytes;
  // The response itself is compiled: browsers keep the code of those alone.
  const copy = response.clone().body;
  if (copy) count(copy).catch(() => {});
  return WebAssembly.compileStreaming(response).catch((error) => { throw failed(error.message); });
};

/** @param {(stage: string, share: number) => void} onProgress */
export const program = (onProgress) => {
  listeners.add(onProgress);
  if (share) onProgress("program", share);
  return (loading ??= load().catch((error) => { loading = null; throw error; }));
};

/** The size of what is loaded at a stage, in bytes; 0 where nothing is. @param {string} stage @param {{ bytes: number }[]} catalogs */
export const bytesOf = (stage, catalogs) => (stage === "program" ? sentBytes : stage === "catalog" ? catalogs.reduce((sum, { bytes }) => sum + bytes, 0) : 0);
