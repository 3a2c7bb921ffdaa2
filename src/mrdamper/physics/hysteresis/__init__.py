"""Bouc–Wen hysteresis, exactly: no differential equation is solved.

The model dz/dt = A v − beta |v| |z|^(n−1) z − gamma v |z|^n is rate independent: along a monotone stroke z is a closed
function of the distance. A sampled motion is therefore divided at its reversals once (`motion.Path.of`); the few
reversal states are sequential; all samples between them are evaluated at once (`follow`).

All quantities are in units that leave three parameters (`Shape`): zeta = z/z_max with z_max = (A/(beta + gamma))^(1/n),
kappa = A/z_max, rho = (gamma − beta)/(gamma + beta) and n. In the direction of motion, w = zeta · sgn v and s the
distance,

    dw/ds = kappa (1 − w^n) for w >= 0,    dw/ds = kappa (1 − rho |w|^n) for w < 0.

beta multiplies |v|, gamma multiplies v; Spencer and co-workers exchange the two symbols.

References
----------
Bouc (1967), "Forced vibration of mechanical systems with hysteresis"; Wen (1976), "Method for
random vibration of hysteretic systems", J. Eng. Mech. Div. 102; Ikhouane and Rodellar (2007),
"Systems with Hysteresis". The literature is recalled; "derived" marks results
derived for this package.
"""

from mrdamper.physics.hysteresis.response import follow, step
from mrdamper.physics.hysteresis.shape import Shape, dissipates, z_max
from mrdamper.physics.hysteresis.steady import loop_harmonics, steady_loop

__all__ = ["Shape", "dissipates", "follow", "loop_harmonics", "steady_loop", "step", "z_max"]
