// Tables of at least three rows are sorted by a click on the head of a column; tables with a filter show the rows that
// contain every word of it. Without this script all rows are there, in their first order.
(() => {
  "use strict";
  const SCALE = { G: 1e9, M: 1e6, k: 1e3, m: 1e-3, "µ": 1e-6, n: 1e-9, p: 1e-12 };
  // `1.23 mm` as 0.00123; texts without a number in front stay texts.
  const value = (text) => {
    const found = /^(-?[\d.]+(?:e-?\d+)?)\s*([GMkmµnp](?=[a-zA-Z]))?/.exec(text);
    return found ? Number(found[1]) * (SCALE[found[2]] || 1) : text;
  };
  // Numbers come before texts, in both directions.
  const compare = (a, b, sign) => {
    const kinds = [typeof a, typeof b];
    if (kinds[0] !== kinds[1]) return kinds[0] === "number" ? -1 : 1;
    return sign * (kinds[0] === "number" ? a - b : a.localeCompare(b));
  };
  for (const table of document.querySelectorAll("table.numbers")) {
    const [body] = table.tBodies;
    const heads = table.tHead ? [...table.tHead.rows[0].cells] : [];
    if (!(body && body.rows.length > 2 && heads.length)) continue;
    table.classList.add("sortable");
    heads.forEach((head, i) => {
      head.tabIndex = 0;
      const sort = () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const keyed = [...body.rows].map((row) => [value(row.cells[i].textContent.trim()), row]);
        keyed.sort(([a], [b]) => compare(a, b, down ? -1 : 1));
        body.append(...keyed.map(([, row]) => row));
      };
      head.addEventListener("click", sort);
      head.addEventListener("keydown", (event) => event.key === "Enter" && sort());
    });
    if (!table.classList.contains("filtered")) continue;
    const box = document.createElement("input");
    box.className = "filter";
    box.type = "search";
    box.placeholder = "filter the rows: stacks shim good enough";
    box.setAttribute("aria-label", "show the rows with these words");
    box.addEventListener("input", () => {
      const words = box.value.toLowerCase().split(/\s+/);
      for (const row of body.rows) {
        const text = [...row.cells].map((cell) => cell.textContent).join(" ").toLowerCase();
        row.hidden = !words.every((word) => text.includes(word));
      }
    });
    table.parentElement.before(box);
  }
})();
