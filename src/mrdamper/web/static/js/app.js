// What the views share: the loaded data and dampers, the state of the page, messages and events.

import { ApiError, forgetSession } from "./api.js";
import { errorMessage, h, note, options, placeholder, render } from "./dom.js";
import { percent } from "./format.js";
import { Store } from "./state.js";

/** The app as its views use it. */
export class App {
  constructor(api, limits) {
    Object.assign(this, { api, limits, store: new Store(), dampers: [] });
    this.overview = null; // of the loaded data
    this.loading = ""; // description of the loading under way
    this.studyRunning = false;
    this.cache = new Map(); // promises of responses about the loaded data, by path
    this.logo = ""; // of the report, as base64; too large for a link
    this.unsavable = null; // key of the last damper without a file format
  }

  get state() {
    return this.store.state;
  }

  setLogo(logo) {
    this.logo = logo;
    this.emit("logo");
  }

  /** Head of the report as the user has filled it in. */
  get reportHead() {
    return { about: this.state.about, logo: this.logo };
  }

  /** Replace the data by those that `load` resolves to; meanwhile the Data view shows `description`. */
  async loadData(load, description, change = {}) {
    this.loading = description;
    this.emit("loading");
    try {
      const overview = await load();
      this.overview = overview;
      this.cache.clear();
      this.loading = "";
      this.store.amend({ source: overview?.source ?? null, dataName: overview?.name ?? "", rig: 0, run: null, compareRun: null, ...change });
      this.store.clearHistory();
      this.emit("data");
    } finally {
      if (this.loading) {
        this.loading = "";
        this.emit("loading");
      }
    }
  }

  /** Open the bundled tests and the models identified from them. */
  async openBundled() {
    await this.loadData(() => this.api.post("/bundled"), "Opening the bundled tests");
    await this.refreshDampers();
  }

  /** Key of the damper to show where none was chosen: selected by a study, of the current rig, the newest. */
  defaultDamper() {
    const rig = this.overview?.rigs[this.state.rig]?.name;
    const rank = (d) => 2 * (d.rig === rig) + d.selected;
    return this.dampers.reduce((best, d) => (best && rank(best) > rank(d) ? best : d), null)?.key ?? null;
  }

  /** Options of a list of dampers, by rig; the error stands before the name, which may be cut. */
  damperOptions() {
    const rigs = [...new Set(this.dampers.map((d) => d.rig))];
    const name = (d) => (rigs.length > 1 && d.rig ? `${d.rig}: ${d.title}` : d.title); // a closed list shows no group
    const option = (d) => [d.key, `${d.error === null ? "" : `${percent(d.error)} · `}${name(d)}${d.selected ? " · selected" : ""}`];
    return rigs.map((rig) => h("optgroup", { label: rig || "rig without name" }, options(this.dampers.filter((d) => d.rig === rig).map(option))));
  }

  /** Number of a rig in the loaded data by its name; -1 where it is not among them. */
  rigNumber(name) {
    return this.overview?.rigs.findIndex((rig) => rig.name === name) ?? -1;
  }

  /** Mark that a study runs until the promise settles. */
  async duringStudy(promise) {
    this.studyRunning = true;
    this.emit("study");
    try {
      return await promise;
    } finally {
      this.studyRunning = false;
      this.emit("study");
    }
  }

  /** Runs and test matrix of a rig; null without data. */
  async rigTable(rig = this.state.rig) {
    return this.overview && this.cached(`/data/rigs/${rig}`, "get");
  }

  /** Quality of every run of a rig. */
  quality(rig) {
    return this.cached(`/data/rigs/${rig}/quality`, "get");
  }

  /** A measured loop. */
  loop(key, part, rig) {
    return this.cached(`/data/rigs/${rig}/runs/${key}/${part}`, "frame");
  }

  /** Response to a request, sent once for the loaded data; one that failed is sent again. */
  cached(path, method) {
    if (!this.cache.has(path)) {
      const promise = this.api[method](path);
      this.cache.set(path, promise);
      promise.catch(() => this.cache.get(path) === promise && this.cache.delete(path));
    }
    return this.cache.get(path);
  }

  async refreshDampers() {
    this.dampers = await this.api.get("/dampers");
    this.emit("dampers");
  }

  /** Add a damper from the text of a model.json; resolves to its key. */
  async addDamper(text) {
    const { damper } = await this.api.post("/dampers", { text });
    await this.refreshDampers();
    return damper;
  }

  selectDamper(key, change = {}) {
    this.store.commit({ damper: key, document: null, held: {}, condition: null, ...change });
  }

  showView(view) {
    this.store.update({ view });
  }

  /** A button that opens another view. */
  viewButton(view, text, kind = "primary") {
    return h("button", { class: kind, onclick: () => this.showView(view) }, text);
  }

  /** Content of a view that requires data. */
  noData() {
    return placeholder("No data", "Open the bundled tests or drop files on the Data page first.", this.viewButton("data", "Open data"));
  }

  /** Column of a table of models: buttons that open the damper of a row in the Model view. */
  exploreColumn() {
    const explore = (row) => () => this.selectDamper(row.damper, { view: "model" });
    return { title: "", value: (row) => h("button", { class: "link", "aria-label": `Explore ${row.title}`, onclick: explore(row) }, "Explore") };
  }

  /** Restore a state from a link or file: its data where they are bundled, and its model. */
  async restore(state) {
    if (state.source === "bundled" && this.overview?.source !== "bundled") {
      await this.openBundled();
    } else if (state.source === "upload" && this.overview?.name !== state.dataName) {
      this.notify(note("warn", h("b", {}, "A link contains no measured data. "), `Drop “${state.dataName}” again to compare the model with measured runs.`));
    }
    let damper = this.dampers.some((d) => d.key === state.damper) ? state.damper : null;
    if (state.document && !damper) damper = await this.addDamper(state.document);
    this.store.commit({ ...state, source: this.overview?.source ?? null, dataName: this.overview?.name ?? "", damper });
  }

  /** Include the model of the selected damper in the state, for a link or file; requested once per damper. */
  async includeDocument() {
    const { damper, document } = this.state;
    if (!damper || document || this.unsavable === damper) return;
    try {
      const { text } = await this.api.post(`/dampers/${damper}/document`, { held: {} });
      if (this.state.damper === damper) this.store.amend({ document: JSON.stringify(JSON.parse(text)) });
    } catch (error) {
      this.unsavable = damper;
      if (error.status !== 422) return this.fail(error);
      this.notify(note("warn", "This kind of damper has no file format yet: a link contains the data set's name, not the model."), 6000);
    }
  }

  /** Show an element in the corner of the page for some time. */
  notify(element, milliseconds = 9000) {
    document.getElementById("toasts").append(element);
    setTimeout(() => element.remove(), milliseconds);
  }

  fail(error) {
    if (error instanceof ApiError && error.status === 410) {
      forgetSession();
      const reload = h("button", { class: "primary", onclick: () => location.reload() }, "Load the page again");
      render(document.getElementById("view"), h("div", { class: "empty" }, errorMessage(error), reload));
      return;
    }
    console.warn(error);
    this.notify(errorMessage(error), 15000);
  }

  /** Run something asynchronous; its error is shown. */
  run(promise) {
    promise.catch((error) => this.fail(error));
  }

  /** Announce a text to screen readers. */
  announce(text) {
    document.getElementById("spoken").textContent = text;
  }

  emit(event, detail = null) {
    document.dispatchEvent(new CustomEvent(`app:${event}`, { detail }));
  }

  on(event, listener) {
    document.addEventListener(`app:${event}`, (e) => listener(e.detail));
  }
}

/** A view of the app under a tab; each has a static `id` and `label`, and an `element`. */
export class View {
  constructor(app) {
    this.app = app;
  }

  get visible() {
    return this.app.state.view === this.constructor.id;
  }

  /** Refresh the view where it is visible. */
  shown() {
    if (this.visible) this.app.run(this.refresh());
  }
}
