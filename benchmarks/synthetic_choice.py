"""Choice of the model and its intervals at untested conditions: `python -m benchmarks.synthetic_choice`.

Dampers of six families and known truth (`benchmarks.synthetic_dampers`), each tested by several designs and studied.
Scores are for untested corners of frequency and amplitude, currents between the tested ones and beyond them, and tested
conditions: the error of the selected model relative to that of the best candidate (errors below 1 % count as 1 %), the
share of peak forces and energies of runs of future sessions that lie in the 90 % prediction interval, and the median of
half the interval, relative.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from benchmarks.synthetic_dampers import (
    DESIGNS,
    Asked,
    Design,
    SyntheticDamper,
    asked_of,
    drawn,
    in_future_session,
    tests_of,
)
from mrdamper.dampers.base import Damper
from mrdamper.data import Dataset, Run
from mrdamper.study.validation import peak_band, score_run
from mrdamper.study.workflow import RigStudy, study_rig

LEVEL = 0.9
ASKED: tuple[Asked, ...] = ("corner", "current", "beyond", "tested")
_NEGLIGIBLE = 0.01  # error below which models are alike
_FUTURE = 10  # sessions a condition is asked for in
_GOAL, _NEVER = 1.3, 3.0  # times the best candidate's error


@dataclass(frozen=True)
class Case:
    """A damper studied from the tests of one design.

    Attributes
    ----------
    damper, design, chosen : str
    errors : mapping of str to mapping of str to float
        Mean nrmse_pp by what is asked and candidate.
    inside : mapping of str to (float, float)
        Share of peak forces and energies inside their intervals, by what is asked.
    widths : mapping of str to (float, float)
        Half the interval of the peak and of the energy, relative.
    seconds : float
        Processor time of the study.
    """

    damper: str
    design: str
    chosen: str
    errors: dict[str, dict[str, float]]
    inside: dict[str, tuple[float, float]]
    widths: dict[str, tuple[float, float]]
    seconds: float

    def ratio(self, what: str) -> float:
        """Error of the selected model over that of the best candidate."""
        errors = {name: max(error, _NEGLIGIBLE) for name, error in self.errors[what].items()}
        return errors[self.chosen] / min(errors.values())


def studied(damper: SyntheticDamper, design: Design, seed: int = 0) -> Case:
    """Study a damper and score it at untested conditions."""
    rng = np.random.default_rng((sum(map(ord, damper.name)), DESIGNS.index(design), seed))
    runs = tests_of(damper, design, rng)
    begin = time.process_time()
    study = study_rig(Dataset(tuple(runs), damper.name))
    seconds = time.process_time() - begin
    errors, inside, widths = {}, {}, {}
    for what in ASKED:
        asked = asked_of(damper, what)
        errors[what] = _errors(study, asked)
        future = [in_future_session(damper, run, rng) for run in asked for _ in range(_FUTURE)]
        inside[what], widths[what] = _covered(study.damper, future)
    return Case(damper.name, design, study.chosen.recipe.name, errors, inside, widths, seconds)


def _errors(study: RigStudy, asked: Sequence[Run]) -> dict[str, float]:
    return {
        c.recipe.name: float(np.mean([score_run(c.damper, run).scores.nrmse_pp for run in asked]))
        for c in study.candidates
    }


def _covered(damper: Damper, runs: Sequence[Run]) -> tuple[tuple[float, float], tuple[float, float]]:
    rows = [peak_band(damper, run, LEVEL) for run in runs]
    inside, widths = np.zeros(2), np.zeros(2)
    for row in rows:
        for i, (name, unit) in enumerate((("peak_force", "N"), ("energy", "J"))):
            low, high = (row.get(f"{name}_{end}_{unit}", np.nan) for end in ("low", "high"))
            measured = row[f"{name}_measured_{unit}"]
            inside[i] += low <= measured <= high
            widths[i] += (high - low) / 2 / measured
    (peak, energy), (peak_width, energy_width) = inside / len(rows), widths / len(rows)
    return (float(peak), float(energy)), (float(peak_width), float(energy_width))


def run_cases(count: int, designs: Sequence[Design], processes: int) -> Iterator[Case]:
    """Study some dampers by some designs; each case comes when it is done."""
    jobs: list[tuple[SyntheticDamper, Design]] = [(damper, design) for damper in drawn(count) for design in designs]
    if processes < 2:
        yield from (studied(*job) for job in jobs)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(studied, *zip(*jobs, strict=True))


def details(case: Case) -> str:
    """A line for each thing that is asked, with the errors of all candidates."""
    lines = []
    for what in ASKED:
        best = sorted(case.errors[what].items(), key=lambda entry: entry[1])
        errors = ", ".join(f"{name} {100 * error:.1f}" for name, error in best)
        shares = " ".join(
            f"{100 * share:.0f}±{100 * w:.0f}" for share, w in zip(case.inside[what], case.widths[what], strict=True)
        )
        lines.append(
            f"{case.damper:24}{case.design:8}{what:8} ratio {case.ratio(what):5.2f}  inside {shares}  "
            f"chosen {case.chosen}; {errors}; {case.seconds:.1f} s"
        )
    return "\n".join(lines)


def table(cases: Sequence[Case]) -> str:
    """Ratios and coverage by design and family, as text."""
    lines = [f"{'cases':28}{'<= 1.3 x':>10}{'worst':>8}{'error':>8}{'peak inside':>18}{'energy inside':>18}"]
    groups = {"all": list(cases)}
    for case in cases:
        groups.setdefault(case.design, []).append(case)
        groups.setdefault(case.damper.rpartition(" ")[0], []).append(case)
    for name, members in groups.items():
        for what in ASKED:
            ratios = [case.ratio(what) for case in members]
            errors = [case.errors[what][case.chosen] for case in members]
            shares = 100 * np.mean([case.inside[what] for case in members], axis=0)
            halves = 100 * np.median([case.widths[what] for case in members], axis=0)
            inside = "".join(f"{share:>9.0f} % ±{half:>4.1f} %" for share, half in zip(shares, halves, strict=True))
            lines.append(
                f"{name + ', ' + what:28}{100 * np.mean(np.array(ratios) <= _GOAL):>8.0f} %{max(ratios):>8.2f}"
                f"{100 * np.median(errors):>6.1f} %{inside}"
            )
    seconds = sum(case.seconds for case in cases)
    lines.append(f"{len(cases)} studies, {seconds / len(cases):.1f} s each")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dampers", type=int, default=42)
    parser.add_argument("--designs", nargs="+", choices=DESIGNS, default=DESIGNS)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--details", action="store_true", help="lines for each case as it is done")
    chosen = parser.parse_args()
    cases = []
    for case in run_cases(chosen.dampers, chosen.designs, chosen.processes):
        cases.append(case)
        if chosen.details:
            print(details(case), flush=True)
    print(table(cases))


if __name__ == "__main__":
    main()
