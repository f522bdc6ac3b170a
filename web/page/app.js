import { showDefocus } from "./defocus.js";
import { byId } from "./dom.js";
import { showLimit } from "./limit.js";
import { photo } from "./photo.js";

const TABS = ["photo", "limit", "defocus"];

/** What follows a # in the address: the tab, and its settings. */
const place = () => {
  const [tab, settings = ""] = location.hash.slice(1).split("?");
  return { tab: TABS.includes(tab) ? tab : "photo", settings: new URLSearchParams(settings) };
};

const show = () => {
  const { tab, settings } = place();
  for (const name of TABS) {
    const button = byId(`tab-${name}`);
    button.setAttribute("aria-selected", String(name === tab));
    button.tabIndex = name === tab ? 0 : -1;
    byId(name).hidden = name !== tab;
  }
  if (tab === "limit") showLimit(settings);
  if (tab === "defocus") showDefocus();
};

for (const [at, name] of TABS.entries()) {
  byId(`tab-${name}`).addEventListener("click", () => { location.hash = name; });
  byId(`tab-${name}`).addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const next = TABS[(at + step + TABS.length) % TABS.length];
    location.hash = next;
    byId(`tab-${next}`).focus();
  });
}
addEventListener("hashchange", show);
show();
const prepared = photo();

// It loads all files once more, most of them from the browser's cache: what the visitor waits for comes first.
if ("serviceWorker" in navigator) {
  /** Fails where there is no room for the files. @param {ServiceWorkerRegistration} registration */
  const refused = ({ installing }) => new Promise((_, fail) => {
    installing?.addEventListener("statechange", () => { if (installing.state === "redundant") fail(new Error("no room")); });
  });
  prepared.then(() => navigator.serviceWorker.register("sw.js")).then((found) => Promise.race([navigator.serviceWorker.ready, refused(found)])).then(
    () => { byId("offline").textContent = "Ready to work offline."; },
    () => { byId("offline").textContent = "This browser does not store the page for offline use."; },
  );
}
