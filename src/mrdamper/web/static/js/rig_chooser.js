// Which rig of the data is looked at: buttons for a few, a list for many or long names.

import { h } from "./dom.js";

const FEW = 3;
const SHORT = 12; // letters of a name that fit on a button

/** Null where there is nothing to choose. `place` tells the choosers of the views apart. */
export function rigChooser(bench, place) {
  const { rigs } = bench.overview ?? { rigs: [] };
  if (rigs.length < 2) return null;
  const pick = (i) => bench.store.commit({ rig: i, run: null, compareRun: null });
  const text = (rig) => `${rig.name || "without name"} (${rig.runs})`;
  if (rigs.length > FEW || rigs.some((rig) => rig.name.length > SHORT)) {
    const list = h("select", { id: `${place}-rigs`, "aria-label": "Rig", onchange: () => pick(Number(list.value)) }, rigs.map((rig, i) => h("option", { value: String(i), selected: i === bench.state.rig }, text(rig))));
    return list;
  }
  const button = (rig, i) => h("button", { id: `${place}-rig-${i}`, "aria-pressed": String(i === bench.state.rig), onclick: () => pick(i) }, text(rig));
  return h("div", { class: "segmented", role: "group", "aria-label": "Rig" }, rigs.map(button));
}
