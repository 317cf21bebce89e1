// Latencies of more contacts than a plot can mark: one chart per group, one histogram per detector.

const BARS_TOP = 36;
const BARS_BOTTOM = 80;

/** A histogram in each detector's lane, with the median and its interval below. */
function histogramPlan(data, panel) {
  const { edges } = panel;
  const { ticks, log } = data.scales.latency;
  const margin = { left: 10, right: 18, top: 0, bottom: 44 };
  const lane = (panel.height - margin.bottom) / panel.rows.length;
  const whole = [ticks[0], ticks[ticks.length - 1]];
  const clamp = (value) => Math.max(value, edges[0]);

  function drawLane(chart, row, place) {
    const detector = data.detectors[row.detector];
    const top = lane * place;
    if (place) draw(chart.front, "path", { class: "axis", d: `M10 ${top}H${chart.right}` });
    const letters = Math.floor((chart.width - 24) / 7);
    const name = shorten(detector.name, Math.min(28, letters - 10));
    draw(chart.front, "text", { class: "strong", x: 10, y: top + 15 }, name);
    draw(chart.front, "text", { class: "small", x: chart.right, y: top + 15, "text-anchor": "end" }, row.words);
    draw(chart.front, "text", { class: "small", x: 10, y: top + 29 }, row.counts);
    const most = mostOf(row.numbers, 1);
    const bars = row.numbers.map((number, i) => {
      if (!number) return "";
      const [from, to] = [chart.x(edges[i]).toFixed(1), chart.x(edges[i + 1]).toFixed(1)];
      // A single contact is visible beside thousands.
      const height = Math.max(((BARS_BOTTOM - BARS_TOP) * number) / most, 1);
      return `M${from} ${top + BARS_BOTTOM}V${(top + BARS_BOTTOM - height).toFixed(1)}H${to}V${top + BARS_BOTTOM}Z`;
    });
    draw(tint(draw(chart.layer, "g"), detector), "path", { class: "bar", d: bars.join("") });
    drawMedian(chart, row, top + BARS_BOTTOM, clamp);
  }

  return {
    whole,
    home: whole,
    ticks,
    log,
    margin,
    label: data.axes.latency,
    draw: (chart) => panel.rows.forEach((row, place) => drawLane(chart, row, place)),
    probe(chart, x, y) {
      const row = panel.rows[Math.floor(y / lane)];
      if (!row || x < margin.left || x > chart.right) return null;
      const i = placeOf(edges, chart.valueAtPixel(x)) - 1;
      if (i < 0 || i >= row.numbers.length) return null;
      const words = [
        data.detectors[row.detector].name,
        `${counted(row.numbers[i], "contact")} after ${numberText(edges[i])} to ${numberText(edges[i + 1])} ms`,
      ];
      return { x, y, words: words.join("\n") };
    },
  };
}
