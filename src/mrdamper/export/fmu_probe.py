"""Validates, loads and walks an unpacked FMU with FMPy: a program of its own, started by its path.

Writes a line a finding or stage, [code, text] as JSON, so that a crash leaves its place.
"""

import contextlib
import json
import sys
from pathlib import Path
from typing import Any, NoReturn

import numpy as np


def main(folder: str, report: str, tolerance: str, *binary: str) -> None:
    """Look at the FMU unpacked in `folder`, its binary too if told so."""
    # Here, because finding the exporters imports this module, and FMPy is an extra.
    from fmpy import instantiate_fmu, read_model_description, simulate_fmu
    from fmpy.fmi1 import FMICallException
    from fmpy.validation import validate_fmu

    def say(code: str, text: object = "") -> None:
        with Path(report).open("a", encoding="utf-8") as out:
            out.write(json.dumps([code, " ".join(str(text).split())]) + "\n")

    def failed(code: str, text: object) -> NoReturn:
        say(code, text)
        say("end")
        sys.exit()

    for problem in validate_fmu(folder):
        say("E_FMU_SCHEMA", problem)
    try:
        described: Any = read_model_description(folder, validate=False)
        references = {v.name: v.valueReference for v in described.modelVariables}
    except Exception as error:  # whatever FMPy's parser meets
        failed("E_FMU_DESCRIPTION", f"modelDescription.xml: {error!r}")
    if described.fmiVersion not in ("2.0", "3.0") or described.coSimulation is None:
        failed("E_FMU_VERSION", f"FMI {described.fmiVersion}; co-simulation of 2.0 or 3.0 is checked")
    try:
        motion, known = (_table(Path(folder, f"resources/reference_{way}.csv")) for way in ("in", "out"))
        if motion.size != known.size or motion.size < 3:
            raise ValueError("the tables do not fit together")
        names, main = [*(motion.dtype.names or ())][1:], [*(known.dtype.names or ())][1]
        dt, rows = float(motion["time"][1]), [[float(row[name]) for name in names] for row in motion]
        forces = known[main]
    except (OSError, ValueError, IndexError) as error:
        failed("E_FMU_REFERENCE", f"the reference cannot be read: {error}")
    try:
        force, inputs = references[main], [references[name] for name in names]
    except KeyError as error:
        failed("E_FMU_DESCRIPTION", f"modelDescription.xml: no variable {error}")
    if not binary:
        return say("end")

    say("stage", "token")
    right, described.guid = described.guid, "{00000000-0000-4000-8000-000000000000}"
    try:
        instantiate_fmu(folder, described)
        say("E_FMU_TOKEN", "the binary takes any token")
    except AttributeError as error:  # ctypes, of a symbol
        failed("E_FMU_SYMBOL", f"the binary lacks {str(error).split()[-1]}")
    except Exception as error:  # FMPy's own are bare
        if "instantiate" not in str(error):
            failed("E_FMU_BINARY", f"the binary cannot be loaded: {error}")
    described.guid = right
    try:
        fmu: Any = instantiate_fmu(folder, described)
    except Exception:  # FMPy's own are bare
        failed("E_FMU_TOKEN", "the binary refuses the token of modelDescription.xml")

    say("stage", "reference")
    end = dict(stop_time=motion["time"][-1], output_interval=dt)
    try:
        answer: Any = simulate_fmu(folder, input=motion, output=[main], validate=False, **end)[main]
    except FMICallException as error:
        failed("E_FMU_REFERENCE", f"the reference is not answered: {error}")
    worst = np.abs(answer - forces).max() if answer.shape == forces.shape else np.nan
    if not worst <= float(tolerance) * np.abs(forces).max():
        say("E_FMU_REFERENCE", f"{main} differs from the reference by {worst:.3g}")

    if described.fmiVersion == "2.0":
        fmu.setupExperiment()
    put, get = (getattr(fmu, w + ("Real" if described.fmiVersion == "2.0" else "Float64")) for w in ("set", "get"))

    def step(values: list[float], dt: float) -> float:
        put(inputs, values)
        fmu.doStep(0.0, dt)
        return get([force])[0]

    say("stage", "refusals")
    fmu.enterInitializationMode()
    put(inputs, rows[0])
    fmu.exitInitializationMode()
    tries = {"input nan": lambda: put(inputs, [np.nan, *rows[0][1:]])}
    tries |= {f"step {bad}": lambda bad=bad: fmu.doStep(0.0, bad) for bad in (0.0, -dt, np.nan, np.inf)}
    for name, attempt in tries.items():
        with contextlib.suppress(FMICallException):
            attempt()
            say("E_FMU_REFUSAL", f"the binary lets pass: {name}")

    say("stage", "state")
    try:
        for row in rows[:-20]:
            step(row, dt)
        saved = fmu.getFMUState()
        ways = [saved, fmu.deserializeFMUState(fmu.serializeFMUState(saved))]
        straight = [step(row, 2 * dt) for row in rows[-20:]]
        for word, state in zip(("saved", "carried"), ways, strict=True):
            fmu.setFMUState(state)
            if [step(row, 2 * dt) for row in rows[-20:]] != straight:
                say("E_FMU_STATE", f"a {word} state does not lead to the same forces again")
            fmu.freeFMUState(state)
    except FMICallException as error:
        say("E_FMU_STATE", f"a state cannot be carried: {error}")
    fmu.terminate()
    fmu.freeInstance()
    say("end")


def _table(path: Path) -> np.ndarray:
    found = np.genfromtxt(path, delimiter=",", names=True)
    if not all(np.isfinite(found[name]).all() for name in found.dtype.names or ()):
        raise ValueError(f"{path.name} holds what is no number")
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
