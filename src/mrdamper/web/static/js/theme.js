// Light or dark colours: those of the system until the user chooses.

import { h, render } from "./dom.js";
import { browserStorage } from "./storage.js";

const KEY = "mrdamper.theme";
const system = matchMedia("(prefers-color-scheme: dark)");
const ofSystem = () => (system.matches ? "dark" : "light");

/** True while the colours are dark. */
export function isDark() {
  return document.documentElement.dataset.theme === "dark";
}

export function startTheme() {
  apply(browserStorage.getItem(KEY) ?? ofSystem());
  system.addEventListener("change", () => browserStorage.getItem(KEY) ?? apply(ofSystem()));
}

/** A button that changes the colours. */
export function themeButton() {
  const button = h("button", { class: "quiet", onclick: toggle });
  const label = () => {
    render(button, isDark() ? "☀" : "☾", h("span", { class: "word" }, isDark() ? "Light" : "Dark"));
    button.setAttribute("aria-label", isDark() ? "Use light colours" : "Use dark colours");
  };
  document.addEventListener("themechange", label);
  label();
  return button;
}

function toggle() {
  const name = isDark() ? "light" : "dark";
  browserStorage.setItem(KEY, name);
  apply(name);
}

function apply(name) {
  document.documentElement.dataset.theme = name;
  document.dispatchEvent(new CustomEvent("themechange"));
}
