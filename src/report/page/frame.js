// What a star is called.
const titleOf = (star) => star.label || (star.kind === "other" ? "Not a star" : "Not identified");

// A small card beside the star that was chosen.
const makeCard = (card, view, onClose) => {
  let star = null;
  const add = (parent, tag, text) => parent.appendChild(Object.assign(document.createElement(tag), { textContent: text }));
  const fixed = (value, decimals) => value.toFixed(decimals).replace("-", "−");
  const linesOf = (star) => [
    star.name === star.label ? "" : star.name,
    star.v === undefined ? "" : `V ${fixed(star.v, 2)}`,
    star.why && `Not measured: ${star.why}`,
    star.ra === undefined ? "" : `RA ${fixed(star.ra, 3)}°, Dec ${fixed(star.dec, 3)}°`,
    [star.id, star.hd && `HD ${star.hd}`, star.hip && `HIP ${star.hip}`].filter(Boolean).join(", "),
    star.kind === "identified" && star.snr !== undefined ? `Signal to noise ${star.snr}` : "",
    star.flags.join(", ").replaceAll("_", " "),
  ];
  const hide = () => { star = null; card.hidden = true; };
  // Below the star, or above where there is no room; it may leave the picture, but not its width.
  const place = () => {
    if (!star) return;
    const GAP = 18;
    const at = new DOMPoint(star.x, star.y).matrixTransform(view.getScreenCTM()), frame = view.getBoundingClientRect();
    const [x, y] = [at.x - frame.left, at.y - frame.top];
    card.hidden = x < 0 || y < 0 || x > frame.width || y > frame.height;
    if (card.hidden) return;
    const left = Math.min(Math.max(x - card.offsetWidth / 2, 4), Math.max(frame.width - card.offsetWidth - 4, 4));
    const isAbove = y > frame.height / 2 && at.y > card.offsetHeight + GAP;
    card.style.left = `${left}px`;
    card.style.top = `${isAbove ? y - GAP - card.offsetHeight : y + GAP}px`;
  };
  const show = (chosen) => {
    star = chosen;
    card.replaceChildren();
    add(card, "b", titleOf(star));
    const close = add(card, "button", "×");
    close.type = "button";
    close.setAttribute("aria-label", "Close");
    close.addEventListener("click", onClose);
    for (const line of linesOf(star)) if (line) add(card, "p", line);
    card.hidden = false;
    place();
  };
  card.addEventListener("keydown", (event) => { if (event.key === "Escape") onClose(); });
  return { show, hide, place };
};

// A map of the stars that covers a share of the photograph, from its left side. It is made when it is wanted.
const makeChart = (view, data, stars) => {
  const MOST = 800;
  const { width, height } = data;
  // An element of its own clips what leaves it.
  const chart = make(view, "svg", { x: -0.5, y: -0.5, height, class: "chart" });
  const edge = make(view, "path", { class: "edge" });
  let dots = [], share = 0, last = 1;
  const fill = () => {
    make(chart, "rect", { class: "back", x: -0.5, y: -0.5, width, height });
    const lines = data.sky.filter(({ key }) => key === "constellations").flatMap((layer) => layer.lines);
    for (const line of lines) make(chart, "path", { d: `M${line.map((at) => at.join(" ")).join("L")}` });
    const known = stars.filter(({ kind, v }) => v !== undefined && (kind === "identified" || kind === "unmeasured"));
    known.sort((a, b) => a.v - b.v);
    const brightest = known[0]?.v ?? 0;
    dots = known.slice(0, MOST).map(({ x, y, v }) => ({ node: make(chart, "circle", { cx: x, cy: y }), r: Math.max(4.5 - 0.75 * (v - brightest), 0.6) }));
  };
  const scale = (u) => {
    last = u;
    const small = view.clientWidth < 600 ? 0.7 : 1;
    if (share) for (const { node, r } of dots) node.setAttribute("r", r * u * small);
  };
  const show = (wanted) => {
    share = wanted;
    if (share && !dots.length) fill();
    const wide = share * width;
    chart.style.display = edge.style.display = share ? "" : "none";
    chart.setAttribute("width", wide);
    chart.setAttribute("viewBox", `-0.5 -0.5 ${Math.max(wide, 1e-3)} ${height}`);
    edge.setAttribute("d", `M${wide - 0.5} -0.5V${height - 0.5}`);
    scale(last);
  };
  show(0);
  return { show, scale };
};

// Brings the elements of a frame in `root` to life: picture, figures and table.
const showFrame = (root, data) => {
  const byId = (id) => root.querySelector(`#${id}`);
  const { width, height } = data;
  const columns = Object.entries(data.stars);
  const stars = data.stars.x.map((_, row) => {
    const given = columns.filter(([, values]) => values[row] !== null);
    return Object.fromEntries(given.map(([key, values]) => [key, values[row]]));
  });
  // What is known of them in words, and what was not measured.
  const annotations = data.annotations ?? [];
  const labels = new Map(annotations.filter(({ detection }) => Number.isInteger(detection)).map((it) => [it.detection, it.label]));
  const unlikeStars = new Set(data.unlike_stars);
  stars.forEach((star, index) => {
    star.index = index;
    star.kind = star.id ? "identified" : unlikeStars.has(index) ? "other" : "unidentified";
    star.label ??= labels.get(index);
    star.residual = star.dx === undefined ? undefined : Math.hypot(star.dx, star.dy);
  });
  const isPoint = ({ kind, detection, x, y }) => ["star", "body"].includes(kind) && !Number.isInteger(detection) && Number.isFinite(x) && Number.isFinite(y);
  const unmeasured = annotations.filter(isPoint).map((it) => ({
    kind: "unmeasured", x: it.x, y: it.y, name: it.name, label: it.label, v: it.vmag ?? undefined, id: it.id ?? undefined,
    why: it.why || "it was not detected", flags: [],
  }));
  const marked = [...stars, ...unmeasured];

  // The picture: the view box is what is seen of the frame, in its pixels.
  const view = byId("view");
  const layers = {};
  const chart = makeChart(view, data, marked);
  for (const { key, lines, circles, texts } of data.sky) {
    const layer = layers[key] = make(view, "g", { class: `sky ${key}` });
    for (const line of lines) make(layer, "path", { d: `M${line.map((at) => at.join(" ")).join("L")}` });
    for (const [cx, cy, r] of circles) make(layer, "circle", { cx, cy, r });
    for (const [text, [x, y]] of texts) make(layer, "text", { x, y }, text);
  }
  const skyTexts = view.querySelectorAll(".sky text");
  for (const name of ["other", "unidentified", "identified", "residuals", "names"]) layers[name] = make(view, "g");
  const box = { x: -0.5, y: -0.5, w: width, h: height };
  // Pixels of the frame in one of the screen.
  const unit = () => Math.max(box.w / Math.max(view.clientWidth, 1), box.h / Math.max(view.clientHeight, 1));
  const radius = (star) => {
    if (star.kind === "unmeasured") return 13;
    const above = star.flux > 0 ? 2.5 * Math.log10(star.flux / faintest) : 0;
    return Math.min(4 + Math.max(above, 0), 13);
  };
  const fluxes = stars.map((star) => star.flux).filter((flux) => flux > 0).sort((a, b) => a - b);
  const faintest = fluxes.length ? fluxes[Math.floor(fluxes.length * 0.2)] : 1;
  const residuals = stars.map((star) => star.residual).filter((r) => r !== undefined).sort((a, b) => a - b);
  const typical = residuals.length ? Math.max(residuals[Math.floor(residuals.length / 2)], 1e-3) : 1;
  for (const star of marked) {
    const tag = { identified: "circle", unmeasured: "circle", other: "path" }[star.kind] ?? "rect";
    star.shape = make(layers[star.kind] ?? layers.identified, tag, { class: `shape ${star.kind}` });
    if (star.residual !== undefined) star.arrow = make(layers.residuals, "path", { class: "arrow" });
  }
  let chosen = null;
  const placeShapes = () => {
    const u = unit();
    const ringed = ringedStars();
    for (const star of marked) {
      const { x, y, shape } = star;
      const r = radius(star) * u;
      if (star.kind === "identified") shape.style.visibility = star === chosen || ringed.has(star) ? "" : "hidden";
      if (star.kind === "identified" || star.kind === "unmeasured") {
        shape.setAttribute("cx", x); shape.setAttribute("cy", y); shape.setAttribute("r", r);
      } else if (star.kind === "other") {
        shape.setAttribute("d", `M${x - r} ${y - r}l${2 * r} ${2 * r}m${-2 * r} 0l${2 * r} ${-2 * r}`);
      } else {
        shape.setAttribute("x", x - r); shape.setAttribute("y", y - r); shape.setAttribute("width", 2 * r); shape.setAttribute("height", 2 * r);
      }
      if (star.arrow) {
        const k = 18 * u / typical, n = Math.max(star.residual, 1e-9), b = 4 * u / n;
        const ex = x + star.dx * k, ey = y + star.dy * k;
        star.arrow.setAttribute("d", `M${x} ${y}L${ex} ${ey}l${(-star.dx - star.dy * 0.6) * b} ${(-star.dy + star.dx * 0.6) * b}M${ex} ${ey}l${(-star.dx + star.dy * 0.6) * b} ${(-star.dy - star.dx * 0.6) * b}`);
      }
    }
    for (const node of skyTexts) { node.setAttribute("font-size", 12 * u); node.setAttribute("stroke-width", 3 * u); }
    placeNames(u, ringed);
    chart.scale(u);
    card.place();
  };
  const isInView = ({ x, y }) => x > box.x && x < box.x + box.w && y > box.y && y < box.y + box.h;
  // Few rings leave the picture to be seen: the brightest in view, so that there are more closer up.
  const ringedStars = () => {
    const [areaPerRing, most] = byId("all-rings")?.checked ? [900, Infinity] : [9000, 40];
    const count = Math.min(Math.ceil(view.clientWidth * view.clientHeight / areaPerRing), most);
    const inView = marked.filter((star) => isInView(star) && (star.kind === "identified" || star.kind === "unmeasured"));
    inView.sort((a, b) => (a.v ?? 99) - (b.v ?? 99));
    return new Set(inView.slice(0, count));
  };
  // The brightest stars in view, where there is room.
  const byMagnitude = marked.filter((star) => star.label).sort((a, b) => (a.v ?? 99) - (b.v ?? 99));
  const placeNames = (u, ringed) => {
    const MOST = 60, SIZE = 12;
    layers.names.replaceChildren();
    const roomOf = (x, y, text) => [x, y - SIZE * u, x + text.length * SIZE * 0.6 * u, y + 3 * u];
    const skyNames = [...skyTexts].filter((node) => node.parentNode.style.display !== "none");
    const taken = skyNames.map((node) => roomOf(Number(node.getAttribute("x")), Number(node.getAttribute("y")), node.textContent));
    const shown = byMagnitude.filter((star) => ringed.has(star) || star === chosen);
    const named = shown.filter((star) => star.name);
    const rings = [...ringed].map((star) => { const r = radius(star) * u; return [star, [star.x - r, star.y - r, star.x + r, star.y + r]]; });
    const areOverlapping = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
    for (const star of (named.length >= 5 ? named : shown).slice(0, 4 * MOST)) {
      if (taken.length >= MOST + skyNames.length) break;
      const text = star.label;
      const off = (radius(star) + 4) * u, wide = text.length * SIZE * 0.6 * u, level = star.y + SIZE * 0.35 * u;
      // Beside its star, above or below it: where it stays in the picture, covers no name, and if possible no ring.
      const places = [["start", star.x + off, level], ["end", star.x - off, level], ["middle", star.x, star.y - off], ["middle", star.x, star.y + off + SIZE * u]];
      const fitting = places.map(([anchor, x, y]) => {
        const room = roomOf(x - { start: 0, middle: wide / 2, end: wide }[anchor], y, text);
        const isInside = room[0] > box.x && room[0] + 0.88 * wide < box.x + box.w && room[1] > box.y && room[3] < box.y + box.h;
        return { anchor, x, y, room, isFree: isInside && !taken.some((other) => areOverlapping(room, other)) };
      }).filter(({ isFree }) => isFree);
      const place = fitting.find(({ room }) => !rings.some(([ringed, ring]) => ringed !== star && areOverlapping(room, ring))) ?? fitting[0];
      if (!place) continue;
      taken.push(place.room);
      make(layers.names, "text", { x: place.x, y: place.y, "text-anchor": place.anchor, "font-size": SIZE * u, "stroke-width": 3 * u }, text);
    }
  };
  let frame = 0;
  const show = () => {
    if (frame) return;
    frame = requestAnimationFrame(() => {
      frame = 0;
      view.setAttribute("viewBox", `${box.x} ${box.y} ${box.w} ${box.h}`);
      view.classList.toggle("sharp", unit() < 0.34);
      view.classList.toggle("whole", box.w >= width);
      placeShapes();
    });
  };
  const zoom = (factor, x = box.x + box.w / 2, y = box.y + box.h / 2) => {
    const w = Math.min(Math.max(box.w / factor, 8), width);
    const share = w / box.w;
    Object.assign(box, { x: x - (x - box.x) * share, y: y - (y - box.y) * share, w, h: box.h * share });
    move(0, 0);
  };
  const move = (dx, dy) => {
    box.x = Math.min(Math.max(box.x + dx, -0.5), width - 0.5 - box.w);
    box.y = Math.min(Math.max(box.y + dy, -0.5), height - 0.5 - box.h);
    show();
  };
  const whole = () => { Object.assign(box, { x: -0.5, y: -0.5, w: width, h: height }); show(); };
  const pointOf = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(view.getScreenCTM().inverse());
    return [point.x, point.y];
  };
  view.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 400), ...pointOf(event));
  }, { passive: false });
  // One pointer moves the picture, two zoom it.
  const grips = new Map();
  const middle = () => [...grips.values()].reduce(([x, y], [px, py]) => [x + px / grips.size, y + py / grips.size], [0, 0]);
  const apart = () => { const [one, two] = grips.values(); return two ? Math.hypot(one[0] - two[0], one[1] - two[1]) : 0; };
  view.addEventListener("pointerdown", (event) => { grips.set(event.pointerId, [event.clientX, event.clientY]); });
  for (const end of ["pointerup", "pointercancel", "pointerleave"]) view.addEventListener(end, (event) => grips.delete(event.pointerId));
  view.addEventListener("pointermove", (event) => {
    if (grips.has(event.pointerId) && event.buttons) {
      const [from, wide] = [middle(), apart()];
      grips.set(event.pointerId, [event.clientX, event.clientY]);
      const to = middle();
      move((from[0] - to[0]) * unit(), (from[1] - to[1]) * unit());
      if (wide) zoom(apart() / wide, ...pointOf({ clientX: to[0], clientY: to[1] }));
    } else if (event.pointerType === "mouse") {
      const star = starAt(event, MOUSE_REACH);
      if (star) tell(star);
    }
  });
  // A finger is wider than a star. One with a ring is what is meant, where fainter ones are near.
  const FINGER_REACH = 24, MOUSE_REACH = 10;
  const starAt = (event, reach) => {
    const [x, y] = pointOf(event), u = unit();
    const isShown = (star) => star.shape.style.display !== "none" && star.shape.parentNode.style.display !== "none";
    let nearest = null, least = reach;
    for (const star of marked) {
      if (!isShown(star)) continue;
      const hasRing = star.shape.style.visibility !== "hidden";
      const off = Math.hypot(star.x - x, star.y - y) / u - (hasRing ? reach / 2 : 0);
      if (off < least) [nearest, least] = [star, off];
    }
    return nearest;
  };
  // A drag ends with a click, too.
  let pressed = null;
  view.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  view.addEventListener("click", (event) => {
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 6) return;
    const star = starAt(event, event.pointerType === "mouse" ? MOUSE_REACH : FINGER_REACH);
    if (star) choose(star, false);
    else leave();
  });
  view.addEventListener("keydown", (event) => {
    const step = box.w / 8;
    const keys = {
      "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": whole,
      n: () => next(1), p: () => next(-1), Escape: () => leave(),
      ArrowLeft: () => move(-step, 0), ArrowRight: () => move(step, 0), ArrowUp: () => move(0, -step), ArrowDown: () => move(0, step),
    };
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  });
  // The next star by brightness, or the one before.
  const next = (by) => {
    const known = byMagnitude.filter(isInView);
    if (!known.length) return;
    const at = known.indexOf(chosen);
    choose(known[at < 0 ? 0 : (at + by + known.length) % known.length], false);
  };
  for (const button of root.querySelectorAll("[data-zoom]")) {
    const factor = Number(button.dataset.zoom);
    button.addEventListener("click", () => (factor ? zoom(factor) : whole()));
  }
  for (const input of root.querySelectorAll("[data-layer]")) {
    const layer = layers[input.dataset.layer] || byId("picture");
    if (input.dataset.layer === "unidentified" && !stars.some((star) => star.id)) input.checked = true;
    const apply = () => {
      if (layer) layer.style.display = input.checked ? "" : "none";
      show();
    };
    input.addEventListener("change", apply);
    apply();
  }

  byId("all-rings").addEventListener("change", show);
  byId("wipe")?.addEventListener("input", () => chart.show(Number(byId("wipe").value) / 100));

  // One star: under the picture, in the picture and in the table.
  const number = (value, decimals) => (value === undefined || value === null ? "" : value.toFixed(decimals));
  const tell = (star) => {
    const parts = [titleOf(star)];
    if (star.name && star.name !== star.label) parts.push(star.name);
    if (star.id && star.id !== star.label) parts.push(star.id);
    if (star.hd) parts.push(`HD ${star.hd}`);
    if (star.hip) parts.push(`HIP ${star.hip}`);
    if (star.v !== undefined) parts.push(`V ${number(star.v, 2)}`);
    if (star.ra !== undefined) parts.push(`RA ${number(star.ra, 4)}° Dec ${number(star.dec, 4)}°`);
    parts.push(`x ${number(star.x, 2)} y ${number(star.y, 2)}`);
    if (star.snr !== undefined) parts.push(`SNR ${star.snr}`);
    if (star.residual !== undefined) parts.push(`residual ${number(star.residual, 3)} px`);
    if (star.why) parts.push(`not measured: ${star.why}`);
    if (star.flags.length) parts.push(star.flags.join(" "));
    byId("under").textContent = parts.join(" · ");
  };
  const card = makeCard(byId("card"), view, () => { leave(); view.focus({ preventScroll: true }); });
  const nodesOf = (star) => [star.shape, ...(star.index === undefined ? [] : [table.rowOf(star)])];
  const leave = () => {
    for (const node of chosen ? nodesOf(chosen) : []) node.classList.remove("chosen");
    chosen = null;
    card.hide();
    show();
  };
  const choose = (star, center) => {
    for (const node of chosen ? nodesOf(chosen) : []) node.classList.remove("chosen");
    chosen = star;
    for (const node of nodesOf(star)) node.classList.add("chosen");
    if (center) {
      if (box.w > width / 4) zoom(box.w / (width / 4));
      move(star.x - box.x - box.w / 2, star.y - box.y - box.h / 2);
      byId("seen").scrollIntoView({ block: "nearest" });
    }
    card.show(star);
    show();
    // Fingers do not hover: there the card alone tells.
    if (matchMedia("(hover: hover)").matches) tell(star);
  };

  // The table, with the marks in the picture of what is left in it.
  const text = (key) => (s) => s[key] || "";
  const column = (key, title, shown, isText = false) => ({ key, title, isText, text: shown, value: (s) => s[key] });
  const table = makeTable(root.querySelector("section.table"), [
    column("name", "Name", text("name"), true), column("id", "Catalog", text("id"), true), column("hd", "HD", text("hd")),
    column("v", "V", (s) => number(s.v, 2)), column("snr", "SNR", (s) => s.snr ?? ""), column("flux", "Flux", (s) => s.flux ?? ""),
    column("x", "x", (s) => number(s.x, 2)), column("y", "y", (s) => number(s.y, 2)),
    column("ra", "RA (°)", (s) => number(s.ra, 4)), column("dec", "Dec (°)", (s) => number(s.dec, 4)),
    column("residual", "Residual (px)", (s) => number(s.residual, 3)),
    { ...column("flags", "Flags", (s) => s.flags.join(" "), true), value: (s) => s.flags.join(" ") || undefined },
  ], stars, {
    choose: (star) => choose(star, true),
    words: (star) => `${star.kind} ${star.hd ? `hd${star.hd} hd ${star.hd}` : ""} ${star.hip ? `hip${star.hip} hip ${star.hip}` : ""}`,
    filtered: (order) => {
      const fitting = new Set(order);
      for (const star of stars) star.shape.style.display = fitting.has(star) ? "" : "none";
    },
  });

  // Figures.
  const figure = (...of) => makeFigure(byId("figures"), ...of);
  const dot = (plot, star, x, y) => {
    const node = make(plot.svg, "circle", { class: "dot", cx: plot.x(x), cy: plot.y(y), r: 2.2 });
    node.addEventListener("pointerenter", () => tell(star));
    node.addEventListener("click", () => choose(star, true));
  };
  const span = (values, margin) => {
    const [low, high] = [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
    const room = Math.max((high - low) * margin, 0.1);
    return [low - room, high + room];
  };
  const lit = stars.filter((star) => star.id && star.flux > 0 && star.v !== undefined);
  if (lit.length > 2) {
    const mag = (star) => -2.5 * Math.log10(star.flux / data.zero_point_exposure_s);
    const vs = span(lit.map((star) => star.v), 0.03), ms = span(lit.map(mag), 0.03);
    const plot = figure("Magnitude against flux, with the zero point", ["V (mag)", ...vs], ["−2.5 log10 flux (mag)", ms[1], ms[0]]);
    for (const star of lit) dot(plot, star, star.v, mag(star));
    if (data.zero_point_vmag !== null) {
      const ends = [Math.max(vs[0], ms[0] + data.zero_point_vmag), Math.min(vs[1], ms[1] + data.zero_point_vmag)];
      if (ends[0] < ends[1]) make(plot.svg, "path", { class: "fit", d: ends.map((v, i) => `${i ? "L" : "M"}${plot.x(v)} ${plot.y(v - data.zero_point_vmag)}`).join("") });
    }
    const off = lit.filter((star) => star.residual !== undefined);
    if (off.length > 2) {
      const most = residuals[Math.floor(residuals.length * 0.99)] * 1.1;
      const plot = figure("Residuals against magnitude", ["V (mag)", ...vs], ["residual (px)", 0, most]);
      for (const star of off) if (star.residual <= most) dot(plot, star, star.v, star.residual);
    }
  }
  const bins = data.completeness.filter((bin) => bin.stars > 0);
  if (bins.length > 1) {
    const [low, high] = [bins[0].vmag - 0.25, bins[bins.length - 1].vmag + 0.25];
    const plot = figure("Fraction of catalog stars that are detected", ["V (mag)", low, high], ["fraction", 0, 1]);
    for (const bin of bins) {
      const part = bin.detected / bin.stars;
      const bar = make(plot.svg, "rect", { class: "part", x: plot.x(bin.vmag - 0.22), y: plot.y(part), width: plot.x(0.44) - plot.x(0), height: plot.y(0) - plot.y(part) });
      make(bar, "title", {}, `V ${bin.vmag}: ${bin.detected} of ${bin.stars}`);
    }
    const mark = (v, name, kind, down) => {
      if (v === null || v < low || v > high) return;
      make(plot.svg, "line", { class: kind, x1: plot.x(v), x2: plot.x(v), y1: plot.y(1), y2: plot.y(0) });
      make(plot.svg, "text", { x: plot.x(v) + 4, y: plot.y(1) + down }, `${name} ${v.toFixed(2)}`);
    };
    mark(data.limit50_vmag, "50 % limit", "fit", 10);
    mark(data.predicted_vmag, "predicted", "predicted", 24);
  }

  byId("figures-fold").hidden = !byId("figures").childElementCount;
  byId("table-fold").hidden = !stars.length;
  show();
  new ResizeObserver(show).observe(view);
};
