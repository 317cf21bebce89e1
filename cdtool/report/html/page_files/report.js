// Runs when the page is complete: sort tables, page through long ones, draw plots, show traces.

function elements(kind) {
  return [...document.querySelectorAll(`svg[data-plot="${kind}"]`)];
}

/** The charts of one kind; if the page has a legend for them, its names hide curves. */
function makeCharts(kind, data, panels, plan) {
  const host = document.querySelector(`.legend[data-for="${kind}"]`);
  let charts = [];
  const redraw = () => charts.forEach((chart) => chart.redraw());
  const hidden = host ? makeLegend(host, data.detectors, detectorsIn(panels), redraw) : new Set();
  charts = elements(kind).map((svg) => new Chart(svg, plan(panels[Number(svg.dataset.number)], hidden)));
  return charts;
}

function makeAmoc(data) {
  const controls = document.querySelector('.controls[data-for="amoc"]');
  if (!controls) return;
  let unit = data.per;
  let hiddenNow = new Set();
  const charts = makeCharts("amoc", data, data.amoc, (panel, hidden) => {
    hiddenNow = hidden;
    return amocPlan(data, panel, hidden, unit);
  });
  makeChoice(
    controls,
    "False alarms",
    [unit, unit === "hour" ? "operation" : "hour"].map((per) => [per, `per ${per}`]),
    (chosen) => {
      unit = chosen;
      charts.forEach((chart, i) => chart.replace(amocPlan(data, data.amoc[i], hiddenNow, unit)));
    },
  );
}

function makeForces(data, viewer) {
  const host = document.querySelector('.legend[data-for="force"]');
  if (!host || !viewer) return;
  const plans = data.force.map((panel) => forcePlan(data, panel, viewer.open));
  elements("force").forEach((svg) => new Chart(svg, plans[Number(svg.dataset.number)]));
  const alarms = data.force.flatMap((panel) => panel.curves.flatMap((item) => item.alarms));
  makeForceLegend(host, data, alarms.map(({ detector }) => detector));
}

/** Show the headings of tables as text or as buttons: on later pages a browser repeats headings without buttons. */
function headingsForPrint() {
  const buttons = [...document.querySelectorAll("thead th button")];
  const words = buttons.map((button) => document.createTextNode(button.textContent));
  buttons.forEach((button, i) => button.replaceWith(words[i]));
  return () => buttons.forEach((button, i) => words[i].replaceWith(button));
}

/** Print collapsed parts, all rows of long tables, and the trigger plots of failed recordings too. */
function completeForPrint(data, viewer, paged) {
  let folded = [],
    restoreHeadings = () => {};
  const chosen = makePrintChoice(data);
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const part of folded) part.open = true;
    for (const table of paged) table.printing(true);
    restoreHeadings = headingsForPrint();
    if (viewer) printFailed(data, data.failed.map(viewer.traceAt), chosen());
  });
  addEventListener("afterprint", () => {
    for (const part of folded) part.open = false;
    restoreHeadings();
    for (const table of paged) table.printing(false);
    if (viewer) printFailed(data, [], 0);
  });
}

function start() {
  const data = JSON.parse(document.getElementById("data").textContent);
  const sources = [...document.querySelectorAll("script.trace")];
  for (const table of document.querySelectorAll("table")) sortInPlace(table);
  const paged = [];
  const viewer =
    sources.length && document.getElementById("viewer")
      ? makeViewer(data, sources, (trace) => paged.forEach((table) => table.mark(trace)))
      : null;
  for (const host of document.querySelectorAll(".paged")) {
    const table = data.tables.find((item) => item.name === host.dataset.table);
    paged.push(new PagedTable(host, table, table.caption, viewer ? viewer.open : () => {}));
  }
  const byRecording = data.tables.find((table) => table.name === "recordings-table");
  const openRecording = (recording) => {
    const traces = viewer && byRecording ? byRecording.opens[recording] : null;
    return traces ? () => viewer.open(traces[0]) : null;
  };
  makeCharts("latency", data, data.latency, (panel) =>
    panel.edges ? histogramPlan(data, panel) : latencyPlan(data, panel, openRecording),
  );
  makeCharts("survival", data, data.survival, (panel, hidden) => survivalPlan(data, panel, hidden));
  makeAmoc(data);
  makeForces(data, viewer);
  if (viewer) viewer.open(data.failed.length ? data.failed[0] : 0, false);
  completeForPrint(data, viewer, paged);
}

start();
