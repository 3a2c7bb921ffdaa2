// Charts: the library of the plotly package in the colours of the page.

import { paint } from "./colours.js";
import { arrowKeys, h, render } from "./dom.js";
import { heading } from "./format.js";
import { legend } from "./legend.js";
import { onScreen } from "./units.js";

const LOOK = { margin: { l: 64, r: 38, t: 10, b: 50 }, pad: 0.04, growth: 0.25 };
const CONFIG = {
  displaylogo: false, responsive: false,
  modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]], // the default can upload a chart
};
let promise = null;

/** Load the library once. */
export function library() {
  promise ??= new Promise((resolve, reject) => {
    // The bundle adds a style element for maps, which are not used here and which the content
    // security policy would refuse: it is not added while the bundle loads.
    const { head } = document;
    head.appendChild = (node) => (node instanceof HTMLStyleElement ? node : Node.prototype.appendChild.call(head, node));
    const onload = () => resolve(window.Plotly);
    const onerror = () => reject(new Error("the chart library did not load"));
    head.append(h("script", { src: "/static/plotly.js", onload, onerror }));
  }).finally(() => delete document.head.appendChild);
  return promise;
}

/** One chart in a card. */
export class Chart {
  /** `title`, axes `x` and `y` as [name, unit of the values] or a title, `name` of an image file; `zero`: x begins at 0. */
  constructor({ title, x, y, name, keys = false, zero = false, layout = () => ({}) }) {
    Object.assign(this, { title, x, y, name, zero, extraLayout: layout, ranges: null, revision: 0 });
    this.axesHeld = false; // while a slider is dragged: the axes only grow
    // Its role is not "img", since its tool bar takes the focus; it has a name before it is drawn.
    this.plot = h("div", { class: "plot", role: "group", "aria-label": title });
    this.keys = keys ? h("div", {}) : null;
    const save = h("button", { class: "quiet save", "aria-label": `Save “${title}” as an image`, title: "Save as an image", onclick: () => this.save() }, "PNG");
    this.frame = h("div", { class: "frame" }, this.plot);
    this.element = h("section", { class: "card chart", "aria-label": title },
      h("div", { class: "chart-head" }, h("h3", {}, title), this.keys, save), this.frame);
    this.traces = [];
    this.keysShown = ""; // markup of the legend beside the title
    new ResizeObserver(() => this.drawn && this.plot.offsetWidth && window.Plotly.Plots.resize(this.plot)).observe(this.plot);
    document.addEventListener("app:units", () => {
      this.reset();
      if (this.drawn) this.draw(this.unscaled).catch(console.warn);
    });
    document.addEventListener("themechange", () => this.drawn && this.redraw());
  }

  /** Show curves: [{x, y, name, color, width, dash, mode, ...}]. `summary` is the text for screen readers. */
  draw(traces, summary = "") {
    const before = this.traces;
    this.unscaled = traces;
    const [x, y] = [this.x, this.y].map((axis) => (Array.isArray(axis) ? onScreen(axis[1]).factor : 1));
    this.traces = traces.map((t) => ({ ...t, x: scaled(t.x, x), y: scaled(t.y, y) }));
    if (this.axesHeld && this.drawn && sameStyle(before, this.traces) && this.fits(this.traces)) return this.move(before);
    this.plot.setAttribute("aria-label", `${this.title}. ${summary}`);
    return this.redraw();
  }

  /** Forget zoom and ranges, for other content. */
  reset() {
    this.ranges = null;
    this.revision += 1;
  }

  /** True if curves stay inside the axes, and there are no more marks than were drawn. */
  fits(traces) {
    if (!this.ranges || !traces.every((t, i) => t.mode !== "markers" || t.x.length <= this.marks[i])) return false;
    const { x, y } = axisRanges(traces, this.ranges, this.zero);
    return x === this.ranges.x && y === this.ranges.y;
  }

  /** Move lines and marks while the axes are held; the library draws everything when the drag ends. */
  move(before) {
    const area = this.plot.querySelector(".nsewdrag");
    const [width, height] = [area.width.baseVal.value, area.height.baseVal.value];
    const { xaxis, yaxis } = this.plot.layout; // zoomed by the user
    const scale = (range, size) => [size / (range[1] - range[0]), range[0]];
    const [[sx, x0], [sy, y0]] = [scale(xaxis.range, width), scale(yaxis.range, height)];
    this.traces.forEach((t, i) => {
      if (t.x === before[i].x && t.y === before[i].y) return;
      const group = this.plot.querySelector(`.scatterlayer .tracecurve${i}`);
      if (!group) return;
      if (t.mode === "markers") {
        group.querySelectorAll(".points path").forEach((mark, k) => {
          const visible = k < t.x.length;
          mark.setAttribute("visibility", visible ? "visible" : "hidden");
          if (visible) mark.setAttribute("transform", `translate(${sx * (t.x[k] - x0)},${height - sy * (t.y[k] - y0)})`);
        });
      } else if (t.x.length) {
        group.querySelector(".js-line")?.setAttribute("d", path(t, sx, x0, sy, y0, height));
      }
    });
  }

  async redraw() {
    const Plotly = window.Plotly ?? (await library());
    const keys = this.keys && legend(this.traces);
    if (keys && this.keysShown !== keys.outerHTML) render(this.keys, keys);
    this.keysShown = keys?.outerHTML;
    const data = this.traces.map((t, i) => ({ ...trace(t), uid: `curve${i}` }));
    this.ranges = axisRanges(this.traces, this.axesHeld ? this.ranges : null, this.zero);
    this.marks = this.traces.map((t) => t.x.length);
    await Plotly.react(this.plot, data, this.layout(), CONFIG);
    this.drawn = true;
    this.makeToolBarOneTabStop();
  }

  /** Make the tool bar one stop of the Tab key; arrow keys move inside it. */
  makeToolBarOneTabStop() {
    const buttons = () => [...this.plot.querySelectorAll(".modebar-btn")];
    buttons().forEach((button, i) => (button.tabIndex = i ? -1 : 0));
    const bar = this.plot.querySelector(".modebar");
    if (!bar || bar.dataset.keys) return;
    bar.dataset.keys = "arrows";
    arrowKeys(bar, buttons, (button) => button.focus(), true);
  }

  /** Save as an image file with title and legend, on the background of the page. */
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
      uirevision: this.revision, autosize: true, ...this.extraLayout(),
    };
  }
}

/**
 * A curve as an SVG path in pixels, without the points that lie within an eighth of a pixel on the line through
 * the two before them; the tip of a curve that turns back remains.
 */
function path(t, sx, x0, sy, y0, height) {
  let [px, py] = [sx * (t.x[0] - x0), height - sy * (t.y[0] - y0)]; // the last point of the path
  let [qx, qy] = [px, py]; // the last point of the curve
  let [ux, uy, reach] = [0, 0, 0]; // direction from the last point of the path, and length of the curve along it
  let text = `M${px.toFixed(1)},${py.toFixed(1)}`;
  const point = () => `L${Math.round(10 * qx) / 10},${Math.round(10 * qy) / 10}`;
  for (let k = 1; k < t.x.length; k += 1) {
    const [x, y] = [sx * (t.x[k] - x0), height - sy * (t.y[k] - y0)];
    if (reach) {
      const along = (x - px) * ux + (y - py) * uy;
      const aside = (x - px) * uy - (y - py) * ux;
      if (along < reach || Math.abs(aside) > 0.125) {
        text += point();
        [px, py, reach] = [qx, qy, 0];
      } else {
        reach = along;
      }
    }
    if (!reach) {
      const size = Math.hypot(x - px, y - py);
      if (size > 0.5) [ux, uy, reach] = [(x - px) / size, (y - py) / size, size];
    }
    [qx, qy] = [x, y];
  }
  return text + point();
}

const scales = new WeakMap(); // arrays in the unit of the screen: the same array whenever it is drawn again

/** Values times a factor. */
function scaled(values, factor) {
  if (factor === 1) return values;
  if (scales.get(values)?.factor !== factor) scales.set(values, { factor, scaled: values.map((value) => factor * value) });
  return scales.get(values).scaled;
}

/** True if two lists of curves differ in their points only. */
function sameStyle(before, now) {
  const style = (t) => [t.color, t.dash, t.width, t.mode, t.x.length > 0 || t.mode === "markers"].join("|");
  return before.length === now.length && now.every((t, i) => style(t) === style(before[i]));
}

/** A trace of the library from a curve. Names are text: the library would interpret some tags as markup. */
function trace(t) {
  const color = paint(t.color);
  return {
    type: "scatter", mode: t.mode ?? "lines", cliponaxis: t.mode !== "markers", x: t.x, y: t.y, name: plain(t.name ?? ""), showlegend: Boolean(t.name) && t.legend !== false,
    line: { color, width: t.width ?? 2, dash: t.dash ?? "solid", simplify: true, shape: "linear" },
    marker: { color: t.fill ? paint(t.fill) : color, size: t.size ?? 7, line: { color, width: 1.5 } },
    text: t.text?.map(plain), hovertemplate: t.hover, hoverinfo: t.hover === undefined && t.quiet ? "skip" : undefined, opacity: t.opacity ?? 1,
  };
}

/** Escape a text for the library, whose markup begins with < and whose templates begin with %. */
function plain(text) {
  return String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;").replaceAll("%{", "% {");
}

/** Ranges that contain all points, and the ranges before where the axes are held. */
function axisRanges(traces, before, zero) {
  const range = (name, fromZero) => {
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
    if (fromZero && low > 0) low = 0;
    const pad = (before ? LOOK.growth : LOOK.pad) * (high - low || Math.abs(high) || 1);
    return [fromZero && low === 0 ? 0 : low - pad, high + pad];
  };
  return { x: range("x", zero), y: range("y", zero) };
}

/** Charts of force over displacement `x` and velocity `v`; `name` begins that of an image file, `keys` has the legend. */
export function loopCharts(name, keys = null) {
  const chart = (axis, quantity, unit) =>
    new Chart({ title: `Force over ${quantity.toLowerCase()}`, x: [quantity, unit], y: ["Force", "N"], name: `${name}-force-${quantity.toLowerCase()}`, keys: axis === keys });
  return { x: chart("x", "Displacement", "mm"), v: chart("v", "Velocity", "m/s") };
}
