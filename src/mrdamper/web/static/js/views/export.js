// The Export view: report, tables and models as files, and the project.

import { AboutForm } from "../about_form.js";
import { View } from "../app.js";
import { capitalise, card, errorMessage, field, h, note, render } from "../dom.js";
import { save } from "../files.js";
import { bytes, condition, figures } from "../format.js";
import { JobProgress } from "../job_progress.js";
import { savedState } from "../state.js";

const MM = 1000;
const json = (text) => new Blob([text], { type: "application/json" });

export class ExportView extends View {
  static id = "export";
  static label = "Export";

  constructor(app) {
    super(app);
    this.studying = new JobProgress(app);
    this.exporting = new JobProgress(app);
    this.report = h("div", { class: "body" });
    this.model = h("div", { class: "body" });
    this.message = h("div", { role: "status" });
    this.chooser = h("select", { id: "export-damper", onchange: () => app.selectDamper(this.chooser.value) });
    this.element = h("div", { class: "stage" }, h("div", { class: "cards" },
      card("Report and tables", new AboutForm(app).element, this.report), card("Model", this.model), card("Project", this.project())));
    for (const event of ["dampers", "data", "units"]) app.on(event, () => this.shown());
  }

  update(state, before) {
    if (["damper", "held", "condition"].some((name) => state[name] !== before[name])) this.shown();
  }

  async refresh() {
    await Promise.all([this.showReport(), this.showModel()]);
  }

  async showReport() {
    if (!this.app.overview) {
      render(this.report, h("p", { class: "faint" }, "No data: open some on the Data page."));
      return;
    }
    const files = await this.app.api.get("/files");
    const button = h("button", { id: "make-report", class: files.length ? "" : "primary", disabled: this.studying.busy, onclick: () => this.app.run(this.study(button)) }, files.length ? "Recalculate" : "Create the report");
    render(this.report, files.length
      ? this.fileList(files)
      : h("p", {}, "Study of the loaded data: report.html (self-contained), report.pdf, the models, and the tables as CSV."),
    h("div", {}, button), this.studying.element);
  }

  fileList(files) {
    const { api } = this.app;
    const row = (f) => h("li", {}, h("a", { href: api.url(`/files/${f.number}`), download: f.name }, f.name), h("span", { class: "faint" }, bytes(f.bytes)));
    const [main, figureFiles] = [false, true].map((figure) => files.filter((f) => f.figure === figure).map(row));
    return [
      h("a", { class: "button", href: api.url("/files.zip"), download: "mrdamper-study.zip" }, "Everything as one zip"),
      h("ul", { class: "filelist" }, main),
      h("details", {}, h("summary", {}, `${figureFiles.length} figures`), h("ul", { class: "filelist" }, figureFiles)),
    ];
  }

  async study(button) {
    button.disabled = true;
    const running = (await this.app.api.get("/jobs")).find((job) => job.kind === "study" && ["waiting", "running"].includes(job.state));
    const result = await this.app.duringStudy(running ? this.studying.resume(running) : this.studying.start("/study", this.app.reportHead));
    button.disabled = false;
    if (result) await this.app.refreshDampers();
  }

  async showModel() {
    const { app, chooser } = this;
    const { held, damper, condition: c } = app.state;
    if (!app.dampers.length) {
      render(this.model, h("p", { class: "faint" }, "No damper: identify one, or drop a model.json on the Data page."));
      return;
    }
    const formats = await app.api.get("/exports");
    render(chooser, app.damperOptions());
    chooser.value = damper ?? app.defaultDamper();
    const names = Object.entries(held).map(([name, value]) => `${name} = ${figures(value)}`);
    const action = (title, work, kind = "") => h("button", { class: kind, onclick: () => this.attempt(work) }, title);
    render(this.model,
      field("Damper", chooser),
      names.length ? note("", `Held by hand: ${names.join(", ")}.`) : null,
      h("div", { class: "row" }, action("model.json", () => this.saveModel(), "primary"), action("Loop as CSV", () => this.saveLoop())),
      h("p", { class: "small faint" }, c ? `The loop is calculated at ${condition({ ...c, amplitude_mm: MM * c.amplitude_m })}.` : "The loop is calculated at the initial condition of the Model page."),
      formats.length ? h("div", { class: "formats", role: "group", "aria-label": "Export" }, formats.map((f) => action(capitalise(f.title), () => this.export(f), "quiet"))) : null,
      this.exporting.element, this.message);
  }

  async attempt(work) {
    render(this.message);
    try {
      await work();
    } catch (error) {
      render(this.message, errorMessage(error));
    }
  }

  async saveModel() {
    const { text } = await this.app.api.post(`/dampers/${this.chooser.value}/document`, { held: this.app.state.held });
    save(json(text), "model.json");
  }

  async saveLoop() {
    const { condition: chosen, held, units } = this.app.state;
    const path = `/dampers/${this.chooser.value}`;
    await this.saveFile(`${path}/csv`, { ...(chosen ?? (await this.app.api.get(path)).start), held, units });
  }

  async saveFile(path, body) {
    const { blob, name } = await this.app.api.file(path, body);
    save(blob, name);
  }

  async export(format) {
    const result = await this.exporting.start(`/dampers/${this.chooser.value}/export/${format.name}`, { held: this.app.state.held });
    if (!result) return;
    const link = h("a", { href: this.app.api.url(`/exported/${result.exported}`), download: "" }, "Save it again");
    link.click();
    render(this.message, h("p", { class: "small faint" }, `${format.title} saved. `, result.notes.map((n) => `${n}. `), link, "."));
  }

  project() {
    const { app } = this;
    const state = async () => {
      await app.includeDocument();
      return JSON.stringify({ ...savedState(app.state), view: app.state.document ? "model" : "data" }, null, 1);
    };
    const saveProject = async () => this.saveFile("/project.zip", { state: await state(), damper: app.state.damper, logo: app.logo });
    const saveState = async () => save(json(await state()), "mrdamper-state.json");
    return h("div", { class: "body" },
      h("p", {}, "A saved project contains the data, all dampers, all slider values and the logo in one file; drop it on the page to open it. A state file contains the view without the data."),
      h("div", { class: "row" },
        h("button", { class: "primary", onclick: () => app.run(saveProject()) }, "Save the project"),
        h("button", { onclick: () => app.run(saveState()) }, "Save the state")),
      h("p", { class: "small faint" }, "“Copy link” in the header has the same content as a state file. All data stay on this computer; the temporary files are removed when the app stops."));
  }
}
