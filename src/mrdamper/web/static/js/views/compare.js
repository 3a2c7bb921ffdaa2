// Compare: models on runs none of them has seen.

import { Chart, paint, series } from "../chart.js";
import { card, h, note, put, swatch, table } from "../dom.js";
import { condition, percent, seconds } from "../format.js";
import { workBox } from "../work.js";

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
    this.answer = null;
    this.drawn = new Set(); // dampers whose loops are drawn
    this.work = workBox(bench);
    this.list = h("fieldset", { class: "field" });
    this.button = h("button", { class: "primary", onclick: () => this.start() }, "Compare");
    this.strip = new Chart({ title: "Error on held-out runs, one mark a run", x: "nrmse_pp (%)", y: "", name: "held-out-errors", zero: true, layout: () => this.rows() });
    this.loops = {
      v: new Chart({ title: "Force over velocity", x: "Velocity (m/s)", y: "Force (N)", name: "compared-force-velocity" }),
      x: new Chart({ title: "Force over displacement", x: "Displacement (mm)", y: "Force (N)", name: "compared-force-displacement" }),
    };
    this.runs = h("select", { id: "compare-run", onchange: () => bench.store.commit({ compareRun: this.runs.value }) });
    this.legend = h("div", { class: "row small" });
    this.stage = h("div", { class: "stage" });
    const side = h("div", { class: "side" }, h("div", { class: "group" },
      h("h2", {}, "Compare models"),
      h("p", { class: "small faint" }, "Each is identified from the train runs of the rig and predicts the held-out ones."),
      this.list, this.button), this.work.element);
    this.element = h("div", { class: "view" }, side, this.stage);
    document.addEventListener("bench:data", () => this.forget());
    this.forget();
  }

  shown() {
    this.choices().catch((error) => this.bench.fail(error));
    if (!this.answer) this.forget();
  }

  update(state, before) {
    if (state.rig !== before.rig) this.forget();
    if (this.answer && state.view === id && state.compareRun !== before.compareRun) this.safely(this.drawLoops());
  }

  safely(promise) {
    promise.catch((error) => this.bench.fail(error));
  }

  forget() {
    const { overview } = this.bench;
    this.answer = null;
    this.button.disabled = !overview;
    put(this.stage, h("div", { class: "empty" },
      h("h2", {}, overview ? "Nothing is compared yet" : "No data on the bench"),
      h("p", {}, overview ? "Choose models and compare them. Ranked by conditions left out; held-out runs confirm." : "Open the bundled tests or drop files on the Data page first."),
      overview ? null : h("button", { class: "primary", onclick: () => this.bench.store.pass({ view: "data" }) }, "Open data")));
  }

  async choices() {
    if (this.list.childElementCount) return;
    const found = await this.bench.api.get("/compare/choices");
    const box = (c) => h("input", { type: "checkbox", name: "contestant", value: c.name, checked: c.studied });
    put(this.list, h("legend", { class: "hidden-text" }, "Models"),
      found.map((c) => h("label", { class: "check", title: c.source }, box(c), c.name, c.slow ? h("span", { class: "badge" }, "slow") : null)));
  }

  async start() {
    const models = [...this.list.querySelectorAll("input:checked")].map((box) => box.value);
    if (!models.length) return this.bench.say(note("warn", "Choose at least one model."));
    const rig = this.bench.state.rig;
    this.button.disabled = true;
    const found = await this.work.run("/compare", { rig, models });
    this.button.disabled = false;
    if (!found || rig !== this.bench.state.rig) return;
    this.answer = found;
    this.drawn = new Set(found.entries.slice(0, OVERLAID).map((e) => e.damper));
    await this.bench.refreshDampers();
    this.bench.store.settle({ compareRun: found.held_out[0]?.key ?? null });
    this.show();
  }

  show() {
    const { entries, held_out: heldOut, refused, rig } = this.answer;
    const columns = [
      { title: "Model", value: (e) => h("span", { title: e.source }, e.title) },
      { title: "Left out", number: true, value: (e) => percent(e.left_out) },
      { title: "Held out", number: true, value: (e) => percent(e.held_out) },
      { title: "Other motion", number: true, value: (e) => percent(e.other) },
      { title: "Numbers", number: true, value: (e) => String(e.numbers) },
      { title: "Runs needed", number: true, value: (e) => String(e.runs_needed) },
      { title: "Time", number: true, value: (e) => seconds(e.seconds) },
      { title: "", value: (e) => h("button", { class: "quiet", onclick: () => this.bench.choose(e.damper, { view: "model" }) }, "Move it") },
    ];
    const why = Object.entries(refused).map(([name, reason]) => h("div", {}, `${name}: ${reason}`));
    put(this.runs, heldOut.map((r) => h("option", { value: r.key }, r.id)));
    put(this.stage,
      card(["Rig ", h("span", {}, rig || "without name")], h("div", { class: "flush" }, table(columns, entries, { caption: "Models compared" }))),
      why.length ? note("warn", h("b", {}, "Not determined from these data: "), why) : null,
      heldOut.length
        ? [this.strip.element,
          h("div", { class: "row" }, h("label", { for: "compare-run" }, "Held-out run"), h("div", { class: "grow" }, this.runs)),
          this.legend, h("div", { class: "figures" }, this.loops.v.element, this.loops.x.element)]
        : note("", "These data hold no held-out runs; the ranking rests on conditions left out."));
    this.safely(this.drawStrip());
    this.safely(this.drawLoops());
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
      x: e.scores.map((s) => 100 * s.nrmse_pp), y: e.scores.map(() => -i), mode: "markers", color: series(i).color, fill: "rgba(0,0,0,0)", size: 8,
      name: e.title, legend: false, text: e.scores.map(about), hover: "%{text}<br>%{x:.2f} %<extra></extra>",
    }));
    await this.strip.draw(marks, entries.map((e) => `${e.title}: ${percent(e.held_out)}`).join("; "));
  }

  async drawLoops() {
    const { entries, held_out: heldOut } = this.answer;
    const key = heldOut.some((r) => r.key === this.bench.state.compareRun) ? this.bench.state.compareRun : heldOut[0]?.key;
    if (!key) return;
    this.runs.value = key;
    const { head, arrays } = await this.bench.api.frame(`/compare/runs/${key}`);
    put(this.legend, h("span", { class: "faint" }, `${condition(head.condition)}:`), h("span", { class: "check" }, swatch({ color: "var(--measured)" }), "measured"),
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
    return h("label", { class: "check" }, h("input", { type: "checkbox", checked: this.drawn.has(entry.damper), onchange: toggle }), swatch(series(index)), entry.title);
  }
}
