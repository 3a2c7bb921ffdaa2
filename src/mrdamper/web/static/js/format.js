// Numbers as text: four significant digits, a minus sign, and units.

import { onScreen } from "./units.js";

const SUPERSCRIPT = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

/** A number with a number of significant digits, without trailing zeros. */
export function figures(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${sign(String(Number(mantissa)))}·10${superscript(Number(exponent))}`;
  }
  return sign(String(Number(value.toPrecision(digits))));
}

/** A count with its noun: `count(1, "run")`. */
export function count(number, thing) {
  return `${number} ${thing}${number === 1 ? "" : "s"}`;
}

/** Format of the numbers of a column: one power of 1000, and decimals that give the median four digits. */
export function column(values) {
  const sizes = values.filter((value) => Number.isFinite(value) && value !== 0).map(Math.abs).sort((a, b) => a - b);
  if (!sizes.length) return { power: 0, print: (value) => figures(value) };
  const middle = sizes[Math.floor(sizes.length / 2)];
  const power = sizes.at(-1) >= 1e5 || sizes.at(-1) < 1e-2 ? 3 * Math.floor(Math.log10(middle) / 3) : 0;
  const decimals = Math.min(6, Math.max(0, 3 - Math.floor(Math.log10(middle / 10 ** power))));
  const print = (value) => (Number.isFinite(value) ? sign((value / 10 ** power).toFixed(decimals)) : "–");
  return { power, print };
}

/** A name with its unit and the power of ten of the numbers: "alpha (10⁶ N/m)". */
export function heading(name, itsUnit, power = 0) {
  const inside = [power ? `10${superscript(power)}` : "", unit(itsUnit)].filter(Boolean).join(" ");
  return inside ? `${name} (${inside})` : name;
}

/** A fraction in per cent. */
export function percent(value, digits = 1) {
  return value === null || value === undefined || !Number.isFinite(value) ? "–" : `${sign((100 * value).toFixed(digits))} %`;
}

/** A unit with superscripts. */
export function unit(text) {
  if (text === "-") return "";
  return text.replace(/\^(-?\d+)/g, (_, power) => superscript(Number(power))).replace(/\^-n/, "⁻ⁿ");
}

/** A quantity in the unit of the screen: `quantity(0.01, "m")`. */
export function quantity(value, itsUnit, digits = 4) {
  const screen = onScreen(itsUnit);
  return `${figures(screen.factor * value, digits)} ${unit(screen.unit)}`.trim();
}

/** A condition: current, frequency, amplitude. */
export function condition(c) {
  return c ? `${figures(c.current_A, 3)} A, ${figures(c.frequency_Hz, 3)} Hz, ${quantity(c.amplitude_mm, "mm", 3)}` : "no motion";
}

/** Bytes. */
export function bytes(count) {
  if (count < 1000) return `${count} B`;
  return count < 1e6 ? `${figures(count / 1e3, 3)} kB` : `${figures(count / 1e6, 3)} MB`;
}

/** Seconds. */
export function seconds(value) {
  return value < 100 ? `${value.toFixed(1)} s` : `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`;
}

function sign(text) {
  return text.replace("-", "−");
}

function superscript(power) {
  return [...String(power)].map((c) => SUPERSCRIPT[c]).join("");
}
