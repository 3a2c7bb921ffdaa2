// Data: drop files, see what was taken and refused, the test matrix, and the loops of a run.

import { Chart } from "../chart.js";
import { busy, empty, h, put, renew } from "../dom.js";
import { DropZone } from "../drop_zone.js";
import { count, quantity } from "../format.js";
import { fileList, profilePanel } from "../import_panels.js";
import { rigChooser } from "../rig_chooser.js";
import { RunFacts } from "../run_facts.js";
import { TestList } from "../test_list.js";
import { TestMatrix } from "../test_matrix.js";

export const id = "data";
export const label = "Data";

export function create(bench) {
  return new DataView(bench);
}

class DataView {
  constructor(bench) {
    this.bench = bench;
    this.drop = new DropZone(bench);
    this.tests = new TestList(bench, this.drop);
    this.parts = { files: h("div", {}), profile: h("div", {}), rigs: h("div", {}), quality: h("div", {}) };
    this.stage = h("div", { class: "stage fill" });
    this.facts = new RunFacts();
    this.matrix = null; // of the table shown
    this.turn = 0; // of several refreshes on their way, the newest counts
    this.charts = {
      x: new Chart({ title: "Force over displacement", x: ["Displacement", "mm"], y: ["Force", "N"], name: "force-displacement", keys: true }),
      v: new Chart({ title: "Force over velocity", x: ["Velocity", "m/s"], y: ["Force", "N"], name: "force-velocity" }),
      t: new Chart({ title: "Force over time", x: ["Time", "s"], y: ["Force", "N"], name: "force-time" }),
      d: new Chart({ title: "Displacement over time", x: ["Time", "s"], y: ["Displacement", "mm"], name: "displacement-time" }),
    };
    this.figures = h("div", { class: "figures" }, Object.values(this.charts).map((c) => c.element));
    this.element = h("div", { class: "view" }, h("div", { class: "side" }, this.drop.element, Object.values(this.parts)), this.stage);
    document.addEventListener("bench:data", () => {
      this.matrix = null;
      this.showIntake(bench.overview);
      this.shown();
    });
    document.addEventListener("bench:units", () => {
      this.matrix = null;
      this.shown();
    });
    document.addEventListener("bench:busy", () => this.shown());
    document.addEventListener("bench:refused", (event) => this.showIntake(event.detail));
    this.shown();
  }

  shown() {
    if (this.bench.state.view === id) this.refresh().catch((error) => this.bench.fail(error));
  }

  update(state, before) {
    if (state.view === id && (state.rig !== before.rig || state.run !== before.run)) this.shown();
  }

  async refresh() {
    const { bench, parts } = this;
    const turn = (this.turn += 1);
    renew(parts.rigs, whatIsThere(bench));
    if (bench.busy || !bench.overview) {
      this.matrix = null;
      put(parts.quality);
      put(this.stage, bench.busy ? busy(`${bench.busy} …`) : [this.tests.element, this.tests.element.hidden ? welcome(bench) : null]);
      return;
    }
    const { rig } = bench.state;
    if (this.matrix?.rig !== rig) put(this.stage, busy(`Analysing ${count(bench.overview.rigs[rig].runs, "run")} …`));
    const table = await bench.rigTable(rig);
    if (turn !== this.turn || rig !== bench.state.rig) return;
    const run = chosen(table, bench.state.run);
    if (this.matrix?.table !== table) this.layOut(table, rig);
    this.matrix.choose(run.key);
    this.facts.show(run);
    const current = () => turn === this.turn && rig === bench.state.rig;
    await this.drawRun(run, rig, current);
    if (current()) await this.showQuality(run, rig, current);
  }

  layOut(table, rig) {
    this.matrix = new TestMatrix(table, (key) => this.bench.store.commit({ run: key }));
    this.matrix.rig = rig;
    put(this.stage, this.tests.element, h("div", { class: "bench-top" }, this.matrix.element, this.facts.element), this.figures);
  }

  async drawRun(run, rig, current) {
    const [cycle, window] = await Promise.all(["cycle", "window"].map((part) => this.bench.loop(run.key, part, rig)));
    if (!current()) return; // another was chosen meanwhile
    const all = { color: "line-strong", width: 1, name: "steady window", quiet: true };
    const last = run.peak_N === null ? { color: "measured", width: 0.8, name: "record" } : { color: "measured", width: 2, name: "last cycle" };
    const said = run.peak_N === null ? run.refused : `Peak force ${quantity(run.peak_N, "N")}, energy ${quantity(run.energy_J, "J")} per cycle.`;
    const two = (a, b) => [{ ...all, x: window.arrays[a], y: window.arrays[b] }, { ...last, x: cycle.arrays[a], y: cycle.arrays[b] }];
    const one = (b) => [{ ...last, width: Math.min(last.width, 1.5), x: window.arrays.t, y: window.arrays[b] }];
    const { x, v, t, d } = this.charts;
    for (const chart of Object.values(this.charts)) chart.reset();
    await Promise.all([x.draw(two("x", "F"), said), v.draw(two("v", "F"), said), t.draw(one("F"), said), d.draw(one("x"), said)]);
  }

  /** Verdicts come after the loops: judging looks at every sample of every run. */
  async showQuality(run, rig, current) {
    const group = (text, faint) => put(this.parts.quality, h("div", { class: "group" }, h("h2", {}, "Quality"), h("p", { class: `small ${faint}` }, text)));
    if (!this.parts.quality.childElementCount) group("Checking the runs …", "faint");
    const found = await this.bench.quality(rig);
    if (!current()) return;
    group(`${Object.entries(tally(Object.values(found).map((q) => q.verdict))).map(([word, n]) => `${n} ${word}`).join(", ")}.`, "");
    this.matrix.judge(found);
    this.facts.judge(found[run.key]);
  }

  showIntake(found) {
    put(this.parts.files, fileList(found));
    put(this.parts.profile, profilePanel(found, this.drop));
    this.tests.show(found);
    if (!this.bench.overview) this.shown();
  }
}

/** The run asked for; else the first of the matrix; else the first there is. */
function chosen(table, key) {
  const first = table.matrix.motions.flatMap((m) => m.cells.flat())[0];
  return [key, first].map((name) => table.runs.find((run) => run.key === name)).find(Boolean) ?? table.runs[0];
}

function whatIsThere(bench) {
  if (!bench.overview) return null;
  const { rigs, name, runs } = bench.overview;
  return h("div", { class: "group" },
    h("h2", {}, rigs.length > 1 ? "Rig" : "Data"),
    rigChooser(bench, "data"),
    h("p", { class: "small faint" }, `${count(runs, "run")} in “${name}”.`));
}

function welcome(bench) {
  const open = h("button", { class: "primary", onclick: () => bench.openBundled().catch((error) => bench.fail(error)) }, "Open the bundled tests");
  return h("div", { class: "welcome" },
    empty("See the damper", "Drop the files of a test rig or a dataset folder anywhere on this page. Or begin with the bundled tests of two real dampers: 53 runs, ready to look at.", open),
    h("ol", { class: "path" },
      [["Data", "measured runs and their quality"], ["Identify", "one model, or a study of all candidates"], ["Model", "loops at any current, frequency, amplitude and parameter value"], ["Compare", "errors of several models on the validation runs"], ["Export", "report, model, code and tables"]]
        .map(([what, why]) => h("li", {}, h("b", {}, what), h("span", { class: "faint small" }, why)))));
}

function tally(words) {
  const counts = {};
  for (const word of words) counts[word] = (counts[word] ?? 0) + 1;
  return counts;
}
