// The test matrix, one button a run, and the facts of a run.

import { h, note } from "./dom.js";
import { condition, figures, percent } from "./format.js";

/** The matrix of a rig's table with the run shown pressed; a click commits another. */
export function matrixCard(bench, table, shown) {
  const byKey = new Map(table.runs.map((run) => [run.key, run]));
  const pick = (key) => bench.store.commit({ run: key });
  const cell = (key) => {
    const run = byKey.get(key);
    return h(
      "button",
      {
        class: `cell ${run.split}`, "data-run": key, "aria-pressed": String(key === shown.key), onclick: () => pick(key),
        title: `${run.id}, ${run.split === "validate" ? "held out" : "train"}`,
        "aria-label": `${run.id}: ${condition(run.condition)}, peak force ${figures(run.peak_N, 3)} N${run.split === "validate" ? ", held out" : ""}`,
      },
      `${figures(run.peak_N, 3)} N`,
    );
  };
  const { currents_A: currents, motions } = table.matrix;
  const inMatrix = new Set(motions.flatMap((m) => m.cells.flat()));
  const others = table.runs.filter((run) => !inMatrix.has(run.key));
  const rows = motions.map((m) =>
    h("tr", {},
      h("th", { scope: "row" }, `${figures(m.frequency_Hz, 3)} Hz`),
      h("th", { scope: "row" }, `${figures(m.amplitude_mm, 3)} mm`),
      m.cells.map((keys) => h("td", {}, keys.map(cell)))),
  );
  return h(
    "section", { class: "card" },
    h("div", { class: "head" },
      h("h2", {}, "Test matrix"),
      h("span", { class: "faint small" }, "peak force, as measured"),
      h("span", { class: "legend" }, h("span", {}, h("i", {}), "train"), h("span", {}, h("i", { class: "dashed" }), "held out"), h("span", {}, h("i", { class: "dot" }), "noticed"))),
    h("div", { class: "flush short" },
      h("table", { class: "matrix" },
        h("caption", { class: "hidden-text" }, "Test matrix: one button a run"),
        h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Frequency"), h("th", { scope: "col" }, "Amplitude"),
          currents.map((I) => h("th", { scope: "col", class: "num" }, `${figures(I, 3)} A`)))),
        h("tbody", {}, rows))),
    others.length
      ? h("div", { class: "chips" }, h("span", { class: "faint small" }, "Other motion:"),
        others.map((run) => h("button", { "data-run": run.key, "aria-pressed": String(run.key === shown.key), title: run.refused, onclick: () => pick(run.key) }, run.id)))
      : null,
  );
}

/** What is known of a run. */
export function runFacts(run) {
  const fact = (name, value) => h("div", {}, h("dt", {}, name), h("dd", {}, value));
  const c = run.condition;
  return [
    run.refused ? note("", run.refused) : null,
    h("dl", { class: "facts" },
      fact("Set", run.split === "validate" ? "held out" : "train"),
      c ? fact("Current", `${figures(c.current_A, 3)} A`) : null,
      c ? fact("Frequency", `${figures(c.frequency_Hz, 3)} Hz`) : null,
      c ? fact("Amplitude", `${figures(c.amplitude_mm, 3)} mm`) : null,
      run.peak_N === null ? null : fact("Peak force", `${figures(run.peak_N)} N`),
      run.energy_J === null ? null : fact("Energy a cycle", `${figures(run.energy_J)} J`),
      run.damping_Ns_m === null ? null : fact("Equivalent damping", `${figures(run.damping_Ns_m)} N s/m`),
      run.mean_N === null ? null : fact("Mean force", `${figures(run.mean_N, 3)} N`),
      run.cycles === null ? null : fact("Cycles", figures(run.cycles, 3)),
      run.repeatability === null ? null : fact("Scatter between cycles", percent(run.repeatability)),
      fact("Record", `${figures(run.duration_s, 3)} s, ${run.samples} samples`)),
  ];
}
