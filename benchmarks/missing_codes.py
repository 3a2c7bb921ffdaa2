"""Detection rate of loggers' codes for missing values, and false findings in clean channels.

    python -m benchmarks.missing_codes --channels 10000

Goals: false findings in at most 1 of 1000 clean channels, at least 99 of 100 with codes refused, as such or as spikes.
Seeded. Exit status 1 if a goal is missed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.noise import changing_current, constant_current
from support.rig_records import clean_record

from mrdamper.rig_files.quality.sentinel import COARSEST, code_in, spikes_in
from mrdamper.rig_files.quality.sentinel import OFF_BY as SPIKES

CODES = (-9999.0, 9999.0, -999.0, -999.25, 999.9, 99999.0, 32767.0, -32768.0, 65535.0, 9.91e37, 0.0)
CHANNELS = ("force", "displacement", "current")


def channel(name: str, seed: int) -> np.ndarray:
    """A clean channel in the unit of its file: N or kN, mm or m, A or mA; with noise, to 0 to 6 decimals."""
    rng = np.random.default_rng([61, seed])
    if name == "current":
        moment = np.arange(int(rng.uniform(200, 4000))) / 200
        made = (constant_current if seed % 3 else changing_current)(rng, moment)
        return made * rng.choice([1.0, 1e3])
    record = clean_record(seed % 200, cycles=int(rng.integers(2, 6)), points=int(rng.choice([60, 200, 400])))
    values = getattr(record, name)
    span = float(np.ptp(values))
    noisy = values + span * 10 ** rng.uniform(-5, -1.7) * rng.standard_normal(values.size)
    if name == "force":
        noisy = noisy * rng.choice([1.0, 1e-3]) * rng.choice([0.3, 1.0, 3.0])
    else:
        noisy = noisy * rng.choice([1.0, 1e3])
    least = max(0, int(np.ceil(-np.log10(np.ptp(noisy) / 300))))  # a channel has some hundred steps at least
    return np.round(noisy, int(rng.integers(least, least + 5)))


def with_code(values: np.ndarray, code: float, seed: int) -> np.ndarray:
    """The channel with a code in place of 2 to 12 scattered samples, some in stretches."""
    rng = np.random.default_rng([62, seed])
    damaged = values.copy()
    for _ in range(int(rng.integers(2, 13))):
        at = int(rng.integers(2, values.size - 6))
        damaged[at : at + int(rng.choice([1, 1, 1, 2, 4]))] = code
    return damaged


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--channels", type=int, default=10_000)
    count = parser.parse_args().channels
    begin, fell_short = time.process_time(), False
    for name in CHANNELS:
        alarms, found, tried = 0, Counter(), Counter()
        for seed in range(count // len(CHANNELS)):
            values = channel(name, seed)
            coarsest = COARSEST.get(name, 0.0)
            alarms += code_in(values, coarsest) is not None or (
                name in SPIKES and spikes_in(values, SPIKES[name]).size > 0
            )
            code = CODES[seed % len(CODES)]
            if name == "current" and (code == 0.0 or abs(code - np.median(values)) < 20 * np.std(values)):
                code = -9999.0  # a current of zero is a current, and so is 999.9 mA where it is 1 A
            tried[code] += 1
            damaged = with_code(values, code, seed)
            known = code_in(damaged, coarsest) == code
            found[code] += known or (name in SPIKES and spikes_in(damaged, SPIKES[name]).size > 0)
        clean = count // len(CHANNELS)
        share = sum(found.values()) / sum(tried.values())
        fell_short |= alarms > 1e-3 * clean or share < 0.99
        each = ", ".join(f"{code:g} {100 * found[code] / tried[code]:.1f}" for code in tried)
        print(
            f"{name:13} {alarms} of {clean} clean ones accused; {100 * share:.2f} % of codes found ({each})", flush=True
        )
    print(f"{time.process_time() - begin:.0f} s of processor")
    return int(fell_short)


if __name__ == "__main__":
    sys.exit(main())
