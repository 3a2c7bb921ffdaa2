// Progress of a job on the page: a bar, the time it took and may take, and a button to cancel it.

import { errorMessage, h, note, render, svg } from "./dom.js";
import { seconds } from "./format.js";

/** Progress of one job at a time; hidden until there is something to show. */
export class JobProgress {
  constructor(app) {
    this.app = app;
    this.rect = svg("rect", { width: "0", height: "100%" });
    this.bar = h("div", { class: "progress", role: "progressbar", "aria-valuemin": "0", "aria-valuemax": "100", "aria-label": "Progress" }, svg("svg", { "aria-hidden": "true" }, this.rect));
    this.step = h("span", { class: "step" });
    this.clock = h("span", {});
    this.cancel = h("button", { disabled: true, onclick: () => app.run(app.api.delete(`/jobs/${this.job}`)) }, "Cancel");
    this.box = h("div", { class: "group", hidden: true }, this.bar, h("div", { class: "progress-text" }, this.step, this.clock), h("div", {}, this.cancel));
    this.message = h("div", { role: "status" });
    this.element = h("div", { class: "field", hidden: true }, this.box, this.message);
    this.quarter = 0;
  }

  get busy() {
    return !this.box.hidden;
  }

  /** Start a job; resolves to its result, or to null where it did not end well or other data were loaded meanwhile. */
  start(path, body) {
    return this.follow(() => this.app.api.post(path, body));
  }

  /** Follow a job that was started before the page was reloaded. */
  resume(job) {
    return this.follow(() => job);
  }

  report({ share, step, seconds: elapsed }) {
    const percent = Math.round(100 * share);
    this.rect.setAttribute("width", `${percent}%`);
    this.bar.setAttribute("aria-valuenow", percent);
    this.bar.classList.toggle("waiting", percent === 0);
    if (Math.floor(percent / 25) > this.quarter) this.app.announce(`${percent} per cent`); // not at every report
    this.quarter = Math.floor(percent / 25);
    this.step.textContent = step;
    this.share = share;
    this.showTime(elapsed);
  }

  /** Show the elapsed time, and the time left at the same speed. */
  showTime(elapsed) {
    const { share } = this;
    const left = elapsed < 2 || share <= 0.02 || share >= 1 ? "" : `, about ${seconds(Math.round((elapsed * (1 - share)) / share))} left`;
    this.clock.textContent = seconds(elapsed) + left;
  }

  async follow(begin) {
    const { app, box } = this;
    const { overview } = app;
    render(this.message);
    const opener = document.activeElement;
    this.element.hidden = box.hidden = false;
    app.announce("Working");
    this.report({ share: 0, step: "starting a worker", seconds: 0 });
    let began = performance.now();
    const timer = setInterval(() => this.showTime((performance.now() - began) / 1000), 200);
    try {
      const job = await begin();
      began -= 1000 * job.seconds;
      this.job = job.key;
      this.cancel.disabled = false;
      const last = await app.api.follow(job.key, (report) => this.report(report));
      app.announce(last.state === "done" ? "Done" : "");
      if (overview !== app.overview) return null;
      if (last.state === "done") return last.result;
      render(this.message, last.state === "cancelled" ? note("", "Cancelled. Nothing was changed.") : errorMessage({ details: last.error }));
    } catch (error) {
      if (overview === app.overview) render(this.message, errorMessage(error));
    } finally {
      clearInterval(timer);
      this.cancel.disabled = true;
      const inside = box.contains(document.activeElement) || document.activeElement === document.body;
      if (inside && opener) setTimeout(() => opener.isConnected && opener.focus()); // once it is enabled again
      box.hidden = true;
      this.element.hidden = !this.message.childElementCount;
    }
    return null;
  }
}
