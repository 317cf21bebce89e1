// The force of single contacts over the time since their onset, with its stepped limits.

/** The part of a trace's load-cell curve that belongs to one contact, turned so that it presses upward. */
function forceCurve(trace, item) {
  const onset = trace.contacts[item.contact].start;
  const next = trace.contacts[item.contact + 1];
  const from = placeOf(trace.times, onset),
    to = next ? placeOf(trace.times, next.start) : trace.times.length;
  const times = trace.times.subarray(from, to).map((time) => 1e3 * (time - onset));
  const raw = trace.values.subarray(from, to);
  const low = leastOf(raw, 0),
    high = mostOf(raw, 0);
  const force = -low > high ? raw.map((value) => -value) : raw;
  return { ...item, times, force, onset, highest: Math.max(high, -low), record: trace };
}

/** When the detectors of a trace raised the alarm for one of its contacts [ms after the onset]. */
function alarmsOf(curve) {
  return curve.record.panels
    .map((panel) => ({ detector: panel.detector, seen: panel.seen[curve.contact] }))
    .filter(({ seen }) => seen && seen.outcome === "detected")
    .map(({ detector, seen }) => ({ detector, late: 1e3 * (seen.alarm - curve.onset) }));
}

function forcePlan(data, panel, readTrace, openTrace) {
  const curves = panel.curves
    .map((item) => forceCurve(readTrace(item.trace), item))
    .filter((curve) => curve.times.length > 1);
  const worst = curves.reduce((a, b) => (b.highest > a.highest ? b : a), curves[0]);
  const alarms = worst ? alarmsOf(worst) : [];
  const peakAt = worst ? worst.times[worst.force.indexOf(mostOf(worst.force))] : 0;
  const ends = curves.map((curve) => curve.times[curve.times.length - 1]);
  const steps = panel.steps.map(([from, most, name]) => ({ from: 1e3 * from, most, name }));
  const end = 1.05 * Math.max(...ends, 1.2 * steps[steps.length - 1].from, 1);
  const home = Math.min(end, 1.3 * Math.max(100, peakAt, ...alarms.map(({ late }) => late)));
  const margin = { left: 52, right: 14, top: 22, bottom: 44 };
  const highest = 1.1 * Math.max(...curves.map((curve) => curve.highest), 1.15 * steps[0].most);
  const y = (force) => margin.top + (1 - Math.max(force, 0) / highest) * (panel.height - margin.top - margin.bottom);
  const limitAt = (time) => steps.filter((step) => step.from <= time).pop().most;

  function drawStaircase(chart) {
    const path = steps
      .map((step, i) => `${i ? "H" : "M"}${chart.x(step.from)}${i ? "V" : " "}${y(step.most)}`)
      .join("");
    const stairs = `${path}H${chart.x(end)}`;
    draw(chart.layer, "path", { class: "band", d: `${stairs}V${chart.bottom}H${chart.x(0)}Z` });
    draw(chart.layer, "path", { class: "limit", d: stairs });
  }

  /** Each limit's name at the right end of its step, as far as that is in view. */
  function nameSteps(chart) {
    steps.forEach((step, i) => {
      const ends = Math.min(i + 1 < steps.length ? chart.x(steps[i + 1].from) : chart.right, chart.right);
      if (ends - Math.max(chart.x(step.from), margin.left) < 110) return;
      draw(
        chart.layer,
        "text",
        { class: "small halo", x: ends - 6, y: y(step.most) - 5, "text-anchor": "end" },
        `${step.name} ≤ ${step.most} N`,
      );
    });
  }

  function drawCurves(chart) {
    for (const curve of curves) {
      const points = Array.from(
        curve.times,
        (time, i) => `${chart.x(time).toFixed(1)} ${y(curve.force[i]).toFixed(1)}`,
      );
      draw(chart.layer, "path", { class: curve === worst ? "worst" : "other", d: `M${points.join("L")}` });
    }
    if (!worst) return;
    chart.layer.append(chart.layer.querySelector(".worst"));
    for (const { detector, late } of alarms) {
      const group = tint(draw(chart.layer, "g"), data.detectors[detector]);
      const force = valueAt(worst.times, worst.force, Math.max(late, worst.times[0]));
      draw(group, "path", {
        class: "mark",
        d: outline(data.detectors[detector].marker, chart.x(Math.max(late, 0)), y(force), 5),
      });
    }
    if (worst.budget !== null) {
      const [x, at] = [chart.x(worst.budget), y(limitAt(worst.budget))];
      const after = x < 0.6 * chart.right;
      draw(chart.layer, "circle", { class: "ring", cx: x, cy: at, r: 4 });
      draw(
        chart.layer,
        "text",
        {
          class: "small worst-note halo",
          x: after ? x + 8 : x - 8,
          y: at + 15,
          "text-anchor": after ? "start" : "end",
        },
        `exceeded after ${numberText(worst.budget)} ms`,
      );
    }
  }

  return {
    whole: [0, end],
    home: [0, home],
    log: false,
    margin,
    label: data.axes.time,
    draw(chart) {
      drawStaircase(chart);
      chart.drawLevels(y, 0, highest, 5, margin.top);
      draw(chart.front, "text", { class: "small", x: 0, y: 10 }, data.axes.force);
      drawCurves(chart);
      nameSteps(chart);
    },
    probe(chart, x, pointerY) {
      if (x < margin.left || x > chart.right) return null;
      const time = chart.valueAtPixel(x);
      let best = null,
        distance = NEAR;
      for (const curve of curves) {
        const force = valueAt(curve.times, curve.force, time);
        const off = Math.abs(y(force) - pointerY);
        if (off < distance) [best, distance] = [{ curve, force }, off];
      }
      if (!best) return null;
      const { curve, force } = best;
      const late = alarmsOf(curve).map(
        (alarm) => `alarm ${data.detectors[alarm.detector].name} ${numberText(alarm.late)} ms`,
      );
      const words = [
        `${curve.record.recording}, contact ${curve.contact + 1}`,
        `${numberText(force)} N at ${numberText(time)} ms`,
        `${curve.verdict.replace("_", " ")}${curve.budget === null ? "" : `: first limit exceeded after ${numberText(curve.budget)} ms`}`,
        ...late,
        "click: trigger plot",
      ];
      return { x, y: y(force), mark: true, words: words.join("\n"), open: () => openTrace(curve.trace) };
    },
  };
}

/** The legend of the force plots: the alarms on the coloured curves. */
function makeForceLegend(host, data, plans) {
  const worst = make(host, "span");
  draw(draw(worst, "svg", { class: "plot swatch", "aria-hidden": "true" }), "path", { class: "worst", d: "M0 6H26" });
  make(worst, "span", {}, "highest peak");
  const others = make(host, "span");
  draw(draw(others, "svg", { class: "plot swatch", "aria-hidden": "true" }), "path", { class: "other", d: "M0 6H26" });
  make(others, "span", {}, "other contacts");
  for (const number of [...new Set(plans)].sort((a, b) => a - b)) {
    const entry = make(host, "span");
    markerOf(entry, data.detectors[number]);
    make(entry, "span", {}, `alarm ${data.detectors[number].name}`);
  }
}
