"use strict";

// Numbers: packed curves, axes with their ticks, numbers as text.

const ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
const DIGITS = new Map([...ALPHABET].map((letter, digit) => [letter, digit]));
const MARKS = new Map([
  ["!", NaN],
  ["^", Infinity],
  ["_", -Infinity],
]);

/** The numbers of a packed curve: NaN where one is missing, infinite where there is no limit. */
function unpack(curve) {
  const found = [];
  let last = 0,
    rest = 0,
    weight = 1;
  for (const letter of curve.at) {
    if (MARKS.has(letter)) {
      found.push(MARKS.get(letter));
      continue;
    }
    const digit = DIGITS.get(letter);
    rest += (digit % 32) * weight;
    weight *= 32;
    if (digit >= 32) continue;
    last += rest % 2 ? -(rest + 1) / 2 : rest / 2;
    found.push(curve.from + curve.step * last);
    rest = 0;
    weight = 1;
  }
  return Float64Array.from(found);
}

/** The smallest and largest of numbers that may be too many for the arguments of a call. */
function leastOf(numbers, start = Infinity) {
  return numbers.reduce((a, b) => Math.min(a, b), start);
}

function mostOf(numbers, start = -Infinity) {
  return numbers.reduce((a, b) => Math.max(a, b), start);
}

/** The index at which a value belongs in ascending numbers. */
function placeOf(numbers, value) {
  let low = 0,
    high = numbers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (numbers[middle] < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The value of a curve at a time, on the straight line between its samples; NaN outside. */
function valueAt(times, values, time) {
  const after = placeOf(times, time);
  if (after >= times.length || (after === 0 && times[0] > time)) return NaN;
  if (after === 0) return values[0];
  const share = (time - times[after - 1]) / (times[after] - times[after - 1]);
  return values[after - 1] + share * (values[after] - values[after - 1]);
}

/** A number as the tables write it: three digits, no exponent. */
function numberText(value, digits = 3) {
  if (value === null || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return "not reached";
  const size = value ? Math.floor(Math.log10(Math.abs(value)) + 1e-12) : 0;
  return value.toFixed(Math.min(Math.max(digits - 1 - size, 0), 12)).replace("-", "−");
}

function counted(count, thing) {
  return `${count} ${thing}${count === 1 ? "" : "s"}`;
}

/** Round numbers from low to high, about `most` of them. */
function ticksOf(low, high, most) {
  const raw = (high - low) / Math.max(most, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= raw * 0.999);
  const found = [];
  for (let i = Math.ceil(low / step - 1e-6); i <= high / step + 1e-6; i += 1) found.push(i * step);
  return { values: found, step };
}

/** The first tick at or beyond the highest value of an axis from 0 with about so many ticks. */
function endOf(highest, most) {
  const { step } = ticksOf(0, highest, most);
  return Math.ceil(highest / step - 1e-9) * step;
}

/** The last and the first tick, and the others that have room between them [px]. */
function apart(ticks, place, room) {
  const kept = [ticks[ticks.length - 1], ticks[0]];
  for (const tick of ticks) if (kept.every((other) => Math.abs(place(other) - place(tick)) >= room)) kept.push(tick);
  return kept;
}

/** Round numbers for a logarithmic axis; for a short one those of a linear axis. */
function logTicksOf(low, high, most) {
  for (const factors of [[1, 2, 3, 5, 7], [1, 2, 5], [1, 3], [1]]) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
      for (const factor of factors) found.push(factor * 10 ** power);
    }
    const inside = found.filter((value) => value >= low * 0.999 && value <= high * 1.001);
    if (inside.length <= most && inside.length >= 2) return { values: inside, step: 0 };
  }
  const decades = Math.log10(high / low);
  if (decades < 1) return ticksOf(low, high, most);
  const every = Math.ceil(decades / most);
  const first = Math.ceil(Math.log10(low));
  const values = Array.from(
    { length: Math.floor((Math.log10(high) - first) / every) + 1 },
    (_, i) => 10 ** (first + i * every),
  );
  return { values, step: 0 };
}

/** A tick in words: as many decimals as the step between ticks needs; without a step as many as the tick needs. */
function tickWords(value, step) {
  if (!step) return String(Number(value.toPrecision(3))).replace("-", "−");
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return (Math.abs(value) < step * 1e-6 ? 0 : value).toFixed(Math.min(decimals, 10)).replace("-", "−");
}
