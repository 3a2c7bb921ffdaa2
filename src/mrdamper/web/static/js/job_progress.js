// Long work on the page: a start button, progress that streams, and a way to stop it.

import { h, problem, put, svg } from "./dom.js";
import { seconds } from "./format.js";

/** A progress box, out of sight until there is something to show. */
export function workBox(bench) {
  const bar = svg("rect", { width: "0", height: "100%" });
  const what = h("span", { class: "what" });
  const clock = h("span", {});
  const cancel = h("button", { disabled: true }, "Cancel");
  const box = h(
    "div", { class: "group", hidden: true },
    h("div", { class: "progress", role: "progressbar", "aria-valuemin": "0", "aria-valuemax": "100", "aria-label": "Progress" }, svg("svg", { "aria-hidden": "true" }, bar)),
    h("div", { class: "progress-text" }, what, clock),
    h("div", {}, cancel),
  );
  const said = h("div", { role: "status" });
  const element = h("div", { class: "field", hidden: true }, box, said);
  let [running, quarter, done] = [null, 0, 0];
  cancel.addEventListener("click", () => bench.api.delete(`/jobs/${running}`).catch((error) => bench.fail(error)));

  function tell(report) {
    const share = Math.round(100 * report.share);
    bar.setAttribute("width", `${share}%`);
    box.firstElementChild.setAttribute("aria-valuenow", share);
    box.firstElementChild.classList.toggle("waiting", share === 0);
    if (Math.floor(share / 25) > quarter) bench.speak(`${share} per cent`); // now and then, not at every report
    quarter = Math.floor(share / 25);
    what.textContent = report.what;
    done = report.share;
    tick(report.seconds);
  }

  /** The time it took, and what it will take if it goes on as before. */
  function tick(took) {
    const left = took < 2 || done <= 0.02 || done >= 1 ? "" : `, about ${seconds(Math.round((took * (1 - done)) / done))} left`;
    clock.textContent = seconds(took) + left;
  }

  /** Begin work; its answer, or null if it did not end well. */
  const run = (path, body) => attend(() => bench.api.post(path, body));

  /** Go on watching work a page began that was loaded again since. */
  const resume = (job) => attend(() => job);

  /** Say nothing more of the work that ended. */
  function clear() {
    put(said);
    element.hidden = box.hidden;
  }

  async function attend(begin) {
    put(said);
    const opener = document.activeElement;
    element.hidden = box.hidden = false;
    bench.speak("Working");
    tell({ share: 0, what: "starting a worker", seconds: 0 });
    let began = performance.now();
    const ticking = setInterval(() => tick((performance.now() - began) / 1000), 200);
    try {
      const job = await begin();
      began -= 1000 * job.seconds;
      running = job.key;
      cancel.disabled = false;
      const last = await bench.api.follow(job.key, tell);
      bench.speak(last.state === "done" ? "Done" : "");
      if (last.state === "done") return last.answer;
      put(said, last.state === "cancelled" ? h("div", { class: "message" }, "Cancelled. Nothing was changed.") : problem({ said: last.error }));
      return null;
    } catch (error) {
      put(said, problem(error));
      return null;
    } finally {
      clearInterval(ticking);
      running = null;
      cancel.disabled = true;
      const inside = box.contains(document.activeElement) || document.activeElement === document.body;
      if (inside && opener) setTimeout(() => opener.isConnected && opener.focus()); // once it can be pressed again
      box.hidden = true;
      element.hidden = !said.childElementCount;
    }
  }

  return {
    element, run, resume, clear,
    get busy() {
      return !box.hidden;
    },
  };
}
