// The state of the page as plain data: it can be undone, put into a link, and saved as a file.

import { knownUnits } from "./units.js";

/** True where the browser can compress a state for a link. */
export const canCompress = "CompressionStream" in globalThis;
const FORMAT = "mrdamper-state";
const VERSION = 1;
const MAX_STEPS = 200; // that can be undone
const BLANK = Object.freeze({
  view: "data", source: null, dataName: "", rig: 0, run: null,
  damper: null, document: null, condition: null, held: {}, family: false, units: knownUnits(), compareRun: null, about: {},
});

/** The state and its history. */
export class Store {
  constructor() {
    this.state = { ...BLANK };
    this.listeners = [];
    this.clearHistory();
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  /** Make a step that can be undone. */
  commit(change) {
    this.past.push(this.committed);
    if (this.past.length > MAX_STEPS) this.past.shift();
    this.future = [];
    this.amend(change);
  }

  /** Change the state without a step: another view, a slider that is being dragged. */
  update(change) {
    const before = this.state;
    this.state = { ...before, ...change };
    for (const listener of this.listeners) listener(this.state, before);
  }

  /** Make a change part of the last step: undoing keeps it. */
  amend(change) {
    this.update(change);
    this.committed = this.state;
  }

  undo() {
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  /** Forget the steps: what they refer to has been replaced. */
  clearHistory() {
    [this.past, this.future, this.committed] = [[], [], this.state];
  }

  step(from, to) {
    if (!from.length) return;
    to.push(this.committed);
    this.amend(from.pop());
  }
}

/** The part of a state that another session can use: the key of a damper belongs to this one. */
export function savedState({ damper: _damper, ...state }) {
  return { format: FORMAT, version: VERSION, ...state };
}

/** True for the text of a saved state. */
export function isState(text) {
  return formatOf(text) === FORMAT;
}

/** True for the text of a model.json. */
export function isModel(text) {
  return formatOf(text) === "mrdamper-model";
}

function formatOf(text) {
  try {
    return JSON.parse(text)?.format;
  } catch {
    return undefined;
  }
}

/** Check a saved state field by field; unknown fields are dropped. */
export function parseState(raw) {
  if (!raw || raw.format !== FORMAT) throw new Error("this is not a saved state of the app");
  if (raw.version > VERSION) throw new Error("this state was saved by a newer mrdamper; update it");
  const entries = (value, accept) => Object.fromEntries(Object.entries(value ?? {}).filter(([, v]) => accept(v)));
  const isText = (value) => typeof value === "string";
  const state = { ...BLANK, family: raw.family === true, units: knownUnits(raw.units) };
  if (["data", "identify", "model", "compare", "simulate", "export"].includes(raw.view)) state.view = raw.view;
  if (["bundled", "upload"].includes(raw.source)) state.source = raw.source;
  if (isText(raw.dataName)) state.dataName = raw.dataName.slice(0, 300);
  if (Number.isInteger(raw.rig) && raw.rig >= 0) state.rig = raw.rig;
  for (const name of ["run", "compareRun"]) if (/^run\d+$/.test(raw[name])) state[name] = raw[name];
  if (isText(raw.document)) state.document = raw.document;
  const { current_A, frequency_Hz, amplitude_m } = raw.condition ?? {};
  if ([current_A, frequency_Hz, amplitude_m].every(Number.isFinite)) state.condition = { current_A, frequency_Hz, amplitude_m };
  state.held = entries(raw.held, Number.isFinite);
  state.about = Object.fromEntries(Object.entries(entries(raw.about, isText)).slice(0, 20));
  return state;
}

/** The state as the fragment of a link. */
export async function toFragment(state) {
  const packed = await through(new CompressionStream("deflate-raw"), new TextEncoder().encode(JSON.stringify(savedState(state))));
  return "s=" + btoa(String.fromCharCode(...packed)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** The state in a fragment, or null. */
export async function fromFragment(fragment) {
  const found = /(?:^#?|&)s=([\w-]+)/.exec(fragment);
  if (!found) return null;
  const packed = Uint8Array.from(atob(found[1].replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  const text = new TextDecoder().decode(await through(new DecompressionStream("deflate-raw"), packed));
  return parseState(JSON.parse(text));
}

async function through(stream, data) {
  const body = new Blob([data]).stream().pipeThrough(stream);
  return new Uint8Array(await new Response(body).arrayBuffer());
}
