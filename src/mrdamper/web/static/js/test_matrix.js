// The test matrix of a rig: one button a run, in a grid the arrow keys walk.

import { h } from "./dom.js";
import { condition, figures, quantity } from "./format.js";

const STEPS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] };

export class TestMatrix {
  /** `pick(key)` hears which run is chosen. */
  constructor(table, pick) {
    this.table = table;
    this.pick = pick;
    this.runs = new Map(table.runs.map((run) => [run.key, run]));
    this.element = h("section", { class: "card tests" }, head(), this.grid(), this.others());
    this.element.addEventListener("keydown", (event) => this.walk(event));
  }

  /** Show which run is chosen; the others are reached by the arrow keys. */
  choose(key) {
    let chosen = null;
    for (const button of this.buttons()) {
      const here = button.dataset.run === key;
      button.setAttribute("aria-pressed", String(here));
      button.tabIndex = here ? 0 : -1;
      if (here) chosen = button;
    }
    chosen?.scrollIntoView({ block: "nearest" });
  }

  /** Mark the runs that have findings. */
  judge(quality) {
    for (const button of this.buttons()) {
      const { verdict, findings } = quality[button.dataset.run];
      const run = this.runs.get(button.dataset.run);
      button.classList.toggle("noted", verdict !== "good");
      button.title = [title(run), ...findings.map((f) => f.text)].join("\n");
      button.setAttribute("aria-label", `${spoken(run)}${verdict === "good" ? "" : `, ${verdict}`}`);
    }
  }

  buttons() {
    return this.element.querySelectorAll("[data-run]");
  }

  grid() {
    const { currents_A: currents, motions } = this.table.matrix;
    const rows = motions.map((m) =>
      h("tr", {},
        h("th", { scope: "row" }, `${figures(m.frequency_Hz, 3)} Hz`),
        h("th", { scope: "row" }, quantity(m.amplitude_mm, "mm", 3)),
        m.cells.map((keys) => h("td", {}, keys.map((key) => this.cell(key))))),
    );
    if (!rows.length) return h("p", { class: "faint small none" }, "No run is a steady sine at one current: there is no matrix to show.");
    return h("div", { class: "flush" },
      h("table", { class: "matrix" },
        h("caption", { class: "hidden-text" }, "Test matrix: one button a run; the arrow keys walk it"),
        h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Frequency"), h("th", { scope: "col" }, "Amplitude"),
          currents.map((I) => h("th", { scope: "col", class: "num" }, `${figures(I, 3)} A`)))),
        h("tbody", {}, rows)));
  }

  cell(key) {
    const run = this.runs.get(key);
    return h(
      "button",
      {
        class: `cell ${run.split}`, "data-run": key,
        onclick: () => this.pick(key), title: title(run), "aria-label": spoken(run),
      },
      quantity(run.peak_N, "N", 3),
    );
  }

  /** Runs that are no steady sine at one current. */
  others() {
    const inMatrix = new Set(this.table.matrix.motions.flatMap((m) => m.cells.flat()));
    const found = this.table.runs.filter((run) => !inMatrix.has(run.key));
    if (!found.length) return null;
    return h("div", { class: "chips" }, h("span", { class: "faint small" }, "Other motion:"),
      found.map((run) => h("button", { "data-run": run.key, title: title(run), onclick: () => this.pick(run.key) }, run.id)));
  }

  /** The nearest button in the direction of an arrow key takes the focus. */
  walk(event) {
    const step = STEPS[event.key];
    const here = event.target.closest("[data-run]");
    if (!step || !here) return;
    event.preventDefault();
    const from = here.getBoundingClientRect();
    const along = (box) => (box.x + box.width / 2 - from.x - from.width / 2) * step[0] + (box.y + box.height / 2 - from.y - from.height / 2) * step[1];
    const aside = (box) => Math.abs((box.x - from.x) * step[1]) + Math.abs((box.y - from.y) * step[0]);
    let [best, least] = [null, Infinity];
    for (const button of this.buttons()) {
      const box = button.getBoundingClientRect();
      const distance = along(box) + 4 * aside(box); // rather far ahead than far aside
      if (along(box) > 2 && distance < least) [best, least] = [button, distance];
    }
    best?.focus();
  }
}

function head() {
  const key = (kind, text) => h("span", {}, h("i", { class: kind }), text);
  return h("div", { class: "head" },
    h("h2", {}, "Test matrix"),
    h("span", { class: "faint small" }, "half the peak-to-peak force"),
    h("span", { class: "legend" }, key("", "identification"), key("dashed", "validation"), key("dot", "noted")));
}

function title(run) {
  return [`${run.id}, ${run.split === "validate" ? "validation" : "identification"}`, run.refused].filter(Boolean).join("\n");
}

function spoken(run) {
  const force = run.peak_N === null ? "" : `, peak force ${quantity(run.peak_N, "N", 3)}`;
  return `${run.id}: ${condition(run.condition)}${force}${run.split === "validate" ? ", validation" : ""}`;
}
