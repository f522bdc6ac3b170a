  // The tables come as columns. Their names are those of the command's CSV, as a filter asks for them.
  const sections = document.querySelectorAll("section.table");
  JSON.parse(document.getElementById("data").textContent).forEach((table, place) => {
    const items = Array.from({ length: table.rows }, (_, row) => row);
    const columns = table.columns.map(({ name, numbers, texts }) => ({
      key: name,
      title: name,
      isText: Boolean(texts),
      value: texts ? (row) => texts.all[texts.which[row]] || undefined : (row) => numbers[row] ?? undefined,
      text: texts ? (row) => texts.all[texts.which[row]] : (row) => shownNumber(numbers[row]),
    }));
    makeTable(sections[place], columns, items, {});
  });
