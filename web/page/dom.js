/**
 * The element of the page with this id, which is there.
 * @param {string} id
 * @returns {any}
 */
export const byId = (id) => document.getElementById(id);

/**
 * Named values, as a list of facts.
 * @param {string[][]} facts
 */
export const factsOf = (facts) => facts.map(([name, value]) => {
  const fact = document.createElement("div");
  const [term, words] = [document.createElement("dt"), document.createElement("dd")];
  term.textContent = name;
  words.textContent = value;
  fact.append(term, words);
  return fact;
});

/**
 * The path through points of a figure.
 * @param {{ x: (value: number) => number, y: (value: number) => number }} plot
 * @param {number[][]} points
 */
export const pathThrough = (plot, points) => points.map(([x, y], at) => `${at ? "L" : "M"}${plot.x(x)} ${plot.y(y)}`).join("");
