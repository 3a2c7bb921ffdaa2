// The Compare view: errors of several models on the validation runs.

import { View } from "../app.js";
import { Chart, loopCharts } from "../chart.js";
import { paint, series } from "../colours.js";
import { card, h, loading, note, options, placeholder, render, table } from "../dom.js";
import { condition, percent, seconds } from "../format.js";
import { JobProgress } from "../job_progress.js";
import { swatch } from "../legend.js";
import { rigChooser } from "../rig_chooser.js";

const DRAWN_AT_FIRST = 3; // models; others are one click away
const MAX_LETTERS = 34; // of a title beside the errors

export class CompareView extends View {
  static id = "compare";
  static label = "Compare";

  constructor(app) {
    super(app);
    this.results = new Map(); // by the number of the rig
    this.drawn = new Set(); // keys of the dampers whose loops are drawn
    this.progress = new JobProgress(app);
    this.writing = new JobProgress(app);
    this.comparing = false;
    this.rig = h("div", {});
    this.list = h("fieldset", { class: "field" });
    this.button = h("button", { class: "primary", onclick: () => this.start() }, "Compare");
    this.errors = new Chart({ title: "Error of the validation runs, one mark per run", x: "Error (% of the peak-to-peak force)", y: "", name: "validation-errors", zero: true, layout: () => this.errorAxis() });
    this.loops = loopCharts("compared");
    this.runs = h("select", { id: "compare-run", onchange: () => app.store.commit({ compareRun: this.runs.value }) });
    this.legend = h("div", { class: "row small" });
    this.stage = h("div", { class: "stage" });
    const side = h("div", { class: "side" }, h("div", { class: "group" },
      h("h2", {}, "Compare models"),
      h("p", { class: "small faint" }, "Every model is identified from the identification runs of the rig and predicts the validation runs."),
      this.rig, this.button, this.list), this.progress.element);
    this.element = h("div", { class: "view" }, side, this.stage);
    app.on("data", () => this.clear());
    app.on("units", () => this.result && this.show());
    this.clear();
  }

  /** Result for the current rig, or null. */
  get result() {
    return this.results.get(this.app.state.rig) ?? null;
  }

  update(state, before) {
    if (state.rig !== before.rig) {
      this.updateForm();
      this.show();
    } else if (this.result && this.visible && state.compareRun !== before.compareRun) this.app.run(this.drawLoops());
  }

  /** Remove the results. */
  clear() {
    this.results.clear();
    this.updateForm();
    this.show();
  }

  updateForm() {
    render(this.rig, rigChooser(this.app, "compare"));
    this.button.disabled = this.comparing || !this.app.overview;
  }

  async refresh() {
    if (this.list.childElementCount) return;
    const choices = await this.app.api.get("/compare/choices");
    const box = (c) => h("input", { type: "checkbox", name: "compared", value: c.name, checked: c.studied });
    const check = (selected) => () => this.list.querySelectorAll("input").forEach((input, i) => (input.checked = selected(choices[i])));
    const link = (text, selected) => h("button", { type: "button", class: "link small", onclick: check(selected) }, text);
    render(this.list, h("legend", {}, "Models"),
      h("div", { class: "row" }, link("Those of the study", (c) => c.studied), link("All but slow", (c) => !c.slow), link("None", () => false)),
      choices.map((c) => h("label", { class: "check", title: c.source }, box(c), c.title, c.slow ? h("span", { class: "badge" }, "slow") : null)));
  }

  start() {
    const models = [...this.list.querySelectorAll("input:checked")].map((box) => box.value);
    if (!models.length) return this.app.notify(note("warn", "Choose at least one model."));
    return this.follow(this.progress.start("/compare", { rig: this.app.state.rig, models }));
  }

  /** After a reload of the page: follow the last job, or show its result. */
  resume(jobs) {
    const last = jobs.find((job) => job.kind === "compare");
    if (last?.state === "done") this.setResult(last.result);
    else if (last && last.state !== "cancelled") this.app.run(this.follow(this.progress.resume(last)));
  }

  async follow(job) {
    this.comparing = true;
    this.updateForm();
    if (!this.result) this.show();
    const result = await job;
    this.comparing = false;
    this.updateForm();
    if (result) await this.app.refreshDampers();
    if (result) this.setResult(result);
    else if (!this.result) this.show();
  }

  setResult(result) {
    this.results.set(result.number, result);
    if (result === this.result) this.show();
  }

  show() {
    if (!this.result) {
      render(this.stage, this.comparing
        ? loading("Comparing …", "The other views can be used meanwhile.")
        : this.app.overview
          ? placeholder("No comparison yet", "Choose models and compare them. They are ranked by cross-validation error (leave one condition out).")
          : this.app.noData());
      return;
    }
    const { entries, validation_runs: validation, identification_runs: identification, refused, rig } = this.result;
    this.drawn = new Set(entries.slice(0, DRAWN_AT_FIRST).map((e) => e.damper));
    const columns = [
      { title: "Model", value: (e) => h("span", { title: e.source }, e.title) },
      { title: "Cross-validation", number: true, value: (e) => percent(e.cross_validation) },
      ...(entries.some((e) => e.validation !== null) ? [{ title: "Validation", number: true, value: (e) => percent(e.validation) }] : []),
      { title: "Parameters", number: true, value: (e) => String(e.parameter_count) },
      { title: "Runs needed", number: true, value: (e) => String(e.runs_needed) },
      { title: "Time", number: true, value: (e) => seconds(e.seconds) },
      this.app.exploreColumn(),
    ];
    const reasons = Object.entries(refused).map(([name, reason]) => h("div", {}, `${name}: ${reason}`));
    const group = (label, runs) => (runs.length ? h("optgroup", { label }, options(runs.map((r) => [r.key, r.id]))) : null);
    render(this.runs, group("Validation", validation), group("Identification", identification));
    render(this.stage,
      card(["Rig ", h("span", {}, rig || this.app.overview.name)], h("div", { class: "flush" }, table(columns, entries, { caption: "Models compared" }))),
      this.files(),
      reasons.length ? note("warn", h("b", {}, "Not identifiable from these data: "), reasons) : null,
      validation.length ? this.errors.element : note("", "These data have no validation runs; the models are ranked by cross-validation error."),
      h("div", { class: "row" }, h("label", { for: "compare-run" }, "Run"), this.runs),
      this.legend, h("div", { class: "figures" }, this.loops.v.element, this.loops.x.element));
    if (validation.length) this.app.run(this.drawErrors());
    this.app.run(this.drawLoops());
  }

  /** Links to the comparison as files. */
  files() {
    const { api } = this.app;
    const path = `/compare/rigs/${this.app.state.rig}`;
    const write = async () => {
      if (await this.writing.start(`${path}/files`)) h("a", { href: api.url(`${path}/files.zip`), download: "mrdamper-comparison.zip" }).click();
    };
    return h("div", { class: "group" },
      h("div", { class: "row" },
        h("a", { class: "button", href: api.url(`${path}/comparison.csv`), download: "comparison.csv" }, "Ranking as CSV"),
        h("button", { onclick: () => this.app.run(write()) }, "Page, tables and models as zip")),
      this.writing.element);
  }

  /** Vertical axis of the errors: one row a model. */
  errorAxis() {
    const titles = this.result?.entries.map((e) => e.title) ?? [];
    return {
      yaxis: {
        tickmode: "array", tickvals: titles.map((_, i) => -i), ticktext: titles.map((t) => (t.length > MAX_LETTERS ? `${t.slice(0, MAX_LETTERS - 1)}…` : t)),
        range: [-titles.length + 0.4, 0.6], automargin: true, zeroline: false, gridcolor: paint("grid"), linecolor: paint("line-strong"),
      },
    };
  }

  async drawErrors() {
    const { entries, validation_runs: runs } = this.result;
    const ids = new Map(runs.map((r) => [r.key, r.id]));
    const about = (s) => `${ids.get(s.key) ?? ""}${s.extrapolation.length ? `, outside: ${s.extrapolation.join(", ")}` : ""}`;
    this.errors.frame.classList.toggle("tall", entries.length > 6);
    const marks = entries.map((e, i) => ({
      x: e.scores.map((s) => 100 * s.nrmse_pp), y: e.scores.map(() => -i), mode: "markers", color: series(i).color, fill: "panel", size: 8,
      name: e.title, legend: false, text: e.scores.map(about), hover: "%{text}<br>%{x:.2f} %<extra></extra>",
    }));
    await this.errors.draw(marks, entries.map((e) => `${e.title}: ${percent(e.validation)}`).join("; "));
  }

  async drawLoops() {
    const { entries, validation_runs: validation, identification_runs: identification } = this.result;
    const { compareRun, rig } = this.app.state;
    const runs = [...validation, ...identification];
    const key = runs.some((r) => r.key === compareRun) ? compareRun : runs[0].key;
    this.runs.value = key;
    const { head, arrays } = await this.app.api.frame(`/compare/rigs/${rig}/runs/${key}`);
    if (rig !== this.app.state.rig) return;
    render(this.legend, h("span", { class: "faint" }, `${condition(head.condition)}:`), h("span", { class: "check" }, swatch({ color: "measured" }), "measured"),
      entries.map((e, i) => this.legendEntry(e, i)));
    for (const [axis, chart] of Object.entries(this.loops)) {
      const models = entries.map((e, i) => ({ x: arrays[`model${i}.${axis}`], y: arrays[`model${i}.F`], ...series(i), width: 1.7, name: e.title }));
      chart.reset();
      chart.draw([
        { x: arrays[`measured.${axis}`], y: arrays["measured.F"], color: "measured", width: 2.4, name: "measured" },
        ...models.filter((_, i) => this.drawn.has(entries[i].damper)),
      ], `${head.id}, ${condition(head.condition)}`);
    }
  }

  legendEntry(entry, index) {
    const toggle = () => {
      this.drawn.delete(entry.damper) || this.drawn.add(entry.damper);
      this.app.run(this.drawLoops());
    };
    return h("label", { class: "check" }, h("input", { type: "checkbox", id: `drawn-${index}`, checked: this.drawn.has(entry.damper), onchange: toggle }), swatch(series(index)), entry.title);
  }
}
