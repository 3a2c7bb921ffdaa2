"""The session of a run: as stated, else its day, else unknown."""

import numpy as np
import pytest

from mrdamper.data import Run, hour_of, session_of
from mrdamper.data.sessions import session_groups
from mrdamper.errors import InputError


def recorded(**notes):
    time = np.arange(4.0)
    return Run("r1", time, np.sin(time), np.cos(time), 0.0, notes=notes)


@pytest.mark.parametrize(
    ("notes", "session", "hour"),
    [
        ({}, None, None),
        ({"session": "", "recorded_at": ""}, None, None),
        ({"session": "  "}, None, None),
        ({"session": "a"}, "a", None),
        ({"session": " a ", "recorded_at": "1970-01-02T02:30:00"}, "a", 26.5),
        ({"recorded_at": "1970-01-02T02:30:00"}, "1970-01-02", 26.5),
        ({"recorded_at": "1970-01-02T23:59:59"}, "1970-01-02", 24 + 23 + 3599 / 3600),
        ({"recorded_at": "1970-01-02", "session": ""}, "1970-01-02", None),
    ],
)
def test_a_session_is_stated_or_the_day_or_unknown(notes, session, hour):
    run = recorded(**notes)
    assert session_of(run) == session
    assert hour_of(run) == (None if hour is None else pytest.approx(hour))


def test_a_clock_that_is_no_date_is_refused_where_it_is_needed():
    assert session_of(recorded(session="a", recorded_at="yesterday")) == "a"
    for ask in (session_of, hour_of):
        with pytest.raises(InputError, match="recorded_at is 'yesterday'") as caught:
            ask(recorded(recorded_at="yesterday"))
        assert caught.value.code == "E_CLOCK"


def test_sessions_are_groups_of_runs_in_the_order_of_their_names():
    assert session_groups(["b", "a", None, "c", "a"]) == [[1, 4], [0], [3]]
    assert session_groups(["b", "a", None, "a"]) == []
