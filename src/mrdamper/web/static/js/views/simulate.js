// Ride: a damper of the bench at work. Road or quake, law, loop and ride move together.

import { Latest } from "../api.js";
import { Chart } from "../chart.js";
import { busy, empty, h, note, problem, put } from "../dom.js";
import { figures, percent, quantity } from "../format.js";
import { scene } from "../simulation_scene.js";

export const id = "ride";
export const label = "Ride";

const MM = 1000;

export function create(bench) {
  return new RideView(bench);
}

class RideView {
  constructor(bench) {
    this.bench = bench;
    this.choices = null;
    this.done = null; // head, arrays and scene of the ride shown
    [this.at, this.playing, this.ticket] = [0, false, 0];
    const list = (name, words) => {
      const select = h("select", { id: `ride-${name}`, onchange: () => this.changed(name) });
      return [select, h("div", { class: "field" }, h("label", { for: `ride-${name}` }, words), select)];
    };
    [this.damper, this.damperField] = list("damper", "Damper");
    [this.system, this.systemField] = list("system", "In");
    [this.source, this.sourceField] = list("source", "On");
    [this.control, this.controlField] = list("control", "Control law");
    this.current = h("input", { type: "number", id: "ride-current", min: "0", step: "any", onchange: () => this.ask() });
    const currentField = h("div", { class: "field" }, h("label", { for: "ride-current" }, "Current, or upper limit of the control law (A)"), this.current);
    this.scaled = h("input", { type: "checkbox", checked: true, onchange: () => this.ask() });
    this.scaledField = h("label", { class: "check" }, this.scaled, "Scale masses and springs of the vehicle to the force of the damper");
    this.play = h("button", { class: "primary", onclick: () => this.toggle() }, "Play");
    this.slider = h("input", { type: "range", min: "0", value: "0", "aria-label": "Moment of the ride", oninput: () => this.show(Number(this.slider.value)) });
    this.pace = h("select", { id: "ride-pace", "aria-label": "Speed" }, [["1", "real time"], ["0.25", "a quarter"], ["0.1", "a tenth"]].map(([value, text]) => h("option", { value }, text)));
    this.clock = h("span", { class: "faint" });
    this.charts = {
      a: new Chart({ title: "Acceleration", x: ["Time", "s"], y: ["Acceleration", "m/s^2"], name: "ride-acceleration", keys: true }),
      loop: new Chart({ title: "The damper's loop", x: ["Stroke", "m"], y: ["Force", "N"], name: "ride-loop" }),
      current: new Chart({ title: "Current", x: ["Time", "s"], y: ["Current", "A"], name: "ride-current" }),
    };
    this.stage = h("div", { class: "stage" });
    this.verdict = h("div", { role: "status" });
    this.picture = h("section", { class: "card ride-card", "aria-label": "Ride" });
    this.bar = h("div", { class: "row ride-bar" }, this.play, this.slider, this.pace, this.clock);
    this.grid = h("div", { class: "ride-grid" }, this.picture, this.charts.loop.element, this.charts.a.element, this.charts.current.element);
    const side = h("div", { class: "side" }, h("div", { class: "group" }, h("h2", {}, "Simulation"),
      this.damperField, this.systemField, this.sourceField, this.controlField, currentField, this.scaledField));
    this.element = h("div", { class: "view" }, side, this.stage);
    this.latest = new Latest((ask) => bench.api.frame("/ride", ask), (found, ask) => this.draw(found, ask), (error) => put(this.stage, problem(error)));
    document.addEventListener("bench:dampers", () => this.shown());
    document.addEventListener("bench:units", () => this.done && put(this.verdict, this.judged(this.done.head, this.done.arrays)));
  }

  shown() {
    if (this.bench.state.view === id) this.refresh().catch((error) => this.bench.fail(error));
  }

  update(state, before) {
    if (state.view !== before.view && before.view === id) this.stop();
  }

  async refresh() {
    const { dampers, state } = this.bench;
    if (!dampers.length) {
      this.done = null;
      return put(this.stage, empty("No model yet", "Identify a model, or open the bundled tests on the Data page.", h("button", { class: "primary", onclick: () => this.bench.store.pass({ view: "identify" }) }, "Identify")));
    }
    if (!this.choices) {
      this.choices = await this.bench.api.get("/ride/choices");
      fill(this.system, this.choices.systems);
      fill(this.control, this.choices.controls);
      this.system.value = "quarter-car";
      this.control.value = "skyhook";
      this.sources();
    }
    const known = this.damper.value;
    put(this.damper, this.bench.damperOptions());
    this.damper.value = dampers.some((d) => d.key === known) ? known : state.damper ?? this.bench.preferred();
    if (known === this.damper.value && this.done) return undefined;
    return this.changed("damper");
  }

  /** The scale of the vehicle applies to roads: a building is simulated as it is defined. */
  sources() {
    const { kind } = this.choices.systems.find((s) => s.name === this.system.value);
    fill(this.source, this.choices.sources[kind]);
    this.scaledField.hidden = kind !== "road";
    if (kind === "road") this.source.value = "iso8608-b";
  }

  async changed(what) {
    if (what === "system") this.sources();
    if (what === "damper") {
      const found = await this.bench.api.get(`/dampers/${this.damper.value}`);
      this.current.value = Number(found.envelope.current_A[1].toPrecision(4));
    }
    this.ask();
  }

  ask() {
    const current = Number(this.current.value);
    if (!(current >= 0)) return;
    this.stop();
    put(this.stage, busy("Calculating …", "The first ride of a damper takes some seconds: its equations are compiled."));
    this.latest.want({ damper: this.damper.value, system: this.system.value, source: this.source.value, control: this.control.value, current_A: current, scaled: this.scaled.checked });
  }

  async draw({ head, arrays }, ask) {
    head.most = ask.current_A;
    this.done = { head, arrays, scene: scene(head, arrays) };
    put(this.picture, this.done.scene.element);
    this.slider.max = arrays.time.length - 1;
    put(this.verdict, this.judged(head, arrays));
    put(this.stage, this.verdict, this.bar, this.grid);
    for (const chart of Object.values(this.charts)) {
      chart.held = false;
      chart.reset();
    }
    this.at = 0;
    await this.curves();
    for (const chart of Object.values(this.charts)) chart.held = true; // from now on only the marks move
    this.show(0);
    if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches) this.toggle(true);
  }

  /** Peak values are those of the curves drawn beside them. */
  judged(head, arrays) {
    const peak = (values) => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    const [a, f] = [peak(arrays[`a.${head.calm}`]), peak(arrays[`force.${head.dampers[0]}`])];
    const scale = head.scale === 1 ? "" : ` Masses and springs of the vehicle are multiplied by ${figures(head.scale, 2)}, so that the damper force at the highest tested current, ${quantity(head.capacity_N, "N", 2)}, is 8 % of the weight of the body.`;
    const better = head.gain === null ? "" : ` RMS of the objective ${head.gain > 0 ? "−" : "+"}${percent(Math.abs(head.gain))} against passive at 0 A.`;
    const outside = Object.entries(head.outside).flatMap(([name, shares]) => Object.entries(shares).map(([what, share]) => `${name}: ${what} ${percent(share)} of the time`));
    return note(outside.length || !head.settled ? "warn" : "", h("b", {}, `${head.title}.`, better),
      h("div", {}, `Peak acceleration of the ${head.calm} ${quantity(a, "m/s^2", 3)}, peak damper force ${quantity(f, "N", 3)}; time step ${figures(MM * head.step_s, 2)} ms, peak values change by ${percent(head.halving)} when it is halved.${scale}`),
      head.settled ? null : h("div", {}, "The peak values have not converged with the step size; the motion is sensitive to small changes."),
      outside.length ? h("div", {}, `Outside the tested range, bump-stop contact or wheel lift-off: ${outside.join("; ")}.`) : null);
  }

  /** All curves, and the mark of the moment on each. */
  curves() {
    const { head, arrays } = this.done;
    const k = this.at;
    const [name] = head.dampers;
    const stroke = arrays[`stroke.${name}`];
    const mark = (x, y) => ({ x: [x[k]], y: [y[k]], mode: "markers", color: "accent", size: 9, quiet: true });
    const [a, force, current] = [arrays[`a.${head.calm}`], arrays[`force.${name}`], arrays[`current.${name}`]];
    return Promise.all([
      this.charts.a.draw([
        { x: arrays.time, y: arrays[`idle.${head.calm}`], name: "passive at 0 A", color: "faint", width: 1 },
        { x: arrays.time, y: a, name: head.calm, color: "predicted", width: 1.4 }, mark(arrays.time, a),
      ], `Of ${head.calm}.`),
      this.charts.loop.draw([{ x: stroke, y: force, color: "predicted", width: 1, name: name }, mark(stroke, force)], `Of ${name}.`),
      this.charts.current.draw([{ x: arrays.time, y: current, color: "predicted", width: 1.2, name: name }, mark(arrays.time, current)], `Of ${name}.`),
    ]);
  }

  show(k) {
    this.at = k;
    this.slider.value = k;
    this.clock.textContent = `${this.done.arrays.time[k].toFixed(2)} s`;
    this.done.scene.show(k);
    this.curves();
  }

  toggle(on = !this.playing) {
    this.stop();
    if (!on || !this.done) return;
    this.playing = true;
    this.play.textContent = "Pause";
    const { time } = this.done.arrays;
    if (this.at >= time.length - 1) this.at = 0;
    let [last, moment] = [performance.now(), time[this.at]];
    const beat = (now) => {
      if (!this.playing) return;
      moment += ((now - last) / 1000) * Number(this.pace.value);
      last = now;
      const k = Math.min(time.length - 1, Math.max(0, Math.round(moment / (time[1] - time[0]))));
      this.show(k);
      if (k === time.length - 1) return this.stop();
      this.ticket = requestAnimationFrame(beat);
    };
    this.ticket = requestAnimationFrame(beat);
  }

  stop() {
    cancelAnimationFrame(this.ticket);
    this.playing = false;
    this.play.textContent = "Play";
  }
}

function fill(select, rows) {
  put(select, rows.map(({ name, title }) => h("option", { value: name }, title)));
}
