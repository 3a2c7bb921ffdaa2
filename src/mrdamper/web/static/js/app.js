// What the views share: the data and dampers on the bench, the state of the page, and ways to speak up.

import { BenchError } from "./api.js";
import { h, note, problem, put } from "./dom.js";
import { percent } from "./format.js";
import { forgetSession } from "./session.js";
import { Store } from "./state.js";

/** What the views share. */
export class Bench {
  constructor(api, limits) {
    this.api = api;
    this.limits = limits;
    this.store = new Store();
    this.overview = null; // of the data on the bench
    this.busy = ""; // what is being done to bring others
    this.studying = false; // a study runs
    this.dampers = [];
    this.tables = new Map(); // rig number to its runs and matrix
    this.picture = ""; // the logo of the report's head, as base64; too large for a link
    this.undocumented = null; // the damper last seen that no file holds
    this.loops = new Map(); // measured loops and verdicts, fetched once
  }

  get state() {
    return this.store.state;
  }

  get logo() {
    return this.picture;
  }

  set logo(picture) {
    this.picture = picture;
    this.announce("logo");
  }

  /** What the reader wrote for the head of a report. */
  get head() {
    return { about: this.state.about, logo: this.logo };
  }

  /** New data: `bring` asks the bench for them; until they are there the Data view says `what` is being done. */
  async takeData(bring, what, change = {}) {
    this.busy = what;
    this.announce("busy");
    try {
      const overview = await bring();
      this.overview = overview;
      this.tables.clear();
      this.loops.clear();
      this.busy = "";
      this.store.settle({ source: overview?.source ?? null, dataName: overview?.name ?? "", rig: 0, run: null, compareRun: null, ...change });
      this.store.forget();
      this.announce("data");
    } finally {
      if (this.busy) {
        this.busy = "";
        this.announce("busy");
      }
    }
  }

  /** Open the bundled tests and the models identified from them. */
  async openBundled() {
    await this.takeData(() => this.api.post("/bundled"), "Opening the bundled tests");
    await this.refreshDampers();
  }

  /** Key of the damper to show where none was chosen: selected by a study, of the rig shown, the newest. */
  preferred() {
    const rig = this.overview?.rigs[this.state.rig]?.name;
    const rank = (d) => 2 * (d.rig === rig) + d.selected;
    return this.dampers.reduce((best, d) => (best && rank(best) > rank(d) ? best : d), null)?.key ?? null;
  }

  /** Options of a list of dampers, by rig; the error stands before the name, which may be cut. */
  damperOptions() {
    const rigs = [...new Set(this.dampers.map((d) => d.rig))];
    const option = (d) => h("option", { value: d.key }, `${d.error === null ? "" : `${percent(d.error)} · `}${d.title}${d.selected ? " · selected" : ""}`);
    return rigs.map((rig) => h("optgroup", { label: rig || "rig without name" }, this.dampers.filter((d) => d.rig === rig).map(option)));
  }

  /** Mark that a study runs, until its work ends. */
  async study(work) {
    this.studying = true;
    this.announce("studying");
    try {
      return await work;
    } finally {
      this.studying = false;
      this.announce("studying");
    }
  }

  async rigTable(number = this.state.rig) {
    if (!this.overview) return null;
    return once(this.tables, number, () => this.api.get(`/data/rigs/${number}`));
  }

  /** The verdict on every run of the rig shown. */
  quality(rig = this.state.rig) {
    const path = `/data/rigs/${rig}/quality`;
    return once(this.loops, path, () => this.api.get(path));
  }

  /** A measured loop of the rig shown. */
  loop(key, part = "cycle", rig = this.state.rig) {
    const path = `/data/rigs/${rig}/runs/${key}/${part}`;
    return once(this.loops, path, () => this.api.frame(path));
  }

  async refreshDampers() {
    this.dampers = await this.api.get("/dampers");
    this.announce("dampers");
    return this.dampers;
  }

  /** Put a damper under the sliders. */
  async choose(key, change = {}) {
    this.store.commit({ damper: key, document: null, held: {}, condition: null, ...change });
  }

  /** Bring back a state from a link or file: its data where they are bundled, and its model. */
  async restore(state) {
    if (state.source === "bundled" && this.overview?.source !== "bundled") {
      await this.openBundled();
    } else if (state.source === "drop" && this.overview?.name !== state.dataName) {
      this.say(note("warn", h("b", {}, "The data are not part of a link. "), `Drop “${state.dataName}” again to lay measured runs under the model.`));
    }
    let damper = this.dampers.some((d) => d.key === state.damper) ? state.damper : null;
    if (state.document && !damper) {
      damper = (await this.api.post("/dampers", { text: state.document })).damper;
      await this.refreshDampers();
    }
    this.store.commit({ ...state, source: this.overview?.source ?? null, dataName: this.overview?.name ?? "", damper });
  }

  /** The model's document goes into the state, so that a link or file carries it; asked for once a damper. */
  async keepDocument() {
    const { damper, document } = this.state;
    if (!damper || document || this.undocumented === damper) return;
    try {
      const { text } = await this.api.post(`/dampers/${damper}/document`, { held: {} });
      if (this.state.damper === damper) this.store.settle({ document: JSON.stringify(JSON.parse(text)) });
    } catch (error) {
      this.undocumented = damper;
      if (error.status !== 422) return this.fail(error);
      this.say(note("warn", "This kind of damper has no file format yet: a link brings back the data, not the model."), 6000);
    }
  }

  /** Say something for a while. */
  say(element, milliseconds = 9000) {
    const box = document.getElementById("toasts");
    box.append(element);
    setTimeout(() => element.remove(), milliseconds);
  }

  fail(error) {
    if (error instanceof BenchError && error.status === 410) {
      forgetSession();
      put(document.getElementById("view"), h("div", { class: "empty" }, problem(error), h("button", { class: "primary", onclick: () => location.reload() }, "Load the page again")));
      return;
    }
    console.warn(error);
    this.say(problem(error), 15000);
  }

  /** Tell a screen reader. */
  speak(text) {
    document.getElementById("spoken").textContent = text;
  }

  announce(what) {
    document.dispatchEvent(new CustomEvent(`bench:${what}`));
  }
}

/** What was fetched under a name before, or is fetched now; what failed is tried again. */
function once(found, name, fetch) {
  if (!found.has(name)) {
    const promise = fetch();
    found.set(name, promise);
    promise.catch(() => found.get(name) === promise && found.delete(name));
  }
  return found.get(name);
}
