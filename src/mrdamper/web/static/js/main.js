// The page: opens or continues its session, builds the views, and has the tools of the header.

import { Address } from "./address.js";
import { ApiError, openSession, storeToken } from "./api.js";
import { App } from "./app.js";
import { library } from "./chart.js";
import { arrowKeys, capitalise, errorMessage, h, note, options, render } from "./dom.js";
import { canCompress } from "./state.js";
import { browserStorage, tabStorage } from "./storage.js";
import { startTheme, themeButton } from "./theme.js";
import { knownUnits, setUnits, UNITS } from "./units.js";
import { CompareView } from "./views/compare.js";
import { DataView } from "./views/data.js";
import { ExportView } from "./views/export.js";
import { IdentifyView } from "./views/identify.js";
import { ModelView } from "./views/model.js";
import { SimulateView } from "./views/simulate.js";

const VIEWS = [DataView, IdentifyView, ModelView, CompareView, SimulateView, ExportView];
const KEEP_ALIVE_MS = 60_000;
const UNITS_KEY = "mrdamper.units";
const NO_LINKS = "This browser cannot write the state into a link. Save the project on the Export page to keep it.";

async function start() {
  startTheme();
  const { api, limits, data } = await openSession();
  const app = new App(api, limits);
  app.store.amend({ units: savedUnits() });
  setUnits(app.state.units);
  const views = VIEWS.map((View) => new View(app));
  const tabs = makeTabs(app);
  const address = new Address(app);
  const updateTools = makeTools(app, address);
  document.querySelector(".skip").addEventListener("click", (event) => {
    event.preventDefault(); // the fragment of the address is the state
    document.getElementById("view").focus();
  });
  app.store.onChange((state, before) => {
    if (state.view !== before.view) show(views, tabs, state.view);
    updateTools();
    if (state.units !== before.units) {
      setUnits(state.units);
      browserStorage.setItem(UNITS_KEY, JSON.stringify(state.units));
      app.emit("units");
    }
    for (const view of views) view.update?.(state, before);
    address.follow();
  });
  if (data) {
    app.overview = await api.get("/data");
    app.store.amend({ source: app.overview.source, dataName: app.overview.name });
    await app.refreshDampers();
    app.emit("data");
  }
  show(views, tabs, app.state.view);
  try {
    const state = await address.initialState();
    if (state) await app.restore(state);
    app.store.clearHistory();
    const jobs = data ? await api.get("/jobs") : []; // of a page that is reloaded
    for (const view of views) view.resume?.(jobs);
  } catch (error) {
    app.fail(error instanceof ApiError ? error : new Error(`The link could not be read: ${error.message}`));
  }
  updateTools();
  if (tabStorage.blocked) app.notify(note("warn", "This browser blocks storage: loading the page again starts a new session. Save the project on the Export page to keep it."), 15000);
  if (!canCompress) app.notify(note("warn", NO_LINKS), 15000);
  document.documentElement.dataset.ready = "yes";
  setInterval(() => app.run(api.get("")), KEEP_ALIVE_MS);
  (window.requestIdleCallback ?? setTimeout)(() => app.run(library()));
}

function makeTabs(app) {
  const tabs = VIEWS.map(({ id, label }) =>
    h("button", { role: "tab", id: `tab-${id}`, "aria-controls": "view", "aria-selected": "false", onclick: () => app.showView(id) }, label));
  arrowKeys(render(document.getElementById("tabs"), tabs), () => tabs, (tab) => {
    tab.focus();
    tab.click();
  });
  return tabs;
}

function show(views, tabs, id) {
  const index = VIEWS.findIndex((View) => View.id === id);
  tabs.forEach((tab, i) => {
    tab.setAttribute("aria-selected", String(i === index));
    tab.tabIndex = i === index ? 0 : -1;
  });
  const panel = render(document.getElementById("view"), views[index].element);
  panel.setAttribute("role", "tabpanel");
  panel.setAttribute("aria-labelledby", `tab-${id}`);
  views[index].shown();
}

/** Fill the right side of the header; returns a function that brings it up to date. */
function makeTools(app, address) {
  const tool = (name, title, onclick, ...content) => h("button", { class: "quiet", title, "aria-label": name, onclick }, ...content);
  const word = (text) => h("span", { class: "word" }, text);
  const undo = tool("Undo", "Undo (Ctrl+Z)", () => app.store.undo(), "↶", word("Undo"));
  const redo = tool("Redo", "Redo (Ctrl+Y)", () => app.store.redo(), "↷", word("Redo"));
  const link = tool(null, "Copy a link to this state", () => app.run(copyLink(app, address)), "Copy link");
  const name = h("span", { class: "data-name" });
  const units = unitChooser(app);
  render(document.getElementById("tools"), name, undo, redo, units.element, link, themeButton());
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches("textarea, input[type=text]")) return;
    const key = event.key.toLowerCase();
    if (key !== "z" && key !== "y") return;
    event.preventDefault();
    if (key === "y" || event.shiftKey) app.store.redo();
    else app.store.undo();
  });
  return () => {
    undo.disabled = !app.store.past.length;
    redo.disabled = !app.store.future.length;
    units.update();
    const text = app.overview?.name ?? "no data";
    if (name.textContent !== text) name.textContent = name.title = text;
  };
}

/** The units stored in this browser. */
function savedUnits() {
  try {
    return knownUnits(JSON.parse(browserStorage.getItem(UNITS_KEY)));
  } catch {
    return knownUnits();
  }
}

/** Lists of the units of quantities on the page. */
function unitChooser(app) {
  const lists = Object.entries(UNITS).map(([name, units]) => {
    const onchange = () => app.store.commit({ units: { ...app.state.units, [name]: list.value } });
    const list = h("select", { id: `units-${name}`, onchange }, options(Object.keys(units).map((unit) => [unit, unit])));
    return [name, list];
  });
  const rows = lists.map(([name, list]) => h("tr", {}, h("th", { scope: "row" }, h("label", { for: list.id }, capitalise(name))), h("td", {}, list)));
  const element = h("details", { class: "units" }, h("summary", {}, "Units"), h("table", {}, h("tbody", {}, rows)));
  element.addEventListener("keydown", (event) => event.key === "Escape" && (element.open = false));
  return { element, update: () => lists.forEach(([name, list]) => (list.value = app.state.units[name])) };
}

async function copyLink(app, address) {
  if (!canCompress) return app.notify(note("warn", NO_LINKS), 5000);
  const link = `${location.origin}/#${await address.fragment()}`;
  try {
    await navigator.clipboard.writeText(link);
    app.notify(note("", "Link copied. It contains the data set's name, the model and all slider values, for an app at the same address."), 5000);
  } catch {
    history.replaceState(null, "", link);
    app.notify(note("", "The link is in the address bar."), 5000);
  }
  return undefined;
}

/** Ask for the token, which no link contains; the state of the link is opened with it. */
function tokenForm() {
  const field = h("input", { type: "password", id: "token", autocomplete: "off", required: true });
  const onsubmit = (event) => {
    event.preventDefault();
    storeToken(field.value);
    location.reload();
  };
  return h("form", { onsubmit }, h("label", { for: field.id }, "Token, or the whole address in the terminal "), field, h("button", {}, "Open"));
}

start().catch((error) => {
  const refused = error.status === 403;
  render(document.getElementById("view"), h("div", { class: "empty" }, errorMessage(error), refused ? tokenForm() : null));
});
