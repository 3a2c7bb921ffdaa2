// The moving picture of a ride: a building on shaking ground, or a car on its road. Motion is enlarged.

import { h, svg } from "./dom.js";

const [W, H] = [420, 300];
const AHEAD = 0.7; // seconds of road shown to either side

/** A scene for one answer: `element`, and `show(k)` for its sample k. */
export function scene(head, arrays) {
  const made = head.kind === "ground" ? frame(head, arrays) : car(head, arrays);
  const view = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "ride-scene", role: "img", "aria-label": `${head.title}, moving; motion is enlarged ${made.enlarged}-fold` }, made.parts);
  return { element: h("div", { class: "ride-stage" }, view, h("p", { class: "small faint" }, `Motion enlarged ${made.enlarged}-fold.`)), show: made.show };
}

/** Floors that sway above the ground; dampers between the ground and the first. */
function frame(head, arrays) {
  const count = head.coordinates.length;
  const [base, rise, half] = [H - 34, (H - 80) / count, 85];
  const scale = enlarge([...head.coordinates.map((name) => arrays[`x.${name}`]), arrays["way.ground"]], 42);
  const line = (kind) => svg("path", { class: kind });
  const [ground, columns, floors, damper] = [line("ride-ground"), line("ride-spring"), line("ride-mass"), line("ride-damper")];
  return {
    parts: [ground, columns, damper, floors],
    enlarged: Math.round(scale.factor),
    show(k) {
      const foot = W / 2 + scale.pixels(arrays["way.ground"][k]);
      const at = [foot, ...head.coordinates.map((name) => foot + scale.pixels(arrays[`x.${name}`][k]))];
      const y = (i) => base - i * rise;
      ground.setAttribute("d", `M${foot - 150},${base}h300`);
      floors.setAttribute("d", at.slice(1).map((x, i) => `M${x - half},${y(i + 1)}h${2 * half}`).join(""));
      columns.setAttribute("d", at.slice(1).map((x, i) => [-half + 8, half - 8].map((s) => bend(at[i] + s, y(i), x + s, y(i + 1))).join("")).join(""));
      damper.setAttribute("d", strut(at[0] - 55, y(0) - 3, at[1] + 55, y(1) + 6));
      shade(damper, head, arrays, k);
    },
  };
}

/** A car on its road: body, one or two wheels, springs and dampers between them. */
function car(head, arrays) {
  const wheels = head.coordinates.filter((name) => name.startsWith("wheel"));
  const places = wheels.length > 1 ? [W / 2 + 95, W / 2 - 95] : [W / 2];
  const roads = head.channels.map((name) => arrays[`way.${name}`]);
  const pitch = arrays["x.pitch"];
  const scale = enlarge([...wheels.map((name) => arrays[`x.${name}`]), arrays["x.body"], ...roads], 30);
  const [ground, body, springs] = ["ride-ground", "ride-mass", "ride-spring"].map((kind) => svg("path", { class: kind }));
  const dampers = wheels.map(() => svg("path", { class: "ride-damper" }));
  const tyres = wheels.map(() => svg("circle", { class: "ride-tyre", r: "24" }));
  const [road, hub, floor] = [H - 40, H - 64, H - 165];
  const [step, last] = [arrays.time[1] - arrays.time[0], arrays.time.length - 1];
  return {
    parts: [ground, ...tyres, springs, ...dampers, body],
    enlarged: Math.round(scale.factor),
    show(k) {
      const height = (x, wheel) => {
        const late = Math.round(((x - places[wheel]) / (W / 2)) * (AHEAD / step));
        return road - scale.pixels(roads[wheel][Math.min(last, Math.max(0, k + late))]);
      };
      let profile = "";
      for (let x = 0; x <= W; x += 4) profile += `${x ? "L" : "M"}${x},${height(x, 0).toFixed(1)}`;
      ground.setAttribute("d", profile);
      const lever = 1.3; // metres from the centre to an axle; what the picture needs of it
      const sink = places.map((_, i) => arrays["x.body"][k] + (pitch ? (i ? lever : -lever) * pitch[k] : 0));
      const top = sink.map((x) => floor - scale.pixels(x));
      const middle = wheels.map((name) => hub - scale.pixels(arrays[`x.${name}`][k]));
      tyres.forEach((tyre, i) => { tyre.setAttribute("cx", places[i]); tyre.setAttribute("cy", middle[i]); });
      springs.setAttribute("d", places.map((x, i) => coil(x - 16, middle[i], top[i] + 22)).join(""));
      dampers.forEach((damper, i) => { damper.setAttribute("d", strut(x0(places[i]), middle[i], x0(places[i]), top[i] + 22)); shade(damper, head, arrays, k, i); });
      const [left, right] = places.length > 1 ? [[places[1], top[1]], [places[0], top[0]]] : [[places[0] - 60, top[0]], [places[0] + 60, top[0]]];
      body.setAttribute("d", `M${left[0] - 40},${left[1] + 11}L${right[0] + 40},${right[1] + 11}`);
    },
  };
}

const x0 = (place) => place + 16;

/** How far motion is enlarged so that the widest of it fills so many pixels; a frame is 300 pixels to 3 m. */
function enlarge(series, pixels) {
  let widest = 1e-9;
  for (const values of series) for (const value of values) widest = Math.max(widest, Math.abs(value));
  return { pixels: (x) => (x / widest) * pixels, factor: Math.max(1, pixels / widest / (H / 3)) };
}

function bend(x, y, to, top) {
  const middle = (y + top) / 2;
  return `M${x},${y}C${x},${middle} ${to},${middle} ${to},${top}`;
}

function coil(x, from, to) {
  const turns = 6;
  let path = `M${x},${from}`;
  for (let i = 1; i <= turns; i += 1) path += `L${x + (i % 2 ? 7 : -7)},${from + ((to - from) * (i - 0.5)) / turns}`;
  return `${path}L${x},${to}`;
}

/** A damper: rod, cylinder, rod. */
function strut(x, y, to, top) {
  const [dx, dy] = [to - x, top - y];
  const at = (share) => [x + dx * share, y + dy * share];
  const size = Math.hypot(dx, dy) || 1;
  const [nx, ny] = [(-dy / size) * 7, (dx / size) * 7];
  const [a, b] = [at(0.3), at(0.68)];
  return `M${x},${y}L${a}M${a[0] + nx},${a[1] + ny}L${b[0] + nx},${b[1] + ny}M${a[0] - nx},${a[1] - ny}L${b[0] - nx},${b[1] - ny}M${a[0] + nx},${a[1] + ny}L${a[0] - nx},${a[1] - ny}M${at(0.55)}L${to},${top}M${at(0.55)[0] + nx},${at(0.55)[1] + ny}L${at(0.55)[0] - nx},${at(0.55)[1] - ny}`;
}

/** A damper is the firmer drawn the more current it has. */
function shade(part, head, arrays, k, which = 0) {
  const name = head.dampers[which] ?? head.dampers[0];
  const current = name === undefined ? 0 : arrays[`current.${name}`][k];
  const most = head.most || 1;
  part.setAttribute("stroke-width", (1.6 + (2.6 * current) / most).toFixed(2));
}
