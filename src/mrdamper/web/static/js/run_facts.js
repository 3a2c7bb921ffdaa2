// Properties of a run, and the findings of its quality check.

import { capitalise, finding, h, note, render } from "./dom.js";
import { figures, percent, quantity } from "./format.js";

export class RunFacts {
  constructor() {
    this.title = h("h2", {});
    this.findings = h("div", { class: "findings" });
    this.facts = h("dl", { class: "facts" });
    this.element = h("section", { class: "card" }, h("div", { class: "head" }, this.title), h("div", { class: "body" }, this.findings, this.facts));
  }

  show(run) {
    render(this.title, "Run ", h("span", {}, run.id));
    render(this.findings, run.refused ? note("", capitalise(run.refused)) : null);
    const { current_A, frequency_Hz, amplitude_mm } = run.condition ?? {};
    const rows = [
      ["Set", run.split === "validate" ? "validation" : "identification"],
      ["Current", current_A, (v) => quantity(v, "A", 3)],
      ["Frequency", frequency_Hz, (v) => quantity(v, "Hz", 3)],
      ["Amplitude", amplitude_mm, (v) => quantity(v, "mm", 3)],
      ["Half peak-to-peak", run.peak_N, (v) => quantity(v, "N")],
      ["Energy per cycle", run.energy_J, (v) => quantity(v, "J")],
      ["Equiv. damping", run.damping_Ns_m, (v) => quantity(v, "N s/m")],
      ["Mean force", run.mean_N, (v) => quantity(v, "N", 3)],
      ["Cycles", run.cycles, (v) => figures(v, 3)],
      ["Cycle scatter", run.repeatability, percent],
      ["Length", run.duration_s, (v) => quantity(v, "s", 3)],
      ["Samples", run.samples, String],
    ];
    render(this.facts, rows.filter(([, value]) => value !== null && value !== undefined)
      .map(([name, value, print = String]) => h("div", {}, h("dt", {}, name), h("dd", {}, print(value)))));
  }

  /** Show the findings, which arrive after the run. */
  showFindings({ verdict, findings }) {
    const kind = verdict === "refused" ? "bad" : "warn";
    if (findings.length) render(this.findings, findings.map((f) => note(kind, finding(f.code, f.text))));
  }
}
