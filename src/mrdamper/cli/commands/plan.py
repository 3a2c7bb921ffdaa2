"""`mrdamper plan`: proposal of the next tests."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import typer

from mrdamper.cli.progress import progress_soon
from mrdamper.errors import InputError

# Names of the force in motion files, which an import does not take for a measured one
_COMPUTED = {"predicted_force_N": "of the model", "estimated_force_N": "from the rated force"}

app = typer.Typer()


@app.command(epilog="Example: mrdamper plan model.json --limits limits.toml --hours 2 --out next")
def plan(
    model: Path | None = typer.Argument(
        None, help="model.json written by mrdamper study; omit for a first test matrix."
    ),
    limits: Path | None = typer.Option(None, help="TOML file with limits of the test rig (mrdamper init limits)."),
    hours: float = typer.Option(..., help="Rig time [h], including setting up."),
    about: str | None = typer.Option(
        None, help="Parameter, or condition A,Hz,mm, to be determined best; default: all conditions."
    ),
    out: Path = typer.Option(..., help="Folder for plan.csv and one motion file per test."),
) -> None:
    """Propose the tests that reduce the uncertainty most.

    Without a model a first test matrix within the limits of the rig is proposed.
    """
    import numpy as np

    from mrdamper.dampers.model_file import load_model
    from mrdamper.data import Condition
    from mrdamper.data.atomic import ResultRecord, require_writable, write_result
    from mrdamper.data.encoding import csv_text
    from mrdamper.data.wording import counted
    from mrdamper.study.first_matrix import first_matrix
    from mrdamper.study.limits import Limits
    from mrdamper.study.plan import least_informative_runs, plan_tests
    from mrdamper.study.proposal import PlanRow

    require_writable(out, "plan")
    damper = load_model(model) if model else None
    if limits is None and damper is None:
        raise InputError("neither a model nor limits is given", remedy="give --limits limits.toml", code="E_LIMITS")
    if about is not None and damper is None:
        raise InputError("--about without a model", remedy="give a model.json")
    allowed = Limits.read(limits) if limits else Limits.of(damper)  # type: ignore[arg-type]
    heading = "predicted_force_N" if damper else "estimated_force_N" if allowed.force_N else ""
    rows = []
    with progress_soon("planning") as tell, write_result(out, ResultRecord("plan")) as folder:
        if damper:
            doubt = Condition.of_text(about) if about and "," in about else about
            chosen, reckoning = plan_tests(damper, allowed, hours, doubt, tell)
        else:
            chosen, reckoning = first_matrix(allowed, hours), None
        for number, item in enumerate(chosen, start=1):
            c = item.condition
            name = f"plan_{number:02d}_{c.current_A:.3g}A_{c.frequency_Hz:.3g}Hz_{1e3 * c.amplitude_m:.3g}mm.csv"
            motion, force = item.record(allowed, damper)
            columns = {"time_s": motion.time, "displacement_m": motion.displacement}
            columns |= ({heading: force} if heading else {}) | {"current_A": motion.current}
            table, names = np.column_stack(list(columns.values())), ",".join(columns)
            np.savetxt(folder / name, table, "%.9g", ",", header=names, comments="", encoding="utf-8")
            rows.append(asdict(PlanRow.of(number, item, name)))
        (folder / "plan.csv").write_text(csv_text(rows), encoding="utf-8")
    sessions = len({item.session for item in chosen})
    minutes = sessions * allowed.opening + sum(item.minutes for item in chosen)
    typer.echo(
        f"{out / 'plan.csv'}\n{counted(len(chosen), 'record')} in {counted(sessions, 'session')}, {minutes:.0f} of "
        f"{60 * hours:.0f} minutes" + (f"; {heading} is {_COMPUTED[heading]}" if heading else "")
    )
    if damper is None or reckoning is None:
        return
    typer.echo(reckoning.summary(chosen))
    if least := least_informative_runs(damper):
        runs = ", ".join(f"{name} ({100 * share:.1f} %)" for name, share in least)
        typer.echo(f"least informative runs: {runs} of the information")
