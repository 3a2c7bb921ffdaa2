// The Identify view: the whole study, or one model by one method; progress, and results with residuals.

import { View } from "../app.js";
import { Chart, loopCharts } from "../chart.js";
import { card, h, loading, note, placeholder, render, table } from "../dom.js";
import { column, condition, count, figures, heading, percent, seconds, unit } from "../format.js";
import { IdentifyForm } from "../identify_form.js";
import { JobProgress } from "../job_progress.js";
import { onScreen } from "../units.js";

export class IdentifyView extends View {
  static id = "identify";
  static label = "Identify";

  constructor(app) {
    super(app);
    this.progress = new JobProgress(app);
    this.form = new IdentifyForm(app, (study, body) =>
      this.follow(study, study ? this.progress.start("/study", app.reportHead) : this.progress.start("/identify", body)));
    this.stage = h("div", { class: "stage" });
    this.charts = { ...loopCharts("identified", "v"), r: new Chart({ title: "Residual over time", x: ["Time", "s"], y: ["Residual", "N"], name: "residual" }) };
    this.charts.r.element.classList.add("wide");
    this.caption = h("h2", {});
    this.element = h("div", { class: "view" }, h("div", { class: "side" }, this.form.element, this.progress.element), this.stage);
    app.on("data", () => this.clear());
    app.on("units", () => this.result && this.show(...this.result));
    this.clear();
  }

  refresh() {
    return this.form.refresh();
  }

  update(state, before) {
    if (state.rig !== before.rig) this.shown();
  }

  /** Remove the results. */
  clear() {
    this.result = null;
    this.shown();
    render(this.stage, this.app.overview
      ? placeholder("No identification yet", "A study identifies all candidates and selects one by cross-validation. Alternatively identify one model by one method and examine its residuals.")
      : this.app.noData());
  }

  /** After a reload of the page: follow the last job, or show its result. */
  resume(jobs) {
    const last = jobs.filter((job) => ["study", "identify"].includes(job.kind) && job.state !== "cancelled").at(-1);
    if (!last) return;
    const study = last.kind === "study";
    if (last.state === "done") this.show(study, last.result);
    else this.app.run(this.follow(study, this.progress.resume(last)));
  }

  async follow(study, job) {
    const { form, app } = this;
    form.setBusy(true);
    if (this.stage.querySelector(".empty")) render(this.stage, loading(study ? "Study running …" : "Identifying …", "The other views can be used meanwhile."));
    const result = await (study ? app.duringStudy(job) : job);
    form.setBusy(false);
    if (!result) return this.stage.querySelector(".spinner") && this.clear();
    const key = study ? (result.rigs[app.state.rig] ?? result.rigs[0]).chosen : result.damper;
    await app.refreshDampers();
    // A damper whose sliders the user moves meanwhile stays selected.
    if (key && (app.state.view !== "model" || !app.state.damper)) app.store.amend({ damper: key, document: null, condition: null, held: {} });
    else if (key) app.notify(note("", "The identified damper is in the list of dampers."));
    return this.show(study, result);
  }

  show(study, result) {
    this.result = [study, result];
    render(this.stage, study ? this.studyResult(result) : this.modelResult(result));
  }

  studyResult({ rigs, seconds: duration }) {
    const validated = rigs.some((rig) => rig.candidates.some((c) => c.validation !== null));
    const columns = [
      { title: "Candidate", value: (c) => c.title },
      { title: "Cross-validation", number: true, value: (c) => percent(c.cross_validation) },
      ...(validated ? [{ title: "Validation", number: true, value: (c) => percent(c.validation) }] : []),
      { title: "Individual fits", number: true, value: (c) => percent(c.individual_fits) },
      { title: "Parameters", number: true, value: (c) => String(c.parameter_count) },
      { title: "Time", number: true, value: (c) => seconds(c.seconds) },
      this.app.exploreColumn(),
    ];
    return [
      h("p", { class: "small faint" }, `Median RMS error as a percentage of the peak-to-peak force. Cross-validation: each identification run is predicted by a model identified without its condition; within one standard error of the lowest, the model with the fewest parameters is selected. Validation: runs not used for identification. Individual fits: each identification run fitted separately. Duration: ${seconds(duration)}.`),
      rigs.map(({ rig, candidates, chosen }) =>
        card(["Rig ", h("span", {}, rig || this.app.overview.name)],
          h("div", { class: "flush" }, table(columns, candidates, { chosen: (c) => c.damper === chosen, caption: `Candidates of rig ${rig}` })))),
      h("div", { class: "row" }, this.app.viewButton("model", "Explore"), this.app.viewButton("export", "Export report and model", "")),
    ];
  }

  modelResult(result) {
    const { damper, no_damper: reason, joint } = result;
    const runs = joint ? joint.runs : result.runs;
    const notes = [...new Set(runs.flatMap((run) => run.notes ?? []))];
    const bounds = joint ? joint.at_bounds : [...new Set(runs.flatMap((run) => run.at_bounds))];
    queueMicrotask(() => this.app.run(this.showRun(runs, 0)));
    return [
      bounds.length ? note("warn", h("div", {}, h("b", {}, "At a bound: "), `${bounds.join(", ")}. The data do not determine ${bounds.length > 1 ? "them" : "it"}, or the bound is too narrow.`)) : null,
      reason ? note("warn", h("div", {}, h("b", {}, "No model over conditions: "), reason)) : null,
      joint ? jointCard(result) : null,
      this.runsCard(result, runs),
      this.caption,
      h("div", { class: "figures" }, ["v", "x", "r"].map((name) => this.charts[name].element)),
      notes.length ? h("ul", { class: "small faint notes" }, notes.map((text) => h("li", {}, text))) : null,
      damper ? h("div", { class: "row" }, this.app.viewButton("model", "Explore")) : null,
    ];
  }

  runsCard({ rig, joint, parameters, median, validation, parameter_count: size }, runs) {
    const columns = [
      { title: "Run", value: (run) => h("button", { class: "link" }, run.id) }, // a click on it is one on the row
      { title: "Error", number: true, value: (run) => percent(run.nrmse_pp) },
    ];
    if (!joint) {
      columns.push({ title: "Scatter", number: true, value: (run) => percent(run.floor) },
        ...parameters.map((p) => parameterColumn(p, runs)),
        { title: "At bounds", value: (run) => run.at_bounds.join(", ") || "–" });
    }
    const validated = validation === null ? "" : `; validation runs ${percent(validation)} with ${size} parameters over all conditions`;
    const list = table(columns, runs, { pick: (run) => this.app.run(this.showRun(runs, runs.indexOf(run))), caption: "Identified runs" });
    this.rows = [...list.tBodies[0].rows];
    return h("section", { class: "card" },
      h("div", { class: "head" }, h("h2", {}, `${count(runs.length, "run")} identified`),
        h("span", { class: "small faint" }, `${rig ? `Rig ${rig}: ` : ""}${joint ? "" : "± is the 95 % interval; "}median error ${percent(median)} of the peak-to-peak force${validated}`)),
      h("div", { class: "flush short" }, list));
  }

  /** Show measured and identified force of one run. */
  async showRun(runs, index) {
    const run = runs[index];
    this.caption.textContent = `Run ${run.id}`;
    this.rows.forEach((row, i) => {
      row.classList.toggle("chosen", i === index);
      row.querySelector("button").setAttribute("aria-pressed", String(i === index));
    });
    const { arrays, head } = await this.app.api.frame(`/identified/runs/${index}`);
    const summary = `${run.id}, ${condition(head.condition)}: error ${percent(run.nrmse_pp)} of the peak-to-peak force.`;
    const loops = (axis) => [
      { x: arrays[`measured.${axis}`], y: arrays["measured.F"], color: "measured", width: 1.6, name: "measured" },
      { x: arrays[`model.${axis}`], y: arrays["model.F"], color: "predicted", width: 2, name: "identified" },
    ];
    const { v, x, r } = this.charts;
    for (const chart of [v, x, r]) chart.reset();
    v.draw(loops("v"), summary);
    x.draw(loops("x"), summary);
    r.draw([{ x: arrays["measured.t"], y: arrays.residual, color: "predicted", width: 1.5, name: "residual" }], summary);
  }
}

/** Column of a parameter in the table of runs: its value, its interval, and a badge at a bound. */
function parameterColumn({ name, unit: itsUnit }, runs) {
  const { factor, unit: shown } = onScreen(itsUnit);
  const value = (run) => factor * (run.values[name] ?? NaN);
  const { power, print } = column(runs.map(value));
  const interval = (run) => {
    const ends = run.intervals[name]?.map((end) => factor * end);
    return ends ? spread(value(run), ends, 10 ** power) : run.at_bounds.includes(name) ? "" : " (no interval)";
  };
  return {
    title: heading(name, shown, power), number: true,
    value: (run) => [print(value(run)), h("span", { class: "faint", title: run.states[name] }, interval(run)), run.at_bounds.includes(name) ? atBound() : null],
  };
}

/** The 95 % interval behind a value: its half width, or its ends where they are not symmetric. */
function spread(value, ends, scale) {
  const [below, above] = [value - ends[0], ends[1] - value];
  if (Math.abs(above - below) <= 0.1 * (above + below)) return ` ± ${figures((above + below) / 2 / scale, 2)}`;
  return ` (${ends.map((end) => figures(end / scale, 2)).join(" to ")})`;
}

function jointCard({ title, parameters, joint: { values, intervals, at_bounds: bounds } }) {
  const value = (p) => {
    const { factor, unit: shown } = onScreen(p.unit);
    const { low = null, high, state } = intervals[p.name] ?? {};
    const scaled = factor * values[p.name];
    const ends = low === null ? "" : spread(scaled, [factor * low, factor * high], 1);
    return `${figures(scaled)}${ends} ${unit(shown)}${state && !ends ? ` (${state})` : ""}`;
  };
  const columns = [
    { title: "Parameter", value: (p) => p.name },
    { title: "Value and 95 % interval", value },
    { title: "Meaning", value: (p) => p.meaning },
    { title: "", value: (p) => (bounds.includes(p.name) ? atBound() : "") },
  ];
  return card(title, h("div", { class: "flush short" }, table(columns, parameters, { caption: "Parameters" })));
}

function atBound() {
  return h("span", { class: "badge warn" }, "at bound");
}
