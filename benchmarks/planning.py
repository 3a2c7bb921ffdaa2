"""Plans beside what an engineer would do without one, on a virtual rig with drift: `python -m benchmarks.planning`.

The same rig time for all: the plan, records drawn at random, the factorial grid from its corners
inward, and the plan of somebody who believes that sessions are alike.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace

import numpy as np

from mrdamper.dampers.base import Damper, Envelope
from mrdamper.dampers.covariance import certain
from mrdamper.dampers.joint import JointDamper
from mrdamper.data import Condition, Run
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.motion import sine
from mrdamper.study.plan import Limits, Reckoning

TRUTH = PlayBypass(
    f0=40.0, k=800.0, c0=600.0, c1=3800.0, fy0=140.0, fy1=1000.0, d=2e-4, e=2.5e-5, cb=3.6e4, h0=0.4, h1=0.3, vh=3e-3,
    T=5e-3,
)  # fmt: skip
LIMITS = Limits((0.0, 1.0), (0.5, 4.0), (2.0, 20.0), velocity_m_s=0.2)
GAIN, NOISE = 0.045, 3.0  # of a session; of a sample [N]
FORM = 0.05  # what the form is wrong by, over half the peak-to-peak force: as on the second bundled rig
_FIRST = [Condition(i, f, a) for i in (0.0, 0.5, 1.0) for f, a in ((0.5, 0.02), (2.0, 0.005))]


def rig(seed: int = 0) -> Damper:
    """A damper known from a few records, each a session with a gain of its own."""
    envelope = Envelope.of(_FIRST)
    truth = JointDamper("virtual", TRUTH, tuple(n for n in TRUTH.values() if TRUTH.values()[n]), envelope, {})
    rng, runs = np.random.default_rng(seed), []
    for number, condition in enumerate(_FIRST):
        motion = sine(condition, 4, 200)
        force = truth.force_along(motion, condition) * (1 + GAIN * rng.standard_normal())
        force = force + NOISE * rng.standard_normal(force.size)
        runs.append(Run(f"r{number}", motion.time, motion.displacement, force, condition.current_A, rig="virtual"))
    made = certain(truth, runs)
    assert made.certainty is not None
    return replace(made, certainty=replace(made.certainty, force=FORM))


def designs(hours: float, seeds: int) -> dict[str, float]:
    """Expected standard deviation of the force after each design, and before; the median of the random ones."""
    damper = rig()
    reckoning = Reckoning.of(damper, LIMITS)
    conditions = list(reckoning.conditions)

    def spread(order: list[int], sessions: list[int] | None = None) -> float:
        played, left = [[] for _ in range(LIMITS.sessions)], 60 * hours
        share = 60 * hours / LIMITS.sessions
        for position, i in enumerate(order):
            minutes = LIMITS.minutes(conditions[i])
            if minutes > left:
                continue
            at = sessions[position] if sessions else min(int((60 * hours - left) / share), LIMITS.sessions - 1)
            played[at].append(i)
            left -= minutes
        return reckoning.spread(played)

    planned = reckoning.chosen(hours)
    alike = replace(reckoning, known=replace(reckoning.known, gain=1e-4, offset=1e-3)).chosen(hours)
    rng = np.random.default_rng(1)
    drawn = [spread(rng.integers(len(conditions), size=200).tolist()) for _ in range(seeds)]
    levels = [sorted({getattr(c, n) for c in conditions}) for n in ("current_A", "frequency_Hz", "amplitude_m")]
    corners = [[v[0], v[-1], *v[1:-1]] for v in levels]
    place = {c: i for i, c in enumerate(conditions)}
    grid = sorted(itertools.product(*(range(len(v)) for v in corners)), key=max)
    factorial = [Condition(*(v[k] for v, k in zip(corners, ks, strict=True))) for ks in grid]
    return {
        "before": reckoning.spread([]),
        "plan": planned[-1].after,
        "plan that ignores drift": spread([place[p.condition] for p in alike], [p.session - 1 for p in alike]),
        "random records (median)": float(np.median(drawn)),
        "factorial grid": spread([place[c] for c in factorial if c in place]),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50)
    chosen = parser.parse_args()
    for hours in (0.2, 0.5, 1.0, 2.0):
        found = designs(hours, chosen.seeds)
        print(f"{hours:g} h of rig time, standard deviation of the force over the envelope, %")
        for name, spread in found.items():
            less = 100 * (1 - found["plan"] / spread)
            print(
                f"  {name:28}{100 * spread:7.2f}" + ("" if name in ("before", "plan") else f"   plan {less:.0f} % less")
            )


if __name__ == "__main__":
    main()
