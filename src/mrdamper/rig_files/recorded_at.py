"""Day and time at which a test was recorded, as the lines around its columns state them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import datetime

from mrdamper.rig_files.vocabulary import words

_DATES, _TIMES = words("date_line"), words("time_of_day")
_KEYED = re.compile(r"^[\W_]*(?P<key>[^\W\d_][\w ./-]{0,40}?)[\"' ]*[:=;,\t]+[\"' ]*(?P<value>\S.{0,60})")
_YEAR_FIRST = re.compile(
    r"(?<!\d)(?P<year>(?:19|20)\d\d)(?P<mark>[-./])(?P<month>\d{1,2})(?P=mark)(?P<day>\d{1,2})(?!\d)"
)
_YEAR_LAST = re.compile(
    r"(?<!\d)(?P<first>\d{1,2})(?P<mark>[-./])(?P<second>\d{1,2})(?P=mark)(?P<year>(?:19|20)\d\d)(?!\d)"
)
_NAMED = re.compile(
    r"(?i)(?<!\w)(?:(?P<day>\d{1,2})[. -]+(?P<month>[a-z]{3,9})|(?P<month_first>[a-z]{3,9})[. ]+(?P<day_last>\d{1,2}))"
    r"[., -]+(?P<year>(?:19|20)\d\d)(?!\d)"
)
_TIME = re.compile(
    r"(?i)(?<![\d:])(?P<hour>\d{1,2}):(?P<minute>\d\d)(?::(?P<second>\d\d))?(?:[.,]\d+)?\s*(?P<half>[ap]m)?"
)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


def recording_time(lines: Iterable[str]) -> dict[str, str]:
    """Return the note `recorded_at` (ISO 8601) of a test, or `session`, the date as written, where it is ambiguous.

    A line that names a date and nothing else counts ("Test date: 2024-05-31 14:05"), with the time of day in the same
    line or in one of its own. 03/04/2024 is a day, and the same day in all files of a rig, but not known to be of March
    or April. Lines that state different days (a report printed later) state none.
    """
    days, times = dict[str, str](), dict[str, None]()
    for line in lines:
        keyed = _KEYED.match(line)
        if keyed is None:
            continue
        key, value = " ".join(keyed["key"].casefold().split()), keyed["value"]
        if key in _DATES and (day := _day_in(value)):
            days[day[0]] = day[1]
        if key in _DATES or key in _TIMES:
            times |= dict.fromkeys(filter(None, [_time_in(value)]))
    if len(days) != 1:
        return {}
    ((iso, written),) = days.items()
    if not iso[0].isdigit():
        return {"session": written}
    return {"recorded_at": f"{iso}T{next(iter(times))}" if len(times) == 1 else iso}


def _day_in(text: str) -> tuple[str, str] | None:
    """Return a day as ISO 8601 ("?" and the text where day and month may be exchanged) and as written."""
    if match := _YEAR_FIRST.search(text):
        year, month, day = (int(match[name]) for name in ("year", "month", "day"))
    elif match := _YEAR_LAST.search(text):
        day, month, year = int(match["first"]), int(match["second"]), int(match["year"])
        if match["mark"] != "." and day != month and max(day, month) <= 12:
            return f"?{match[0]}", match[0]
        if month > 12:
            day, month = month, day
    elif match := _NAMED.search(text):
        name = (match["month"] or match["month_first"])[:3].casefold()
        if name not in _MONTHS:
            return None
        year, month, day = int(match["year"]), _MONTHS.index(name) + 1, int(match["day"] or match["day_last"])
    else:
        return None
    try:
        return datetime(year, month, day).date().isoformat(), match[0]
    except ValueError:
        return None


def _time_in(text: str) -> str | None:
    """Return a time of day as ISO 8601."""
    match = _TIME.search(text)
    if match is None:
        return None
    hour = int(match["hour"])
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"].casefold() == "pm")
    try:
        return datetime(1970, 1, 1, hour, int(match["minute"]), int(match["second"] or 0)).time().isoformat()
    except ValueError:
        return None
