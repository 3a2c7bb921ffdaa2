"""Common parts of all attacks: hostile texts and values, and the count of what was tried and held."""

from __future__ import annotations

import math
import random
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar

Item = TypeVar("Item")

NASTY = (
    "*/", "*\\/", "*\\/ int canary(void){return 1;} /*", "/*", "//", "??/", "\\", "\n", "\r", "\x00", "\x1b[2J",
    "\u202e", "<script>canary()</script>", "]]>", "<!--", "&", '"', "'", "<", ">", "=cmd|' /C calc'!A0", "+1",
    "-1+cmd", "\u2028", "@SUM(A1)", "\t", ";=1", ",", "\\input{canary}", "\\write18{canary}", "$", "^^5c", "%", "#",
    "{", "}", "`", "|", "![a](javascript:canary)", "[a](b)", "../../canary", "..", "/", "C:\\", "con", "\xe9",
    "\u6f22", "\U0001f600", " ", "", "MTS 810/25kN", "{{7*7}}", "{% raw %}", "%s%n", "a" * 300,
)  # fmt: skip


ODD = (
    None, True, False, 0, -1, 1, 1e-300, 1e300, -1e300, 10**30, "", "x", "1", "1e5", [], {}, [1.0], [1.0, 2.0], ["a"],
    [[1.0]], {"a": 1}, 1e308, -0.0, 5e-324, "a\x1b[0m", "../x", [None], 0.1, 1e9, [0.0, 0.0], [1e300, -1e300],
)  # fmt: skip


_TOLD = 5  # of a kind, as they happen


@dataclass
class Count:
    """Number of trials of a kind, and those that did not hold."""

    kind: str
    tried: int = 0
    broke: list[str] = field(default_factory=list)
    began: float = field(default_factory=time.monotonic)

    def check(self, held: bool, what: object) -> None:
        """Count one."""
        self.tried += 1
        if not held:
            self.broke.append(str(what)[:400])
            if len(self.broke) <= _TOLD:
                print(f"    broke: {self.kind}: {self.broke[-1]}", flush=True)

    def __str__(self) -> str:
        seconds = time.monotonic() - self.began
        return f"{self.kind:34}{self.tried:8} tried{self.tried - len(self.broke):8} held{seconds:8.0f} s"


@dataclass
class Clock:
    """When attacks end, whatever is left of them."""

    stop_at: float = math.inf
    stopped: bool = False


CLOCK = Clock()


def within(items: Iterable[Item]) -> Iterator[Item]:
    """Items as long as there is time."""
    for item in items:
        if time.monotonic() > CLOCK.stop_at:
            CLOCK.stopped = True
            return
        yield item


def names(count: int, rng: random.Random) -> Iterator[str]:
    """Hostile names: pieces that mean something somewhere, alone and together, and any characters."""
    yield from NASTY
    for _ in range(count - len(NASTY)):
        pieces = [rng.choice(NASTY) for _ in range(rng.randint(1, 5))]
        if rng.random() < 0.3:
            pieces.append("".join(chr(rng.choice([rng.randrange(0x250), rng.randrange(0xD800)])) for _ in range(9)))
        yield "".join(pieces)


def typed(count: Count, what: object, call: Callable[[], Any]) -> Any:
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


def sample_damper() -> Any:
    from mrdamper.dampers.envelope import Envelope
    from mrdamper.dampers.joint import JointDamper
    from mrdamper.models import model_type

    values = {"c": 1440.0, "alpha": 9e5, "beta": 2e5, "gamma": 2e5, "f0": 60.0, "k1": 800.0}
    envelope = Envelope((0.0, 1.0), (0.5, 4.0), (0.004, 0.02), (0.02, 0.3))
    return JointDamper(model_type("bouc-wen").build(values), tuple(values), rig="bench", envelope=envelope)
