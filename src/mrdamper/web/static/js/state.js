// What the page shows, as plain data: it can be undone, put into a link, and saved as a file.

import { knownUnits } from "./units.js";

/** True where the browser can pack a state into a link. */
export const packs = "CompressionStream" in globalThis;
const VERSION = 1;
const MOST = 200; // steps that can be undone
const BLANK = Object.freeze({
  view: "data", source: null, dataName: "", rig: 0, run: null,
  damper: null, document: null, condition: null, held: {}, family: false, units: knownUnits(), compareRun: null, about: {},
});
const SESSION_ONLY = ["damper"]; // keys of this session mean nothing in another

export class Store {
  constructor() {
    this.state = { ...BLANK };
    this.past = [];
    this.future = [];
    this.listeners = [];
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  /** A step that can be undone. */
  commit(change) {
    this.past.push(this.committed ?? this.state);
    if (this.past.length > MOST) this.past.shift();
    this.future = [];
    this.change(change);
    this.committed = this.state;
  }

  /** A change on the way, or one that is no step: turning a page, a slider being dragged. */
  pass(change) {
    this.committed ??= this.state;
    this.change(change);
  }

  /** A change that belongs to the steps so far: later undoing keeps it. */
  settle(change) {
    this.change(change);
    this.committed = this.state;
  }

  undo() {
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  /** Forget the steps: the data changed, and what they named is gone. */
  forget() {
    this.past = [];
    this.future = [];
    this.committed = this.state;
  }

  step(from, to) {
    if (!from.length) return;
    to.push(this.committed ?? this.state);
    const target = from.pop();
    this.change(target);
    this.committed = this.state;
  }

  change(change) {
    const before = this.state;
    this.state = { ...before, ...change };
    for (const listener of this.listeners) listener(this.state, before);
  }
}

/** The part of a state another session can use. */
export function portable(state) {
  const kept = Object.fromEntries(Object.entries(state).filter(([name]) => !SESSION_ONLY.includes(name)));
  return { format: "mrdamper-bench-state", version: VERSION, ...kept };
}

/** Check a state that came from outside, field by field; unknown fields go. */
export function imported(raw) {
  if (!raw || raw.format !== "mrdamper-bench-state") throw new Error("this is not a saved state of the app");
  if (raw.version > VERSION) throw new Error("this state was saved by a newer mrdamper; update it");
  const state = { ...BLANK };
  if (["data", "identify", "model", "compare", "ride", "takeaway"].includes(raw.view)) state.view = raw.view;
  if (["bundled", "drop"].includes(raw.source)) state.source = raw.source;
  if (typeof raw.dataName === "string") state.dataName = raw.dataName.slice(0, 300);
  if (Number.isInteger(raw.rig) && raw.rig >= 0) state.rig = raw.rig;
  for (const name of ["run", "compareRun"]) if (/^run\d+$/.test(raw[name])) state[name] = raw[name];
  if (typeof raw.document === "string") state.document = raw.document;
  const c = raw.condition;
  if (c && ["current_A", "frequency_Hz", "amplitude_m"].every((name) => Number.isFinite(c[name]))) {
    state.condition = { current_A: c.current_A, frequency_Hz: c.frequency_Hz, amplitude_m: c.amplitude_m };
  }
  state.held = Object.fromEntries(Object.entries(raw.held ?? {}).filter(([, value]) => Number.isFinite(value)));
  state.family = raw.family === true;
  state.units = knownUnits(raw.units);
  state.about = Object.fromEntries(Object.entries(raw.about ?? {}).filter(([, value]) => typeof value === "string").slice(0, 20));
  return state;
}

/** The state as the fragment of a link. */
export async function toFragment(state) {
  const packed = await through(new CompressionStream("deflate-raw"), new TextEncoder().encode(JSON.stringify(portable(state))));
  return "s=" + btoa(String.fromCharCode(...packed)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** The state a fragment holds, or null. */
export async function fromFragment(fragment) {
  const found = /(?:^#?|&)s=([\w-]+)/.exec(fragment);
  if (!found) return null;
  const packed = Uint8Array.from(atob(found[1].replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  const text = new TextDecoder().decode(await through(new DecompressionStream("deflate-raw"), packed));
  return imported(JSON.parse(text));
}

async function through(stream, data) {
  const body = new Blob([data]).stream().pipeThrough(stream);
  return new Uint8Array(await new Response(body).arrayBuffer());
}
