// Model: a damper under the sliders. The loops follow while a slider is dragged.

import { Latest } from "../api.js";
import { capital, empty, h, note, put } from "../dom.js";
import { condition, figures, quantity } from "../format.js";
import { ModelCharts } from "../model_charts.js";
import { ModelPanel } from "../model_panel.js";
import { onScreen } from "../units.js";

export const id = "model";
export const label = "Model";

const SETTLE = 300; // milliseconds after a drag until the axes fit again
const LATE = 250; // milliseconds after which a picture that is not answered yet is dimmed
const SLOW = 60; // milliseconds a loop, from which on the curves over current come point by point, and no band
const QUICK = 6; // milliseconds a loop, up to which the band comes while a slider is dragged: it takes six loops or so
const [COARSE, FINE] = [11, 15]; // points of the curves over current, while dragged and at rest; one lies where tests end
const NO_CURVE = { current: [], peak: [], energy: [] };

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
    this.spoken = ""; // what a screen reader was told last
    this.damper = null; // as the bench describes it
    this.moved = null; // when the slider was moved that the next question is about
    this.pace = Infinity; // milliseconds of work a loop of this damper takes; not known at first
    this.latest = new Latest(
      (question) => this.timed(question),
      (found, question) => this.draw(found, question),
      (error) => {
        bench.fail(error);
        this.rest();
      },
    );
    document.addEventListener("bench:units", () => {
      this.damper = null;
      this.shown();
    });
    document.addEventListener("bench:dampers", () => {
      if (bench.dampers.some((d) => d.key === this.damper?.key)) return this.panel.list(); // what is moved stays
      this.damper = null;
      this.shown();
    });
  }

  shown() {
    if (this.bench.state.view !== id) return;
    this.busy(true);
    this.refresh().catch((error) => {
      this.bench.fail(error);
      this.busy(false);
    });
  }

  /** Whether the picture is still to follow what the panel says. */
  busy(on) {
    this.stage.setAttribute("aria-busy", String(on));
  }

  /** The picture is that of the panel, unless something is asked or moved still. */
  rest() {
    if (!this.latest.busy && !this.charts.held) this.busy(false);
  }

  update(state, before) {
    if (["damper", "condition", "held", "family"].some((name) => state[name] !== before[name])) this.shown();
  }

  /** Bring the panel to the damper chosen, and ask for its loops. */
  async refresh() {
    const { state, dampers, store } = this.bench;
    const key = dampers.some((d) => d.key === state.damper) ? state.damper : this.bench.preferred();
    if (key === null) {
      this.damper = null;
      this.panel.empty();
      put(this.stage, nothing(this.bench));
      this.busy(false);
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
    this.pace = Infinity;
    this.panel.build(found);
    this.charts.reset();
    put(this.stage, this.verdict, this.charts.element);
    return true;
  }

  ask() {
    const { damper, condition, held, family } = this.bench.state;
    if (this.damper?.key !== damper) return;
    const currents = this.pace > SLOW ? 0 : this.charts.held ? COARSE : FINE;
    const band = this.pace <= (this.charts.held ? QUICK : SLOW);
    this.latest.want({ key: damper, moved: this.moved, ask: { ...(condition ?? this.damper.start), held, family, currents, band } });
    this.moved = null;
  }

  /** Ask, and dim the picture of before where the answer takes its time. */
  async timed({ key, ask }) {
    const waiting = setTimeout(() => this.late(true), LATE);
    try {
      const found = await this.bench.api.frame(`/dampers/${key}/predict`, ask);
      if (key === this.damper?.key) this.pace = found.head.pace_ms;
      return found;
    } finally {
      clearTimeout(waiting);
      this.late(false);
    }
  }

  late(on) {
    this.stage.classList.toggle("late", on);
    if (on) put(this.verdict, note("", h("b", {}, "Calculating …"), h("div", {}, "The picture is that of before.")));
  }

  async draw({ head, arrays }, { key, ask, moved }) {
    if (key !== this.damper?.key) return;
    this.panel.set(head.parameters);
    this.judge(head, ask);
    const curve = ask.currents ? { current: arrays["over.current"], peak: arrays["over.peak"], energy: arrays["over.energy"] } : NO_CURVE;
    const newest = await this.charts.draw(head, arrays, curve, ask.current_A, this.damper.rig);
    if (!newest) return;
    if (moved !== null) measure(moved);
    if (!ask.currents && !this.charts.held) await this.complete(head, key, ask);
    this.rest();
  }

  /** The curves over current after the loop: at once, or point by point until something newer is asked. */
  async complete(head, key, ask) {
    const current = () => key === this.damper?.key && !this.latest.busy && this.bench.state.view === id;
    if (!current()) return;
    if (this.pace <= SLOW) {
      this.ask();
      return;
    }
    const curve = { current: [], peak: [], energy: [] };
    const [low, high] = this.damper.reach.current_A;
    for (let i = 0; i < COARSE; i += 1) {
      const at = low + (i / (COARSE - 1)) * (high - low);
      const found = await this.bench.api.frame(`/dampers/${key}/predict`, { ...ask, current_A: at, family: false, band: false });
      if (!current()) return;
      this.pace = Math.min(this.pace, found.head.pace_ms);
      if (this.pace <= SLOW) return this.ask(); // the first loop of a damper takes longer
      const [loop] = found.head.loops;
      curve.current.push(at);
      curve.peak.push(loop.peak_N);
      curve.energy.push(loop.energy_J);
      await this.charts.drawCurve(head, curve, ask.current_A);
    }
  }

  dragging(change, when) {
    clearTimeout(this.settling);
    this.moved = when;
    this.charts.held = true;
    this.bench.store.pass(change);
  }

  settled(change) {
    this.bench.store.commit(change);
    if (!this.charts.held) return; // a number that was typed
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
      current: ["current", `${figures(ask.current_A, 3)} A, tested ${span(e.current_A, "A")}`],
      frequency: ["frequency", `${figures(ask.frequency_Hz, 3)} Hz, tested ${span(e.frequency_Hz, "Hz")}`],
      amplitude: ["amplitude", `${quantity(ask.amplitude_m, "m", 3)}, tested ${span(e.amplitude_m, "m")}`],
      velocity: ["peak velocity", `${quantity(head.peak_velocity_m_s, "m/s", 3)}, tested ${span(e.peak_velocity_m_s, "m/s")}`],
    };
    const flags = head.extrapolation.map((flag) => tested[flag] ?? [flag, ""]);
    const [now] = head.loops;
    const said = flags.length ? `Extrapolation in ${flags.map(([name]) => name).join(", ")}` : "Inside the tested conditions";
    if (this.spoken !== said) this.bench.speak(said); // when it changes, not at every move
    this.spoken = said;
    const between = now.level ? ` (${Math.round(100 * now.level)} % prediction interval ${now.scope}: ${quantity(now.peak_from_N, "N", 3)} to ${quantity(now.peak_to_N, "N", 3)})` : "";
    const none = now.level ? "" : ` ${capital(now.no_band ?? (this.pace > SLOW ? "no prediction interval: this model is too slow for one" : "the prediction interval is calculated when the slider rests"))}.`;
    const amounts = `Predicted: peak force ${quantity(now.peak_N, "N")}${between}, energy ${quantity(now.energy_J, "J")} per cycle.${none} ${nearest(head.nearest[0])}`;
    put(this.verdict, flags.length
      ? note("warn", h("div", {}, h("b", {}, "Extrapolation: "), `${flags.map((f) => f.join(" ")).join("; ")}. The loop is dashed.`), h("div", {}, amounts))
      : note("", h("div", {}, h("b", {}, "Inside the tested conditions.")), h("div", {}, amounts)));
  }
}

/** Times from the move of a slider to the frame that shows it: the benchmark reads them. */
function measure(moved) {
  requestAnimationFrame(() => setTimeout(() => performance.measure("slider-to-picture", { start: moved, end: performance.now() })));
}

function span([low, high], itsUnit) {
  const { factor, unit } = onScreen(itsUnit);
  const [from, to] = [figures(factor * low, 3), figures(factor * high, 3)];
  return `${from === to ? `at ${from}` : `${from}–${to}`} ${unit}`;
}

/** What was measured nearest, to hold the prediction against. */
function nearest(run) {
  if (!run) return "No run was measured near this condition.";
  return `Measured nearest, ${condition(run.condition)}: ${quantity(run.peak_N, "N")}, ${quantity(run.energy_J, "J")}.`;
}

function nothing(bench) {
  const go = (view) => () => bench.store.pass({ view });
  return empty("No model yet",
    "Identify a model from the data, or drop a model.json. Sliders of current, frequency, amplitude and every parameter then change its loops.",
    h("button", { class: "primary", onclick: go("identify") }, "Identify a model"),
    h("button", { onclick: go("data") }, "Open data"));
}
