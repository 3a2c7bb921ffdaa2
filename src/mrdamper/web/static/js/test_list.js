// The test list: columns of the channels, and current, split and findings of every uploaded test, to be corrected.

import { capitalise, errorMessage, finding, h, note, options, render, table } from "./dom.js";

const CHANNELS = ["time", "displacement", "force", "current"];
const UNITS = { time: ["s", "ms"], displacement: ["mm", "m", "in"], force: ["N", "kN", "lbf", "kgf"], current: ["A", "mA"] };
const SIGNED = ["displacement", "force"];

export class TestList {
  constructor(app, zone) {
    Object.assign(this, { app, zone });
    this.turn = 0; // of several requests under way, the newest counts
    this.message = h("div", { role: "status" });
    this.body = h("div", {});
    this.element = h("details", { class: "card", id: "tests", hidden: true }, h("summary", {}, "Tests: columns, currents, split"), this.body, this.message);
    this.element.addEventListener("toggle", () => this.element.open && this.fetch());
  }

  /** Show the list for other data or refused files: fetched when it is open; opened where files were refused. */
  async show(overview) {
    this.element.hidden = !overview;
    if (this.element.open) await this.fetch();
    else if (overview?.verdicts.some((v) => v.state === "refused")) this.element.open = true;
  }

  async fetch() {
    const turn = (this.turn += 1);
    try {
      const { tests, preview } = await this.app.api.get("/tests");
      if (turn !== this.turn) return; // the user may have changed the newer list already
      render(this.body, preview ? this.columns(preview) : null, tests.length ? this.list(tests) : null, tests.some((t) => t.run) ? this.splitRules(tests) : null);
    } catch (error) {
      render(this.message, errorMessage(error));
    }
  }

  /** Request a change, and load the data that result from it. */
  async change(path, body) {
    render(this.message);
    await this.zone.load(async () => {
      const overview = await this.app.api.post(path, body);
      if (overview.reason) render(this.message, note("good", `Validation runs: ${overview.reason}.`));
      return overview;
    });
  }

  columns(preview) {
    const pickers = CHANNELS.map((name) => columnPicker(name, preview));
    const head = preview.names.map((name, i) => ({ title: name + (preview.units[i] ? ` [${preview.units[i]}]` : ""), value: (row) => row[i] }));
    const read = () => this.change("/tests/columns", { channels: Object.fromEntries(pickers.map((p) => p.chosen()).filter(Boolean)) });
    return h("div", { class: "group" },
      h("h3", {}, "Columns"), h("p", { class: "small faint" }, `The first rows of ${preview.name}.`),
      h("div", { class: "scroll" }, table(head, preview.rows, { caption: `First rows of ${preview.name}` })),
      pickers.map((p) => p.element), h("div", { class: "row" }, h("button", { onclick: read }, "Read with these columns")));
  }

  list(tests) {
    const columns = [
      { title: "Test", value: (t) => [t.test || t.name, t.test && t.name !== t.test ? h("div", { class: "small faint" }, t.name) : null] },
      { title: "Motion", value: (t) => t.motion || "–" },
      { title: "Current (A)", number: true, value: (t) => this.current(t) },
      { title: "Split", value: (t) => (t.run ? this.split(t, tests) : "–") },
      { title: "State", value: (t) => state(t) },
    ];
    return h("div", { class: "group" }, h("h3", {}, "Tests"), h("div", { class: "scroll" }, table(columns, tests, { caption: "Tests" })));
  }

  current(test) {
    const value = test.current_A === null ? "" : String(test.current_A);
    if (test.file === null || (test.state === "refused" && !test.test)) return value || "–";
    const onchange = (event) =>
      this.change("/tests/current", { file: test.file, run: test.test, current_A: event.target.value === "" ? null : Number(event.target.value) });
    return h("input", { type: "number", step: "any", class: "short", "aria-label": `Current of ${test.test}, ampere`, value, placeholder: test.state === "refused" ? "A" : "varies", onchange });
  }

  split(test, tests) {
    const out = test.split === "validate";
    const others = tests.filter((t) => t.split === "validate" && t.run !== test.run).map((t) => t.run);
    const runs = out ? others : [...others, test.run];
    const toggle = () => this.change("/tests/split", runs.length ? { runs } : { none: true });
    return h("button", { class: "link small", "aria-pressed": String(out), "aria-label": `Use ${test.test} for validation`, onclick: toggle }, out ? "validation" : "identification");
  }

  splitRules(tests) {
    const levels = [...new Set(tests.filter((t) => t.run && t.current_A !== null).map((t) => Number(t.current_A.toPrecision(2))))].sort((a, b) => a - b);
    const level = h("select", { "aria-label": "Current of the validation runs" }, options(levels.map((a) => [String(a), `${a} A`])));
    const every = h("input", { type: "number", min: "2", step: "1", value: "4", class: "short", "aria-label": "Every n-th run" });
    const button = (text, body) => h("button", { onclick: () => this.change("/tests/split", body()) }, text);
    return h("div", { class: "group" }, h("h3", {}, "Choose validation runs"),
      h("div", { class: "row" }, button("A stratified fifth", () => ({})), button("Nothing", () => ({ none: true }))),
      h("div", { class: "row" }, button("All at", () => ({ currents: [Number(level.value)] })), level),
      h("div", { class: "row" }, button("Every n-th", () => ({ every: Number(every.value) })), every));
  }
}

/** Lists for column, unit and sign of a channel; `chosen()` gives its name with the choice, or null. */
function columnPicker(name, preview) {
  const known = preview.channels[name] ?? { column: null, unit: "", sign: 1 };
  const list = (label, pairs, value) => {
    const select = h("select", { "aria-label": `${label} of ${name}` }, options(pairs));
    select.value = value;
    return select;
  };
  const column = list("Column", [["", name === "current" ? "elsewhere" : "–"], ...preview.names.map((text, i) => [String(i), text])], String(known.column ?? ""));
  const units = [...new Set([known.unit, ...UNITS[name]].filter(Boolean))];
  const unit = list("Unit", [...(known.unit ? [] : [["", "as the file states"]]), ...units.map((u) => [u, u])], known.unit);
  const sign = SIGNED.includes(name) ? list("Sign", [["1", "extension +"], ["-1", "compression +"]], String(known.sign)) : null;
  column.addEventListener("change", () => {
    if (column.value !== "") unit.value = units.find((u) => u === preview.units[Number(column.value)]) ?? unit.value;
  });
  const chosen = () => (column.value === "" ? null : [name, { column: preview.numbers[Number(column.value)] - 1, unit: unit.value, sign: Number(sign?.value ?? 1) }]);
  return { chosen, element: h("div", { class: "row" }, h("span", { class: "small picked" }, capitalise(name)), column, unit, sign) };
}

function state(test) {
  const [kind, text] = test.state === "refused" ? ["bad", "refused"] : test.findings.length ? ["warn", "noted"] : ["good", "taken"];
  return [h("span", { class: `badge ${kind}` }, text), test.findings.map(([code, problem]) => finding(code, problem, "small"))];
}
