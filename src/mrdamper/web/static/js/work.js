// Long work on the page: a start button, progress that streams, and a way to stop it.

import { h, problem, put, svg } from "./dom.js";
import { seconds } from "./format.js";

/** A progress box. `run(path, body)` starts work and resolves with its answer, or null if it did not end well. */
export function workBox(bench) {
  const bar = svg("rect", { width: "0", height: "100%" });
  const what = h("span", { class: "what" });
  const clock = h("span", {});
  const cancel = h("button", {}, "Cancel");
  const box = h(
    "div", { class: "group", hidden: true },
    h("div", { class: "progress", role: "progressbar", "aria-valuemin": "0", "aria-valuemax": "100", "aria-label": "Progress" }, svg("svg", { "aria-hidden": "true" }, bar)),
    h("div", { class: "progress-text", "aria-live": "polite" }, what, clock),
    h("div", {}, cancel),
  );
  const said = h("div", {});
  const element = h("div", { class: "field" }, box, said);
  let running = null;
  cancel.addEventListener("click", () => running && bench.api.delete(`/jobs/${running}`).catch((error) => bench.fail(error)));

  function tell(report) {
    const share = Math.round(100 * report.share);
    bar.setAttribute("width", `${share}%`);
    box.firstElementChild.setAttribute("aria-valuenow", share);
    what.textContent = report.what;
    clock.textContent = seconds(report.seconds);
  }

  async function run(path, body) {
    put(said);
    box.hidden = false;
    tell({ share: 0, what: "starting", seconds: 0 });
    const began = performance.now();
    const ticking = setInterval(() => (clock.textContent = seconds((performance.now() - began) / 1000)), 200);
    try {
      const job = await bench.api.post(path, body);
      running = job.key;
      const last = await bench.api.follow(job.key, tell);
      if (last.state === "done") return last.answer;
      put(said, last.state === "cancelled" ? h("div", { class: "message" }, "Cancelled. Nothing was changed.") : problem({ said: last.error }));
      return null;
    } catch (error) {
      put(said, problem(error));
      return null;
    } finally {
      clearInterval(ticking);
      running = null;
      box.hidden = true;
    }
  }

  return { element, run };
}
