// Storage of the browser; where the browser blocks it, storage of this page alone.

function storage(name) {
  try {
    window[name].getItem("");
    return window[name];
  } catch {
    const entries = new Map();
    return {
      blocked: true,
      getItem: (key) => entries.get(key) ?? null,
      setItem: (key, value) => entries.set(key, value),
      removeItem: (key) => entries.delete(key),
    };
  }
}

/** Storage of this tab, until it is closed. */
export const tabStorage = storage("sessionStorage");

/** Storage of this browser. */
export const browserStorage = storage("localStorage");
