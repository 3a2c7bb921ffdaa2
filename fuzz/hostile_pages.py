"""Whole results of dampers, runs, rigs and files with hostile names: what is written is parsed, and holds no canary."""

from __future__ import annotations

import csv
import io
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fuzz.counting import NASTY, Count, names, sample_damper, within

MEANT = (
    "$x_{$",
    "$\\frac{$",
    "_hidden",
    "$",
    "</title>",
    '"></script><script>canary()</script>',
    "' onload=canary() '",
)
COMMANDS = (
    "study set --out study", "compare set --models bingham --models biviscous --out compare", "report set --out report",
    "check set --figure loops.svg", "fleet line --out fleet --workers 1", "export study/model.json --to page --out d.html",
    "simulate quarter-car --input bump --damper study/model.json --current 1 --step 0.002 --out ride",
)  # fmt: skip


def attack_exports(share: float) -> list[Count]:
    """Every way a damper leaves, its rig by a hostile name; and the model, saved and loaded again."""
    from mrdamper.dampers.model_file import dump_model, parse_model
    from mrdamper.exporters import all_exporters

    damper = sample_damper()
    count, saved, rng = Count("whole export of a named rig"), Count("model of a named rig, saved"), random.Random(2)
    exporters = {form: kind(platforms=()) if form == "fmu" else kind() for form, kind in all_exporters().items()}
    usual = {form: _scripts(exporter.export(damper, "damper").files) for form, exporter in exporters.items()}
    with tempfile.TemporaryDirectory() as folder:
        for rig in within([*MEANT, *names(len(NASTY), rng)][: max(4, int((len(MEANT) + len(NASTY)) * share))]):
            named = replace(damper, rig=rig)
            for form, exporter in exporters.items():
                files = exporter.export(named, "damper").files
                count.check(_scripts(files) == usual[form], (form, "further scripts", rig))
                for name, content in files.items():
                    said = unsound(name, content)
                    count.check(not said, (name, said, rig))
                if form == "c" and shutil.which("cc"):
                    count.check(_compiles(Path(folder), files), (form, rig))
            try:
                saved.check(parse_model(dump_model(named)).rig == rig, rig)
            except ValueError as error:
                saved.check(hasattr(error, "code"), (rig, error))
    return [count, saved]


def attack_pages(share: float) -> list[Count]:
    """Every command that writes pages and figures, its rig, runs, remarks, folders and dampers by hostile names."""
    from benchmarks.synthetic_fleet import Population
    from mrdamper.errors import InputError
    from mrdamper.rig_files.dataset_folder import save_dataset

    count, ran = Count("whole result of named runs"), Count("command on named runs")
    dataset, rng = next(iter(Population(dampers=1, sessions=1, golden=0))).dataset(), random.Random(8)

    def allowed(name: str) -> bool:
        try:
            return bool(name) and bool(replace(dataset.runs[0], id=name, rig=name))
        except InputError:
            return False

    known = [name for name in [*MEANT, *names(len(NASTY) + 60, rng)] if allowed(name)]
    for round_ in within(range(max(1, int(6 * share)))):
        chosen = [*MEANT[-2:], *rng.sample(known, len(dataset) + 4)][:: 1 if round_ % 2 else -1]
        runs = [
            replace(run, id=f"{name} {i}"[-255:], rig=chosen[-1], notes={**run.notes, name: name})
            for i, (run, name) in enumerate(zip(dataset, chosen, strict=False))
        ]
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            hostile = replace(dataset, runs=tuple(runs), name=chosen[-2])
            save_dataset(hostile, root / "set")
            for name in chosen[-3:]:
                part = re.sub(r"[/\0]", "|", name)[:60].strip(".") or "x"
                save_dataset(hostile, root / "line" / part)
            for line in COMMANDS:
                done = subprocess.run(
                    [sys.executable, "-m", "mrdamper", *line.split()], cwd=root, capture_output=True, check=False
                )
                said = done.stderr.decode(errors="replace").strip()
                typed = done.returncode == 0 or (done.returncode == 2 and re.search(r"\[E_\w+\]$", said))
                ran.check(bool(typed), (line, said[-200:], chosen))
                shown = (
                    re.sub(rb"\x1b\[[\d;?]*[a-zA-Z]", b"", done.stderr) + done.stdout
                )  # a bar moves the cursor itself
                ran.check(
                    not re.search(rb"[\x00-\x08\x0e-\x1f]", shown.replace(b"\r", b"")), (line, "control characters")
                )
            for path in sorted(root.rglob("*")):
                if path.is_file() and "set" not in path.parts and "line" not in path.relative_to(root).parts[:1]:
                    found = unsound(path.name, path.read_bytes())
                    count.check(not found, (path.relative_to(root).as_posix(), found, chosen))
    return [ran, count]


def unsound(name: str, content: bytes) -> str:
    """Fault of a file that somebody will open; empty where a name stayed a name."""
    kind = name.rsplit(".", 1)[-1]
    try:
        if kind == "html":
            return _unsound_page(content.decode())
        if kind in ("svg", "xml"):
            tags = [element.tag.rsplit("}", 1)[-1] for element in ElementTree.fromstring(content).iter()]
            return "a script" if "script" in tags else ""
        if kind == "json":
            json.loads(content)
        elif kind == "csv":
            rows = list(csv.reader(io.StringIO(content.decode(), newline="")))
            numbers = re.compile(r"[+-]?[\d.]|[+-]?(inf|nan)")
            cells = [cell for row in rows for cell in row if re.match(r"[=+\-@\t\r]", cell) and not numbers.match(cell)]
            return f"a formula {cells[0]}" if cells else "" if len({len(row) for row in rows}) == 1 else "a broken row"
        elif kind == "tex":
            return "a command" if re.search(rb"\\(input|write|frac\{\$)", content) else ""
        elif kind == "pdf":
            return "a script" if re.search(rb"/(JavaScript|Launch)\b", content) else ""
        elif kind == "fmu":
            with zipfile.ZipFile(io.BytesIO(content)) as parts:
                return "".join(unsound(part, parts.read(part)) for part in parts.namelist())
    except (ValueError, ElementTree.ParseError, zipfile.BadZipFile) as error:
        return repr(error)
    return ""


def _unsound_page(text: str) -> str:
    seen: list[str] = []

    def started(tag: str, attributes: list[tuple[str, str | None]]) -> None:
        bad = [key for key, value in attributes if "canary" in key or (key[:2] == "on" and "canary" in str(value))]
        links = [value for key, value in attributes if key in ("href", "src") and str(value).startswith("javascript:")]
        seen.extend([*bad, *links, *([tag] if "canary" in tag else [])])

    for script in re.findall(r"<script[^>]*>(.*?)</script", text, re.DOTALL | re.IGNORECASE):
        if re.match(r"\s*canary", script):
            seen.append("canary runs")
    parser = HTMLParser()
    parser.handle_starttag = started  # type: ignore[method-assign]
    parser.feed(text)
    return ", ".join(seen)


def _scripts(files: dict[str, Any]) -> int:
    return sum(content.lower().count(b"<script") for name, content in files.items() if name.endswith(".html"))


def _compiles(folder: Path, files: dict[str, Any]) -> bool:
    for name in ("damper.h", "damper.c"):
        (folder / name).write_bytes(files[name])
    command = ["cc", "-std=c99", "-trigraphs", "-Wcomment", "-Werror", "-c", "damper.c"]
    if subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode:
        return False
    return b"canary" not in subprocess.run(["nm", "damper.o"], cwd=folder, capture_output=True, check=False).stdout
