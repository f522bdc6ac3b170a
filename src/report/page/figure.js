  // Elements of SVG, and figures with axes.
  const make = (parent, tag, attributes = {}, text) => {
    const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.appendChild(node);
    return node;
  };
  // Round values between two others.
  const ticks = (low, high, most) => {
    const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((n) => n * power).find((s) => s >= raw);
    const found = [];
    for (let at = Math.ceil(low / step) * step; at <= high + step * 1e-6; at += step) found.push(Number(at.toPrecision(6)));
    return found;
  };
  const shownTick = (value) => String(value).replace("-", "−");
  // A figure without data; `x` and `y` give the place of a value.
  const makeFigure = (parent, caption, [xName, x0, x1], [yName, y0, y1]) => {
    const holder = document.createElement("figure"), words = document.createElement("figcaption");
    words.textContent = caption;
    holder.appendChild(words);
    parent.appendChild(holder);
    const W = 420, H = 260, left = 52, bottom = 38, top = 10, right = 12;
    const svg = make(holder, "svg", { class: "plot", viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": caption });
    const x = (v) => left + (v - x0) / (x1 - x0) * (W - left - right);
    const y = (v) => H - bottom - (v - y0) / (y1 - y0) * (H - top - bottom);
    for (const t of ticks(Math.min(x0, x1), Math.max(x0, x1), 6)) {
      make(svg, "line", { class: "grid", x1: x(t), x2: x(t), y1: top, y2: H - bottom });
      make(svg, "text", { x: x(t), y: H - bottom + 14, "text-anchor": "middle" }, shownTick(t));
    }
    for (const t of ticks(Math.min(y0, y1), Math.max(y0, y1), 5)) {
      make(svg, "line", { class: "grid", x1: left, x2: W - right, y1: y(t), y2: y(t) });
      make(svg, "text", { x: left - 5, y: y(t) + 4, "text-anchor": "end" }, shownTick(t));
    }
    make(svg, "text", { x: (left + W - right) / 2, y: H - 6, "text-anchor": "middle" }, xName);
    make(svg, "text", { x: 12, y: (H - bottom) / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${(H - bottom) / 2})` }, yName);
    make(svg, "path", { class: "axis", d: `M${left} ${top}V${H - bottom}H${W - right}` });
    return { svg, x, y };
  };
  // Fingers do not hover: the value of what is touched in a drawing stands below it.
  document.addEventListener("click", (event) => {
    const REACH_PX = 24;
    const drawing = event.target.closest?.(".drawing");
    if (!drawing) return;
    const away = (low, at, high) => Math.max(low - at, 0, at - high);
    let nearest = event.target.querySelector(":scope > title"), least = REACH_PX;
    for (const title of nearest ? [] : drawing.querySelectorAll("svg * > title")) {
      const { left, right, top, bottom } = title.parentNode.getBoundingClientRect();
      const off = Math.hypot(away(left, event.clientX, right), away(top, event.clientY, bottom));
      if (off < least) [nearest, least] = [title, off];
    }
    let told = drawing.nextElementSibling;
    if (!told?.classList.contains("told")) {
      told = drawing.insertAdjacentElement("afterend", Object.assign(document.createElement("p"), { className: "told" }));
      told.setAttribute("role", "status");
    }
    told.textContent = nearest?.textContent ?? "";
  });
