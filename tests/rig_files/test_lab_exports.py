"""Every kind of laboratory export becomes the tests it was made of; `benchmarks` measures all combinations."""

import numpy as np
import pytest
from support.lab_exports import KINDS, LOCALES, UNITS, Lab, campaign, faults
from support.stored_exports import MACHINES

from mrdamper.rig_files.parts import stretches_of_time
from mrdamper.rig_files.rig_import import import_files, to_dataset

WRITINGS = [(locale, units) for locale in LOCALES for units in UNITS]


@pytest.fixture(scope="module")
def tests():
    return campaign(1, currents=(0.0, 0.8), points=40, cycles=3)[::2]


@pytest.mark.parametrize("kind", KINDS)
def test_an_export_holds_every_test_it_was_made_of(kind, tests, tmp_path):
    """In two locales and units a kind, so that every one of them comes up."""
    place = list(KINDS).index(kind)
    for step in (0, 13):
        locale, units = WRITINGS[(5 * place + step) % len(WRITINGS)]
        lab = Lab(tests, locale, units, facts={"form": place + step})
        folder = tmp_path / f"{locale}_{units}"
        folder.mkdir()
        KINDS[kind](lab, folder)
        imported = import_files([folder])
        assert not imported.refusals, str(imported.refusals[0].error)
        assert faults(lab, to_dataset(imported.records)) == []


@pytest.mark.parametrize("machine", MACHINES)
def test_a_machines_export_holds_every_test_it_was_made_of(machine, tests, tmp_path):
    MACHINES[machine](tests, tmp_path)
    imported = import_files([tmp_path])
    assert not imported.refusals, str(imported.refusals[0].error)
    assert faults(Lab(tests), to_dataset(imported.records)) == []


@pytest.mark.parametrize(
    ("name", "time"),
    [
        ("swapped rows", [0, 1, 2, 4, 3, 5]),
        ("a counter of 16 bits in milliseconds", np.concatenate([np.arange(0, 65.536, 0.004), np.arange(0, 5, 0.004)])),
        ("an hour put back", np.concatenate([np.arange(0, 50, 0.5), np.arange(0, 50, 0.5) - 3550])),
        ("one stamp of zero", np.concatenate([np.arange(0, 5, 0.1), [0.0], np.arange(5, 10, 0.1)])),
    ],
)
def test_what_runs_backwards_for_another_reason_is_no_new_test(name, time):
    assert len(stretches_of_time(np.asarray(time, dtype=float))) == 1, name


def test_a_time_that_starts_again_is_a_new_test():
    time = np.concatenate([np.arange(0, 5, 0.01), np.arange(0, 3, 0.01), np.arange(0, 4, 0.01)])
    assert stretches_of_time(time) == [slice(0, 500), slice(500, 800), slice(800, 1200)]
