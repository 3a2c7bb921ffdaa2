// Identify: the whole study, or one model by one method; progress, cancel, results with residuals.

import { Chart } from "../chart.js";
import { busy, card, empty, h, note, put, table } from "../dom.js";
import { column, condition, count, figures, heading, percent, seconds, unit } from "../format.js";
import { IdentifyForm } from "../identify_form.js";
import { onScreen } from "../units.js";
import { workBox } from "../job_progress.js";

export const id = "identify";
export const label = "Identify";


export function create(bench) {
  return new IdentifyView(bench);
}

class IdentifyView {
  constructor(bench) {
    this.bench = bench;
    this.work = workBox(bench);
    this.form = new IdentifyForm(bench, (choice) => this.start(choice));
    this.stage = h("div", { class: "stage" });
    this.charts = {
      v: new Chart({ title: "Force over velocity", x: ["Velocity", "m/s"], y: ["Force", "N"], name: "identified-force-velocity", keys: true }),
      x: new Chart({ title: "Force over displacement", x: ["Displacement", "mm"], y: ["Force", "N"], name: "identified-force-displacement" }),
      r: new Chart({ title: "Residual over time", x: ["Time", "s"], y: ["Residual", "N"], name: "residual" }),
    };
    this.charts.r.element.classList.add("wide");
    this.caption = h("h2", {});
    this.lines = []; // of the table of runs
    this.element = h("div", { class: "view" }, h("div", { class: "side" }, this.form.element, this.work.element), this.stage);
    document.addEventListener("bench:data", () => this.forget());
    document.addEventListener("bench:units", () => this.answer && this.show(...this.answer));
    this.forget();
  }

  shown() {
    if (this.bench.state.view === id) this.safely(this.form.refresh());
  }

  update(state, before) {
    if (state.rig !== before.rig) this.shown();
  }

  safely(promise) {
    promise.catch((error) => this.bench.fail(error));
  }

  forget() {
    const { overview } = this.bench;
    this.answer = null;
    this.shown();
    put(this.stage, overview
      ? empty("No identification yet", "A study identifies all candidates and selects one by cross-validation. Alternatively identify one model by one method and examine its residuals.")
      : empty("No data", "Open the bundled tests or drop files on the Data page first.", h("button", { class: "primary", onclick: this.go("data") }, "Open data")));
  }

  start({ whole, body }) {
    return this.attend(whole, whole ? this.work.run("/study", this.bench.head) : this.work.run("/identify", body));
  }

  /** A page that was loaded again: go on watching, or show the result. */
  resume(jobs) {
    const last = jobs.filter((job) => ["study", "identify"].includes(job.kind) && job.state !== "cancelled").at(-1);
    if (!last) return;
    if (last.state === "done") this.show(last.kind === "study", last.answer);
    else this.safely(this.attend(last.kind === "study", this.work.resume(last)));
  }

  async attend(whole, work) {
    const { form, bench } = this;
    const { overview } = bench;
    form.working(true);
    if (this.stage.querySelector(".empty")) put(this.stage, busy(whole ? "Study running …" : "Identifying …", "The other views can be used meanwhile."));
    const answer = await (whole ? bench.study(work) : work);
    form.working(false);
    if (overview !== bench.overview) return this.work.clear(); // other data lie on the bench by now
    if (!answer) {
      if (this.stage.querySelector(".spinner")) this.forget();
      return;
    }
    const key = whole ? (answer.rigs[bench.state.rig] ?? answer.rigs[0]).chosen : answer.damper;
    await bench.refreshDampers();
    // A damper that is being moved meanwhile stays under the hand.
    if (key && (bench.state.view !== "model" || !bench.state.damper)) bench.store.settle({ damper: key, document: null, condition: null, held: {} });
    else if (key) bench.say(note("", "The identified damper is in the list of dampers."));
    this.show(whole, answer);
  }

  show(whole, answer) {
    this.answer = [whole, answer];
    put(this.stage, whole ? this.studied(answer) : this.identified(answer));
  }

  go(view) {
    return () => this.bench.store.pass({ view });
  }

  studied(answer) {
    const columns = [
      { title: "Candidate", value: (c) => c.title },
      { title: "Cross-validation", number: true, value: (c) => percent(c.left_out) },
      ...(answer.rigs.some((rig) => rig.candidates.some((c) => c.held_out !== null)) ? [{ title: "Validation", number: true, value: (c) => percent(c.held_out) }] : []),
      { title: "Individual fits", number: true, value: (c) => percent(c.per_run) },
      { title: "Parameters", number: true, value: (c) => String(c.numbers) },
      { title: "Time", number: true, value: (c) => seconds(c.seconds) },
      { title: "", value: (c) => h("button", { class: "link", "aria-label": `Explore ${c.title}`, onclick: () => this.bench.choose(c.damper, { view: "model" }) }, "Explore") },
    ];
    return [
      h("p", { class: "small faint" }, `Median RMS error as a percentage of the peak-to-peak force. Cross-validation: each identification run is predicted by a model identified without its condition; within one standard error of the lowest, the model with the fewest parameters is selected. Validation: runs not used for identification. Individual fits: each identification run fitted separately. Duration: ${seconds(answer.seconds)}.`),
      answer.rigs.map((rig) =>
        card(["Rig ", h("span", {}, rig.rig || this.bench.overview.name)],
          h("div", { class: "flush" }, table(columns, rig.candidates, { chosen: (c) => c.damper === rig.chosen, caption: `Candidates of rig ${rig.rig}` })))),
      h("div", { class: "row" },
        h("button", { class: "primary", onclick: this.go("model") }, "Explore"),
        h("button", { onclick: this.go("takeaway") }, "Export report and model")),
    ];
  }

  identified(answer) {
    const runs = answer.joint ? answer.joint.runs : answer.runs;
    const { v, x, r } = this.charts;
    queueMicrotask(() => this.safely(this.pick(runs, 0)));
    const notes = [...new Set(runs.flatMap((run) => run.notes ?? []))];
    return [
      this.boundsNote(answer, runs),
      answer.no_damper ? note("warn", h("div", {}, h("b", {}, "No model over conditions: "), answer.no_damper)) : null,
      answer.joint ? jointCard(answer) : null,
      this.runsCard(answer, runs),
      this.caption,
      h("div", { class: "figures" }, v.element, x.element, r.element),
      notes.length ? h("ul", { class: "small faint notes" }, notes.map((text) => h("li", {}, text))) : null,
      answer.damper ? h("div", { class: "row" }, h("button", { class: "primary", onclick: this.go("model") }, "Explore")) : null,
    ];
  }

  boundsNote(answer, runs) {
    const names = answer.joint ? answer.joint.at_bounds : [...new Set(runs.flatMap((run) => run.at_bounds))];
    if (!names.length) return null;
    return note("warn", h("div", {}, h("b", {}, "At a bound: "), `${names.join(", ")}. The data do not determine ${names.length > 1 ? "them" : "it"}, or the bound is too narrow.`));
  }

  runsCard(answer, runs) {
    const pick = (run) => this.safely(this.pick(runs, runs.indexOf(run)));
    const columns = [
      { title: "Run", value: (run) => h("button", { class: "link" }, run.id) }, // its click is the row's
      { title: "Error", number: true, value: (run) => percent(run.nrmse_pp) },
    ];
    if (!answer.joint) {
      columns.push({ title: "Scatter", number: true, value: (run) => percent(run.floor) });
      columns.push(...answer.units.map((p) => {
        const screen = onScreen(p.unit);
        const value = (run) => screen.factor * (run.values[p.name] ?? NaN);
        const { power, print } = column(runs.map(value));
        const ends = (run) => run.intervals[p.name]?.map((end) => screen.factor * end);
        const sure = (run) => h("span", { class: "faint", title: run.states[p.name] }, ends(run) ? spread(value(run), ends(run), 10 ** power) : run.at_bounds.includes(p.name) ? "" : " (no interval)");
        return { title: heading(p.name, screen.unit, power), number: true, value: (run) => [print(value(run)), sure(run), run.at_bounds.includes(p.name) ? h("span", { class: "badge warn" }, "at bound") : null] };
      }));
      columns.push({ title: "At bounds", value: (run) => run.at_bounds.join(", ") || "–" });
    }
    const held = answer.held_out === null ? "" : `; validation runs ${percent(answer.held_out)} with ${answer.numbers} parameters over all conditions`;
    const listed = table(columns, runs, { pick, caption: "Identified runs" });
    this.lines = [...listed.tBodies[0].rows];
    return h("section", { class: "card" },
      h("div", { class: "head" }, h("h2", {}, `${count(runs.length, "run")} identified`),
        h("span", { class: "small faint" }, `${answer.rig ? `Rig ${answer.rig}: ` : ""}${answer.joint ? "" : "± is the 95 % interval; "}median error ${percent(answer.median)} of the peak-to-peak force${held}`)),
      h("div", { class: "flush short" }, listed));
  }

  /** Show measured and identified force of one run. */
  async pick(runs, index) {
    const run = runs[index];
    this.caption.textContent = `Run ${run.id}`;
    this.lines.forEach((line, i) => {
      line.classList.toggle("chosen", i === index);
      line.querySelector("button").setAttribute("aria-pressed", String(i === index));
    });
    const { arrays, head } = await this.bench.api.frame(`/identified/runs/${index}`);
    const said = `${run.id}, ${condition(head.condition)}: error ${percent(run.nrmse_pp)} of the peak-to-peak force.`;
    const two = (axis) => [
      { x: arrays[`measured.${axis}`], y: arrays["measured.F"], color: "measured", width: 1.6, name: "measured" },
      { x: arrays[`model.${axis}`], y: arrays["model.F"], color: "predicted", width: 2, name: "identified" },
    ];
    const { v, x, r } = this.charts;
    for (const chart of [v, x, r]) chart.reset();
    v.draw(two("v"), said);
    x.draw(two("x"), said);
    r.draw([{ x: arrays["measured.t"], y: arrays.residual, color: "predicted", width: 1.5, name: "residual" }], said);
  }
}

/** The 95 % interval of a value as it stands behind it: its half width, or its ends where they differ. */
function spread(value, ends, scale) {
  const [below, above] = [value - ends[0], ends[1] - value];
  if (Math.abs(above - below) <= 0.1 * (above + below)) return ` ± ${figures((above + below) / 2 / scale, 2)}`;
  return ` (${ends.map((end) => figures(end / scale, 2)).join(" to ")})`;
}

function jointCard(answer) {
  const { values, intervals, at_bounds: bounds } = answer.joint;
  const said = (p) => {
    const { factor, unit: shown } = onScreen(p.unit);
    const [value, found] = [factor * values[p.name], intervals[p.name]];
    const ends = found && found.low !== null ? spread(value, [factor * found.low, factor * found.high], 1) : "";
    return `${figures(value)}${ends} ${unit(shown)}${found && !ends ? ` (${found.state})` : ""}`;
  };
  const columns = [
    { title: "Parameter", value: (p) => p.name },
    { title: "Value and 95 % interval", value: said },
    { title: "Meaning", value: (p) => p.meaning },
    { title: "", value: (p) => (bounds.includes(p.name) ? h("span", { class: "badge warn" }, "at bound") : "") },
  ];
  return card(answer.title, h("div", { class: "flush short" }, table(columns, answer.units, { caption: "Parameters" })));
}
