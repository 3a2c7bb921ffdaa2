// Model: a damper under the sliders. The loops follow while a slider is dragged.

import { Latest } from "../api.js";
import { h, note, put } from "../dom.js";
import { figures } from "../format.js";
import { ModelCharts } from "../model_charts.js";
import { ModelPanel } from "../model_panel.js";

export const id = "model";
export const label = "Model";

const MM = 1000;
const SETTLE = 300; // milliseconds after a drag until the axes fit again
const [COARSE, FINE] = [9, 33]; // points of the curves over current: while dragged, and at rest

export function create(bench) {
  return new ModelView(bench);
}

class ModelView {
  constructor(bench) {
    this.bench = bench;
    this.charts = new ModelCharts(bench);
    this.panel = new ModelPanel(bench, {
      dragging: (change, when) => this.dragging(change, when),
      settled: (change) => this.settled(change),
    });
    this.stage = h("div", { class: "stage fill" });
    this.element = h("div", { class: "view" }, this.panel.element, this.stage);
    this.verdict = h("div", {});
    this.spoken = h("p", { class: "hidden-text", "aria-live": "polite" });
    this.damper = null; // as the bench describes it
    this.moved = null; // when the slider was moved that the next question is about
    this.latest = new Latest(
      ({ key, ask }) => bench.api.frame(`/dampers/${key}/predict`, ask),
      (found, question) => this.draw(found, question),
      (error) => bench.fail(error),
    );
    document.addEventListener("bench:dampers", () => {
      this.damper = null; // the list of dampers is another
      this.shown();
    });
  }

  shown() {
    if (this.bench.state.view === id) this.refresh().catch((error) => this.bench.fail(error));
  }

  update(state, before) {
    if (["damper", "condition", "held", "family"].some((name) => state[name] !== before[name])) this.shown();
  }

  /** Bring the panel to the damper chosen, and ask for its loops. */
  async refresh() {
    const { state, dampers, store } = this.bench;
    const key = state.damper ?? dampers.at(-1)?.key ?? null;
    if (key === null) {
      this.damper = null;
      this.panel.empty();
      put(this.stage, nothing(this.bench));
      return;
    }
    if (key !== state.damper) {
      store.settle({ damper: key });
      return;
    }
    if (key !== this.damper?.key && !(await this.bring(key))) return;
    this.panel.set();
    this.ask();
  }

  /** Put a damper under the sliders; false where another was chosen meanwhile. */
  async bring(key) {
    const found = await this.bench.api.get(`/dampers/${key}`);
    if (key !== this.bench.state.damper) return false;
    this.damper = found;
    this.panel.build(found);
    this.charts.reset();
    put(this.stage, this.verdict, this.charts.element, this.spoken);
    this.keepDocument(key);
    return true;
  }

  ask() {
    const { damper, condition, held, family } = this.bench.state;
    if (this.damper?.key !== damper) return;
    const ask = { ...(condition ?? this.damper.start), held, family, currents: this.charts.held ? COARSE : FINE };
    this.latest.want({ key: damper, moved: this.moved, ask });
    this.moved = null;
  }

  async draw({ head, arrays }, { key, ask, moved }) {
    if (key !== this.damper?.key) return;
    this.panel.set(head.parameters);
    this.judge(head, ask);
    await this.charts.draw(head, arrays, ask.current_A, this.damper.rig);
    if (moved !== null) measure(moved);
  }

  dragging(change, when) {
    clearTimeout(this.settling);
    this.moved = when;
    this.charts.held = true;
    this.bench.store.pass(change);
  }

  settled(change) {
    this.bench.store.commit(change);
    clearTimeout(this.settling); // keys move a slider step by step: the axes wait for the last
    this.settling = setTimeout(() => {
      this.charts.held = false;
      this.ask(); // once more, finely, with axes that fit
    }, SETTLE);
  }

  /** Say whether the condition was tested, and what the loop amounts to. */
  judge(head, ask) {
    const e = this.damper.envelope;
    const tested = {
      current: ["current", `${figures(ask.current_A, 3)} A, tested ${span(e.current_A, 1)} A`],
      frequency: ["frequency", `${figures(ask.frequency_Hz, 3)} Hz, tested ${span(e.frequency_Hz, 1)} Hz`],
      amplitude: ["amplitude", `${figures(MM * ask.amplitude_m, 3)} mm, tested ${span(e.amplitude_m, MM)} mm`],
      velocity: ["peak velocity", `${figures(head.peak_velocity_m_s, 3)} m/s, tested ${span(e.peak_velocity_m_s, 1)} m/s`],
    };
    const flags = head.extrapolation.map((flag) => tested[flag] ?? [flag, ""]);
    const [now] = head.loops;
    const said = flags.length ? `Extrapolation in ${flags.map(([name]) => name).join(", ")}` : "Inside the tested conditions";
    if (this.spoken.textContent !== said) this.spoken.textContent = said; // spoken when it changes, not at every move
    put(this.verdict, flags.length
      ? note("warn", h("div", {}, h("b", {}, "Extrapolation: "), `${flags.map((f) => f.join(" ")).join("; ")}. Nothing was measured there; the loop is dashed.`))
      : note("", h("div", {}, h("b", {}, "Inside the tested conditions: "), `peak force ${figures(now.peak_N)} N, energy ${figures(now.energy_J)} J a cycle${head.nearest.length ? "" : "; no run was measured near this condition"}.`)));
  }

  /** The model's document goes into the state, so that a link carries it. */
  async keepDocument(key) {
    try {
      const { text } = await this.bench.api.post(`/dampers/${key}/document`, { held: {} });
      if (this.bench.state.damper === key) this.bench.store.settle({ document: JSON.stringify(JSON.parse(text)) });
    } catch (error) {
      if (error.status !== 422) return this.bench.fail(error);
      this.bench.say(note("warn", "This kind of damper has no file format yet: a link brings back the data, not the model."), 6000);
    }
  }
}

/** Times from the move of a slider to the frame that shows it: the benchmark reads them. */
function measure(moved) {
  requestAnimationFrame(() => setTimeout(() => performance.measure("slider-to-picture", { start: moved, end: performance.now() })));
}

function span([low, high], factor) {
  return `${figures(factor * low, 3)}–${figures(factor * high, 3)}`;
}

function nothing(bench) {
  const go = (view) => () => bench.store.pass({ view });
  return h(
    "div", { class: "empty" },
    h("h2", {}, "No model to move yet"),
    h("p", {}, "Identify one from the data, or drop a model.json on the Data page. Then drag current, frequency, amplitude and every parameter, and watch the loops follow."),
    h("div", { class: "row" },
      h("button", { class: "primary", onclick: go("identify") }, "Identify a model"),
      h("button", { onclick: go("data") }, "Open data")),
  );
}
