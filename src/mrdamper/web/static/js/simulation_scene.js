// Animation of a simulation: a building on moving ground, or a vehicle on its road. Motion is enlarged.

import { h, svg } from "./dom.js";

const [WIDTH, HEIGHT] = [420, 300];
const PIXELS_PER_M = 100;
const ROAD_S = 0.7; // seconds of road to either side
const AXLE_DISTANCE_M = 1.3; // from the centre of the body to an axle

/** The scene of a simulation: `element`, and `show(k)` for sample k; `highest` is the current limit [A]. */
export function scene(head, arrays, highest) {
  const { parts, factor, show } = (head.kind === "ground" ? building : vehicle)(head, arrays, highest || 1);
  const text = `${Math.round(factor)}-fold`;
  const view = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "scene", role: "img", "aria-label": `${head.title}, moving; motion is enlarged ${text}` }, parts);
  return { element: h("div", { class: "scene-stage" }, view, h("p", { class: "small faint" }, `Motion enlarged ${text}.`)), show };
}

/** Floors above the ground, with the damper between the ground and the first. */
function building({ coordinates, dampers }, arrays, highest) {
  const [base, storey, half] = [HEIGHT - 34, (HEIGHT - 80) / coordinates.length, 85];
  const { pixels, factor } = enlarge([...coordinates.map((name) => arrays[`x.${name}`]), arrays["input.ground"]], 42);
  const [ground, columns, damper, floors] = ["ground", "spring", "damper", "mass"].map(path);
  const y = (i) => base - i * storey;
  return {
    parts: [ground, columns, damper, floors],
    factor,
    show(k) {
      const foot = WIDTH / 2 + pixels(arrays["input.ground"][k]);
      const x = [foot, ...coordinates.map((name) => foot + pixels(arrays[`x.${name}`][k]))];
      const above = x.slice(1);
      ground.setAttribute("d", `M${foot - 150},${base}h300`);
      floors.setAttribute("d", above.map((floor, i) => `M${floor - half},${y(i + 1)}h${2 * half}`).join(""));
      columns.setAttribute("d", above.flatMap((floor, i) => [8 - half, half - 8].map((s) => column(x[i] + s, y(i), floor + s, y(i + 1)))).join(""));
      damper.setAttribute("d", strut(x[0] - 55, y(0) - 3, x[1] + 55, y(1) + 6));
      showCurrent(damper, arrays, dampers[0], k, highest);
    },
  };
}

/** Body, one or two wheels with springs and dampers, and the road. */
function vehicle({ coordinates, channels, dampers }, arrays, highest) {
  const wheels = coordinates.filter((name) => name.startsWith("wheel"));
  const places = wheels.length > 1 ? [WIDTH / 2 + 95, WIDTH / 2 - 95] : [WIDTH / 2];
  const roads = channels.map((name) => arrays[`input.${name}`]);
  const { "x.body": bounce, "x.pitch": pitch, time } = arrays;
  const { pixels, factor } = enlarge([...wheels.map((name) => arrays[`x.${name}`]), bounce, ...roads], 30);
  const [ground, springs, body] = ["ground", "spring", "mass"].map(path);
  const struts = wheels.map(() => path("damper"));
  const tyres = places.map((cx) => svg("circle", { class: "tyre", r: "24", cx: String(cx) }));
  const [road, hub, floor] = [HEIGHT - 40, HEIGHT - 64, HEIGHT - 165];
  const samplesPerPixel = ROAD_S / (WIDTH / 2) / (time[1] - time[0]);
  return {
    parts: [ground, ...tyres, springs, ...struts, body],
    factor,
    show(k) {
      const height = (x) => {
        const sample = k + Math.round((x - places[0]) * samplesPerPixel);
        return road - pixels(roads[0][Math.min(time.length - 1, Math.max(0, sample))]);
      };
      const profile = Array.from({ length: WIDTH / 4 + 1 }, (_, i) => `${4 * i},${height(4 * i).toFixed(1)}`);
      ground.setAttribute("d", `M${profile.join("L")}`);
      const lever = (i) => (pitch ? (i ? AXLE_DISTANCE_M : -AXLE_DISTANCE_M) * pitch[k] : 0);
      const top = places.map((_, i) => floor - pixels(bounce[k] + lever(i)));
      const middle = wheels.map((name) => hub - pixels(arrays[`x.${name}`][k]));
      tyres.forEach((tyre, i) => tyre.setAttribute("cy", middle[i]));
      springs.setAttribute("d", places.map((x, i) => coil(x - 16, middle[i], top[i] + 22)).join(""));
      struts.forEach((damper, i) => {
        damper.setAttribute("d", strut(places[i] + 16, middle[i], places[i] + 16, top[i] + 22));
        showCurrent(damper, arrays, dampers[i] ?? dampers[0], k, highest);
      });
      const ends = places.length > 1 ? [places[1], places[0]] : [places[0] - 60, places[0] + 60];
      body.setAttribute("d", `M${ends[0] - 40},${top.at(-1) + 11}L${ends[1] + 40},${top[0] + 11}`);
    },
  };
}

const path = (kind) => svg("path", { class: kind });

/** Scale of the motion: its largest displacement fills a number of pixels; `factor` is the enlargement. */
function enlarge(series, size) {
  let largest = 1e-9;
  for (const values of series) for (const value of values) largest = Math.max(largest, Math.abs(value));
  return { pixels: (x) => (x / largest) * size, factor: Math.max(1, size / largest / PIXELS_PER_M) };
}

function column(x, y, toX, toY) {
  const middle = (y + toY) / 2;
  return `M${x},${y}C${x},${middle} ${toX},${middle} ${toX},${toY}`;
}

function coil(x, from, to) {
  const turns = [1, 2, 3, 4, 5, 6].map((i) => `L${x + (i % 2 ? 7 : -7)},${from + ((to - from) * (i - 0.5)) / 6}`);
  return `M${x},${from}${turns.join("")}L${x},${to}`;
}

/** A damper: rod, cylinder, piston, rod. */
function strut(x, y, toX, toY) {
  const [dx, dy] = [toX - x, toY - y];
  const size = Math.hypot(dx, dy) || 1;
  const at = (share, side = 0) => `${x + dx * share - (7 * side * dy) / size},${y + dy * share + (7 * side * dx) / size}`;
  const lines = [[at(0), at(0.3)], [at(0.3, 1), at(0.68, 1)], [at(0.3, -1), at(0.68, -1)], [at(0.3, 1), at(0.3, -1)], [at(0.55), at(1)], [at(0.55, 1), at(0.55, -1)]];
  return lines.map((line) => `M${line.join("L")}`).join("");
}

/** Draw a damper the thicker the larger its current. */
function showCurrent(part, arrays, name, k, highest) {
  const current = name === undefined ? 0 : arrays[`current.${name}`][k];
  part.setAttribute("stroke-width", (1.6 + (2.6 * current) / highest).toFixed(2));
}
