# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executors: run the callbacks of nodes, in one thread or in several.

A turn collects everything that is ready (tasks, timers, guard conditions, readers with
samples) and then runs it one by one. A sample is taken from DDS only when its callback is about
to run, so that a slow callback sees the newest samples that its history depth allows. An entity
whose callback group is busy is detached from the wait set until the group is free; an executor
with nothing to do therefore sleeps, also while coroutines await.
"""

from __future__ import annotations

import itertools
import os
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import TYPE_CHECKING, Any

from embedded_ros.transport.endpoints import WaitSet

from ._entity import Entity
from .context import Context
from .task import Future, Task
from .timer import Timer
from .utilities import get_default_context

if TYPE_CHECKING:
    from .node import Node

# Ends waits now and then, so that Python runs signal handlers that are not rclpy's own.
_MAX_WAIT_NS = 1_000_000_000
QOS_CHECK_PERIOD_S = 1.0


class TimeoutException(Exception):
    """Nothing became ready in time."""


class ShutdownException(Exception):
    """The executor was shut down while it was waited for."""


class ExternalShutdownException(Exception):
    """The context was shut down while it was spun."""


class ConditionReachedException(Exception):
    """What was spun for has happened."""


class Executor:
    """Base of the executors: everything but in which thread callbacks run."""

    def __init__(self, *, context: Context | None = None) -> None:
        self._context = context or get_default_context()
        self._nodes: set[Node] = set()
        self._lock = threading.RLock()
        self._tasks: deque[Task] = deque()
        self._ready: deque[Callable[[], Task | None]] = deque()
        self._waits = _Waits(self._context)
        self._shutdown = False
        self._spinning = False
        self._entities: list[Entity] = []
        self._entities_changed = True
        self._next_qos_check = _now()

    @property
    def context(self) -> Context:
        """The context whose shutdown ends spinning."""
        return self._context

    @property
    def is_shutdown(self) -> bool:
        """Whether the executor was shut down."""
        return self._shutdown

    def add_node(self, node: Node) -> bool:
        """Run a node's callbacks; returns False where it is here already."""
        with self._lock:
            if node in self._nodes:
                return False
            self._nodes.add(node)
            node.executor = self
        self.entities_changed()
        return True

    def remove_node(self, node: Node) -> None:
        """Run a node's callbacks no more.

        As in rclpy it stays the node's executor until there is another: tasks that the node
        creates meanwhile run when it is spun again.
        """
        with self._lock:
            self._nodes.discard(node)
        self.entities_changed()

    def get_nodes(self) -> list[Node]:
        """The nodes whose callbacks it runs."""
        with self._lock:
            return list(self._nodes)

    def wake(self) -> None:
        """Have it look again at what is ready; from any thread."""
        self._waits.wake()

    def entities_changed(self) -> None:
        """Have it look again at which entities its nodes have; from any thread."""
        self._entities_changed = True
        self.wake()

    def create_task(
        self, callback: Callable[..., Any] | Coroutine[Any, Any, Any], *args: Any, **kwargs: Any
    ) -> Task:
        """Run a function or coroutine; returns its task, a future of its result."""
        task = Task(callback, args, kwargs, self)
        self.resume(task)
        return task

    def resume(self, task: Task) -> None:
        """Run a task's next step; from any thread."""
        self._tasks.append(task)
        self.wake()

    def spin(self) -> None:
        """Run callbacks until the context or the executor is shut down.

        Raises:
            ExternalShutdownException: The context was shut down, by a signal or another thread.
            Exception: Whatever a callback raised.
        """
        self._enter_spin()
        try:
            while self._context.ok() and not self._shutdown:
                self._spin_once(None)
            if self._context.shut_down_by_signal and not self._shutdown:
                raise ExternalShutdownException
        finally:
            self._spinning = False

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Run one callback.

        Args:
            timeout_sec: How long to wait for one; for ever by default.

        Raises:
            ExternalShutdownException: The context is shut down.
            Exception: Whatever the callback raised.
        """
        self._enter_spin()
        try:
            self._spin_once(timeout_sec)
        finally:
            self._spinning = False

    def spin_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        """Run callbacks until a future is done, or the time is up.

        Raises:
            ExternalShutdownException: The context was shut down.
            Exception: Whatever a callback raised.
        """
        future._set_executor(self)

        def wake(_: Future[Any]) -> None:
            self.wake()

        future.add_wakeup(wake)
        deadline = None if timeout_sec is None or timeout_sec < 0 else _now() + timeout_sec
        self._enter_spin()
        try:
            while self._context.ok() and not (
                future.done() or future.cancelled() or self._shutdown
            ):
                remaining = None if deadline is None else deadline - _now()
                if remaining is not None and remaining <= 0:
                    return
                self._spin_once(remaining, until=future)
        finally:
            self._spinning = False
            future.remove_wakeup(wake)

    def spin_once_until_future_complete(
        self, future: Future[Any], timeout_sec: float | None = None
    ) -> None:
        """Run one callback, unless the future is done before."""
        self.spin_until_future_complete(future, timeout_sec)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop spinning and let go of the nodes; callbacks that run are waited for.

        Returns:
            Whether they finished in time.
        """
        self._shutdown = True
        self.wake()
        with self._lock:
            self._nodes.clear()
        if not self._spinning:
            self._waits.close()
        return True

    def __enter__(self) -> Executor:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.shutdown()

    def __del__(self) -> None:
        waits = self.__dict__.get("_waits")
        if waits is not None:
            waits.close()

    # -- one turn

    def _enter_spin(self) -> None:
        with self._lock:
            if self._spinning:
                raise RuntimeError("Executor is already spinning")
            self._spinning = True

    def _spin_once(self, timeout_sec: float | None, until: Future[Any] | None = None) -> None:
        try:
            task = self._next_task(timeout_sec, until)
        except ShutdownException:
            return
        if task is not None:
            self._execute(task)

    def _execute(self, task: Task) -> None:
        """Run a task's step in this thread."""
        task()
        if task.done() and (error := task.exception()) is not None:
            raise error

    def _has_capacity(self) -> bool:
        """Whether another callback can run now."""
        return True

    def _next_task(self, timeout_sec: float | None, until: Future[Any] | None) -> Task | None:
        deadline = None if timeout_sec is None or timeout_sec < 0 else _now() + timeout_sec
        collected = False
        while True:
            self._raise_if_shut_down()
            if until is not None and until.done():
                return None
            while self._ready and self._has_capacity():
                task = self._ready.popleft()()
                if task is not None:
                    return task
            remaining = None if deadline is None else deadline - _now()
            if collected and remaining is not None and remaining <= 0:
                return None
            self._collect(remaining)
            collected = True

    def _raise_if_shut_down(self) -> None:
        if self._shutdown:
            raise ShutdownException
        if not self._context.ok():
            raise ExternalShutdownException

    def _collect(self, timeout_sec: float | None) -> None:
        """Wait until something is ready, and put it into the queue."""
        if self._entities_changed:
            self._entities_changed = False
            self._refresh()
        self._check_qos()
        busy = not self._has_capacity()
        if not busy:
            for _ in range(len(self._tasks)):
                task = self._tasks.popleft()
                self._ready.append(lambda task=task: task)  # type: ignore[misc]
            for entity in self._entities:
                if entity.is_ready and entity.callback_group.can_execute(entity):
                    self._ready.append(lambda entity=entity: self._claim(entity))  # type: ignore[misc]
        timeout_ns = 0 if self._ready and not busy else self._wait_ns(timeout_sec, busy)
        for entity in self._waits.wait(timeout_ns, listen=not busy):
            self._ready.append(lambda entity=entity: self._claim(entity))  # type: ignore[misc]

    def _wait_ns(self, timeout_sec: float | None, busy: bool) -> int:
        wait = _MAX_WAIT_NS if timeout_sec is None else max(0, int(timeout_sec * 1e9))
        wait = min(wait, _MAX_WAIT_NS)
        if self._tasks and not busy:
            return 0
        for entity in self._entities:
            # A timer whose group is busy is looked at again when the group ends its turn.
            if isinstance(entity, Timer) and entity.callback_group.can_execute(entity):
                remaining = entity.real_time_until_next_call()
                if remaining is not None:
                    wait = min(wait, remaining)
        return wait

    def _check_qos(self) -> None:
        now = _now()
        if now >= self._next_qos_check:
            self._next_qos_check = now + QOS_CHECK_PERIOD_S
            for node in self.get_nodes():
                node.check_qos()

    def _refresh(self) -> None:
        with self._lock:
            nodes = list(self._nodes)
        self._entities = [entity for node in nodes for entity in node.entities()]
        self._waits.set_entities(self._entities)

    def _claim(self, entity: Entity) -> Task | None:
        """The entity's next callback as a task, where its group lets it run."""
        group = entity.callback_group
        if not group.beginning_execution(entity):
            self._waits.park(entity)
            return None
        try:
            work = entity.take()
        except BaseException:
            group.ending_execution(entity)
            raise
        if work is None:
            group.ending_execution(entity)
            return None
        return Task(work.callback, work.args, None, self, lambda: self._release(entity))

    def _release(self, entity: Entity) -> None:
        entity.callback_group.ending_execution(entity)
        self._after_release()

    def _after_release(self) -> None:
        """A group is free again: look at what was parked for it."""


class SingleThreadedExecutor(Executor):
    """Runs every callback in the thread that spins."""


class MultiThreadedExecutor(Executor):
    """Runs callbacks in a pool of threads, as many at a time as their groups allow."""

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        if num_threads is None:
            num_threads = max(2, os.cpu_count() or 1)
        if num_threads < 1:
            raise ValueError(f"num_threads is {num_threads}, expected at least 1")
        self._num_threads = num_threads
        self._running = 0
        self._running_changed = threading.Condition()
        self._failures: deque[BaseException] = deque()
        self._pool = ThreadPoolExecutor(num_threads, thread_name_prefix="rclpy executor")

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop spinning and let go of the nodes; callbacks that run are waited for.

        Returns:
            Whether they finished in time.
        """
        with self._running_changed:
            self._shutdown = True
        super().shutdown(timeout_sec)
        with self._running_changed:
            own = 1 if threading.current_thread().name.startswith("rclpy executor") else 0
            finished = self._running_changed.wait_for(lambda: self._running <= own, timeout_sec)
        self._pool.shutdown(wait=finished and not own)
        return finished

    def _execute(self, task: Task) -> None:
        with self._running_changed:
            self._running += 1
        self._pool.submit(self._run, task)
        self._raise_failure()

    def _run(self, task: Task) -> None:
        try:
            task()
            if task.done() and (error := task.exception()) is not None:
                self._failures.append(error)
        except BaseException as error:
            self._failures.append(error)
        finally:
            with self._running_changed:
                self._running -= 1
                self._running_changed.notify_all()
            self.wake()

    def _raise_failure(self) -> None:
        if self._failures:
            raise self._failures.popleft()

    def _raise_if_shut_down(self) -> None:
        self._raise_failure()
        super()._raise_if_shut_down()

    def _has_capacity(self) -> bool:
        # No queue in front of the pool: a sample would grow old in it.
        return self._running < self._num_threads

    def _after_release(self) -> None:
        self.wake()


class _Waits:
    """The executor's wait set: which entities are attached, parked or gone."""

    def __init__(self, context: Context) -> None:
        self._context = weakref.ref(context)
        self._lock = threading.Lock()
        self._wait_set: WaitSet | None = None
        self._tokens = itertools.count(WaitSet.WAKE_TOKEN + 1)
        self._attached: dict[Entity, int] = {}
        self._by_token: dict[int, Entity] = {}
        self._parked: set[Entity] = set()
        self._closed = False
        self._woken = False

    def wake(self) -> None:
        with self._lock:
            if self._wait_set is not None:
                self._wait_set.wake()
            else:
                self._woken = True  # before the first wait

    def set_entities(self, entities: list[Entity]) -> None:
        wanted = {entity for entity in entities if entity.reader is not None}
        for entity in list(self._attached):
            if entity not in wanted:
                self._detach(entity)
        self._parked &= wanted
        for entity in wanted - self._attached.keys() - self._parked:
            self._attach(entity)

    def park(self, entity: Entity) -> None:
        """Do not wait for an entity until its group is free."""
        if entity in self._attached:
            self._detach(entity)
            self._parked.add(entity)

    def wait(self, timeout_ns: int, *, listen: bool) -> list[Entity]:
        """The entities that are ready within the time.

        With listen false, only :meth:`wake` ends the wait: nothing could be run now.
        """
        if listen:
            for entity in [e for e in self._parked if e.callback_group.can_execute(e)]:
                self._parked.discard(entity)
                self._attach(entity)
        else:
            for entity in list(self._attached):
                self.park(entity)
        wait_set = self._open()
        if self._woken:
            self._woken = False
            timeout_ns = 0
        return [self._by_token[t] for t in wait_set.wait(timeout_ns) if t in self._by_token]

    def close(self) -> None:
        with self._lock:
            wait_set, self._wait_set = self._wait_set, None
            self._closed = True
        context = self._context()
        if wait_set is not None and context is not None and context.ok():
            context.participant.close_wait_set(wait_set)

    def _open(self) -> WaitSet:
        wait_set = self._wait_set
        if wait_set is None or wait_set.closed:
            context = self._context()
            if context is None or self._closed:
                raise ShutdownException
            wait_set = context.participant.create_wait_set()
            with self._lock:
                self._wait_set = wait_set
        return wait_set

    def _attach(self, entity: Entity) -> None:
        reader = entity.reader
        if reader is None or reader.closed:
            return
        token = next(self._tokens)
        self._attached[entity] = token
        self._by_token[token] = entity
        self._open().attach(reader.condition, token)

    def _detach(self, entity: Entity) -> None:
        token = self._attached.pop(entity)
        del self._by_token[token]
        self._open().detach(token)


def _now() -> float:
    return time.monotonic()
