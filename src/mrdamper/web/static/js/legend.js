// Legend of a chart, beside its title.

import { paint } from "./colours.js";
import { h, svg } from "./dom.js";

const DASHES = { dash: "5 3", dot: "2 2", dashdot: "5 2 2 2", longdash: "8 3" };

/** One entry per name; curves with `legend: false` or without a name have none. */
export function legend(traces) {
  const named = new Map(traces.filter((t) => t.name && t.legend !== false && t.x.length).map((t) => [t.name, t]));
  return h("ul", { class: "keys" }, [...named.values()].reverse().map((t) => h("li", {}, swatch(t), t.name)));
}

/** A piece of a curve in its colour, dash and mark. */
export function swatch({ color, dash, mode, fill, width = 2 }) {
  const stroke = paint(color);
  const piece = mode === "markers"
    ? svg("circle", { cx: "12", cy: "5", r: "3.6", fill: fill ? paint(fill) : stroke, stroke, "stroke-width": "1.6" })
    : svg("line", { x1: "0", x2: "24", y1: "5", y2: "5", stroke, "stroke-width": String(Math.max(1.6, 1.2 * width)), "stroke-dasharray": DASHES[dash] ?? null });
  return svg("svg", { class: "swatch", viewBox: "0 0 24 10", "aria-hidden": "true" }, piece);
}
