"""`mrdamper plan`: which tests next."""

from __future__ import annotations

from pathlib import Path

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(epilog="Example: mrdamper plan model.json --limits limits.toml --hours 2 --out next")
    def plan(
        model: Path | None = typer.Argument(None, help="model.json written by mrdamper study; none: a first matrix."),
        limits: Path | None = typer.Option(
            None, "--limits", help="TOML: current_A, frequency_Hz, amplitude_mm = [lowest, highest], velocity_m_s, ..."
        ),
        hours: float = typer.Option(..., "--hours", help="Rig time [h]."),
        out: Path = typer.Option(..., "--out", help="Folder for plan.csv and the records to play."),
    ) -> None:
        """Propose the records that shrink the doubt about a damper most, or a first test matrix."""
        import numpy as np

        from mrdamper.errors import InputError
        from mrdamper.files.atomic import write_into
        from mrdamper.files.encoding import csv_text
        from mrdamper.files.model_file import load_model
        from mrdamper.study.plan import first_matrix, limits_of, plan_tests, read_limits, record_of, rows, taught_least

        damper = load_model(model) if model else None
        if limits is None and damper is None:
            raise InputError("neither a model nor limits", mend="give --limits limits.toml", code="E_LIMITS")
        allowed = read_limits(limits) if limits else limits_of(damper)  # type: ignore[arg-type]
        chosen = plan_tests(damper, allowed, hours) if damper else first_matrix(allowed, hours)
        names = []
        with write_into(out) as folder:
            for number, item in enumerate(chosen, start=1):
                c = item.condition
                name = f"plan_{number:02d}_{c.current_A:.3g}A_{c.frequency_Hz:.3g}Hz_{1e3 * c.amplitude_m:.3g}mm.csv"
                motion, force = record_of(item, allowed, damper)
                table = np.column_stack([motion.time, motion.displacement, force, motion.current])
                text = "time_s,displacement_m,force_N,current_A\n"
                text += "".join(",".join(f"{v:.9g}" for v in row) + "\n" for row in table.tolist())
                (folder / name).write_text(text, encoding="utf-8")
                names.append(name)
            (folder / "plan.csv").write_text(csv_text(rows(chosen, names)), encoding="utf-8")
        minutes = sum(item.minutes for item in chosen)
        said = f"{len(chosen)} records, {minutes:.0f} of {60 * hours:.0f} minutes, force_N in them is what to expect"
        if damper and chosen:
            said += f"; standard deviation of the force {100 * chosen[0].before:.2f} -> {100 * chosen[-1].after:.2f} %"
        typer.echo(f"{out / 'plan.csv'}\n{said}")
        if damper and (least := taught_least(damper)):
            runs = ", ".join(f"{name} ({100 * share:.1f} %)" for name, share in least)
            typer.echo(f"existing runs that taught least: {runs} of what is known")
