"""Comparison of test plans with other designs, on a virtual rig with drift: `python -m benchmarks.planning`.

All have the same rig time, including set-up of sessions: the plan, which optimises their number; random records; the
factorial grid from its corners inward; and a plan without differences between sessions.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import JointDamper
from mrdamper.data import Condition, Run
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.physics.motion import sine
from mrdamper.study.limits import Limits
from mrdamper.study.plan import ExperimentDesign

TRUTH = PlayBypass(
    f0=40.0, k=800.0, c0=600.0, c1=3800.0, fy0=140.0, fy1=1000.0, d=2e-4, e=2.5e-5, cb=3.6e4, h0=0.4, h1=0.3, vh=3e-3,
    T=5e-3,
)  # fmt: skip
LIMITS = Limits((0.0, 1.0), (0.5, 4.0), (2.0, 20.0), velocity_m_s=0.2)
GAIN, NOISE = 0.045, 3.0  # of a session; of a sample [N]
FORM = 0.05  # model error over half the peak-to-peak force, as on the second bundled rig
_DAYS = 3
_FIRST = [Condition(i, f, a) for i in (0.0, 0.5, 1.0) for f, a in ((0.5, 0.02), (2.0, 0.005))]


def rig(seed: int) -> Damper:
    """A damper known from six records, two on each of three days, each day with a gain of its own."""
    envelope = Envelope.of(_FIRST)
    truth = JointDamper(TRUTH, tuple(n for n in TRUTH.values() if TRUTH.values()[n]), rig="virtual", envelope=envelope)
    rng, runs = np.random.default_rng(seed), []
    gains = 1 + GAIN * rng.standard_normal(_DAYS)
    for number, condition in enumerate(_FIRST):
        motion, day = sine(condition, 4, 200), number % _DAYS
        force = truth.force_along(motion, condition) * gains[day]
        force = force + NOISE * rng.standard_normal(force.size)
        notes = {"session": f"day {day}"}
        run = Run(
            f"r{number}", motion.time, motion.displacement, force, condition.current_A, rig="virtual", notes=notes
        )
        runs.append(run)
    made = estimate_uncertainty(truth, runs)
    assert made.uncertainty is not None
    return replace(made, uncertainty=replace(made.uncertainty, force=FORM))


def reckoned(seed: int) -> ExperimentDesign:
    """Information of records on that rig."""
    return ExperimentDesign.of(rig(seed), LIMITS, LIMITS.candidates(1.0))


def designs(reckoning: ExperimentDesign, hours: float, seed: int) -> dict[str, float]:
    """Expected standard deviation of the force after each design, and before.

    Designs without a plan have one session; they are also evaluated with the number of sessions of the plan.
    """
    conditions = list(reckoning.conditions)

    def spread(order: list[int], sessions: int = 1) -> float:
        """After records in an order, as many in each session as its share of the hours holds."""
        played: list[list[int]] = [[] for _ in range(sessions)]
        waiting = list(order)
        for rows in played:
            left = 60 * hours / sessions - LIMITS.opening
            for i in [*waiting]:
                if (minutes := LIMITS.minutes(conditions[i])) <= left:
                    rows.append(i)
                    waiting.remove(i)
                    left -= minutes
        return reckoning.spread(played)

    planned = reckoning.chosen(hours)
    alike = replace(reckoning, session=np.array([1e8, 1e8])).chosen(hours)
    drawn = np.random.default_rng(seed).integers(len(conditions), size=200).tolist()
    levels = [sorted({getattr(c, n) for c in conditions}) for n in ("current_A", "frequency_Hz", "amplitude_m")]
    corners = [[v[0], v[-1], *v[1:-1]] for v in levels]
    place = {c: i for i, c in enumerate(conditions)}
    grid = sorted(itertools.product(*(range(len(v)) for v in corners)), key=max)
    factorial = [Condition(*(v[k] for v, k in zip(corners, ks, strict=True))) for ks in grid]
    order, count = [place[c] for c in factorial if c in place], len(planned)
    return {
        "sessions": count,
        "before": reckoning.spread([]),
        "plan": reckoning.spread(planned),
        "plan that ignores drift": reckoning.spread(alike),
        "random records, one session": spread(drawn),
        "random records, sessions as the plan": spread(drawn, count),
        "factorial grid, one session": spread(order),
        "factorial grid, sessions as the plan": spread(order, count),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50)
    chosen = parser.parse_args()
    rigs = [reckoned(seed) for seed in range(chosen.seeds)]
    for hours in (0.5, 1.0, 2.0):
        found = [designs(each, hours, seed) for seed, each in enumerate(rigs)]
        names = list(found[0])
        print(f"{hours:g} h of rig time, standard deviation of the force, medians of {len(rigs)} rigs, %")
        print(f"  {'sessions the plan takes':40}{np.median([each['sessions'] for each in found]):7.0f}")
        for name in names[1:]:
            less = 100 * np.median([1 - each["plan"] / each[name] for each in found])
            said = "" if name == "plan" else f"   plan {less:.0f} % less"
            print(f"  {name:40}{100 * np.median([each[name] for each in found]):7.2f}{said}")


if __name__ == "__main__":
    main()
