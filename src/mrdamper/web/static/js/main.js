// The page: opens or finds its session, builds the views, keeps link, undo and theme.

import { Api, BenchError } from "./api.js";
import { h, note, problem, put } from "./dom.js";
import { Store, fromFragment, toFragment } from "./state.js";
import { library } from "./chart.js";
import { theme } from "./theme.js";
import * as data from "./views/data.js";
import * as identify from "./views/identify.js";
import * as model from "./views/model.js";
import * as compare from "./views/compare.js";
import * as takeaway from "./views/takeaway.js";

const VIEWS = [data, identify, model, compare, takeaway];
const SESSION = "mrdamper.session";
const LAST = "mrdamper.last"; // link and damper of this page, for loading it again
const BEAT = 60_000;

/** What the views share. */
class Bench {
  constructor(api, limits) {
    this.api = api;
    this.limits = limits;
    this.store = new Store();
    this.overview = null; // of the data on the bench
    this.dampers = [];
    this.tables = new Map(); // rig number to its runs and matrix
    this.loops = new Map(); // measured loops and verdicts, fetched once
  }

  get state() {
    return this.store.state;
  }

  /** Data changed on the bench. */
  async takeData(overview, change = {}) {
    this.overview = overview;
    this.tables.clear();
    this.loops.clear();
    this.announce("data");
    this.store.settle({ source: overview.source, dataName: overview.name, rig: 0, run: null, compareRun: null, ...change });
    this.store.forget();
  }

  async rigTable(number = this.state.rig) {
    if (!this.overview) return null;
    if (!this.tables.has(number)) this.tables.set(number, this.api.get(`/data/rigs/${number}`));
    return this.tables.get(number);
  }

  /** The verdict on every run of the rig shown. */
  quality(rig = this.state.rig) {
    const path = `/data/rigs/${rig}/quality`;
    if (!this.loops.has(path)) this.loops.set(path, this.api.get(path));
    return this.loops.get(path);
  }

  /** A measured loop of the rig shown. */
  loop(key, part = "cycle", rig = this.state.rig) {
    const path = `/data/rigs/${rig}/runs/${key}/${part}`;
    if (!this.loops.has(path)) this.loops.set(path, this.api.frame(path));
    return this.loops.get(path);
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
      await this.takeData(await this.api.post("/bundled"));
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

  /** Say something for a while. */
  say(element, milliseconds = 9000) {
    const box = document.getElementById("toasts");
    box.append(element);
    setTimeout(() => element.remove(), milliseconds);
  }

  fail(error) {
    if (error instanceof BenchError && error.status === 410) {
      sessionStorage.removeItem(SESSION);
      put(document.getElementById("view"), h("div", { class: "empty" }, problem(error), h("button", { class: "primary", onclick: () => location.reload() }, "Load the page again")));
      return;
    }
    console.warn(error);
    this.say(problem(error), 15000);
  }

  announce(what) {
    document.dispatchEvent(new CustomEvent(`bench:${what}`));
  }
}

async function openSession() {
  const known = sessionStorage.getItem(SESSION);
  if (known) {
    const { session, limits } = JSON.parse(known);
    const api = new Api(session);
    try {
      const there = await api.get("");
      return { api, limits, there };
    } catch {
      sessionStorage.removeItem(SESSION);
    }
  }
  const opened = await Api.open();
  sessionStorage.setItem(SESSION, JSON.stringify({ session: opened.session, limits: opened.limits }));
  return { api: new Api(opened.session), limits: opened.limits, there: { data: null, dampers: 0 } };
}

async function start() {
  theme();
  const { api, limits, there } = await openSession();
  const bench = new Bench(api, limits);
  const views = VIEWS.map((v) => Object.assign(v.create(bench), { id: v.id, label: v.label }));
  const tabs = makeTabs(bench, views);
  const tools = makeTools(bench);
  bench.store.onChange((state, before) => {
    if (state.view !== before.view) show(views, tabs, state.view);
    tools.update();
    for (const view of views) view.update?.(state, before);
    remember(bench);
  });
  if (there.data) {
    bench.overview = await api.get("/data");
    bench.store.settle({ source: bench.overview.source, dataName: bench.overview.name });
    await bench.refreshDampers();
    bench.announce("data");
  }
  show(views, tabs, bench.state.view);
  try {
    const linked = await fromFragment(location.hash);
    const last = JSON.parse(sessionStorage.getItem(LAST) ?? "null");
    if (linked && last?.hash === location.hash) linked.damper = last.damper; // the same page again: its dampers are there
    if (linked) await bench.restore(linked);
    bench.store.forget(); // there is nothing before it to go back to
  } catch (error) {
    bench.fail(error instanceof BenchError ? error : new Error(`The link could not be read: ${error.message}`));
  }
  tools.update();
  document.documentElement.dataset.ready = "yes";
  setInterval(() => api.get("").catch((error) => bench.fail(error)), BEAT);
  requestIdleCallback(() => library().catch((error) => bench.fail(error)));
}

function makeTabs(bench, views) {
  const buttons = views.map((view) =>
    h("button", { role: "tab", id: `tab-${view.id}`, "aria-controls": "view", "aria-selected": "false", onclick: () => bench.store.pass({ view: view.id }) }, view.label),
  );
  const bar = put(document.getElementById("tabs"), buttons);
  bar.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const next = buttons[(buttons.indexOf(document.activeElement) + step + buttons.length) % buttons.length];
    next.focus();
    next.click();
  });
  return buttons;
}

function show(views, tabs, id) {
  const at = views.findIndex((view) => view.id === id);
  tabs.forEach((tab, i) => {
    tab.setAttribute("aria-selected", String(i === at));
    tab.tabIndex = i === at ? 0 : -1;
  });
  const main = put(document.getElementById("view"), views[at].element);
  main.setAttribute("role", "tabpanel");
  main.setAttribute("aria-labelledby", `tab-${id}`);
  views[at].shown?.();
}

function makeTools(bench) {
  const undo = h("button", { class: "quiet", title: "Undo (Ctrl+Z)", "aria-label": "Undo", onclick: () => bench.store.undo() }, "↶ Undo");
  const redo = h("button", { class: "quiet", title: "Redo (Ctrl+Y)", "aria-label": "Redo", onclick: () => bench.store.redo() }, "↷ Redo");
  const link = h("button", { class: "quiet", title: "Copy a link that brings this state back", onclick: () => copyLink(bench) }, "Copy link");
  const name = h("span", { class: "data-name" });
  put(document.getElementById("tools"), name, undo, redo, link, theme.button());
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches("textarea, input[type=text]")) return;
    const key = event.key.toLowerCase();
    if (key === "z" || key === "y") {
      event.preventDefault();
      key === "y" || event.shiftKey ? bench.store.redo() : bench.store.undo();
    }
  });
  return {
    update() {
      undo.disabled = !bench.store.past.length;
      redo.disabled = !bench.store.future.length;
      const text = bench.overview ? bench.overview.name : "no data yet";
      if (name.textContent !== text) name.textContent = name.title = text;
    },
  };
}

async function copyLink(bench) {
  const address = `${location.origin}/#${await toFragment(bench.state)}`;
  try {
    await navigator.clipboard.writeText(address);
    bench.say(note("", "Link copied. It brings back data, model and sliders on a bench at the same address."), 5000);
  } catch {
    history.replaceState(null, "", address);
    bench.say(note("", "The link is in the address bar now."), 5000);
  }
}

let remembering = 0;
function remember(bench) {
  clearTimeout(remembering);
  remembering = setTimeout(async () => {
    const hash = `#${await toFragment(bench.state)}`;
    history.replaceState(null, "", hash);
    sessionStorage.setItem(LAST, JSON.stringify({ hash, damper: bench.state.damper }));
  }, 400);
}

start().catch((error) => put(document.getElementById("view"), h("div", { class: "empty" }, problem(error))));
