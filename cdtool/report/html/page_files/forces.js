// The force of single contacts over the time since their onset, with its stepped limits.

function forcePlan(data, panel, openTrace) {
  const curves = panel.curves.map((item) => ({ ...item, times: unpack(item.times), force: unpack(item.force) }));
  const [worst] = curves;
  const peakAt = worst.times[worst.force.indexOf(mostOf(worst.force))];
  const ends = curves.map((curve) => curve.times[curve.times.length - 1]);
  const steps = panel.steps.map(([from, most, name]) => ({ from: 1e3 * from, most, name }));
  const end = 1.05 * Math.max(...ends, 1.2 * steps[steps.length - 1].from, 1);
  const home = Math.min(end, 1.3 * Math.max(100, peakAt, ...worst.alarms.map(({ late }) => late)));
  const margin = { left: 52, right: 14, top: 22, bottom: 44 };
  const highest = endOf(Math.max(...curves.map((curve) => mostOf(curve.force)), 1.1 * steps[0].most), 5);
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
    chart.layer.append(chart.layer.querySelector(".worst"));
    for (const { detector, late } of worst.alarms) {
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
        worst.exceeded,
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
      const words = [
        curve.name,
        `${numberText(force)} N at ${numberText(time)} ms`,
        `${curve.verdict}${curve.budget === null ? "" : `: ${curve.exceeded}`}`,
        ...curve.alarms.map(({ detector, text }) => `alarm ${data.detectors[detector].name} ${text} ms`),
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
  make(worst, "span", {}, "worst contact");
  const others = make(host, "span");
  draw(draw(others, "svg", { class: "plot swatch", "aria-hidden": "true" }), "path", { class: "other", d: "M0 6H26" });
  make(others, "span", {}, "other contacts");
  for (const number of [...new Set(plans)].sort((a, b) => a - b)) {
    const entry = make(host, "span");
    markerOf(entry, data.detectors[number]);
    make(entry, "span", {}, `alarm ${data.detectors[number].name}`);
  }
}
