// What is known of a run, and what was found in it.

import { capital, h, note, put } from "./dom.js";
import { figures, percent, quantity } from "./format.js";

export class RunFacts {
  constructor() {
    this.title = h("h2", {});
    this.findings = h("div", { class: "findings" });
    this.facts = h("div", {});
    this.element = h("section", { class: "card" }, h("div", { class: "head" }, this.title), h("div", { class: "body" }, this.findings, this.facts));
  }

  show(run) {
    put(this.title, "Run ", h("span", {}, run.id));
    put(this.findings, run.refused ? note("", capital(run.refused)) : null);
    put(this.facts, facts(run));
  }

  /** Findings come a moment after the run. */
  judge({ verdict, findings }) {
    const kind = verdict === "refused" ? "bad" : "warn";
    if (findings.length) put(this.findings, findings.map((f) => note(kind, h("div", {}, capital(f.text), " ", h("code", {}, f.code)))));
  }
}

function facts(run) {
  const fact = (name, value) => h("div", {}, h("dt", {}, name), h("dd", {}, value));
  const c = run.condition;
  return h("dl", { class: "facts" },
    fact("Set", run.split === "validate" ? "validation" : "identification"),
    c ? fact("Current", `${figures(c.current_A, 3)} A`) : null,
    c ? fact("Frequency", `${figures(c.frequency_Hz, 3)} Hz`) : null,
    c ? fact("Amplitude", quantity(c.amplitude_mm, "mm", 3)) : null,
    run.peak_N === null ? null : fact("Half peak-to-peak", quantity(run.peak_N, "N")),
    run.energy_J === null ? null : fact("Energy per cycle", quantity(run.energy_J, "J")),
    run.damping_Ns_m === null ? null : fact("Equiv. damping", quantity(run.damping_Ns_m, "N s/m")),
    run.mean_N === null ? null : fact("Mean force", quantity(run.mean_N, "N", 3)),
    run.cycles === null ? null : fact("Cycles", figures(run.cycles, 3)),
    run.repeatability === null ? null : fact("Cycle scatter", percent(run.repeatability)),
    fact("Length", `${figures(run.duration_s, 3)} s`),
    fact("Samples", String(run.samples)));
}
