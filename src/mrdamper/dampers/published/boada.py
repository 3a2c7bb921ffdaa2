"""Boada-type: arctangent loop, its parameters from a small neural network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.dampers.published.base import ConditionedDamper
from mrdamper.data import Condition, Floats, Run
from mrdamper.identification import Identification
from mrdamper.models.guo import Guo
from mrdamper.statistics.levenberg_marquardt import least_squares

_HIDDEN = 5
_DECAY = 0.15  # weight of the penalty on the network's weights
_SEED = 20240813
_OUTPUTS = ("fy", "kappa", "v0", "c", "k", "f0")
_LOGARITHMIC = ("fy", "kappa", "v0")  # the first of them
_INPUTS = 3
_MAX_WEIGHT = 20.0  # weight
_WEIGHT_STEP = 1e-6 * (2 * _MAX_WEIGHT)  # of a weight, for derivatives by differences


class BoadaType(ConditionedDamper):
    """F = (2/pi) f_y arctan[kappa (v + v0 sgn x)] + c v + k x + f0; the six come from a neural network.

    Inputs are current, frequency and amplitude, standardised; one hidden layer of five tanh units; weights by penalised
    least squares on the identifications of single runs. There are more weights than runs, so the penalty determines
    them.

    References
    ----------
    After Boada et al.; the published equations were not seen ("trigonometric functions",
    parameters from a neural network over frequency), hence "-type".
    """

    name: ClassVar[str] = "boada-type"
    heading: ClassVar[str] = "Boada-type (arctangent, neural network)"
    source: ClassVar[str] = "after Boada et al.; equations not seen"
    unverified: ClassVar[str] = (
        "the trigonometric form of the loop, the size of the network and its inputs; the "
        "publication reportedly has few parameters, this network has tens"
    )
    equation: ClassVar[str] = (
        r"F = \frac{2}{\pi} f_y \arctan[\kappa (v + v_0\,\mathrm{sgn}\,x)] + c\,v + k\,x + f_0,\quad "
        r"(\ln f_y, \ln \kappa, \ln v_0, c, k, f_0)_j = \mathrm{middle}_j + \mathrm{width}_j\, o_j,\quad "
        r"o_j = \sum_{h} \mathrm{weight}_{jh} \tanh\left(\sum_{i} \mathrm{weight}_{hi} u_i\right),\quad "
        r"u_i = (q_i - \mathrm{centre}_i)/\mathrm{spread}_i,\quad q = (I, \ln f, \ln A)"
    )
    basis: ClassVar[str] = "guo"
    basis_free: ClassVar[tuple[str, ...]] = ("k",)
    limits: ClassVar[str] = "needs frequency and amplitude: sines only; a network does not extrapolate"

    @classmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        inputs = np.array([_raw(i.condition) for i in identifications])
        outputs = np.array([[i.model.values()[name] for name in _OUTPUTS] for i in identifications])
        logarithmic = slice(len(_LOGARITHMIC))
        outputs[:, logarithmic] = np.log(np.maximum(outputs[:, logarithmic], 1e-6))
        centre, spread = inputs.mean(axis=0), _spread(inputs)
        middle, width = np.median(outputs, axis=0), _spread(outputs)
        weights = _train((inputs - centre) / spread, np.clip((outputs - middle) / width, -3, 3))
        named = {"centre": centre, "spread": spread, "middle": middle, "width": width, "weight": weights}
        return {f"{name}{i}": float(value) for name, values in named.items() for i, value in enumerate(values)}

    def refined(self, runs: Sequence[Run]) -> Self:
        """List the weights at a bound of their search; they are not refined."""
        weights = {name: value for name, value in self.coefficients.items() if name.startswith("weight")}
        return self.stating_bounds([n for n, value in weights.items() if abs(value) > (1 - 1e-6) * _MAX_WEIGHT])

    def model_at(self, condition: Condition) -> Guo:
        scaled = zip(_raw(condition), self._part("centre", _INPUTS), self._part("spread", _INPUTS), strict=True)
        weights = self._part("weight", _weight_count(len(_OUTPUTS)))
        outputs = _network(weights, [(value - centre) / spread for value, centre, spread in scaled], len(_OUTPUTS))
        bounds = {info.name: info.bounds for info in Guo.parameters()}
        values: dict[str, float] = {}
        for i, (name, output) in enumerate(zip(_OUTPUTS, outputs, strict=True)):
            middle, width = self.coefficients[f"middle{i}"], self.coefficients[f"width{i}"]
            value = middle + width * np.clip(output, -4, 4)
            values[name] = np.clip(np.exp(value) if name in _LOGARITHMIC else value, *bounds[name])
        return Guo(**values)

    def _part(self, name: str, count: int) -> Floats:
        return np.array([self.coefficients[f"{name}{i}"] for i in range(count)])


def _raw(condition: Condition) -> tuple[Any, Any, Any]:
    return condition.current_A, np.log(condition.frequency_Hz), np.log(condition.amplitude_m)


def _spread(table: Floats) -> Floats:
    spread = table.std(axis=0)
    return np.where(spread > 1e-9, spread, 1.0)


def _weight_count(outputs: int) -> int:
    return _HIDDEN * (_INPUTS + 1) + outputs * (_HIDDEN + 1)


def _network(weights: Floats, inputs: Sequence[Any], outputs: int) -> list[Any]:
    """One value, or one array of values, an output; inputs likewise."""
    first, second = _layers(weights, outputs)
    hidden = [np.tanh(_weighted(row, inputs)) for row in first]
    return [_weighted(row, hidden) for row in second]


def _layers(weights: Floats, outputs: int) -> tuple[Floats, Floats]:
    """Weights of the hidden units and of the outputs, the offset of each last."""
    cut = _HIDDEN * (_INPUTS + 1)
    return weights[:cut].reshape(_HIDDEN, -1), weights[cut:].reshape(outputs, -1)


def _weighted(row: Floats, values: Sequence[Any]) -> Any:
    *factors, offset = row.tolist()
    return sum((factor * value for factor, value in zip(factors, values, strict=True)), offset)


def _train(inputs: Floats, targets: Floats) -> Floats:
    runs, outputs = targets.shape
    count = _weight_count(outputs)
    begin = 0.3 * np.random.default_rng(_SEED).standard_normal(count)
    given = np.column_stack([inputs, np.ones(runs)])

    def residuals(weights: Floats) -> Floats:
        error = np.stack(_network(weights, list(inputs.T), outputs), axis=-1) - targets
        return np.concatenate([error.ravel(), _DECAY * weights])

    def slopes(weights: Floats) -> Floats:
        """Forward differences: a weight of the first layer moves one hidden unit, one of the second one output."""
        first, second = _layers(weights, outputs)
        sums = (given @ first.T)[:, :, None]
        hidden = np.tanh(sums)
        moved = (np.tanh(sums + _WEIGHT_STEP * given[:, None]) - hidden) / _WEIGHT_STEP  # (runs, hidden, inputs + 1)
        units = np.column_stack([hidden[:, :, 0], np.ones(runs)])
        by_layer = (np.einsum("oh,rhi->rohi", second[:, :-1], moved), np.einsum("ok,rh->rokh", np.eye(outputs), units))
        by_weight = np.hstack([part.reshape(runs * outputs, -1) for part in by_layer])
        return np.vstack([by_weight, _DECAY * np.eye(count)])

    box = np.full(count, _MAX_WEIGHT)
    return least_squares(residuals, begin, -box, box, most_steps=60, slopes=slopes).point
