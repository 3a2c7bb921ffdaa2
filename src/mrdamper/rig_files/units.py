"""Units as rig files write them, to SI. Only here is a unit interpreted.

The field's units stand in a table, as a library of all units takes longer to import than
most files take to read; pint knows the rest.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

LBF = 4.4482216152605
INCH = 0.0254
G = 9.80665


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit: factor and offset that convert a value to SI.

    Attributes
    ----------
    dimension : str
        "time", "length", "force", "velocity", ...
    factor, offset : float
        SI value = factor * number + offset; the offset is for temperatures [°C].
    """

    dimension: str
    factor: float
    offset: float = 0.0


_EXACT = {
    "time": {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60, "h": 3600, "days": 86400},
    "length": {"m": 1, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": INCH, "ft": 0.3048,
        "mil": 1e-3 * INCH, "thou": 1e-3 * INCH, "pouce": INCH,
    },
    "force": {
        "N": 1, "mN": 1e-3, "daN": 10, "kN": 1e3, "KN": 1e3, "MN": 1e6,
        "lbf": LBF, "lb": LBF, "lbs": LBF, "kip": 1e3 * LBF, "klbf": 1e3 * LBF, "kgf": G, "kp": G,
        "gf": 1e-3 * G, "tf": 1e3 * G,
    },
    "velocity": {"m/s": 1, "cm/s": 1e-2, "mm/s": 1e-3, "um/s": 1e-6, "in/s": INCH, "ft/s": 0.3048, "km/h": 1 / 3.6},
    "acceleration": {"m/s2": 1, "cm/s2": 1e-2, "mm/s2": 1e-3, "in/s2": INCH, "ft/s2": 0.3048, "g": G, "gn": G},
    "current": {"A": 1, "mA": 1e-3, "uA": 1e-6, "kA": 1e3},
    "voltage": {"V": 1, "mV": 1e-3, "uV": 1e-6, "kV": 1e3},
    "temperature": {"°C": 1, "degC": 1, "C": 1},
    "mass": {"kg": 1, "lbm": 0.45359237},
    "pressure": {"Pa": 1, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "psi": 6894.757293168},
    "frequency": {"Hz": 1, "kHz": 1e3, "rpm": 1 / 60, "1/min": 1 / 60, "min-1": 1 / 60, "U/min": 1 / 60,
        "tr/min": 1 / 60, "S/s": 1, "kS/s": 1e3, "1/s": 1, "samples/s": 1},
    "angle": {"rad": 1, "deg": 0.017453292519943295, "°": 0.017453292519943295},
    "count": {"%": 0.01, "segments": 1, "cycles": 1, "counts": 1, "samples": 1},
}  # fmt: skip
_WORDS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sekunden": "s", "sn": "s", "sekunde": "s", "segundos": "s",
    "msec": "ms", "msecs": "ms", "millisecond": "ms", "milliseconds": "ms", "usec": "us", "microseconds": "us",
    "minutes": "min", "minute": "min", "hour": "h", "hours": "h", "hr": "h", "sek": "s",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm",
    "millimetre": "mm", "millimetres": "mm", "micron": "um", "microns": "um", "micrometer": "um",
    "inch": "in", "inches": "in", '"': "in", "''": "in", "mils": "mil", "pounds": "lbf", "pound": "lbf", "lbs.": "lbf",
    "zoll": "in", "pulgada": "in", "pulgadas": "in", "kilopond": "kp", "feet": "ft", "foot": "ft",
    "newton": "N", "newtons": "N", "kilonewton": "kN", "kilonewtons": "kN", "lbsf": "lbf", "lb-f": "lbf",
    "lb_f": "lbf", "pound-force": "lbf", "kips": "kip", "ips": "in/s", "m/sec": "m/s", "mm/sec": "mm/s",
    "in/sec": "in/s", "kph": "km/h", "gs": "g",
    "amp": "A", "amps": "A", "ampere": "A", "amperes": "A", "milliamps": "mA",
    "volt": "V", "volts": "V", "millivolts": "mV", "celsius": "°C", "deg c": "°C", "grad c": "°C",
    "deg f": "°F", "fahrenheit": "°F",
    "с": "s", "сек": "s", "мс": "ms", "м": "m", "см": "cm", "мм": "mm", "мкм": "um", "н": "N", "кн": "kN",
    "кгс": "kgf", "а": "A", "ма": "mA", "в": "V", "°с": "°C",
    "秒": "s", "毫秒": "ms", "米": "m", "毫米": "mm", "厘米": "cm", "微米": "um", "牛": "N", "牛顿": "N", "千牛": "kN",
    "安": "A", "安培": "A", "毫安": "mA", "伏": "V", "초": "s", "ミリ秒": "ms", "アンペア": "A",
    "ole": "days", "ole date": "days", "day": "days", "tage": "days", "pct": "%", "percent": "%",
    "segment": "segments", "cycle": "cycles", "count": "counts", "degree": "deg", "degrees": "deg",
}  # fmt: skip
_OTHER = {
    "K": Unit("temperature", 1.0, -273.15),
    "°F": Unit("temperature", 5 / 9, -160 / 9),
    "degF": Unit("temperature", 5 / 9, -160 / 9),
}
_SAME = ("time", "force", "velocity", "acceleration", "current", "voltage", "temperature", "pressure")
DIMENSION = MappingProxyType({"displacement": "length", **{name: name for name in _SAME}})  # of a channel
_PINT = {
    "[time]": "time", "[length]": "length", "[mass] * [length] / [time] ** 2": "force",
    "[length] / [time]": "velocity", "[length] / [time] ** 2": "acceleration", "[current]": "current",
    "[mass] * [length] ** 2 / [current] / [time] ** 3": "voltage",
}  # fmt: skip
_PLAIN = re.compile(r"[A-Za-zµμΩ°]{1,20}(?:\^?-?[1-4])?(?:[*/·⋅ ][A-Za-zµμΩ°]{1,20}(?:\^?-?[1-4])?){0,3}")


def parse_unit(text: str) -> Unit | None:
    """Return the unit a text states, None if it states none that is known."""
    return _parse(text) if len(text) <= 40 else None


def is_unit(text: str) -> bool:
    """Tell if a text is nothing but one of the field's units."""
    return len(text) <= 40 and _from_table(text) is not None


@lru_cache(maxsize=512)
def _parse(text: str) -> Unit | None:
    return _from_table(text) or _from_pint(text)


@lru_cache(maxsize=512)
def _from_table(text: str) -> Unit | None:
    text = _normal(text)
    text = _WORDS.get(text.lower(), text)
    if text in _OTHER:
        return _OTHER[text]
    for dimension, units in _EXACT.items():
        if text in units:
            return Unit(dimension, units[text])
    if text.isupper() and text.isascii():  # some programs write all of a header in capitals
        same = [Unit(d, factor) for d, units in _EXACT.items() for u, factor in units.items() if u.upper() == text]
        return same[0] if same and all(unit == same[0] for unit in same) else None
    return None


def _normal(text: str) -> str:
    """One writing for the many of m/s²: m/s^2, m s-2, m_s2, m/s**2, m·s⁻²."""
    text = " ".join(text.strip().split())
    for old, new in (("µ", "u"), ("μ", "u"), ("²", "2"), ("³", "3"), ("⁻¹", "-1"), ("⁻", "-"), ("**", "^"), ("º", "°")):
        text = text.replace(old, new)
    text = text.replace("^", "").replace("_per_", "/").replace(" per ", "/").replace("° ", "°")
    if "/" not in text:
        text = re.sub(r"^([A-Za-z]{1,2})[ ·⋅*.]?s-([12])$", lambda m: f"{m[1]}/s{m[2].replace('1', '')}", text)
        text = re.sub(r"^([a-z]{1,2})_s([2]?)$", r"\1/s\2", text)
    return re.sub(r"/s/s$", "/s2", re.sub(r"\s*/\s*", "/", text)).replace("/sec", "/s")


def _from_pint(text: str) -> Unit | None:
    if not _PLAIN.fullmatch(text) or len(text) < 2:
        return None
    import pint

    try:
        quantity = _registry().Quantity(1.0, text).to_base_units()
    except (pint.errors.PintError, ValueError, TypeError, KeyError, AttributeError, ArithmeticError, SyntaxError):
        return None
    dimension = _PINT.get(str(quantity.dimensionality), str(quantity.dimensionality))
    return Unit(dimension, float(quantity.magnitude))


@lru_cache(maxsize=1)
def _registry():
    import pint

    return pint.UnitRegistry(cache_folder=None)
