// Making elements. Text goes in as text nodes only, so no name of a file or run can become markup.

const SVG = "http://www.w3.org/2000/svg";

/** Make an element: `h("button", {class: "primary", onclick: start}, "Start")`. */
export function h(tag, props = {}, ...children) {
  return fill(document.createElement(tag), props, children);
}

/** Make an SVG element. */
export function svg(tag, props = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), props, children);
}

/** Replace what an element holds. */
export function put(element, ...children) {
  element.replaceChildren(...children.flat(Infinity).filter(present));
  return element;
}

/** Like `put`, for parts that are built anew while the reader is in them: the focus stays where it was. */
export function renew(element, ...children) {
  const focused = element.contains(document.activeElement) ? document.activeElement.id : "";
  put(element, ...children);
  if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
  return element;
}

/** A card with a heading. */
export function card(title, ...children) {
  return h("section", { class: "card" }, h("div", { class: "head" }, h("h2", {}, title)), ...children);
}

/** What a stage shows while there is nothing to see: a heading, a sentence, and what can be done. */
export function empty(title, text, ...actions) {
  return h("div", { class: "empty" }, h("h2", {}, title), h("p", {}, text), actions.length ? h("div", { class: "row" }, actions) : null);
}

/** What a stage shows while the bench works on it. */
export function busy(title, text = "") {
  return h("div", { class: "empty", role: "status" }, h("span", { class: "spinner", "aria-hidden": "true" }), h("h2", {}, title), text ? h("p", {}, text) : null);
}

/** A table: columns are {title, value(row), number?, head?}; `pick(row)` makes rows choosable. */
export function table(columns, rows, { pick, chosen, caption } = {}) {
  const cells = (row) =>
    columns.map((c, i) => h(i === 0 ? "th" : "td", { class: c.number ? "num" : i === 0 ? "name" : "", scope: i === 0 ? "row" : null }, c.value(row)));
  const line = (row) => {
    const props = { class: [pick ? "pick" : "", chosen?.(row) ? "chosen" : ""].join(" ").trim() };
    if (pick) props.onclick = () => pick(row);
    return h("tr", props, cells(row));
  };
  return h(
    "table", {},
    caption ? h("caption", { class: "hidden-text" }, caption) : null,
    h("thead", {}, h("tr", {}, columns.map((c) => h("th", { class: c.number ? "num" : "", scope: "col" }, c.title)))),
    h("tbody", {}, rows.map(line)),
  );
}

/** What went wrong, where, and how to correct it. */
export function problem(error) {
  const said = error.said ?? { text: String(error.message ?? error) };
  return h(
    "div", { class: "message bad", role: "alert" },
    h("div", {}, said.where ? [h("b", {}, said.where), ": "] : null, said.where ? said.found : capital(said.found ?? said.text)),
    said.remedy ? h("div", {}, capital(said.remedy), ".") : null,
    said.code ? h("code", {}, said.code) : null,
  );
}

export function note(kind, ...children) {
  return h("div", { class: `message ${kind}` }, ...children);
}

/** A sentence begins with a capital. */
export function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function fill(element, props, children) {
  for (const [name, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && typeof value !== "string") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter(present));
  return element;
}

function present(child) {
  return child !== null && child !== undefined && child !== false;
}
