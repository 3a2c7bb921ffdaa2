// Asking the bench. Every answer that is no success becomes a BenchError with what to show.

import { tabStorage } from "./storage.js";

export class BenchError extends Error {
  constructor(said, status) {
    super(said.text);
    this.said = said;
    this.status = status;
  }
}

const TOKEN = "mrdamper.token";

/** What the printed address holds: kept for loading the page again, and taken out of the address. */
function token() {
  const given = new URLSearchParams(location.search).get("token");
  if (given) {
    tabStorage.setItem(TOKEN, given);
    history.replaceState(history.state, "", location.pathname + location.hash);
  }
  return tabStorage.getItem(TOKEN) ?? "";
}

const RETRIES = 4; // of a progress stream that broke off

export class Api {
  constructor(session) {
    this.base = `/api/sessions/${session}`;
  }

  /** Open a session. */
  static async open() {
    const headers = { "X-Bench-Token": token() };
    return (await answer(await send("/api/sessions", { method: "POST", headers }))).json();
  }

  url(path) {
    return this.base + path;
  }

  async get(path) {
    return (await this.ask("GET", path)).json();
  }

  async post(path, body = {}) {
    return (await this.ask("POST", path, body)).json();
  }

  async delete(path) {
    return (await this.ask("DELETE", path)).json();
  }

  /** Arrays, by GET or with a body by POST: {head, arrays: {name: Float32Array}}. */
  async frame(path, body) {
    const response = await this.ask(body === undefined ? "GET" : "POST", path, body);
    return unpack(await response.arrayBuffer());
  }

  /** A file to be saved, by POST: {blob, name}. */
  async file(path, body) {
    const response = await this.ask("POST", path, body);
    const name = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? "mrdamper";
    return { blob: await response.blob(), name };
  }

  async upload(path, file) {
    return (await answer(await send(this.base + path, { method: "PUT", body: file }))).json();
  }

  /** Follow a job; `tell` gets every report, the promise the last. */
  follow(job, tell) {
    return new Promise((resolve, reject) => {
      const source = new EventSource(this.url(`/jobs/${job}/events`));
      let failures = 0;
      source.onmessage = (event) => {
        failures = 0;
        const report = JSON.parse(event.data);
        tell(report);
        if (!["waiting", "running"].includes(report.state)) {
          source.close();
          resolve(report);
        }
      };
      source.onerror = () => {
        failures += 1; // the browser tries again by itself
        if (failures < RETRIES && source.readyState !== EventSource.CLOSED) return;
        source.close();
        reject(lost());
      };
    });
  }

  async ask(method, path, body) {
    const options = { method };
    if (body !== undefined) {
      options.headers = { "Content-Type": "application/json" };
      options.body = JSON.stringify(body);
    }
    return answer(await send(this.base + path, options));
  }
}

async function send(path, options) {
  try {
    return await fetch(path, options);
  } catch {
    throw lost();
  }
}

function lost() {
  return new BenchError({ text: "the bench does not answer", found: "the bench does not answer", remedy: "start mrdamper serve again and load the page", code: "E_OFFLINE" }, 0);
}

async function answer(response) {
  if (response.ok) return response;
  let said;
  try {
    said = await response.json();
  } catch {
    said = { text: `the bench answered ${response.status}` };
  }
  throw new BenchError(said, response.status);
}

function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  let at = 4 + length;
  for (const [name, size] of head.arrays) {
    arrays[name] = new Float32Array(buffer, at, size);
    at += 4 * size;
  }
  return { head, arrays };
}

/**
 * Of many questions in a row, the newest counts: "latest wins". The next is sent as soon as an
 * answer is there, before it is drawn, so that asking and drawing overlap.
 */
export class Latest {
  constructor(ask, show, fail) {
    Object.assign(this, { ask, show, fail, waiting: null, asking: false });
  }

  /** Whether something is being asked. */
  get busy() {
    return this.asking;
  }

  want(question) {
    this.waiting = question;
    if (!this.asking) this.next();
  }

  async next() {
    const question = this.waiting;
    this.waiting = null;
    this.asking = true;
    let [found, trouble] = [null, null];
    try {
      found = await this.ask(question);
    } catch (error) {
      trouble = error;
    }
    this.asking = false;
    if (this.waiting !== null) this.next();
    try {
      if (trouble) throw trouble;
      await this.show(found, question);
    } catch (error) {
      this.fail(error);
    }
  }
}
