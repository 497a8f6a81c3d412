# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The workers that run jobs: local processes, or a Ray cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from queue import SimpleQueue
from threading import Thread
from time import sleep
from typing import Any, Protocol, TypeVar

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.finished_jobs import FinishedJobs
from slap_ros.learning.progress_callback import ProgressCallback
from slap_ros.signals import signals_held_back

Result = TypeVar("Result")
PARENT_POLL_S = 1.0


class Workers(Protocol):
    """Runs jobs side by side; each is a function of its arguments alone, wherever it runs."""

    @property
    def processes(self) -> int:
        """The number of cores that a job may use where it is the only one."""
        ...

    def run(
        self, function: Callable[..., Result], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Result]]:
        """Run a function once per job.

        Args:
            function: Function to run; importable by its name, for other processes.
            jobs: Arguments of the function, one tuple per job.

        Yields:
            The number and the result of each job, as they end.
        """
        ...


class SequentialWorkers:
    """Runs one job after the other in this process."""

    processes = 1

    def run(
        self, function: Callable[..., Result], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Result]]:
        """See :class:`Workers`."""
        for i, job in enumerate(jobs):
            yield i, function(*job)


class LocalWorkers:
    """Processes of this machine."""

    def __init__(self, pool: ProcessPoolExecutor, processes: int) -> None:
        self._pool, self.processes = pool, processes

    def run(
        self, function: Callable[..., Result], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Result]]:
        """See :class:`Workers`."""
        numbers: dict[Future[Result], int] = {}
        ended: SimpleQueue[Future[Result]] = SimpleQueue()
        with signals_held_back():  # the first job starts the processes
            for i, job in enumerate(jobs):
                future = self._pool.submit(function, *job)
                numbers[future] = i
                future.add_done_callback(ended.put)
        for _ in numbers:
            # Not as_completed: a signal while it takes the locks of its futures leaves them taken,
            # and the pool waits for them for good.
            future = ended.get()
            yield numbers[future], future.result()


class RayWorkers:
    """Processes of a Ray cluster, on which slap_ros must be installed."""

    processes = 1  # a job has one core there

    def __init__(self, ray: Any) -> None:
        self._ray = ray

    def run(
        self, function: Callable[..., Result], jobs: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Result]]:
        """See :class:`Workers`."""
        remote = self._ray.remote(num_cpus=1)(function)
        numbers = {remote.remote(*job): i for i, job in enumerate(jobs)}
        waiting = list(numbers)
        while waiting:
            (ready,), waiting = self._ray.wait(waiting, num_returns=1)
            yield numbers[ready], self._ray.get(ready)


def exit_with_parent(parent: int) -> None:
    """Let this process end when its parent has, for whatever reason."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(PARENT_POLL_S)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def local_workers(count: int) -> Iterator[LocalWorkers]:
    """A pool of ``count`` processes; after an error, those still running are terminated."""
    # Spawned, not forked: physics clients and threads do not survive a fork.
    context = get_context("spawn")
    pool = ProcessPoolExecutor(
        count, mp_context=context, initializer=exit_with_parent, initargs=(os.getpid(),)
    )
    try:
        yield LocalWorkers(pool, count)
    except BaseException:
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(cancel_futures=True)  # waits, or semaphores would be left to the tracker
        raise
    pool.shutdown()


@contextmanager
def ray_workers(address: str) -> Iterator[RayWorkers]:
    """The workers of the cluster at an address; ``local`` starts one on this machine.

    Raises:
        InvalidParameterError: Ray is not installed, or nothing answers there.
    """
    try:
        import ray
    except ImportError as error:
        raise InvalidParameterError("Ray is not installed: pip install 'slap_ros[ray]'") from error
    try:
        ray.init(address=address, log_to_driver=False)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise InvalidParameterError(f"no Ray cluster at {address!r}: {error}") from error
    try:
        yield RayWorkers(ray)
    finally:
        ray.shutdown()


def run_in_order(
    workers: Workers,
    function: Callable[..., Result],
    jobs: Sequence[tuple[Any, ...]],
    what: str,
    callback: ProgressCallback,
    finished: FinishedJobs | None = None,
) -> list[Result]:
    """Run a function once per job, wherever and in whichever order they end.

    Args:
        workers: Workers that run the jobs.
        function: Function to run; importable by its name, for other processes.
        jobs: Arguments of the function, one tuple per job.
        what: Name of the step that the jobs are, in words.
        callback: Callback that is told before the first job and after each.
        finished: Jobs that have ended already, which are not run again; each that ends is added.
            There may be more of them than are asked for. None to run them all and keep none.

    Returns:
        The results in the order of the jobs.
    """
    ended: dict[int, Result] = finished.of(what) if finished is not None else {}
    results = {number: result for number, result in ended.items() if number < len(jobs)}
    callback.on_progress(what, 0, len(jobs))
    if results:
        callback.on_progress(what, len(results), len(jobs))
    left = [number for number in range(len(jobs)) if number not in results]
    for place, result in workers.run(function, [jobs[number] for number in left]):
        number = left[place]
        if finished is not None:
            finished.add(what, number, result)
        results[number] = result
        callback.on_progress(what, len(results), len(jobs))
    return [results[number] for number in range(len(jobs))]
