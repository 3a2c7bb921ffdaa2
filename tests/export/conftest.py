"""FMUs are made once: their tests share a process."""

import pytest


def pytest_collection_modifyitems(items):
    for item in items:
        if "/export/test_fmu" in item.nodeid:
            item.add_marker(pytest.mark.xdist_group("fmu"))
