// Requests to the server, and the session of the page. A response that is no success becomes an ApiError.

import { tabStorage } from "./storage.js";

const [SESSION, TOKEN] = ["mrdamper.session", "mrdamper.token"];
const RETRIES = 4; // of a progress stream that broke off

/** An error to display; `details`: {found, where, remedy, code} or {text, code}. */
export class ApiError extends Error {
  constructor(details, status = 0) {
    super(details.text ?? details.found);
    Object.assign(this, { details, status });
  }
}

/** Requests of one session. */
export class Api {
  constructor(session) {
    this.base = `/api/sessions/${session}`;
  }

  url(path) {
    return this.base + path;
  }

  async get(path) {
    return (await this.send("GET", path)).json();
  }

  async post(path, body = {}) {
    return (await this.send("POST", path, body)).json();
  }

  async delete(path) {
    return (await this.send("DELETE", path)).json();
  }

  /** Arrays, by GET or with a body by POST: {head, arrays: {name: Float32Array}}. */
  async frame(path, body) {
    const response = await this.send(body === undefined ? "GET" : "POST", path, body);
    return unpack(await response.arrayBuffer());
  }

  /** A file to save, by POST: {blob, name}. */
  async file(path, body) {
    const response = await this.send("POST", path, body);
    const name = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? "mrdamper";
    return { blob: await response.blob(), name };
  }

  upload(path, file) {
    return request("PUT", this.url(path), { body: file });
  }

  /** Follow a job: `onReport` receives every report, the promise resolves to the last. */
  follow(job, onReport) {
    return new Promise((resolve, reject) => {
      const source = new EventSource(this.url(`/jobs/${job}/events`));
      let failures = 0;
      source.onmessage = (event) => {
        failures = 0;
        const report = JSON.parse(event.data);
        onReport(report);
        if (["waiting", "running"].includes(report.state)) return;
        source.close();
        resolve(report);
      };
      source.onerror = () => {
        failures += 1; // the browser connects again by itself
        if (failures < RETRIES && source.readyState !== EventSource.CLOSED) return;
        source.close();
        reject(offline());
      };
    });
  }

  send(method, path, body) {
    const json = { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
    return request(method, this.url(path), body === undefined ? {} : json);
  }
}

/** The session of this tab, continued after a reload, or a new one: {api, limits, data}; `data` where some are loaded. */
export async function openSession() {
  const stored = tabStorage.getItem(SESSION);
  if (stored) {
    const { session, limits } = JSON.parse(stored);
    const api = new Api(session);
    try {
      return { api, limits, data: (await api.get("")).data };
    } catch {
      forgetSession();
    }
  }
  const { session, limits } = await (await request("POST", "/api/sessions", { headers: { "X-App-Token": token() } })).json();
  tabStorage.setItem(SESSION, JSON.stringify({ session, limits }));
  return { api: new Api(session), limits, data: null };
}

/** Forget a session that has ended. */
export function forgetSession() {
  tabStorage.removeItem(SESSION);
}

/** Store the token of an address, or one that is given alone, for this tab. */
export function storeToken(text) {
  tabStorage.setItem(TOKEN, /[?&]token=([^&#]+)/.exec(text)?.[1] ?? text.trim());
}

/** The token in the printed address: stored for a reload, and removed from the address. */
function token() {
  if (new URLSearchParams(location.search).has("token")) {
    storeToken(location.search);
    history.replaceState(history.state, "", location.pathname + location.hash);
  }
  return tabStorage.getItem(TOKEN) ?? "";
}

async function request(method, url, settings) {
  const response = await fetch(url, { method, ...settings }).catch(() => Promise.reject(offline()));
  if (response.ok) return response;
  throw new ApiError(await response.json().catch(() => ({ text: `the app responded with status ${response.status}` })), response.status);
}

function offline() {
  return new ApiError({ found: "the app does not respond", remedy: "start mrdamper serve again and load the page again", code: "E_OFFLINE" });
}

function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  let offset = 4 + length;
  for (const [name, size] of head.arrays) {
    arrays[name] = new Float32Array(buffer, offset, size);
    offset += 4 * size;
  }
  return { head, arrays };
}

/**
 * Requests of which only the newest counts. The next is sent as soon as a response arrives, before that
 * response is drawn, so that calculation and drawing overlap.
 */
export class Latest {
  constructor(fetch, show, fail) {
    Object.assign(this, { fetch, show, fail, waiting: null, busy: false });
  }

  request(query) {
    this.waiting = query;
    if (!this.busy) this.next();
  }

  async next() {
    const query = this.waiting;
    [this.waiting, this.busy] = [null, true];
    const response = this.fetch(query);
    await Promise.allSettled([response]);
    this.busy = false;
    if (this.waiting !== null) this.next();
    try {
      await this.show(await response, query);
    } catch (error) {
      this.fail(error);
    }
  }
}
