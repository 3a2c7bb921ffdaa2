// The test list: which column is which, and file, test, motion, current and split of every test, mended by a click.

import { capital, h, note, problem, put, table } from "./dom.js";

const CHANNELS = ["time", "displacement", "force", "current"];
const UNITS = { time: ["s", "ms"], displacement: ["mm", "m", "in"], force: ["N", "kN", "lbf", "kgf"], current: ["A", "mA"] };
const SIGNED = ["displacement", "force"];

export class TestList {
  constructor(bench, drop) {
    Object.assign(this, { bench, drop });
    this.turn = 0; // of several requests on their way, the newest counts
    this.said = h("div", { role: "status" });
    this.body = h("div", {});
    this.element = h("details", { class: "card", id: "tests", hidden: true }, h("summary", {}, "Tests: columns, currents, split"), this.body, this.said);
    this.element.addEventListener("toggle", () => this.element.open && this.fetch());
  }

  /** Other data are loaded, or files were refused: the list is fetched once, when it is open; opening it fetches it. */
  async show(found) {
    this.element.hidden = !found;
    const refused = (found?.verdicts ?? []).some((v) => v.state === "refused");
    if (this.element.open) await this.fetch();
    else if (refused) this.element.open = true;
  }

  async fetch() {
    const turn = (this.turn += 1);
    try {
      const { tests, preview } = await this.bench.api.get("/tests");
      if (turn !== this.turn) return; // choices made meanwhile belong to the newer list
      put(this.body, preview ? this.columns(preview) : null, tests.length ? this.list(tests) : null, tests.some((t) => t.run) ? this.rules(tests) : null);
    } catch (error) {
      put(this.said, problem(error));
    }
  }

  /** Ask for a change, and take what the bench has then. */
  async change(path, body) {
    put(this.said);
    await this.drop.load(async () => {
      const overview = await this.bench.api.post(path, body);
      if (overview.reason) put(this.said, note("good", capital(`validation runs: ${overview.reason}`), "."));
      return overview;
    });
  }

  columns(preview) {
    const pickers = CHANNELS.map((name) => this.picker(name, preview));
    const head = preview.names.map((name, i) => ({ title: name + (preview.units[i] ? ` [${preview.units[i]}]` : ""), value: (row) => row[i] }));
    const read = () => {
      const channels = Object.fromEntries(pickers.filter((p) => p.column.value !== "").map((p) => [p.name, p.value()]));
      this.change("/tests/columns", { channels });
    };
    return h("div", { class: "group" },
      h("h3", {}, "Columns"), h("p", { class: "small faint" }, `The first rows of ${preview.name}.`),
      h("div", { class: "scroll" }, table(head, preview.rows, { caption: `First rows of ${preview.name}` })),
      pickers.map((p) => p.element), h("div", { class: "row" }, h("button", { onclick: read }, "Read with these columns")));
  }

  picker(name, preview) {
    const known = preview.channels[name] ?? { column: null, unit: "", sign: 1 };
    const option = (value, text, chosen) => h("option", { value, selected: chosen }, text);
    const column = h("select", { "aria-label": `Column of ${name}` },
      option("", name === "current" ? "elsewhere" : "–", known.column === null), preview.names.map((text, i) => option(String(i), text, known.column === i)));
    const units = [...new Set([known.unit, ...UNITS[name]].filter(Boolean))];
    const unit = h("select", { "aria-label": `Unit of ${name}` }, known.unit ? null : option("", "as the file says", true), units.map((u) => option(u, u, u === known.unit)));
    const sign = SIGNED.includes(name)
      ? h("select", { "aria-label": `Sign of ${name}` }, option("1", "extension +", known.sign === 1), option("-1", "compression +", known.sign === -1)) : null;
    column.addEventListener("change", () => {
      if (column.value === "") return;
      unit.value = units.find((u) => u === preview.units[Number(column.value)]) ?? unit.value;
    });
    const value = () => ({ column: Number(column.value), unit: unit.value, sign: Number(sign?.value ?? 1) });
    return { name, column, value, element: h("div", { class: "row" }, h("span", { class: "small picked" }, capital(name)), column, unit, sign) };
  }

  list(tests) {
    const shown = [
      { title: "Test", value: (t) => [t.test || t.name, t.name && t.name !== t.test ? h("div", { class: "small faint" }, t.name) : null] },
      { title: "Motion", value: (t) => t.motion || "–" },
      { title: "Current (A)", number: true, value: (t) => this.current(t) },
      { title: "Split", value: (t) => (t.run ? this.held(t, tests) : "–") },
      { title: "State", value: (t) => state(t) },
    ];
    return h("div", { class: "group" }, h("h3", {}, "Tests"), h("div", { class: "scroll" }, table(shown, tests, { caption: "Tests" })));
  }

  current(test) {
    const text = test.current_A === null ? "" : String(test.current_A);
    if (test.file === null || (test.state === "refused" && !test.test)) return text || "–";
    const input = h("input", { type: "number", step: "any", class: "short", "aria-label": `Current of ${test.test}, ampere`, value: text, placeholder: test.state === "refused" ? "A" : "varies" });
    input.addEventListener("change", () =>
      this.change("/tests/current", { file: test.file, run: test.test, current_A: input.value === "" ? null : Number(input.value) }));
    return input;
  }

  held(test, tests) {
    const out = test.split === "validate";
    const others = tests.filter((t) => t.split === "validate" && t.run !== test.run).map((t) => t.run);
    const runs = out ? others : [...others, test.run];
    const toggle = () => this.change("/tests/split", runs.length ? { runs } : { none: true });
    return h("button", { class: "link small", "aria-pressed": out ? "true" : "false", "aria-label": `Use ${test.test} for validation`, onclick: toggle }, out ? "validation" : "identification");
  }

  rules(tests) {
    const levels = [...new Set(tests.filter((t) => t.run && t.current_A !== null).map((t) => Number(t.current_A.toPrecision(2))))].sort((a, b) => a - b);
    const level = h("select", { "aria-label": "Current to hold out" }, levels.map((a) => h("option", { value: String(a) }, `${a} A`)));
    const every = h("input", { type: "number", min: "2", step: "1", value: "4", class: "short", "aria-label": "Every n-th run" });
    const button = (text, body) => h("button", { onclick: () => this.change("/tests/split", body()) }, text);
    return h("div", { class: "group" }, h("h3", {}, "Hold out for validation"),
      h("div", { class: "row" }, button("A stratified fifth", () => ({})), button("Nothing", () => ({ none: true }))),
      h("div", { class: "row" }, button("All at", () => ({ currents: [Number(level.value)] })), level),
      h("div", { class: "row" }, button("Every n-th", () => ({ every: Number(every.value) })), every));
  }
}

function state(test) {
  const bad = test.state === "refused";
  return [h("span", { class: `badge ${bad ? "bad" : test.findings.length ? "warn" : "good"}` }, bad ? "refused" : test.findings.length ? "noted" : "taken"),
    test.findings.map(([code, text]) => h("div", { class: "small" }, text ? `${capital(text)} ` : "", h("code", {}, code)))];
}
