// The Data view: files, quality, test matrix, and the loops of a run.

import { View } from "../app.js";
import { Chart, loopCharts } from "../chart.js";
import { h, loading, placeholder, render } from "../dom.js";
import { DropZone } from "../drop_zone.js";
import { count, quantity } from "../format.js";
import { fileList, profilePanel } from "../import_panels.js";
import { rigChooser } from "../rig_chooser.js";
import { RunFacts } from "../run_facts.js";
import { TestList } from "../test_list.js";
import { TestMatrix } from "../test_matrix.js";

const STEPS = [
  ["Data", "measured runs and their quality"], ["Identify", "one model, or a study of all candidates"],
  ["Model", "loops at any current, frequency, amplitude and parameter value"],
  ["Compare", "errors of several models on the validation runs"], ["Simulate", "a vehicle or building with the damper"],
  ["Export", "report, model, code and tables"],
];

export class DataView extends View {
  static id = "data";
  static label = "Data";

  constructor(app) {
    super(app);
    this.zone = new DropZone(app);
    this.tests = new TestList(app, this.zone);
    this.parts = { files: h("div", {}), profile: h("div", {}), rigs: h("div", {}), quality: h("div", {}) };
    this.stage = h("div", { class: "stage fill" });
    this.facts = new RunFacts();
    this.matrix = null; // of the table shown
    this.turn = 0; // of several refreshes under way, the newest counts
    this.charts = {
      ...loopCharts("measured", "x"),
      t: new Chart({ title: "Force over time", x: ["Time", "s"], y: ["Force", "N"], name: "measured-force-time" }),
      d: new Chart({ title: "Displacement over time", x: ["Time", "s"], y: ["Displacement", "mm"], name: "measured-displacement-time" }),
    };
    this.figures = h("div", { class: "figures" }, Object.values(this.charts).map((c) => c.element));
    this.element = h("div", { class: "view" }, h("div", { class: "side" }, this.zone.element, Object.values(this.parts)), this.stage);
    app.on("data", () => {
      this.matrix = null;
      this.showFiles(app.overview);
      this.shown();
    });
    app.on("units", () => {
      this.matrix = null;
      this.shown();
    });
    app.on("loading", () => this.shown());
    app.on("refused", (overview) => this.showFiles(overview));
    this.shown();
  }

  update(state, before) {
    if (state.rig !== before.rig || state.run !== before.run) this.shown();
  }

  async refresh() {
    const { app, parts } = this;
    const turn = (this.turn += 1);
    render(parts.rigs, dataSummary(app));
    if (app.loading || !app.overview) {
      this.matrix = null;
      render(parts.quality);
      render(this.stage, app.loading ? loading(`${app.loading} …`) : [this.tests.element, this.tests.element.hidden ? welcome(app) : null]);
      return;
    }
    const { rig } = app.state;
    if (this.matrix?.rig !== rig) render(this.stage, loading(`Analysing ${count(app.overview.rigs[rig].runs, "run")} …`));
    const table = await app.rigTable(rig);
    const current = () => turn === this.turn && rig === app.state.rig;
    if (!current()) return;
    const run = runToShow(table, app.state.run);
    if (this.matrix?.table !== table) this.layOut(table, rig);
    this.matrix.choose(run.key);
    this.facts.show(run);
    await this.drawRun(run, rig, current);
    if (current()) await this.showQuality(run, rig, current);
  }

  layOut(table, rig) {
    this.matrix = new TestMatrix(table, rig, (run) => this.app.store.commit({ run }));
    render(this.stage, this.tests.element, h("div", { class: "matrix-and-run" }, this.matrix.element, this.facts.element), this.figures);
  }

  async drawRun(run, rig, current) {
    const [cycle, window] = await Promise.all(["cycle", "window"].map((part) => this.app.loop(run.key, part, rig)));
    if (!current()) return; // another was chosen meanwhile
    const sine = run.peak_N !== null;
    const all = { color: "line-strong", width: 1, name: "steady window", quiet: true };
    const last = sine ? { color: "measured", width: 2, name: "last cycle" } : { color: "measured", width: 0.8, name: "record" };
    const summary = sine ? `Peak force ${quantity(run.peak_N, "N")}, energy ${quantity(run.energy_J, "J")} per cycle.` : run.refused;
    const loop = (a) => [{ ...all, x: window.arrays[a], y: window.arrays.F }, { ...last, x: cycle.arrays[a], y: cycle.arrays.F }];
    const history = (b) => [{ ...last, width: Math.min(last.width, 1.5), x: window.arrays.t, y: window.arrays[b] }];
    const { x, v, t, d } = this.charts;
    for (const chart of [x, v, t, d]) chart.reset();
    await Promise.all([x.draw(loop("x"), summary), v.draw(loop("v"), summary), t.draw(history("F"), summary), d.draw(history("x"), summary)]);
  }

  /** Show the quality after the loops: the check examines every sample of every run. */
  async showQuality(run, rig, current) {
    const show = (text) => render(this.parts.quality, h("div", { class: "group" }, h("h2", {}, "Quality"), h("p", { class: "small" }, text)));
    if (!this.parts.quality.childElementCount) show("Checking the runs …");
    const quality = await this.app.quality(rig);
    if (!current()) return;
    const verdicts = Object.values(quality).map((q) => q.verdict);
    show(`${[...new Set(verdicts)].map((verdict) => `${verdicts.filter((v) => v === verdict).length} ${verdict}`).join(", ")}.`);
    this.matrix.showFindings(quality);
    this.facts.showFindings(quality[run.key]);
  }

  showFiles(overview) {
    render(this.parts.files, fileList(overview));
    render(this.parts.profile, profilePanel(overview, this.zone));
    this.tests.show(overview);
    if (!this.app.overview) this.shown();
  }
}

/** The run of a key; else the first of the matrix; else the first of all. */
function runToShow(table, key) {
  const [first] = table.matrix.motions.flatMap((m) => m.cells.flat());
  return [key, first].map((name) => table.runs.find((run) => run.key === name)).find(Boolean) ?? table.runs[0];
}

function dataSummary(app) {
  if (!app.overview) return null;
  const { rigs, name, runs } = app.overview;
  return h("div", { class: "group" },
    h("h2", {}, rigs.length > 1 ? "Rig" : "Data"),
    rigChooser(app, "data"),
    h("p", { class: "small faint" }, `${count(runs, "run")} in “${name}”.`));
}

function welcome(app) {
  const open = h("button", { class: "primary", onclick: () => app.run(app.openBundled()) }, "Open the bundled tests");
  return h("div", { class: "welcome" },
    placeholder("Open measured data", "Drop the files of a test rig or a dataset folder anywhere on this page, or open the bundled tests of two real dampers: 53 runs.", open),
    h("ol", { class: "steps" }, STEPS.map(([view, text]) => h("li", {}, h("b", {}, view), h("span", { class: "faint small" }, text)))));
}
