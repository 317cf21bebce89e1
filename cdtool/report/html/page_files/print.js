// Trigger plots of failed recordings on paper: drawn before the page is printed, removed after it.

// The width of an A4 page in landscape format without its margins, and heights that let one plot fit under its title [px].
const PAPER_WIDTH = 1030;
const PAPER_HEIGHTS = { force: 100, row: 78, axis: 44 };
const ROWS_ON_PAPER = 5;

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

/** Draw a plot, or several with five detectors each, per trace; without traces remove them all. */
function printFailed(data, traces) {
  const host = document.getElementById("printed-plots");
  if (!host) return;
  host.replaceChildren();
  for (const trace of traces) {
    const { parts, leftOut } = panelsOnPaper(trace);
    parts.forEach((panels, i) => {
      const figure = make(host, "figure");
      const part = parts.length > 1 ? `, part ${i + 1} of ${parts.length}` : "";
      make(figure, "h3", {}, `${trace.recording || "(no name)"}${part}`);
      const words = wordsOf(trace);
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
