// Latencies, the share still undetected, and latency against false alarms: one chart per group of contacts.

const GOLDEN = 0.6180339887;
const NEAR = 14;
const MOST_BANDS = 3;

/** The rows whose detectors are not hidden. */
function visible(panel, hidden) {
  return panel.rows.filter((row) => !hidden.has(row.detector));
}

function recordingName(data, number) {
  return number < 0 ? "a recording that is not listed" : data.recordings[number];
}

/** The median of a lane, and its interval if it has one; without an upper end it is written where it begins. */
function drawMedian(chart, { median: [middle, low, high], open }, y, clamp) {
  if (middle !== null) {
    const x = chart.x(clamp(middle));
    draw(chart.layer, "path", { class: "median", d: `M${x} ${y - 12}V${y + 12}` });
  }
  if (open) {
    const x = chart.x(clamp(open[0]));
    draw(chart.layer, "path", { class: "open-end", d: `M${x} ${y + 6}V${y + 17}` });
    const isRight = x > 0.5 * chart.width;
    const at = { class: "small halo", x: isRight ? x - 6 : x + 6, y: y + 16, "text-anchor": isRight ? "end" : "start" };
    draw(chart.layer, "text", at, open[1]);
  } else if (middle !== null && low !== undefined && low !== null && high !== null) {
    draw(chart.layer, "path", { class: "median", d: `M${chart.x(clamp(low))} ${y}H${chart.x(clamp(high))}` });
  }
}

/** A mark per contact in its detector's lane, with the median and its interval. */
function latencyPlan(data, panel, openRecording) {
  const { ticks, log } = data.scales.latency;
  const whole = [ticks[0], ticks[ticks.length - 1]];
  const floored = log && panel.rows.some((row) => row.latency.some((value) => value < whole[0]));
  const isBeyond = (value) => value > whole[1];
  const beyond = panel.rows.some((row) => row.watched.some(isBeyond));
  const margin = { left: 10, right: beyond ? 64 : 18, top: 0, bottom: 44 };
  const lane = (panel.height - margin.bottom) / panel.rows.length;
  const clamp = (value) => Math.max(value, whole[0]);
  const placeOfTime = (chart, value) => (isBeyond(value) ? chart.right + 36 : chart.x(clamp(value)));
  const spread = (i) => 18 * ((i * GOLDEN) % 1) - 9;
  const heightOf = (row, i) => lane * row + 46 + spread(i);

  function drawLane(chart, row, place) {
    const detector = data.detectors[row.detector];
    const top = lane * place;
    if (place) draw(chart.front, "path", { class: "axis", d: `M10 ${top}H${chart.right}` });
    const letters = Math.floor((chart.width - 24) / 7);
    draw(
      chart.front,
      "text",
      { class: "strong", x: 10, y: top + 15 },
      shorten(detector.name, Math.min(28, letters - 10)),
    );
    draw(chart.front, "text", { class: "small", x: chart.right, y: top + 15, "text-anchor": "end" }, row.words);
    draw(chart.front, "text", { class: "small", x: 10, y: top + 29 }, row.counts);
    const group = tint(draw(chart.layer, "g"), detector);
    // Thousands of contacts have smaller marks.
    const size = Math.min(3.2, Math.max(1.1, 60 / Math.sqrt(row.latency.length + 1)));
    const marks = row.latency.map((value, i) =>
      outline(detector.marker, chart.x(clamp(value)), heightOf(place, i), size),
    );
    draw(group, "path", { class: "mark", d: marks.join("") });
    const strip = tint(draw(chart.front, "g"), detector);
    row.watched.forEach((value, i) => {
      const d = outline(detector.marker, placeOfTime(chart, value), heightOf(place, i), 3.6);
      draw(isBeyond(value) ? strip : group, "path", { class: "open", d });
    });
    drawMedian(chart, row, top + 46, clamp);
  }

  function nearest(chart, values, place, x, y) {
    let best = -1,
      distance = NEAR;
    values.forEach((value, i) => {
      const off = Math.hypot(placeOfTime(chart, value) - x, heightOf(place, i) - y);
      if (off < distance) [best, distance] = [i, off];
    });
    return { best, distance };
  }

  return {
    whole,
    home: whole,
    ticks,
    log,
    margin,
    label: `${data.axes.latency}${floored ? `; below ${whole[0]} ms drawn there` : ""}`,
    draw(chart) {
      panel.rows.forEach((row, place) => drawLane(chart, row, place));
      if (!beyond) return;
      const at = { class: "small", x: chart.right + 36, y: chart.bottom + 16, "text-anchor": "middle" };
      draw(chart.front, "text", at, `> ${whole[1]}`);
    },
    probe(chart, x, y) {
      const place = Math.floor(y / lane);
      const row = panel.rows[place];
      if (!row) return null;
      const hit = nearest(chart, row.latency, place, x, y);
      const miss = nearest(chart, row.watched, place, x, y);
      if (hit.best < 0 && miss.best < 0) return null;
      const missed = miss.distance < hit.distance;
      const i = missed ? miss.best : hit.best;
      const recording = (missed ? row.missed_recording : row.recording)[i];
      const contact = (missed ? row.missed_contact : row.contact)[i];
      const value = (missed ? row.watched : row.latency)[i];
      const open = openRecording(recording);
      const words = [
        data.detectors[row.detector].name,
        `${recordingName(data, recording)}, contact ${contact}`,
        missed ? `missed: no alarm within ${numberText(value)} ms` : `${row.texts[i]} ms`,
      ];
      if (open) words.push("click: trigger plot");
      return { x: placeOfTime(chart, value), y: heightOf(place, i), mark: true, words: words.join("\n"), open };
    },
  };
}

/** Share of the contacts still undetected over the time since the onset: a step curve per detector. */
function survivalPlan(data, panel, hidden) {
  const { ticks, log } = data.scales.survival;
  const whole = [ticks[0], ticks[ticks.length - 1]];
  // A logarithmic axis has no 0: the curve begins at its left edge.
  const xOf = (chart, time) => chart.x(Math.max(time, whole[0])).toFixed(1);
  const margin = { left: 52, right: 18, top: 10, bottom: 44 };
  const y = (share) => margin.top + (1 - share) * (panel.height - margin.top - margin.bottom);
  const stepAt = (row, time) => Math.max(placeOf(row.times, time + 1e-9) - 1, 0);

  function stepPath(chart, row, values) {
    const steps = row.times.map((time, i) => `${i ? `H${xOf(chart, time)}V` : `M${xOf(chart, time)} `}${y(values[i]).toFixed(1)}`);
    return `${steps.join("")}H${xOf(chart, row.until)}`;
  }

  function bandPath(chart, row) {
    const back = [];
    for (let i = row.times.length - 1; i >= 0; i -= 1) {
      back.push(`V${y(row.low[i]).toFixed(1)}H${xOf(chart, row.times[i])}`);
    }
    return `${stepPath(chart, row, row.high)}${back.join("")}Z`;
  }

  /** At most six markers of a detector on its curve: the first and the last fall and some between. */
  function marksOf(chart, row) {
    const { marker } = data.detectors[row.detector];
    const falls = row.times.map((_, i) => i).slice(1);
    const every = Math.max(falls.length - 1, 1) / Math.min(falls.length - 1, 5);
    const shown = falls.filter((_, i) => i === Math.round(Math.round(i / every) * every));
    return shown.map((i) => outline(marker, Number(xOf(chart, row.times[i])), y(row.share[i]), 4));
  }

  return {
    whole,
    home: whole,
    ticks,
    log,
    margin,
    label: data.axes.time,
    draw(chart) {
      chart.drawLevels(y, 0, 1, 4, margin.top, (share) => `${Math.round(100 * share)} %`);
      const rows = visible(panel, hidden);
      for (const row of rows) {
        const group = tint(draw(chart.layer, "g"), data.detectors[row.detector]);
        if (rows.length <= MOST_BANDS && row.low) draw(group, "path", { class: "shade", d: bandPath(chart, row) });
        draw(group, "path", { class: "line dashed", d: stepPath(chart, row, row.share) });
        draw(group, "path", { class: "mark", d: marksOf(chart, row).join("") });
      }
    },
    probe(chart, x, pointerY) {
      if (x < margin.left || x > chart.right || pointerY > chart.bottom) return null;
      const time = chart.valueAtPixel(x);
      const words = visible(panel, hidden).map((row) => {
        const i = stepAt(row, time);
        const monitored = time <= row.until || row.share[row.share.length - 1] === 0;
        return `${data.detectors[row.detector].name}: ${monitored ? row.words[i] : "no longer monitored"}`;
      });
      return { x, y: pointerY, words: [`${numberText(time)} ms after the onset:`, ...words].join("\n") };
    },
  };
}

/** Median latency against the rate of false alarms: a point per safety factor. */
function amocPlan(data, panel, hidden, unit) {
  const zone = 100,
    gap = 12;
  const { ticks, log } = data.scales.amoc;
  const margin = { left: 44 + zone + gap, right: 16, top: 34, bottom: 56 };
  const exposure = (row) => (unit === "hour" ? row.hours : row.operations);
  const rates = panel.rows.flatMap((row) => row.alarms.filter(Boolean).map((count) => count / exposure(row)));
  const least = Math.min(...rates, ...panel.rows.map((row) => 1 / exposure(row)));
  const range = [least / 1.4, Math.max(...rates, least * 4) * 1.4];
  const [low, high] = [ticks[0], ticks[ticks.length - 1]].map(log ? Math.log : Number);
  const y = (value) => {
    const share = ((log ? Math.log(Math.max(value, ticks[0])) : value) - low) / (high - low);
    return margin.top + (1 - share) * (panel.height - margin.top - margin.bottom);
  };
  const columnOf = (row) => margin.left - gap - zone + (zone * (panel.rows.indexOf(row) + 0.5)) / panel.rows.length;
  const xOf = (chart, row, i) => (row.alarms[i] ? chart.x(row.alarms[i] / exposure(row)) : columnOf(row));
  const yOf = (row, i) => (row.median[i] === null ? margin.top - 8 : y(row.median[i]));
  const seen = (chart, row, i) => {
    const x = xOf(chart, row, i);
    return row.alarms[i] === 0 || (x >= margin.left && x <= chart.right);
  };

  function drawCurve(chart, row) {
    const detector = data.detectors[row.detector];
    const group = tint(draw(chart.front, "g"), detector);
    let path = "",
      solid = "",
      open = "",
      outside = "";
    let down = false,
      quiet = false;
    row.factor.forEach((_, i) => {
      const shown = seen(chart, row, i);
      const [x, at] = [xOf(chart, row, i), yOf(row, i)];
      if (shown && row.median[i] !== null) {
        // No line leads from the strip of no false alarms to a rate: there is no place between them.
        const joined = down && quiet === !row.alarms[i];
        path += `${joined ? "L" : "M"}${x.toFixed(1)} ${at.toFixed(1)}`;
        const mark = outline(detector.marker, x, at, i === row.chosen ? 5 : 2.4);
        if (row.missed[i]) open += mark;
        else solid += mark;
      } else if (shown) {
        outside += outline("^", x, at, 3.2);
      }
      down = shown && row.median[i] !== null;
      quiet = !row.alarms[i];
    });
    draw(group, "path", { class: "line dashed", d: path });
    draw(group, "path", { class: "mark", d: solid });
    draw(group, "path", { class: "open", d: open });
    draw(group, "path", { class: "open", d: outside });
    if (row.chosen >= 0 && seen(chart, row, row.chosen)) {
      draw(chart.front, "circle", { class: "ring", cx: xOf(chart, row, row.chosen), cy: yOf(row, row.chosen), r: 9 });
    }
  }

  function wordsOf(row, i) {
    const per = unit === "hour" ? "hour" : "operation";
    const alarms = row.alarms[i];
    const rate = alarms ? `${numberText(alarms / exposure(row))} per ${per}` : `at most ${row.none[unit]} per ${per}`;
    const median = `median ${row.texts[i]}${row.median[i] === null ? "" : " ms"}`;
    const inUse = i === row.chosen ? " (in use)" : "";
    return [
      `${data.detectors[row.detector].name}, safety factor ${numberText(row.factor[i])}${inUse}`,
      `${median}: ${row.detected[i]} detected, ${row.missed[i]} missed, ${row.not_assessable} not assessable`,
      `${counted(alarms, "false alarm")} in ${row.operations} operations, ${numberText(row.hours)} h: ${rate}`,
    ].join("\n");
  }

  return {
    whole: range,
    home: range,
    log: true,
    margin,
    label: `false alarms per ${unit}`,
    draw(chart) {
      const left = margin.left - gap - zone;
      const strip = { class: "band", x: left, y: margin.top, width: zone, height: chart.bottom - margin.top };
      draw(chart.front, "rect", strip);
      for (const tick of ticks) {
        const at = y(tick).toFixed(1);
        draw(chart.front, "path", { class: "axis", d: `M${left} ${at}h${zone}M${margin.left} ${at}H${chart.right}` });
        const place = { class: "small", x: left - 6, y: Number(at) + 4, "text-anchor": "end" };
        draw(chart.front, "text", place, tickWords(tick, 0));
      }
      draw(chart.front, "text", { class: "small", x: 0, y: 10 }, data.axes.median);
      const fewest = panel.rows.reduce((a, b) => (exposure(b) < exposure(a) ? b : a));
      const watched = unit === "hour" ? `${numberText(fewest.hours)} h` : `${fewest.operations} operations`;
      ["0", `in ${watched}:`, `at most ${fewest.none[unit]}`].forEach((words, i) => {
        const place = { class: "small", x: left + zone / 2, y: chart.bottom + 16 + 14 * i, "text-anchor": "middle" };
        draw(chart.front, "text", place, words);
      });
      for (const row of visible(panel, hidden)) drawCurve(chart, row);
    },
    probe(chart, x, pointerY) {
      let best = null,
        distance = NEAR;
      for (const row of visible(panel, hidden)) {
        row.factor.forEach((_, i) => {
          const off = Math.hypot(xOf(chart, row, i) - x, yOf(row, i) - pointerY);
          if (off < distance && seen(chart, row, i)) {
            distance = off;
            best = { x: xOf(chart, row, i), y: yOf(row, i), mark: true, words: wordsOf(row, i) };
          }
        });
      }
      return best;
    },
  };
}

/** Two choices next to each other; calls back with the selected one. */
function makeChoice(host, words, options, changed) {
  make(host, "span", {}, words);
  options.forEach(([value, text], i) => {
    const label = make(host, "label");
    const input = make(label, "input", { type: "radio", name: words, value });
    input.checked = i === 0;
    label.append(` ${text}`);
    input.addEventListener("change", () => changed(value));
  });
}
