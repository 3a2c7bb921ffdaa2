// Export: report, tables and models as files, and the state of the bench itself.

import { capital, card, h, note, problem, put, renew } from "../dom.js";
import { save } from "../files.js";
import { bytes, condition, figures } from "../format.js";
import { portable } from "../state.js";
import { AboutForm } from "../about_form.js";
import { workBox } from "../job_progress.js";

export const id = "takeaway";
export const label = "Export";

const MM = 1000;

export function create(bench) {
  return new TakeAwayView(bench);
}

class TakeAwayView {
  constructor(bench) {
    this.bench = bench;
    this.studying = workBox(bench);
    this.exporting = workBox(bench);
    this.report = h("div", { class: "body" });
    this.model = h("div", { class: "body" });
    this.said = h("div", { role: "status" });
    this.about = new AboutForm(bench);
    this.element = h("div", { class: "stage" }, h("div", { class: "cards" },
      card("Report and tables", this.about.element, this.report), card("Model", this.model), card("Project", this.stateBody())));
    for (const what of ["dampers", "data", "units"]) document.addEventListener(`bench:${what}`, () => this.shown());
  }

  shown() {
    if (this.bench.state.view === id) this.safely(this.refresh());
  }

  update(state, before) {
    if (["damper", "held", "condition"].some((name) => state[name] !== before[name])) this.shown();
  }

  safely(promise) {
    promise.catch((error) => this.bench.fail(error));
  }

  async refresh() {
    await Promise.all([this.showReport(), this.showModel()]);
  }

  async showReport() {
    if (!this.bench.overview) {
      put(this.report, h("p", { class: "faint" }, "No data on the bench: open some on the Data page."));
      return;
    }
    const files = await this.bench.api.get("/files");
    const button = h("button", { id: "make-report", class: files.length ? "" : "primary", disabled: this.studying.busy, onclick: () => this.safely(this.study(button)) }, files.length ? "Recalculate" : "Create the report");
    renew(this.report, files.length
      ? this.fileList(files)
      : h("p", {}, "Study of the open data: report.html (self-contained), report.pdf, the models, and the tables as CSV."),
    h("div", {}, button), this.studying.element);
  }

  fileList(files) {
    const { api } = this.bench;
    const row = (f) => h("li", {}, h("a", { href: api.url(`/files/${f.number}`), download: f.name }, f.name), h("span", { class: "faint" }, bytes(f.bytes)));
    const [main, pictures] = [false, true].map((wanted) => files.filter((f) => f.folder === wanted).map(row));
    return [
      h("a", { class: "button", href: api.url("/files.zip"), download: "mrdamper-study.zip" }, "Everything as one zip"),
      h("ul", { class: "filelist" }, main),
      h("details", {}, h("summary", {}, `${pictures.length} figures`), h("ul", { class: "filelist" }, pictures)),
    ];
  }

  async study(button) {
    button.disabled = true;
    const running = (await this.bench.api.get("/jobs")).find((job) => job.kind === "study" && ["waiting", "running"].includes(job.state));
    const answer = await this.bench.study(running ? this.studying.resume(running) : this.studying.run("/study", this.bench.head));
    button.disabled = false;
    if (answer) await this.bench.refreshDampers();
  }

  async showModel() {
    const { bench } = this;
    const { held, damper, condition: c } = bench.state;
    if (!bench.dampers.length) {
      put(this.model, h("p", { class: "faint" }, "No damper on the bench: identify one, or drop a model.json on the Data page."));
      return;
    }
    const exports = await bench.api.get("/exports");
    this.chooser = h("select", { id: "take-damper", onchange: () => bench.choose(this.chooser.value) }, bench.damperOptions());
    this.chooser.value = damper ?? bench.preferred();
    const names = Object.entries(held).map(([name, value]) => `${name} = ${figures(value)}`);
    const action = (title, work, kind = "") => h("button", { class: kind, onclick: () => this.trying(work) }, title);
    renew(this.model,
      h("div", { class: "field" }, h("label", { for: "take-damper" }, "Damper"), this.chooser),
      names.length ? note("", `Fixed by hand: ${names.join(", ")}.`) : null,
      h("div", { class: "row" }, action("model.json", () => this.document(), "primary"), action("Loop as CSV", () => this.csv())),
      h("p", { class: "small faint" }, c ? `The loop is calculated at ${condition({ ...c, amplitude_mm: MM * c.amplitude_m })}.` : "The loop is calculated at the initial condition of the Model page."),
      exports.length ? h("div", { class: "forms", role: "group", "aria-label": "Export" }, exports.map((e) => action(capital(e.title), () => this.export(e), "quiet"))) : null,
      this.exporting.element, this.said);
  }

  async trying(work) {
    put(this.said);
    try {
      await work();
    } catch (error) {
      put(this.said, problem(error));
    }
  }

  async document() {
    const { text } = await this.bench.api.post(`/dampers/${this.chooser.value}/document`, { held: this.bench.state.held });
    save(new Blob([text], { type: "application/json" }), "model.json");
  }

  async csv() {
    const key = this.chooser.value;
    const at = this.bench.state.condition ?? (await this.bench.api.get(`/dampers/${key}`)).start;
    const { blob, name } = await this.bench.api.file(`/dampers/${key}/csv`, { ...at, held: this.bench.state.held, units: this.bench.state.units });
    save(blob, name);
  }

  async export(form) {
    const answer = await this.exporting.run(`/dampers/${this.chooser.value}/export/${form.name}`, { held: this.bench.state.held });
    if (!answer) return;
    const link = h("a", { href: this.bench.api.url(`/exported/${answer.exported}`), download: "" }, "Save it again");
    link.click();
    put(this.said, h("p", { class: "small faint" }, `${form.title} saved. `, answer.notes.map((n) => `${n}. `), link, "."));
  }

  stateBody() {
    const shown = async () => {
      await this.bench.keepDocument();
      return JSON.stringify({ ...portable(this.bench.state), view: this.bench.state.document ? "model" : "data" }, null, 1);
    };
    const keepState = async () => save(new Blob([await shown()], { type: "application/json" }), "bench-state.json");
    const keepAll = async () => {
      const { blob, name } = await this.bench.api.file("/bench.zip", { state: await shown(), damper: this.bench.state.damper, logo: this.bench.logo });
      save(blob, name);
    };
    return h("div", { class: "body" },
      h("p", {}, "A saved project contains the data, all dampers, all slider values and the logo in one file; drop it on the page to open it. A state file contains the view without the data."),
      h("div", { class: "row" },
        h("button", { class: "primary", onclick: () => this.safely(keepAll()) }, "Save the project"),
        h("button", { onclick: () => this.safely(keepState()) }, "Save the state")),
      h("p", { class: "small faint" }, "“Copy link” in the header has the same content as a state file. All data stay on this computer; the temporary files are removed when the app stops."));
  }
}
