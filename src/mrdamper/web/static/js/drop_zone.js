// Upload of files: dropped anywhere on the page or chosen, sent in turn, and read.

import { ApiError } from "./api.js";
import { errorMessage, h, note, render } from "./dom.js";
import { droppedFiles, isProject } from "./files.js";
import { bytes } from "./format.js";
import { isModel, isState, parseState } from "./state.js";

export class DropZone {
  constructor(app) {
    this.app = app;
    this.upload = null; // key of the last upload
    this.message = h("div", { role: "status" });
    this.zone = this.makeZone();
    this.bundled = h("button", { class: "link small", onclick: () => app.run(app.openBundled()) }, "Open the bundled tests of two dampers");
    this.element = h("div", { class: "group" }, this.zone, this.message, this.bundled);
    this.listen();
    app.on("data", () => this.offerBundled());
    this.offerBundled();
  }

  makeZone() {
    const chooser = (props, name) => {
      const input = h("input", { type: "file", hidden: true, ...props });
      input.addEventListener("change", () => {
        const files = [...input.files].map((file) => ({ file, name: name(file) }));
        input.value = "";
        this.open(files);
      });
      return input;
    };
    const files = chooser({ multiple: true, "aria-label": "Files" }, (file) => file.name);
    const folder = chooser({ webkitdirectory: "", "aria-label": "Folder" }, (file) => file.webkitRelativePath || file.name);
    return h(
      "div", { class: "drop", id: "drop" },
      h("strong", {}, "Drop rig files, a dataset folder, a model.json or a saved project"),
      h("span", { class: "small" }, `up to ${bytes(this.app.limits.file_bytes)} a file`),
      h("div", { class: "row" }, h("button", { onclick: () => files.click() }, "Files …"), h("button", { onclick: () => folder.click() }, "Folder …")),
      files, folder,
    );
  }

  listen() {
    const { classList } = this.zone;
    for (const kind of ["dragenter", "dragover"]) {
      document.addEventListener(kind, (event) => {
        event.preventDefault();
        classList.add("over");
      });
    }
    document.addEventListener("dragleave", (event) => event.relatedTarget || classList.remove("over"));
    document.addEventListener("drop", async (event) => {
      event.preventDefault();
      classList.remove("over");
      this.open(await droppedFiles(event.dataTransfer).catch((error) => this.showError(error) ?? []));
    });
  }

  /** Offer the bundled tests beside other data; without data the Data view offers them. */
  offerBundled() {
    this.bundled.hidden = !this.app.overview || this.app.overview.source === "bundled";
  }

  /** Open files: a saved state, model or project, or data. */
  async open(files) {
    const { app } = this;
    if (!files.length) return;
    if (app.loading) return app.notify(note("warn", "Other files are still being read. Drop these again in a moment."));
    render(this.message);
    try {
      if (files.length === 1 && files[0].name.toLowerCase().endsWith(".json") && (await this.openJson(files[0].file))) return;
      if (files.length === 1 && (await isProject(files[0].file))) return await this.openProject(files);
    } catch (error) {
      return this.showError(error);
    }
    app.showView("data");
    return this.load(async () => {
      await this.send(files);
      return this.read("");
    });
  }

  async load(request) {
    try {
      await this.app.loadData(request, "Reading the files", { view: "data" });
      render(this.message);
    } catch (error) {
      this.showError(error);
    }
  }

  showError(error) {
    const { overview } = this.app;
    render(this.message, errorMessage(error), overview ? h("p", { class: "small faint" }, `“${overview.name}” is still loaded.`) : null);
    if (error.details?.verdicts) this.app.emit("refused", error.details);
  }

  async send(files) {
    const limit = this.app.limits.file_bytes;
    const tooLarge = files.find(({ file }) => file.size > limit);
    if (tooLarge) {
      const remedy = "read it with mrdamper import, which has no such limit, and drop the dataset folder";
      throw new ApiError({ where: tooLarge.name, found: `the file is over ${bytes(limit)}`, remedy, code: "E_UPLOAD_SIZE" });
    }
    this.upload = (await this.app.api.post("/uploads")).upload;
    for (const [i, { file, name }] of files.entries()) {
      render(this.message, h("p", { class: "small faint" }, `Sending file ${i + 1} of ${files.length} …`));
      await this.app.api.upload(`/uploads/${this.upload}/files?name=${encodeURIComponent(name)}`, file);
    }
  }

  /** Read the last upload with a profile: all files, or those refused. */
  read(toml, refusedOnly = false) {
    render(this.message, h("p", { class: "small faint" }, "Checking each file …"));
    return this.app.api.post(`/uploads/${this.upload}/read`, { toml, refused_only: refusedOnly });
  }

  /** Open a saved project: its data, its dampers, and its state. */
  async openProject(files) {
    const { app } = this;
    let project = null;
    await app.loadData(async () => {
      await this.send(files);
      project = await app.api.post(`/uploads/${this.upload}/open`);
      return project.data ? app.api.get("/data") : app.overview;
    }, "Opening the saved project");
    render(this.message);
    app.setLogo(project.logo);
    await app.refreshDampers();
    await app.restore({ ...parseState(JSON.parse(project.state)), damper: project.damper });
  }

  /** Open a state or a model; false where the file is neither. */
  async openJson(file) {
    const text = await file.text();
    if (isState(text)) await this.app.restore(parseState(JSON.parse(text)));
    else if (isModel(text)) this.app.selectDamper(await this.app.addDamper(text), { view: "model" });
    else return false;
    return true;
  }
}
