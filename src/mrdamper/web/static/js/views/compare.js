// Compare: models on runs none of them has seen.

import { Chart } from "../chart.js";
import { paint, series } from "../colours.js";
import { busy, card, empty, h, note, put, renew, table } from "../dom.js";
import { condition, percent, seconds } from "../format.js";
import { swatch } from "../legend.js";
import { rigChooser } from "../rig_chooser.js";
import { workBox } from "../job_progress.js";

export const id = "compare";
export const label = "Compare";

const OVERLAID = 3; // models drawn at first; others are one click away
const LONGEST = 34; // letters of a title beside the strip

export function create(bench) {
  return new CompareView(bench);
}

class CompareView {
  constructor(bench) {
    this.bench = bench;
    this.answers = new Map(); // rig number to what came of its comparison
    this.drawn = new Set(); // dampers whose loops are drawn
    this.work = workBox(bench);
    this.writing = workBox(bench);
    this.comparing = false;
    this.rig = h("div", {});
    this.list = h("fieldset", { class: "field" });
    this.button = h("button", { class: "primary", onclick: () => this.start() }, "Compare");
    this.strip = new Chart({ title: "Error of the validation runs, one mark per run", x: "Error (% of the peak-to-peak force)", y: "", name: "validation-errors", zero: true, layout: () => this.rows() });
    this.loops = {
      v: new Chart({ title: "Force over velocity", x: ["Velocity", "m/s"], y: ["Force", "N"], name: "compared-force-velocity" }),
      x: new Chart({ title: "Force over displacement", x: ["Displacement", "mm"], y: ["Force", "N"], name: "compared-force-displacement" }),
    };
    this.runs = h("select", { id: "compare-run", onchange: () => bench.store.commit({ compareRun: this.runs.value }) });
    this.legend = h("div", { class: "row small" });
    this.stage = h("div", { class: "stage" });
    const side = h("div", { class: "side" }, h("div", { class: "group" },
      h("h2", {}, "Compare models"),
      h("p", { class: "small faint" }, "Every model is identified from the identification runs of the rig and predicts the validation runs."),
      this.rig, this.button, this.list), this.work.element);
    this.element = h("div", { class: "view" }, side, this.stage);
    document.addEventListener("bench:data", () => this.forget());
    document.addEventListener("bench:units", () => this.answer && this.show());
    this.forget();
  }

  get answer() {
    return this.answers.get(this.bench.state.rig) ?? null;
  }

  shown() {
    this.safely(this.choices());
  }

  update(state, before) {
    if (state.rig !== before.rig) {
      this.offer();
      this.show();
    } else if (this.answer && state.view === id && state.compareRun !== before.compareRun) this.safely(this.drawLoops());
  }

  safely(promise) {
    promise.catch((error) => this.bench.fail(error));
  }

  /** Other data. */
  forget() {
    this.answers.clear();
    this.offer();
    this.show();
  }

  offer() {
    renew(this.rig, rigChooser(this.bench, "compare"));
    this.button.disabled = this.comparing || !this.bench.overview;
  }

  nothing() {
    const { overview, store } = this.bench;
    if (this.comparing) return busy("Comparing …", "The other views can be used meanwhile.");
    return overview
      ? empty("No comparison yet", "Choose models and compare them. They are ranked by cross-validation error (leave one condition out).")
      : empty("No data on the bench", "Open the bundled tests or drop files on the Data page first.", h("button", { class: "primary", onclick: () => store.pass({ view: "data" }) }, "Open data"));
  }

  async choices() {
    if (this.list.childElementCount) return;
    const found = await this.bench.api.get("/compare/choices");
    const box = (c) => h("input", { type: "checkbox", name: "contestant", value: c.name, checked: c.studied });
    const check = (which) => () => this.list.querySelectorAll("input").forEach((input, i) => (input.checked = which(found[i])));
    const link = (text, which) => h("button", { type: "button", class: "link small", onclick: check(which) }, text);
    put(this.list, h("legend", {}, "Models"),
      h("div", { class: "row" }, link("Those of the study", (c) => c.studied), link("All but slow", (c) => !c.slow), link("None", () => false)),
      found.map((c) => h("label", { class: "check", title: c.source }, box(c), c.title, c.slow ? h("span", { class: "badge" }, "slow") : null)));
  }

  start() {
    const models = [...this.list.querySelectorAll("input:checked")].map((box) => box.value);
    if (!models.length) return this.bench.say(note("warn", "Choose at least one model."));
    return this.attend(this.work.run("/compare", { rig: this.bench.state.rig, models }));
  }

  /** A page that was loaded again: go on watching, or show the result. */
  resume(jobs) {
    const last = jobs.find((job) => job.kind === "compare");
    if (last?.state === "done") this.take(last.answer);
    else if (last && last.state !== "cancelled") this.safely(this.attend(this.work.resume(last)));
  }

  async attend(work) {
    const { overview } = this.bench;
    this.comparing = true;
    this.offer();
    if (!this.answer) put(this.stage, this.nothing());
    const found = await work;
    this.comparing = false;
    this.offer();
    if (overview !== this.bench.overview) return this.work.clear(); // other data lie on the bench by now
    if (found) await this.bench.refreshDampers();
    if (found) this.take(found);
    else if (!this.answer) this.show();
  }

  take(found) {
    this.answers.set(found.number, found);
    if (found.number !== this.bench.state.rig) return;
    this.show();
  }

  show() {
    if (!this.answer) {
      put(this.stage, this.nothing());
      return;
    }
    const { entries, held_out: heldOut, train, refused, rig } = this.answer;
    this.drawn = new Set(entries.slice(0, OVERLAID).map((e) => e.damper));
    const known = (name, title) => (entries.some((e) => e[name] !== null) ? [{ title, number: true, value: (e) => percent(e[name]) }] : []);
    const columns = [
      { title: "Model", value: (e) => h("span", { title: e.source }, e.title) },
      { title: "Cross-validation", number: true, value: (e) => percent(e.left_out) },
      ...known("held_out", "Validation"),
      { title: "Parameters", number: true, value: (e) => String(e.numbers) },
      { title: "Runs needed", number: true, value: (e) => String(e.runs_needed) },
      { title: "Time", number: true, value: (e) => seconds(e.seconds) },
      { title: "", value: (e) => h("button", { class: "link", "aria-label": `Explore ${e.title}`, onclick: () => this.bench.choose(e.damper, { view: "model" }) }, "Explore") },
    ];
    const why = Object.entries(refused).map(([name, reason]) => h("div", {}, `${name}: ${reason}`));
    const group = (label, runs) => (runs.length ? h("optgroup", { label }, runs.map((r) => h("option", { value: r.key }, r.id))) : null);
    put(this.runs, group("Validation", heldOut), group("Identification", train));
    put(this.stage,
      card(["Rig ", h("span", {}, rig || this.bench.overview.name)], h("div", { class: "flush" }, table(columns, entries, { caption: "Models compared" }))),
      this.takeAway(),
      why.length ? note("warn", h("b", {}, "Not identifiable from these data: "), why) : null,
      heldOut.length ? this.strip.element : note("", "These data have no validation runs; the models are ranked by cross-validation error."),
      h("div", { class: "row" }, h("label", { for: "compare-run" }, "Run"), this.runs),
      this.legend, h("div", { class: "figures" }, this.loops.v.element, this.loops.x.element));
    if (heldOut.length) this.safely(this.drawStrip());
    this.safely(this.drawLoops());
  }

  /** The comparison as files. */
  takeAway() {
    const { api } = this.bench;
    const path = `/compare/rigs/${this.bench.state.rig}`;
    const write = async () => {
      if (await this.writing.run(`${path}/files`)) h("a", { href: api.url(`${path}/files.zip`), download: "mrdamper-comparison.zip" }).click();
    };
    return h("div", { class: "group" },
      h("div", { class: "row" },
        h("a", { class: "button", href: api.url(`${path}/comparison.csv`), download: "comparison.csv" }, "Ranking as CSV"),
        h("button", { onclick: () => this.safely(write()) }, "Page, tables and models as zip")),
      this.writing.element);
  }

  /** The strip's vertical axis: one row a model. */
  rows() {
    const titles = this.answer?.entries.map((e) => e.title) ?? [];
    return {
      yaxis: {
        tickmode: "array", tickvals: titles.map((_, i) => -i), ticktext: titles.map((t) => (t.length > LONGEST ? `${t.slice(0, LONGEST - 1)}…` : t)),
        range: [-titles.length + 0.4, 0.6], automargin: true, zeroline: false, gridcolor: paint("grid"), linecolor: paint("line-strong"),
      },
    };
  }

  async drawStrip() {
    const { entries, held_out: heldOut } = this.answer;
    const ids = new Map(heldOut.map((r) => [r.key, r.id]));
    const about = (s) => `${ids.get(s.key) ?? ""}${s.extrapolation.length ? `, outside: ${s.extrapolation.join(", ")}` : ""}`;
    this.strip.element.querySelector(".frame").classList.toggle("tall", entries.length > 6);
    const marks = entries.map((e, i) => ({
      x: e.scores.map((s) => 100 * s.nrmse_pp), y: e.scores.map(() => -i), mode: "markers", color: series(i).color, fill: "panel", size: 8,
      name: e.title, legend: false, text: e.scores.map(about), hover: "%{text}<br>%{x:.2f} %<extra></extra>",
    }));
    await this.strip.draw(marks, entries.map((e) => `${e.title}: ${percent(e.held_out)}`).join("; "));
  }

  async drawLoops() {
    const { entries, held_out: heldOut, train } = this.answer;
    const runs = [...heldOut, ...train];
    const key = runs.some((r) => r.key === this.bench.state.compareRun) ? this.bench.state.compareRun : runs[0].key;
    this.runs.value = key;
    const { rig } = this.bench.state;
    const { head, arrays } = await this.bench.api.frame(`/compare/rigs/${rig}/runs/${key}`);
    if (rig !== this.bench.state.rig) return;
    renew(this.legend, h("span", { class: "faint" }, `${condition(head.condition)}:`), h("span", { class: "check" }, swatch({ color: "measured" }), "measured"),
      entries.map((e, i) => this.legendEntry(e, i)));
    for (const [axis, chart] of Object.entries(this.loops)) {
      const shown = entries.map((e, i) => [e, i]).filter(([e]) => this.drawn.has(e.damper));
      chart.reset();
      chart.draw([
        { x: arrays[`measured.${axis}`], y: arrays["measured.F"], color: "measured", width: 2.4, name: "measured" },
        ...shown.map(([e, i]) => ({ x: arrays[`model${i}.${axis}`], y: arrays[`model${i}.F`], ...series(i), width: 1.7, name: e.title })),
      ], `${head.id}, ${condition(head.condition)}`);
    }
  }

  legendEntry(entry, index) {
    const toggle = () => {
      this.drawn.delete(entry.damper) || this.drawn.add(entry.damper);
      this.safely(this.drawLoops());
    };
    return h("label", { class: "check" }, h("input", { type: "checkbox", id: `drawn-${index}`, checked: this.drawn.has(entry.damper), onchange: toggle }), swatch(series(index)), entry.title);
  }
}
