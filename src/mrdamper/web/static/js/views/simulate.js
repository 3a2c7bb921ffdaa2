// The Simulate view: a damper in a vehicle or building under a control law, animated with its loop.

import { Latest } from "../api.js";
import { View } from "../app.js";
import { Chart } from "../chart.js";
import { errorMessage, field, h, loading, note, options, placeholder, render } from "../dom.js";
import { figures, percent, quantity } from "../format.js";
import { scene } from "../simulation_scene.js";

const MM = 1000;
const SPEEDS = [["1", "real time"], ["0.25", "a quarter"], ["0.1", "a tenth"]];

export class SimulateView extends View {
  static id = "simulate";
  static label = "Simulate";

  constructor(app) {
    super(app);
    this.choices = null;
    this.result = null; // head, arrays and scene of the simulation shown
    [this.sample, this.playing, this.frame] = [0, false, 0];
    const list = (name) => h("select", { id: `simulate-${name}`, onchange: () => app.run(this.change(name)) });
    [this.damper, this.system, this.source, this.control] = ["damper", "system", "source", "control"].map(list);
    this.current = h("input", { type: "number", id: "simulate-current", min: "0", step: "any", onchange: () => this.request() });
    this.scaled = h("input", { type: "checkbox", checked: true, onchange: () => this.request() });
    this.scaledField = h("label", { class: "check" }, this.scaled, "Scale masses and springs of the vehicle to the force of the damper");
    this.play = h("button", { class: "primary", onclick: () => this.toggle() }, "Play");
    this.slider = h("input", { type: "range", min: "0", value: "0", "aria-label": "Time of the simulation", oninput: () => this.show(Number(this.slider.value)) });
    this.speed = h("select", { id: "simulate-speed", "aria-label": "Speed" }, options(SPEEDS));
    this.clock = h("span", { class: "faint" });
    this.charts = {
      loop: new Chart({ title: "Loop of the damper", x: ["Stroke", "m"], y: ["Force", "N"], name: "simulation-loop" }),
      a: new Chart({ title: "Acceleration", x: ["Time", "s"], y: ["Acceleration", "m/s^2"], name: "simulation-acceleration", keys: true }),
      current: new Chart({ title: "Current", x: ["Time", "s"], y: ["Current", "A"], name: "simulation-current" }),
    };
    this.stage = h("div", { class: "stage" });
    this.verdict = h("div", { role: "status" });
    this.picture = h("section", { class: "card scene-card", "aria-label": "Animation" });
    this.playback = h("div", { class: "row playback" }, this.play, this.slider, this.speed, this.clock);
    this.grid = h("div", { class: "simulation-grid" }, this.picture, Object.values(this.charts).map((chart) => chart.element));
    this.element = h("div", { class: "view" }, h("div", { class: "side" }, h("div", { class: "group" }, h("h2", {}, "Simulation"),
      field("Damper", this.damper), field("In", this.system), field("On", this.source), field("Control law", this.control),
      field("Current, or upper limit of the control law (A)", this.current), this.scaledField)), this.stage);
    this.latest = new Latest((query) => app.api.frame("/simulate", query), (frame, query) => this.draw(frame, query), (error) => render(this.stage, errorMessage(error)));
    app.on("dampers", () => this.shown());
    app.on("units", () => this.result && render(this.verdict, verdict(this.result)));
  }

  update(state, before) {
    if (state.view !== before.view && !this.visible) this.stop();
  }

  async refresh() {
    const { dampers, state, api } = this.app;
    if (!dampers.length) {
      this.result = null;
      render(this.stage, placeholder("No model yet", "Identify a model, or open the bundled tests on the Data page.", this.app.viewButton("identify", "Identify")));
      return;
    }
    if (!this.choices) {
      this.choices = await api.get("/simulate/choices");
      fill(this.system, this.choices.systems, "quarter-car");
      fill(this.control, this.choices.controls, "skyhook");
      this.listSources();
    }
    const before = this.damper.value;
    render(this.damper, this.app.damperOptions());
    this.damper.value = dampers.some((d) => d.key === before) ? before : state.damper ?? this.app.defaultDamper();
    if (before !== this.damper.value || !this.result) await this.change("damper");
  }

  /** List the inputs of the system; only a vehicle can be scaled. */
  listSources() {
    const { kind } = this.choices.systems.find((s) => s.name === this.system.value);
    fill(this.source, this.choices.sources[kind], kind === "road" ? "iso8608-b" : null);
    this.scaledField.hidden = kind !== "road";
  }

  async change(name) {
    if (name === "system") this.listSources();
    if (name === "damper") {
      const { envelope } = await this.app.api.get(`/dampers/${this.damper.value}`);
      this.current.value = Number(envelope.current_A[1].toPrecision(4));
    }
    this.request();
  }

  request() {
    const current_A = Number(this.current.value);
    if (!(current_A >= 0)) return;
    this.stop();
    render(this.stage, loading("Calculating …", "The first simulation of a damper takes some seconds: its equations are compiled."));
    const [damper, system, source, control] = [this.damper, this.system, this.source, this.control].map((list) => list.value);
    this.latest.request({ damper, system, source, control, current_A, scaled: this.scaled.checked });
  }

  async draw({ head, arrays }, { current_A: highest }) {
    this.result = { head, arrays, scene: scene(head, arrays, highest) };
    render(this.picture, this.result.scene.element);
    this.slider.max = arrays.time.length - 1;
    render(this.verdict, verdict(this.result));
    render(this.stage, this.verdict, this.playback, this.grid);
    const charts = Object.values(this.charts);
    for (const chart of charts) {
      chart.axesHeld = false;
      chart.reset();
    }
    this.sample = 0;
    await this.drawCurves();
    for (const chart of charts) chart.axesHeld = true; // from now on only the marks move
    this.show(0);
    if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) this.toggle(true);
  }

  /** Draw all curves, with a mark at the current sample of each. */
  drawCurves() {
    const { head: { coordinate, dampers: [name] }, arrays } = this.result;
    const { time, [`a.${coordinate}`]: a, [`stroke.${name}`]: stroke, [`force.${name}`]: force, [`current.${name}`]: current } = arrays;
    const marked = (x, y, style) => [
      { x, y, color: "predicted", ...style },
      { x: [x[this.sample]], y: [y[this.sample]], mode: "markers", color: "accent", size: 9, quiet: true },
    ];
    const passive = { x: time, y: arrays[`passive.${coordinate}`], name: "passive at 0 A", color: "faint", width: 1 };
    return Promise.all([
      this.charts.a.draw([passive, ...marked(time, a, { name: coordinate, width: 1.4 })], `Of ${coordinate}.`),
      this.charts.loop.draw(marked(stroke, force, { name, width: 1 }), `Of ${name}.`),
      this.charts.current.draw(marked(time, current, { name, width: 1.2 }), `Of ${name}.`),
    ]);
  }

  show(sample) {
    this.sample = sample;
    this.slider.value = sample;
    this.clock.textContent = `${this.result.arrays.time[sample].toFixed(2)} s`;
    this.result.scene.show(sample);
    this.drawCurves();
  }

  toggle(on = !this.playing) {
    this.stop();
    if (!on || !this.result) return;
    this.playing = true;
    this.play.textContent = "Pause";
    const { time } = this.result.arrays;
    const end = time.length - 1;
    if (this.sample >= end) this.sample = 0;
    let [last, moment] = [performance.now(), time[this.sample]];
    const step = (now) => {
      if (!this.playing) return;
      moment += ((now - last) / 1000) * Number(this.speed.value);
      last = now;
      this.show(Math.min(end, Math.max(0, Math.round(moment / (time[1] - time[0])))));
      if (this.sample === end) this.stop();
      else this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
  }

  stop() {
    cancelAnimationFrame(this.frame);
    this.playing = false;
    this.play.textContent = "Play";
  }
}

function fill(list, rows, selected) {
  render(list, options(rows.map(({ name, title }) => [name, title])));
  if (selected) list.value = selected;
}

/** The results of a simulation in words; peak values are those of the curves. */
function verdict({ head, arrays }) {
  const peak = (values) => values.reduce((largest, value) => Math.max(largest, Math.abs(value)), 0);
  const [a, force] = [peak(arrays[`a.${head.coordinate}`]), peak(arrays[`force.${head.dampers[0]}`])];
  const scale = head.scale === 1 ? "" : ` Masses and springs of the vehicle are multiplied by ${figures(head.scale, 2)}, so that the damper force at the highest tested current, ${quantity(head.capacity_N, "N", 2)}, is 8 % of the weight of the body.`;
  const gain = head.gain === null ? "" : ` RMS of the objective ${head.gain > 0 ? "−" : "+"}${percent(Math.abs(head.gain))} against passive at 0 A.`;
  const outside = Object.entries(head.outside).flatMap(([name, shares]) => Object.entries(shares).map(([flag, share]) => `${name}: ${flag} ${percent(share)} of the time`));
  return note(outside.length || !head.converged ? "warn" : "", h("b", {}, `${head.title}.`, gain),
    h("div", {}, `Peak acceleration of the ${head.coordinate} ${quantity(a, "m/s^2", 3)}, peak damper force ${quantity(force, "N", 3)}; time step ${figures(MM * head.step_s, 2)} ms, peak values change by ${percent(head.halving)} when it is halved.${scale}`),
    head.converged ? null : h("div", {}, "The peak values have not converged with the step size; the motion is sensitive to small changes."),
    outside.length ? h("div", {}, `Outside the tested range, bump-stop contact or wheel lift-off: ${outside.join("; ")}.`) : null);
}
