// Numbers as text: four figures at most, engineers' signs.

import { onScreen } from "./units.js";

const SUPERSCRIPT = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

/** A number with so many significant figures, without trailing noise. */
export function figures(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${sign(trim(mantissa))}·10${superscript(Number(exponent))}`;
  }
  return sign(String(Number(value.toPrecision(digits))));
}

/** How many of something: `count(1, "run")`. */
export function count(number, thing) {
  return `${number} ${thing}${number === 1 ? "" : "s"}`;
}

/**
 * How the numbers of one column are printed, so that they stand under each other: a power of 1000 for
 * all of them, and as many decimals as give the middle one four figures.
 */
export function column(values) {
  const sizes = values.filter((value) => Number.isFinite(value) && value !== 0).map(Math.abs).sort((a, b) => a - b);
  if (!sizes.length) return { power: 0, print: (value) => figures(value) };
  const middle = sizes[Math.floor(sizes.length / 2)];
  const power = sizes.at(-1) >= 1e5 || sizes.at(-1) < 1e-2 ? 3 * Math.floor(Math.log10(middle) / 3) : 0;
  const decimals = Math.min(6, Math.max(0, 3 - Math.floor(Math.log10(middle / 10 ** power))));
  const print = (value) => (Number.isFinite(value) ? sign((value / 10 ** power).toFixed(decimals)) : "–");
  return { power, print };
}

/** A name with its unit, and the power its numbers were divided by: "alpha (10⁶ N/m)". */
export function heading(name, itsUnit, power = 0) {
  const inside = [power ? `10${superscript(power)}` : "", unit(itsUnit)].filter(Boolean).join(" ");
  return inside ? `${name} (${inside})` : name;
}

/** A fraction as per cent. */
export function percent(value, digits = 1) {
  return value === null || value === undefined || !Number.isFinite(value) ? "–" : `${sign((100 * value).toFixed(digits))} %`;
}

/** A unit as it is printed. */
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

function trim(text) {
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

function sign(text) {
  return text.replace("-", "−");
}

function superscript(power) {
  return [...String(power)].map((c) => SUPERSCRIPT[c]).join("");
}
