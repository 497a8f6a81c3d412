# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Timers and rates."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ._entity import Entity, Work
from .clock import Clock
from .clock_type import ClockType
from .duration import NANOSECONDS_PER_SECOND
from .exceptions import ROSInterruptException, TimerCancelledError

if TYPE_CHECKING:
    from .callback_groups import CallbackGroup
    from .context import Context


class Timer(Entity):
    """Calls back periodically, by a clock that may be simulated."""

    def __init__(
        self,
        callback: Callable[..., Any] | None,
        callback_group: CallbackGroup,
        timer_period_ns: int,
        clock: Clock,
        *,
        context: Context | None = None,
        autostart: bool = True,
    ) -> None:
        if timer_period_ns < 0:
            raise ValueError(f"timer period must be non-negative, got {timer_period_ns} ns")
        super().__init__(callback_group)
        self.callback = callback
        self._clock = clock
        # A steady clock by default: a jump of the wall clock must not stop a robot's timers.
        self._wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._period_ns = int(timer_period_ns)
        self._canceled = not autostart
        self._lock = threading.Lock()
        self._last_ns = self._now_ns()
        self._next_ns = self._last_ns + self._period_ns
        clock.add_listener(self._on_time_set)
        self._simulated = clock.is_simulated

    @property
    def clock(self) -> Clock:
        """The clock it follows."""
        return self._clock

    @property
    def timer_period_ns(self) -> int:
        """The period in nanoseconds."""
        return self._period_ns

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        with self._lock:
            self._period_ns = int(value)
            self._next_ns = self._last_ns + self._period_ns
        self.wake_executor()

    @property
    def is_ready(self) -> bool:
        """Whether its next call is due."""
        return not self._canceled and self._now_ns() >= self._next_ns

    def is_canceled(self) -> bool:
        """Whether it was cancelled."""
        return self._canceled

    def cancel(self) -> None:
        """Call back no more, until reset."""
        self._canceled = True

    def reset(self) -> None:
        """Begin a new period now, also after cancelling."""
        with self._lock:
            self._canceled = False
            self._last_ns = self._now_ns()
            self._next_ns = self._last_ns + self._period_ns
        self.wake_executor()

    def time_since_last_call(self) -> int:
        """Nanoseconds since it last called back, or was made or reset."""
        return self._now_ns() - self._last_ns

    def time_until_next_call(self) -> int | None:
        """Nanoseconds until it next calls back, None where it is cancelled."""
        return None if self._canceled else max(0, self._next_ns - self._now_ns())

    def real_time_until_next_call(self) -> int | None:
        """As :meth:`time_until_next_call`, but None also where simulated time must pass."""
        return None if self._clock.is_simulated else self.time_until_next_call()

    def take(self) -> Work | None:
        """The callback, where it is due; the next call is one period after this one was due."""
        with self._lock:
            now = self._now_ns()
            if self._canceled or now < self._next_ns:
                return None
            self._last_ns = now
            self._next_ns += self._period_ns
            if self._next_ns < now:  # late by more than a period: those calls are left out
                missed = (now - self._next_ns) // self._period_ns + 1 if self._period_ns else 0
                self._next_ns = self._next_ns + missed * self._period_ns if missed else now
        return Work(self.callback or _nothing)

    def destroy(self) -> None:
        """Cancel it and detach it from its node."""
        self.cancel()
        self._clock.remove_listener(self._on_time_set)
        self.leave_node()

    def _now_ns(self) -> int:
        clock = self._clock
        if clock.clock_type is ClockType.SYSTEM_TIME or clock.is_simulated:
            return clock.nanoseconds()
        return self._wall.nanoseconds()

    def _on_time_set(self) -> None:
        with self._lock:
            if self._clock.is_simulated != self._simulated:
                self._simulated = self._clock.is_simulated
                self._last_ns = self._now_ns()
                self._next_ns = self._last_ns + self._period_ns
            elif self._now_ns() < self._last_ns:  # a bag or a simulation began again
                self._last_ns = self._now_ns()
                self._next_ns = self._last_ns + self._period_ns
        self.wake_executor()


class Rate:
    """Sleeps away the rest of a period; the node must be spun in another thread."""

    def __init__(self, timer: Timer, *, context: Context) -> None:
        self._timer = timer
        self._context = context
        self._ticked = threading.Event()
        self._destroyed = False
        timer.callback = self._ticked.set
        context.on_shutdown(self._ticked.set)

    def sleep(self) -> None:
        """Sleep until the timer's next call.

        Raises:
            ROSInterruptException: The context was shut down, or the rate destroyed.
            TimerCancelledError: The timer was cancelled.
        """
        if self._timer.is_canceled() and not self._destroyed:
            raise TimerCancelledError
        self._ticked.clear()
        if self._context.ok() and not self._destroyed:
            self._ticked.wait()
        if self._destroyed or not self._context.ok():
            raise ROSInterruptException

    def destroy(self) -> None:
        """End every sleep and cancel the timer."""
        self._destroyed = True
        self._timer.cancel()
        self._ticked.set()
        self._context.remove_on_shutdown(self._ticked.set)


def period_to_ns(period_sec: float) -> int:
    """Seconds to nanoseconds."""
    return int(float(period_sec) * NANOSECONDS_PER_SECOND)


def _nothing() -> None:
    pass
