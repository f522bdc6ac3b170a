// Keeps the files of the page for use without a network. The build fills in what they are: the name of the
// cache is the hash of all of them.
const CACHE = "CACHE-NAME";
const FILES = ["FILES"];

/** A file whose name has its hash is the same in every version: what is kept of it is not loaded again. */
const HAS_HASH = /-[0-9a-f]{16}\.bin$/;

const keep = async () => {
  const cache = await caches.open(CACHE);
  await Promise.all(FILES.map(async (file) => {
    const kept = HAS_HASH.test(file) && await caches.match(file);
    await (kept ? cache.put(file, kept) : cache.add(file));
  }));
  await skipWaiting();
};

addEventListener("install", (event) => event.waitUntil(keep()));
addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith("starpipe-") && name !== CACHE);
  event.waitUntil(caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))).then(() => clients.claim()));
});
addEventListener("fetch", (event) => {
  if (event.request.method !== "GET") return;
  event.respondWith(caches.match(event.request, { ignoreSearch: true, cacheName: CACHE }).then((kept) => kept ?? fetch(event.request)));
});
