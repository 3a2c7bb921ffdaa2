"""A study as files, written atomically: report.html, models, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.dampers.bands import scope
from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.model_file import dump_model
from mrdamper.dampers.modified import ModifiedFit
from mrdamper.dampers.uncertainty import table
from mrdamper.data.atomic import ResultRecord, publish
from mrdamper.data.encoding import csv_text, file_names
from mrdamper.data.progress import Progress, silent
from mrdamper.data.wording import counted, raised, span
from mrdamper.identification import Identification
from mrdamper.identification.characteristics import Characteristics
from mrdamper.identification.intervals import written
from mrdamper.models import Model
from mrdamper.report.about import About, Limit, about_of, load_about, load_limits
from mrdamper.report.damper_tests import facts_of_tests, figures_of_tests, force_rows, provenance
from mrdamper.report.limitations import PREDICTION, limitations
from mrdamper.report.page import made_from, plain, render_page
from mrdamper.report.plots.cycle import spread_out
from mrdamper.report.plots.figure import Figure
from mrdamper.report.plots.model import (
    BAND_LEVEL,
    motions_of,
    parameter_curves,
    predicted_loops,
    residual_map,
    score_strip,
)
from mrdamper.report.plots.reversal import force_since_reversal
from mrdamper.report.plots.rig_tests import measured_loops, test_analysis, test_matrix
from mrdamper.report.plots.style import MOST_NAMED, Picture, picture_files, picture_of, powered
from mrdamper.report.summary import error_sentence, omission_lines
from mrdamper.report.tables import identification_rows, score_rows
from mrdamper.study.cross_validation import NO_CURRENT
from mrdamper.study.processes import IN_PROCESS, Processes
from mrdamper.study.recipe import RecipeResult
from mrdamper.study.workflow import RigStudy, Study

_LOOPS_SHOWN = 6
_CV_RANGE = ("low_cv", "high_cv")  # columns with the range of a parameter in cross-validation


def write_study(
    study: Study,
    folder: str | Path,
    progress: Progress = silent,
    *,
    about: About | Mapping[str, Any] | str | Path | None = None,
    limits: Sequence[Limit] | str | Path = (),
    also: Sequence[str] = (),
    paper: str = "a4",
    processes: Processes = IN_PROCESS,
) -> list[Path]:
    """Write report.html, model files, tables and figures/ atomically, and return the files, the page first.

    The folder is made if missing; files of the same names are replaced together at the end. The head of the report
    `about` is given by its fields or as a TOML file (`mrdamper init about`), as are the `limits` of the measured force
    (`mrdamper init limits`), against which alone pass or fail is stated. Every figure is also written in the formats of
    `also`, "png" and "pdf", by the `processes`; "pdf" adds report.pdf, with pages of the size `paper`, "a4" or
    "letter". Raises `AboutError` if `about` or `limits` cannot be read, or has an unknown field, and `OutputError`
    if the folder cannot be written to.
    """
    if isinstance(about, (str, Path)):
        about = load_about(about)
    head = about if isinstance(about, About) else about_of(about or {}, "about")
    limits = load_limits(limits) if isinstance(limits, (str, Path)) else tuple(limits)
    # Figures as SVG alone cost less here than sending the study to a process, with what this one knows of its runs.
    painters = processes if also else IN_PROCESS
    drawn = painters.map(partial(_draw, also=tuple(also), limits=limits), study.rigs, progress)
    chapters, parts = [], file_names(rig.rig for rig in study.rigs)
    models, figures, vectors, forces = {}, {}, {}, []
    for number, (rig, pictures) in enumerate(zip(study.rigs, drawn, strict=True), 1):
        suffix = f"-{parts[rig.rig]}" if len(study.rigs) > 1 else ""
        models[f"model{suffix}.json"] = dump_model(rig.damper)
        figures |= picture_files(pictures, suffix)
        vectors |= {f"rig-{number}-{name}": picture["pdf"] for name, picture in pictures.items() if "pdf" in picture}
        chapters.append({**_chapter(rig, pictures, limits), "key": f"rig-{number}"})
        forces += force_rows(chapters[-1]["measured"] or {})
    footer = f"{made_from(study.dataset)}."
    title = f"MR damper study: {', '.join(r.rig for r in study.rigs) or study.dataset.name}"
    origin = provenance({rig.dataset.name: rig.dataset for rig in study.rigs})
    page = render_page("study.html.j2", head.title or title, footer, chapters=chapters, about=head, provenance=origin)
    files: dict[str, str | bytes] = {"report.html": page, **models, **figures}
    if "pdf" in also:
        from mrdamper.report.pdf import pdf_of

        files["report.pdf"] = pdf_of(page, vectors, paper)
    tables = _tables(study) | ({"forces": forces} if forces else {})
    files |= {f"{name}.csv": csv_text(rows) for name, rows in tables.items()}
    took = {rig.dataset.name: {c.recipe.name: c.seconds for c in rig.candidates} for rig in study.rigs}
    written = publish(folder, files, ResultRecord("study", seconds={"in all": study.seconds, **took}))
    progress("written", 1.0)
    return written


def _tables(study: Study) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of the tables by name; candidates share individual fits, which are listed once."""
    fits = {id(one): one for rig in study.rigs for c in rig.candidates for one in c.identifications}
    return {
        "identifications": identification_rows(list(fits.values()), study.dataset.name),
        "parameters": _parameter_rows(study),
        "validation": [
            row
            for rig in study.rigs
            for candidate in rig.candidates
            for row in score_rows(rig.dataset.name, candidate, "cross-validation", "validation")
        ],
        "coverage": [{"rig": rig.dataset.name, **rig.interval_coverage} for rig in study.rigs if rig.interval_coverage],
    }


def _draw(rig: RigStudy, progress: Progress, *, also: tuple[str, ...], limits: tuple[Limit, ...]) -> dict[str, Picture]:
    figures, pictures = _figures(rig, limits), {}
    for number, (name, figure) in enumerate(figures.items()):
        progress(f"{rig.rig or 'rig'}: figure {name}", number / len(figures))
        pictures[name] = picture_of(figure, also)
    return pictures


def _figures(rig: RigStudy, limits: Sequence[Limit]) -> dict[str, Figure]:
    chosen = rig.chosen
    scores = {}
    for candidate in rig.candidates:
        scores[f"{candidate.title}, cross-validation"] = candidate.cross_validated
        if candidate.validation.runs:
            scores[f"{candidate.title}, validation"] = candidate.validation
    train = [rig.dataset[run.run_id] for run in chosen.cross_validated.runs]
    measured, loops = _measured(rig), {}
    if rig.loops:
        loops = {"matrix": test_matrix(rig.loops), "loops": measured_loops(rig.dataset, rig.loops)}
        loops["analysis"] = test_analysis(rig.loops, rig.ranges)
    return {
        **(figures_of_tests(rig.dataset, measured, limits) if measured else {}),
        **loops,
        "scores": score_strip(scores),
        **({"parameters": parameter_curves(mapped)} if (mapped := _mapped(rig)[1]) else {}),
        "predicted": predicted_loops(chosen.damper, _shown(rig)),
        "residuals": residual_map(chosen.damper, train),
        "reversal": force_since_reversal(train, chosen.damper),
    }


def _shown(rig: RigStudy) -> list[Any]:
    """Select validation sine runs spread over the currents; identification runs where there are none."""
    sines = {loop.run_id: loop.condition for loop in rig.loops}
    if not sines:
        return list(rig.dataset.split("validate") or rig.dataset.runs)[:_LOOPS_SHOWN]
    runs = [run for run in rig.dataset.split("validate") if run.id in sines]
    if not runs:
        runs = [run for run in rig.dataset if run.id in sines]
    ordered = sorted(runs, key=lambda run: (sines[run.id].current_A, sines[run.id].peak_velocity))
    return spread_out(ordered, _LOOPS_SHOWN)


def _measured(rig: RigStudy) -> dict[str, Characteristics]:
    return {rig.dataset.name: rig.measured} if rig.measured else {}


def _chapter(rig: RigStudy, pictures: Mapping[str, Picture], limits: Sequence[Limit]) -> dict[str, Any]:
    chosen = rig.chosen
    mapped, functions = _mapped(rig)
    floors = [run.repeatability for run in rig.dataset if run.repeatability is not None]
    limits_of_use = limitations(chosen, rig.loops, rig.dataset, rig.comparison_notes)
    held = all(run.split == "validate" for run in _shown(rig))
    return {
        "rig": rig.dataset.name,
        "verdict": error_sentence(rig),
        "measured": facts_of_tests(measured, limits=limits) if (measured := _measured(rig)) else None,
        "choice": _choice(rig),
        "tests": _tests(rig),
        "chosen": chosen,
        "candidates": rig.candidates,
        "folds": rig.folds,
        "floor": float(np.median(floors)) if floors else None,
        "limitations": {PREDICTION: [*limits_of_use.pop(PREDICTION, []), _scatter(rig)], **limits_of_use},
        "loops": rig.loops,
        "contradictions": rig.contradictions,
        "omissions": omission_lines(rig.candidates, rig.omitted, len(rig.omitted)),
        "identifications": mapped.identifications if mapped else (),
        "fit_columns": _fit_columns(mapped.identifications) if mapped else (),
        "mapped": mapped,
        "every_motion_drawn": functions is not None and len(motions_of(functions)) <= MOST_NAMED,
        "joint": _joint_table(chosen, chosen.fit.damper.model) if isinstance(chosen.fit, JointFit) else (),
        "predicted_caption": (
            "Validation runs, last cycle of the steady window; none was used for identification."
            if held
            else "Identification runs, last cycle of the steady window; "
            + ("no validation run is a steady sine." if chosen.validation.runs else "there are no validation runs.")
        )
        + (
            f" Dotted: {100 * BAND_LEVEL:.0f} % prediction interval {scope(chosen.damper, BAND_LEVEL)}."
            if chosen.damper.uncertainty
            else ""
        ),
        "figures": {name: picture["svg"] for name, picture in pictures.items()},
    }


def _mapped(rig: RigStudy) -> tuple[RecipeResult, ModifiedFit] | tuple[None, None]:
    """Return the best candidate with parameter functions, if any: its curves are drawn."""
    return next(((c, c.fit) for c in rig.candidates if isinstance(c.fit, ModifiedFit)), (None, None))


def _fit_columns(fits: Sequence[Identification]) -> list[tuple[str, str, float]]:
    """List the free parameters of individual fits: name, unit with a power of a thousand, and the factor for it."""
    columns = []
    for info in fits[0].model.parameters() if fits else ():
        if info.name in fits[0].free:
            unit, factor = powered(f"({info.unit})", max(abs(getattr(fit.model, info.name)) for fit in fits))
            columns.append((info.name, raised(unit[1:-1]), factor))
    return columns


def _joint_table(chosen: RecipeResult, model: Model) -> list[dict[str, Any]]:
    """List parameters with intervals and their range in cross-validation; fixed parameters have none."""
    written = {row["name"]: row["written"] for row in table(chosen.damper)}
    return [
        {"name": info.name, "written": written.get(info.name) or _held(getattr(model, info.name), info.unit)}
        | {"spread": _range(chosen.spread.get(info.name), info.unit), "meaning": info.meaning}
        for info in model.parameters()
    ]


def _held(value: float, unit: str) -> str:
    """Format a parameter that was not identified; a term that is zero is no part of the model."""
    return f"{written(value, None, unit)} (fixed)" if value else "– (not part of this model)"


def _range(ends: tuple[float, float] | None, unit: str) -> str:
    return " to ".join(written(end, None, unit) for end in ends) if ends and ends[0] < ends[1] else ""


def _parameter_rows(study: Study) -> list[dict[str, Any]]:
    """Tabulate the parameters of the chosen dampers, their 95 % intervals and ranges in cross-validation, if any."""
    names = {"low": "low_95", "high": "high_95"}
    return [
        {"rig": rig.dataset.name}
        | {names.get(k, k): "" if v != v else v for k, v in row.items() if k != "written"}
        | dict(zip(_CV_RANGE, rig.chosen.spread.get(row["name"], ("", "")), strict=True))
        for rig in study.rigs
        for row in table(rig.damper)
    ]


def _scatter(rig: RigStudy) -> str:
    """State the mean errors by kind of fold, the scatter of gains and offsets, and the coverage of the intervals."""
    kinds = {name.partition("cross-validation, ")[2]: value for name, value in rig.damper.provenance.items()}
    means = ", ".join(f"{kind} {value}" for kind, value in kinds.items() if kind)
    sentences = [f"Mean error in cross-validation by what is omitted: {means}."] if means else []
    if uncertainty := rig.damper.uncertainty:
        of_runs = f"between runs{' of one session' * uncertainty.of_sessions}"
        scatter = {of_runs: (uncertainty.run_gain, uncertainty.run_offset)}
        if uncertainty.of_sessions:
            scatter = {"between sessions": (uncertainty.gain, uncertainty.offset), **scatter}
        parts = ", ".join(f"{place} {100 * gain:.1f} % and {offset:.0f} N" for place, (gain, offset) in scatter.items())
        sentences.append(f"Standard deviations of the gain and the offset of measured over predicted force: {parts}.")
    if any(score.predicted and score.predicted.session for score in rig.chosen.cross_validated.runs):
        error = rig.session_known
        rest = f", which are not known ({error})" if isinstance(error, str) else f"; without them {100 * error:.2f} %"
        sentences.append(f"The cross-validated median error includes the differences between test sessions{rest}.")
    return " ".join([*sentences, *([f"{rig.calibration.summary}."] if rig.calibration else [])])


def _choice(rig: RigStudy) -> str:
    chosen, others = rig.candidates[0], rig.candidates[1:]
    kinds = [kind if kind.endswith("s") else f"{kind}s" for kind in rig.folds[0] if kind != NO_CURRENT]
    over = " and ".join([*filter(None, [", ".join(kinds[:-1])]), *kinds[-1:]])
    reason = "Chosen by the user" if rig.asked_for else f"Chosen by cross-validation over {over}"
    text = (
        f"{reason}: {chosen.title}, {chosen.damper.parameter_count} parameters, "
        f"error {100 * chosen.cross_validated.median():.1f} %"
    )
    if others:
        best = min(others, key=lambda other: other.cross_validated.median())
        error = 100 * best.cross_validated.median()
        text += f"; next {best.title}, {best.damper.parameter_count} parameters, {error:.1f} %"
    titles = {other.recipe.name: other.title for other in others}
    refused = "".join(f" Not eligible: {titles[name]}, {why}." for name, why in rig.refused.items() if name in titles)
    return (
        f"{text}. Within one standard error of the best, the model with the fewest parameters is chosen.{refused} "
        "Further models, such as the hyperbolic tangent, are fitted and ranked by mrdamper compare."
    )


def _tests(rig: RigStudy) -> str:
    used = {run.run_id for scores in (rig.chosen.cross_validated, rig.chosen.validation) for run in scores.runs}
    others, unused = len(used - {loop.run_id for loop in rig.loops}), len({run.id for run in rig.dataset} - used)
    records = f"{counted(others, 'record')} of other motion or of a varying current"
    more = " and ".join([records] * (others > 0) + [f"{unused} not used"] * (unused > 0))
    if not rig.loops:
        return f"Tests: {more}; no steady sine at constant current."
    conditions = [loop.condition for loop in rig.loops]
    currents = sorted({plain(c.current_A) for c in conditions}, key=float)
    listed = ", ".join(currents) if len(currents) < 9 else f"{currents[0]} to {currents[-1]}"
    frequencies = [c.frequency_Hz for c in conditions]
    amplitudes = [1e3 * c.amplitude_m for c in conditions]
    motions = f"{span(min(frequencies), max(frequencies), 'Hz')} and {span(min(amplitudes), max(amplitudes), 'mm')}"
    return (
        f"Tests: {counted(len(rig.loops), 'sine run')} at {listed} A, {motions}{f', and {more}' if more else ''}; "
        f"{counted(len(rig.dataset.split('validate')), 'run')} for validation."
    )
