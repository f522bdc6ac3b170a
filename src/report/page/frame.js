// Brings the elements of a frame in `root` to life: picture, figures and table.
const showFrame = (root, data) => {
  const byId = (id) => root.querySelector(`#${id}`);
  const { width, height } = data;
  const columns = Object.entries(data.stars);
  const stars = data.stars.x.map((_, row) => {
    const given = columns.filter(([, values]) => values[row] !== null);
    return Object.fromEntries(given.map(([key, values]) => [key, values[row]]));
  });
  const unlikeStars = new Set(data.unlike_stars);
  stars.forEach((star, index) => {
    star.index = index;
    star.kind = star.id ? "identified" : unlikeStars.has(index) ? "other" : "unidentified";
    star.residual = star.dx === undefined ? undefined : Math.hypot(star.dx, star.dy);
  });

  // The picture: the view box is what is seen of the frame, in its pixels.
  const view = byId("view");
  const layers = {};
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
    const above = star.flux > 0 ? 2.5 * Math.log10(star.flux / faintest) : 0;
    return Math.min(4 + Math.max(above, 0), 13);
  };
  const fluxes = stars.map((star) => star.flux).filter((flux) => flux > 0).sort((a, b) => a - b);
  const faintest = fluxes.length ? fluxes[Math.floor(fluxes.length * 0.2)] : 1;
  const residuals = stars.map((star) => star.residual).filter((r) => r !== undefined).sort((a, b) => a - b);
  const typical = residuals.length ? Math.max(residuals[Math.floor(residuals.length / 2)], 1e-3) : 1;
  for (const star of stars) {
    const tag = star.kind === "identified" ? "circle" : star.kind === "other" ? "path" : "rect";
    star.shape = make(layers[star.kind], tag, { class: `shape ${star.kind}` });
    star.shape.star = star;
    if (star.residual !== undefined) star.arrow = make(layers.residuals, "path", { class: "arrow" });
  }
  let chosen = null;
  const placeShapes = () => {
    const u = unit();
    // As many rings as leave the picture to be seen, brightest first; closer up there are more.
    const AREA_PER_RING = 900;
    let rings = Math.ceil(view.clientWidth * view.clientHeight / AREA_PER_RING);
    for (const star of stars) {
      const { x, y, shape } = star;
      const r = radius(star) * u;
      if (star.kind === "identified") {
        const isInView = x > box.x && x < box.x + box.w && y > box.y && y < box.y + box.h;
        if (isInView) rings -= 1;
        shape.style.visibility = star === chosen || (isInView && rings >= 0) ? "" : "hidden";
      }
      if (star.kind === "identified") {
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
    placeNames(u);
  };
  // The brightest stars in view, where there is room.
  const byMagnitude = stars.filter((star) => star.name || star.id).sort((a, b) => (a.v ?? 99) - (b.v ?? 99));
  const placeNames = (u) => {
    const MOST = 60, SIZE = 12;
    layers.names.replaceChildren();
    const roomOf = (x, y, text) => [x, y - SIZE * u, x + text.length * SIZE * 0.6 * u, y + 3 * u];
    const skyNames = [...skyTexts].filter((node) => node.parentNode.style.display !== "none");
    const taken = skyNames.map((node) => roomOf(Number(node.getAttribute("x")), Number(node.getAttribute("y")), node.textContent));
    const shown = byMagnitude.filter((s) => s.x > box.x && s.x < box.x + box.w && s.y > box.y && s.y < box.y + box.h);
    const named = shown.filter((star) => star.name);
    for (const star of (named.length >= 5 ? named : shown).slice(0, 4 * MOST)) {
      if (taken.length >= MOST + skyNames.length) break;
      const text = star.name || (star.hd ? `HD ${star.hd}` : star.id);
      const at = [star.x + (radius(star) + 4) * u, star.y + SIZE * 0.35 * u];
      const room = roomOf(...at, text);
      if (taken.some((o) => o[0] < room[2] && room[0] < o[2] && o[1] < room[3] && room[1] < o[3])) continue;
      taken.push(room);
      make(layers.names, "text", { x: at[0], y: at[1], "font-size": SIZE * u, "stroke-width": 3 * u }, text);
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
    } else if (event.target.star) {
      tell(event.target.star);
    }
  });
  view.addEventListener("click", (event) => { if (event.target.star) choose(event.target.star, false); });
  view.addEventListener("keydown", (event) => {
    const step = box.w / 8;
    const keys = {
      "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": whole,
      ArrowLeft: () => move(-step, 0), ArrowRight: () => move(step, 0), ArrowUp: () => move(0, -step), ArrowDown: () => move(0, step),
    };
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  });
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

  // One star: under the picture, in the picture and in the table.
  const number = (value, decimals) => (value === undefined || value === null ? "" : value.toFixed(decimals));
  const tell = (star) => {
    const parts = [star.name || star.id || (star.kind === "other" ? "not a star" : "not identified")];
    if (star.name && star.id) parts.push(star.id);
    if (star.hd) parts.push(`HD ${star.hd}`);
    if (star.hip) parts.push(`HIP ${star.hip}`);
    if (star.v !== undefined) parts.push(`V ${number(star.v, 2)}`);
    if (star.ra !== undefined) parts.push(`RA ${number(star.ra, 4)}° Dec ${number(star.dec, 4)}°`);
    parts.push(`x ${number(star.x, 2)} y ${number(star.y, 2)}`);
    if (star.snr !== undefined) parts.push(`SNR ${star.snr}`);
    if (star.residual !== undefined) parts.push(`residual ${number(star.residual, 3)} px`);
    if (star.flags.length) parts.push(star.flags.join(" "));
    byId("under").textContent = parts.join(" · ");
  };
  const choose = (star, center) => {
    for (const node of chosen ? [chosen.shape, table.rowOf(chosen)] : []) node.classList.remove("chosen");
    chosen = star;
    const row = table.rowOf(star);
    for (const node of [star.shape, row]) node.classList.add("chosen");
    if (center) {
      if (box.w > width / 4) zoom(box.w / (width / 4));
      move(star.x - box.x - box.w / 2, star.y - box.y - box.h / 2);
    } else {
      row.scrollIntoView({ block: "nearest" });
    }
    show();
    tell(star);
  };

  // The table, with the marks in the picture of what is left in it.
  const text = (key) => (s) => s[key] || "";
  const column = (key, title, shown, isText = false) => ({ key, title, isText, text: shown, value: (s) => s[key] });
  const table = makeTable(root.querySelector("section.table"), [
    column("name", "Name", text("name"), true), column("id", "Catalogue", text("id"), true), column("hd", "HD", text("hd")),
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
    const plot = figure("Share of the catalogue's stars that are found", ["V (mag)", low, high], ["share", 0, 1]);
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
    mark(data.limit50_vmag, "half at", "fit", 10);
    mark(data.predicted_vmag, "predicted", "predicted", 24);
  }

  show();
  new ResizeObserver(show).observe(view);
};
