// Runs when the page is complete: cells of the maps become buttons that open their contacts and a trigger plot.

/** The list of a cell's contacts, the worst first; open(trace) shows a trigger plot. */
class ContactList {
  constructor(data) {
    this.data = data;
    this.cell = -1;
    this.title = document.getElementById("cell-title");
    this.body = document.querySelector("#cell-table tbody");
  }

  show(cell, trace, open) {
    const { title, contacts, traces } = this.data.cells[cell];
    this.cell = cell;
    this.title.textContent = title;
    this.body.replaceChildren();
    contacts.forEach(([recording, ...words], i) => {
      const at = traces[i];
      const kinds = [at >= 0 ? "opens" : "", at >= 0 && at === trace ? "open" : ""];
      const line = make(this.body, "tr", { class: kinds.filter(Boolean).join(" ") });
      const name = make(line, "th", { scope: "row" });
      if (at >= 0) {
        make(name, "button", { type: "button" }, `▸ ${recording}`);
        line.addEventListener("click", () => open(at));
      } else name.append(recording);
      for (const word of words) make(line, "td", {}, word);
    });
    for (const item of document.querySelectorAll("td[data-cell]")) {
      item.classList.toggle("open", Number(item.dataset.cell) === cell);
    }
  }
}

function start() {
  const data = JSON.parse(document.getElementById("data").textContent);
  if (!data.cells.length) return;
  const sources = [...document.querySelectorAll("script.trace")];
  for (const table of document.querySelectorAll("table.sorted")) sortInPlace(table);
  const list = new ContactList(data);
  const holds = (cell, trace) => data.cells[cell].traces.includes(trace);
  let viewer = null;

  /** After a step to another trigger plot the list is that of the cell whose worst contact it shows. */
  function opened(trace) {
    let { cell } = list;
    if (cell < 0 || !holds(cell, trace)) {
      cell = data.cells.findIndex((item) => item.traces[0] === trace);
      if (cell < 0) cell = data.cells.findIndex((item) => item.traces.includes(trace));
    }
    if (cell >= 0) list.show(cell, trace, viewer.open);
  }

  function openCell(cell, travel = true) {
    const trace = data.cells[cell].traces.find((number) => number >= 0) ?? -1;
    list.show(cell, trace, (number) => viewer.open(number));
    if (trace >= 0) viewer.open(trace, false);
    else if (viewer) document.getElementById("viewer").hidden = true;
    if (!travel) return;
    list.title.scrollIntoView({ block: "start" });
    list.title.focus({ preventScroll: true });
  }

  if (sources.length) viewer = makeViewer(data, sources, opened);
  for (const item of document.querySelectorAll("td[data-cell]")) {
    const cell = Number(item.dataset.cell);
    const inner = item.querySelector(".inner");
    const button = make(item, "button", { type: "button", class: "inner", title: data.cells[cell].title });
    button.append(...inner.childNodes);
    inner.remove();
    button.addEventListener("click", () => openCell(cell));
  }
  openCell(data.first, false);
}

start();
