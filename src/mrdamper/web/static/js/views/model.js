// The Model view: loops of a damper at the condition and parameters of sliders, drawn while a slider is dragged.

import { Latest } from "../api.js";
import { View } from "../app.js";
import { capitalise, h, note, placeholder, render } from "../dom.js";
import { condition, figures, quantity } from "../format.js";
import { ModelCharts } from "../model_charts.js";
import { ModelPanel } from "../model_panel.js";
import { onScreen } from "../units.js";

const SETTLE_MS = 300; // from the end of a drag until the axes fit again
const LATE_MS = 250; // without a response, after which the charts are dimmed
const SLOW_MS = 60; // for a loop: from here the curves over current are calculated point by point, without interval
const QUICK_MS = 6; // for a loop: up to here the interval, about six loops, is calculated while a slider is dragged
const [COARSE, FINE] = [11, 15]; // points of the curves over current, while dragged and at rest

export class ModelView extends View {
  static id = "model";
  static label = "Model";

  constructor(app) {
    super(app);
    this.charts = new ModelCharts(app);
    this.panel = new ModelPanel(app, {
      drag: (change, time) => this.drag(change, time),
      settle: (change) => this.settle(change),
    });
    this.stage = h("div", { class: "stage fill" });
    this.element = h("div", { class: "view" }, this.panel.element, this.stage);
    this.verdict = h("div", {});
    this.announced = ""; // to screen readers
    this.damper = null; // as the server describes it
    this.movedAt = null; // time when the slider of the next request was moved
    this.loopMs = Infinity; // calculation of a loop of this damper; unknown at first
    this.latest = new Latest((query) => this.fetch(query), (frame, query) => this.draw(frame, query), (error) => {
      app.fail(error);
      this.updateBusy();
    });
    app.on("units", () => {
      this.damper = null;
      this.shown();
    });
    app.on("dampers", () => {
      if (app.dampers.some((d) => d.key === this.damper?.key)) return this.panel.list(); // its sliders stay
      this.damper = null;
      return this.shown();
    });
  }

  shown() {
    if (!this.visible) return;
    this.setBusy(true);
    this.app.run(this.refresh().catch((error) => {
      this.setBusy(false);
      throw error;
    }));
  }

  /** Mark the charts as not yet those of the panel. */
  setBusy(busy) {
    this.stage.setAttribute("aria-busy", String(busy));
  }

  /** Mark the charts as current, unless a request or a drag is under way. */
  updateBusy() {
    if (!this.latest.busy && !this.charts.axesHeld) this.setBusy(false);
  }

  update(state, before) {
    if (["damper", "condition", "held", "family"].some((name) => state[name] !== before[name])) this.shown();
  }

  /** Show the selected damper, and request its loops. */
  async refresh() {
    const { state, dampers, store } = this.app;
    const key = dampers.some((d) => d.key === state.damper) ? state.damper : this.app.defaultDamper();
    if (key === null) {
      this.damper = null;
      render(this.panel.element, h("p", { class: "faint" }, "No model yet."));
      this.setBusy(false);
      return render(this.stage, placeholder("No model yet",
        "Identify a model from the data, or drop a model.json. Sliders of current, frequency, amplitude and every parameter then change its loops.",
        this.app.viewButton("identify", "Identify a model"), this.app.viewButton("data", "Open data", "")));
    }
    if (key !== state.damper) return store.amend({ damper: key });
    if (key !== this.damper?.key && !(await this.load(key))) return undefined;
    this.panel.set();
    return this.request();
  }

  /** Load a damper; false where another was selected meanwhile. */
  async load(key) {
    const damper = await this.app.api.get(`/dampers/${key}`);
    if (key !== this.app.state.damper) return false;
    this.damper = damper;
    this.loopMs = Infinity;
    this.panel.build(damper);
    this.charts.reset();
    render(this.stage, this.verdict, this.charts.element);
    return true;
  }

  request() {
    const { damper, held, family } = this.app.state;
    if (this.damper?.key !== damper) return;
    const { axesHeld } = this.charts;
    const currents = this.loopMs > SLOW_MS ? 0 : axesHeld ? COARSE : FINE;
    const interval = this.loopMs <= (axesHeld ? QUICK_MS : SLOW_MS);
    this.latest.request({ key: damper, movedAt: this.movedAt, body: { ...this.panel.condition, held, family, currents, interval } });
    this.movedAt = null;
  }

  predict(key, body) {
    return this.app.api.frame(`/dampers/${key}/predict`, body);
  }

  /** Send a request, and dim the charts while its response is late. */
  async fetch({ key, body }) {
    const timer = setTimeout(() => this.setLate(true), LATE_MS);
    try {
      const frame = await this.predict(key, body);
      if (key === this.damper?.key) this.loopMs = frame.head.loop_ms;
      return frame;
    } finally {
      clearTimeout(timer);
      this.setLate(false);
    }
  }

  setLate(late) {
    this.stage.classList.toggle("late", late);
    if (late) render(this.verdict, note("", h("b", {}, "Calculating …"), h("div", {}, "The charts show the values before.")));
  }

  async draw({ head, arrays }, { key, body, movedAt }) {
    if (key !== this.damper?.key) return;
    this.panel.set(head.parameters);
    this.showVerdict(head, body);
    const [current, peak, energy] = ["current", "peak", "energy"].map((name) => arrays[`over.${name}`] ?? []);
    const newest = await this.charts.draw(head, arrays, { current, peak, energy }, body.current_A, this.damper.rig);
    if (!newest) return;
    if (movedAt !== null) measure(movedAt);
    if (!body.currents && !this.charts.axesHeld) await this.addCurves(head, key, body);
    this.updateBusy();
  }

  /** Add the curves over current after the loop: all at once, or point by point until there is a newer request. */
  async addCurves(head, key, body) {
    const current = () => key === this.damper?.key && !this.latest.busy && this.visible;
    if (!current()) return;
    const curve = { current: [], peak: [], energy: [] };
    const [low, high] = this.damper.reach.current_A;
    for (let i = 0; i < COARSE && this.loopMs > SLOW_MS; i += 1) {
      const current_A = low + (i / (COARSE - 1)) * (high - low);
      const frame = await this.predict(key, { ...body, current_A, family: false, interval: false });
      if (!current()) return;
      this.loopMs = Math.min(this.loopMs, frame.head.loop_ms);
      const [loop] = frame.head.loops;
      curve.current.push(current_A);
      curve.peak.push(loop.peak_N);
      curve.energy.push(loop.energy_J);
      await this.charts.drawCurve(head, curve, body.current_A);
    }
    if (this.loopMs <= SLOW_MS) this.request(); // the first loop of a damper takes longer
  }

  drag(change, time) {
    clearTimeout(this.settling);
    this.movedAt = time;
    this.charts.holdAxes(true);
    this.app.store.update(change);
  }

  settle(change) {
    this.app.store.commit(change);
    if (!this.charts.axesHeld) return; // a number that was typed
    clearTimeout(this.settling); // keys move a slider step by step: the axes wait for the last
    this.settling = setTimeout(() => {
      this.charts.holdAxes(false);
      this.request(); // finely, with axes that fit
    }, SETTLE_MS);
  }

  /** Show whether the condition was tested, peak force and energy of the loop, and the nearest measured run. */
  showVerdict(head, body) {
    const e = this.damper.envelope;
    const range = (name, value, [low, high], unit) => {
      const [from, to] = [low, high].map((end) => figures(onScreen(unit).factor * end, 3));
      return [name, `${quantity(value, unit, 3)}, tested ${from === to ? `at ${from}` : `${from}–${to}`} ${onScreen(unit).unit}`];
    };
    const tested = {
      current: range("current", body.current_A, e.current_A, "A"),
      frequency: range("frequency", body.frequency_Hz, e.frequency_Hz, "Hz"),
      amplitude: range("amplitude", body.amplitude_m, e.amplitude_m, "m"),
      velocity: range("peak velocity", head.peak_velocity_m_s, e.peak_velocity_m_s, "m/s"),
    };
    const flags = head.extrapolation.map((flag) => tested[flag] ?? [flag, ""]);
    const text = flags.length ? `Extrapolation in ${flags.map(([name]) => name).join(", ")}` : "Inside the tested conditions";
    if (this.announced !== text) this.app.announce(text); // when it changes, not at every move
    this.announced = text;
    const [now] = head.loops;
    const interval = now.level ? ` (${Math.round(100 * now.level)} % prediction interval ${now.scope}: ${quantity(now.peak_from_N, "N", 3)} to ${quantity(now.peak_to_N, "N", 3)})` : "";
    const none = now.level ? "" : ` ${capitalise(now.no_interval ?? (this.loopMs > SLOW_MS ? "no prediction interval: this model is too slow for one" : "the prediction interval is calculated when the slider rests"))}.`;
    const [run] = head.nearest;
    const measured = run ? `Measured nearest, ${condition(run.condition)}: ${quantity(run.peak_N, "N")}, ${quantity(run.energy_J, "J")}.` : "No run was measured near this condition.";
    const values = h("div", {}, `Predicted: peak force ${quantity(now.peak_N, "N")}${interval}, energy ${quantity(now.energy_J, "J")} per cycle.${none} ${measured}`);
    render(this.verdict, flags.length
      ? note("warn", h("div", {}, h("b", {}, "Extrapolation: "), `${flags.map((f) => f.join(" ")).join("; ")}. The loop is dashed.`), values)
      : note("", h("div", {}, h("b", {}, "Inside the tested conditions.")), values));
  }
}

/** Measure the time from the move of a slider to the frame that shows it, for the benchmark. */
function measure(movedAt) {
  requestAnimationFrame(() => setTimeout(() => performance.measure("slider-to-picture", { start: movedAt, end: performance.now() })));
}
