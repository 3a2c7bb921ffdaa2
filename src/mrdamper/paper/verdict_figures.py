"""Ways side by side: accuracy and cost, searches, noise seeds, sensitivities [Qian et al. 2024, Fig. 26]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from mrdamper.paper.loop_figures import Made
from mrdamper.paper.results import Reproduction, forces_a_run, rate_rows, seconds_a_run
from mrdamper.report.plots.style import PALETTE, house_style, label, new_figure
from mrdamper.study.recipe import Scored


def accuracy_rate(study: Reproduction) -> Made:
    """Draw error and identification rate over the current: the paper's method, Ali's and the direct genetic search."""
    rows = [row for row in rate_rows(study) if np.isfinite(row["nrmse_pp"])]
    if not rows:
        return "nothing predicts a validation run"
    with house_style():
        figure, axes = new_figure(1, 3, 2.9, top=0.5)
        for title, colour in zip(dict.fromkeys(row["method"] for row in rows), PALETTE[1:], strict=False):
            own = [row for row in rows if row["method"] == title]
            for panel, name, scale in zip(
                axes, ("nrmse_pp", "mean_relative_error", "forces_until_settled"), (100, 100, 1), strict=True
            ):
                shown = [(row["current_A"], scale * row[name]) for row in own if row[name] is not None]
                panel.plot(*np.reshape(shown, (-1, 2)).T, "o-", ms=3, lw=0.9, color=colour, label=title)
        axes[2].set_yscale("log")
        for panel, text in zip(
            axes, ("nrmse_pp (%)", "Relative error, Eq. 44 (%)", "Forces computed (–)"), strict=True
        ):
            label(panel, "Current (A)", text)
        figure.legend(*axes[0].get_legend_handles_labels(), loc="upper center", ncols=3, fontsize=7)
        return figure


def methods_figure(study: Reproduction) -> Made:
    """Median and worst held-out error, and forces computed for an identification, by way."""
    ways = [c for c in study.contenders if c.validation.runs]
    if not ways:
        return "nothing predicts a held-out run"
    with house_style():
        figure, axes = new_figure(1, 2, 1.15 + 0.26 * len(ways), left=2.4, top=0.45)
        rows = _rows_of(axes, ways)
        axes[0].barh(rows, [100 * c.validation.median() for c in ways], color=PALETTE[6], label="median")
        axes[0].plot([100 * c.validation.worst().scores.nrmse_pp for c in ways], rows, "k|", ms=8, label="worst run")
        _key_above(axes[0])
        label(axes[0], "Held-out nrmse_pp (%)", "")
        axes[1].barh(rows, [forces_a_run(study, c) for c in ways], color=PALETTE[3])
        _decades(axes[1])
        label(axes[1], "Forces computed for a run (–)", "")
        return figure


def seconds_figure(study: Reproduction) -> Made:
    """Seconds an identification takes here and now, by way: the one figure that differs from run to run."""
    ways = [c for c in study.contenders if c.identifications]
    if not ways:
        return "nothing was identified from single runs"
    with house_style():
        figure, axes = new_figure(1, 1, 0.8 + 0.26 * len(ways), left=2.4)
        axes[0].barh(_rows_of(axes, ways), [seconds_a_run(study, c) for c in ways], color=PALETTE[3])
        label(axes[0], "Identification (s a run)", "")
        return figure


def genetic_figure(study: Reproduction) -> Made:
    """Lowest error over the generations, above the least there is."""
    if not study.genetic:
        return "no genetic search was made"
    with house_style():
        figure, (axes,) = new_figure(1, 1, 2.8)
        for check, colour in zip(study.genetic, PALETTE[1:], strict=False):
            # The search sees a part of the samples; its error is carried over to all of them.
            carried = check.minimum.history * check.reached / check.minimum.cost
            excess = np.maximum(carried / check.optimum - 1, 1e-6)
            axes.semilogy(np.arange(1, excess.size + 1), excess, color=colour, label=str(check.condition))
        first = study.genetic[0].minimum
        per_box = first.history.size // len(first.boxes)
        for start in range(per_box, first.history.size, per_box):
            axes.axvline(start, color=PALETTE[0], lw=0.8, ls=":")
        label(axes, "Generation (dotted: a narrower box begins)", "Error above the least (–)")
        axes.grid(visible=False, axis="x")
        axes.legend(frameon=True, framealpha=1.0, edgecolor="none")
        return figure


def errors_figure(study: Reproduction) -> Made:
    """Error of every held-out run by contender, over current."""
    if not any(c.validation.runs for c in study.contenders):
        return "nothing predicts a held-out run"
    with house_style():
        figure, (axes,) = new_figure(1, 1, 3.4, right=2.6)
        colours = PALETTE[:7]  # yellow is lost on white
        for number, contender in enumerate(study.contenders):
            again, place = divmod(number, len(colours))
            runs = sorted(contender.validation.runs, key=lambda r: r.condition.current_A)
            axes.plot(
                [r.condition.current_A for r in runs],
                [100 * r.scores.nrmse_pp for r in runs],
                ("o-", "s--", "^:")[min(again, 2)],
                ms=3,
                lw=0.8,
                color=colours[place],
                label=contender.recipe.title,
            )
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(NullFormatter())
        label(axes, "Current (A)", "nrmse_pp of held-out runs (%)")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7)
        return figure


def seeds_figure(study: Reproduction) -> Made:
    """Held-out error over noise seeds."""
    errors = study.seed_errors
    if not errors:
        return "noise seeds need a virtual rig"
    with house_style():
        figure, (axes,) = new_figure(1, 1, 2.4, left=2.2)
        for row, values in enumerate(reversed([*errors.values()])):
            axes.plot(100 * values, np.full(values.size, row), "|", ms=9, color=PALETTE[1])
        axes.set_yticks(range(len(errors)), [*errors][::-1])
        axes.set_ylim(-0.6, len(errors) - 0.4)
        axes.set_xlim(left=0)
        label(axes, "Median nrmse_pp of the held-out runs (%), one mark a seed", "")
        return figure


def sensitivity_figure(study: Reproduction) -> Made:
    """One-at-a-time effects, what is left after identifying anew, and Sobol indices."""
    single, indices = study.sensitivity, study.sobol
    if not single:
        return "no run was identified the consistent way"
    with house_style():
        figure, axes = new_figure(1, 2, 3.2, left=1.3, gap=1.3, top=0.45)
        rows = np.arange(len(single))
        axes[0].barh(rows, [s.effect for s in single], color=PALETTE[6], label="others held")
        left = [max(s.left, 1e-8) for s in single]
        axes[0].plot(left, rows, "o", ms=4, color=PALETTE[2], label="others anew")
        _decades(axes[0])
        axes[0].set_yticks(rows, [s.name.replace("_", " ") for s in single])
        _key_above(axes[0])
        label(axes[0], f"Change of force for {100 * single[0].change:.0f} % (of its deviation)", "")
        if indices is not None:
            rows = np.arange(len(indices.names))
            axes[1].barh(rows, indices.total, xerr=indices.total_confidence, color=PALETTE[6])
            axes[1].set_yticks(rows, [name.replace("_", " ") for name in indices.names])
            label(axes[1], f"Total Sobol index (–), all ±{100 * indices.spread:.0f} %", "")
        else:
            axes[1].set_visible(False)
        return figure


def _rows_of(axes: Sequence[Axes], ways: Sequence[Scored]) -> np.ndarray:
    """A row a way, the first on top, named at the left."""
    rows = np.arange(len(ways))[::-1]
    for number, panel in enumerate(axes):
        panel.set_yticks(rows, ["" if number else c.recipe.title for c in ways])
    return rows


def _key_above(axes: Axes) -> None:
    axes.legend(fontsize=7, loc="lower right", bbox_to_anchor=(1.03, 0.99), ncols=2, borderaxespad=0.2)


def _decades(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(numticks=6))
    axes.xaxis.set_minor_formatter(NullFormatter())
