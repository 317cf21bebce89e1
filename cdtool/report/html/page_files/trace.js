// One recording: the load cell on top, below it a row per detector with signal, band, limits and alarm.

const HEAD = 26,
  GAP = 10;
const HEADROOM = 1.5;
const HATCHES = {
  1: "M0 8L8 0",
  2: "M0 8L8 0M0 0L8 8",
  3: "M1 2h2M5 6h2",
  4: "M0 0L8 8",
  5: "M4 0V8",
  6: "M0 4H8",
};
const LONGEST_LABEL = 40;

/** A trace with its curves as numbers. */
function readTrace(text) {
  const trace = JSON.parse(text);
  trace.times = unpack(trace.force_time);
  trace.values = unpack(trace.force);
  for (const panel of trace.panels) {
    for (const name of ["time", "value", "lower", "upper"]) panel[name] = unpack(panel[name]);
    panel.status = Uint8Array.from(panel.status.flatMap(([code, count]) => Array(count).fill(code)));
  }
  return trace;
}

function shownContact(trace) {
  return trace.contact >= 0 ? trace.contacts[trace.contact] : null;
}

/** Intervals of samples that are not assessable: first and last time, and the number of the reason. */
function notAssessed(panel) {
  const found = [];
  for (let i = 0; i < panel.status.length; i += 1) {
    const code = panel.status[i];
    if (!code) continue;
    let end = i;
    while (end + 1 < panel.status.length && panel.status[end + 1] === code) end += 1;
    found.push({ code, from: panel.time[i], to: panel.time[Math.min(end + 1, panel.time.length - 1)] });
    i = end;
  }
  return found;
}

/** The vertical range: all limits and valid values in view, excursions up to some bands beyond. */
function frame(panel, first, last) {
  const values = [],
    bounds = [];
  for (let i = first; i < last; i += 1) {
    const value = panel.value[i],
      judged = panel.status[i] === 0;
    const limits = [panel.lower[i], panel.upper[i]].filter(Number.isFinite);
    for (const limit of limits) bounds.push(limit);
    if (!Number.isFinite(value) || !judged) continue;
    values.push(value);
    if (value >= panel.lower[i] && value <= panel.upper[i]) bounds.push(value);
  }
  if (!values.length)
    for (let i = first; i < last; i += 1) if (Number.isFinite(panel.value[i])) values.push(panel.value[i]);
  const all = values.concat(bounds);
  if (!all.length) return [-1, 1];
  let [low, high] = [leastOf(all), mostOf(all)];
  if (bounds.length) {
    const [near, far] = [leastOf(bounds), mostOf(bounds)];
    const room = HEADROOM * Math.max(far - near, 1e-12);
    low = Math.max(low, near - room);
    high = Math.min(high, far + room);
  }
  const margin = 0.08 * (high - low) || 0.5 * Math.abs(high) || 1;
  return [low - margin, high + margin];
}

function tracePlan(data, trace) {
  const { heights } = data;
  const contact = shownContact(trace);
  const forced = trace.times.length > 0;
  const margin = { left: 50, right: 10, top: 0, bottom: heights.axis };
  const rows = trace.panels;
  const first = forced ? heights.force : 0;

  /** A curve with a break where a sample is missing. */
  function line(chart, times, values, y, from, to, keep = () => true) {
    let path = "",
      down = false;
    for (let i = from; i < to; i += 1) {
      const drawn = Number.isFinite(values[i]) && keep(i);
      if (drawn) path += `${down ? "L" : "M"}${chart.x(times[i]).toFixed(1)} ${y(values[i]).toFixed(1)}`;
      down = drawn;
    }
    return path;
  }

  function part(chart, times) {
    const [low, high] = chart.view;
    return [Math.max(placeOf(times, low) - 1, 0), Math.min(placeOf(times, high) + 1, times.length)];
  }

  function area(top, height, low, high) {
    const from = top + HEAD,
      to = top + height - GAP;
    // A browser does not draw far beyond the screen.
    return { from, to, y: (value) => Math.min(Math.max(to - ((value - low) / (high - low)) * (to - from), -1e5), 1e5) };
  }

  function levels(chart, place, low, high) {
    const ticks = ticksOf(low, high, 3);
    for (const tick of ticks.values) {
      const y = place.y(tick);
      if (y < place.from || y > place.to) continue;
      draw(
        chart.front,
        "text",
        { class: "small", x: margin.left - 6, y: y + 4, "text-anchor": "end" },
        tickWords(tick, ticks.step),
      );
      draw(chart.layer, "path", { class: "axis", d: `M${margin.left} ${y.toFixed(1)}H${chart.right}` });
    }
  }

  function drawForce(chart) {
    const [from, to] = part(chart, trace.times);
    const seen = trace.values.subarray(from, to).filter(Number.isFinite);
    const limits = (data.force || []).find((panel) => panel.group === trace.words[0])?.steps ?? [];
    const least = leastOf(seen, 0),
      most = endOf(mostOf(seen, 1), 3);
    const place = area(0, heights.force, least, most);
    draw(chart.front, "text", { class: "strong", x: 0, y: 13 }, "load cell [N]");
    levels(chart, place, least, most);
    if (contact && limits.length) {
      const side = -least > mostOf(seen, 0) ? -1 : 1;
      const path = limits.map(
        ([from, most], i) => `${i ? "H" : "M"}${chart.x(contact.start + from)}${i ? "V" : " "}${place.y(side * most)}`,
      );
      draw(chart.layer, "path", { class: "limit", d: `${path.join("")}H${chart.right}` });
    }
    draw(chart.layer, "path", { class: "force", d: line(chart, trace.times, trace.values, place.y, from, to) });
  }

  function drawRow(chart, panel, place) {
    const detector = data.detectors[panel.detector];
    const top = first + heights.row * place;
    const [from, to] = part(chart, panel.time);
    const [low, high] = frame(panel, from, to);
    const box = area(top, heights.row, low, high);
    const [words, reason] = panel.words;
    const joint = trace.joints > 1 ? ` · ${panel.joint}` : "";
    const letters = Math.floor(chart.width / 8) - words.length;
    draw(
      chart.front,
      "text",
      { class: "strong", x: 0, y: top + 13 },
      shorten(`${detector.name} [${panel.unit}]${joint}`, Math.max(Math.min(letters, LONGEST_LABEL), 12)),
    );
    const verdict = draw(chart.front, "text", { x: chart.right, y: top + 13, "text-anchor": "end" });
    const room = Math.floor(chart.width / 7) - 46;
    if (reason && room > 12) draw(verdict, "tspan", { class: "small" }, `${shorten(reason, Math.min(room, 90))}  `);
    draw(verdict, "tspan", { class: "strong" }, words);
    const layer = chart.clipped(chart.layer, box.from, box.to);
    drawBand(layer, chart, panel, box, from, to);
    levels(chart, box, low, high);
    drawTrigger(chart, panel, detector, box);
    drawNotAssessed(chart, panel, box);
    const group = tint(draw(layer, "g"), detector);
    draw(layer, "path", {
      class: "not-assessed",
      d: line(chart, panel.time, panel.value, box.y, from, to, (i) => panel.status[i] !== 0),
    });
    draw(group, "path", {
      class: "line",
      d: line(chart, panel.time, panel.value, box.y, from, to, (i) => panel.status[i] === 0),
    });
    for (const limit of [panel.lower, panel.upper]) {
      draw(layer, "path", { class: "limit", d: line(chart, panel.time, limit, box.y, from, to) });
    }
  }

  function drawBand(layer, chart, panel, box, from, to) {
    let path = "",
      i = from;
    const held = (at) =>
      panel.status[at] === 0 &&
      !Number.isNaN(panel.lower[at]) &&
      !Number.isNaN(panel.upper[at]) &&
      (Number.isFinite(panel.lower[at]) || Number.isFinite(panel.upper[at]));
    const edge = (value) => (value === Infinity ? box.from : value === -Infinity ? box.to : box.y(value));
    while (i < to) {
      const begin = i;
      while (i < to && held(i)) i += 1;
      const points = [];
      for (let k = begin; k < i; k += 1)
        points.push(`${chart.x(panel.time[k]).toFixed(1)} ${edge(panel.upper[k]).toFixed(1)}`);
      for (let k = i - 1; k >= begin; k -= 1)
        points.push(`${chart.x(panel.time[k]).toFixed(1)} ${edge(panel.lower[k]).toFixed(1)}`);
      if (points.length) path += `M${points.join("L")}Z`;
      i += 1;
    }
    draw(layer, "path", { class: "band", d: path });
  }

  function drawNotAssessed(chart, panel, box) {
    for (const { code, from, to } of notAssessed(panel)) {
      const left = Math.max(chart.x(from), margin.left),
        width = Math.min(chart.x(to), chart.right) - left;
      if (width < 1) continue;
      draw(chart.layer, "rect", {
        x: left,
        y: box.from,
        width,
        height: box.to - box.from,
        fill: `url(#${chart.hatch}-${code})`,
      });
      const reason = data.reasons[code];
      const words = [`not assessable: ${reason}`, reason].find((text) => text.length * 6.2 + 8 < width);
      if (words) draw(chart.front, "text", { class: "small halo", x: left + 4, y: box.to - 4 }, words);
    }
  }

  function drawTrigger(chart, panel, detector, box) {
    const group = tint(draw(chart.layer, "g"), detector);
    const height = box.to - box.from;
    for (const time of panel.alarms) {
      draw(group, "path", {
        class: panel.false_alarms.includes(time) ? "alarm false" : "alarm",
        d: `M${chart.x(time).toFixed(1)} ${box.from}v${height}`,
      });
    }
    for (const [from, to] of panel.held) {
      const left = Math.max(chart.x(from), margin.left);
      const right = Math.min(chart.x(to), chart.right);
      if (right > left) draw(group, "rect", { class: "trigger", x: left, y: box.from, width: right - left, height });
    }
  }

  function drawOnsets(chart) {
    for (const { start } of trace.contacts) {
      draw(chart.layer, "path", {
        class: "onset",
        d: `M${chart.x(start).toFixed(1)} ${forced ? HEAD : 0}V${chart.bottom}`,
      });
    }
  }

  return {
    whole: [trace.start, trace.end],
    home: trace.view,
    log: false,
    margin,
    offset: contact ? contact.start : 0,
    scale: contact ? 1e3 : 1,
    label: contact ? data.axes.time : "time [s]",
    draw(chart) {
      const defs = draw(chart.svg, "defs");
      // Another plot's pattern would not be drawn while that plot is hidden.
      chart.hatch = `hatch-${(clipCount += 1)}`;
      for (const [code, d] of Object.entries(HATCHES)) {
        const pattern = draw(defs, "pattern", {
          id: `${chart.hatch}-${code}`,
          class: "hatch",
          width: 8,
          height: 8,
          patternUnits: "userSpaceOnUse",
        });
        draw(pattern, "path", { d });
      }
      if (forced) drawForce(chart);
      rows.forEach((panel, place) => drawRow(chart, panel, place));
      drawOnsets(chart);
    },
    probe(chart, x, y) {
      if (x < margin.left || x > chart.right || y > chart.bottom) return null;
      const time = chart.valueAtPixel(x);
      const when = contact ? `${numberText(1e3 * (time - contact.start), 4)} ms from onset` : `${time.toFixed(3)} s`;
      const force = () => numberText(valueAt(trace.times, trace.values, time));
      if (y < first) return { x, y, words: `${when}\nload cell ${force()} N` };
      const panel = rows[Math.floor((y - first) / heights.row)];
      if (!panel) return null;
      const i = Math.max(placeOf(panel.time, time) - 1, 0);
      const status = panel.status[i] ? `not assessable: ${data.reasons[panel.status[i]]}` : "";
      const limits = [panel.lower[i], panel.upper[i]].map((limit) =>
        Number.isFinite(limit) ? numberText(limit) : "none",
      );
      const words = [
        when,
        `${data.detectors[panel.detector].name}: ${numberText(panel.value[i])} ${panel.unit}`,
        `limits: ${limits[0]} to ${limits[1]}`,
        status,
      ];
      return { x, y, words: words.filter(Boolean).join("\n") };
    },
  };
}

/** The panel with the trigger plot of one recording; returns open(number) to show a trace. */
function makeViewer(data, sources, opened) {
  const viewer = document.getElementById("viewer");
  const svg = document.getElementById("viewer-plot");
  const read = new Map();
  let chart = null,
    current = -1;
  const traceAt = (number) => {
    if (!read.has(number)) read.set(number, readTrace(sources[number].textContent));
    return read.get(number);
  };

  function open(number, travel = true) {
    const trace = traceAt(number);
    current = number;
    viewer.hidden = false;
    svg.setAttribute("height", trace.height);
    if (chart) chart.replace(tracePlan(data, trace));
    else chart = new Chart(svg, tracePlan(data, trace));
    tell(trace, number);
    opened(number);
    if (!travel) return;
    viewer.scrollIntoView({ block: "start" });
    document.getElementById("viewer-title").focus({ preventScroll: true });
  }

  function tell(trace, number) {
    const words = [...trace.words];
    words.push(`plot ${number + 1} of ${sources.length}${trace.chosen ? `: ${trace.chosen}` : ""}`);
    document.getElementById("viewer-title").textContent = trace.recording || "(no name)";
    document.getElementById("viewer-words").textContent = words.join(" · ");
    const list = document.getElementById("viewer-why");
    list.replaceChildren();
    for (const panel of trace.panels) {
      if (panel.why.length === 0) continue;
      const item = make(list, "li", {});
      make(item, "strong", {}, data.detectors[panel.detector].name);
      for (const line of panel.why) make(item, "p", {}, line);
    }
    viewer.querySelector('[data-do="before"]').disabled = number === 0;
    viewer.querySelector('[data-do="after"]').disabled = number === sources.length - 1;
  }

  const actions = {
    in: () => chart.zoom(1 / ZOOM_STEP),
    out: () => chart.zoom(ZOOM_STEP),
    left: () => chart.pan(-0.25),
    right: () => chart.pan(0.25),
    home: () => chart.home(),
    whole: () => chart.all(),
    before: () => open(current - 1, false),
    after: () => open(current + 1, false),
  };
  for (const button of viewer.querySelectorAll("[data-do]")) {
    button.addEventListener("click", actions[button.dataset.do]);
  }
  makeTraceLegend(document.getElementById("viewer-legend"));
  return { open, traceAt };
}

function makeTraceLegend(host) {
  const marks = [
    ["onset", "M0 6H26", "contact onset"],
    ["limit", "M0 6H26", "limit"],
    ["band", "M0 0H26V12H0Z", "normal band"],
    ["not-assessed", "M0 12L12 0M8 12L20 0M16 12L26 2", "not assessable"],
  ];
  for (const [kind, d, words] of marks) {
    const entry = make(host, "span");
    const svg = draw(entry, "svg", { class: "plot swatch", width: 26, height: 12, "aria-hidden": "true" });
    draw(svg, "path", { class: kind, d });
    make(entry, "span", {}, words);
  }
  for (const words of [
    "coloured line: signal",
    "coloured vertical line: alarm, dashed where it is false",
    "shaded from an alarm until it is re-armed: trigger on",
  ])
    make(host, "span", {}, words);
}
