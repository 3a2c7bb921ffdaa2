// The session of this page on the bench, found again when the page is loaded again.

import { Api } from "./api.js";
import { tabStorage } from "./storage.js";

const SESSION = "mrdamper.session";

/** {api, limits, there}: `there` says what lies on the bench already. */
export async function openSession() {
  const known = tabStorage.getItem(SESSION);
  if (known) {
    const { session, limits } = JSON.parse(known);
    const api = new Api(session);
    try {
      const there = await api.get("");
      return { api, limits, there };
    } catch {
      forgetSession();
    }
  }
  const opened = await Api.open();
  tabStorage.setItem(SESSION, JSON.stringify({ session: opened.session, limits: opened.limits }));
  return { api: new Api(opened.session), limits: opened.limits, there: { data: null, dampers: 0 } };
}

/** It has ended. */
export function forgetSession() {
  tabStorage.removeItem(SESSION);
}
