// The panel of the Model view: which damper, its condition, and its parameters under sliders.

import { h, put } from "./dom.js";
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
  /** `dragging(change, when)` and `settled(change)` hear of the sliders; a change is one of the state. */
  constructor(bench, { dragging, settled }) {
    Object.assign(this, { bench, dragging, settled, sliders: {}, damper: null });
    this.element = h("div", { class: "side" });
    this.pending = h("p", { class: "small message", role: "status" });
    const pending = () => {
      this.pending.hidden = !bench.studying;
      this.pending.textContent = bench.studying ? "A study is running. The model it selects will be added to this list." : "";
    };
    pending();
    document.addEventListener("bench:studying", pending);
    this.runs = h("select", { id: "tested-run", onchange: () => this.goTo(this.runs.value) });
    this.family = h("input", { type: "checkbox", id: "family", onchange: () => bench.store.commit({ family: this.family.checked }) });
  }

  /** Nothing to move. */
  empty() {
    put(this.element, h("p", { class: "faint" }, "No model yet."));
  }

  /** Sliders for a damper as the bench describes it. */
  build(damper) {
    this.damper = damper;
    this.sliders = {};
    put(this.element, this.chooser(), this.conditions(), this.parameters());
  }

  /** Bring all sliders to the state, and the parameters that follow to `values`. */
  set(values = null) {
    const { condition, held, family } = this.bench.state;
    const at = condition ?? this.damper.start;
    for (const { name } of CONDITION) this.sliders[name].set(at[name]);
    for (const { name } of this.damper.parameters) {
      const value = held[name] ?? values?.[name] ?? null;
      if (value !== null) this.sliders[`p.${name}`].set(value, name in held);
    }
    this.family.checked = family;
    const there = (c) => c.current_A === at.current_A && c.frequency_Hz === at.frequency_Hz && c.amplitude_mm / MM === at.amplitude_m;
    this.runs.value = [...(this.tested ?? [])].find(([, c]) => there(c))?.[0] ?? "";
  }

  /** The dampers to choose from. */
  list() {
    put(this.dampers, this.bench.damperOptions());
    this.dampers.value = this.damper.key;
  }

  chooser() {
    const { title, numbers, origin, rig, note } = this.damper;
    this.dampers = h("select", { id: "damper", onchange: () => this.bench.choose(this.dampers.value) });
    this.list();
    return h("div", { class: "field" }, h("label", { for: "damper" }, "Damper"), this.dampers,
      h("p", { class: "small faint" }, `${title}: ${numbers} parameters, ${ORIGIN[origin] ?? origin}${rig ? `, rig ${rig}` : ""}${note ? `; ${note}` : ""}.`), this.pending);
  }

  conditions() {
    return h("div", { class: "group" }, h("h2", {}, "Condition"), CONDITION.map((spec) => this.conditionSlider(spec)),
      this.testedRuns(),
      h("label", { class: "check" }, this.family, "Loops at all tested currents, with those measured"));
  }

  /** Runs of the damper's rig, to lay one under the prediction. */
  testedRuns() {
    const rig = this.bench.overview?.rigs.findIndex((r) => r.name === this.damper.rig) ?? -1;
    if (rig < 0) return null;
    this.bench.rigTable(rig).then(({ runs }) => {
      this.tested = new Map(runs.filter((r) => r.peak_N !== null).map((r) => [r.key, r.condition]));
      put(this.runs, h("option", { value: "" }, "choose one"),
        runs.filter((r) => this.tested.has(r.key)).map((r) => h("option", { value: r.key }, `${r.id}${r.split === "validate" ? " (validation)" : ""}`)));
    }).catch((error) => this.bench.fail(error));
    return h("div", { class: "field" }, h("label", { for: "tested-run" }, "At the condition of a tested run"), this.runs);
  }

  /** The sliders go to where a run was made: its measured loop is the nearest then. */
  goTo(key) {
    const at = this.tested.get(key);
    if (!at) return;
    this.bench.store.commit({ condition: { current_A: at.current_A, frequency_Hz: at.frequency_Hz, amplitude_m: at.amplitude_mm / MM } });
  }

  parameters() {
    const made = this.damper.parameters.map((p) => ({ preset: p.preset, element: this.parameterSlider(p) }));
    const [main, preset] = [false, true].map((wanted) => made.filter((p) => p.preset === wanted).map((p) => p.element));
    return h("div", { class: "group" },
      h("div", { class: "row" }, h("h2", { class: "grow" }, "Parameters"),
        h("button", { class: "link small", onclick: () => this.bench.store.commit({ held: {}, condition: null }) }, "Reset all")),
      h("p", { class: "small faint" }, made.length
        ? `${this.damper.follows ? "They follow the condition" : "One set for every condition"}. A slider that is moved holds its value until released.`
        : "This model has no parameters to change."),
      main,
      preset.length ? h("details", {}, h("summary", {}, "Held at their presets in the identification"), h("div", { class: "group" }, preset)) : null);
  }

  conditionSlider(spec) {
    const [low, high] = this.damper.reach[spec.name];
    const full = { ...spec, ...onScreen(spec.unit), low, high, value: this.damper.start[spec.name], tested: this.damper.envelope[spec.name], bounds: spec.bounds([low, high]) };
    return this.listen(spec.name, full, (value) => ({ condition: { ...(this.bench.state.condition ?? this.damper.start), [spec.name]: value } }));
  }

  parameterSlider(p) {
    const change = (value) => ({ held: { ...this.bench.state.held, [p.name]: value } });
    return this.listen(`p.${p.name}`, { ...p, symbol: p.name, ...onScreen(p.unit) }, change, () => {
      const { [p.name]: _gone, ...rest } = this.bench.state.held;
      this.bench.store.commit({ held: rest });
    });
  }

  listen(key, spec, change, release) {
    this.sliders[key] = slider(spec, {
      drag: (value, when) => this.dragging(change(value), when),
      settle: (value) => this.settled(change(value)),
      release,
    });
    return this.sliders[key].element;
  }
}
