// Tables that are sorted by a click on a heading, and long ones that are paged, filtered and searched.

// Missing numbers of a table; they stay last in either order.
const NO_KEY = 1e299;
const PAGE_SIZES = [15, 50, 200, 1000];
const LONGEST_WORD = 28;
// A browser prints more rows only after minutes.
const MOST_PRINTED = 1000;

/** Which of two rows comes first: by number if they have one, else by text. */
function compareRows(first, second, direction) {
  if (typeof first === "number") {
    const [a, b] = [first > NO_KEY, second > NO_KEY];
    if (a || b) return a - b;
    return direction * (first - second);
  }
  return direction * first.localeCompare(second, "en", { numeric: true });
}

/** Turn headings into buttons; sort(column, direction) is called with the heading's index and 1 or -1. */
function makeSortable(headings, sort) {
  headings.forEach((heading, column) => {
    const words = heading.textContent;
    heading.textContent = "";
    const button = make(heading, "button", { type: "button" }, words);
    button.addEventListener("click", () => {
      const falling = heading.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
      sort(column, falling ? -1 : 1);
    });
  });
}

/** Sort a table of the page: its rows are reordered, each part's below its heading. */
function sortInPlace(table) {
  const parts = [...table.tBodies].map((body) => [body, [...body.rows].filter((row) => row.className !== "part")]);
  makeSortable([...table.tHead.rows[0].cells], (column, direction) => {
    const keyed = parts.some(([, rows]) => rows.some((row) => row.cells[column].dataset.key !== undefined));
    const key = (row) => {
      const cell = row.cells[column];
      if (!keyed) return cell.textContent;
      return cell.dataset.key === undefined ? Infinity : Number(cell.dataset.key);
    };
    for (const [body, rows] of parts) body.append(...[...rows].sort((a, b) => compareRows(key(a), key(b), direction)));
  });
}

/** A table of the page's data, a page of rows at a time; `open` shows the traces of a row. Returns mark(trace). */
class PagedTable {
  constructor(host, table, caption, open) {
    this.table = table;
    this.open = open;
    this.order = Array.from({ length: table.rows }, (_, i) => i);
    this.filters = new Map();
    this.page = 0;
    this.size = PAGE_SIZES[0];
    this.current = -1;
    this.filterBar = make(host, "div", { class: "filters" });
    this.makeFilters();
    const box = make(host, "div", { class: "scroll", role: "region", tabindex: "0", "aria-label": caption });
    const element = make(box, "table");
    make(element, "caption", {}, caption);
    const line = make(make(element, "thead"), "tr");
    const headings = table.columns.map((column) =>
      make(line, "th", { scope: "col", class: column.numeric ? "number" : "" }, column.heading),
    );
    makeSortable(headings, (column, direction) => this.sort(column, direction));
    this.body = make(element, "tbody");
    this.pages = make(host, "div", { class: "pages" });
    this.cut = make(host, "p", { class: "note print-only" });
    this.draw();
  }

  textOf(column, row) {
    return column.texts[column.at[row]];
  }

  /** The first line of a cell as it is, the others in small print. */
  fill(cell, words) {
    const [text, ...rest] = words.split("\n");
    cell.append(text);
    for (const line of rest) {
      cell.append(" ");
      make(cell, "small", {}, line);
    }
  }

  makeFilters() {
    const search = make(this.label("find"), "input", { type: "search", placeholder: this.table.columns[0].heading });
    search.addEventListener("input", () => {
      const wanted = search.value.toLowerCase();
      this.filter(
        "find",
        wanted ? (row) => this.textOf(this.table.columns[0], row).toLowerCase().includes(wanted) : null,
      );
    });
    for (const column of this.table.columns.filter((item) => item.choice && item.texts.length > 1)) {
      const select = this.makeSelect(column.heading, column.texts);
      select.addEventListener("change", () => {
        const wanted = Number(select.value);
        this.filter(column.heading, wanted >= 0 ? (row) => column.at[row] === wanted : null);
      });
    }
    const marks = Object.entries(this.table.marks).filter(([, rows]) => rows.length);
    if (!marks.length) return;
    const select = this.makeSelect(
      "which",
      marks.map(([name, rows]) => `${name} (${rows.length})`),
    );
    select.addEventListener("change", () => {
      const wanted = Number(select.value);
      const rows = new Set(wanted >= 0 ? marks[wanted][1] : []);
      this.filter("which", wanted >= 0 ? (row) => rows.has(row) : null);
    });
  }

  label(words) {
    return make(this.filterBar, "label", {}, words);
  }

  makeSelect(words, options) {
    const select = make(this.label(words), "select");
    make(select, "option", { value: "-1" }, "all");
    options.forEach((option, i) => make(select, "option", { value: String(i) }, option));
    return select;
  }

  filter(name, keep) {
    if (keep) this.filters.set(name, keep);
    else this.filters.delete(name);
    this.page = 0;
    this.draw();
  }

  sort(place, direction) {
    const column = this.table.columns[place];
    const key = column.keys ? (row) => column.keys[row] ?? Infinity : (row) => this.textOf(column, row);
    this.order.sort((a, b) => compareRows(key(a), key(b), direction) || a - b);
    this.page = 0;
    this.draw();
  }

  draw() {
    const rows = this.order.filter((row) => [...this.filters.values()].every((keep) => keep(row)));
    const last = Math.max(Math.ceil(rows.length / this.size) - 1, 0);
    this.page = Math.min(this.page, last);
    const from = this.page * this.size;
    this.body.replaceChildren();
    for (const row of rows.slice(from, from + this.size)) this.drawRow(row);
    this.cut.textContent = last ? `${rows.length - this.size} more rows are on the screen and in results.json.` : "";
    this.drawPages(rows.length, from, last);
  }

  drawRow(row) {
    const traces = this.table.opens[row] || [];
    const line = make(
      this.body,
      "tr",
      traces.length ? { class: traces.includes(this.current) ? "opens open" : "opens" } : {},
    );
    this.table.columns.forEach((column, place) => {
      const words = this.textOf(column, row);
      const kinds = [
        column.numeric ? "number" : "",
        column.tones ? column.tones[row] : "",
        words.length > LONGEST_WORD && !words.includes("\n") ? "long" : "",
      ];
      const style = kinds.filter(Boolean).join(" ");
      const cell =
        place === this.table.row_heading
          ? make(line, "th", { scope: "row", class: style })
          : make(line, "td", { class: style });
      if (place || !traces.length) this.fill(cell, words);
      else this.drawOpener(cell, words, traces);
    });
    if (traces.length) line.addEventListener("click", () => this.open(traces[0]));
  }

  /** A row with several operations has a button for each. */
  drawOpener(cell, words, traces) {
    traces.forEach((trace, i) => {
      const button = make(cell, "button", { type: "button" }, i ? ` ▸${i + 1}` : `▸ ${words}`);
      button.addEventListener("click", (event) => {
        event.stopPropagation();
        this.open(trace);
      });
    });
  }

  drawPages(count, from, last) {
    this.pages.replaceChildren();
    const step = (words, page, possible) => {
      const button = make(this.pages, "button", { type: "button" }, words);
      button.disabled = !possible;
      button.addEventListener("click", () => {
        this.page = page;
        this.draw();
      });
    };
    const shown = count ? `${from + 1} to ${Math.min(from + this.size, count)} of ${count}` : "none";
    const all = count === this.table.rows ? "" : ` (${this.table.rows} in all)`;
    if (last) step("◀", this.page - 1, this.page > 0);
    make(this.pages, "span", { role: "status" }, `${shown}${all}`);
    if (last) step("▶", this.page + 1, this.page < last);
    if (this.table.rows <= PAGE_SIZES[0]) return;
    const select = make(this.pages, "select", { "aria-label": "rows at a time" });
    for (const size of PAGE_SIZES) {
      const option = make(select, "option", { value: String(size) }, `${size} rows`);
      option.selected = size === this.size;
    }
    select.addEventListener("change", () => {
      this.size = Number(select.value);
      this.draw();
    });
  }

  /** On paper all rows are shown, up to MOST_PRINTED; then as before. */
  printing(begins) {
    if (begins) this.before = [this.page, this.size];
    [this.page, this.size] = begins ? [0, MOST_PRINTED] : this.before;
    this.draw();
  }

  /** The row whose trace is shown. */
  mark(trace) {
    this.current = trace;
    this.draw();
  }
}
