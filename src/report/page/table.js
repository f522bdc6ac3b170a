  // A table that sorts and filters. Its rows are made as far as they are seen.
  //
  // A column has a key, a title, whether it is text, and for an item its value (undefined where there is none) and
  // its text. `isChosen` and `choose` are of rows that can be chosen, `words` gives more words of an item that a
  // filter may ask for, `filtered` is told which items are left.
  const shownNumber = (value) => (value === null || value === undefined ? "" : Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(7))));
  const makeTable = (section, columns, items, { choose, words = () => "", filtered = () => {} }) => {
    const STEP = 200, LONG = 60;
    const [head, body, filter, count, scroll] = ["thead tr", "tbody", "input", ".count", ".scroll"].map((path) => section.querySelector(path));
    const rows = new Map();
    const byKey = new Map(columns.map((column) => [column.key.toLowerCase(), column]));
    let order = items, made = 0, sorted = { column: null, up: true };
    const rowOf = (item) => {
      if (rows.has(item)) return rows.get(item);
      const row = document.createElement("tr");
      for (const { text, isText } of columns) {
        const cell = row.insertCell();
        cell.textContent = text(item);
        if (isText) cell.className = cell.textContent.length > LONG ? "text long" : "text";
      }
      if (choose) {
        row.tabIndex = 0;
        row.className = "choice";
        row.addEventListener("click", () => choose(item));
        row.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(item); });
      }
      rows.set(item, row);
      return row;
    };
    const more = () => {
      for (const item of order.slice(made, made + STEP)) body.appendChild(rowOf(item));
      made = Math.min(made + STEP, order.length);
    };
    scroll.addEventListener("scroll", () => {
      if (made < order.length && scroll.scrollTop + scroll.clientHeight > scroll.scrollHeight - 600) more();
    });
    // All parts of what is asked must fit: comparisons such as v<5, and words.
    const partFits = (part) => {
      const compared = part.match(/^(.+?)([<>=])(.+)$/);
      const column = compared && byKey.get(compared[1]);
      if (!column) return (item) => `${columns.map((c) => (c.isText ? c.text(item) : "")).join(" ")} ${words(item)}`.toLowerCase().includes(part);
      const [, , sign, wanted] = compared;
      if (column.isText) return (item) => column.text(item).toLowerCase() === wanted;
      return (item) => {
        const value = column.value(item), number = Number(wanted);
        return value !== undefined && (sign === "<" ? value < number : sign === ">" ? value > number : value === number);
      };
    };
    const fill = () => {
      const parts = filter.value.trim().toLowerCase().replace(/\s*([<>=])\s*/g, "$1").split(/\s+/).filter(Boolean).map(partFits);
      order = items.filter((item) => parts.every((fits) => fits(item)));
      const { column, up } = sorted;
      if (column) {
        order.sort((a, b) => {
          const [p, q] = [column.value(a), column.value(b)];
          if (p === undefined || q === undefined) return (p === undefined) - (q === undefined);
          return (p < q ? -1 : p > q ? 1 : 0) * (up ? 1 : -1);
        });
      }
      filtered(order);
      body.replaceChildren();
      made = 0;
      more();
      const all = items.length === 1 ? "1 row" : `${items.length} rows`;
      count.textContent = order.length === items.length ? all : `${order.length} of ${all}`;
    };
    for (const column of columns) {
      const cell = document.createElement("th"), button = document.createElement("button");
      cell.scope = "col";
      if (column.isText) cell.className = "text";
      button.type = "button";
      button.textContent = column.title;
      button.addEventListener("click", () => {
        sorted = { column, up: sorted.column === column ? !sorted.up : true };
        for (const other of head.children) other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", sorted.up ? "ascending" : "descending");
        fill();
      });
      cell.appendChild(button);
      head.appendChild(cell);
    }
    filter.addEventListener("input", fill);
    fill();
    return { rowOf };
  };

