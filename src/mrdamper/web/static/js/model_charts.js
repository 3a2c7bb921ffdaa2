// The five charts of the Model view: predicted loops, what was measured nearest, figures over current.

import { Chart } from "./chart.js";
import { h } from "./dom.js";
import { condition, figures, quantity } from "./format.js";

export class ModelCharts {
  constructor(bench) {
    this.bench = bench;
    this.turn = 0; // of the answers drawn
    this.x = new Chart({ title: "Force over displacement", x: ["Displacement", "mm"], y: ["Force", "N"], name: "model-force-displacement", keys: true });
    this.v = new Chart({ title: "Force over velocity", x: ["Velocity", "m/s"], y: ["Force", "N"], name: "model-force-velocity" });
    this.t = new Chart({ title: "Force over time", x: ["Time", "s"], y: ["Force", "N"], name: "model-force-time" });
    this.peak = new Chart({ title: "Peak force over current", x: ["Current", "A"], y: ["Half peak-to-peak", "N"], name: "model-peak-force", zero: true, keys: true });
    this.energy = new Chart({ title: "Energy per cycle over current", x: ["Current", "A"], y: ["Energy", "J"], name: "model-energy", zero: true });
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
    const { near, tested } = await this.measured(head, rig);
    if (turn !== this.turn) return false;
    const family = head.loops.filter((loop) => loop.name !== "now");
    const predicted = head.loops.slice().reverse().map((loop) => predictedLoop(loop, head, arrays)); // the loop asked for on top
    const under = family.length ? tested : near;
    const curves = (a, b) => [...band(head, arrays, a, b), ...under.map((n) => n.curve(a, b)), ...predicted.map((p) => p(a, b))];
    const [now] = head.loops;
    const said = `Predicted peak force ${quantity(now.peak_N, "N")}, energy ${quantity(now.energy_J, "J")} per cycle${near.length ? `; measured nearest: ${near.map((n) => n.name).join("; ")}` : ""}.`;
    await Promise.all([
      this.x.draw(curves("x", "F"), said),
      this.v.draw(curves("v", "F"), said),
      this.t.draw([...band(head, arrays, "t", "F"), ...near.map((n) => n.curve("t", "F")), predicted.at(-1)("t", "F")], said),
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

  /** Loops measured nearest, and those at this motion for a family: on the page already or fetched now. */
  async measured(head, rigName) {
    const rig = this.bench.overview?.rigs.findIndex((r) => r.name === rigName) ?? -1;
    if (rig < 0) return { near: [], tested: [] };
    const fetched = (rows) => Promise.all(rows.map((row) => this.bench.loop(row.key, "cycle", rig)));
    const rows = head.loops.length > 1 ? head.measured : [];
    const [nearest, all] = await Promise.all([fetched(head.nearest), fetched(rows)]);
    const near = head.nearest.map((row, i) => {
      const name = `${condition(row.condition)}${heldOut(row)}`;
      const look = i
        ? { color: "line-strong", width: 1, name, legend: false, dash: i === 2 ? "dot" : "solid" }
        : { color: "measured", width: 1.6, name: `measured ${name}` };
      return { name, curve: (a, b) => ({ ...look, x: nearest[i].arrays[a], y: nearest[i].arrays[b] }) };
    });
    const tested = rows.map((row, i) => {
      const look = { color: shade(row.condition.current_A, head), width: 1.4, dash: "dot", name: "dotted: measured at this motion", legend: i === 0 };
      return { curve: (a, b) => ({ ...look, x: all[i].arrays[a], y: all[i].arrays[b] }) };
    });
    return { near, tested };
  }
}

const heldOut = (row) => (row.split === "validate" ? " (validation)" : "");
const shade = (current, head) => `shade ${Math.min(1, current / (head.tested_A[1] || 1)).toFixed(3)}`;

/** Prediction interval of the force as two lines around the loop. */
function band(head, arrays, a, b) {
  const [{ level }] = head.loops;
  if (!level) return [];
  return ["low", "high"].map((end) => ({
    x: arrays[`${end}.${a}`], y: arrays[`${end}.${b}`], color: "predicted", width: 1, dash: "dot", opacity: 0.75, quiet: true,
    name: `${Math.round(100 * level)} % interval`, legend: end === "low",
  }));
}

function predictedLoop(loop, head, arrays) {
  const now = loop.name === "now";
  const [low, high] = head.tested_A; // a family lies at the currents of the data, of which this damper may know few
  const inside = loop.current_A >= 0.999 * low - 1e-9 && loop.current_A <= 1.001 * high + 1e-9;
  const untested = head.extrapolation.some((flag) => now || flag !== "current") || !(now || inside);
  const dash = untested ? "dash" : "solid";
  const look = now
    ? { color: "predicted", width: 2.6, name: "predicted", dash }
    : { color: shade(loop.current_A, head), width: 1.3, name: `${figures(loop.current_A, 3)} A`, dash };
  return (a, b) => ({ ...look, x: arrays[`${loop.name}.${a}`], y: arrays[`${loop.name}.${b}`] });
}

/** Points measured at this motion, and the curve predicted: dashed where the current or the motion was not tested. */
function overCurrent(head, currents, values, key, current_A) {
  const [low, high] = head.tested_A;
  const motion = head.extrapolation.some((flag) => flag !== "current");
  const inside = [...currents.keys()].filter((i) => currents[i] >= low - 1e-9 && currents[i] <= high + 1e-9);
  const [first, last] = inside.length ? [inside[0], inside.at(-1)] : [currents.length, currents.length];
  const piece = (from, to, look) => ({ x: currents.slice(from, to), y: values.slice(from, to), color: "predicted", width: 2, ...look });
  const beyond = { dash: "dash", name: "predicted, not tested", legend: motion || low > 0.02 * high };
  return [
    {
      x: head.measured.map((m) => m.condition.current_A), y: head.measured.map((m) => m[key]), mode: "markers",
      color: "measured", fill: "panel", name: "measured", text: head.measured.map((m) => m.id),
    },
    piece(0, first + 1, beyond),
    piece(first, last + 1, motion ? beyond : { name: "predicted" }),
    piece(last, currents.length, { ...beyond, legend: true }),
    { x: [current_A], y: [head.loops[0][key]], mode: "markers", color: "predicted", size: 10, name: "now", legend: false },
  ];
}
