"""Numbers, ranges and counts as a person reads them, on a terminal, on a page and in messages."""

from __future__ import annotations

import math
import re

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LEAST, _MOST = 1e-4, 1e6  # numbers from the least up to the most are written without an exponent


def number(value: float | None, digits: int = 4, beside: float | None = None, sign: str = "-") -> str:
    """Write a number to some significant digits, with the `sign` "-" or "+" as in a format; a dash where there is none.

    A million and more, and less than a ten-thousandth, have an exponent that is a multiple of three: that of `beside`,
    a number written next to it, where one is given. Zero is not negative.

    Examples
    --------
    >>> number(10420.3), number(-11.88e6), number(5e-7), number(-0.0), number(float("nan"))
    ('10420', '-11.88e6', '500e-9', '0', '–')
    """
    if value is None or not math.isfinite(value):
        return "–"
    rounded = float(f"{value:.{digits}g}")
    size = abs(float(f"{value if beside is None else beside:.{digits}g}"))
    power = 0 if not size or _LEAST <= size < _MOST else 3 * math.floor(math.log10(size) / 3)
    if power < -300:  # a tenth of which is zero
        return f"{rounded:{sign}.{digits}g}"
    return f"{rounded / 10.0**power:{sign}z.10g}" + (f"e{power}" if power else "")


def span(low: float, high: float, unit: str = "", digits: int = 3, to: str = "–") -> str:
    """Write a range and its unit: one number where both ends are written alike, and "to" beside a negative end.

    Examples
    --------
    >>> span(0.5, 4, "Hz"), span(11.99, 12.01, "mm"), span(-543, 2, "kg")
    ('0.5–4 Hz', '12 mm', '-543 to 2 kg')
    """
    to = " to " if low < 0 else to
    return f"{to.join(dict.fromkeys((number(low, digits), number(high, digits))))} {unit}".strip()


def counted(count: int, noun: str) -> str:
    """Write a count with its noun, in the plural unless it is one.

    Examples
    --------
    >>> counted(1, "run"), counted(0, "cross-validated run")
    ('1 run', '0 cross-validated runs')
    """
    return f"{count} {noun}{'s' * (count != 1)}"


def raised(text: str) -> str:
    """Raise the whole exponents of units and powers.

    Examples
    --------
    >>> raised("10^-3 N/m^3")
    '10⁻³ N/m³'
    """
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(_RAISED), text)
