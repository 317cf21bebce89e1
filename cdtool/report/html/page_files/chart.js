// A plot whose horizontal axis can be zoomed by dragging, wheel, keys and buttons, with a tooltip at the pointer.

const SVG = "http://www.w3.org/2000/svg";
const SMALLEST_SHARE = 1e-5;
const ZOOM_STEP = 1.5;
const DRAGGED = 5;
let clipCount = 0;

/** A new SVG element. Text is only ever set as text. */
function draw(parent, name, attributes = {}, words = null) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (words !== null) element.textContent = words;
  parent.append(element);
  return element;
}

/** A new HTML element. */
function make(parent, name, attributes = {}, words = null) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (words !== null) element.textContent = words;
  parent.append(element);
  return element;
}

/** Give an element a detector's look. */
function tint(element, detector) {
  element.classList.add("detector");
  for (const name of ["colour", "dark", "dashes"]) if (detector[name]) element.style.setProperty(`--${name}`, detector[name]);
  return element;
}

function shorten(words, most) {
  const tail = (most - 1) >> 1;
  return words.length <= most ? words : `${words.slice(0, most - 1 - tail)}…${words.slice(words.length - tail)}`;
}

const SHAPES = {
  s: [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ],
  D: [
    [0, -1.25],
    [1.25, 0],
    [0, 1.25],
    [-1.25, 0],
  ],
  "^": [
    [0, -1.2],
    [1.15, 1],
    [-1.15, 1],
  ],
  v: [
    [0, 1.2],
    [1.15, -1],
    [-1.15, -1],
  ],
  ">": [
    [1.2, 0],
    [-1, 1.15],
    [-1, -1.15],
  ],
  "<": [
    [-1.2, 0],
    [1, 1.15],
    [1, -1.15],
  ],
  p: [
    [0, -1.2],
    [1.14, -0.37],
    [0.7, 1],
    [-0.7, 1],
    [-1.14, -0.37],
  ],
  h: [
    [0, -1.2],
    [1.04, -0.6],
    [1.04, 0.6],
    [0, 1.2],
    [-1.04, 0.6],
    [-1.04, -0.6],
  ],
  P: [
    [-0.4, -1.2],
    [0.4, -1.2],
    [0.4, -0.4],
    [1.2, -0.4],
    [1.2, 0.4],
    [0.4, 0.4],
    [0.4, 1.2],
    [-0.4, 1.2],
    [-0.4, 0.4],
    [-1.2, 0.4],
    [-1.2, -0.4],
    [-0.4, -0.4],
  ],
  X: [
    [-1.1, -0.5],
    [-0.5, -1.1],
    [0, -0.6],
    [0.5, -1.1],
    [1.1, -0.5],
    [0.6, 0],
    [1.1, 0.5],
    [0.5, 1.1],
    [0, 0.6],
    [-0.5, 1.1],
    [-1.1, 0.5],
    [-0.6, 0],
  ],
};

/** The outline of a marker: thousands of them are one path, which a browser draws fast. */
function outline(marker, x, y, size) {
  const shape = SHAPES[marker];
  if (!shape) {
    const half = (width) => `a${size} ${size} 0 1 0 ${width} 0`;
    return `M${(x - size).toFixed(1)} ${y.toFixed(1)}${half(2 * size)}${half(-2 * size)}Z`;
  }
  return `M${shape.map(([dx, dy]) => `${(x + size * dx).toFixed(1)} ${(y + size * dy).toFixed(1)}`).join("L")}Z`;
}

const tooltip = document.getElementById("tooltip");

function showTooltip(words, event) {
  tooltip.textContent = words;
  tooltip.hidden = false;
  const box = tooltip.getBoundingClientRect();
  const left = event.clientX + 16 + box.width > innerWidth ? event.clientX - box.width - 12 : event.clientX + 14;
  const top = event.clientY + 18 + box.height > innerHeight ? event.clientY - box.height - 12 : event.clientY + 16;
  tooltip.style.transform = `translate(${Math.max(left, 4)}px, ${Math.max(top, 4)}px)`;
}

/**
 * plan: `whole` and `home`: the widest and the first range; `log`; `margin`; `label`; optional `offset` and `scale` of
 * what the axis writes, and the `ticks` of the first range; draw(chart) fills `chart.layer` (clipped to the data area)
 * and `chart.front`; probe(chart, x, y) returns {x, y, words, open} for the position of the pointer, or nothing.
 */
class Chart {
  constructor(svg, plan) {
    this.svg = svg;
    this.plan = plan;
    this.range = this.toAxis(plan.home);
    this.waiting = false;
    svg.addEventListener("pointerdown", (event) => this.press(event));
    svg.addEventListener("pointermove", (event) => this.move(event));
    svg.addEventListener("pointerup", (event) => this.release(event));
    svg.addEventListener("pointercancel", () => this.leave());
    svg.addEventListener("pointerleave", () => this.leave());
    svg.addEventListener("dblclick", () => this.home());
    svg.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    svg.addEventListener("keydown", (event) => this.key(event));
    this.redraw();
    if (svg.dataset.width) return; // of a fixed width, such as on paper
    new ResizeObserver(() => {
      if (Math.abs(svg.clientWidth - this.width) > 1) this.redraw();
    }).observe(svg);
  }

  /** Show something else in the same place. */
  replace(plan) {
    this.plan = plan;
    this.range = this.toAxis(plan.home);
    this.redraw();
  }

  toAxis(values) {
    return this.plan.log ? values.map((value) => Math.log10(value)) : [...values];
  }

  fromAxis(value) {
    return this.plan.log ? 10 ** value : value;
  }

  get view() {
    return this.range.map((end) => this.fromAxis(end));
  }

  get right() {
    return this.width - this.plan.margin.right;
  }

  get bottom() {
    return this.height - this.plan.margin.bottom;
  }

  /** Where a value stands [px]. */
  x(value) {
    const { left } = this.plan.margin;
    const at = this.plan.log ? Math.log10(value) : value;
    return left + ((at - this.range[0]) / (this.range[1] - this.range[0])) * (this.right - left);
  }

  /** The value at a place [px]. */
  valueAtPixel(x) {
    return this.fromAxis(this.axisAt(x));
  }

  axisAt(x) {
    const { left } = this.plan.margin;
    return this.range[0] + ((x - left) / (this.right - left)) * (this.range[1] - this.range[0]);
  }

  redraw() {
    const { svg, plan } = this;
    this.width = Number(svg.dataset.width) || svg.clientWidth || 600;
    this.height = Number(svg.getAttribute("height"));
    svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    [svg.dataset.from, svg.dataset.to] = this.view;
    svg.replaceChildren();
    this.layer = this.clipped(svg, plan.margin.top, this.bottom);
    this.front = draw(svg, "g");
    this.drawAxis();
    plan.draw(this);
    this.over = this.clipped(svg, plan.margin.top, this.bottom);
  }

  /** A group of which only what lies in the data area between two heights is seen. */
  clipped(parent, top, bottom) {
    const name = `clip-${(clipCount += 1)}`;
    const { left } = this.plan.margin;
    const area = { x: left, y: top, width: Math.max(this.right - left, 1), height: Math.max(bottom - top, 1) };
    draw(draw(draw(parent, "defs"), "clipPath", { id: name }), "rect", area);
    return draw(parent, "g", { "clip-path": `url(#${name})` });
  }

  drawAxis() {
    const { plan, front } = this;
    const { offset = 0, scale = 1 } = plan;
    const [low, high] = this.view.map((end) => (end - offset) * scale);
    const most = Math.max(2, Math.floor((this.right - plan.margin.left) / 68));
    const isHome = plan.ticks && String(this.range) === String(this.toAxis(plan.home));
    const free = () => (plan.log ? logTicksOf(low, high, most) : ticksOf(low, high, most));
    const ticks = isHome ? { values: apart(plan.ticks, (tick) => this.x(tick), 34), step: 0 } : free();
    draw(front, "path", { class: "axis", d: `M${plan.margin.left} ${this.bottom}H${this.right}` });
    for (const tick of ticks.values) {
      const x = this.x(tick / scale + offset);
      draw(front, "path", { class: "axis", d: `M${x.toFixed(1)} ${this.bottom}v4` });
      draw(
        front,
        "text",
        { class: "small", x: x.toFixed(1), y: this.bottom + 16, "text-anchor": "middle" },
        tickWords(tick, ticks.step),
      );
    }
    draw(front, "text", { class: "small", x: this.right, y: this.bottom + 33, "text-anchor": "end" }, plan.label);
  }

  /** A vertical axis with a line at each tick. */
  drawLevels(place, low, high, count, top, words = tickWords) {
    const ticks = ticksOf(low, high, count);
    const { left } = this.plan.margin;
    for (const tick of ticks.values) {
      const y = place(tick).toFixed(1);
      draw(
        this.front,
        "text",
        { class: "small", x: left - 6, y: Number(y) + 4, "text-anchor": "end" },
        words(tick, ticks.step),
      );
      draw(this.layer, "path", { class: "axis", d: `M${left} ${y}H${this.right}` });
    }
  }

  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.redraw();
    });
  }

  /** Show this range, as far as there is anything. */
  show(low, high) {
    const whole = this.toAxis(this.plan.whole);
    const span = Math.min(Math.max(high - low, SMALLEST_SHARE * (whole[1] - whole[0])), whole[1] - whole[0]);
    const from = Math.min(Math.max(low, whole[0]), whole[1] - span);
    this.range = [from, from + span];
    this.later();
  }

  zoom(factor, around = 0.5 * (this.range[0] + this.range[1])) {
    this.show(around + (this.range[0] - around) * factor, around + (this.range[1] - around) * factor);
  }

  pan(share) {
    const step = share * (this.range[1] - this.range[0]);
    this.show(this.range[0] + step, this.range[1] + step);
  }

  home() {
    this.show(...this.toAxis(this.plan.home));
  }

  all() {
    this.show(...this.toAxis(this.plan.whole));
  }

  place(event) {
    const box = this.svg.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  press(event) {
    if (event.button === 0) [this.pressed] = this.place(event);
  }

  move(event) {
    const [x, y] = this.place(event);
    this.over.replaceChildren();
    if (this.pressed === undefined) {
      this.tell(event, x, y);
      return;
    }
    if (Math.abs(x - this.pressed) < DRAGGED) return;
    this.svg.setPointerCapture(event.pointerId);
    this.dragged = true;
    const { top } = this.plan.margin;
    draw(this.over, "rect", {
      class: "selection",
      x: Math.min(x, this.pressed),
      y: top,
      width: Math.abs(x - this.pressed),
      height: this.bottom - top,
    });
    tooltip.hidden = true;
  }

  tell(event, x, y) {
    const found = this.plan.probe ? this.plan.probe(this, x, y) : null;
    if (!found) {
      tooltip.hidden = true;
      return;
    }
    if (found.mark) draw(this.over, "circle", { class: "ring", cx: found.x, cy: found.y, r: 7 });
    else draw(this.over, "path", { class: "cross", d: `M${found.x} ${this.plan.margin.top}V${this.bottom}` });
    showTooltip(found.words, event);
  }

  release(event) {
    const [x, y] = this.place(event);
    if (this.dragged) {
      const ends = [this.axisAt(this.pressed), this.axisAt(x)].sort((a, b) => a - b);
      this.show(...ends);
    } else if (this.pressed !== undefined && this.plan.probe) {
      const found = this.plan.probe(this, x, y);
      if (found && found.open) found.open();
    }
    this.stop();
  }

  stop() {
    this.pressed = undefined;
    this.dragged = false;
    this.over.replaceChildren();
  }

  leave() {
    tooltip.hidden = true;
    if (!this.dragged) this.stop();
  }

  /** The wheel scrolls the page unless the plot has the focus: nobody wants to be caught by a plot in passing. */
  wheel(event) {
    if (document.activeElement !== this.svg && !event.ctrlKey) return;
    event.preventDefault();
    this.zoom(event.deltaY < 0 ? 1 / 1.2 : 1.2, this.axisAt(this.place(event)[0]));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const actions = {
      "+": () => this.zoom(1 / ZOOM_STEP),
      "=": () => this.zoom(1 / ZOOM_STEP),
      "-": () => this.zoom(ZOOM_STEP),
      ArrowLeft: () => this.pan(-0.2),
      ArrowRight: () => this.pan(0.2),
      0: () => this.home(),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }
}
