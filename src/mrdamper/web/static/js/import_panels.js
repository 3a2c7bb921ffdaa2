// What became of dropped files, and the profile they were read with.

import { capital, h } from "./dom.js";
import { count } from "./format.js";

/** What was said of every dropped file; those that were simply taken stand folded. */
export function fileList(found) {
  if (!found?.verdicts.length) return null;
  const [taken, others] = [true, false].map((wanted) => found.verdicts.filter((v) => (v.state === "taken") === wanted));
  return h("div", { class: "group" }, h("h2", {}, "Files"), byFinding(others), taken.length ? folded(taken, !others.length) : null);
}

/** The profile, to be corrected; open where a file was refused. */
export function profilePanel(found, drop) {
  if (!found?.profile) return null;
  const refused = found.verdicts.filter((v) => v.state === "refused").length;
  const text = h("textarea", { "aria-label": "Rig profile, TOML", spellcheck: "false", rows: String(Math.min(30, found.profile.split("\n").length + 1)) });
  text.value = found.profile;
  const some = refused > 0 && refused < found.verdicts.length;
  return h("details", { class: "group" }, h("summary", {}, "Rig profile as text"),
    h("div", { class: "group" },
      h("p", { class: "small faint" }, "As guessed or last given. Correct it and read the files again."), text,
      h("div", { class: "row" },
        some ? h("button", { onclick: () => drop.readAgain(text.value, true) }, refused === 1 ? "Read the refused file" : `Read the ${refused} refused`) : null,
        h("button", { onclick: () => drop.readAgain(text.value) }, found.verdicts.length === 1 ? "Read again" : "Read all again"))));
}

/** Refused files one by one; the same note on several files once, with their names folded. */
function byFinding(verdicts) {
  const groups = new Map();
  for (const verdict of verdicts) {
    const key = verdict.state === "refused" ? verdict.name : JSON.stringify(verdict.findings);
    groups.set(key, [...(groups.get(key) ?? []), verdict]);
  }
  return [...groups.values()].map((same) => {
    if (same.length === 1) return said(same[0]);
    const names = h("details", {}, h("summary", {}, "Names"), h("ul", { class: "names" }, same.map((v) => h("li", {}, v.name))));
    return said({ ...same[0], name: count(same.length, "file") }, names);
  });
}

function said(verdict, names = null) {
  const refused = verdict.state === "refused";
  return h("div", { class: `message ${refused ? "bad" : "warn"}` },
    h("div", { class: "row" }, h("b", {}, verdict.name), h("span", { class: `badge ${refused ? "bad" : "warn"}` }, verdict.state)),
    verdict.findings.map(([code, text]) => h("div", {}, capital(text), " ", h("code", {}, code))), names);
}

function folded(verdicts, open) {
  return h("details", { open: open && verdicts.length <= 12 }, h("summary", {}, `${count(verdicts.length, "file")} taken`),
    h("ul", { class: "names" }, verdicts.map((v) => h("li", {}, v.name))));
}
