"""Figures of the uncertainty of parameters: profile likelihoods and pairs of posterior samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.likelihood import CHI_SQUARED_95, LikelihoodProfile
from mrdamper.dampers.posterior import Samples
from mrdamper.report.plots.figure import WIDTH, Figure
from mrdamper.report.plots.style import PALETTE

_BINS = 30


def profile_curves(profiles: Sequence[LikelihoodProfile]) -> Figure:
    """Draw the profile likelihood of each parameter; the line is the end of the 95 % interval."""
    columns = min(3, len(profiles))
    rows = -(-len(profiles) // columns)
    figure = Figure(rows, columns, 0.9 + 2.1 * rows)
    for axes, profile in zip(figure.axes, profiles, strict=False):
        axes.plot(profile.values, profile.fall, ".", ls="-", color=PALETTE[1])
        axes.line("x", CHI_SQUARED_95, color=PALETTE[2], lw=0.8)
        axes.line("y", profile.estimate, color=PALETTE[0], lw=0.6, ls=":")
        axes.y.low, axes.y.high = 0.0, 3 * CHI_SQUARED_95
        axes.label(f"{profile.name} ({profile.unit or '–'})", "−2 Δ ln L (–)", profile.kind)
    return figure


def corner(samples: Samples) -> Figure:
    """Draw samples of every pair of parameters, and the distribution of each on the diagonal."""
    size = len(samples.names)
    figure = Figure(size, size, WIDTH, left=0.4, right=0.1, top=0.1, bottom=0.4, gap=0.08, lettered=False)
    for number, axes in enumerate(figure.axes):
        i, j = divmod(number, size)
        axes.size, axes.x.places, axes.y.places = 7.0, (), ()
        if j < i:
            axes.plot(samples.values[:, j], samples.values[:, i], ",", color=PALETTE[1])
        elif i == j:
            heights, edges = np.histogram(samples.values[:, i], _BINS)
            axes.bars(edges, heights, PALETTE[1])
        axes.label(samples.names[j] if i == size - 1 else "", samples.names[i] if j == 0 and i else "")
    return figure


def quantiles(samples: Samples, level: float = 0.95) -> list[dict[str, float | str]]:
    """Median and ends of the samples of each parameter, one row per parameter."""
    low, middle, high = np.quantile(samples.values, [(1 - level) / 2, 0.5, (1 + level) / 2], axis=0)
    return [
        {"name": name, "low": float(a), "median": float(b), "high": float(c)}
        for name, a, b, c in zip(samples.names, low, middle, high, strict=True)
    ]
