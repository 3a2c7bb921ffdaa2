// The state of the page in its address, so that a link, a bookmark or loading it again brings it back.

import { fromFragment, imported, packs, portable, toFragment } from "./state.js";
import { tabStorage } from "./storage.js";

const LAST = "mrdamper.last"; // state and damper of this page as it was left, for loading it again
const BETWEEN = 400; // milliseconds between two writings while a slider moves: browsers refuse many in a row

const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

export class Address {
  constructor(bench) {
    const last = JSON.parse(tabStorage.getItem(LAST) ?? "null");
    tabStorage.removeItem(LAST);
    Object.assign(this, { bench, behind: false, writing: false, opened: { hash: location.hash, last } });
    addEventListener("pagehide", () => this.keep());
  }

  /**
   * The state changed: the address follows at once, or BETWEEN after it was written last. Writings
   * come one after the other, never an older state after a newer. `data-address` of the page says
   * whether the address holds what is shown.
   */
  follow() {
    if (!packs) return;
    this.behind = true;
    this.tell();
    if (!this.writing) this.write().catch((error) => this.bench.fail(error));
  }

  async write() {
    this.writing = true;
    try {
      while (this.behind) {
        this.behind = false;
        history.replaceState(null, "", `#${await this.fragment()}`);
        this.tell();
        await pause(BETWEEN);
      }
    } finally {
      this.writing = false;
    }
  }

  /** The state as a fragment, its model's document in it. */
  async fragment() {
    await this.bench.keepDocument();
    return toFragment(this.bench.state);
  }

  tell() {
    document.documentElement.dataset.address = this.behind ? "behind" : "current";
  }

  /** Leaving: loading the page again finds the state as it is, even one the address does not hold yet. */
  keep() {
    const { state } = this.bench;
    tabStorage.setItem(LAST, JSON.stringify({ hash: location.hash, damper: state.damper, state: portable(state) }));
  }

  /** The state to begin with, or null; where the same page is loaded again its damper is there too. */
  async found() {
    const { hash, last } = this.opened;
    return last?.hash === hash ? { ...imported(last.state), damper: last.damper } : fromFragment(hash);
  }
}
