// Light or dark: as the system says, until the reader says otherwise.

import { h, put } from "./dom.js";
import { browserStorage } from "./storage.js";

const KEY = "mrdamper.theme";
const system = matchMedia("(prefers-color-scheme: dark)");

export function theme() {
  apply(browserStorage.getItem(KEY) ?? wished());
  system.addEventListener("change", () => browserStorage.getItem(KEY) ?? apply(wished()));
}

theme.button = () => {
  const button = h("button", { class: "quiet", onclick: toggle });
  const label = () => {
    const dark = document.documentElement.dataset.theme === "dark";
    put(button, dark ? "☀" : "☾", h("span", { class: "word" }, dark ? "Light" : "Dark"));
    button.setAttribute("aria-label", dark ? "Use light colours" : "Use dark colours");
  };
  document.addEventListener("themechange", label);
  label();
  return button;
};

function toggle() {
  const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  browserStorage.setItem(KEY, next);
  apply(next);
}

function wished() {
  return system.matches ? "dark" : "light";
}

function apply(name) {
  document.documentElement.dataset.theme = name;
  document.dispatchEvent(new CustomEvent("themechange"));
}
