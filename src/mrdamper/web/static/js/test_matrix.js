// The test matrix of a rig: one button a run, in a grid with arrow keys.

import { h } from "./dom.js";
import { condition, quantity } from "./format.js";

const DIRECTIONS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] };

export class TestMatrix {
  /** `pick(key)` is called with the run that the user chooses. */
  constructor(table, rig, pick) {
    Object.assign(this, { table, rig, pick });
    this.runs = new Map(table.runs.map((run) => [run.key, run]));
    this.element = h("section", { class: "card tests" }, head(), this.grid(), this.otherRuns());
    this.element.addEventListener("keydown", (event) => this.moveFocus(event));
  }

  /** Mark the chosen run; the arrow keys reach the others. */
  choose(key) {
    for (const button of this.buttons()) {
      const chosen = button.dataset.run === key;
      button.setAttribute("aria-pressed", String(chosen));
      button.tabIndex = chosen ? 0 : -1;
      if (chosen) button.scrollIntoView({ block: "nearest" });
    }
  }

  /** Mark the runs that have findings. */
  showFindings(quality) {
    for (const button of this.buttons()) {
      const { verdict, findings } = quality[button.dataset.run];
      const run = this.runs.get(button.dataset.run);
      button.classList.toggle("noted", verdict !== "good");
      button.title = [title(run), ...findings.map((f) => f.text)].join("\n");
      button.setAttribute("aria-label", `${description(run)}${verdict === "good" ? "" : `, ${verdict}`}`);
    }
  }

  buttons() {
    return this.element.querySelectorAll("[data-run]");
  }

  grid() {
    const { currents_A: currents, motions } = this.table.matrix;
    if (!motions.length) return h("p", { class: "faint small none" }, "No run is a steady sine at one current: there is no matrix to show.");
    const th = (scope, text) => h("th", { scope }, text);
    const rows = motions.map((m) => h("tr", {},
      th("row", quantity(m.frequency_Hz, "Hz", 3)), th("row", quantity(m.amplitude_mm, "mm", 3)),
      m.cells.map((keys) => h("td", {}, keys.map((key) => this.cell(this.runs.get(key)))))));
    return h("div", { class: "flush" },
      h("table", { class: "matrix" },
        h("caption", { class: "hidden-text" }, "Test matrix: one button a run; the arrow keys move between them"),
        h("thead", {}, h("tr", {}, th("col", "Frequency"), th("col", "Amplitude"), currents.map((I) => th("col", quantity(I, "A", 3))))),
        h("tbody", {}, rows)));
  }

  cell(run) {
    return h("button", { class: `cell ${run.split}`, "data-run": run.key, onclick: () => this.pick(run.key), title: title(run), "aria-label": description(run) },
      quantity(run.peak_N, "N", 3));
  }

  /** Buttons of the runs that are no steady sine at one current. */
  otherRuns() {
    const inMatrix = new Set(this.table.matrix.motions.flatMap((m) => m.cells.flat()));
    const others = this.table.runs.filter((run) => !inMatrix.has(run.key));
    if (!others.length) return null;
    return h("div", { class: "chips" }, h("span", { class: "faint small" }, "Other motion:"),
      others.map((run) => h("button", { "data-run": run.key, title: title(run), onclick: () => this.pick(run.key) }, run.id)));
  }

  /** Move the focus to the nearest button in the direction of an arrow key. */
  moveFocus(event) {
    const direction = DIRECTIONS[event.key];
    const current = event.target.closest("[data-run]");
    if (!direction || !current) return;
    event.preventDefault();
    const from = current.getBoundingClientRect();
    const along = (box) => (box.x + box.width / 2 - from.x - from.width / 2) * direction[0] + (box.y + box.height / 2 - from.y - from.height / 2) * direction[1];
    const aside = (box) => Math.abs((box.x - from.x) * direction[1]) + Math.abs((box.y - from.y) * direction[0]);
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

function description(run) {
  const force = run.peak_N === null ? "" : `, peak force ${quantity(run.peak_N, "N", 3)}`;
  return `${run.id}: ${condition(run.condition)}${force}${run.split === "validate" ? ", validation" : ""}`;
}
