// Pictures and answers in the browser's storage, so that a reload keeps them. Where it has no room, or gives none, the
// page works without.

const NAME = "starpipe", VERSION = 1;

/** @template T @param {IDBRequest<T>} request @returns {Promise<T>} */
const resultOf = (request) => new Promise((done, fail) => {
  request.onsuccess = () => done(request.result);
  request.onerror = () => fail(request.error);
});

/** @type {Promise<IDBDatabase> | null} */ let opened = null;
const open = () => (opened ??= new Promise((done, fail) => {
  const request = indexedDB.open(NAME, VERSION);
  request.onupgradeneeded = () => {
    request.result.createObjectStore("pictures", { keyPath: "id" });
    request.result.createObjectStore("answers");
  };
  request.onsuccess = () => done(request.result);
  request.onerror = () => fail(request.error);
  request.onblocked = () => fail(new Error("blocked"));
}));

/**
 * What `act` asks of a store; undefined where there is no storage.
 * @template T
 * @param {"pictures" | "answers"} name
 * @param {IDBTransactionMode} mode
 * @param {(store: IDBObjectStore) => IDBRequest<T>} act
 * @returns {Promise<T | undefined>}
 */
const ask = async (name, mode, act) => {
  try {
    const transaction = (await open()).transaction(name, mode);
    const ended = new Promise((done, fail) => {
      transaction.oncomplete = () => done(undefined);
      transaction.onabort = () => fail(transaction.error);
    });
    const [value] = await Promise.all([resultOf(act(transaction.objectStore(name))), ended]);
    return value;
  } catch {
    return undefined;
  }
};

/** Whether it is kept. @param {{ id: number } & Record<string, unknown>} picture */
export const keepPicture = async (picture) => (await ask("pictures", "readwrite", (store) => store.put(picture))) !== undefined;
export const keptPictures = async () => (await ask("pictures", "readonly", (store) => store.getAll())) ?? [];
/** @param {number} id @param {unknown} answer */
export const keepAnswer = async (id, answer) => (await ask("answers", "readwrite", (store) => store.put(answer, id))) !== undefined;
/** @param {number} id */
export const keptAnswer = (id) => ask("answers", "readonly", (store) => store.get(id));
export const clearAll = () => Promise.all(["pictures", "answers"].map((name) => ask(/** @type {"pictures" | "answers"} */ (name), "readwrite", (store) => store.clear())));
