"""What is remembered along times and paths is what would be computed anew, and lives no longer than they do."""

import gc

import numpy as np

from mrdamper.physics.motion import lag
from mrdamper.physics.motion.lag import first_order_lag
from mrdamper.physics.motion.path import memoize_per_path


def test_another_signal_or_constant_along_known_times_is_lagged_as_along_new_ones():
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(1e-4, 5e-3, 500))
    for constant in (4e-3, 9e-3, 4e-3):
        signal = rng.standard_normal(time.size)
        np.testing.assert_array_equal(
            first_order_lag(time, signal, constant), first_order_lag(time.copy(), signal, constant)
        )


def test_long_records_are_lagged_alike(monkeypatch):
    time, signal = np.arange(2000) / 500, np.sin(np.arange(2000) / 7)
    short = first_order_lag(time, signal, 0.01)
    monkeypatch.setattr(lag, "LONG", 1000)
    np.testing.assert_array_equal(first_order_lag(time.copy(), signal, 0.01), short)


def test_only_the_last_two_are_remembered_and_nothing_outlives_what_it_belongs_to():
    made = []

    @memoize_per_path
    def scaled(time, factor):
        made.append(factor)
        return factor * time

    time = np.arange(4.0)
    assert scaled(time, 2.0) is scaled(time, 2.0)
    scaled(time, 3.0)  # a search moves to and fro
    scaled(time, 2.0)
    scaled(time, 4.0)
    scaled(time, 3.0)
    assert made == [2.0, 3.0, 4.0, 3.0]
    del time
    gc.collect()
    (known,) = (cell.cell_contents for cell in scaled.__closure__ if isinstance(cell.cell_contents, dict))
    assert known == {}
