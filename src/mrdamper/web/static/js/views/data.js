// Data: drop files, see what was taken and refused, the test matrix, and the loops of a run.

import { Chart } from "../chart.js";
import { card, h, put } from "../dom.js";
import { DropZone, openBundled } from "../drop_zone.js";
import { figures } from "../format.js";
import { matrixCard, runFacts } from "../test_matrix.js";

export const id = "data";
export const label = "Data";

export function create(bench) {
  return new DataView(bench);
}

class DataView {
  constructor(bench) {
    this.bench = bench;
    this.drop = new DropZone(bench);
    this.parts = { rigs: h("div", {}), quality: h("div", {}), verdicts: h("div", {}), profile: h("div", {}) };
    this.stage = h("div", { class: "stage" });
    this.facts = h("div", {});
    this.charts = {
      x: new Chart({ title: "Force over displacement", x: "Displacement (mm)", y: "Force (N)", name: "force-displacement" }),
      v: new Chart({ title: "Force over velocity", x: "Velocity (m/s)", y: "Force (N)", name: "force-velocity" }),
      t: new Chart({ title: "Force over time", x: "Time (s)", y: "Force (N)", name: "force-time" }),
      d: new Chart({ title: "Displacement over time", x: "Time (s)", y: "Displacement (mm)", name: "displacement-time" }),
    };
    const side = h("div", { class: "side" }, this.drop.element, Object.values(this.parts));
    this.element = h("div", { class: "view" }, side, this.stage);
    document.addEventListener("bench:data", () => this.shown());
    document.addEventListener("bench:refused", (event) => this.showIntake(event.detail));
    this.shown();
  }

  shown() {
    this.refresh().catch((error) => this.bench.fail(error));
  }

  update(state, before) {
    if (state.view === id && (state.rig !== before.rig || state.run !== before.run)) this.shown();
  }

  async refresh() {
    const { bench } = this;
    put(this.parts.rigs, rigChooser(bench));
    this.showIntake(bench.overview);
    if (!bench.overview) {
      put(this.parts.quality);
      put(this.stage, welcome(bench));
      return;
    }
    const table = await bench.rigTable();
    const run = table.runs.find((r) => r.key === bench.state.run) ?? table.runs.find((r) => r.peak_N !== null) ?? table.runs[0];
    put(this.facts, runFacts(run));
    put(
      this.stage,
      h("div", { class: "bench-top" },
        matrixCard(bench, table, run),
        card(["Run ", h("span", {}, run.id)], h("div", { class: "body" }, this.facts))),
      h("div", { class: "figures" }, Object.values(this.charts).map((c) => c.element)),
    );
    this.stage.querySelector(".cell[aria-pressed=true]")?.scrollIntoView({ block: "nearest" });
    this.showQuality(table, run).catch((error) => bench.fail(error));
    await this.drawRun(run);
  }

  async drawRun(run) {
    const cycle = await this.bench.loop(run.key, "cycle");
    const window = await this.bench.loop(run.key, "window");
    if (this.bench.state.run && this.bench.state.run !== run.key) return; // another was chosen meanwhile
    const all = { color: "line-strong", width: 1, name: "steady window", quiet: true };
    const last = { color: "measured", width: 2, name: run.peak_N === null ? "record" : "last cycle" };
    const said = run.peak_N === null ? run.refused : `Peak force ${figures(run.peak_N)} newtons, energy ${figures(run.energy_J)} joules a cycle.`;
    const two = (a, b) => [{ ...all, x: window.arrays[a], y: window.arrays[b] }, { ...last, x: cycle.arrays[a], y: cycle.arrays[b] }];
    const { x, v, t, d } = this.charts;
    for (const chart of Object.values(this.charts)) chart.reset();
    x.draw(two("x", "F"), said);
    v.draw(two("v", "F"), said);
    t.draw([{ ...last, width: 1.5, x: window.arrays.t, y: window.arrays.F }], said);
    d.draw([{ ...last, width: 1.5, x: window.arrays.t, y: window.arrays.x }], said);
  }

  /** Verdicts come a moment later: judging looks at every sample of every run. */
  async showQuality(table, run) {
    const group = (text, faint) => put(this.parts.quality, h("div", { class: "group" }, h("h2", {}, "Quality"), h("p", { class: `small ${faint}` }, text)));
    group("Judging the runs …", "faint");
    const found = await this.bench.quality();
    if ((await this.bench.rigTable()) !== table || !this.facts.isConnected) return;
    group(`${Object.entries(tally(Object.values(found).map((q) => q.verdict))).map(([word, count]) => `${count} ${word}`).join(", ")}.`, "");
    for (const mark of this.stage.querySelectorAll("[data-run]")) {
      const { verdict, findings } = found[mark.dataset.run];
      mark.classList.toggle("noticed", verdict !== "good");
      if (findings.length && !mark.title.includes(findings[0].text)) mark.title += `\n${findings.map((f) => f.text).join("\n")}`;
    }
    const { verdict, findings } = found[run.key];
    const kind = verdict === "refused" ? "bad" : "warn";
    this.facts.querySelectorAll(".finding").forEach((element) => element.remove());
    this.facts.prepend(...findings.map((f) => h("div", { class: `finding message ${kind}` }, h("div", {}, f.text, " ", h("code", {}, f.code)))));
  }

  showIntake(found) {
    put(this.parts.verdicts, verdicts(found));
    put(this.parts.profile, profile(found, this.drop));
  }
}

function rigChooser(bench) {
  if (!bench.overview) return null;
  const { rigs } = bench.overview;
  return h("div", { class: "group" },
    h("h2", {}, rigs.length > 1 ? "Rig" : "Data"),
    h("div", { class: "segmented", role: "group", "aria-label": "Rig" },
      rigs.map((rig, i) => h("button", { "aria-pressed": String(i === bench.state.rig), onclick: () => bench.store.commit({ rig: i, run: null, compareRun: null }) }, `${rig.name || bench.overview.name} (${rig.runs})`))),
    h("p", { class: "small faint" }, `${bench.overview.runs} runs in “${bench.overview.name}”.`));
}

/** What was said of every dropped file. */
function verdicts(overview) {
  if (!overview?.verdicts.length) return null;
  const word = { taken: ["good", "taken"], noticed: ["warn", "noticed"], refused: ["bad", "refused"] };
  return h("div", { class: "group" }, h("h2", {}, "Files"),
    overview.verdicts.map((v) => h("div", { class: `message ${v.state === "refused" ? "bad" : v.state === "noticed" ? "warn" : ""}` },
      h("div", { class: "row" }, h("b", {}, v.name), h("span", { class: `badge ${word[v.state][0]}` }, word[v.state][1])),
      v.findings.map(([code, text]) => h("div", {}, text, " ", h("code", {}, code))))));
}

function profile(found, drop) {
  if (!found?.profile) return null;
  const text = h("textarea", { "aria-label": "Rig profile, TOML", spellcheck: "false" });
  text.value = found.profile;
  const again = h("button", { onclick: () => drop.read(text.value) }, "Read again");
  return h("details", { class: "group", open: found.verdicts.some((v) => v.state === "refused") }, h("summary", {}, "Guessed rig profile: columns, units, signs"),
    h("div", { class: "group" }, text, h("div", {}, again)));
}

function welcome(bench) {
  return h(
    "div", { class: "empty" },
    h("h2", {}, "See the damper"),
    h("p", {}, "Drop the files of a test rig or a dataset folder on the left. Or begin with the bundled tests of two real dampers: 53 runs, ready to look at."),
    h("button", { class: "primary", onclick: () => openBundled(bench) }, "Open the bundled tests"),
  );
}

function tally(words) {
  const counts = {};
  for (const word of words) counts[word] = (counts[word] ?? 0) + 1;
  return counts;
}
