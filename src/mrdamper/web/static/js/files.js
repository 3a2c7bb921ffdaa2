// What was dropped: files, and the files of folders, with the path each had.

/** All files of a drop: [{file, name}]. */
export async function collect(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.length) return [...transfer.files].map((file) => ({ file, name: file.name }));
  const found = [];
  for (const entry of entries) await walk(entry, "", found);
  return found;
}

export function isModel(text) {
  return format(text) === "mrdamper-model";
}

export function isState(text) {
  return format(text) === "mrdamper-bench-state";
}

/** Whether a file is a bench that was kept: a zip whose first part has the name it is known by. */
export async function isKept(file) {
  const head = new Uint8Array(await file.slice(0, 40).arrayBuffer());
  const [signature, name] = [head.slice(0, 4), head.slice(30)].map((bytes) => new TextDecoder("latin1").decode(bytes));
  return signature === "PK\u0003\u0004" && name === "bench.json";
}

/** Save something as a file. */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

function format(text) {
  try {
    return JSON.parse(text)?.format;
  } catch {
    return undefined;
  }
}

async function walk(entry, path, found) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    if (!file.name.startsWith(".")) found.push({ file, name: path + file.name });
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return;
    for (const child of some) await walk(child, `${path}${entry.name}/`, found);
  }
}
