"""Damage good rig files at random: every mutant is read, or refused with a code, within a second.

    python -m fuzz.fuzz_import --mutants 20000 --seed 1

The mutant at work lies in a file whose name is printed first, so that a crash leaves it.
Exit status 1 if a mutant raised something else, or took longer.
"""

from __future__ import annotations

import argparse
import gzip
import io
import random
import sys
import tempfile
import time
import traceback
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np

from mrdamper.errors import InputError
from mrdamper.rig_files.rig_import import read_runs

LIMIT = 1.0  # seconds a small file may take
SAMPLES = 240
TOKENS = (
    b"", b"\0", b"\n", b"\r", b'"', b",", b";", b"\t", b".", b"-", b"e", b"nan", b"inf", b"1e999", b"1_0", b"0x1F",
    b"\xff", b"\xff\xfe", b"\xef\xbb\xbf", b"\xd9\xa1", b"99999999999999999999", b"-9999", b"#", b"[", b"(kN)", b"PK",
    b"\x1f\x8b", b"PAR1", b"\x80\x04", b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff", b"\0\0\0\0\0\0\0\x01",
    b"2024-01-01T00:00:00",
)  # fmt: skip


def seeds(formats: list[str] | None = None) -> dict[str, bytes]:
    """Small good files by name, of every format whose library is installed."""
    sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
    from support import rig_files as rig

    table = rig.rows(SAMPLES)
    named = dict(zip(rig.NAMES, table.T, strict=True))
    short = dict(zip(("time", "disp", "force"), table.T, strict=True))
    units = {"time": "s", "disp": "mm", "force": "N"}
    german = ("Prüfstand;7", "", "Zeit;Weg;Kraft", "s;mm;N")
    plain = rig.text(table).encode()
    blocks = rig.text(table, ("Data Acquisition", "Time\tAxial Displacement\tAxial Force", "s\tmm\tN"), "\t").encode()
    makers = {
        "plain_0.5A.csv": lambda: plain,
        "german.csv": lambda: rig.text(table, german, ";", ",", "\r\n").encode("cp1252"),
        "wide.csv": lambda: rig.text(table, german, ";", ",").encode("utf-16"),
        "quoted.csv": lambda: plain.replace(b",", b'","').replace(b"\n", b'"\n"')[:-1].join([b'"', b""]),
        "blocks.dat": lambda: blocks + blocks,
        "a.csv.gz": lambda: gzip.compress(plain),
        "a.zip": lambda: zipped(plain),
        "a.xlsx": lambda: rig.xlsx_bytes([list(rig.NAMES), *table[:60].tolist()]),
        "a.parquet": lambda: rig.parquet_bytes(named),
        "a.sqlite": lambda: rig.sqlite_bytes(samples=named),
        "a.npz": lambda: rig.npz_bytes(**named),
        "a.mat": lambda: rig.mat_bytes(named),
        "packed.mat": lambda: rig.mat_bytes({"data": named}, do_compression=True),
        "version4.mat": lambda: rig.mat_bytes(named, format="4"),
        "new.mat": lambda: rig.mat73_bytes(named),
        "a.h5": lambda: rig.hdf5_bytes(short, units, "test"),
        "a.xml": lambda: elements(table),
        "page.xls": lambda: page([rig.NAMES, *table]),
        "a.tdms": lambda: rig.tdms_bytes(short, units),
        "a.mf4": lambda: rig.mf4_bytes([(short["time"], {n: short[n] for n in ("disp", "force")})], units),
    }
    return {name: make() for name, make in makers.items() if not formats or name in formats}


def elements(table: np.ndarray) -> bytes:
    samples = "".join('<s time_s="{:g}" displacement_mm="{:g}" force_N="{:g}"/>\n'.format(*row) for row in table)
    return f'<?xml version="1.0"?><test><current unit="A">0.5</current>{samples}</test>'.encode()


def page(table: list) -> bytes:
    rows = ["".join(f"<td>{cell}</td>" for cell in row) for row in table]
    return f"<html><table><tr>{'</tr><tr>'.join(rows)}</tr></table></html>".encode()


def zipped(content: bytes) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.csv", content)
    return target.getvalue()


def mutate(content: bytes, rng: random.Random) -> bytes:
    """One to eight small damages, sometimes a cut."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 3, 8))):
        # Headers and directories stand at the ends: look there more often.
        place = rng.choice((rng.randrange(len(data) + 1), rng.randrange(min(len(data), 600) + 1),
                            len(data) - rng.randrange(min(len(data), 600) + 1)))  # fmt: skip
        kind = rng.randrange(7)
        if kind == 0 and data:
            data[min(place, len(data) - 1)] ^= 1 << rng.randrange(8)
        elif kind == 1 and data:
            data[min(place, len(data) - 1)] = rng.randrange(256)
        elif kind == 2:
            token = rng.choice(TOKENS)
            data[place : place + rng.choice((0, len(token)))] = token
        elif kind == 3:
            del data[place : place + rng.choice((1, 2, 10, 200))]
        elif kind == 4:
            data[place:place] = data[place : place + rng.choice((1, 10, 200, 2000))]
        elif kind == 5 and rng.random() < 0.3:
            del data[place:]
        elif kind == 6:
            size = rng.choice((1, 4, 8, 512))
            data[place : place + size] = bytes(size)
        if not data:
            return b""
    return bytes(data)


def attempt(path: Path) -> tuple[str, float, str]:
    """Result of one file: a code or "read"; the seconds it took; and a fault, if it is one."""
    begin = time.perf_counter()
    try:
        read_runs(path)
        outcome, fault = "read", ""
    except InputError as error:
        outcome, fault = error.code, ""
    except Exception:
        outcome, fault = "!", traceback.format_exc()
    seconds = time.perf_counter() - begin
    return outcome, seconds, fault or (f"took {seconds:.2f} s ({outcome})" if seconds > LIMIT else "")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mutants", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--format", action="append", help="only this seed file, by name")
    parser.add_argument("--keep", type=Path, help="folder for the mutants that fail")
    arguments = parser.parse_args()
    good = seeds(arguments.format)
    rng, outcomes, faults, worst = random.Random(arguments.seed), Counter(), 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        print(f"mutants pass through {folder}", flush=True)
        for name, content in good.items():  # also loads every library before the clock runs
            path = Path(folder) / name
            path.write_bytes(content)
            read_runs(path)
        begin = time.perf_counter()
        for number in range(arguments.mutants):
            name = rng.choice(list(good))
            path = Path(folder) / name
            path.write_bytes(mutate(good[name], rng))
            outcome, taken, fault = attempt(path)
            for pause in (0, 1, 5):  # the machine may have been busy elsewhere: a hang comes again
                if fault.startswith("took"):
                    time.sleep(pause)
                    outcome, taken, fault = attempt(path)
            worst = max(worst, taken)
            outcomes[outcome] += 1
            if fault:
                faults += 1
                print(f"mutant {number} of {name}:\n{fault}", flush=True)
                if arguments.keep:
                    arguments.keep.mkdir(parents=True, exist_ok=True)
                    (arguments.keep / f"{number}_{name}").write_bytes(path.read_bytes())
        seconds = time.perf_counter() - begin
    print(f"{arguments.mutants} mutants in {seconds:.0f} s, {faults} faults, the slowest {worst:.2f} s")
    print(", ".join(f"{code} {count}" for code, count in outcomes.most_common()))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
