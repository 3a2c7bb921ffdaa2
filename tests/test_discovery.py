"""Discovery of parts: a list that one thread still fills is not read by another."""

import threading
import time
from importlib.metadata import Distribution

from mrdamper import discovery
from mrdamper.discovery import Registry
from mrdamper.models import Model


def test_threads_that_ask_at_once_see_every_class(monkeypatch):
    """The first thread imports the parts; the second waits for all of them."""
    parts = discovery.provided_modules("mrdamper.models")
    begun = threading.Event()

    def slow(group):
        begun.set()
        time.sleep(0.2)
        return parts

    monkeypatch.setattr(discovery, "provided_modules", slow)
    monkeypatch.setattr(discovery, "_registries", {})
    registry = Registry("mrdamper.models", Model, "model")
    seen = []
    threads = [threading.Thread(target=lambda: seen.append(set(registry.all()))) for _ in range(2)]
    threads[0].start()
    assert begun.wait(5)
    threads[1].start()
    for thread in threads:
        thread.join(10)
    assert len(seen) == 2
    assert seen[0] == seen[1] >= {"bouc-wen", "bingham"}


def test_the_description_of_a_package_is_read_once_for_all_its_parts(monkeypatch):
    read, metadata = [], Distribution.metadata.fget
    monkeypatch.setattr(Distribution, "metadata", property(lambda self: read.append(self) or metadata(self)))
    discovery.modules_with("mrdamper.checks", "check")
    discovery.provided_modules.cache_clear()
    discovery.modules_with("mrdamper.checks", "check")
    assert len(read) <= 2 * len(set(map(id, read)))  # its name and its version
