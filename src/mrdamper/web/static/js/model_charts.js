// The five charts of the Model view: predicted loops, what was measured nearest, figures over current.

import { Chart } from "./chart.js";
import { h } from "./dom.js";
import { condition, figures } from "./format.js";

export class ModelCharts {
  constructor(bench) {
    this.bench = bench;
    this.turn = 0; // of the answers drawn
    this.x = new Chart({ title: "Force over displacement", x: "Displacement (mm)", y: "Force (N)", name: "model-force-displacement", keys: true });
    this.v = new Chart({ title: "Force over velocity", x: "Velocity (m/s)", y: "Force (N)", name: "model-force-velocity" });
    this.t = new Chart({ title: "Force over time", x: "Time (s)", y: "Force (N)", name: "model-force-time" });
    this.peak = new Chart({ title: "Peak force over current", x: "Current (A)", y: "Half peak-to-peak (N)", name: "model-peak-force", zero: true, keys: true });
    this.energy = new Chart({ title: "Energy a cycle over current", x: "Current (A)", y: "Energy (J)", name: "model-energy", zero: true });
    this.all = [this.x, this.v, this.t, this.peak, this.energy];
    this.element = h("div", { class: "figures model" }, this.all.map((chart) => chart.element));
  }

  get held() {
    return this.x.held;
  }

  /** Keep the axes while a slider is dragged. */
  set held(on) {
    for (const chart of this.all) chart.held = on;
  }

  reset() {
    for (const chart of this.all) chart.reset();
  }

  /**
   * Draw an answer of the bench: its head and arrays, the curve over current, the current asked for,
   * and the damper's rig. False where a newer answer came meanwhile.
   */
  async draw(head, arrays, curve, current_A, rig) {
    const turn = (this.turn += 1);
    const near = await this.measured(head, rig);
    if (turn !== this.turn) return false;
    const family = head.loops.filter((loop) => loop.name !== "now");
    const ends = [family[0], family.at(-1)]; // the scale of the others follows from these
    const predicted = head.loops.slice().reverse().map((loop) => predictedLoop(loop, head, arrays, ends.includes(loop))); // the loop asked for on top
    const curves = (a, b) => [...near.map((n) => n.curve(a, b)), ...predicted.map((p) => p(a, b))];
    const [now] = head.loops;
    const said = `Predicted peak force ${figures(now.peak_N)} newtons, energy ${figures(now.energy_J)} joules a cycle${near.length ? `; measured nearest: ${near.map((n) => n.name).join("; ")}` : ""}.`;
    await Promise.all([
      this.x.draw(curves("x", "F"), said),
      this.v.draw(curves("v", "F"), said),
      this.t.draw([...near.map((n) => n.curve("t", "F")), predicted.at(-1)("t", "F")], said),
      this.drawCurve(head, curve, current_A, said),
    ]);
    return turn === this.turn;
  }

  /** Draw the figures over current; `curve` holds as many points as there are. */
  drawCurve(head, { current, peak, energy }, current_A, said = "") {
    return Promise.all([
      this.peak.draw(overCurrent(head, current, peak, "peak_N", current_A), said),
      this.energy.draw(overCurrent(head, current, energy, "energy_J", current_A), said),
    ]);
  }

  /** Loops measured nearest, on the page already or fetched now. */
  async measured(head, rigName) {
    const rig = this.bench.overview?.rigs.findIndex((r) => r.name === rigName) ?? -1;
    if (rig < 0) return [];
    const found = await Promise.all(head.nearest.map((row) => this.bench.loop(row.key, "cycle", rig)));
    return head.nearest.map((row, i) => {
      const name = `${condition(row.condition)}${row.split === "validate" ? " (held out)" : ""}`;
      const look = i
        ? { color: "line-strong", width: 1, name, legend: false, dash: i === 2 ? "dot" : "solid" }
        : { color: "measured", width: 1.6, name: `measured ${name}` };
      return { name, curve: (a, b) => ({ ...look, x: found[i].arrays[a], y: found[i].arrays[b] }) };
    });
  }
}

function predictedLoop(loop, head, arrays, named) {
  const share = head.tested_to_A ? loop.current_A / head.tested_to_A : 0;
  const look = loop.name === "now"
    ? { color: "predicted", width: 2.6, name: "predicted", dash: head.extrapolation.length ? "dash" : "solid" }
    : { color: `shade ${share.toFixed(3)}`, width: 1.3, name: `${figures(loop.current_A, 3)} A`, legend: named };
  return (a, b) => ({ ...look, x: arrays[`${loop.name}.${a}`], y: arrays[`${loop.name}.${b}`] });
}

/** Points measured at this motion, and the curve predicted: dashed beyond the currents tested. */
function overCurrent(head, currents, values, key, current_A) {
  const beyond = currents.findIndex((current) => current > 1.001 * head.tested_to_A);
  const end = beyond < 0 ? currents.length : beyond;
  const from = Math.max(0, end - 1);
  return [
    {
      x: head.measured.map((m) => m.condition.current_A), y: head.measured.map((m) => m[key]), mode: "markers",
      color: "measured", fill: "panel", name: "measured", text: head.measured.map((m) => m.id),
    },
    { x: currents.slice(0, end), y: values.slice(0, end), color: "predicted", width: 2, name: "predicted" },
    { x: currents.slice(from), y: values.slice(from), color: "predicted", width: 2, dash: "dash", name: "predicted, beyond the tests", legend: false },
    { x: [current_A], y: [head.loops[0][key]], mode: "markers", color: "predicted", size: 10, name: "now", legend: false },
  ];
}
