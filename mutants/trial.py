"""One group: its tests are collected once, then every fault is tried in a fork."""

from __future__ import annotations

import gc
import importlib
import inspect
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Generator, Iterator
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest

from mutants.faults import Fault, path_of, planted
from mutants.fork import in_fork

_UNKNOWN = 255  # exit status of a fork whose test number does not fit


class Trial:
    """A pytest plugin that runs the collected tests once without a fault and then once per fault.

    Parameters
    ----------
    faults : list of Fault
    jobs : int
        Forks at a time.
    patience : float
        Additional processor time by a fault [s].
    console : int
        File descriptor for progress.
    """

    def __init__(self, faults: list[Fault], jobs: int, patience: float, console: int):
        self.faults, self.jobs, self.patience, self.console = faults, jobs, patience, console
        self.survivors: list[Fault] = []
        self.why = ""
        self.seconds: dict[str, float] = {}
        self.through: dict[tuple[str, str, int], set[str]] = {}  # function → tests and fixtures that execute it
        self.running: list[str] = []
        self.functions: list[FunctionType] = []
        self.kills: Counter[str] = Counter()  # faults that a test has detected
        self.made: dict[str, Any] = {}  # values of shared fixtures that execute no planted function

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the trials instead of the tests once."""
        if session.testsfailed or not session.items:
            self.why = "no test could be collected"
            return True
        for module in {fault.module for fault in self.faults}:
            importlib.import_module(module)  # modules loaded later would be loaded again in every fork
        files = {str(path_of(fault.module)) for fault in self.faults}
        answer = in_fork(lambda: self._healthy(session, files), 600)
        if not isinstance(answer, tuple):
            self.why = f"fail without any fault ({answer}): correct them first"
            return True
        self.seconds, self.through = answer
        self._make_fixtures(session)
        gc.unfreeze()  # objects frozen by the tests' conftest are not listed otherwise
        alive = (f for f in gc.get_objects() if isinstance(f, FunctionType))
        self.functions = [f for f in alive if f.__code__.co_filename in files]
        gc.freeze()  # forks then share the memory pages
        self._try_all(session)
        return True

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Generator[None, Any, Any]:
        """Count a shared fixture's calls and time for every test that uses it."""
        begin = time.process_time()
        self.running.append(_fixture(fixturedef))
        try:
            return (yield)
        finally:
            name = self.running.pop()
            self.seconds[name] = self.seconds.get(name, 0.0) + time.process_time() - begin

    def _make_fixtures(self, session: pytest.Session) -> None:
        """Make shared fixtures of modules and of the session that depend on one another alone."""
        planted = set().union(*self.through.values())
        for item in session.items:
            definitions = {name: found[-1] for name, found in _definitions(item).items()}
            for name in sorted(definitions, key=lambda name: self.seconds.get(_fixture(definitions[name]), 0.0)):
                self._make_fixture(name, definitions, planted)

    def _make_fixture(self, name: str, definitions: dict[str, Any], planted: set[str]) -> None:
        one = definitions.get(name)
        if one is None or (key := _fixture(one)) in self.made or key in planted:
            return
        if one.scope not in ("module", "session") or one.params or inspect.isgeneratorfunction(one.func):
            return
        for argument in one.argnames:
            self._make_fixture(argument, definitions, planted)
        arguments = [definitions.get(argument) for argument in one.argnames]
        if all(d is not None and _fixture(d) in self.made for d in arguments):
            values = [self.made[_fixture(d)] for d in arguments]
            self.made[key] = one.func(*values)
            one.func = lambda *given, **named: self.made[key]

    def _healthy(self, session: pytest.Session, files: set[str]) -> Any:
        def trace(frame: FrameType, event: str, argument: object) -> None:
            code = frame.f_code
            if code.co_filename in files:
                self.through.setdefault(_key(code), set()).update(self.running)

        sys.settrace(trace)
        for item, nextitem in _in_turn(session.items):
            self.running, begin = [item.nodeid], time.process_time()
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=nextitem)
            self.seconds[item.nodeid] = time.process_time() - begin
            if session.testsfailed:
                return item.nodeid
        return self.seconds, self.through

    def _try_all(self, session: pytest.Session) -> None:
        begin, running = time.perf_counter(), dict[int, tuple[Fault, list[pytest.Item]]]()
        for fault in self.faults:
            changed = _changed_code(fault)
            tests = self._answering(session, changed)
            if not tests:
                self._survives(fault, "no test runs through it")
                continue
            child = os.fork()
            if child == 0:
                os._exit(self._noticed(session, changed, tests))
            running[child] = fault, tests
            while len(running) >= self.jobs:
                self._reap(running)
        while running:
            self._reap(running)
        named = f"{self.faults[0].module}: {len(self.faults)} tried in {time.perf_counter() - begin:.0f} s\n"
        os.write(self.console, named.encode())

    def _reap(self, running: dict[int, tuple[Fault, list[pytest.Item]]]) -> None:
        child, status = os.wait()
        fault, tests = running.pop(child)
        noticed_by = os.waitstatus_to_exitcode(status)
        if noticed_by == 0:
            self._survives(fault, "")
        elif 0 < noticed_by < _UNKNOWN:
            self.kills[tests[noticed_by - 1].nodeid] += 1

    def _survives(self, fault: Fault, why: str) -> None:
        self.survivors.append(fault)
        text = f"survives: {fault.module}:{fault.line}: {fault.change} in {fault.of}: {fault.text} {why}\n"
        os.write(self.console, text.encode())

    def _noticed(
        self, session: pytest.Session, changed: list[tuple[CodeType, CodeType]], tests: list[pytest.Item]
    ) -> int:
        """Number of the first test, from 1, that fails with the fault; 0 if none does."""
        number, new = 0, dict(changed)
        # A test may have to make results that another one cached in the run without a fault.
        limit = self.patience + max(map(self._cost, tests))
        try:
            for function in self.functions:
                if function.__code__ in new:
                    function.__code__ = new[function.__code__]
            for number, (item, nextitem) in enumerate(_in_turn(tests), 1):
                limit += 5 * self._cost(item)
                signal.setitimer(signal.ITIMER_PROF, limit - time.process_time())  # independent of the load
                signal.alarm(10 * int(limit) + 10)  # for a test that waits without processor time
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=nextitem)
                if session.testsfailed:
                    return min(number, _UNKNOWN)
        except BaseException:
            return min(max(number, 1), _UNKNOWN)
        return 0

    def _answering(self, session: pytest.Session, changed: list[tuple[CodeType, CodeType]]) -> list[pytest.Item]:
        """Tests that execute a function with the fault; first the fast ones that detected other faults."""
        names = set().union(*(self.through.get(_key(old), set()) for old, _ in changed))
        found = [i for i in session.items if i.nodeid in names or not names.isdisjoint(_fixtures(i))]
        return sorted(found, key=lambda item: self._cost(item) / (1 + self.kills[item.nodeid]))

    def _cost(self, item: pytest.Item) -> float:
        return self.seconds[item.nodeid] + sum(self.seconds.get(name, 0.0) for name in _fixtures(item))


def _in_turn(items: list[pytest.Item]) -> Iterator[tuple[pytest.Item, pytest.Item | None]]:
    """Pairs of successive tests, for which pytest keeps shared fixtures."""
    return zip(items, [*items[1:], None], strict=True)


def _changed_code(fault: Fault) -> list[tuple[CodeType, CodeType]]:
    """Code objects before and after, where they differ."""
    path = path_of(fault.module)
    old = compile(path.read_text(encoding="utf-8"), str(path), "exec", dont_inherit=True)
    new = compile(planted(fault), str(path), "exec", dont_inherit=True)
    return list(_differing(old, new))


def _differing(old: CodeType, new: CodeType) -> Iterator[tuple[CodeType, CodeType]]:
    inner = ([c for c in code.co_consts if isinstance(c, CodeType)] for code in (old, new))
    # Exchanged arguments move their lambdas: then only the enclosing function counts.
    pairs = zip(*inner, strict=False)
    for a, b in pairs:
        yield from _differing(a, b)
    if old != new:
        yield old, new


def _key(code: CodeType) -> tuple[str, str, int]:
    return code.co_filename, code.co_qualname, code.co_firstlineno


def _fixtures(item: pytest.Item) -> set[str]:
    return {_fixture(definition) for definitions in _definitions(item).values() for definition in definitions}


def _definitions(item: Any) -> dict[str, list[Any]]:
    """Fixtures of a test by their names, the nearest last; pytest has no public interface for them."""
    return item._fixtureinfo.name2fixturedefs


def _fixture(definition: Any) -> str:
    return f"fixture {definition.baseid}::{definition.argname}"
