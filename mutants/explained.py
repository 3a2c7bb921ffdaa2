"""Survivors that are no gap in the tests, and why: (module, line, change) to a reason.

They count among the survivors all the same.
"""

from __future__ import annotations

EXPLAINED: dict[tuple[str, str, str], str] = {
    (
        "reproduction.tested",
        "out = np.abs((phase - angle + 180) % 360 - 180) < 5",
        "Add → Sub",
    ): "half a turn forth or back is the same angle",
    (
        "dampers.published.dominguez",
        "[np.log(c.frequency_Hz / reference.frequency_Hz) for c in conditions],",
        ".frequency_Hz → .current_A",
    ): "a constant factor goes into the level every current has of its own",
    (
        "models.play_bypass",
        "turned = path.first_direction * np.where(np.arange(len(path.lengths)) % 2, -1.0, 1.0) * path.lengths",
        "Mult → Div",
    ): "a sign divides as it multiplies",
    (
        "models.play_bypass",
        "along = np.maximum(0.0, loaded * np.sign(v))",
        "Mult → Div",
    ): "a sign divides as it multiplies",
    (
        "functions.forms",
        "turns = np.flatnonzero(slope[1:] * slope[:-1] < 0)",
        "Mult → Div",
    ): "only the sign of the product of two signs is asked",
    (
        "functions.fitting",
        "q, _ = np.linalg.qr(weighted / np.linalg.norm(weighted, axis=0))",
        "Div → Mult",
    ): "the space columns span does not depend on their lengths",
    (
        "dampers.published.ali",
        "levels = [np.isclose(currents, level, atol=2e-3) for level in np.unique(np.round(currents, 3))]",
        "3 → 4",
    ): "the tests' currents have fewer digits",
    (
        "reproduction.verdicts",
        'sign = 1.0 if self.sense == "below" else -1.0',
        "1.0 → 10.0",
    ): "only the sign decides on which side a number lies",
    (
        "reproduction.verdicts",
        'return Limit(number, "below", holds, holds if near is None else near)',
        "arguments 0 and 2 exchanged",
    ): "runs when the module is loaded, before a fault is planted; the tests repeat every limit",
    (
        "reproduction.verdicts",
        'return Limit(number, "above", holds, holds if near is None else near)',
        "arguments 0 and 2 exchanged",
    ): "runs when the module is loaded, before a fault is planted; the tests repeat every limit",
}
