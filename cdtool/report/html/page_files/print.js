// Trigger plots of failed recordings on paper: drawn before the page is printed, removed after it.

// The width of an A4 page in landscape format without its margins, and heights that let one plot fit under its title [px].
const PAPER_WIDTH = 1030;
const PAPER_HEIGHTS = { force: 100, row: 78, axis: 44 };
const ROWS_ON_PAPER = 5;
// Hundreds of recordings may have failed. The address may end in #print-pages=50 or #print-pages=all.
const PAGES_OF_PLOTS = 20;
const CHOICES = [PAGES_OF_PLOTS, 50, 100, Infinity];
const IN_ADDRESS = /#print-pages=(all|[1-9]\d*)$/;

function failedPanel(trace, panel) {
  const seen = trace.contact >= 0 ? panel.seen[trace.contact] : null;
  return panel.false_alarms.length > 0 || (seen !== null && seen.outcome === "missed");
}

/** The detectors of each plot: all that failed, and others where there is room. */
function panelsOnPaper(trace) {
  const failed = trace.panels.filter((panel) => failedPanel(trace, panel));
  const others = trace.panels.filter((panel) => !failedPanel(trace, panel));
  const shown = [...failed, ...others.slice(0, Math.max(ROWS_ON_PAPER - failed.length, 0))];
  const parts = [];
  for (let i = 0; i < shown.length; i += ROWS_ON_PAPER) parts.push(shown.slice(i, i + ROWS_ON_PAPER));
  return { parts, leftOut: trace.panels.length - shown.length };
}

/** The worst recordings whose plots are printed, on at most so many pages; at least one. */
function tracesOnPaper(traces, most) {
  let pages = 0;
  const last = traces.findIndex((trace) => (pages += panelsOnPaper(trace).parts.length) >= most);
  return last < 0 ? traces : traces.slice(0, last + 1);
}

/** On how many pages plots are to be printed: what the address says, else PAGES_OF_PLOTS. */
function pagesAsked() {
  const asked = IN_ADDRESS.exec(location.hash);
  if (!asked) return PAGES_OF_PLOTS;
  return asked[1] === "all" ? Infinity : Number(asked[1]);
}

/** Let readers choose on how many pages plots are printed, if they may need more; returns what is chosen. */
function makePrintChoice(data) {
  const host = document.querySelector('.controls[data-for="print"]');
  const pages = data.failed.length * Math.ceil(data.detectors.length / ROWS_ON_PAPER);
  if (!host || pages <= PAGES_OF_PLOTS) return pagesAsked;
  let chosen = null;
  const label = make(host, "label", {}, "Pages of trigger plots when printed: ");
  const select = make(label, "select");
  for (const most of CHOICES) make(select, "option", { value: most }, most === Infinity ? "all" : `at most ${most}`);
  select.value = CHOICES.find((most) => most >= pagesAsked());
  select.addEventListener("change", () => {
    chosen = Number(select.value);
  });
  return () => chosen ?? pagesAsked();
}

/** Draw a plot, or several with five detectors each, of the worst traces on at most so many pages; none if 0. */
function printFailed(data, failed, most) {
  const host = document.getElementById("printed-plots");
  if (!host) return;
  host.replaceChildren();
  const traces = most ? tracesOnPaper(failed, most) : [];
  const cut = failed.length - traces.length;
  document.getElementById("printed-cut").textContent = cut
    ? `The ${traces.length} worst of ${counted(failed.length, "trigger plot")} are printed here. The other ${cut} are on ` +
      "the screen: click a recording in the first table. To print more, choose the number of pages above that table, " +
      "or end the address of the report with #print-pages=all."
    : "";
  for (const trace of traces) {
    const { parts, leftOut } = panelsOnPaper(trace);
    parts.forEach((panels, i) => {
      const figure = make(host, "figure");
      const part = parts.length > 1 ? `, part ${i + 1} of ${parts.length}` : "";
      make(figure, "h3", {}, `${trace.recording || "(no name)"}${part}`);
      const words = [...trace.words];
      if (leftOut) words.push(`${counted(leftOut, "other detector")} left out`);
      make(figure, "p", { class: "note" }, words.join(" · "));
      const forced = trace.times.length > 0 ? PAPER_HEIGHTS.force : 0;
      const height = forced + PAPER_HEIGHTS.row * panels.length + PAPER_HEIGHTS.axis;
      const svg = draw(figure, "svg", { class: "plot", height, role: "img", "data-width": PAPER_WIDTH });
      svg.setAttribute("aria-label", `Load cell and detectors over time, ${trace.recording}`);
      new Chart(svg, tracePlan({ ...data, heights: PAPER_HEIGHTS }, { ...trace, panels }));
    });
  }
}
