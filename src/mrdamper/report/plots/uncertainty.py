"""Figures of the uncertainty of parameters: profile likelihoods and pairs of posterior samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from mrdamper.dampers.likelihood import CHI_SQUARED_95, LikelihoodProfile
from mrdamper.dampers.posterior import Samples
from mrdamper.report.plots.style import PALETTE, WIDTH, house_style, label, new_figure

_BINS = 30


def profile_curves(profiles: Sequence[LikelihoodProfile]) -> Figure:
    """Fall of the likelihood as each number moves and all others follow; the line is where 95 % end."""
    with house_style():
        columns = min(3, len(profiles))
        rows = -(-len(profiles) // columns)
        figure, panels = new_figure(rows, columns, 0.9 + 2.1 * rows)
        for axes, profile in zip(panels, profiles, strict=False):
            axes.plot(profile.values, profile.fall, marker=".", color=PALETTE[1])
            axes.axhline(CHI_SQUARED_95, color=PALETTE[2], lw=0.8)
            axes.axvline(profile.estimate, color=PALETTE[0], lw=0.6, ls=":")
            axes.set_ylim(0, 3 * CHI_SQUARED_95)
            label(axes, f"{profile.name} ({profile.unit or '–'})", "−2 Δ ln L (–)", profile.kind)
        for axes in panels[len(profiles) :]:
            axes.set_visible(False)
    return figure


def corner(samples: Samples) -> Figure:
    """Samples of every pair of numbers, and each number's own distribution on the diagonal."""
    size = len(samples.names)
    with house_style():
        figure = Figure(figsize=(WIDTH, WIDTH))
        grid = figure.subplots(size, size, squeeze=False)
        figure.subplots_adjust(0.08, 0.08, 0.98, 0.98, 0.06, 0.06)
        for i in range(size):
            for j in range(size):
                axes = grid[i, j]
                axes.set_visible(j <= i)
                if j < i:
                    axes.plot(samples.values[:, j], samples.values[:, i], ",", color=PALETTE[1])
                elif i == j:
                    axes.hist(samples.values[:, i], _BINS, color=PALETTE[1])
                axes.set_xticks([])
                axes.set_yticks([])
                if i == size - 1:
                    axes.set_xlabel(samples.names[j], fontsize=7)
                if j == 0 and i:
                    axes.set_ylabel(samples.names[i], fontsize=7)
    return figure


def quantiles(samples: Samples, level: float = 0.95) -> list[dict[str, float | str]]:
    """Median and ends of each number's samples, a row a number."""
    low, middle, high = np.quantile(samples.values, [(1 - level) / 2, 0.5, (1 + level) / 2], axis=0)
    return [
        {"name": name, "low": float(a), "median": float(b), "high": float(c)}
        for name, a, b, c in zip(samples.names, low, middle, high, strict=True)
    ]
