// Taking files: dropped anywhere on the page or chosen, sent one by one, read, and answered for.

import { h, note, problem, put } from "./dom.js";
import { collect, isKept, isModel, isState } from "./files.js";
import { bytes } from "./format.js";
import { imported } from "./state.js";

export class DropZone {
  constructor(bench) {
    this.bench = bench;
    this.drop = null; // the bench's name for what was dropped last
    this.said = h("div", { role: "status" });
    this.zone = this.makeZone();
    this.bundled = h("button", { class: "link small", onclick: () => bench.openBundled().catch((error) => bench.fail(error)) }, "Open the bundled tests of two dampers");
    this.element = h("div", { class: "group" }, this.zone, this.said, this.bundled);
    this.listen();
    this.offer();
  }

  makeZone() {
    const input = (props, name) => {
      const chooser = h("input", { type: "file", hidden: true, ...props, onchange: () => {
        const files = [...chooser.files].map((file) => ({ file, name: name(file) }));
        chooser.value = "";
        this.take(files);
      } });
      return chooser;
    };
    const files = input({ multiple: true, "aria-label": "Files" }, (file) => file.name);
    const folder = input({ webkitdirectory: "", "aria-label": "Folder" }, (file) => file.webkitRelativePath || file.name);
    return h(
      "div", { class: "drop", id: "drop" },
      h("strong", {}, "Drop rig files, a dataset folder, a model.json or a saved project"),
      h("span", { class: "small" }, `up to ${bytes(this.bench.limits.file_bytes)} a file`),
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
      this.take(await collect(event.dataTransfer).catch((error) => this.refuse(error) ?? []));
    });
    document.addEventListener("bench:data", () => this.offer());
  }

  /** Without data the stage offers the bundled tests, with them nobody needs to. */
  offer() {
    this.bundled.hidden = !this.bench.overview || this.bench.overview.source === "bundled";
  }

  async take(files) {
    const { bench } = this;
    if (!files.length) return;
    if (bench.busy) return bench.say(note("warn", "The bench is still reading. Drop these again in a moment."));
    put(this.said);
    try {
      if (files.length === 1 && files[0].name.toLowerCase().endsWith(".json") && (await this.bring(files[0].file))) return;
      if (files.length === 1 && (await isKept(files[0].file))) return await this.open(files);
    } catch (error) {
      this.refuse(error);
      return;
    }
    bench.store.pass({ view: "data" });
    await this.load(async () => {
      await this.send(files);
      return this.read("");
    });
  }

  /** Read what was dropped again with a corrected profile: all of it, or what was refused. */
  readAgain(toml, refusedOnly = false) {
    return this.load(() => this.read(toml, refusedOnly));
  }

  async load(bring) {
    try {
      await this.bench.takeData(bring, "Reading the files", { view: "data" });
      put(this.said);
    } catch (error) {
      this.refuse(error);
    }
  }

  refuse(error) {
    const { overview } = this.bench;
    put(this.said, problem(error), overview ? h("p", { class: "small faint" }, `“${overview.name}” stays on the bench.`) : null);
    if (error.said?.verdicts) document.dispatchEvent(new CustomEvent("bench:refused", { detail: error.said }));
  }

  async send(files) {
    const limit = this.bench.limits.file_bytes;
    const tooLarge = files.find(({ file }) => file.size > limit);
    if (tooLarge) throw tooLargeError(tooLarge.name, limit);
    this.drop = (await this.bench.api.post("/drops")).drop;
    for (const [i, { file, name }] of files.entries()) {
      put(this.said, h("p", { class: "small faint" }, `Taking file ${i + 1} of ${files.length} …`));
      await this.bench.api.upload(`/drops/${this.drop}/files?name=${encodeURIComponent(name)}`, file);
    }
  }

  read(toml, refusedOnly = false) {
    put(this.said, h("p", { class: "small faint" }, "Checking each file …"));
    return this.bench.api.post(`/drops/${this.drop}/read`, { toml, refused_only: refusedOnly });
  }

  /** A bench that was kept: its data, its dampers, and what was shown. */
  async open(files) {
    const { bench } = this;
    let found = null;
    await bench.takeData(async () => {
      await this.send(files);
      found = await bench.api.post(`/drops/${this.drop}/open`);
      return found.data ? bench.api.get("/data") : bench.overview;
    }, "Opening the saved project");
    put(this.said);
    bench.logo = found.logo;
    await bench.refreshDampers();
    await bench.restore({ ...imported(JSON.parse(found.state)), damper: found.damper });
  }

  /** A state or a model brought back; false where the file is something else. */
  async bring(file) {
    const text = await file.text();
    if (isState(text)) {
      await this.bench.restore(imported(JSON.parse(text)));
      return true;
    }
    if (!isModel(text)) return false;
    const { damper } = await this.bench.api.post("/dampers", { text });
    await this.bench.refreshDampers();
    await this.bench.choose(damper, { view: "model" });
    return true;
  }
}

function tooLargeError(name, limit) {
  const error = new Error("too large");
  error.said = { where: name, found: `the file is over ${bytes(limit)}`, remedy: "read it with mrdamper import, which has no such limit, and drop the dataset folder", code: "E_DROP_SIZE" };
  return error;
}
