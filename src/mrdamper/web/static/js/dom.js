// DOM helpers. Text is inserted as text nodes only, so no name of a file or run can become markup.

const SVG = "http://www.w3.org/2000/svg";

/** Create an element: `h("button", { class: "primary", onclick: start }, "Start")`. */
export function h(tag, props = {}, ...children) {
  return fill(document.createElement(tag), props, children);
}

/** Create an SVG element. */
export function svg(tag, props = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), props, children);
}

/** Replace the children of an element; the focus stays on the element with the id that had it. */
export function render(element, ...children) {
  const focused = element.contains(document.activeElement) ? document.activeElement.id : "";
  element.replaceChildren(...children.flat(Infinity).filter(present));
  if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
  return element;
}

/** Call `choose` with the next, previous, first or last button of a bar on its key. */
export function arrowKeys(bar, buttons, choose, vertical = false) {
  bar.addEventListener("keydown", (event) => {
    const all = buttons();
    const current = all.indexOf(document.activeElement);
    const [next, previous] = [current + 1, current - 1 + all.length].map((i) => i % all.length);
    const more = vertical ? { ArrowDown: next, ArrowUp: previous } : {};
    const target = { ArrowRight: next, ArrowLeft: previous, Home: 0, End: all.length - 1, ...more }[event.key];
    if (target === undefined) return;
    event.preventDefault();
    choose(all[target]);
  });
}

/** A control that has an id, below its label. */
export function field(label, control, ...more) {
  return h("div", { class: "field" }, h("label", { for: control.id }, label), control, more);
}

/** Options of a list: pairs of value and text. */
export function options(pairs) {
  return pairs.map(([value, text]) => h("option", { value }, text));
}

/** A card with a heading. */
export function card(title, ...children) {
  return h("section", { class: "card" }, h("div", { class: "head" }, h("h2", {}, title)), ...children);
}

/** Content of an empty view: a heading, a sentence, and buttons. */
export function placeholder(title, text, ...actions) {
  return h("div", { class: "empty" }, h("h2", {}, title), h("p", {}, text), actions.length ? h("div", { class: "row" }, actions) : null);
}

/** Content of a view while its results are calculated. */
export function loading(title, text = "") {
  return h("div", { class: "empty", role: "status" }, h("span", { class: "spinner", "aria-hidden": "true" }), h("h2", {}, title), text ? h("p", {}, text) : null);
}

/** A table; columns: {title, value(row), number?}; `pick(row)` makes rows selectable, `chosen(row)` marks one. */
export function table(columns, rows, { pick, chosen, caption }) {
  const cells = (row) =>
    columns.map((c, i) => h(i === 0 ? "th" : "td", { class: c.number ? "num" : i === 0 ? "name" : "", scope: i === 0 ? "row" : null }, c.value(row)));
  const line = (row) =>
    h("tr", { class: [pick ? "pick" : "", chosen?.(row) ? "chosen" : ""].join(" ").trim(), ...(pick ? { onclick: () => pick(row) } : {}) }, cells(row));
  return h(
    "table", {},
    h("caption", { class: "hidden-text" }, caption),
    h("thead", {}, h("tr", {}, columns.map((c) => h("th", { class: c.number ? "num" : "", scope: "col" }, c.title)))),
    h("tbody", {}, rows.map(line)),
  );
}

/** Message of an error: what was found, where, and what to do; an `ApiError` has these parts as `details`. */
export function errorMessage(error) {
  const { text, found = text, where, remedy, code } = error.details ?? { text: String(error.message ?? error) };
  return h(
    "div", { class: "message bad", role: "alert" },
    h("div", {}, where ? [h("b", {}, where), ": ", found] : capitalise(found)),
    remedy ? h("div", {}, capitalise(remedy), ".") : null,
    code ? h("code", {}, code) : null,
  );
}

/** A message of a kind: "", "good", "warn" or "bad". */
export function note(kind, ...children) {
  return h("div", { class: `message ${kind}` }, ...children);
}

/** A finding of a check with its code. */
export function finding(code, text, kind = "") {
  return h("div", { class: kind }, capitalise(text), " ", h("code", {}, code));
}

/** A text with a capital letter at its beginning. */
export function capitalise(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function fill(element, props, children) {
  for (const [name, value] of Object.entries(props)) {
    if (!present(value)) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && typeof value !== "string") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter(present));
  return element;
}

function present(value) {
  return value !== null && value !== undefined && value !== false;
}
