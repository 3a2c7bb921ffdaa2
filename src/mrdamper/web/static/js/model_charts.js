// The five charts of the Model view: predicted loops, the nearest measured loops, peak force and energy over current.

import { Chart, loopCharts } from "./chart.js";
import { h } from "./dom.js";
import { condition, figures, quantity } from "./format.js";

export class ModelCharts {
  constructor(app) {
    this.app = app;
    this.turn = 0; // of several responses being drawn, the newest counts
    Object.assign(this, loopCharts("model", "x"));
    this.t = new Chart({ title: "Force over time", x: ["Time", "s"], y: ["Force", "N"], name: "model-force-time" });
    this.peak = new Chart({ title: "Peak force over current", x: ["Current", "A"], y: ["Peak force", "N"], name: "model-peak-force", zero: true, keys: true });
    this.energy = new Chart({ title: "Energy per cycle over current", x: ["Current", "A"], y: ["Energy", "J"], name: "model-energy", zero: true });
    this.axesHeld = false; // while a slider is dragged
    this.all = [this.x, this.v, this.t, this.peak, this.energy];
    this.element = h("div", { class: "figures model" }, this.all.map((chart) => chart.element));
  }

  holdAxes(held) {
    this.axesHeld = held;
    for (const chart of this.all) chart.axesHeld = held;
  }

  reset() {
    for (const chart of this.all) chart.reset();
  }

  /**
   * Draw a response: its head and arrays, the curve over current, the current of the condition, and the measured
   * loops of the damper's rig. False where a newer response came meanwhile.
   */
  async draw(head, arrays, curve, current_A, rig) {
    const turn = (this.turn += 1);
    const { nearest, atMotion } = await this.measured(head, rig);
    if (turn !== this.turn) return false;
    const [now, ...family] = head.loops;
    const predicted = [...family.reverse(), now].map((loop) => predictedLoop(loop, head, arrays)); // the loop of the condition on top
    const measured = family.length ? atMotion : nearest;
    const curves = (a, b) => [...interval(head, arrays, a, b), ...measured.map((m) => m.curve(a, b)), ...predicted.map((p) => p(a, b))];
    const summary = `Predicted peak force ${quantity(now.peak_N, "N")}, energy ${quantity(now.energy_J, "J")} per cycle${nearest.length ? `; measured nearest: ${nearest.map((n) => n.name).join("; ")}` : ""}.`;
    await Promise.all([
      this.x.draw(curves("x", "F"), summary),
      this.v.draw(curves("v", "F"), summary),
      this.t.draw([...interval(head, arrays, "t", "F"), ...nearest.map((n) => n.curve("t", "F")), predicted.at(-1)("t", "F")], summary),
      this.drawCurve(head, curve, current_A, summary),
    ]);
    return turn === this.turn;
  }

  /** Draw peak force and energy over current; `curve` has the points calculated so far. */
  drawCurve(head, { current, peak, energy }, current_A, summary = "") {
    return Promise.all([
      this.peak.draw(overCurrent(head, current, peak, "peak_N", current_A), summary),
      this.energy.draw(overCurrent(head, current, energy, "energy_J", current_A), summary),
    ]);
  }

  /** The nearest measured loops, and for a family of loops those at this motion. */
  async measured(head, rigName) {
    const rig = this.app.rigNumber(rigName);
    if (rig < 0) return { nearest: [], atMotion: [] };
    const loops = (rows) => Promise.all(rows.map((row) => this.app.loop(row.key, "cycle", rig)));
    const curve = ({ arrays }, style) => (a, b) => ({ ...style, x: arrays[a], y: arrays[b] });
    const rows = head.loops.length > 1 ? head.measured : [];
    const [nearLoops, motionLoops] = await Promise.all([loops(head.nearest), loops(rows)]);
    const nearest = head.nearest.map((row, i) => {
      const name = `${condition(row.condition)}${row.split === "validate" ? " (validation)" : ""}`;
      const style = i
        ? { color: "line-strong", width: 1, name, legend: false, dash: i === 2 ? "dot" : "solid" }
        : { color: "measured", width: 1.6, name: `measured ${name}` };
      return { name, curve: curve(nearLoops[i], style) };
    });
    const atMotion = rows.map((row, i) => {
      const style = { color: shade(row.condition.current_A, head), width: 1.4, dash: "dot", name: "dotted: measured at this motion", legend: i === 0 };
      return { curve: curve(motionLoops[i], style) };
    });
    return { nearest, atMotion };
  }
}

const shade = (current, head) => `shade ${Math.min(1, current / (head.tested_A[1] || 1)).toFixed(3)}`;

/** Prediction interval of the force as two lines around the loop. */
function interval(head, arrays, a, b) {
  const [{ level }] = head.loops;
  if (!level) return [];
  return ["low", "high"].map((end) => ({
    x: arrays[`${end}.${a}`], y: arrays[`${end}.${b}`], color: "predicted", width: 1, dash: "dot", opacity: 0.75, quiet: true,
    name: `${Math.round(100 * level)} % interval`, legend: end === "low",
  }));
}

function predictedLoop(loop, head, arrays) {
  const now = loop.name === "now";
  const [low, high] = head.tested_A; // a family has the currents of the data, which may exceed those of this damper
  const inside = loop.current_A >= 0.999 * low - 1e-9 && loop.current_A <= 1.001 * high + 1e-9;
  const untested = head.extrapolation.some((flag) => now || flag !== "current") || !(now || inside);
  const dash = untested ? "dash" : "solid";
  const style = now
    ? { color: "predicted", width: 2.6, name: "predicted", dash }
    : { color: shade(loop.current_A, head), width: 1.3, name: `${figures(loop.current_A, 3)} A`, dash };
  return (a, b) => ({ ...style, x: arrays[`${loop.name}.${a}`], y: arrays[`${loop.name}.${b}`] });
}

/** Points measured at this motion, and the predicted curve, dashed outside the tested range. */
function overCurrent(head, currents, values, key, current_A) {
  const [low, high] = head.tested_A;
  const motion = head.extrapolation.some((flag) => flag !== "current");
  const inside = [...currents.keys()].filter((i) => currents[i] >= low - 1e-9 && currents[i] <= high + 1e-9);
  const [first, last] = inside.length ? [inside[0], inside.at(-1)] : [currents.length, currents.length];
  const part = (from, to, style) => ({ x: currents.slice(from, to), y: values.slice(from, to), color: "predicted", width: 2, ...style });
  const untested = { dash: "dash", name: "predicted, not tested", legend: motion || low > 0.02 * high };
  return [
    {
      x: head.measured.map((m) => m.condition.current_A), y: head.measured.map((m) => m[key]), mode: "markers",
      color: "measured", fill: "panel", name: "measured", text: head.measured.map((m) => m.id),
    },
    part(0, first + 1, untested),
    part(first, last + 1, motion ? untested : { name: "predicted" }),
    part(last, currents.length, { ...untested, legend: true }),
    { x: [current_A], y: [head.loops[0][key]], mode: "markers", color: "predicted", size: 10, name: "now", legend: false },
  ];
}
