// Choice of a rig of the data: buttons for a few short names, else a list.

import { h, options } from "./dom.js";

const MAX_BUTTONS = 3;
const MAX_LETTERS = 12; // of a name on a button

/** The chooser; null where there is one rig. `view` distinguishes the choosers of the views. */
export function rigChooser(app, view) {
  const { rigs } = app.overview ?? { rigs: [] };
  if (rigs.length < 2) return null;
  const pick = (i) => app.store.commit({ rig: i, run: null, compareRun: null });
  const text = (rig) => `${rig.name || "without name"} (${rig.runs})`;
  if (rigs.length > MAX_BUTTONS || rigs.some((rig) => rig.name.length > MAX_LETTERS)) {
    const list = h("select", { id: `${view}-rigs`, "aria-label": "Rig", onchange: () => pick(list.selectedIndex) }, options(rigs.map((rig, i) => [String(i), text(rig)])));
    list.selectedIndex = app.state.rig;
    return list;
  }
  const button = (rig, i) => h("button", { id: `${view}-rig-${i}`, "aria-pressed": String(i === app.state.rig), onclick: () => pick(i) }, text(rig));
  return h("div", { class: "segmented", role: "group", "aria-label": "Rig" }, rigs.map(button));
}
