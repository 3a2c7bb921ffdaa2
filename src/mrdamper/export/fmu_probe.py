"""Loads an FMU's binary and walks it through its reference: run as a program of its own.

A binary that crashes or hangs takes this process with it and nobody else. It is started by
its path, so it imports the standard library only. A task comes in as JSON on standard input;
what was seen goes out line by line, each a JSON object, so that a crash leaves its place.
"""

from __future__ import annotations

import ctypes
import json
import math
import sys
from collections.abc import Sequence
from typing import Any

_Double, _Size, _Pointer, _Text = ctypes.c_double, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_char_p
_Logger2 = ctypes.CFUNCTYPE(None, _Pointer, _Text, ctypes.c_int, _Text, _Text)
_Logger3 = ctypes.CFUNCTYPE(None, _Pointer, ctypes.c_int, _Text, _Text)


def main() -> None:
    """Say what is seen, in the order of what depends on what."""
    task = json.load(sys.stdin)
    say(stage="load")
    try:
        library = ctypes.CDLL(task["library"])
    except OSError as error:
        say(stage="load", error=str(error))
        return
    missing = [symbol for symbol in task["symbols"] if not hasattr(library, symbol)]
    say(stage="symbols", missing=missing)
    if missing:
        return
    api = (Fmi2 if task["fmi"] == 2 else Fmi3)(library)
    say(stage="token", wrong_accepted=bool(api.instantiate("{00000000-0000-4000-8000-000000000000}")))
    instance = Instance(api, task)
    say(stage="instantiate", done=bool(instance.handle))
    if not instance.handle:
        return
    say(stage="reference", **instance.reference(task["rows"]))
    say(stage="refusals", **instance.refusals())
    say(stage="state", **instance.state(task["rows"]))
    api.call("FreeInstance", instance.handle, status=False)
    say(stage="end")


def say(**facts: Any) -> None:
    """One line of JSON."""
    sys.stdout.write(f"\n{json.dumps(facts)}\n")
    sys.stdout.flush()


class Api:
    """Calls both versions of the standard share."""

    prefix = ""
    state_word = ""
    deserialize_word = ""

    def __init__(self, library: ctypes.CDLL):
        self.library = library

    def call(self, function: str, *arguments: Any, status: bool = True) -> int:
        called = getattr(self.library, self.prefix + function)
        called.restype = ctypes.c_int if status else None
        return called(*arguments)

    def get_state(self, handle: Any) -> Any:
        state = _Pointer()
        self.expect(self.call(f"Get{self.state_word}", handle, ctypes.byref(state)))
        return state

    def set_state(self, handle: Any, state: Any) -> None:
        self.expect(self.call(f"Set{self.state_word}", handle, state))

    def free_state(self, handle: Any, state: Any) -> None:
        self.expect(self.call(f"Free{self.state_word}", handle, ctypes.byref(state)))

    def carried(self, handle: Any, state: Any) -> Any:
        """The state after it went through bytes."""
        size, again = _Size(), _Pointer()
        self.expect(self.call(f"Serialized{self.state_word}Size", handle, state, ctypes.byref(size)))
        room = (ctypes.c_ubyte * size.value)()
        self.expect(self.call(f"Serialize{self.state_word}", handle, state, room, size))
        self.expect(self.call(self.deserialize_word, handle, room, size, ctypes.byref(again)))
        return again

    @staticmethod
    def expect(status: int) -> None:
        if status:
            raise RuntimeError(f"status {status}")


class Fmi2(Api):
    """FMI 2.0."""

    prefix = "fmi2"
    state_word = "FMUstate"
    deserialize_word = "DeSerializeFMUstate"

    class Callbacks(ctypes.Structure):
        """fmi2CallbackFunctions."""

        _fields_ = (
            ("logger", _Logger2),
            ("allocate", _Pointer),
            ("free", _Pointer),
            ("finished", _Pointer),
            ("environment", _Pointer),
        )

    def instantiate(self, token: str) -> Any:
        self.callbacks = self.Callbacks(_Logger2(lambda *message: None), None, None, None, None)
        self.library.fmi2Instantiate.restype = _Pointer
        made = self.library.fmi2Instantiate(b"probe", 1, token.encode(), None, ctypes.byref(self.callbacks), 0, 0)
        return _Pointer(made) if made else None

    def begin(self, handle: Any) -> None:
        self.expect(self.call("SetupExperiment", handle, 0, _Double(0), _Double(0), 0, _Double(0)))
        self.expect(self.call("EnterInitializationMode", handle))

    def set(self, handle: Any, references: Any, values: Any, count: int) -> int:
        return self.call("SetReal", handle, references, _Size(count), values)

    def get(self, handle: Any, references: Any, values: Any, count: int) -> int:
        return self.call("GetReal", handle, references, _Size(count), values)

    def step(self, handle: Any, time: float, step: float) -> int:
        return self.call("DoStep", handle, _Double(time), _Double(step), 0)


class Fmi3(Api):
    """FMI 3.0."""

    prefix = "fmi3"
    state_word = "FMUState"
    deserialize_word = "DeserializeFMUState"

    def instantiate(self, token: str) -> Any:
        self.logger = _Logger3(lambda *message: None)
        no = ctypes.c_bool(False)
        self.library.fmi3InstantiateCoSimulation.restype = _Pointer
        made = self.library.fmi3InstantiateCoSimulation(
            b"probe", token.encode(), None, no, no, no, no, None, _Size(0), None, self.logger, None
        )
        return _Pointer(made) if made else None

    def begin(self, handle: Any) -> None:
        no = ctypes.c_bool(False)
        self.expect(self.call("EnterInitializationMode", handle, no, _Double(0), _Double(0), no, _Double(0)))

    def set(self, handle: Any, references: Any, values: Any, count: int) -> int:
        return self.call("SetFloat64", handle, references, _Size(count), values, _Size(count))

    def get(self, handle: Any, references: Any, values: Any, count: int) -> int:
        return self.call("GetFloat64", handle, references, _Size(count), values, _Size(count))

    def step(self, handle: Any, time: float, step: float) -> int:
        flags, last = [ctypes.c_bool() for _ in range(3)], _Double()
        places = [ctypes.byref(place) for place in (*flags, last)]
        return self.call("DoStep", handle, _Double(time), _Double(step), ctypes.c_bool(True), *places)


class Instance:
    """One instance of the FMU under test."""

    def __init__(self, api: Any, task: dict[str, Any]):
        self.api, self.task = api, task
        self.inputs, self.force_reference, self.dt = task["inputs"], task["force"], task["step"]
        self.handle = api.instantiate(task["token"])

    def reference(self, rows: Sequence[Sequence[float]]) -> dict[str, Any]:
        """Forces at rest and along the motion, or the first status that is not OK."""
        self.api.begin(self.handle)
        status = self.set(rows[0]) or self.api.call("ExitInitializationMode", self.handle)
        forces = [self.force()]
        for k, row in enumerate(rows[:-1]):
            status = status or self.set(row) or self.api.step(self.handle, k * self.dt, self.dt)
            if status:
                return {"status": status, "row": k}
            forces.append(self.force())
        return {"status": 0, "forces": forces}

    def refusals(self) -> dict[str, Any]:
        """What must not pass: values that are not finite, steps that do not go forward."""
        force, here = self.force(), len(self.task["rows"]) * self.dt
        passed = [f"input {value}" for value in (math.nan, math.inf) if not self.set([value, 0.0, 0.0])]
        steps = (0.0, -self.dt, math.nan, math.inf)
        passed += [f"step {step}" for step in steps if not self.api.step(self.handle, here, step)]
        return {"passed": passed, "moved": self.force() != force}

    def state(self, rows: Sequence[Sequence[float]]) -> dict[str, Any]:
        """Whether a saved state leads to the same forces again, before and after it went through bytes."""
        saved = self.api.get_state(self.handle)
        carried = self.api.carried(self.handle, saved)
        ways = []
        for state in (None, saved, carried):
            if state is not None:
                self.api.set_state(self.handle, state)
            # Two internal steps each: between them the inputs of the step before count too.
            ways.append(
                [(self.set(row), self.api.step(self.handle, 0.0, 2 * self.dt), self.force()) for row in rows[:20]]
            )
        self.api.free_state(self.handle, saved)
        self.api.free_state(self.handle, carried)
        return {"saved": ways[1] == ways[0], "carried": ways[2] == ways[0]}

    def set(self, row: Sequence[float]) -> int:
        count = len(self.inputs)
        return self.api.set(self.handle, (ctypes.c_uint * count)(*self.inputs), (_Double * count)(*row), count)

    def force(self) -> float | None:
        """Force [N]; None where the FMU refuses it or gives no number (JSON has no NaN)."""
        value = (_Double * 1)()
        status = self.api.get(self.handle, (ctypes.c_uint * 1)(self.force_reference), value, 1)
        return value[0] if status == 0 and math.isfinite(value[0]) else None


if __name__ == "__main__":
    main()
