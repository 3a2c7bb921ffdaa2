// Units in which the page shows quantities; the app calculates in SI units.

/** Units by quantity, each with its factor from SI. */
export const UNITS = { force: { N: 1, kN: 1e-3, lbf: 1 / 4.4482216152605 }, length: { mm: 1e3, in: 1 / 0.0254 } };
const chosen = { force: "N", length: "mm" };

/** Set the units of the page: {force, length}. */
export function setUnits(units) {
  Object.assign(chosen, units);
}

/** The units of a saved choice, without unknown ones. */
export function knownUnits(raw) {
  const known = Object.entries(raw ?? {}).filter(([name, unit]) => Object.hasOwn(UNITS, name) && Object.hasOwn(UNITS[name], unit));
  return { force: "N", length: "mm", ...Object.fromEntries(known) };
}

/** The unit of a quantity on the page, and the factor from its own unit: `onScreen("N s/m")`. */
export function onScreen(unit) {
  const { force, length } = chosen;
  if (unit === "mm") return { unit: length, factor: UNITS.length[length] / 1000 };
  if (unit === "m") return { unit: length, factor: UNITS.length[length] };
  if (unit === "J") return force === "lbf" ? { unit: "in·lbf", factor: UNITS.force.lbf * UNITS.length.in } : { unit, factor: 1 };
  if (unit.includes("^-n")) return { unit, factor: 1 };
  let [factor, sign] = [1, 1];
  const shown = unit.replace(/\/|\b(N|m)\b(?:\^(\d+))?/g, (part, base, power) => {
    if (part === "/") sign = -1;
    else if (base === "N") factor *= UNITS.force[force] ** (sign * (power ?? 1));
    else if (length === "in") factor *= UNITS.length.in ** (sign * (power ?? 1));
    return part.replace("N", force).replace("m", length === "in" ? "in" : "m");
  });
  return { unit: shown, factor };
}
