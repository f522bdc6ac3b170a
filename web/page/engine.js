import { program } from "./program.js";

/** What a call ends with that was stopped. */
export class Stopped extends Error {}

/** A thread that computes one call after the other, and can be stopped. */
export class Engine {
  /** @type {Worker | null} */ #worker = null;
  /** @type {Map<number, { resolve: (value: any) => void, reject: (error: Error) => void }>} */ #open = new Map();
  #next = 0;
  /** @type {(stage: string, share: number) => void} */ #onProgress;

  /** @param {(stage: string, share: number) => void} onProgress */
  constructor(onProgress) {
    this.#onProgress = onProgress;
  }

  /**
   * @param {string} call
   * @param {unknown[]} values
   * @returns {Promise<any>}
   */
  call(call, ...values) {
    this.#worker ??= this.#start();
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#open.set(id, { resolve, reject });
      this.#worker?.postMessage({ id, call, values });
    });
  }

  /** Ends what runs. The next call begins with a new thread. */
  stop() {
    this.#end(new Stopped("stopped"));
  }

  /** @param {Error} error */
  #end(error) {
    this.#worker?.terminate();
    this.#worker = null;
    const open = [...this.#open.values()];
    this.#open.clear();
    for (const { reject } of open) reject(error);
  }

  #start() {
    const worker = new Worker("worker.js", { type: "module" });
    worker.addEventListener("message", ({ data }) => {
      if (data.stage !== undefined) {
        this.#onProgress(data.stage, data.share);
        return;
      }
      const waiting = this.#open.get(data.id);
      this.#open.delete(data.id);
      if (data.error === undefined) waiting?.resolve(data.value);
      else waiting?.reject(new Error(data.error));
      if (data.isFatal) this.#end(new Error(data.error));
    });
    program(this.#onProgress).then((module) => worker.postMessage({ module }), (error) => { if (worker === this.#worker) this.#end(error); });
    worker.addEventListener("error", (event) => this.#end(new Error(event.message || "the thread could not be started")));
    return worker;
  }
}
