"""Synthetic dampers of six families, integrated here without the models of the package, and four designs of tests.

Every damper has seal friction, a gas spring and a moving mass in addition to its controllable force. Its sizes are
random: 200 N to 20 kN, strokes of 8 to 60 mm, full currents of 0.5 to 4 A.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrdamper.data import Floats, Run

Design = Literal["matrix", "sparse", "random", "few"]
Asked = Literal["corner", "current", "beyond", "tested"]
DESIGNS: tuple[Design, ...] = ("matrix", "sparse", "random", "few")
PER_CYCLE, FINE = 128, 24  # samples of a cycle; steps of the integration between them
NOISE, DRIFT = 0.004, (0.003, 0.04)  # of half the peak-to-peak force; gain of a session, smallest and largest
_CYCLES = 5
_MOTIONS = ((0.5, 1.0), (1.0, 1.0), (2.0, 0.4), (0.5, 0.4), (1.0, 0.4))  # frequency and amplitude; sparse: three
_CORNERS = ((0.0, 2.0, 1.0), (1.0, 2.0, 1.0), (0.6, 1.6, 0.9))  # current, frequency, amplitude, of the largest
_CURRENTS = ((0.06, 1.0, 1.0), (0.42, 0.5, 1.0), (0.85, 2.0, 0.4))
_BEYOND = ((1.2, 0.5, 1.0), (1.2, 1.0, 0.4), (1.3, 1.0, 1.0))
_TESTED = ((0.0, 0.5, 1.0), (1.0, 1.0, 1.0), (1.0, 2.0, 0.4))  # in the full matrix and in the sparse one
_LEVELS: Mapping[str, tuple[float, ...]] = {
    "matrix": (0.0, 0.25, 0.5, 0.75, 1.0), "sparse": (0.0, 1 / 3, 2 / 3, 1.0), "few": (0.0, 0.5, 1.0),
}  # fmt: skip
_RECORDS, _LENGTH = 4, 30  # of the random design; cycles of the middle frequency in each


@dataclass(frozen=True)
class Motions:
    """Several motions, on the fine grid of the integration.

    Attributes
    ----------
    step : (M, 1) array
        [s]
    x, v, a, current : (M, N) arrays
        [m], [m/s], [m/s²], [A]
    """

    step: Floats
    x: Floats
    v: Floats
    a: Floats
    current: Floats


@dataclass(frozen=True)
class SyntheticDamper:
    """A damper with known parameters.

    Attributes
    ----------
    name : str
    force : float
        Yield force at the full current [N].
    stroke, frequency, current : float
        Largest amplitude [m], middle frequency [Hz] and full current [A] of its tests.
    law : str
        Of the yield force over the current: "exponential", "linear" or "onset".
    family : str
    shape : tuple of float
        Five numbers between 0 and 1 from which the family takes its parameters.
    drift : float
        Standard deviation of the gain of a session.
    """

    name: str
    force: float
    stroke: float
    frequency: float
    current: float
    law: str
    family: str
    shape: tuple[float, ...]
    drift: float

    @property
    def speed(self) -> float:
        """Peak velocity of the largest tested sine [m/s]."""
        return 2 * np.pi * self.frequency * self.stroke

    def share(self, current: Floats) -> Floats:
        """Yield force over that at the full current."""
        i, own = np.abs(current) / self.current, self.shape[0]
        base = 0.06 + 0.14 * own
        risen = {
            "linear": i,
            "exponential": (1 - np.exp(-i * (0.8 + 2 * own))) / (1 - np.exp(-0.8 - 2 * own)),
            "onset": np.tanh(1.5 * i) ** 1.4 / np.tanh(1.5) ** 1.4,
        }[self.law]
        return base + (1 - base) * risen

    def follow(self, motions: Motions) -> Floats:
        """Force [N], (M, N)."""
        own, speed = self.shape, self.speed
        force = FAMILIES[self.family](self, motions)
        friction = 0.03 * self.force * np.tanh(motions.v / (0.01 * speed))
        gas = 0.05 * self.force * (1 + own[4]) / (1 - 0.15 * motions.x / self.stroke) ** 1.2
        return force + friction + gas + 0.01 * self.force * own[4] / (speed * self.frequency) * motions.a


def _bouc_wen(damper: SyntheticDamper, motions: Motions) -> Floats:
    own, sharp = damper.shape, 1.0 + damper.shape[2]
    length = damper.stroke * (0.01 + 0.06 * own[1])

    def rate(z: Floats, k: int) -> Floats:
        v = motions.v[:, k]
        return (v - (0.6 * np.abs(v) * z + 0.4 * v * np.abs(z)) * np.abs(z) ** sharp) / length

    viscous = (
        damper.force / damper.speed * (0.15 + 0.4 * own[3] + (0.1 + 0.3 * own[4]) * motions.current / damper.current)
    )
    return damper.force * damper.share(motions.current) * _runge_kutta(rate, motions) + viscous * motions.v


def _spencer(damper: SyntheticDamper, motions: Motions) -> Floats:
    own, share = damper.shape, damper.share(motions.current)
    length = damper.stroke * (0.01 + 0.05 * own[1])
    c0 = damper.force / damper.speed * (0.1 + 0.3 * own[3]) * (0.4 + 0.6 * share)
    c1 = damper.force / damper.speed * (6 + 8 * own[2]) * (0.5 + 0.5 * share)
    k0 = 0.02 * damper.force / damper.stroke

    def rates(state: Floats, k: int) -> Floats:
        z, y = state
        v = motions.v[:, k]
        drive = damper.force * share[:, k] * z + c0[:, k] * v + k0 * (motions.x[:, k] - y)
        slow = drive / (c0[:, k] + c1[:, k])
        w = v - slow
        return np.array([(w - (0.5 * np.abs(w) * z + 0.5 * w * np.abs(z)) * np.abs(z)) / length, slow])

    z, y = _runge_kutta(rates, motions, 2)
    return damper.force * share * z + c0 * (motions.v - np.gradient(y, axis=1) / motions.step) + k0 * (motions.x - y)


def _lugre(damper: SyntheticDamper, motions: Motions) -> Floats:
    own, z = damper.shape, np.zeros_like(motions.x)
    length = damper.stroke * (0.008 + 0.04 * own[1])
    stribeck = 1 + 0.25 * own[2] * np.exp(-((motions.v / (0.05 * damper.speed)) ** 2))
    for k in range(1, z.shape[1]):  # exact where the velocity holds for a step
        v = (motions.v[:, k - 1] + motions.v[:, k]) / 2
        pull = np.abs(v) / (length * stribeck[:, k]) + 1e-12
        left = np.exp(-pull * motions.step[:, 0])
        z[:, k] = z[:, k - 1] * left + v / length / pull * (1 - left)
    viscous = damper.force / damper.speed * (0.15 + 0.4 * own[3] + 0.2 * motions.current / damper.current)
    micro = 0.004 * damper.force / damper.speed * np.gradient(z, axis=1) * length / motions.step
    return damper.force * damper.share(motions.current) * z + micro + viscous * motions.v


def _tangent(damper: SyntheticDamper, motions: Motions) -> Floats:
    own, x = damper.shape, motions.x / damper.stroke
    turned = motions.v / (damper.speed * (0.04 + 0.12 * own[1])) + (0.2 + 0.5 * own[2]) * np.tanh(8 * x)
    share = damper.share(motions.current)
    viscous = damper.force / damper.speed * (0.1 + 0.4 * own[3] + 0.2 * share)
    return damper.force * share * np.tanh(turned) + viscous * motions.v + 0.05 * damper.force * (1 + share) * x


def _play(damper: SyntheticDamper, motions: Motions) -> Floats:
    own, place = damper.shape, np.zeros_like(motions.x)
    half = damper.stroke * (0.004 + 0.03 * own[1])
    for k in range(1, place.shape[1]):
        place[:, k] = np.clip(place[:, k - 1] + motions.x[:, k] - motions.x[:, k - 1], -half, half)
    seat = half * (0.1 + 0.4 * own[2])
    seated = np.clip((np.abs(place) - half + seat) / seat, 0, 1) * np.sign(place)
    share = damper.share(motions.current)
    bypass = 4 * damper.force / damper.speed * motions.v / (damper.force * share)
    thinning = np.abs(motions.v) / (np.abs(motions.v) + 0.03 * damper.speed)
    wanted = seated * (0.6 + 0.4 * thinning) + (1 - np.abs(seated)) * bypass / np.sqrt(1 + bypass**2)
    lagged = np.zeros_like(wanted)
    keep = np.exp(-motions.step[:, 0] * damper.frequency * 200)
    for k in range(1, wanted.shape[1]):
        lagged[:, k] = keep * lagged[:, k - 1] + (1 - keep) * wanted[:, k]
    viscous = damper.force / damper.speed * (0.15 + 0.3 * own[3] + 0.2 * motions.current / damper.current)
    return damper.force * share * lagged + viscous * motions.v


def _biviscous(damper: SyntheticDamper, motions: Motions) -> Floats:
    """Two viscosities behind the compressibility of the fluid; implicit steps, in closed form piece by piece."""
    own, force = damper.shape, np.zeros_like(motions.x)
    steep = damper.force / damper.speed * (8 + 15 * own[2])  # through the leak, below the yield force
    flat = damper.force / damper.speed * (0.15 + 0.4 * own[3])
    stiff = damper.force / damper.stroke / (0.01 + 0.04 * own[1])
    level = damper.force * damper.share(motions.current)
    h = motions.step[:, 0]
    for k in range(1, force.shape[1]):
        pushed = force[:, k - 1] + stiff * (motions.x[:, k] - motions.x[:, k - 1])
        below = pushed / (1 + stiff * h / steep)
        top = level[:, k]
        knee = top * (1 - flat / steep)  # the flat branch, drawn back to no velocity
        beyond = (pushed + np.sign(pushed) * stiff * h / flat * knee) / (1 + stiff * h / flat)
        force[:, k] = np.where(np.abs(below) <= top, below, beyond)
    return force


FAMILIES: Mapping[str, Callable[[SyntheticDamper, Motions], Floats]] = {
    "Bouc-Wen": _bouc_wen, "Spencer": _spencer, "LuGre": _lugre, "hyperbolic tangent": _tangent,
    "play and bypass": _play, "biviscous with leak": _biviscous,
}  # fmt: skip


def _runge_kutta(rate: Callable[[Floats, int], Floats], motions: Motions, states: int = 1) -> Floats:
    """States along the motions by the classical method over pairs of steps; shape (M, N), or (states, M, N)."""
    runs, samples = motions.x.shape
    found = np.zeros((states, runs, samples))
    z, h = np.zeros((states, runs)), 2 * motions.step[:, 0]
    for k in range(0, samples - 2, 2):
        one = z if states > 1 else z[0]
        k1 = rate(one, k)
        k2 = rate(one + h / 2 * k1, k + 1)
        k3 = rate(one + h / 2 * k2, k + 1)
        k4 = rate(one + h * k3, k + 2)
        after = np.reshape(one + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), z.shape)
        found[:, :, k + 1], found[:, :, k + 2] = (z + after) / 2, after
        z = after
    return found if states > 1 else found[0]


def drawn(count: int, seed: int = 0) -> list[SyntheticDamper]:
    """Dampers of all families in turn, with every law of the current."""
    rng, made = np.random.default_rng(seed), []
    for k in range(count):
        family = list(FAMILIES)[k % len(FAMILIES)]
        law = ("exponential", "linear", "onset")[(k // len(FAMILIES) + k) % 3]
        if family == "Bouc-Wen":
            law = ("exponential", "linear")[k // len(FAMILIES) % 2]
        low, high = np.log(DRIFT)
        made.append(
            SyntheticDamper(
                f"{family} {k // len(FAMILIES)}",
                float(np.exp(rng.uniform(np.log(200), np.log(2e4)))),
                float(np.exp(rng.uniform(np.log(0.008), np.log(0.06)))),
                float(np.exp(rng.uniform(np.log(0.4), np.log(4.0)))),
                float(np.exp(rng.uniform(np.log(0.5), np.log(4.0)))),
                law,
                family,
                tuple(rng.uniform(size=5).tolist()),
                float(np.exp(rng.uniform(low, high))),
            )
        )
    return made


def tests_of(damper: SyntheticDamper, design: Design, rng: np.random.Generator) -> list[Run]:
    """Identification runs of a design, in four sessions with a gain and an offset each."""
    gains = damper.drift * rng.standard_normal((4, 2))
    if design == "random":
        motions = _random(damper, rng)
        return _recorded(damper, motions, "random", gains, rng)
    shapes = _MOTIONS[:3] if design == "sparse" else _MOTIONS
    asked = [(i, f, a) for i in _LEVELS[design] for f, a in shapes]
    return _recorded(damper, _sines(damper, asked), "sine", gains, rng)


def asked_of(damper: SyntheticDamper, what: Asked) -> list[Run]:
    """Clean runs at untested corners of the motions, at currents between the tested ones or beyond, or at tests."""
    asked = {"corner": _CORNERS, "current": _CURRENTS, "beyond": _BEYOND, "tested": _TESTED}[what]
    return _recorded(damper, _sines(damper, asked), "sine", None, np.random.default_rng(0))


def in_future_session(damper: SyntheticDamper, run: Run, rng: np.random.Generator) -> Run:
    """A clean run as another session would show it."""
    from dataclasses import replace

    gain, offset, own = rng.standard_normal(3) * damper.drift * np.array([1.0, 0.25, 0.25])
    half = float(np.ptp(run.force)) / 2
    noise = NOISE * half * rng.standard_normal(run.force.size)
    return replace(run, force=run.force * (1 + gain + own) + offset * damper.force + noise)


def _sines(
    damper: SyntheticDamper, asked: list[tuple[float, float, float]] | tuple[tuple[float, float, float], ...]
) -> Motions:
    samples = (_CYCLES + 1) * PER_CYCLE * FINE
    table = np.array(asked) * [damper.current, damper.frequency, damper.stroke]
    phase = np.arange(samples + 1) / (PER_CYCLE * FINE)  # in cycles
    ramp = np.clip(phase, 0, 1)
    envelope = ramp**2 * (3 - 2 * ramp)
    x = table[:, 2:] * envelope * np.sin(2 * np.pi * phase)
    step = 1 / (table[:, 1:2] * PER_CYCLE * FINE)
    return _moved(x, step, np.repeat(table[:, :1], samples + 1, axis=1))


def _random(damper: SyntheticDamper, rng: np.random.Generator) -> Motions:
    samples = _LENGTH * PER_CYCLE * FINE
    time = np.arange(samples + 1) / (damper.frequency * PER_CYCLE * FINE)
    lines = np.linspace(0.2, 2.0, 60) * damper.frequency
    x = np.zeros((_RECORDS, time.size))
    for line in lines:
        x += np.sin(2 * np.pi * line * time + rng.uniform(0, 2 * np.pi, (_RECORDS, 1))) / line**0.5
    x *= 0.8 * damper.stroke / np.abs(x).max(axis=1, keepdims=True)
    x = x * np.clip(time * damper.frequency, 0, 1)
    cuts = np.arange(0, time[-1], 1.7 / damper.frequency)
    levels = rng.uniform(0, damper.current, (_RECORDS, cuts.size))
    levels[:, ::4] = 0.0
    current = levels[:, np.searchsorted(cuts, time, side="right") - 1]
    return _moved(x, np.full((_RECORDS, 1), time[1]), current)


def _moved(x: Floats, step: Floats, current: Floats) -> Motions:
    v = np.gradient(x, axis=1) / step
    return Motions(step, x, v, np.gradient(v, axis=1) / step, current)


def _recorded(
    damper: SyntheticDamper, motions: Motions, kind: str, gains: Floats | None, rng: np.random.Generator
) -> list[Run]:
    force = damper.follow(motions)
    order, runs = rng.permutation(len(force)), []
    for k in range(len(force)):
        kept = slice(None, None, FINE)
        clean, time = force[k, kept], np.arange(force[k, kept].size) * motions.step[k, 0] * FINE
        session = int(order[k]) % 4
        if gains is not None:
            half = float(np.ptp(clean)) / 2
            gain, offset = gains[session] * [1.0, 0.25]
            own = 0.25 * damper.drift * rng.standard_normal()
            clean = clean * (1 + gain + own) + offset * damper.force + NOISE * half * rng.standard_normal(clean.size)
        current = motions.current[k, kept]
        period = PER_CYCLE * motions.step[k, 0] * FINE
        window = (2 * period, float(time[-1])) if kind == "sine" else None
        runs.append(
            Run(
                f"{kind}{k}", time, motions.x[k, kept], clean,
                float(current[0]) if kind == "sine" else current,  # type: ignore[arg-type]
                rig="synthetic", excitation=kind, window=window, notes={"session": f"s{session}"},
            )
        )  # fmt: skip
    return runs
