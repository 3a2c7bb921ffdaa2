// The page: engine and self-test, the sine under the sliders, a dropped motion, charts.
(async () => {
  "use strict";
  const $ = (id) => document.getElementById(id);
  const facts = JSON.parse($("facts").textContent);
  const say = (id, text, kind = "") => { $(id).textContent = text; $(id).className = kind; };
  const CYCLE = 400, MOST_CYCLES = 60, CLOSED = 1e-6;
  const MOST_BYTES = 50e6;
  window.addEventListener("error", (e) => say("message", `The page failed: ${e.message}`, "bad"));
  window.addEventListener("unhandledrejection", (e) => say("message", `The page failed: ${e.reason}`, "bad"));

  // ---- engine -------------------------------------------------------------------------------------
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const doubles = (text) => new Float64Array(bytes(text).buffer);

  const binary = facts.wasm && bytes(facts.wasm);
  // A table travels once: on its own, or where it stands in the binary.
  const curves = facts.curves.map(({ data, at, size }) => (data ? doubles(data) : new Float64Array(binary.slice(at, at + 8 * size).buffer)));

  async function webAssembly() {
    const { instance } = await WebAssembly.instantiate(binary, {});
    return instance.exports;
  }

  // Largest difference from mrdamper's own forces, over the largest force; infinite if there is no answer.
  function selfTest(engine) {
    const [x, current, force] = [facts.test.displacement, facts.test.current, facts.test.force].map(doubles);
    if (!engine.begin()) return Infinity;
    let worst = 0, largest = 0;
    for (let i = 0; i < x.length; i++) {
      const off = Math.abs(engine.drive(x[i], current[i], facts.test.step) - force[i]);
      if (!(off < Infinity)) return Infinity;
      worst = Math.max(worst, off);
      largest = Math.max(largest, Math.abs(force[i]));
    }
    return worst / (largest || 1);
  }

  async function chosenEngine() {
    const javaScript = { engine: makeDamper(curves), name: "JavaScript" };
    let why = binary ? "" : "it was exported without WebAssembly";
    if (binary) {
      try {
        const engine = await webAssembly();
        const off = selfTest(engine);
        if (off <= facts.test.tolerance) return { engine, name: "WebAssembly", off, why };
        why = "its WebAssembly failed the self-test";
      } catch (error) {
        why = "this browser forbids WebAssembly";
      }
    }
    return { ...javaScript, off: selfTest(javaScript.engine), why };
  }

  const { engine, name, off, why } = await chosenEngine();
  const count = doubles(facts.test.force).length;
  const by = `${name}${why ? `, because ${why}` : ""}`;
  if (off <= facts.test.tolerance) {
    const how = off === 0 ? "to the last bit" : `within ${off.toExponential(0)} of the largest force`;
    say("test", `Self-test passed: ${count} forces agree with mrdamper's ${how}. Computed in ${by}.`, "faint");
  } else {
    say("test", `Self-test failed in ${by}.`, "bad");
    say("message", "This browser computes other forces than mrdamper did: do not use the numbers below; open the page in another browser.", "bad");
  }

  // ---- the sine -----------------------------------------------------------------------------------
  // One closed cycle [s, m, m/s, N], from rest until two cycles agree; force null where there is no answer.
  function loop(current, frequency, amplitude) {
    const w = 2 * Math.PI * frequency, dt = 1 / (frequency * CYCLE);
    let last = null, turned = new Float64Array(CYCLE);
    engine.begin();
    for (let cycle = 0; cycle < MOST_CYCLES; cycle++) {
      let gap = 0, low = Infinity, high = -Infinity;
      for (let i = 0; i < CYCLE; i++) {
        const turn = (2 * Math.PI * i) / CYCLE, c = amplitude * Math.cos(turn);
        const force = engine.step(-c, w * amplitude * Math.sin(turn), w * w * c, current, dt);
        if (Number.isNaN(force)) return null;
        if (last) gap = Math.max(gap, Math.abs(force - last[i]));
        turned[i] = force;
        low = Math.min(low, force);
        high = Math.max(high, force);
      }
      const closed = last && gap <= CLOSED * (high - low);
      [last, turned] = [turned, last || new Float64Array(CYCLE)];
      if (closed) break;
    }
    const at = (f) => Float64Array.from({ length: CYCLE + 1 }, (_, i) => f((2 * Math.PI * i) / CYCLE, i));
    return {
      time: at((_, i) => i * dt),
      displacement: at((turn) => -amplitude * Math.cos(turn)),
      velocity: at((turn) => w * amplitude * Math.sin(turn)),
      current: at(() => current),
      force: at((_, i) => last[i % CYCLE]),
    };
  }

  const energy = ({ displacement: x, force: F }) => {
    let sum = 0;
    for (let i = 1; i < x.length; i++) sum += 0.5 * (F[i] + F[i - 1]) * (x[i] - x[i - 1]);
    return sum;
  };
  const extremes = (values) => values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
  const number = (v, digits = 3) => (Number.isFinite(v) ? Number(v.toPrecision(digits)).toLocaleString("en", { maximumSignificantDigits: digits }).replace("-", "−") : "–");

  // Half the width of the band around each force of a loop.
  function widths(force, known) {
    const [low, high] = extremes(force), { gain, offset_N, of_peak, of_peak_untested } = facts.band;
    return force.map((F) => Math.hypot(gain * F, offset_N, (known ? of_peak : of_peak_untested) * (high - low) / 2));
  }

  // Whether a sine is one of the tested conditions: sessions repeat a level to some per cent.
  function wasTested(current, frequency, amplitude) {
    const near = (one, other, share) => Math.abs(one - other) <= share * Math.abs(other);
    const largest = Math.max(...facts.conditions.map(([I]) => I));
    return facts.conditions.some(([I, f, A]) => Math.abs(current - I) <= 0.02 * largest && near(frequency, f, 0.05) && near(amplitude, A, 0.05));
  }

  // Which quantities of a sine lie outside the tests, with what was tested.
  function outside(current, frequency, amplitude) {
    if (!facts.tested) return [];
    const given = { current_A: current, frequency_Hz: frequency, amplitude_m: amplitude, peak_velocity_m_s: 2 * Math.PI * frequency * amplitude };
    return facts.tested.filter(({ field, low, high }) => given[field] < low - facts.slack * high || given[field] > high * (1 + facts.slack));
  }

  function show(pairs) {
    $("numbers").replaceChildren(...pairs.map(([term, value]) => {
      const pair = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
      dt.textContent = term;
      dd.textContent = value;
      pair.append(dt, dd);
      return pair;
    }));
  }

  // ---- charts -------------------------------------------------------------------------------------
  function ticks(low, high) {
    const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((s) => s * power >= rough);
    const first = Math.floor(low / step), last = Math.ceil(high / step);
    return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
  }

  const SVG = "http://www.w3.org/2000/svg";
  function element(tag, attributes, text) {
    const made = document.createElementNS(SVG, tag);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  // lines: { x, y, kind, spread, skip, label }; a point is left out of its line where skip(i) holds; the label stands at its middle.
  function chart(id, title, xLabel, yLabel, lines) {
    const host = $(id), width = Math.max(host.clientWidth - 34, 240), height = 280;
    const left = 58, right = 18, top = 8, bottom = 40;
    let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const { x, y, spread } of lines) {
      for (let i = 0; i < x.length; i++) {
        const half = spread ? spread[i] : 0;
        if (x[i] < x0) x0 = x[i];
        if (x[i] > x1) x1 = x[i];
        if (y[i] - half < y0) y0 = y[i] - half;
        if (y[i] + half > y1) y1 = y[i] + half;
      }
    }
    if (!(x1 > x0)) { x0 -= 1; x1 += 1; }
    if (!(y1 > y0)) { y0 -= 1; y1 += 1; }
    const ys = ticks(y0, y1), xs = ticks(x0, x1);
    [x0, x1, y0, y1] = [xs[0], xs.at(-1), ys[0], ys.at(-1)];
    const px = (v) => left + ((v - x0) / (x1 - x0)) * (width - left - right);
    const py = (v) => height - bottom - ((v - y0) / (y1 - y0)) * (height - top - bottom);
    const label = `${title}: ${number(y0)} to ${number(y1)} ${yLabel.match(/\[(.*)\]/)[1]}`;
    const svg = element("svg", { viewBox: `0 0 ${width} ${height}`, height, role: "img", "aria-label": label });
    for (const v of ys) {
      svg.append(element("line", { x1: left, x2: width - right, y1: py(v), y2: py(v), class: v === 0 ? "zero" : "grid-line" }));
      svg.append(element("text", { x: left - 6, y: py(v) + 4, "text-anchor": "end" }, number(v, 4)));
    }
    for (const v of xs) {
      svg.append(element("line", { x1: px(v), x2: px(v), y1: top, y2: height - bottom, class: v === 0 ? "zero" : "grid-line" }));
      svg.append(element("text", { x: px(v), y: height - bottom + 16, "text-anchor": "middle" }, number(v, 4)));
    }
    svg.append(element("text", { x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, xLabel));
    svg.append(element("text", { x: 12, y: (height - bottom) / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${(height - bottom) / 2})` }, yLabel));
    for (const { x, y, kind = "", skip, label, spread } of lines) {
      let d = "", pen = false;
      if (spread) {  // a loop turns back on itself: one strip from point to point, drawn as one faint shape
        let strips = "";
        for (let i = 1; i < x.length; i++) {
          const corner = (k, side) => `${px(x[k]).toFixed(1)} ${py(y[k] + side * spread[k]).toFixed(1)}`;
          const [a, b] = x[i] < x[i - 1] ? [i, i - 1] : [i - 1, i];
          strips += `M${corner(a, -1)}L${corner(a, 1)}L${corner(b, 1)}L${corner(b, -1)}Z`;
        }
        svg.append(element("path", { d: strips, class: "band" }));
      }
      for (let i = 0; i < x.length; i++) {
        if (skip && skip(i)) { pen = false; continue; }
        d += `${pen ? "L" : "M"}${px(x[i]).toFixed(1)} ${py(y[i]).toFixed(1)}`;
        pen = true;
      }
      svg.append(element("path", { d, class: kind }));
      const middle = x.length >> 1, below = kind.includes("second");
      if (label) svg.append(element("text", { x: px(x[middle]), y: py(y[middle]) + (below ? 20 : -10), "text-anchor": below ? "start" : "end", class: `line ${kind}` }, label));
    }
    const heading = document.createElement("h2");
    heading.textContent = title;
    host.replaceChildren(heading, svg);
  }

  const times = (values, factor) => values.map((v) => v * factor);

  // ---- what is shown: the sine, or a motion -------------------------------------------------------
  let motion = null, shown = null;
  const condition = () => ["current", "frequency", "amplitude"].map((key) => $(`${key}-number`).valueAsNumber * (key === "amplitude" ? 1e-3 : 1));

  function drawSine() {
    const [current, frequency, amplitude] = condition();
    if (![current, frequency, amplitude].every(Number.isFinite) || !(frequency > 0) || !(amplitude > 0)) {
      return say("outside", "Give a number in each field, frequency and amplitude above zero.", "bad");
    }
    const away = outside(current, frequency, amplitude);
    say("outside", away.length ? `Extrapolated: ${away.map((t) => t.said).join("; ")}. The tests do not cover this range.` : "", "warn");
    const found = loop(current, frequency, amplitude);
    if (!found) return say("outside", "The model has no force at this condition: come nearer to the tests.", "bad");
    shown = found;
    const [low, high] = extremes(found.force), kind = away.length ? "outside" : "";
    const spread = facts.band && !away.length ? widths(found.force, wasTested(current, frequency, amplitude)) : null;  // nothing is known of it where nobody measured
    const within = (peak) => `${number(peak)}${spread ? ` ± ${number(spread[found.force.indexOf(peak)], 2)}` : ""} N`;
    show([
      ["Peak force, extension", within(high)], ["Peak force, compression", within(low)],
      ["Dissipated energy", `${number(energy(found))} J per cycle`],
      ["Peak velocity", `${number(2e3 * Math.PI * frequency * amplitude)} mm/s`],
    ]);
    const force = found.force;
    chart("over-displacement", "Force over displacement", "Displacement [mm]", "Force [N]", [{ x: times(found.displacement, 1e3), y: force, kind, spread }]);
    chart("over-velocity", "Force over velocity", "Velocity [mm/s]", "Force [N]", [{ x: times(found.velocity, 1e3), y: force, kind, spread }]);
  }

  function drawCurrents() {
    const [, frequency, amplitude] = condition(), most = Number($("current").max), least = Number($("current").min);
    const currents = Float64Array.from({ length: 13 }, (_, i) => least + ((most - least) * i) / 12);
    const peaks = Array.from(currents, (I) => { const found = loop(I, frequency, amplitude); return found ? extremes(found.force) : [NaN, NaN]; });
    if (peaks.flat().some(Number.isNaN)) return;
    const tested = Array.from(currents, (I) => outside(I, frequency, amplitude).length === 0);
    const dashed = (i) => tested[i] && tested[Math.max(i - 1, 0)] && tested[Math.min(i + 1, 12)];
    const line = (y, kind, label) => [{ x: currents, y, kind, label, skip: (i) => !tested[i] }, { x: currents, y, kind: `${kind} outside`, skip: dashed }];
    chart("wide", "Peak force over current", "Current [A]", "Peak force [N]", [
      ...line(Float64Array.from(peaks, (p) => p[1]), "", "extension"), ...line(Float64Array.from(peaks, (p) => -p[0]), "second", "compression"),
    ]);
  }

  // Every few samples, those with the extremes of the force among them.
  function thinned(size, force, most) {
    if (size <= most) return Array.from({ length: size }, (_, i) => i);
    const kept = [], step = Math.ceil((2 * size) / most);
    for (let a = 0; a < size; a += step) {
      let low = a, high = a;
      for (let i = a; i < Math.min(a + step, size); i++) {
        if (force[i] < force[low]) low = i;
        if (force[i] > force[high]) high = i;
      }
      kept.push(...(low === high ? [low] : [Math.min(low, high), Math.max(low, high)]));
    }
    return kept;
  }

  function drawMotion() {
    const { time, displacement, velocity, acceleration, current: given, force: measured } = motion;
    const size = time.length, force = new Float64Array(size), flags = new Uint8Array(size);
    const current = given || new Float64Array(size).fill(condition()[0]);
    engine.begin();
    let all = 0;
    for (let i = 0; i < size; i++) {
      const dt = i ? time[i] - time[i - 1] : time[1] - time[0];
      force[i] = engine.step(displacement[i], velocity[i], acceleration[i], current[i], dt);
      if (Number.isNaN(force[i])) return say("file-message", `The model has no force at row ${i + 2} of the file: bring the motion nearer to the tests.`, "bad");
      flags[i] = engine.flags();
      all |= flags[i];
    }
    shown = { time, displacement, velocity, current, force };
    const named = facts.flags.filter((_, bit) => (all >> bit) & 1);
    say("outside", named.length ? `Extrapolated in ${named.join(", ")} where the curve is dashed. The tests do not cover this range.` : "", "warn");
    const [low, high] = extremes(force), pairs = [["Peak force, extension", `${number(high)} N`], ["Peak force, compression", `${number(low)} N`], ["Dissipated energy", `${number(energy(shown))} J`], ["Duration", `${number(time[size - 1] - time[0])} s`]];
    if (measured) {
      const [a, b] = extremes(measured), squares = force.reduce((sum, f, i) => sum + (f - measured[i]) ** 2, 0);
      pairs.push(["RMS error over peak-to-peak", b > a ? `${number(100 * Math.sqrt(squares / size) / (b - a))} %` : "–"]);
    }
    show(pairs);
    const kept = thinned(size, force, 4000), pick = (values, factor = 1) => Float64Array.from(kept, (i) => values[i] * factor);
    const inside = (i) => flags[kept[i]] === 0 && flags[kept[Math.min(i + 1, kept.length - 1)]] === 0;
    const lines = (x) => [
      ...(measured ? [{ x, y: pick(measured), kind: "measured" }] : []),
      { x, y: pick(force), skip: (i) => flags[kept[i]] !== 0 },
      ...(all ? [{ x, y: pick(force), kind: "outside", skip: inside }] : []),
    ];
    chart("over-displacement", "Force over displacement", "Displacement [mm]", "Force [N]", lines(pick(displacement, 1e3)));
    chart("over-velocity", "Force over velocity", "Velocity [mm/s]", "Force [N]", lines(pick(velocity, 1e3)));
    chart("wide", measured ? "Force over time; dark: measured" : "Force over time", "Time [s]", "Force [N]", lines(pick(time)));
  }

  let waiting = 0, later = 0;
  function draw() {
    if (waiting) return;
    waiting = requestAnimationFrame(() => {
      waiting = 0;
      const start = performance.now();
      if (motion) return drawMotion();
      drawSine();
      clearTimeout(later);
      later = setTimeout(drawCurrents, 80);
      document.documentElement.dataset.ready = (performance.now() - start).toFixed(1);
    });
  }

  // ---- a file -------------------------------------------------------------------------------------
  class Unusable extends Error {}

  function table(text) {
    const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/);
    while (lines.length && !lines.at(-1).trim()) lines.pop();
    if (lines.length < 4) throw new Unusable(`${Math.max(lines.length - 1, 0)} rows; a motion needs three or more, under a row of column names`);
    const mark = [";", "\t", ","].find((m) => lines[0].includes(m)) || ",";
    const names = lines[0].split(mark).map((n) => n.trim().replace(/^"|"$/g, ""));
    const column = (name, needed) => {
      const at = names.indexOf(name);
      if (at >= 0) return at;
      const near = names.find((n) => n.toLowerCase().startsWith(name.split("_")[0]));
      if (near !== undefined && (needed || near !== name)) throw new Unusable(`column "${near.slice(0, 40)}" where "${name}" is expected: convert it to SI and rename it`);
      if (needed) throw new Unusable(`column ${name} is missing (found ${names.slice(0, 8).join(", ").slice(0, 160)})`);
      return -1;
    };
    const wanted = { time: column("time_s", true), displacement: column("displacement_m", true), current: column("current_A"), force: column("force_N") };
    const made = {};
    for (const [key, at] of Object.entries(wanted)) if (at >= 0) made[key] = new Float64Array(lines.length - 1);
    for (let row = 1; row < lines.length; row++) {
      const cells = lines[row].split(mark);
      for (const [key, values] of Object.entries(made)) {
        const text = (cells[wanted[key]] ?? "").trim(), value = text === "" ? NaN : Number(mark === "," ? text : text.replace(",", "."));
        if (!Number.isFinite(value)) throw new Unusable(`row ${row + 1}, column ${names[wanted[key]]}: "${text.slice(0, 30)}" is not a finite number; remove or correct that row`);
        values[row - 1] = value;
      }
    }
    return made;
  }

  function checked(made) {
    const { time, displacement } = made, steps = time.slice(1).map((t, i) => t - time[i]);
    const back = steps.findIndex((s) => !(s > 0));
    if (back >= 0) throw new Unusable(`time does not increase at row ${back + 3}: sort the rows or drop the repeated ones`);
    const median = steps.slice().sort()[steps.length >> 1], wide = steps.findIndex((s) => s > 5 * median);
    if (wide >= 0) throw new Unusable(`a gap of ${number(steps[wide])} s after ${number(time[wide], 6)} s: the state of the damper is unknown after it; enter the parts separately`);
    const [low, high] = extremes(displacement);
    if (high - low < 1e-9) throw new Unusable("the displacement does not move");
    return made;
  }

  // Value, slope and curvature of quadratics fitted around each sample, over a fortieth of the motion's period.
  function smooth(time, signal) {
    const size = time.length, thin = Math.max(1, Math.floor(size / 2000));
    let mean = 0, squares = 0, moved = 0, pieces = 0, sparse = 0;
    for (let i = 0; i < size; i += thin) { mean += signal[i]; sparse++; }
    mean /= sparse;
    for (let i = 0; i < size; i += thin) {
      squares += (signal[i] - mean) ** 2;
      if (i) { moved += ((signal[i] - signal[i - thin]) / (time[i] - time[i - thin])) ** 2; pieces++; }
    }
    const period = moved > 0 ? (2 * Math.PI * Math.sqrt(squares / sparse)) / Math.sqrt(moved / pieces) : 0;
    const spacing = time.slice(1).map((t, i) => t - time[i]).sort()[(size - 1) >> 1];
    const half = Math.min(Math.max(Math.round(period / 80 / spacing), 2), Math.max((size - 1) >> 1, 1)), width = Math.min(2 * half + 1, size);
    const out = { displacement: new Float64Array(size), velocity: new Float64Array(size), acceleration: new Float64Array(size) };
    for (let i = 0; i < size; i++) {
      const start = Math.min(Math.max(i - half, 0), size - width);
      let s1 = 0, s2 = 0, s3 = 0, s4 = 0, y0 = 0, y1 = 0, y2 = 0;
      for (let j = start; j < start + width; j++) {
        const t = (time[j] - time[i]) / spacing, y = signal[j] - signal[i], tt = t * t;
        s1 += t; s2 += tt; s3 += tt * t; s4 += tt * tt; y0 += y; y1 += y * t; y2 += y * tt;
      }
      const s0 = width, A = s2 * s4 - s3 * s3, B = s1 * s4 - s2 * s3, C = s1 * s3 - s2 * s2, det = s0 * A - s1 * B + s2 * C;
      out.displacement[i] = signal[i] + (y0 * A - y1 * B + y2 * C) / det;
      out.velocity[i] = (-y0 * B + y1 * (s0 * s4 - s2 * s2) - y2 * (s0 * s3 - s1 * s2)) / det / spacing;
      out.acceleration[i] = (2 * (y0 * C - y1 * (s0 * s3 - s1 * s2) + y2 * (s0 * s2 - s1 * s1))) / det / spacing ** 2;
    }
    return out;
  }

  async function take(file) {
    say("file-message", `Reading ${file.name.slice(0, 80)} …`);
    try {
      if (file.size > MOST_BYTES) throw new Unusable(`${number(file.size / 1e6)} MB; this page reads up to ${MOST_BYTES / 1e6} MB: thin or cut the record, or use mrdamper predict --motion`);
      const made = checked(table(await file.text()));
      motion = { ...made, ...smooth(made.time, made.displacement) };
      const middle = extremes(motion.displacement).reduce((sum, x) => sum + x, 0) / 2;
      $("back").hidden = false;
      say("file-message", `${file.name.slice(0, 80)}: ${made.time.length} samples, its middle is ${number(1e3 * middle)} mm from mid-stroke${made.current ? "" : ", current from the slider"}.`);
      clearTimeout(later);
      draw();
    } catch (error) {
      say("file-message", `${file.name.slice(0, 80)}: ${error instanceof Unusable ? error.message : `it cannot be read (${error.message})`}.`, "bad");
    }
  }

  function save() {
    if (!shown) return;
    const columns = ["time", "displacement", "velocity", "current", "force"].map((key) => shown[key]);
    const rows = Array.from(shown.time, (_, i) => columns.map((c) => c[i]).join(","));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([["time_s,displacement_m,velocity_m_s,current_A,force_N", ...rows].join("\n"), "\n"], { type: "text/csv" }));
    link.download = "force.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  for (const key of ["current", "frequency", "amplitude"]) {
    const slider = $(key), field = $(`${key}-number`);
    slider.addEventListener("input", () => { field.value = slider.value; draw(); });
    field.addEventListener("input", () => { slider.value = field.value; draw(); });
  }
  $("file").addEventListener("change", (e) => { if (e.target.files[0]) take(e.target.files[0]); });
  $("back").addEventListener("click", () => {
    motion = null;
    $("back").hidden = true;
    $("file").value = "";
    say("file-message", "");
    draw();
    $("file").focus();
  });
  $("save").addEventListener("click", save);
  document.addEventListener("dragover", (e) => { e.preventDefault(); $("drop").classList.add("over"); });
  document.addEventListener("dragleave", () => $("drop").classList.remove("over"));
  document.addEventListener("drop", (e) => {
    e.preventDefault();
    $("drop").classList.remove("over");
    if (e.dataTransfer.files[0]) take(e.dataTransfer.files[0]);
  });
  window.addEventListener("resize", draw);
  draw();
})();
