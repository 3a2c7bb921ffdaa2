// Files: those of a drop, folders included, and files to save.

import { h } from "./dom.js";

/** List all files of a drop with their paths: [{file, name}]. */
export async function droppedFiles(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.length) return [...transfer.files].map((file) => ({ file, name: file.name }));
  const files = [];
  for (const entry of entries) await collect(entry, "", files);
  return files;
}

/** Tell if a file is a saved project: a zip whose first part has a known name. */
export async function isProject(file) {
  const head = new TextDecoder("latin1").decode(await file.slice(0, 42).arrayBuffer());
  return head.startsWith("PK\u0003\u0004") && head.endsWith("project.json");
}

/** Save a file. */
export function save(blob, name) {
  const href = URL.createObjectURL(blob);
  h("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}

async function collect(entry, path, files) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    if (!file.name.startsWith(".")) files.push({ file, name: path + file.name });
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return;
    for (const child of some) await collect(child, `${path}${entry.name}/`, files);
  }
}
