// Names with colours and markers; a click on a name hides its curve in all plots below it.

/** A small picture of a detector's marker, with its line where a legend is of curves. */
function markerOf(parent, detector, line = false) {
  const width = line ? 34 : 14;
  const group = tint(draw(draw(parent, "svg", { width, height: 14, "aria-hidden": "true" }), "g"), detector);
  if (line) draw(group, "path", { class: "line dashed", d: `M0 7H${width}` });
  draw(group, "path", { class: "mark", d: outline(detector.marker, width / 2, 7, 5) });
}

/** Buttons for the detectors that plots show; returns the set of those that are hidden. */
function makeLegend(host, detectors, shown, changed) {
  const hidden = new Set();
  for (const number of shown) {
    const button = make(host, "button", { type: "button", "aria-pressed": "true" });
    markerOf(button, detectors[number], true);
    make(button, "span", {}, detectors[number].name);
    button.addEventListener("click", () => {
      if (!hidden.delete(number)) hidden.add(number);
      button.setAttribute("aria-pressed", String(!hidden.has(number)));
      changed();
    });
  }
  return hidden;
}

/** The detectors with a row in any of the panels, in their order. */
function detectorsIn(panels) {
  return [...new Set(panels.flatMap((panel) => panel.rows.map((row) => row.detector)))].sort((a, b) => a - b);
}
