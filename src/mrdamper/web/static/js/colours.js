// Colours of curves: those of the page, a scale for currents, and a series for models.

import { isDark } from "./theme.js";

const VIRIDIS = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30"];
const DARK_VIRIDIS = ["#8a6bd1", "#6f86d6", "#5b9bd0", "#3fb0b8", "#38c192", "#6bd36a", "#b5de2b", "#fde725"];
const SERIES = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7a5ea8", "#8c6d1f"];
const DARK_SERIES = ["#4aa8e0", "#ff8a3d", "#2fc79c", "#e5a3c9", "#f2c14e", "#9bd4f5", "#b79ce0", "#cdb15c"];
const DASHES = ["solid", "dash", "dot", "dashdot", "longdash"];
const cache = new Map(); // of the page's colours: every move of a slider needs them
document.addEventListener("themechange", () => cache.clear());

/** CSS colour of a name: a colour of the page ("measured"), of a scale ("shade 0.4", "series 3"), or a CSS colour. */
export function paint(name) {
  const [kind, value] = name.split(" ");
  if (kind === "shade") return shade(Number(value));
  if (kind === "series") return (isDark() ? DARK_SERIES : SERIES)[Number(value)];
  return /^[a-z-]+$/.test(name) ? pageColour(name) : name;
}

/** Colour and dash of one of many models; the dash differs where colours repeat. */
export function series(index) {
  return { color: `series ${index % SERIES.length}`, dash: DASHES[Math.floor(index / SERIES.length) % DASHES.length] };
}

/** Colour of a fraction of a range, dark to light. */
function shade(fraction) {
  const scale = isDark() ? DARK_VIRIDIS : VIRIDIS;
  return scale[Math.min(scale.length - 1, Math.max(0, Math.round(fraction * (scale.length - 1))))];
}

function pageColour(name) {
  if (!cache.has(name)) cache.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return cache.get(name);
}
