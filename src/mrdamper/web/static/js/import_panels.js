// Results of an import, file by file, and the profile the files were read with.

import { finding, h } from "./dom.js";
import { count } from "./format.js";

/** The verdict on every file; files that were taken without findings are folded. */
export function fileList(overview) {
  if (!overview?.verdicts.length) return null;
  const [taken, others] = [true, false].map((wanted) => overview.verdicts.filter((v) => (v.state === "taken") === wanted));
  return h("div", { class: "group" }, h("h2", {}, "Files"), byFinding(others),
    taken.length ? folded(`${count(taken.length, "file")} taken`, taken, !others.length && taken.length <= 12) : null);
}

/** The profile as text to correct. */
export function profilePanel(overview, zone) {
  if (!overview?.profile) return null;
  const { profile, verdicts } = overview;
  const refused = verdicts.filter((v) => v.state === "refused").length;
  const text = h("textarea", { "aria-label": "Rig profile, TOML", spellcheck: "false", rows: String(Math.min(30, profile.split("\n").length + 1)) }, profile);
  const button = (label, refusedOnly) => h("button", { onclick: () => zone.load(() => zone.read(text.value, refusedOnly)) }, label);
  return h("details", { class: "group" }, h("summary", {}, "Rig profile as text"),
    h("div", { class: "group" },
      h("p", { class: "small faint" }, "As guessed or last given. Correct it and read the files again."), text,
      h("div", { class: "row" },
        refused > 0 && refused < verdicts.length ? button(refused === 1 ? "Read the refused file" : `Read the ${refused} refused`, true) : null,
        button(verdicts.length === 1 ? "Read again" : "Read all again", false))));
}

/** List the refused files; a finding that several files have is stated once, with their names folded. */
function byFinding(verdicts) {
  const groups = new Map();
  for (const verdict of verdicts) {
    const key = verdict.state === "refused" ? verdict.name : JSON.stringify(verdict.findings);
    groups.set(key, [...(groups.get(key) ?? []), verdict]);
  }
  return [...groups.values()].map((same) =>
    same.length === 1 ? message(same[0]) : message({ ...same[0], name: count(same.length, "file") }, folded("Names", same, false)));
}

function message(verdict, names = null) {
  const kind = verdict.state === "refused" ? "bad" : "warn";
  return h("div", { class: `message ${kind}` },
    h("div", { class: "row" }, h("b", {}, verdict.name), h("span", { class: `badge ${kind}` }, verdict.state)),
    verdict.findings.map(([code, text]) => finding(code, text)), names);
}

function folded(summary, verdicts, open) {
  return h("details", { open }, h("summary", {}, summary), h("ul", { class: "names" }, verdicts.map((v) => h("li", {}, v.name))));
}
