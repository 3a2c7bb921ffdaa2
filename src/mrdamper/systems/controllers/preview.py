"""Non-causal optimum with the whole record known, a lower bound of the cost of any controller.

Any damper gives some history of force. The optimum over all histories, whether or not a damper can provide them, has at
most the same cost for the linear structure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.systems.controllers.base import Controller, Sensors

_RICCATI_TOLERANCE = 1e-13  # relative change at which the Riccati recursion has ended


@dataclass(frozen=True)
class NonCausalOptimum(Controller):
    """Minimises the mean square of the aims (`linear.aims`) over all force histories.

    A linear-quadratic problem with a known disturbance, solved backwards in the time steps of the simulation: the bound
    holds to rounding, without bump-stop contact and wheel lift-off.
    """

    name: ClassVar[str] = "preview"
    title: ClassVar[str] = "optimum with the whole record known"
    source: ClassVar[str] = "Bryson and Ho 1975, Applied Optimal Control, ch. 5; Hrovat 1997, Automatica 33, 1781–1817"

    def law(self, see: Sensors) -> Any:
        return see.low

    def forces(self, A: Floats, B: Floats, driven: Floats, C: Floats, D: Floats, aimed: Floats) -> Floats:
        """(N, E) forces of least cost for z⁺ = A z + B (f + f⁺)/2 + driven⁺, y = C z + D f + aimed.

        `driven` (N, 2n), `aimed` (N, P): contribution of the input to the state in the step that ends there, and to the
        objectives.
        """
        n, count = B.shape
        # The state contains the last force; the next force is the decision variable.
        F = np.block([[A, B / 2], [np.zeros((count, n + count))]])
        G = np.vstack([B / 2, np.eye(count)])
        Y = np.hstack([C, D])
        samples = driven.shape[0]
        P, p = Y.T @ Y, Y.T @ aimed[-1]
        gains = np.zeros((samples, count, n + count))
        offsets = np.zeros((samples, count))
        settled, K, short, closed = False, np.zeros((count, n + count)), G.T, F
        for k in range(samples - 1, 0, -1):
            before = P
            if not settled:
                S = G.T @ P @ G
                K, short = np.linalg.solve(S, G.T @ P @ F), np.linalg.solve(S, G.T)
                closed = F - G @ K
                before = closed.T @ P @ closed + Y.T @ Y
                before = 0.5 * (before + before.T)
                settled = bool(np.abs(before - P).max() <= _RICCATI_TOLERANCE * np.abs(P).max())
            push = P[:, :n] @ driven[k] + p
            gains[k], offsets[k] = K, short @ push
            P, p = before, closed.T @ push + Y.T @ aimed[k - 1]
        state, optimum = np.zeros(n + count), np.zeros((samples, count))
        for k in range(1, samples):
            u = -gains[k] @ state - offsets[k]
            state = F @ state + G @ u
            state[:n] += driven[k]
            optimum[k] = u
        return optimum
