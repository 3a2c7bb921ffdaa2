// The head of a report: specimen, customer, laboratory. Every field may stay empty.

import { h, render } from "./dom.js";

const FIELDS = {
  title: "Title", customer: "Customer", maker: "Maker", type: "Type", serial: "Serial number", rig: "Test rig", operator: "Operator",
  date: "Date", temperature_C: "Temperature (°C)", standard: "Standard", notes: "Notes",
};
const MAX_LOGO_BYTES = 500_000;

export class AboutForm {
  constructor(app) {
    this.app = app;
    this.inputs = new Map(Object.keys(FIELDS).map((name) => [name, this.input(name)]));
    this.logo = h("input", { type: "file", accept: "image/png,image/jpeg", id: "about-logo", onchange: () => app.run(this.readLogo()) });
    this.message = h("div", { class: "row small faint", role: "status" });
    const row = (name, control) => [h("label", { for: control.id }, name), control];
    this.element = h("details", { class: "about-head" }, h("summary", {}, "Head of the report"),
      h("div", { class: "about-fields" }, Object.entries(FIELDS).map(([name, title]) => row(title, this.inputs.get(name))), row("Logo (PNG, JPEG)", this.logo), h("span", {}), this.message));
    app.store.onChange((state, before) => state.about !== before.about && this.set(state.about));
    app.on("logo", () => this.showLogo());
  }

  input(name) {
    const props = { id: `about-${name}`, maxlength: "5000", onchange: (event) => this.change(name, event.target.value) };
    return name === "notes" ? h("textarea", { ...props, rows: "2" }) : h("input", { ...props, type: "text" });
  }

  change(name, text) {
    const { [name]: _before, ...rest } = this.app.state.about;
    this.app.store.update({ about: text.trim() ? { ...rest, [name]: text.trim() } : rest });
  }

  set(about) {
    for (const [name, control] of this.inputs) if (document.activeElement !== control) control.value = about[name] ?? "";
  }

  async readLogo() {
    const [file] = this.logo.files;
    if (file && file.size > MAX_LOGO_BYTES) {
      this.app.setLogo("");
      render(this.message, `${file.name} is over 500 kB: give a smaller picture.`);
      return;
    }
    const content = file ? new Uint8Array(await file.arrayBuffer()) : [];
    this.app.setLogo(btoa(Array.from(content, (byte) => String.fromCharCode(byte)).join("")));
  }

  /** Show the logo: chosen here, or of a saved project. */
  showLogo() {
    const { logo } = this.app;
    if (!logo) this.logo.value = "";
    render(this.message, logo ? [
      h("img", { class: "logo", alt: "The logo", src: `data:image/png;base64,${logo}` }), // browsers recognise JPEG by its content
      h("button", { class: "quiet", onclick: () => this.app.setLogo("") }, "Remove the logo"),
    ] : null);
  }
}
