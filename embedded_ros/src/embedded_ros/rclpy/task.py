# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Futures, and tasks that run functions and coroutines on an executor."""

from __future__ import annotations

import inspect
import threading
import weakref
from collections.abc import Callable, Coroutine, Generator
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from .executors import Executor

T = TypeVar("T")


class Future(Generic[T]):
    """The outcome of something not finished yet; every method is safe from any thread."""

    def __init__(self, *, executor: Executor | None = None) -> None:
        self._condition = threading.Condition()
        self._done = False
        self._cancelled = False
        self._result: T | None = None
        self._exception: Exception | None = None
        self._exception_fetched = False
        self._callbacks: list[Callable[[Any], Any]] = []
        self._wakeups: list[Callable[[Any], None]] = []
        self._executor: weakref.ref[Executor] | None = None
        if executor is not None:
            self._set_executor(executor)

    def __await__(self) -> Generator[Future[T], None, T | None]:
        while not self._done and not self._cancelled:
            yield self
        return self.result()

    def cancel(self) -> None:
        """Cancel it, where it is not done yet."""
        with self._condition:
            if self._done:
                return
            self._cancelled = True
        self._finish()

    def cancelled(self) -> bool:
        """Whether it was cancelled."""
        return self._cancelled

    def done(self) -> bool:
        """Whether there is a result or an exception."""
        return self._done

    def result(self) -> T | None:
        """The result, None while there is none; raises the exception where there is one."""
        if self._exception is not None:
            self._exception_fetched = True
            raise self._exception
        return self._result

    def exception(self) -> Exception | None:
        """The exception, or None."""
        self._exception_fetched = True
        return self._exception

    def set_result(self, result: T) -> None:
        """Finish with a result."""
        with self._condition:
            self._result = result
            self._done = True
            self._cancelled = False
        self._finish()

    def set_exception(self, exception: Exception) -> None:
        """Finish with an exception."""
        with self._condition:
            self._exception = exception
            self._exception_fetched = False
            self._done = True
            self._cancelled = False
        self._finish()

    def add_done_callback(self, callback: Callable[[Future[T]], Any]) -> None:
        """Call this with the future once it is done: on the executor where it has one."""
        with self._condition:
            if not self._done:
                self._callbacks.append(callback)
                return
        self._invoke(callback)

    def remove_done_callback(self, callback: Callable[[Future[T]], Any]) -> bool:
        """Drop a callback; returns whether it was there."""
        with self._condition:
            if callback in self._callbacks:
                self._callbacks.remove(callback)
                return True
            return False

    def wait(self, timeout_sec: float | None = None) -> bool:
        """Block this thread until it is done or cancelled; returns whether it is."""
        with self._condition:
            return self._condition.wait_for(lambda: self._done or self._cancelled, timeout_sec)

    def add_wakeup(self, wakeup: Callable[[Future[T]], None]) -> None:
        """Call this in the finishing thread; it must be quick. Executors use it to wake up."""
        with self._condition:
            if not self._done and not self._cancelled:
                self._wakeups.append(wakeup)
                return
        wakeup(self)

    def remove_wakeup(self, wakeup: Callable[[Future[T]], None]) -> None:
        """Drop a wakeup."""
        with self._condition:
            if wakeup in self._wakeups:
                self._wakeups.remove(wakeup)

    def _set_executor(self, executor: Executor) -> None:
        self._executor = weakref.ref(executor)

    def _finish(self) -> None:
        with self._condition:
            self._condition.notify_all()
            wakeups, self._wakeups = self._wakeups, []
            callbacks, self._callbacks = self._callbacks, []
        for wakeup in wakeups:
            wakeup(self)
        for callback in callbacks:
            self._invoke(callback)

    def _invoke(self, callback: Callable[[Future[T]], Any]) -> None:
        executor = self._executor() if self._executor is not None else None
        if executor is not None and not executor.is_shutdown:
            executor.create_task(callback, self)
        else:
            callback(self)

    def __repr__(self) -> str:
        state = "cancelled" if self._cancelled else "done" if self._done else "pending"
        return f"<{type(self).__name__} {state}>"


class Task(Future[Any]):
    """A function or coroutine that an executor runs, step by step."""

    def __init__(
        self,
        handler: Callable[..., Any] | Coroutine[Any, Any, Any],
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
        executor: Executor | None = None,
        finalizer: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(executor=executor)
        self._coroutine: Coroutine[Any, Any, Any] | None = None
        self._handler: Callable[..., Any] | None = None
        if inspect.iscoroutine(handler):
            self._coroutine = handler
        else:
            assert callable(handler)
            self._handler = handler
        self._args = args
        self._kwargs = kwargs or {}
        self._finalizer = finalizer
        self._running = threading.Lock()

    def executing(self) -> bool:
        """Whether some thread runs a step of it now."""
        return self._running.locked()

    def __call__(self) -> None:
        """Run one step: to the end, or to the next future that is awaited."""
        if self._done or self._cancelled or not self._running.acquire(blocking=False):
            self._drop_cancelled()
            return
        try:
            waiting_for = self._step()
        finally:
            self._running.release()
        if not self._done:
            self._suspend(waiting_for)

    def _step(self) -> object:
        try:
            if self._handler is not None:
                handler, self._handler = self._handler, None
                result = handler(*self._args, **self._kwargs)
                if not inspect.iscoroutine(result):
                    self._complete(result, None)
                    return None
                self._coroutine = result
            assert self._coroutine is not None
            return self._coroutine.send(None)
        except StopIteration as stop:
            self._complete(stop.value, None)
        except Exception as error:
            self._complete(None, error)
        except BaseException:
            # KeyboardInterrupt: the callback is over, its group must not stay locked.
            self._release()
            raise
        return None

    def _suspend(self, waiting_for: object) -> None:
        executor = self._executor() if self._executor is not None else None
        if executor is None:
            return
        if isinstance(waiting_for, Future):
            waiting_for.add_wakeup(lambda _: executor.resume(self))
        else:
            executor.resume(self)  # a bare yield: again at the next turn

    def _complete(self, result: object, error: Exception | None) -> None:
        self._coroutine = None
        self._release()
        if error is not None:
            self.set_exception(error)
        else:
            self.set_result(result)

    def _release(self) -> None:
        finalizer, self._finalizer = self._finalizer, None
        if finalizer is not None:
            finalizer()

    def _drop_cancelled(self) -> None:
        if self._cancelled and not self._done:
            coroutine, self._coroutine = self._coroutine, None
            if coroutine is not None:
                coroutine.close()
            self._release()

    def cancel(self) -> None:
        """Cancel it: its coroutine is closed at its next step."""
        super().cancel()
        executor = self._executor() if self._executor is not None else None
        if executor is not None and self._cancelled:
            executor.resume(self)
