"""Laboratories' exports to models: every kind, locale, unit and noise, imported as in the how-to page.

    python -m benchmarks.lab_exports
    python -m benchmarks.lab_exports --labs 200 --models 10

Each laboratory is written by code that is independent of the readers. Correct: every true test is a run with true
channels. Silently wrong: imported, but not correct. For `--models` of them a study is made; its damper is compared with
the true one at the tested motions and at an untested current. False finding: a quality check reports more than empty
cells of a clean test. Goals: 99 % correct, none silently wrong, 99 % of the models within 3 % of the peak-to-peak
force, false findings in at most 0.5 % of the tests. Seeded. Exit status 1 if a goal is missed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from support.lab_exports import KINDS, LOCALES, UNITS, Lab, campaign, damper, faults
from support.stored_exports import MACHINES

from mrdamper.data import Condition, Dataset
from mrdamper.errors import QualityError
from mrdamper.physics.simulation import steady_loop
from mrdamper.rig_files.quality import check_record
from mrdamper.rig_files.record import Record
from mrdamper.rig_files.rig_import import import_files, to_dataset
from mrdamper.statistics.metrics import nrmse_pp
from mrdamper.study.workflow import run_study

NOISES = (0.0005, 0.002, 0.005)  # of 1 kN in force; twice as many amperes in current
WITHIN, ACCUSED = 0.03, 0.005
UNTESTED = 0.6  # A


def labs() -> Iterator[tuple[str, Lab]]:
    """Every kind in every locale and unit it knows, with every noise, in an order that mixes them."""
    tests = {noise: campaign(5, noise, points=40) for noise in NOISES}
    found = [
        (kind, Lab(tests[noise], locale, units, facts={"form": i}))
        for i, noise in enumerate(NOISES)
        for kind in KINDS
        for locale in LOCALES
        for units in UNITS
    ]
    found += [(machine, Lab(tests[noise])) for noise in NOISES for machine in MACHINES]
    order = np.random.default_rng(71).permutation(len(found))
    return (found[i] for i in order)


def write(kind: str, lab: Lab, folder: Path) -> None:
    if kind in KINDS:
        KINDS[kind](lab, folder)
    else:
        MACHINES[kind](lab.tests, folder)


def accusations(record: Record) -> set[str]:
    """Codes of what the quality checks say of a record, beside the findings of its import and cells that are empty."""
    try:
        findings = check_record(replace(record, findings=(), segments=())).findings
        return {finding.code for finding in findings} - {"W_MISSING"}
    except QualityError as error:
        return {error.code}


def largest_error(dataset: Dataset, lab: Lab) -> float:
    """Largest difference of the study's damper from the true one, over the peak-to-peak force."""
    model = run_study(dataset).model
    motions = {(test.frequency, test.amplitude) for test in lab.tests}
    currents = {UNTESTED, *(test.current for test in lab.tests)}
    errors = []
    for frequency, amplitude in motions:
        for current in currents:
            at = Condition(current, frequency, amplitude)
            errors.append(nrmse_pp(steady_loop(damper(current), at).force, model.loop(at).force))
    return max(errors)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--labs", type=int, default=10**6, help="so many of them; default: all")
    parser.add_argument("--models", type=int, default=20, help="of so many a study is made")
    arguments = parser.parse_args()
    begin, right, refused, silent, within = time.process_time(), 0, [], [], []
    codes: Counter[str] = Counter()
    tried = tests = accused = 0
    for tried, (kind, lab) in enumerate(labs(), 1):
        with tempfile.TemporaryDirectory() as folder:
            write(kind, lab, Path(folder))
            found = import_files([folder])
            dataset = to_dataset(found.records) if found.records and not found.refusals else None
        name = f"{kind}, {lab.locale}, {lab.units}"
        of_tests = [accusations(record) for record in found.records]
        of_tests += [{r.error.code} for r in found.refusals if isinstance(r.error, QualityError)]
        codes.update(code for of_test in of_tests for code in of_test)
        tests, accused = tests + len(of_tests), accused + sum(map(bool, of_tests))
        if dataset is None:
            refused.append(f"{name}: {found.refusals[0].error}")
        elif wrong := faults(lab, dataset):
            silent.append(f"{name}: {wrong[0]}")
        else:
            right += 1
            if len(within) < arguments.models:
                within.append(largest_error(dataset, lab))
        if tried >= arguments.labs:
            break
    near = sum(error <= WITHIN for error in within)
    print(f"{tried} laboratories of {len(KINDS) + len(MACHINES)} kinds: {right} right ({100 * right / tried:.1f} %), "
          f"{len(refused)} refused, {len(silent)} wrong in silence")  # fmt: skip
    print(f"{accused} of {tests} clean tests accused ({100 * accused / tests:.2f} %, goal {100 * ACCUSED:g} %): "
          f"{', '.join(f'{code} {count}' for code, count in codes.most_common()) or 'none'}")  # fmt: skip
    if within:
        print(f"{near} of {len(within)} models within 3 % of the true damper (largest {100 * max(within):.2f} %)")
    for line in (*silent, *refused)[:20]:
        print(f"    {line}")
    print(f"{time.process_time() - begin:.0f} s of processor")
    missed = right < 0.99 * tried or near < 0.99 * len(within) or accused > ACCUSED * tests
    return int(missed or bool(silent))


if __name__ == "__main__":
    sys.exit(main())
