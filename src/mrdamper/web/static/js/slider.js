// One quantity under a slider with a number beside it; both speak the unit of the screen.

import { capital, h, put, svg } from "./dom.js";
import { figures, unit } from "./format.js";

const STEPS = 1000;

/**
 * A slider. `spec`: {name, symbol, meaning, unit, low, high, value, scale, factor, tested: [low, high]};
 * values are SI, `factor` makes them the screen's. `drag(value, when)` hears every move, `settle(value)` the end
 * of one, `release()` is offered where the value can be let go again.
 */
export function slider(spec, { drag, settle, release }) {
  const factor = spec.factor ?? 1;
  const toPlace = (value) => {
    const share = spec.scale === "log"
      ? Math.log(value / spec.low) / Math.log(spec.high / spec.low)
      : (value - spec.low) / (spec.high - spec.low);
    return Math.round(STEPS * Math.min(1, Math.max(0, share)));
  };
  const toValue = (place) => {
    const share = place / STEPS;
    const value = spec.scale === "log" ? spec.low * (spec.high / spec.low) ** share : spec.low + share * (spec.high - spec.low);
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
    spec.tested ? tested(spec, toPlace) : null,
    wrong,
  );

  let last = null;

  function set(value, held = false) {
    if (last !== null && last.value === value && last.held === held) return; // most do not move while one is dragged
    say("");
    last = { value, held };
    if (document.activeElement !== range) range.value = toPlace(value);
    if (document.activeElement !== number) number.value = typed(factor * value);
    range.setAttribute("aria-valuetext", `${figures(factor * value)} ${spec.unit}`);
    element.classList.toggle("held", held);
    if (free) free.hidden = !held;
    const outside = spec.tested && (value < spec.tested[0] * 0.98 || value > spec.tested[1] * 1.02);
    element.classList.toggle("outside", Boolean(outside));
  }

  /** Say why a number that was typed is refused; nothing where it is accepted. */
  function say(text) {
    wrong.textContent = text;
    wrong.hidden = !text;
    if (text) number.setAttribute("aria-describedby", wrong.id);
    else number.removeAttribute("aria-describedby");
  }

  range.addEventListener("input", (event) => {
    const value = toValue(Number(range.value));
    say("");
    number.value = typed(factor * value);
    drag(value, event.timeStamp);
  });
  range.addEventListener("change", () => settle(toValue(Number(range.value))));
  number.addEventListener("change", () => {
    const text = refusal(number.value, spec, factor);
    if (!text) {
      say("");
      return settle(Number(number.value) / factor);
    }
    number.value = typed(factor * last.value); // what the picture shows
    return say(`${text.slice(0, -1)}; ${spec.symbol} stays at ${figures(factor * last.value)} ${unit(spec.unit)}.`);
  });
  set(spec.value);
  return { element, set };
}

/** Why a typed number is not taken, in words; empty where it is. */
function refusal(typed, spec, factor) {
  if (typed.trim() === "" || !Number.isFinite(Number(typed))) return `${capital(spec.meaning)}: type a number.`;
  const value = Number(typed) / factor;
  const [low, high] = (spec.bounds ?? [spec.low, spec.high]).map((bound, i) => bound ?? [-Infinity, Infinity][i]);
  const shown = (v) => `${figures(factor * v)} ${unit(spec.unit)}`.trim();
  if (value >= low && value <= high) return "";
  if (spec.least && value <= 0) return `${shown(value)} is refused: ${spec.least}.`;
  return `${shown(value)} is refused: ${spec.meaning} lies ${low === -Infinity ? `at or below ${shown(high)}` : high === Infinity ? `at or above ${shown(low)}` : `between ${shown(low)} and ${shown(high)}`}.`;
}

/** A number as a field shows it: short enough to be read whole. */
function typed(value) {
  const size = Math.abs(value);
  return size !== 0 && (size >= 1e6 || size < 1e-3) ? value.toExponential(3) : String(Number(value.toPrecision(5)));
}

/** A bar under the slider where tests were made. */
function tested(spec, toPlace) {
  const from = toPlace(spec.tested[0]) / STEPS;
  const to = toPlace(spec.tested[1]) / STEPS;
  const bar = svg("rect", { x: `${100 * from}%`, width: `${100 * Math.max(0.01, to - from)}%`, height: "100%" });
  return put(h("div", { class: "ticks", title: "where tests were made" }), svg("svg", { "aria-hidden": "true" }, bar));
}
