"""F0, phase and parameters over the current, motion by motion, and their functions [Qian et al. 2024, Fig. 11–23]."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from mrdamper.data import Condition, Floats
from mrdamper.errors import IdentificationError
from mrdamper.paper.loop_figures import Made
from mrdamper.paper.recipes import LITERAL
from mrdamper.paper.results import SAME, Reproduction, amplitudes, function_of, motions, values
from mrdamper.report.plots.style import MEASURED, MM, current_colours, house_style, label, new_figure, powered
from mrdamper.statistics.functions.fitting import fit_function
from mrdamper.statistics.functions.forms import ParameterFunction, features

Curves = Mapping[int, tuple[Callable[[Floats], Floats] | None, str]]  # of a motion by its first run; what to say
_OVER: Mapping[str, tuple[Callable[[Condition], float], str]] = {
    "frequency": (lambda c: c.frequency_Hz, "Frequency (Hz)"),
    "speed": (lambda c: MM * c.frequency_Hz * c.amplitude_m, "f · A (mm Hz)"),
}


def readings_figure(name: str, text: str, form: str, study: Reproduction) -> Made:
    """F0, phi or f0 over current, motion by motion, with a function and its R² where one is asked for."""
    read = np.array([getattr(r, name) for r in study.readings])
    return _by_motion(study, read, text, _fits(study, read, form))


def parameter_figure(name: str, text: str, form: str, study: Reproduction) -> Made:
    """A parameter of the literal identifications over current, a function fitted for every motion."""
    found, log = _literal(name, study), name == "beta"
    if found is None:
        return "the literal recipe could not be followed"
    return _by_motion(study, found, text, _fits(study, found, form, log=log), log=log)


def r2_figure(name: str, form: str, study: Reproduction) -> Made:
    """Draw R² of the function of the current at every condition of motion."""
    values = amplitudes(study) if name == "F0" else _literal(name, study)
    if values is None or values.size != len(study.conditions):
        return f"{name} was not identified on every run"
    names, shares = [], []
    for group in motions(study):
        with suppress(IdentificationError):
            conditions = [study.conditions[i] for i in group]
            shares.append(fit_function(form, conditions, values[group], log=name == "beta").r2)
            names.append(_named(conditions[0]).replace(", ", "\n"))
    if not shares:
        return "too few currents at every motion"
    with house_style():
        figure, (axes,) = new_figure(1, 1, 2.6)
        axes.bar(range(len(shares)), shares, color=MEASURED, alpha=0.35)
        axes.plot(range(len(shares)), shares, "o", ms=4, color=MEASURED, label="R²")
        axes.set_ylim(min(0.0, *shares), 1.05)
        label(axes, "", "R² (–)")
        axes.set_xticks(range(len(names)), names, fontsize=7)
        return figure


def function_figure(name: str, text: str, study: Reproduction) -> Made:
    """A parameter of the literal identifications over current, with the one function of all runs."""
    values, whole = _literal(name, study), function_of(study, name)
    if values is None:
        return "the literal recipe could not be followed"
    if whole is None:
        return f"{name} has no function"
    scale, log = study.options.scaled(name, 1.0), name == "beta"
    curves = {}
    for group in motions(study):
        found = scale * whole.function(*features([study.conditions[i] for i in group]))
        r2 = _r2(*((np.log(values[group]), np.log(found)) if log else (values[group], found)))
        curve = partial(_along, whole.function, study.conditions[group[0]], scale)
        curves[group[0]] = curve, f"R² {r2:.3f}" if np.isfinite(r2) else ""
    return _by_motion(study, values, text, curves, f"R² {whole.r2:.3f} over all runs", log=log)


def over_motion(name: str, over: str, text: str, form: str, study: Reproduction) -> Made:
    """What is left of F0 or a parameter beside its current law, over frequency or speed, beside the function."""
    values = amplitudes(study) if name == "F0" else _literal(name, study)
    if values is None or values.size != len(study.conditions):
        return f"{name} was not identified on every run"
    if name == "beta":
        values = np.log(np.maximum(values, 1e-12))
    try:
        found = fit_function(form, study.conditions, values).function
    except IdentificationError as error:
        return str(error)
    firsts, (u, text_of_axis) = [study.conditions[group[0]] for group in motions(study)], _OVER[over]
    left = beside_current_law(found, study.conditions, values)
    level = np.array([float(np.mean(left[group])) for group in motions(study)])
    curve = np.array([float(found(0.0, c.frequency_Hz, c.amplitude_m)) for c in firsts])
    title = f"R² {r2:.3f} over the motions" if np.isfinite(r2 := _r2(level, curve)) else "one motion: no R²"
    text, power = powered(text, float(np.max(np.abs(level))))
    with house_style():
        figure, (axes,) = new_figure(1, 1, 3.0, right=2.0)
        shades = current_colours([c.peak_velocity for c in firsts])
        for c, value, fitted in zip(firsts, power * level, power * curve, strict=True):
            axes.plot(u(c), value, "o", ms=4, color=shades[c.peak_velocity], label=_named(c))
            axes.plot(u(c), fitted, "_", ms=11, mew=1.4, color=shades[c.peak_velocity])
        for first in {round(np.log(c.amplitude_m) / SAME): c for c in firsts if over == "frequency"}.values():
            ends = np.linspace(min(map(u, firsts)), max(map(u, firsts)), 40)
            line = [float(found(0.0, f, first.amplitude_m)) for f in ends]
            axes.plot(ends, power * np.array(line), lw=0.7, color=MEASURED, alpha=0.6)
        if over == "speed":
            ends = np.linspace(min(map(u, firsts)), max(map(u, firsts)), 40)
            line = [float(found(0.0, 1.0, f / MM)) for f in ends]
            axes.plot(ends, power * np.array(line), lw=0.7, color=MEASURED, alpha=0.6)
        axes.plot([], [], "_", ms=11, mew=1.4, color=MEASURED, label="by the function")
        label(axes, text_of_axis, text, title)
        _list_beside(axes)
        return figure


def beside_current_law(function: ParameterFunction, conditions: Sequence[Condition], values: Floats) -> Floats:
    """Values less what the function says of the current alone [Qian et al. 2024, Eq. 24, 28, 33, 37]."""
    I, f, A = features(conditions)
    return values - (function(I, f, A) - function(np.zeros(I.size), f, A))


def _fits(study: Reproduction, values: Floats, form: str, *, log: bool = False) -> Curves:
    """A function of the current for every motion, by its first run, and what to say of it."""
    fits: dict[int, tuple[Callable[[Floats], Floats] | None, str]] = {}
    for group in motions(study) if form else ():
        conditions = [study.conditions[i] for i in group]
        try:
            found = fit_function(form, conditions, values[group], log=log)
        except IdentificationError:
            fits[group[0]] = None, "too few currents"
            continue
        curve = partial(_along, found.function, conditions[0], 1.0)
        # A mean explains nothing: its value says more than an R² of zero.
        level = float(np.ravel(curve(np.zeros(1)))[0])
        exact = len(found.function.coefficients) + len(found.function.rates) >= len(group)
        said = "through its points" if exact else f"R² {found.r2:.3f}"
        fits[group[0]] = curve, f"{level:.4g}" if form == "constant" else said
    return fits


def _by_motion(
    study: Reproduction,
    values: Floats,
    text: str,
    curves: Curves,
    title: str = "",
    *,
    log: bool = False,
) -> Made:
    """Values over current, one colour a motion, with the curves of the motions and what there is to say of each."""
    text, power = (text, 1.0) if log else powered(text, float(np.max(np.abs(values))))
    with house_style():
        figure, (axes,) = new_figure(1, 1, 3.4, right=2.3)
        shades = current_colours([study.conditions[group[0]].peak_velocity for group in motions(study)])
        for group in motions(study):
            first = study.conditions[group[0]]
            colour, (curve, said) = shades[first.peak_velocity], curves.get(group[0], (None, ""))
            currents = np.array([study.conditions[i].current_A for i in group])
            axes.plot(currents, power * values[group], "o", ms=3.5, color=colour)
            if not curves:
                axes.plot(currents, power * values[group], lw=0.8, color=colour)
            if curve is not None:
                dense = np.linspace(currents.min(), currents.max(), 60)
                axes.plot(dense, power * curve(dense) * np.ones(60), lw=0.9, color=colour)
            line = "-" if curve is not None else ""
            name = f"{_named(first)}: {said}" if said else _named(first)
            axes.plot([], [], f"o{line}", ms=3.5, lw=0.9, color=colour, label=name)
        if log:
            axes.set_yscale("log")
        label(axes, "Current (A)", text, title)
        _list_beside(axes)
        return figure


def _along(function: ParameterFunction, at: Condition, scale: float, current: Floats) -> Floats:
    return scale * function(current, at.frequency_Hz, at.amplitude_m)


def _literal(name: str, study: Reproduction) -> Floats | None:
    """A parameter of the literal identifications as it reads with the preset A."""
    found = values(study, LITERAL, name)
    return np.array([study.options.scaled(name, value) for value in found.tolist()]) if found.size else None


def _r2(values: Floats, found: Floats) -> float:
    spread = float(np.sum((values - values.mean()) ** 2))
    return 1 - float(np.sum((found - values) ** 2)) / spread if spread > 0 else float("nan")


def _named(c: Condition) -> str:
    return f"{c.frequency_Hz:.2g} Hz, {MM * c.amplitude_m:.3g} mm"


def _list_beside(axes: Axes) -> None:
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
