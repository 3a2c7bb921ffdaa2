"""`make attack`: hostile names, models, tables and calls, killed and starved commands; counts a kind, tried and held.

Each kind is bounded, so that all end within ten minutes; `--share 0.1` takes a tenth. What did
not hold is printed with what it came from, and the exit status is 1.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np

NASTY = (
    *(
        "*/",
        "*\\/",
        "*\\/ int canary(void){return 1;} /*",
        "/*",
        "//",
        "??/",
        "\\",
        "\n",
        "\r",
        "\0",
        "\x1b[2J",
        "\u202e",
    ),
    *(
        "<script>canary()</script>",
        "]]>",
        "<!--",
        "&",
        '"',
        "'",
        "<",
        ">",
        "=cmd|' /C calc'!A0",
        "+1",
        "-1+cmd",
        "\u2028",
    ),
    *("@SUM(A1)", "\t", ";=1", ",", "\\input{canary}", "\\write18{canary}", "$", "^^5c", "%", "#", "{", "}", "`", "|"),
    *(
        "![a](javascript:canary)",
        "[a](b)",
        "../../canary",
        "..",
        "/",
        "C:\\",
        "con",
        "a" * 300,
        "é",
        "漢",
        "\U0001f600",
    ),
    *(" ", "", "MTS 810/25kN", "{{7*7}}", "{% raw %}", "%s%n"),
)


@dataclass
class Count:
    """How many of a kind were tried, and what did not hold."""

    kind: str
    tried: int = 0
    broke: list[str] = field(default_factory=list)
    began: float = field(default_factory=time.monotonic)

    def check(self, held: bool, what: object) -> None:
        """Count one."""
        self.tried += 1
        if not held:
            self.broke.append(str(what)[:400])

    def __str__(self) -> str:
        seconds = time.monotonic() - self.began
        lines = [f"{self.kind:34}{self.tried:8} tried{self.tried - len(self.broke):8} held{seconds:8.0f} s"]
        return "\n".join(lines + [f"    broke: {text}" for text in self.broke[:5]])


def names(count: int, rng: random.Random) -> Iterator[str]:
    """Hostile names: pieces that mean something somewhere, alone and together, and any characters."""
    yield from NASTY
    for _ in range(count - len(NASTY)):
        pieces = [rng.choice(NASTY) for _ in range(rng.randint(1, 5))]
        if rng.random() < 0.3:
            pieces.append("".join(chr(rng.choice([rng.randrange(0x250), rng.randrange(0xD800)])) for _ in range(9)))
        yield "".join(pieces)


def attack_names(share: float) -> list[Count]:
    """Names where they are written: C is compiled, XML and HTML parsed, Markdown rendered, CSV read again."""
    from html.parser import HTMLParser

    from markdown_it import MarkdownIt

    from mrdamper.errors import InputError
    from mrdamper.files import encoding

    counts = {kind: Count(kind) for kind in ("name in C", "name in XML and HTML", "name in LaTeX", "name in Markdown")}
    counts |= {kind: Count(kind) for kind in ("name in CSV", "name in a file name", "name in a terminal")}
    rng, comments = random.Random(1), []
    markup = MarkdownIt("commonmark").enable("table")
    folder = Path(tempfile.mkdtemp())
    for name in names(max(len(NASTY), int(10_000 * share)), rng):
        comments.append(
            f'/* {encoding.c_comment(name)}.\n * Made from a model of rig "{encoding.c_comment(name)}". */\n'
        )
        text = f'<a b="{encoding.xml(name)}">{encoding.xml(name)}</a>'
        seen: list[str] = []
        parser = HTMLParser()
        parser.handle_starttag = lambda tag, attrs, seen=seen: seen.append(tag)  # type: ignore[method-assign]
        parser.feed(text)
        try:
            element = ElementTree.fromstring(text)
            counts["name in XML and HTML"].check(not len(element) and seen == ["a"], name)
        except ElementTree.ParseError:
            counts["name in XML and HTML"].check(False, name)
        rest = re.sub(r"\\(text[a-z]+\{\}|[&%$#_{}])", "", encoding.latex(name))
        counts["name in LaTeX"].check(not re.search(r"[\\&%$#_{}^~\n]", rest), name)
        kinds = {child.type for child in markup.parseInline(encoding.markdown(name))[0].children or ()}
        counts["name in Markdown"].check(kinds <= {"text", "text_special"}, name)
        rows = list(csv.reader(io.StringIO(encoding.csv_text([{"a": name, "b": "end"}]), newline="")))
        cell = rows[1][0]
        held = len(rows) == 2 and rows[1][1] == "end" and encoding.csv_value(cell) == name
        counts["name in CSV"].check(held and (not re.match(r"[=@\t\r]", cell)), name)
        made = encoding.file_names([name])[name]
        try:
            (folder / f"model-{made}.json").write_bytes(b"")
            counts["name in a file name"].check((folder / f"model-{made}.json").is_file(), name)
        except (OSError, ValueError):
            counts["name in a file name"].check(False, name)
        line = str(InputError(name, where=name, mend=name))
        counts["name in a terminal"].check(
            len(line.splitlines()) == 1 and not re.search(r"[\x00-\x1f\x7f-\x9f]", line), name
        )
    shutil.rmtree(folder)
    _compile(counts["name in C"], comments)
    return list(counts.values())


def _compile(count: Count, comments: list[str]) -> None:
    """All comments in one source, between functions: each function has to be seen, and nothing else."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        print("no C compiler: names in C are not compiled", file=sys.stderr)
        return
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "names.c"
        source.write_text(
            "".join(f"{text}int f{i}(void);\nint f{i}(void) {{ return {i}; }}\n" for i, text in enumerate(comments))
        )
        command = [
            compiler,
            "-std=c99",
            "-trigraphs",
            "-Wall",
            "-Wcomment",
            "-Werror",
            "-c",
            source.name,
            "-o",
            "names.o",
        ]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        listed = subprocess.run(["nm", "names.o"], cwd=folder, capture_output=True, text=True, check=False).stdout
        found = set(re.findall(r" T (\w+)", listed))
    for i, text in enumerate(comments):
        count.check(done.returncode == 0 and f"f{i}" in found, text)
    count.check(found == {f"f{i}" for i in range(len(comments))}, found - {f"f{i}" for i in range(len(comments))})


def attack_exports(share: float) -> list[Count]:
    """Whole exports of dampers whose rig has a hostile name: compiled, parsed, no canary."""
    from dataclasses import replace

    from mrdamper.export import all_exporters
    from mrdamper.files.model_file import dump_model, parse_model

    damper = _damper()
    count, rng = Count("whole export of a named rig"), random.Random(2)
    folder = Path(tempfile.mkdtemp())
    for rig in list(names(len(NASTY), rng))[: max(4, int(len(NASTY) * share))]:
        named = replace(damper, rig=rig)
        for form, kind in all_exporters().items():
            exporter = kind(platforms=()) if form == "fmu" else kind()
            files = exporter.export(named, "damper").files
            for name, content in files.items():
                if name.endswith(".c") and not name.endswith("_test.c"):
                    (folder / "damper.h").write_bytes(files["damper.h"])
                    (folder / name).write_bytes(content)
                    done = subprocess.run(
                        ["cc", "-std=c99", "-Werror", "-c", name], cwd=folder, capture_output=True, check=False
                    )
                    listed = subprocess.run(["nm", "damper.o"], cwd=folder, capture_output=True, check=False).stdout
                    count.check(done.returncode == 0 and b"canary" not in listed, (form, rig))
                elif name.endswith(".html"):
                    count.check(b"<script>canary" not in content, (form, rig))
                elif name.endswith(".tex"):
                    count.check(not re.search(rb"\\(input|write)", content), (form, rig))
                else:
                    count.check(True, form)
        try:
            parse_model(dump_model(named))
            count.check(rig.isprintable() or True, rig)
        except ValueError as error:
            count.check(hasattr(error, "code"), (rig, error))
    shutil.rmtree(folder)
    return [count]


def _damper() -> Any:
    from mrdamper.dampers.base import Envelope
    from mrdamper.dampers.joint import JointDamper
    from mrdamper.models import model_type

    values = {"c": 1440.0, "alpha": 9e5, "beta": 2e5, "gamma": 2e5, "f0": 60.0, "k1": 800.0}
    envelope = Envelope((0.0, 1.0), (0.5, 4.0), (0.004, 0.02), (0.02, 0.3))
    return JointDamper("bench", model_type("bouc-wen").build(values), tuple(values), envelope, {})


ODD = (
    None, True, False, 0, -1, 1, 1e-300, 1e300, -1e300, 10**30, "", "x", "1", "1e5", [], {}, [1.0], [1.0, 2.0], ["a"],
    [[1.0]], {"a": 1}, 1e308, -0.0, 5e-324, "a\x1b[0m", "../x", [None], 0.1, 1e9, [0.0, 0.0], [1e300, -1e300],
)  # fmt: skip


def _typed(count: Count, what: object, call: Callable[[], Any]) -> Any:
    """Call something; anything but an answer or an error with a code breaks."""
    from mrdamper.errors import InputError

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            answer = call()
        except InputError:
            answer = None
        except Exception as error:
            count.check(False, f"{type(error).__name__}: {error} from {what}"[:400])
            return None
    count.check(True, what)
    return answer


def _places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield path
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in inner:
        yield from _places(part, (*path, key))


def _mutated(document: Any, rng: random.Random) -> tuple[Any, Any]:
    made = json.loads(json.dumps(document))
    changes = []
    for _ in range(rng.choice([1, 1, 1, 2])):
        path = rng.choice([p for p in _places(made) if p])
        holder = made
        for key in path[:-1]:
            holder = holder[key]
        change = rng.random()
        if change < 0.2:
            del holder[path[-1]]
            changes.append((path, "gone"))
        elif change < 0.3 and isinstance(holder, dict):
            holder[rng.choice(NASTY)] = rng.choice(ODD)
            changes.append((path, "more"))
        else:
            value = rng.choice(ODD)
            holder[path[-1]] = value
            changes.append((path, value))
    return made, changes


def attack_models(share: float) -> list[Count]:
    """Saved models with anything in any place: refused with a code, or a damper that answers with one."""
    from mrdamper.data import Condition
    from mrdamper.files.model_file import dump_model, parse_model

    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from support.dampers import conditioned_damper, joint_damper, modified_damper  # type: ignore[import-not-found]

    count, rng = Count("saved model, changed anywhere"), random.Random(3)
    documents = [json.loads(dump_model(d)) for d in (conditioned_damper(), joint_damper(), modified_damper())]
    for _ in range(max(60, int(6000 * share))):
        document, changes = _mutated(rng.choice(documents), rng)
        damper = _typed(count, changes, lambda d=document: parse_model(json.dumps(d)))
        if damper is not None:
            _typed(count, changes, lambda d=damper: d.predict(Condition(0.5, 1.0, 0.01)))
    text = json.dumps(documents[1])
    for _ in range(max(60, int(4000 * share))):
        broken = bytearray(text.encode())
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(broken))
            broken[at : at + rng.randint(0, 3)] = bytes(rng.randrange(256) for _ in range(rng.randint(0, 3)))
        _typed(count, broken[:60], lambda b=broken: parse_model(b.decode("utf-8", "replace")))
    return [count]


def attack_datasets(share: float) -> list[Count]:
    """Dataset folders with anything in any cell: refused with a code, or studied with one."""
    from mrdamper.files.dataset import load_dataset
    from mrdamper.identification import identify

    count, rng = Count("dataset, changed anywhere"), random.Random(4)
    folder = Path(tempfile.mkdtemp())
    t = np.arange(200) / 100
    cells = [*map(str, (0, -1, 1e-300, 1e300, 1e298, "1_0", "nan", "inf", "٣", "0x10", "9" * 5000, "1,5"))]
    for _ in range(max(20, int(400 * share))):
        rows = [
            {"run_id": f"r{i}", "rig": "a", "current_A": str(i), "excitation": "sine", "split": "train"}
            | {"steady_t0_s": "0", "steady_t1_s": "1.9", "nominal_frequency_Hz": "1", "nominal_amplitude_m": "0.01"}
            for i in range(2)
        ]
        changed = rng.choice(["cell", "sample", "scale", "short"])
        what: Any = changed
        x, force = 0.01 * np.sin(2 * np.pi * t), 500 * np.cos(2 * np.pi * t)
        size = t.size
        if changed == "cell":
            key = rng.choice([*rows[0], rng.choice(NASTY).strip() or "x"])
            rows[0][key] = rng.choice([*cells, *NASTY])
            what = (key, rows[0][key])
        elif changed == "scale":
            scales = rng.choice([1e-300, 1e298, 0.0, -1.0, 1e20]), rng.choice([1e-300, 1e300, 0.0, -1.0])
            x, force, what = scales[0] * x, scales[1] * force, scales
        elif changed == "short":
            size = rng.choice([0, 1, 2, 3, 4, 7])
            what = ("samples", size)
        samples = [
            [f"r{i}", repr(float(t[k])), repr(float(x[k])), repr(float(force[k]))]
            for i in range(2)
            for k in range(size)
        ]
        if changed == "sample":
            at, column = rng.randrange(len(samples)), rng.randrange(4)
            samples[at][column] = rng.choice([*cells, *NASTY])
            what = (at, column, samples[at][column])
        heads = list(rows[0])
        with (folder / "runs.csv").open("w", newline="", encoding="utf-8", errors="replace") as file:
            writer = csv.writer(file)
            writer.writerows([heads, *([row.get(h, "") for h in heads] for row in rows)])
        with (folder / "samples.csv").open("w", newline="", encoding="utf-8", errors="replace") as file:
            writer = csv.writer(file)
            writer.writerows([["run_id", "time_s", "displacement_m", "force_N"], *samples])
        dataset = _typed(count, what, lambda: load_dataset(folder))
        for run in dataset or ():
            _typed(count, what, lambda run=run: identify(run, "bingham"))
            _typed(count, what, lambda run=run: identify(run, "bouc-wen"))
    shutil.rmtree(folder)
    return [count]


def attack_calls(share: float) -> list[Count]:
    """Public functions given what is no argument of theirs."""
    import mrdamper
    from mrdamper.models import all_models, model_type

    count, rng = Count("public call with anything"), random.Random(5)
    odd: list[Any] = [
        *ODD,
        math.nan,
        math.inf,
        1j,
        object(),
        b"x",
        np.zeros(3),
        np.array("a"),
        np.array([1j, 2, 3]),
        {1, 2},
    ]
    t = np.arange(300) / 100
    for _ in range(max(60, int(3000 * share))):
        one, two, three = (rng.choice(odd) for _ in range(3))
        what = f"{one!r:.40} {two!r:.40} {three!r:.40}"
        name = rng.choice(sorted(all_models()))
        arrays = {"time": t, "displacement": 0.01 * np.sin(t * 6), "force": np.cos(t * 6) * 500, "current": 0.5}
        arrays[rng.choice(list(arrays))] = one
        _typed(count, ("Run", what), lambda a=arrays, two=two: mrdamper.Run(id=rng.choice(["a", two]), **a))
        infos = model_type(name).parameters()
        values = {info.name: rng.choice([1.0, 1e3, one, two, 0.0]) for info in infos}
        model = _typed(count, (name, values), lambda n=name, v=values: model_type(n)(**v))
        if model is not None:
            from mrdamper.motion import sine

            _typed(
                count,
                ("simulate", name, values),
                lambda m=model: mrdamper.simulate(m, sine(mrdamper.Condition(0.5, 1.0, 0.01), 1, 50)),
            )
        _typed(count, ("load_model", what), lambda one=one: mrdamper.load_model(one))
        _typed(count, ("load_dataset", what), lambda one=one: mrdamper.load_dataset(one) if one is not None else None)
        _typed(count, ("GasSpring", what), lambda a=one, b=two, c=three: mrdamper.GasSpring(a, b, c))
    return [count]


def attack_kills(share: float) -> list[Count]:
    """SIGKILL while commands write: nothing half, no orphan after two seconds, no litter after the next run."""
    if os.name != "posix":
        return []
    count, rng = Count("SIGKILL while writing"), random.Random(6)
    root = Path(tempfile.mkdtemp())
    model = root / "model.json"
    from mrdamper.files.model_file import save_model

    save_model(_damper(), model)
    commands = {
        "identify": (["identify", "--run", "utf_5mm4Hz_1A", "--out", "i.csv"], "i.csv"),
        "predict": (
            ["predict", str(model), "--current", "1", "--frequency", "1", "--amplitude", "10", "--out", "p.csv"],
            "p.csv",
        ),
        "export": (["export", str(model), "--to", "c", "--out", "c"], "c"),
        "study": (["study", "--out", "s"], "s"),
    }
    whole: dict[str, set[str]] = {}
    spans: dict[str, float] = {}
    for name, (arguments, out) in commands.items():
        began = time.monotonic()
        _mrdamper(root / name, arguments).wait()
        spans[name] = time.monotonic() - began
        whole[name] = _listed(root / name / out)
    for i in range(max(4, int(40 * share))):
        name = list(commands)[i % len(commands)]
        arguments, out = commands[name]
        process = _mrdamper(root / name, arguments)
        time.sleep(rng.uniform(0.5, 1.02) * spans[name])
        children = _children(process.pid)
        process.send_signal(signal.SIGKILL)
        process.wait()
        time.sleep(2)
        count.check(_listed(root / name / out) == whole[name], (name, "half written"))
        count.check(not any(map(_alive, children)), (name, "orphans", children))
    for name, (arguments, out) in commands.items():
        _mrdamper(root / name, arguments).wait()
        count.check([p.name for p in (root / name).iterdir()] == [out], (name, "litter", os.listdir(root / name)))  # noqa: PTH208
    shutil.rmtree(root)
    return [count]


def attack_limits(share: float) -> list[Count]:
    """A limit of file size or memory at many points: done, or refused with a code and without litter."""
    if os.name != "posix":
        return []
    count = Count("limits of file size and memory")
    root = Path(tempfile.mkdtemp())
    points = max(2, int(8 * share))
    limits = [f"ulimit -f {int(2 ** (i * 12 / points))}" for i in range(points)]
    limits += [f"ulimit -v {int(1e5 * 2 ** (i * 6 / points))}" for i in range(points)]
    limits += [f"ulimit -n {n}" for n in (6, 9, 16)][: max(1, points)]
    for limit in limits:
        for arguments in (
            ["identify", "--run", "utf_5mm4Hz_1A", "--out", "i.csv"],
            ["export", "m.json", "--to", "c", "--out", "c"],
        ):
            from mrdamper.files.model_file import save_model

            save_model(_damper(), root / "m.json")
            command = " ".join([sys.executable, "-m", "mrdamper.cli", *arguments])
            done = subprocess.run(
                ["bash", "-c", f"{limit}; exec {command}"],
                cwd=root,
                capture_output=True,
                text=True,
                timeout=120,
                check=False,
            )
            held = done.returncode == 0 or (
                done.returncode == 2 and re.search(r"\[E_\w+\]\s*$", done.stderr) is not None
            )
            count.check(held, (limit, arguments[0], done.returncode, done.stderr[-200:]))
    shutil.rmtree(root)
    return [count]


def _mrdamper(folder: Path, arguments: list[str]) -> subprocess.Popen[bytes]:
    folder.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "mrdamper.cli", *arguments]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _listed(path: Path) -> set[str]:
    return (
        {p.relative_to(path).as_posix() for p in path.rglob("*")}
        if path.is_dir()
        else {path.name}
        if path.exists()
        else set()
    )


def _children(process: int) -> list[int]:
    tasks = Path(f"/proc/{process}/task").glob("*/children")
    direct = [int(child) for task in tasks for child in task.read_text().split()]
    return direct + [inner for child in direct for inner in _children(child)]


def _alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


KINDS = {
    "names": attack_names,
    "exports": attack_exports,
    "models": attack_models,
    "datasets": attack_datasets,
    "calls": attack_calls,
    "kills": attack_kills,
    "limits": attack_limits,
}


def main() -> None:
    """Attack, and print the counts."""
    arguments = argparse.ArgumentParser(prog="python -m fuzz.attack", description=__doc__)
    arguments.add_argument("kinds", nargs="*", help=f"of {', '.join(KINDS)}; default: all")
    arguments.add_argument("--share", type=float, default=1.0, help="of the usual number")
    chosen = arguments.parse_args()
    broke = 0
    for kind in chosen.kinds or KINDS:
        for count in KINDS[kind](chosen.share):
            print(count, flush=True)
            broke += len(count.broke)
    sys.exit(1 if broke else 0)


if __name__ == "__main__":
    main()
