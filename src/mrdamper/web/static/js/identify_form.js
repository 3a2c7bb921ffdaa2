// What to identify: the whole study, or one model by one method from some runs.

import { h, note, put, renew } from "./dom.js";
import { condition } from "./format.js";
import { rigChooser } from "./rig_chooser.js";

export class IdentifyForm {
  /** `start({whole, body})` is called when the reader begins. */
  constructor(bench, start) {
    this.bench = bench;
    this.start = start;
    this.choices = null;
    this.whole = h("input", { type: "radio", name: "what", id: "what-study", checked: true, onchange: () => this.toggle() });
    this.one = h("input", { type: "radio", name: "what", id: "what-one", onchange: () => this.toggle() });
    this.model = h("select", { id: "model-name", onchange: () => this.about() });
    this.method = h("select", { id: "method-name" });
    this.runs = h("select", { id: "which-runs" });
    this.over = h("select", { id: "over" },
      h("option", { value: "functions" }, "parameter functions fitted to individual fits"), h("option", { value: "joint" }, "global fit"));
    this.parameters = new ParameterChoice();
    this.rig = h("div", {});
    this.source = h("p", { class: "small faint" });
    this.button = h("button", { class: "primary", onclick: () => this.go() }, "Start");
    this.details = this.fields();
    this.element = this.layout();
  }

  fields() {
    const field = (name, text, control, ...more) => h("div", { class: "field" }, h("label", { for: name }, text), control, more);
    return h("div", { class: "group", hidden: true },
      this.rig, field("model-name", "Model", this.model, this.source), field("method-name", "Method", this.method),
      field("which-runs", "From", this.runs), field("over", "Over all conditions", this.over), this.parameters.element);
  }

  layout() {
    const choice = (radio, title, about) => h("label", { class: "check" }, radio, h("span", {}, title, h("br", {}), h("span", { class: "small faint" }, about)));
    return h("div", { class: "group" },
      h("h2", {}, "Identify"),
      h("fieldset", { class: "group" },
        h("legend", { class: "hidden-text" }, "What to identify"),
        choice(this.whole, "Whole study", "all candidates, cross-validation, report"),
        choice(this.one, "One model", "individual fits, with residuals")),
      this.details, this.button);
  }

  /** Bring the lists to the data on the bench. */
  async refresh() {
    this.offer();
    renew(this.rig, rigChooser(this.bench, "identify"));
    if (!this.choices) {
      this.choices = await this.bench.api.get("/choices");
      const { models, methods, model, method } = this.choices;
      put(this.model, models.map((m) => h("option", { value: m.name }, m.title)));
      put(this.method, methods.map((m) => h("option", { value: m.name, title: m.about }, m.name)));
      this.model.value = model;
      this.method.value = method;
      this.about();
    }
    const found = await this.bench.rigTable();
    const usable = found?.runs.filter((r) => !r.refused) ?? [];
    const train = usable.filter((r) => r.split === "train").length;
    const before = this.runs.value;
    put(this.runs, h("option", { value: "" }, ["no identification run can be used", "the only identification run"][train] ?? `all ${train} identification runs`),
      usable.map((r) => h("option", { value: r.key }, `${r.id} (${condition(r.condition)})`)));
    if (usable.some((r) => r.key === before)) this.runs.value = before;
  }

  /** Whether something is being identified: one thing at a time. */
  working(on) {
    this.at = on;
    this.offer();
  }

  offer() {
    this.button.disabled = Boolean(this.at) || !this.bench.overview;
  }

  about() {
    const chosen = this.choices.models.find((m) => m.name === this.model.value);
    this.source.textContent = `${chosen.source}${chosen.integrated ? ". Stepped in time: takes longer" : ""}`;
    this.parameters.show(chosen.jointly ? [] : chosen.parameters);
    this.method.disabled = this.over.disabled = chosen.jointly;
  }

  toggle() {
    this.details.hidden = this.whole.checked;
  }

  go() {
    const missing = this.whole.checked ? [] : this.parameters.missing;
    if (missing.length) return this.bench.say(note("warn", `Tick ${missing.join(", ")}, or give the value to hold at: there is no preset.`));
    this.start({
      whole: this.whole.checked,
      body: {
        rig: this.bench.state.rig, model: this.model.value, method: this.method.value, over: this.over.value,
        runs: this.runs.value ? [this.runs.value] : [], ...this.parameters.chosen,
      },
    });
  }
}

/** Which parameters are determined, and at what the others are held. */
class ParameterChoice {
  constructor() {
    this.rows = [];
    this.body = h("div", { class: "parameter-choice" });
    this.element = h("details", {}, h("summary", {}, "Parameters: free or held"), this.body);
  }

  show(parameters) {
    this.element.hidden = !parameters.length;
    this.rows = parameters.map((p) => this.row(p));
    put(this.body, h("p", { class: "small faint" }, "A ticked parameter is determined from the tests; another is held at the number beside it, in SI units, or at its preset where there is none."),
      this.rows.map((row) => row.element));
  }

  row(parameter) {
    const value = h("input", { type: "number", step: "any", "aria-label": `${parameter.name} held at, in ${parameter.unit}`, placeholder: parameter.default === null ? "number" : String(parameter.default) });
    const free = h("input", { type: "checkbox", checked: !parameter.preset, onchange: () => (value.disabled = free.checked) });
    value.disabled = free.checked;
    const element = h("div", { class: "row" },
      h("label", { class: "check grow", title: parameter.meaning }, free, h("span", {}, parameter.name, h("span", { class: "small faint" }, ` ${parameter.meaning}`))), value);
    return { parameter, free, value, element };
  }

  get chosen() {
    const free = this.rows.filter((r) => r.free.checked && r.parameter.preset).map((r) => r.parameter.name);
    const held = this.rows.filter((r) => !r.free.checked && r.value.value.trim() !== "");
    return { free, fixed: Object.fromEntries(held.map((r) => [r.parameter.name, Number(r.value.value)])) };
  }

  /** What hinders a start, in words. */
  get missing() {
    const rows = this.rows.filter((r) => !r.free.checked && !r.parameter.preset && r.value.value.trim() === "");
    return rows.map((r) => r.parameter.name);
  }
}
