"""`mrdamper simulate`: a vehicle or building with dampers and a controller."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mrdamper.cli.output import aligned, parse_named, shortened, warn
from mrdamper.cli.progress import progress_soon
from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper
    from mrdamper.data import Floats
    from mrdamper.systems.controller_comparison import ControllerComparison
    from mrdamper.systems.controllers import Controller
    from mrdamper.systems.monte_carlo import Bands
    from mrdamper.systems.result import Simulation
    from mrdamper.systems.simulate import SystemLoop
    from mrdamper.systems.system_file import SystemFile

app = typer.Typer()


@app.command(epilog="Example: mrdamper simulate dyke1996 --input elcentro --time-scale 5 --volts 2.25 --json")
def simulate(
    system: str = typer.Argument(..., help="dyke1996, quarter-car, half-car, or a TOML file of the system."),
    source: str = typer.Option(
        ..., "--input", help="CSV with time_s and acceleration_m_s2, acceleration_g or height_m; or NAME[:KEY=VALUE,…]."
    ),
    damper: Path | None = typer.Option(None, help="model.json for every damper."),
    control: str = typer.Option("passive", help="Controller, NAME[:KEY=VALUE,…]."),
    current: float | None = typer.Option(None, help="Constant current [A]; the largest with a controller."),
    volts: float | None = typer.Option(None, help="Voltage of the current driver [V], instead of --current."),
    without: bool = typer.Option(False, "--without-damper", help="Simulate the system without dampers."),
    time_scale: float = typer.Option(1.0, help="Factor by which the input record is played faster."),
    step: float | None = typer.Option(None, help="Time step [s]; default: halved until peaks converge."),
    compare: list[str] | None = typer.Option(None, help="Controller to compare, or all; may be repeated."),
    draws: int | None = typer.Option(None, help="Monte Carlo runs over the uncertainty: 5 to 95 % ranges."),
    seed: int = typer.Option(1, help="Random seed of --draws."),
    out: Path | None = typer.Option(None, help="Folder for simulation.html, time histories and results."),
    law_out: Path | None = typer.Option(None, "--c", help="Folder for the controller as C99 source."),
    law_fmu: Path | None = typer.Option(None, "--fmu", help="File for the controller as FMU."),
    verbose: bool = typer.Option(False, "--verbose", help="Print every file written."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON, SI units."),
) -> None:
    """Simulate a vehicle or building with dampers and a controller."""
    from mrdamper.systems.controller_comparison import compare_controllers
    from mrdamper.systems.inputs import load_input
    from mrdamper.systems.monte_carlo import draw, monte_carlo
    from mrdamper.systems.simulate import SystemLoop, simulate_system
    from mrdamper.systems.system_file import load_system

    _refuse_no_folder(out, compare)
    loaded, shaken_by = load_system(system), load_input(*parse_named(source, "--input"), time_scale=time_scale)
    if without and damper:
        raise InputError("--damper together with --without-damper", remedy="give one of them", code="E_OPTION")
    dampers = {} if without else _dampers(loaded, damper, system)
    highest = _amperes(current, volts, dampers)
    controller, others = _controller(control, highest), [_controller(text) for text in _all_of(compare or [])]
    if not dampers and (others or draws is not None):
        raise InputError("--compare or --draws without a damper", remedy="omit them, or omit --without-damper")
    given = (loaded.system, shaken_by, dampers)
    if law_out or law_fmu:
        _export_law(SystemLoop(*given, controller, highest), law_out, law_fmu)
    drawn = None if draws is None else draw(dampers, draws, seed)
    with progress_soon(f"{loaded.system.title}, time step halved until peaks converge") as tell:
        done = simulate_system(*given, controller, step, highest)
        bands, compared, paths = None, None, []
        if drawn is not None:
            bands = monte_carlo(SystemLoop(*given, controller, highest, free=True), drawn, done, tell)
        if out is not None:
            from mrdamper.report.simulation import write_simulation

            compared = compare_controllers(done, *given[1:], others, highest, tell) if others else None
            tell("writing", 1.0)
            facts = _facts(system, source, time_scale, (damper or "that of the system") if dampers else "")
            paths = write_simulation(done, out, compared, bands, facts)
    warn(shortened([f"{path}" for path in paths], 2, verbose))
    if as_json:
        print(json.dumps(_figures(done, dampers) | _banded(bands), indent=1))
        return
    _print_peaks(done)
    _print_comparison(compared)
    _print_warnings(done)
    _print_bands(done, bands, dampers)


def _refuse_no_folder(out: Path | None, compare: list[str] | None) -> None:
    from mrdamper.data.atomic import require_writable

    if out is None and compare:
        raise InputError("--compare without --out", remedy="give a folder for the report")
    require_writable(out, "simulate")


def _facts(system: str, source: str, time_scale: float, damper: Path | str) -> dict[str, str]:
    scaled = f", played {time_scale:g} times as fast" if time_scale != 1 else ""
    return {"system": system, "input": f"{source}{scaled}"} | ({"damper": str(damper)} if damper else {})


def _dampers(loaded: SystemFile, model: Path | None, where: str) -> dict[str, Damper]:
    """Return the damper of every link: the model given, or the system's own."""
    from mrdamper.dampers.model_file import load_model

    links = [link.name for link in loaded.system.dampers]
    dampers = dict(loaded.dampers) if model is None else dict.fromkeys(links, load_model(model))
    if empty := [name for name in links if name not in dampers]:
        raise InputError(
            f"no model for the damper {', '.join(empty)}",
            where=where,
            remedy="give --damper model.json, or --without-damper",
            code="E_NO_DAMPER",
        )
    return dampers


def _export_law(loop: SystemLoop, folder: Path | None, fmu: Path | None) -> None:
    """Return the law of a loop as C99 in a folder, and as an FMU."""
    from mrdamper.exporters.c import write_program
    from mrdamper.exporters.fmu_program import write_program_fmu
    from mrdamper.systems.simulate import PERIOD

    law, (name, title) = loop.control.program, (type(loop.controller).name, type(loop.controller).title)
    if law is None:
        raise InputError(f"{name} has no law to export", remedy="give --control a law")
    paths, notes = [] if folder is None else write_program(law, name, title, loop.control.units, folder), ()
    if fmu is not None:
        path, notes = write_program_fmu(law, name, title, loop.control.units, fmu, PERIOD, loop.control.start)
        paths += path
    warn([*paths, *(f"note: {note}" for note in notes)])


def _all_of(names: list[str]) -> list[str]:
    """Return the names, "all" as every law there is."""
    from mrdamper.systems.controllers import controller_types

    laws = [name for name in controller_types() if name not in ("passive", "preview")]
    return list(dict.fromkeys(name for given in names for name in (laws if given == "all" else [given])))


def _controller(text: str, current: float | None = None) -> Controller:
    """Return a controller by name; the current, where one is given, is the constant one's [A]."""
    from mrdamper.data.parameters import with_values
    from mrdamper.systems.controllers import controller_type

    name, values = parse_named(text, "--control")
    if name == text == "passive" and current is not None:
        values = {"current_A": current}
    return with_values(controller_type(name), values)


def _amperes(current: float | None, volts: float | None, dampers: dict[str, Damper]) -> float | None:
    """Return the current asked for, straight or through the driver of the dampers [A]."""
    if current is not None and volts is not None:
        raise InputError("--current beside --volts", remedy="give one")
    if volts is None or not dampers:
        if current is not None and not 0 <= current < math.inf:
            raise InputError(f"--current {current:g}", remedy="give zero or more")
        return current
    if not 0 <= volts < math.inf:
        raise InputError(f"--volts {volts:g}", remedy="give zero or more")
    gains = {d.coil.driver if d.coil else None for d in dampers.values()}
    driver = gains.pop()
    if gains or driver is None:
        raise InputError(
            "volts for a damper whose driver is not known", remedy="give --current, or a model with a coil driver"
        )
    return min(driver.amperes_per_volt * volts, driver.limit_A or math.inf)


def _figures(done: Simulation, dampers: Mapping[str, Damper]) -> dict[str, Any]:
    from mrdamper.systems.measures import measures
    from mrdamper.systems.rise_time import rise_times

    peaks = {f"peak_{name}": values.tolist() for name, values in done.peaks.items()}
    forces = dict(zip((link.name for link in done.dampers), peaks.pop("peak_force_N"), strict=True))
    return {
        "system": done.system.name,
        "controller": type(done.controller).name,
        "coordinates": list(done.system.coordinates),
        "spans": list(done.system.spans),
        **peaks,
        "peak_force_N": max(forces.values(), default=0.0),
        "peak_force_by_damper_N": forces,
        "step_s": done.step,
        "step_halving_change": done.halving,
        "settled": done.settled,
        "energy_gap": done.energy_gap,
        "outside_tests": done.outside,
        "out_of_reach": done.unreachable,
        "timing": done.timing,
        "rise_times_s": {name: rise_times(d) for name, d in dampers.items() if d.coil},
        "measures": measures(done),
    }


def _banded(bands: Bands | None) -> dict[str, Any]:
    if bands is None:
        return {}
    from mrdamper.systems.monte_carlo import LEVELS

    rows = {name: values.tolist() for name, values in bands.quantiles().items()}
    return {"bands": {"levels": LEVELS, "draws": bands.count, "lost": bands.lost,
                      "step_s": bands.step, "step_change": bands.step_change}
            | {f"peak_{name}": rows.pop(name) for name in bands.peaks} | {"measures": rows}}  # fmt: skip


def _print_bands(done: Simulation, bands: Bands | None, dampers: Mapping[str, Damper]) -> None:
    from mrdamper.data.wording import number

    if bands is None:
        return
    from mrdamper.systems.result import HALVING

    quantiles = bands.quantiles()
    low, high = ({name: rows[end] for name, rows in quantiles.items()} for end in (0, -1))
    typer.echo(f"5 to 95 % of {bands.count} draws of the parameters and the session:")
    _print_rows(done, low, high)
    if bands.step_change > HALVING:
        typer.echo(
            f"the step of the draws, {1e3 * bands.step:.3g} ms, moves a peak by {number(100 * bands.step_change, 2)} %",
            err=True,
        )
    if bands.lost:
        typer.echo(f"warning: {bands.lost} draws had no solution and are omitted", err=True)
    for name, damper in dampers.items():
        if damper.uncertainty and damper.uncertainty.left_out:
            share = 100 * damper.uncertainty.force
            typer.echo(f"not included: model error of {name}, {number(share, 2)} % of half the peak-to-peak force")


def _print_rows(done: Simulation, *ends: Mapping[str, Floats]) -> None:
    """Print the peaks of every coordinate, span and damper, or the ends of their ranges."""

    def text(kind: str, i: int, width: int, digits: int, factor: float = 1.0) -> str:
        first, *last = (f"{factor * end[kind][i]:.{digits}f}" for end in ends)
        return " to ".join([first.rjust(width), *last])

    for i, name in enumerate(done.system.coordinates):
        x, a = text("displacement_m", i, 9, 3, 1e3), text("acceleration_m_s2", i, 8, 3)
        typer.echo(f"  {name:12} x {x} mm   a {a} m/s²")
    for i, name in enumerate(done.system.spans):
        typer.echo(f"  {name:12} drift {text('drift_m', i, 9, 3, 1e3)} mm")
    for i, link in enumerate(done.dampers):
        typer.echo(f"  {link.name:12} F {text('force_N', i, 9, 1)} N")


def _print_peaks(done: Simulation) -> None:
    from mrdamper.data.wording import number

    typer.echo(f"{done.headline}\npeak values:")
    _print_rows(done, done.peaks)
    typer.echo(
        f"step {1e3 * done.step:.3g} ms; the last halving changed a peak value by {number(100 * done.halving, 2)} %; "
        f"relative error of the energy balance {number(done.energy_gap, 1)}"
    )


def _print_comparison(compared: ControllerComparison | None) -> None:
    if compared is None:
        return
    typer.echo("improvement of the mean square from no current (0 %) to the non-causal optimum (100 %):")
    rows = [(f"  {title}", f"{100 * compared.share(title):.0f} %") for title in compared.runs]
    typer.echo("\n".join(aligned(rows)))


def _print_warnings(done: Simulation) -> None:
    from mrdamper.dampers.streaming import FLAGS
    from mrdamper.data.wording import number

    if not done.settled:
        typer.echo(
            "warning: the peak values have not converged with the step size; the motion is sensitive to small changes "
            "(switching controller, wheel lift-off, bump-stop contact or low damping)",
            err=True,
        )
    for name, shares in done.outside.items():
        parts = ", ".join(f"{quantity} {number(100 * share, 3)} %" for quantity, share in shares.items())
        beyond = " outside the tested range" if set(shares) <= set(FLAGS) else ""
        typer.echo(f"warning: {name}{beyond}: {parts} of the time", err=True)
    for name, share in done.unreachable.items():
        typer.echo(f"{name}: the force command could not be reached {number(100 * share, 3)} % of the time")
    if type(done.controller).calms:
        for name, timing in done.timing.items():
            if timing < 0:
                typer.echo(
                    f"warning: {name}: damping is high when it excites the body (correlation {timing:.2f}); "
                    "check the signs of the force and the velocities",
                    err=True,
                )
