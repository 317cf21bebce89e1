// Names with colours and markers; a click on a name hides its curve in all plots below it.

/** A small picture of a detector's marker. */
function markerOf(parent, detector) {
  const svg = draw(parent, "svg", { width: 14, height: 14, "aria-hidden": "true" });
  tint(draw(draw(svg, "g"), "path", { class: "mark", d: outline(detector.marker, 7, 7, 5) }).parentNode, detector);
}

/** Buttons for the detectors that plots show; returns the set of those that are hidden. */
function makeLegend(host, detectors, shown, changed) {
  const hidden = new Set();
  for (const number of shown) {
    const button = make(host, "button", { type: "button", "aria-pressed": "true" });
    markerOf(button, detectors[number]);
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
