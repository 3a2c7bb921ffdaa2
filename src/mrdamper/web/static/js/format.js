// Numbers as text: four figures at most, engineers' signs.

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

/** A fraction as per cent. */
export function percent(value, digits = 1) {
  return value === null || value === undefined || !Number.isFinite(value) ? "–" : `${sign((100 * value).toFixed(digits))} %`;
}

/** A unit as it is printed. */
export function unit(text) {
  if (text === "-") return "";
  return text.replace(/\^(-?\d+)/g, (_, power) => superscript(Number(power))).replace(/\^-n/, "⁻ⁿ").replaceAll("/A", "/A");
}

/** A condition: current, frequency, amplitude. */
export function condition(c) {
  return c ? `${figures(c.current_A, 3)} A, ${figures(c.frequency_Hz, 3)} Hz, ${figures(c.amplitude_mm, 3)} mm` : "no motion";
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
