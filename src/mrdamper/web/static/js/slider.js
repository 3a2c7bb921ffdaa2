// One quantity as a slider with a number beside it, both in the unit of the screen.

import { capitalise, h, svg } from "./dom.js";
import { figures, unit } from "./format.js";

const STEPS = 1000;

/**
 * A slider. `spec`: {name, symbol, meaning, unit, low, high, value, scale, factor, bounds, tested: [low, high]};
 * values are SI, `factor` converts them to the screen's. `drag(value, time)` receives every move, `settle(value)` the
 * end of one; `release()` lets a held value follow the model again.
 */
export function slider(spec, { drag, settle, release }) {
  const factor = spec.factor ?? 1;
  const shown = (value) => `${figures(factor * value)} ${unit(spec.unit)}`.trim();
  const log = spec.scale === "log";
  const toPosition = (value) => {
    const share = log ? Math.log(value / spec.low) / Math.log(spec.high / spec.low) : (value - spec.low) / (spec.high - spec.low);
    return Math.round(STEPS * Math.min(1, Math.max(0, share)));
  };
  const toValue = (position) => {
    const share = position / STEPS;
    const value = log ? spec.low * (spec.high / spec.low) ** share : spec.low + share * (spec.high - spec.low);
    return Number(value.toPrecision(4));
  };
  const id = `slider-${spec.name}`;
  const range = h("input", { type: "range", id, min: "0", max: String(STEPS), step: "5" });
  const number = h("input", { type: "number", step: "any", "aria-label": `${spec.meaning} in ${spec.unit}` });
  const free = release ? h("button", { class: "quiet release", hidden: true, title: "Let it follow the model again", "aria-label": `Release ${spec.symbol}`, onclick: release }, "release") : null;
  const wrong = h("p", { class: "wrong small", id: `${id}-wrong`, role: "alert", hidden: true });
  const element = h(
    "div", { class: "slider", "data-name": spec.name },
    h("label", { for: id, title: `${spec.symbol}: ${spec.meaning}` }, h("b", {}, spec.symbol), h("span", {}, spec.meaning), free),
    number,
    h("span", { class: "unit" }, unit(spec.unit)),
    range,
    spec.tested ? testedRange(...spec.tested.map((value) => toPosition(value) / STEPS)) : null,
    wrong,
  );

  let last = null;

  function set(value, held = false) {
    if (last !== null && last.value === value && last.held === held) return; // most stay while one is dragged
    showRefusal("");
    last = { value, held };
    if (document.activeElement !== range) range.value = toPosition(value);
    if (document.activeElement !== number) number.value = fieldText(factor * value);
    range.setAttribute("aria-valuetext", `${figures(factor * value)} ${spec.unit}`);
    element.classList.toggle("held", held);
    if (free) free.hidden = !held;
    const outside = spec.tested && (value < spec.tested[0] * 0.98 || value > spec.tested[1] * 1.02);
    element.classList.toggle("outside", Boolean(outside));
  }

  /** Show why a typed number is refused; nothing for an empty text. */
  function showRefusal(text) {
    wrong.textContent = text;
    wrong.hidden = !text;
    if (text) number.setAttribute("aria-describedby", wrong.id);
    else number.removeAttribute("aria-describedby");
  }

  range.addEventListener("input", (event) => {
    const value = toValue(Number(range.value));
    showRefusal("");
    number.value = fieldText(factor * value);
    drag(value, event.timeStamp);
  });
  range.addEventListener("change", () => settle(toValue(Number(range.value))));
  number.addEventListener("change", () => {
    const reason = refusal(number.value, spec, factor, shown);
    showRefusal(reason && `${reason}; ${spec.symbol} stays at ${shown(last.value)}.`);
    if (reason) number.value = fieldText(factor * last.value); // the value of the charts
    else settle(Number(number.value) / factor);
  });
  set(spec.value);
  return { element, set };
}

/** Reason to refuse a typed number; empty where it is accepted. */
function refusal(typed, spec, factor, shown) {
  if (typed.trim() === "" || !Number.isFinite(Number(typed))) return `${capitalise(spec.meaning)}: type a number`;
  const value = Number(typed) / factor;
  const [low, high] = spec.bounds ?? [spec.low, spec.high]; // null where there is no bound
  if (value >= (low ?? -Infinity) && value <= (high ?? Infinity)) return "";
  if (spec.least && value <= 0) return `${shown(value)} is refused: ${spec.least}`;
  const range = low === null ? `at or below ${shown(high)}` : high === null ? `at or above ${shown(low)}` : `between ${shown(low)} and ${shown(high)}`;
  return `${shown(value)} is refused: ${spec.meaning} lies ${range}`;
}

/** A number as text of a field, short enough to be read completely. */
function fieldText(value) {
  const size = Math.abs(value);
  return size !== 0 && (size >= 1e6 || size < 1e-3) ? value.toExponential(3) : String(Number(value.toPrecision(5)));
}

/** A bar below the slider over the tested range, as fractions of the slider. */
function testedRange(from, to) {
  const bar = svg("rect", { x: `${100 * from}%`, width: `${100 * Math.max(0.01, to - from)}%`, height: "100%" });
  return h("div", { class: "ticks", title: "tested range" }, svg("svg", { "aria-hidden": "true" }, bar));
}
