// The head of a report: what was tested, for whom, by whom. All of it may stay empty.

import { h, put } from "./dom.js";

const FIELDS = {
  title: "Title", customer: "Customer", maker: "Maker", type: "Type", serial: "Serial number", rig: "Test rig", operator: "Operator",
  date: "Date", temperature_C: "Temperature (°C)", standard: "Standard", notes: "Notes",
};

export class AboutForm {
  constructor(bench) {
    this.bench = bench;
    this.inputs = new Map(Object.keys(FIELDS).map((name) => [name, this.input(name)]));
    this.logo = h("input", { type: "file", accept: "image/png,image/jpeg", id: "about-logo", onchange: () => this.take() });
    this.said = h("div", { class: "row small faint", role: "status" });
    const field = (name, control) => [h("label", { for: control.id }, name), control];
    this.element = h("details", { class: "about-head" }, h("summary", {}, "Head of the report"),
      h("div", { class: "about-fields" }, Object.entries(FIELDS).map(([name, title]) => field(title, this.inputs.get(name))), field("Logo (PNG, JPEG)", this.logo), h("span", {}), this.said));
    bench.store.onChange((state, before) => state.about !== before.about && this.set(state.about));
    document.addEventListener("bench:logo", () => this.show());
  }

  input(name) {
    const control = h(name === "notes" ? "textarea" : "input", { id: `about-${name}`, maxlength: "5000", onchange: () => this.change(name, control.value) });
    if (name !== "notes") control.type = "text";
    else control.rows = "2";
    return control;
  }

  change(name, text) {
    const { [name]: _before, ...rest } = this.bench.state.about;
    this.bench.store.pass({ about: text.trim() ? { ...rest, [name]: text.trim() } : rest });
  }

  set(about) {
    for (const [name, control] of this.inputs) if (document.activeElement !== control) control.value = about[name] ?? "";
  }

  async take() {
    const [file] = this.logo.files;
    if (file && file.size > 500_000) {
      this.bench.logo = "";
      put(this.said, `${file.name} is over 500 kB: give a smaller picture.`);
      return;
    }
    const bytes = file ? new Uint8Array(await file.arrayBuffer()) : [];
    this.bench.logo = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  }

  /** The logo that is taken: chosen here, or from a saved project. */
  show() {
    const { logo } = this.bench;
    if (!logo) this.logo.value = "";
    put(this.said, logo ? [
      h("img", { class: "logo", alt: "The logo", src: `data:image/png;base64,${logo}` }), // browsers tell JPEG from PNG themselves
      h("button", { class: "quiet", onclick: () => (this.bench.logo = "") }, "Take the logo out"),
    ] : null);
  }
}
