// Charts: the library of the plotly package, dressed in the page's colours.

import { paint } from "./colours.js";
import { h, renew } from "./dom.js";
import { heading } from "./format.js";
import { legend } from "./legend.js";
import { onScreen } from "./units.js";

const LOOK = { margin: { l: 64, r: 38, t: 10, b: 50 }, pad: 0.04, growth: 0.25 };
let loading = null;

/** Load the library once. */
export function library() {
  loading ??= new Promise((resolve, reject) => {
    // The bundle adds a style element for maps, which are not used here and which the content
    // security policy would refuse: it is not added while the bundle loads.
    const head = document.head;
    head.appendChild = (node) => (node instanceof HTMLStyleElement ? node : Node.prototype.appendChild.call(head, node));
    const script = h("script", { src: "/static/plotly.js" });
    const done = (end) => () => {
      delete head.appendChild;
      end(window.Plotly);
    };
    script.addEventListener("load", done(resolve));
    script.addEventListener("error", done(() => reject(new Error("the chart library did not load"))));
    head.append(script);
  });
  return loading;
}

/** One chart in a card. */
export class Chart {
  /** `title`, axes `x` and `y` as [name, unit of what is drawn] or a title, `name` of an image file; `zero` lets x begin there. */
  constructor({ title, x, y, name, keys = false, zero = false, layout = () => ({}) }) {
    Object.assign(this, { title, x, y, name, zero, more: layout, ranges: null, revision: 0 });
    this.held = false; // while something is dragged: the axes stay, and grow where they must
    // No picture, for its tool bar takes the focus; named before anything is drawn.
    this.plot = h("div", { class: "plot", role: "group", "aria-label": title });
    this.keys = keys ? h("div", { class: "keys-place" }) : null;
    const save = h("button", { class: "quiet save", "aria-label": `Save “${title}” as an image`, title: "Save as an image", onclick: () => this.save() }, "PNG");
    this.frame = h("div", { class: "frame" }, this.plot);
    this.element = h("section", { class: "card chart", "aria-label": title },
      h("div", { class: "chart-head" }, h("h3", {}, title), this.keys, save), this.frame);
    this.traces = [];
    this.shown = ""; // the keys that stand beside the title
    new ResizeObserver(() => this.drawn && this.plot.offsetWidth && window.Plotly.Plots.resize(this.plot)).observe(this.plot);
    document.addEventListener("bench:units", () => {
      this.reset();
      if (this.drawn) this.draw(this.given).catch(console.warn);
    });
    document.addEventListener("themechange", () => this.drawn && this.redraw());
  }

  /** Show curves: [{x, y, name, color, width, dash, mode, ...}]. `summary` is what a screen reader says. */
  draw(traces, summary = "") {
    const before = this.traces;
    this.given = traces;
    const [x, y] = [this.x, this.y].map((axis) => (Array.isArray(axis) ? onScreen(axis[1]).factor : 1));
    this.traces = traces.map((t) => ({ ...t, x: scaled(t.x, x), y: scaled(t.y, y) }));
    if (this.held && this.drawn && alike(before, this.traces) && this.fits(this.traces)) return this.move(before);
    this.plot.setAttribute("aria-label", `${this.title}. ${summary}`);
    return this.redraw();
  }

  /** Forget zoom and ranges: what is shown is something else now. */
  reset() {
    this.ranges = null;
    this.revision += 1;
  }

  /** Whether curves stay inside the axes shown, and marks have something drawn to be moved. */
  fits(traces) {
    const enough = this.ranges && traces.every((t, i) => t.mode !== "markers" || t.x.length <= this.marks[i]);
    if (!enough) return false;
    const wanted = spans(traces, this.ranges, this.zero);
    return wanted.x === this.ranges.x && wanted.y === this.ranges.y;
  }

  /**
   * While a slider is dragged and the axes are held, only lines and marks move: they are moved here
   * and nothing else is drawn anew. The library draws all of it once the drag ends.
   */
  move(before) {
    const area = this.plot.querySelector(".nsewdrag");
    const [width, height] = [area.width.baseVal.value, area.height.baseVal.value];
    const { xaxis, yaxis } = this.plot.layout; // with the reader's zoom in it
    const place = (range, size) => [size / (range[1] - range[0]), range[0]];
    const [[sx, x0], [sy, y0]] = [place(xaxis.range, width), place(yaxis.range, height)];
    this.traces.forEach((t, i) => {
      if (t.x === before[i].x && t.y === before[i].y) return;
      const group = this.plot.querySelector(`.scatterlayer .tracecurve${i}`);
      if (!group) return;
      if (t.mode === "markers") {
        group.querySelectorAll(".points path").forEach((mark, k) => {
          const there = k < t.x.length;
          mark.setAttribute("visibility", there ? "visible" : "hidden");
          if (there) mark.setAttribute("transform", `translate(${sx * (t.x[k] - x0)},${height - sy * (t.y[k] - y0)})`);
        });
      } else {
        if (t.x.length) group.querySelector(".js-line")?.setAttribute("d", path(t, sx, x0, sy, y0, height));
      }
    });
  }

  async redraw() {
    const Plotly = window.Plotly ?? (await library());
    this.showKeys();
    const data = this.traces.map((t, i) => ({ ...trace(t), uid: `curve${i}` }));
    this.ranges = spans(this.traces, this.held ? this.ranges : null, this.zero);
    this.marks = this.traces.map((t) => t.x.length);
    await Plotly.react(this.plot, data, this.layout(), this.config());
    this.drawn = true;
    this.oneTabStop();
  }

  /** The tool bar is one stop of the Tab key; arrow keys move inside it. */
  oneTabStop() {
    const buttons = [...this.plot.querySelectorAll(".modebar-btn")];
    buttons.forEach((button, i) => (button.tabIndex = i ? -1 : 0));
    const bar = this.plot.querySelector(".modebar");
    if (!bar || bar.dataset.keys) return;
    bar.dataset.keys = "arrows";
    bar.addEventListener("keydown", (event) => {
      const all = [...bar.querySelectorAll(".modebar-btn")];
      const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      all[(all.indexOf(document.activeElement) + step + all.length) % all.length].focus();
    });
  }

  showKeys() {
    if (!this.keys) return;
    const wanted = legend(this.traces);
    if (this.shown !== wanted.outerHTML) renew(this.keys, wanted);
    this.shown = wanted.outerHTML;
  }

  /** As an image file: with its title and keys, on the page's ground. */
  async save() {
    if (!this.drawn) return;
    const layout = { ...this.layout(), title: { text: plain(this.title), x: 0.02 }, showlegend: this.keys !== null, paper_bgcolor: paint("panel") };
    const { xaxis, yaxis } = this.plot.layout;
    const margin = { ...layout.margin, t: 70 };
    const figure = { data: this.traces.map(trace), layout: { ...layout, margin, xaxis: { ...layout.xaxis, range: xaxis.range }, yaxis: { ...layout.yaxis, range: yaxis.range } } };
    await window.Plotly.downloadImage(figure, { format: "png", width: 900, height: 600, scale: 2, filename: `mrdamper-${this.name}` });
  }

  layout() {
    const axis = (title, range) => ({
      title: { text: Array.isArray(title) ? heading(title[0], onScreen(title[1]).unit) : title, standoff: 8 }, range, gridcolor: paint("grid"), zerolinecolor: paint("line-strong"),
      linecolor: paint("line-strong"), ticks: "outside", ticklen: 4, tickcolor: paint("line-strong"),
      // No powers: the library writes them as styled markup, which the content security policy refuses.
      automargin: false, hoverformat: ".4~g", exponentformat: "none", separatethousands: false,
    });
    const size = parseFloat(getComputedStyle(document.documentElement).fontSize) / 15;
    return {
      margin: { l: LOOK.margin.l * size, r: LOOK.margin.r, t: LOOK.margin.t, b: LOOK.margin.b * size },
      xaxis: axis(this.x, this.ranges.x), yaxis: axis(this.y, this.ranges.y),
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: getComputedStyle(document.body).fontFamily, size: 12 * size, color: paint("text") },
      showlegend: false, // the keys stand beside the title; an image file has them inside
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", font: { size: 11.5 * size }, bgcolor: "rgba(0,0,0,0)" },
      hovermode: "closest", hoverlabel: { font: { size: 12 * size }, namelength: 40 }, dragmode: "zoom",
      modebar: { orientation: "v", bgcolor: "rgba(0,0,0,0)", color: paint("faint"), activecolor: paint("accent") },
      uirevision: this.revision, autosize: true, ...this.more(),
    };
  }

  config() {
    return {
      displaylogo: false, responsive: false,
      // Just these: the library's own choice offers to send a chart to its maker.
      modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]],
    };
  }
}

/**
 * A curve as an SVG path in pixels. Points that lie on the line through the two kept before them, to an
 * eighth of a pixel, change no picture and are left out; a curve that turns back keeps its tip.
 */
function path(t, sx, x0, sy, y0, height) {
  const last = t.x.length - 1;
  let [px, py] = [sx * (t.x[0] - x0), height - sy * (t.y[0] - y0)];
  let text = `M${px.toFixed(1)},${py.toFixed(1)}`;
  let [ux, uy, reach] = [0, 0, 0]; // direction from the point kept last, and how far along it the curve has come
  let [qx, qy] = [px, py]; // the point before
  for (let k = 1; k <= last; k += 1) {
    const x = sx * (t.x[k] - x0);
    const y = height - sy * (t.y[k] - y0);
    if (reach) {
      const along = (x - px) * ux + (y - py) * uy;
      const aside = (x - px) * uy - (y - py) * ux;
      if (along < reach || aside > 0.125 || aside < -0.125) {
        text += `L${Math.round(10 * qx) / 10},${Math.round(10 * qy) / 10}`;
        [px, py, reach] = [qx, qy, 0];
      } else {
        reach = along;
      }
    }
    if (!reach) {
      const size = Math.hypot(x - px, y - py);
      if (size > 0.5) [ux, uy, reach] = [(x - px) / size, (y - py) / size, size];
    }
    qx = x;
    qy = y;
  }
  return `${text}L${Math.round(10 * qx) / 10},${Math.round(10 * qy) / 10}`;
}

const scales = new WeakMap(); // arrays in the unit of the screen: what is drawn again is the same array

/** Values times a factor. */
function scaled(values, factor) {
  if (factor === 1) return values;
  if (scales.get(values)?.factor !== factor) scales.set(values, { factor, scaled: values.map((value) => factor * value) });
  return scales.get(values).scaled;
}

/** Whether two lists of curves differ in their points only, so that what is drawn can be moved. */
function alike(before, now) {
  const look = (t) => [t.color, t.dash, t.width, t.mode, t.x.length > 0 || t.mode === "markers"].join("|");
  return before.length === now.length && now.every((t, i) => look(t) === look(before[i]));
}

/** A library trace from one of ours. Names are shown as text: the library would read some tags as markup. */
function trace(t) {
  const color = paint(t.color);
  return {
    type: "scatter", mode: t.mode ?? "lines", cliponaxis: t.mode !== "markers", x: t.x, y: t.y, name: plain(t.name ?? ""), showlegend: Boolean(t.name) && t.legend !== false,
    line: { color, width: t.width ?? 2, dash: t.dash ?? "solid", simplify: true, shape: "linear" },
    marker: { color: t.fill ? paint(t.fill) : color, size: t.size ?? 7, line: { color, width: 1.5 } },
    text: t.text?.map(plain), hovertemplate: t.hover, hoverinfo: t.hover === undefined && t.quiet ? "skip" : undefined, opacity: t.opacity ?? 1,
  };
}

/** Text the library prints as it is: its markup begins with < and its templates with %. */
export function plain(text) {
  return String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;").replaceAll("%{", "% {");
}

/** Ranges that hold all points, and those shown before where the axes are held. */
function spans(traces, before, zero) {
  const range = (name, first) => {
    let low = before ? before[name][0] : Infinity;
    let high = before ? before[name][1] : -Infinity;
    let grown = false;
    for (const t of traces) {
      for (const value of t[name]) {
        if (value < low) { low = value; grown = true; }
        if (value > high) { high = value; grown = true; }
      }
    }
    if (!Number.isFinite(low)) return [0, 1];
    if (before && !grown) return before[name];
    if (first && low > 0) low = 0;
    const pad = (before ? LOOK.growth : LOOK.pad) * (high - low || Math.abs(high) || 1);
    return [first && low === 0 ? 0 : low - pad, high + pad];
  };
  return { x: range("x", zero), y: range("y", zero) };
}
