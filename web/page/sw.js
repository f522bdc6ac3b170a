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

/** Where the page finds what another app shares with it. */
const SHARED_CACHE = "shared-with-starpipe";

/** Keeps the files of a form that another app sends, and shows the page. @param {Request} request */
const takeShared = async (request) => {
  const cache = await caches.open(SHARED_CACHE);
  const files = (await request.formData()).getAll("pictures").filter((file) => file instanceof File);
  await Promise.all(files.map((file, at) => cache.put(`shared/${at}/${encodeURIComponent(file.name)}`, new Response(file))));
  return Response.redirect("./?shared", 303);
};

addEventListener("install", (event) => event.waitUntil(keep()));
addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith("starpipe-") && name !== CACHE);
  event.waitUntil(caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))).then(() => clients.claim()));
});
addEventListener("fetch", (event) => {
  if (event.request.method === "POST" && new URL(event.request.url).pathname.endsWith("/share")) return event.respondWith(takeShared(event.request));
  // The page asks so whether its server solves pictures. None does without a network: a failure would be an error in the log.
  if (event.request.method === "HEAD") return event.respondWith(fetch(event.request).catch(() => new Response()));
  if (event.request.method !== "GET") return;
  event.respondWith(caches.match(event.request, { ignoreSearch: true, cacheName: CACHE }).then((kept) => kept ?? fetch(event.request)));
});
