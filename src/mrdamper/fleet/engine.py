"""Execution of jobs: processes of this machine, or a Dask cluster. Both return futures of rows."""

from __future__ import annotations

import atexit
import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mrdamper.errors import InputError, MissingExtraError
from mrdamper.fleet.guard import JobError, JobLimits, KillableWorker

Row = dict[str, Any]
Submit = Callable[[Row], "Future[Row]"]
_ATTEMPT = "mrdamper.fleet.job:attempt"
_LOST_TRIES = 8  # of a job whose cluster worker was killed


class ClusterError(InputError):
    """The cluster cannot be reached, or was lost."""

    code = "E_CLUSTER"


@contextmanager
def local_engine(workers: int, limits: JobLimits) -> Iterator[tuple[Submit, int]]:
    """Run jobs on this machine in worker processes that can be killed, without a socket.

    Yields a function from the argument of a job to the future of its row, and how many run at once.
    """
    held = threading.local()
    guards: list[KillableWorker] = []

    def begin() -> None:
        held.guard = KillableWorker(limits)
        guards.append(held.guard)

    pool = ThreadPoolExecutor(workers, thread_name_prefix="fleet", initializer=begin)
    try:
        yield lambda job: pool.submit(lambda: guarded(held.guard, job)), workers
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for guard in guards:
            guard.close()
        pool.shutdown(wait=True)


def outcome(future: Future[Row]) -> Row:
    """Return the row of a finished job; a job whose cluster workers died repeatedly has failed.

    Raises `ClusterError` if the scheduler is lost.
    """
    from mrdamper.fleet.job import refused

    try:
        return future.result()
    except CancelledError as error:
        raise ClusterError(
            "the scheduler is lost", remedy="start it again and run the same command; what was finished is safe"
        ) from error
    except Exception as error:
        if type(error).__name__ != "KilledWorker":
            raise
        return refused(JobError(_first_line(error), remedy="run the same command again"))


def guarded(guard: KillableWorker, job: Row) -> Row:
    """Run a job in a process with limits and return its row, also where the process fails."""
    from mrdamper.fleet.job import refused

    try:
        return guard.call(_ATTEMPT, job)
    except JobError as error:
        return refused(error)


@contextmanager
def cluster_engine(
    address: str, limits: JobLimits, tls: str | Path | None = None, patience: float = 10.0
) -> Iterator[tuple[Submit, int]]:
    """Run jobs on a Dask cluster, each in a child process of its worker; yields as `local_engine`.

    Raises `MissingExtraError` if Dask is not installed. Raises `ClusterError` if no scheduler responds or it has no
    worker.
    """
    try:
        import distributed
    except ModuleNotFoundError as error:
        raise MissingExtraError("Dask is not installed", remedy="pip install 'mrdamper[fleet]'") from error
    options: dict[str, Any] = {}
    if tls is not None:
        ca, cert, key = (str(Path(tls) / name) for name in ("ca.pem", "cert.pem", "key.pem"))
        options["security"] = distributed.Security(
            require_encryption=True, tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key
        )
    try:
        client = distributed.Client(address, timeout=patience, set_as_default=False, **options)
    except (OSError, TypeError, ValueError, RuntimeError) as error:
        raise ClusterError(
            f"no scheduler answers: {_first_line(error)}", where=address,
            remedy="mrdamper cluster shows how to start one",
        ) from error  # fmt: skip
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # its messages are raised as errors of this package
    try:
        workers = client.scheduler_info(n_workers=-1)["workers"]
        slots = sum(worker["nthreads"] for worker in workers.values())
        if not slots:
            raise ClusterError(
                "the cluster has no worker", where=address, remedy="mrdamper cluster shows how to start one"
            )
        executor: Executor = client.get_executor(pure=False, retries=_LOST_TRIES)
        yield lambda job: executor.submit(on_cluster, job, asdict(limits)), slots
    finally:
        client.close(timeout=5)


_HELD = threading.local()


def on_cluster(job: Row, limits: dict[str, Any]) -> Row:
    """Run a job on a worker of the cluster; each of its threads has its own child process."""
    guard: KillableWorker | None = getattr(_HELD, "guard", None)
    if guard is None or _HELD.limits != limits:
        if guard is not None:
            guard.close()
        _HELD.limits, _HELD.guard = limits, KillableWorker(JobLimits(**limits))
        atexit.register(_HELD.guard.close)
        guard = _HELD.guard
    return guarded(guard, job)


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).strip().splitlines()[0]
