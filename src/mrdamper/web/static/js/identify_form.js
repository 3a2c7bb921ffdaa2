// The form of the Identify view: the whole study, or one model by one method from some runs.

import { field, h, note, options, render } from "./dom.js";
import { condition } from "./format.js";
import { rigChooser } from "./rig_chooser.js";

export class IdentifyForm {
  /** `start(study, body)` is called when the user starts; `body` is the request for one model. */
  constructor(app, start) {
    this.app = app;
    this.start = start;
    this.choices = null;
    this.study = h("input", { type: "radio", name: "what", id: "what-study", checked: true, onchange: () => this.toggle() });
    this.single = h("input", { type: "radio", name: "what", id: "what-one", onchange: () => this.toggle() });
    this.model = h("select", { id: "model-name", onchange: () => this.showModel() });
    this.method = h("select", { id: "method-name" });
    this.runs = h("select", { id: "which-runs" });
    this.over = h("select", { id: "over" }, options([["functions", "parameter functions fitted to individual fits"], ["joint", "global fit"]]));
    this.parameters = new ParameterChoice();
    this.rig = h("div", {});
    this.source = h("p", { class: "small faint" });
    this.button = h("button", { class: "primary", onclick: () => this.submit() }, "Start");
    this.details = h("div", { class: "group", hidden: true },
      this.rig, field("Model", this.model, this.source), field("Method", this.method),
      field("From", this.runs), field("Over all conditions", this.over), this.parameters.element);
    const choice = (radio, title, about) => h("label", { class: "check" }, radio, h("span", {}, title, h("br", {}), h("span", { class: "small faint" }, about)));
    this.element = h("div", { class: "group" },
      h("h2", {}, "Identify"),
      h("fieldset", { class: "group" },
        h("legend", { class: "hidden-text" }, "Scope of the identification"),
        choice(this.study, "Whole study", "all candidates, cross-validation, report"),
        choice(this.single, "One model", "individual fits, with residuals")),
      this.details, this.button);
  }

  /** Update the lists to the loaded data. */
  async refresh() {
    this.updateButton();
    render(this.rig, rigChooser(this.app, "identify"));
    if (!this.choices) {
      this.choices = await this.app.api.get("/choices");
      const { models, methods, model, method } = this.choices;
      render(this.model, options(models.map((m) => [m.name, m.title])));
      render(this.method, methods.map((m) => h("option", { value: m.name, title: m.about }, m.name)));
      this.model.value = model;
      this.method.value = method;
      this.showModel();
    }
    const table = await this.app.rigTable();
    const usable = table?.runs.filter((r) => !r.refused) ?? [];
    const count = usable.filter((r) => r.split === "train").length;
    const before = this.runs.value;
    render(this.runs, options([
      ["", ["no identification run can be used", "the only identification run"][count] ?? `all ${count} identification runs`],
      ...usable.map((r) => [r.key, `${r.id} (${condition(r.condition)})`]),
    ]));
    if (usable.some((r) => r.key === before)) this.runs.value = before;
  }

  /** Disable the start while an identification runs. */
  setBusy(busy) {
    this.busy = busy;
    this.updateButton();
  }

  updateButton() {
    this.button.disabled = Boolean(this.busy) || !this.app.overview;
  }

  showModel() {
    const model = this.choices.models.find((m) => m.name === this.model.value);
    this.source.textContent = `${model.source}${model.integrated ? ". Stepped in time: takes longer" : ""}`;
    this.parameters.show(model.whole_damper ? [] : model.parameters);
    this.method.disabled = this.over.disabled = model.whole_damper;
  }

  toggle() {
    this.details.hidden = this.study.checked;
  }

  submit() {
    const { missing } = this.parameters;
    if (this.single.checked && missing.length) return this.app.notify(note("warn", `Tick ${missing.join(", ")}, or give the value to hold at: there is no preset.`));
    return this.start(this.study.checked, {
      rig: this.app.state.rig, model: this.model.value, method: this.method.value, over: this.over.value,
      runs: this.runs.value ? [this.runs.value] : [], ...this.parameters.chosen,
    });
  }
}

/** Choice of the free parameters, and of the values of the others. */
class ParameterChoice {
  constructor() {
    this.rows = [];
    this.body = h("div", { class: "parameter-choice" });
    this.element = h("details", {}, h("summary", {}, "Parameters: free or held"), this.body);
  }

  show(parameters) {
    this.element.hidden = !parameters.length;
    this.rows = parameters.map((parameter) => this.row(parameter));
    render(this.body, h("p", { class: "small faint" }, "A ticked parameter is determined from the tests; another is held at the number beside it, in SI units, or at its preset where there is none."),
      this.rows.map((row) => row.element));
  }

  row({ name, unit, meaning, preset, default: value }) {
    const input = h("input", { type: "number", step: "any", "aria-label": `${name} held at, in ${unit}`, placeholder: value === null ? "number" : String(value), disabled: !preset });
    const box = h("input", { type: "checkbox", checked: !preset, onchange: () => (input.disabled = box.checked) });
    const element = h("div", { class: "row" },
      h("label", { class: "check grow", title: meaning }, box, h("span", {}, name, h("span", { class: "small faint" }, ` ${meaning}`))), input);
    return { name, preset, box, input, element };
  }

  get chosen() {
    const free = this.rows.filter((r) => r.box.checked && r.preset).map((r) => r.name);
    const held = this.rows.filter((r) => !r.box.checked && r.input.value.trim() !== "");
    return { free, fixed: Object.fromEntries(held.map((r) => [r.name, Number(r.input.value)])) };
  }

  /** Names of the parameters that have neither a value nor a preset. */
  get missing() {
    return this.rows.filter((r) => !r.box.checked && !r.preset && r.input.value.trim() === "").map((r) => r.name);
  }
}
