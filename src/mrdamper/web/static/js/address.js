// The state of the page in its address, so that a link, a bookmark or a reload restores it.

import { canCompress, fromFragment, parseState, savedState, toFragment } from "./state.js";
import { tabStorage } from "./storage.js";

const LAST = "mrdamper.last"; // state and damper when the page was left, for a reload
const INTERVAL_MS = 400; // between two writings while a slider moves: browsers refuse many in a row

export class Address {
  constructor(app) {
    const last = JSON.parse(tabStorage.getItem(LAST) ?? "null");
    tabStorage.removeItem(LAST);
    Object.assign(this, { app, outdated: false, writing: false, opened: { hash: location.hash, last } });
    addEventListener("pagehide", () => this.storeLast());
  }

  /**
   * Write the state into the address, at once or INTERVAL_MS after the last writing; one writing follows the
   * other, so an older state never replaces a newer. `data-address` of the page shows if the address is current.
   */
  follow() {
    if (!canCompress) return;
    this.outdated = true;
    this.mark();
    if (!this.writing) this.app.run(this.write());
  }

  async write() {
    this.writing = true;
    try {
      while (this.outdated) {
        this.outdated = false;
        history.replaceState(null, "", `#${await this.fragment()}`);
        this.mark();
        await new Promise((done) => setTimeout(done, INTERVAL_MS));
      }
    } finally {
      this.writing = false;
    }
  }

  /** The state as a fragment, the model included. */
  async fragment() {
    await this.app.includeDocument();
    return toFragment(this.app.state);
  }

  mark() {
    document.documentElement.dataset.address = this.outdated ? "behind" : "current";
  }

  /** Store the state for a reload, even one that the address does not have yet. */
  storeLast() {
    const { state } = this.app;
    tabStorage.setItem(LAST, JSON.stringify({ hash: location.hash, damper: state.damper, state: savedState(state) }));
  }

  /** The state to begin with, or null; after a reload with the damper of this session. */
  async initialState() {
    const { hash, last } = this.opened;
    return last?.hash === hash ? { ...parseState(last.state), damper: last.damper } : fromFragment(hash);
  }
}
