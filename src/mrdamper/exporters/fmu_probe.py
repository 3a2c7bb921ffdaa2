"""Check of an unpacked FMU with FMPy: a separate program, started by its path.

Writes one line per finding or stage, [code, text] as JSON, so that the stage of a crash is known.
"""

import contextlib
import json
import sys
from pathlib import Path
from typing import Any, NoReturn

import numpy as np


def main(folder: str, report: str, tolerance: str, *binary: str) -> None:
    """Check the FMU unpacked in `folder`, and its binary if a further argument is given."""
    probe = _Probe(folder, Path(report))
    with contextlib.suppress(_ProbeEndedError):
        probe.read()
        if binary:
            fmu = probe.load()
            probe.compare(float(tolerance))
            probe.step(fmu)
    probe.note("end")


class _ProbeEndedError(Exception):
    """A finding after which nothing more can be checked."""


class _Probe:
    """The check of one unpacked FMU, stage by stage."""

    described: Any  # its modelDescription.xml
    motion: np.ndarray  # inputs of the reference
    forces: np.ndarray  # outputs of the reference
    main: str  # name of the output that is compared

    def __init__(self, folder: str, report: Path):
        self._folder, self._report = folder, report

    def note(self, code: str, text: object = "") -> None:
        """Add a line to the report."""
        with self._report.open("a", encoding="utf-8") as out:
            out.write(json.dumps([code, " ".join(str(text).split())]) + "\n")

    def fail(self, code: str, text: object) -> NoReturn:
        """Add a finding after which nothing more can be checked."""
        self.note(code, text)
        raise _ProbeEndedError

    def read(self) -> None:
        """Validate the XML; read the description and the reference."""
        # Imported here, because discovery imports this module, and FMPy is an extra.
        from fmpy import read_model_description
        from fmpy.validation import validate_fmu

        for problem in validate_fmu(self._folder):
            self.note("E_FMU_SCHEMA", problem)
        try:
            self.described = read_model_description(self._folder, validate=False)
            references = {v.name: v.valueReference for v in self.described.modelVariables}
        except Exception as error:  # any error of FMPy's parser
            self.fail("E_FMU_DESCRIPTION", f"modelDescription.xml: {error!r}")
        if self.described.fmiVersion not in ("2.0", "3.0") or self.described.coSimulation is None:
            self.fail("E_FMU_VERSION", f"FMI {self.described.fmiVersion}; co-simulation of 2.0 or 3.0 is checked")
        try:
            self.motion, outputs = (
                _table(Path(self._folder, f"resources/reference_{way}.csv")) for way in ("in", "out")
            )
            if self.motion.size != outputs.size or self.motion.size < 3:
                raise ValueError("the tables do not fit together")
            names = [*(self.motion.dtype.names or ())][1:]
            self.main = [*(outputs.dtype.names or ())][1]
            self.dt = float(self.motion["time"][1])
            self.rows = [[float(row[name]) for name in names] for row in self.motion]
            self.forces = outputs[self.main]
        except (OSError, ValueError, IndexError) as error:
            self.fail("E_FMU_REFERENCE", f"the reference cannot be read: {error}")
        try:
            self.force, self.inputs = references[self.main], [references[name] for name in names]
        except KeyError as error:
            self.fail("E_FMU_DESCRIPTION", f"modelDescription.xml: no variable {error}")

    def load(self) -> Any:
        """Load the binary: a wrong token must be refused, the right one accepted."""
        from fmpy import instantiate_fmu

        self.note("stage", "token")
        right, self.described.guid = self.described.guid, "{00000000-0000-4000-8000-000000000000}"
        try:
            instantiate_fmu(self._folder, self.described)
            self.note("E_FMU_TOKEN", "the binary takes any token")
        except AttributeError as error:  # ctypes, of a symbol
            self.fail("E_FMU_SYMBOL", f"the binary lacks {str(error).split()[-1]}")
        except Exception as error:  # FMPy's own are bare
            if "instantiate" not in str(error):
                self.fail("E_FMU_BINARY", f"the binary cannot be loaded: {error}")
        self.described.guid = right
        try:
            return instantiate_fmu(self._folder, self.described)
        except Exception:  # FMPy's own are bare
            self.fail("E_FMU_TOKEN", "the binary refuses the token of modelDescription.xml")

    def compare(self, tolerance: float) -> None:
        """Simulate the reference motion and compare the force."""
        from fmpy import simulate_fmu
        from fmpy.fmi1 import FMICallException

        self.note("stage", "reference")
        end = dict(stop_time=self.motion["time"][-1], output_interval=self.dt)
        try:
            answer: Any = simulate_fmu(self._folder, input=self.motion, output=[self.main], validate=False, **end)
        except FMICallException as error:
            self.fail("E_FMU_REFERENCE", f"the reference is not answered: {error}")
        force = answer[self.main]
        worst = np.abs(force - self.forces).max() if force.shape == self.forces.shape else np.nan
        if not worst <= tolerance * np.abs(self.forces).max():
            self.note("E_FMU_REFERENCE", f"{self.main} differs from the reference by {worst:.3g}")

    def step(self, fmu: Any) -> None:
        """Step the binary: bad inputs must be refused, a stored state must lead to the same forces again."""
        from fmpy.fmi1 import FMICallException

        old, dt, rows = self.described.fmiVersion == "2.0", self.dt, self.rows
        if old:
            fmu.setupExperiment()
        put, get = (getattr(fmu, way + ("Real" if old else "Float64")) for way in ("set", "get"))

        def force_after(values: list[float], dt: float) -> float:
            put(self.inputs, values)
            fmu.doStep(0.0, dt)
            return get([self.force])[0]

        self.note("stage", "refusals")
        fmu.enterInitializationMode()
        put(self.inputs, rows[0])
        fmu.exitInitializationMode()
        tries = {"input nan": lambda: put(self.inputs, [np.nan, *rows[0][1:]])}
        tries |= {f"step {bad}": lambda bad=bad: fmu.doStep(0.0, bad) for bad in (0.0, -dt, np.nan, np.inf)}
        for name, attempt in tries.items():
            with contextlib.suppress(FMICallException):
                attempt()
                self.note("E_FMU_REFUSAL", f"the binary lets pass: {name}")

        self.note("stage", "state")
        try:
            for row in rows[:-20]:
                force_after(row, dt)
            saved = fmu.getFMUState()
            ways = [saved, fmu.deserializeFMUState(fmu.serializeFMUState(saved))]
            straight = [force_after(row, 2 * dt) for row in rows[-20:]]
            for word, state in zip(("saved", "carried"), ways, strict=True):
                fmu.setFMUState(state)
                if [force_after(row, 2 * dt) for row in rows[-20:]] != straight:
                    self.note("E_FMU_STATE", f"a {word} state does not lead to the same forces again")
                fmu.freeFMUState(state)
        except FMICallException as error:
            self.note("E_FMU_STATE", f"a state cannot be carried: {error}")
        fmu.terminate()
        fmu.freeInstance()


def _table(path: Path) -> np.ndarray:
    table = np.genfromtxt(path, delimiter=",", names=True)
    if not all(np.isfinite(table[name]).all() for name in table.dtype.names or ()):
        raise ValueError(f"{path.name} holds what is no number")
    return table


if __name__ == "__main__":
    main(*sys.argv[1:])
