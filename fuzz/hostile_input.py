"""Models, datasets and calls with anything in any place: an answer, or an error with a code."""

from __future__ import annotations

import csv
import json
import math
import random
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.counting import NASTY, ODD, Count, typed, within


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
    from mrdamper.dampers.model_file import dump_model, parse_model
    from mrdamper.data import Condition

    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from support.dampers import conditioned_damper, joint_damper, modified_damper  # type: ignore[import-not-found]

    count, rng = Count("saved model, changed anywhere"), random.Random(3)
    documents = [json.loads(dump_model(d)) for d in (conditioned_damper(), joint_damper(), modified_damper())]
    for _ in within(range(max(60, int(6000 * share)))):
        document, changes = _mutated(rng.choice(documents), rng)
        damper = typed(count, changes, lambda d=document: parse_model(json.dumps(d)))
        if damper is not None:
            typed(count, changes, lambda d=damper: d.predict(Condition(0.5, 1.0, 0.01)))
    text = json.dumps(documents[1])
    for _ in within(range(max(60, int(4000 * share)))):
        broken = bytearray(text.encode())
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(broken))
            broken[at : at + rng.randint(0, 3)] = bytes(rng.randrange(256) for _ in range(rng.randint(0, 3)))
        typed(count, broken[:60], lambda b=broken: parse_model(b.decode("utf-8", "replace")))
    return [count]


def attack_datasets(share: float) -> list[Count]:
    """Dataset folders with anything in any cell: refused with a code, or studied with one."""
    from mrdamper.identification import identify
    from mrdamper.rig_files.dataset_folder import load_dataset

    count, rng = Count("dataset, changed anywhere"), random.Random(4)
    folder = Path(tempfile.mkdtemp())
    t = np.arange(200) / 100
    cells = [*map(str, (0, -1, 1e-300, 1e300, 1e298, "1_0", "nan", "inf", "٣", "0x10", "9" * 5000, "1,5"))]
    for _ in within(range(max(20, int(400 * share)))):
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
        dataset = typed(count, what, lambda: load_dataset(folder))
        for run in dataset or ():
            typed(count, what, lambda run=run: identify(run, "bingham"))
            typed(count, what, lambda run=run: identify(run, "bouc-wen"))
    shutil.rmtree(folder)
    return [count, _damaged(share)]


def _damaged(share: float) -> Count:
    """Samples in Parquet with bytes changed anywhere, most of them where the table is described."""
    from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset

    count, rng = Count("samples of a dataset, damaged"), random.Random(7)
    with tempfile.TemporaryDirectory() as folder:
        bundled = load_dataset()
        save_dataset(bundled.only(list(bundled)[:2]), Path(folder) / "set")
        samples = Path(folder) / "set" / "samples.parquet"
        whole = samples.read_bytes()
        for _ in within(range(max(20, int(500 * share)))):
            content = bytearray(whole)
            for _ in range(rng.randint(1, 4)):
                at = rng.randrange(len(whole)) if rng.random() < 0.3 else rng.randrange(len(whole) - 2000, len(whole))
                content[at] = rng.randrange(256)
            samples.write_bytes(content)
            typed(count, bytes(content[-60:]), lambda: load_dataset(Path(folder) / "set"))
    return count


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
    for _ in within(range(max(60, int(3000 * share)))):
        one, two, three = (rng.choice(odd) for _ in range(3))
        what = f"{one!r:.40} {two!r:.40} {three!r:.40}"
        name = rng.choice(sorted(all_models()))
        arrays = {"time": t, "displacement": 0.01 * np.sin(t * 6), "force": np.cos(t * 6) * 500, "current": 0.5}
        arrays[rng.choice(list(arrays))] = one
        typed(count, ("Run", what), lambda a=arrays, two=two: mrdamper.Run(id=rng.choice(["a", two]), **a))
        infos = model_type(name).parameters()
        values = {info.name: rng.choice([1.0, 1e3, one, two, 0.0]) for info in infos}
        model = typed(count, (name, values), lambda n=name, v=values: model_type(n)(**v))
        if model is not None:
            from mrdamper.physics.motion import sine

            typed(
                count,
                ("simulate", name, values),
                lambda m=model: mrdamper.simulate(m, sine(mrdamper.Condition(0.5, 1.0, 0.01), 1, 50)),
            )
        typed(count, ("load_model", what), lambda one=one: mrdamper.load_model(one))
        typed(count, ("load_dataset", what), lambda one=one: mrdamper.load_dataset(one) if one is not None else None)
        typed(count, ("GasSpring", what), lambda a=one, b=two, c=three: mrdamper.GasSpring(a, b, c))
    return [count]
