"""A job that crashes, hangs, leaks, wants too much or forks fails alone, and the next one runs."""

import os
import time
from dataclasses import replace

import pytest

from mrdamper.data.child import descendants
from mrdamper.errors import InputError
from mrdamper.fleet.guard import JobError, JobLimits, KillableWorker

HERE = "support.bad_jobs"
SMALL = JobLimits(cpu_s=1.0, wall_s=60.0, memory_bytes=700 * 2**20)


@pytest.fixture
def guard():
    held = KillableWorker(SMALL)
    yield held
    held.close()


@pytest.mark.parametrize(
    ("job", "argument", "code", "found"),
    [
        ("crash", None, "E_JOB_CRASH", "SIGSEGV"),
        ("leave", None, "E_JOB_CRASH", "status 7"),
        ("hang", None, "E_JOB_TIME", "not done after 2 s"),
        ("spin", None, "E_JOB_TIME", "0.5 s of processor time"),
        ("want", 4 * 2**30, "E_JOB_MEMORY", "0.684 GiB"),
        ("fork_and_want", 400 * 2**20, "E_JOB_MEMORY", "0.684 GiB"),
        ("slip", None, "E_JOB_FAULT", "ZeroDivisionError: ours"),
    ],
)
def test_it_fails_alone_and_is_named(guard, job, argument, code, found):
    if job in ("hang", "spin"):
        guard = KillableWorker(replace(SMALL, wall_s=2.0) if job == "hang" else replace(SMALL, cpu_s=0.5))
    with pytest.raises(JobError) as failed:
        guard.call(f"{HERE}:{job}", argument)
    assert failed.value.code == code
    assert found in str(failed.value)
    assert guard.call(f"{HERE}:doubled", 21) == 42
    guard.close()


def test_a_leak_ends_with_its_process(guard):
    # What a first job leaves is taken for its libraries; the next one's leak is noticed.
    assert [guard.call(f"{HERE}:leak", 300 * 2**20) for _ in range(4)] == [1, 2, 1, 2]


def test_a_fork_that_comes_back_has_no_say(guard):
    assert [guard.call(f"{HERE}:fork_and_return", None) for _ in range(3)] == ["parent"] * 3


def test_nothing_is_left_behind(guard):
    before = set(descendants(os.getpid()))  # of other tests of this process
    assert guard.call(f"{HERE}:fork_and_leave_behind", None) == "left"
    time.sleep(0.2)
    assert guard.call(f"{HERE}:doubled", 1) == 2
    assert len(set(descendants(os.getpid())) - before) == 1  # the guard's own process


def test_a_job_whose_process_somebody_killed_is_done_again(guard, tmp_path):
    assert guard.call(f"{HERE}:killed_once", str(tmp_path / "mark")) == "done"


def test_what_the_user_can_mend_comes_through(guard):
    with pytest.raises(InputError) as refused:
        guard.call(f"{HERE}:refuse", None)
    assert str(refused.value) == "a.csv: no force; add it [E_COLUMN]"
