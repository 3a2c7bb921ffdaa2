// The panel of the Model view: damper, condition, and parameters as sliders.

import { field, h, options, render } from "./dom.js";
import { slider } from "./slider.js";
import { onScreen } from "./units.js";

const MM = 1000;
const ORIGIN = { study: "from the study", bundled: "identified by a study of the bundled tests", identification: "identified here", comparison: "from the comparison", file: "from a file" };
const CONDITION = [
  { name: "current_A", symbol: "I", meaning: "current", unit: "A", least: "the magnitude of the current is used, 0 A or more", bounds: ([, high]) => [0, 100 * high] },
  { name: "frequency_Hz", symbol: "f", meaning: "frequency", unit: "Hz", scale: "log", least: "a motion has a frequency above 0 Hz", bounds: ([low, high]) => [low / 100, high * 100] },
  { name: "amplitude_m", symbol: "X", meaning: "amplitude", unit: "m", least: "a motion has an amplitude above 0", bounds: ([low, high]) => [low / 100, high * 100] },
];

export class ModelPanel {
  /** `drag(change, time)` and `settle(change)` receive the changes of the state that the sliders make. */
  constructor(app, { drag, settle }) {
    Object.assign(this, { app, drag, settle, sliders: {}, damper: null, tested: new Map() });
    this.element = h("div", { class: "side" });
    this.pending = h("p", { class: "small message", role: "status" });
    const showPending = () => {
      this.pending.hidden = !app.studyRunning;
      this.pending.textContent = app.studyRunning ? "A study is running. The model it selects will be added to this list." : "";
    };
    showPending();
    app.on("study", showPending);
    this.runs = h("select", { id: "tested-run", onchange: () => this.goToRun(this.runs.value) });
    this.family = h("input", { type: "checkbox", id: "family", onchange: () => app.store.commit({ family: this.family.checked }) });
  }

  /** Build the sliders of a damper. */
  build(damper) {
    this.damper = damper;
    this.sliders = {};
    render(this.element, this.chooser(), this.conditions(), this.parameters());
  }

  /** Set all sliders to the state, and the parameters that follow the condition to `values`. */
  set(values = null) {
    const { held, family } = this.app.state;
    for (const { name } of CONDITION) this.sliders[name].set(this.condition[name]);
    for (const { name } of this.damper.parameters) {
      const value = held[name] ?? values?.[name] ?? null;
      if (value !== null) this.sliders[`p.${name}`].set(value, name in held);
    }
    this.family.checked = family;
    this.runs.value = [...this.tested].find(([, c]) => CONDITION.every(({ name }) => c[name] === this.condition[name]))?.[0] ?? "";
  }

  /** The condition of the state, or the initial one of the damper. */
  get condition() {
    return this.app.state.condition ?? this.damper.start;
  }

  /** List the dampers. */
  list() {
    render(this.dampers, this.app.damperOptions());
    this.dampers.value = this.damper.key;
  }

  chooser() {
    const { title, parameter_count: count, origin, rig, note } = this.damper;
    this.dampers = h("select", { id: "damper", onchange: () => this.app.selectDamper(this.dampers.value) });
    this.list();
    return field("Damper", this.dampers,
      h("p", { class: "small faint" }, `${title}: ${count} parameters, ${ORIGIN[origin] ?? origin}${rig ? `, rig ${rig}` : ""}${note ? `; ${note}` : ""}.`), this.pending);
  }

  conditions() {
    return h("div", { class: "group" }, h("h2", {}, "Condition"), CONDITION.map((spec) => this.conditionSlider(spec)),
      this.testedRuns(),
      h("label", { class: "check" }, this.family, "Loops at all tested currents, with those measured"));
  }

  /** A list of the measured runs of the damper's rig; null where they are not loaded. */
  testedRuns() {
    const rig = this.app.rigNumber(this.damper.rig);
    this.tested = new Map();
    if (rig < 0) return null;
    this.app.run(this.app.rigTable(rig).then(({ runs }) => {
      const sines = runs.filter((r) => r.peak_N !== null);
      this.tested = new Map(sines.map(({ key, condition: { amplitude_mm: mm, ...rest } }) => [key, { ...rest, amplitude_m: mm / MM }]));
      render(this.runs, options([["", "choose one"], ...sines.map((r) => [r.key, `${r.id}${r.split === "validate" ? " (validation)" : ""}`])]));
    }));
    return field("At the condition of a tested run", this.runs);
  }

  /** Set the sliders to the condition of a run, whose measured loop is then the nearest. */
  goToRun(key) {
    if (this.tested.has(key)) this.app.store.commit({ condition: this.tested.get(key) });
  }

  parameters() {
    const { parameters, follows } = this.damper;
    const [main, preset] = [false, true].map((wanted) => parameters.filter((p) => p.preset === wanted).map((p) => this.parameterSlider(p)));
    const text = parameters.length
      ? `${follows ? "They follow the condition" : "One set for every condition"}. A slider that is moved holds its value until released.`
      : "This model has no parameters to change.";
    return h("div", { class: "group" },
      h("div", { class: "row" }, h("h2", { class: "grow" }, "Parameters"),
        h("button", { class: "link small", onclick: () => this.app.store.commit({ held: {}, condition: null }) }, "Reset all")),
      h("p", { class: "small faint" }, text),
      main,
      preset.length ? h("details", {}, h("summary", {}, "Held at their presets in the identification"), h("div", { class: "group" }, preset)) : null);
  }

  conditionSlider(spec) {
    const [low, high] = this.damper.reach[spec.name];
    const full = { ...spec, ...onScreen(spec.unit), low, high, value: this.damper.start[spec.name], tested: this.damper.envelope[spec.name], bounds: spec.bounds([low, high]) };
    return this.addSlider(spec.name, full, (value) => ({ condition: { ...this.condition, [spec.name]: value } }));
  }

  parameterSlider(p) {
    const change = (value) => ({ held: { ...this.app.state.held, [p.name]: value } });
    return this.addSlider(`p.${p.name}`, { ...p, symbol: p.name, ...onScreen(p.unit) }, change, () => {
      const { [p.name]: _released, ...held } = this.app.state.held;
      this.app.store.commit({ held });
    });
  }

  addSlider(key, spec, change, release) {
    this.sliders[key] = slider(spec, {
      drag: (value, time) => this.drag(change(value), time),
      settle: (value) => this.settle(change(value)),
      release,
    });
    return this.sliders[key].element;
  }
}
