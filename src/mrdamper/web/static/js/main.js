// The page: opens or finds its session, builds the views, keeps link, undo and theme.

import { Address } from "./address.js";
import { BenchError } from "./api.js";
import { Bench } from "./app.js";
import { library } from "./chart.js";
import { capital, h, note, problem, put } from "./dom.js";
import { openSession } from "./session.js";
import { packs } from "./state.js";
import { browserStorage, tabStorage } from "./storage.js";
import { theme } from "./theme.js";
import { knownUnits, setUnits, UNITS } from "./units.js";
import * as data from "./views/data.js";
import * as identify from "./views/identify.js";
import * as model from "./views/model.js";
import * as compare from "./views/compare.js";
import * as ride from "./views/simulate.js";
import * as takeaway from "./views/export.js";

const VIEWS = [data, identify, model, compare, ride, takeaway];
const BEAT = 60_000;
const UNITS_KEY = "mrdamper.units";

async function start() {
  theme();
  const { api, limits, there } = await openSession();
  const bench = new Bench(api, limits);
  bench.store.settle({ units: savedUnits() });
  setUnits(bench.state.units);
  const views = VIEWS.map((v) => Object.assign(v.create(bench), { id: v.id, label: v.label }));
  const tabs = makeTabs(bench, views);
  const address = new Address(bench);
  const tools = makeTools(bench, address);
  document.querySelector(".skip").addEventListener("click", (event) => {
    event.preventDefault(); // the address holds the state
    document.getElementById("view").focus();
  });
  bench.store.onChange((state, before) => {
    if (state.view !== before.view) show(views, tabs, state.view);
    tools.update();
    if (state.units !== before.units) {
      setUnits(state.units);
      browserStorage.setItem(UNITS_KEY, JSON.stringify(state.units));
      bench.announce("units");
    }
    for (const view of views) view.update?.(state, before);
    address.follow();
  });
  if (there.data) {
    bench.overview = await api.get("/data");
    bench.store.settle({ source: bench.overview.source, dataName: bench.overview.name });
    await bench.refreshDampers();
    bench.announce("data");
  }
  show(views, tabs, bench.state.view);
  try {
    const linked = await address.found();
    if (linked) await bench.restore(linked);
    bench.store.forget(); // there is nothing before it to go back to
    const jobs = there.data ? await api.get("/jobs") : []; // of a page that is loaded again
    for (const view of views) view.resume?.(jobs);
  } catch (error) {
    bench.fail(error instanceof BenchError ? error : new Error(`The link could not be read: ${error.message}`));
  }
  tools.update();
  if (tabStorage.blocked) bench.say(note("warn", "This browser blocks storage: loading the page again starts a new session. Save the project on the Export page to keep it."), 15000);
  if (!packs) bench.say(note("warn", NO_LINKS), 15000);
  document.documentElement.dataset.ready = "yes";
  setInterval(() => api.get("").catch((error) => bench.fail(error)), BEAT);
  (window.requestIdleCallback ?? setTimeout)(() => library().catch((error) => bench.fail(error)));
}

function makeTabs(bench, views) {
  const buttons = views.map((view) =>
    h("button", { role: "tab", id: `tab-${view.id}`, "aria-controls": "view", "aria-selected": "false", onclick: () => bench.store.pass({ view: view.id }) }, view.label),
  );
  const bar = put(document.getElementById("tabs"), buttons);
  bar.addEventListener("keydown", (event) => {
    const at = buttons.indexOf(document.activeElement);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: buttons.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    const next = buttons[(to + buttons.length) % buttons.length];
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
  const panel = put(document.getElementById("view"), views[at].element);
  panel.setAttribute("role", "tabpanel");
  panel.setAttribute("aria-labelledby", `tab-${id}`);
  views[at].shown?.();
}

function makeTools(bench, address) {
  const undo = h("button", { class: "quiet", title: "Undo (Ctrl+Z)", "aria-label": "Undo", onclick: () => bench.store.undo() }, "↶", h("span", { class: "word" }, "Undo"));
  const redo = h("button", { class: "quiet", title: "Redo (Ctrl+Y)", "aria-label": "Redo", onclick: () => bench.store.redo() }, "↷", h("span", { class: "word" }, "Redo"));
  const link = h("button", { class: "quiet", title: "Copy a link that brings this state back", onclick: () => copyLink(bench, address) }, "Copy link");
  const name = h("span", { class: "data-name" });
  const units = unitChooser(bench);
  put(document.getElementById("tools"), name, undo, redo, units.element, link, theme.button());
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
      units.update();
      const text = bench.overview ? bench.overview.name : "no data yet";
      if (name.textContent !== text) name.textContent = name.title = text;
    },
  };
}

/** The units chosen in this browser before. */
function savedUnits() {
  try {
    return knownUnits(JSON.parse(browserStorage.getItem(UNITS_KEY)));
  } catch {
    return knownUnits();
  }
}

/** The table of the units in which the page shows quantities. */
function unitChooser(bench) {
  const lists = Object.entries(UNITS).map(([name, units]) => {
    const change = () => bench.store.commit({ units: { ...bench.state.units, [name]: list.value } });
    const list = h("select", { id: `units-${name}`, onchange: change }, Object.keys(units).map((unit) => h("option", { value: unit }, unit)));
    return [name, list];
  });
  const rows = lists.map(([name, list]) => h("tr", {}, h("th", { scope: "row" }, h("label", { for: list.id }, capital(name))), h("td", {}, list)));
  const element = h("details", { class: "units" }, h("summary", {}, "Units"), h("table", {}, h("tbody", {}, rows)));
  element.addEventListener("keydown", (event) => event.key === "Escape" && (element.open = false));
  return { element, update: () => lists.forEach(([name, list]) => (list.value = bench.state.units[name])) };
}

const NO_LINKS = "This browser cannot pack the state into a link. Save the project on the Export page to keep it.";

async function copyLink(bench, kept) {
  if (!packs) return bench.say(note("warn", NO_LINKS), 5000);
  const address = `${location.origin}/#${await kept.fragment()}`;
  try {
    await navigator.clipboard.writeText(address);
    bench.say(note("", "Link copied. It brings back data, model and sliders on a bench at the same address."), 5000);
  } catch {
    history.replaceState(null, "", address);
    bench.say(note("", "The link is in the address bar now."), 5000);
  }
}

start().catch((error) => put(document.getElementById("view"), h("div", { class: "empty" }, problem(error))));
