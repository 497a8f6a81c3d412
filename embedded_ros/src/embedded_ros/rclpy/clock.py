# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clocks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from .clock_type import ClockType
from .duration import NANOSECONDS_PER_SECOND, Duration
from .time import Time

__all__ = ["Clock", "ClockType", "ROSClock"]


class Clock:
    """A clock of some type; made with ROS_TIME it is a :class:`ROSClock`."""

    def __new__(cls, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> Clock:  # noqa: D102
        if not isinstance(clock_type, ClockType):
            raise TypeError("Clock type must be a ClockType enum")
        return super().__new__(ROSClock if clock_type is ClockType.ROS_TIME else cls)

    def __init__(self, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> None:
        self._clock_type = clock_type

    @property
    def clock_type(self) -> ClockType:
        """What the clock follows."""
        return self._clock_type

    def now(self) -> Time:
        """The time now."""
        return Time(nanoseconds=self.nanoseconds(), clock_type=self._clock_type)

    def nanoseconds(self) -> int:
        """The time now in nanoseconds, without an object around it."""
        if self._clock_type is ClockType.STEADY_TIME:
            return time.monotonic_ns()
        return time.time_ns()

    @property
    def is_simulated(self) -> bool:
        """Whether time is set from outside instead of passing by itself."""
        return False

    def add_listener(self, listener: Callable[[], None]) -> None:
        """Call this whenever simulated time is set or switched on or off."""

    def remove_listener(self, listener: Callable[[], None]) -> None:
        """Call it no more."""

    def sleep_until(self, until: Time, context: Any = None) -> bool:
        """Sleep until a time on this clock.

        Returns:
            Whether the time was reached; False where the context was shut down before.

        Raises:
            ValueError: The time is another clock's.
        """
        if until.clock_type != self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        from .utilities import get_default_context

        context = context or get_default_context()
        changed = threading.Event()
        self.add_listener(changed.set)
        context.on_shutdown(changed.set)
        try:
            while context.ok():
                remaining = until.nanoseconds - self.nanoseconds()
                if remaining <= 0:
                    return True
                changed.wait(None if self.is_simulated else remaining / NANOSECONDS_PER_SECOND)
                changed.clear()
            return False
        finally:
            self.remove_listener(changed.set)
            context.remove_on_shutdown(changed.set)

    def sleep_for(self, rel_time: Duration, context: Any = None) -> bool:
        """Sleep for a duration on this clock; returns as :meth:`sleep_until`."""
        return self.sleep_until(self.now() + rel_time, context)

    def create_jump_callback(self, *args: object, **kwargs: object) -> None:
        """Not provided."""
        raise NotImplementedError("clock jump callbacks are not part of embedded_ros")

    def __repr__(self) -> str:
        return f"Clock(clock_type={self._clock_type.name})"


class ROSClock(Clock):
    """ROS time: the system's, or simulated while an override is active."""

    def __new__(cls, *, clock_type: ClockType = ClockType.ROS_TIME) -> ROSClock:  # noqa: D102
        clock = super().__new__(cls, clock_type=ClockType.ROS_TIME)
        assert isinstance(clock, ROSClock)
        return clock

    def __init__(self, *, clock_type: ClockType = ClockType.ROS_TIME) -> None:
        super().__init__(clock_type=ClockType.ROS_TIME)
        self._override_ns: int | None = None
        self._lock = threading.Lock()
        self._listeners: list[Callable[[], None]] = []

    @property
    def ros_time_is_active(self) -> bool:
        """Whether time is simulated."""
        return self._override_ns is not None

    @property
    def is_simulated(self) -> bool:
        """Whether time is simulated."""
        return self._override_ns is not None

    def nanoseconds(self) -> int:
        """The time now in nanoseconds; 0 while simulated and not yet told."""
        override = self._override_ns
        return time.time_ns() if override is None else override

    def set_ros_time_override(self, time: Time) -> None:
        """Set simulated time; raises TypeError for anything but a Time."""
        if not isinstance(time, Time):
            raise TypeError("Time must be specified as rclpy.time.Time")
        self.set_override(time.nanoseconds)

    def set_override(self, nanoseconds: int | None) -> None:
        """Set simulated time in nanoseconds, or end simulation with None."""
        self._override_ns = nanoseconds
        with self._lock:
            listeners = list(self._listeners)
        for listener in listeners:
            listener()

    def add_listener(self, listener: Callable[[], None]) -> None:
        """Call this whenever simulated time is set or switched on or off."""
        with self._lock:
            self._listeners.append(listener)

    def remove_listener(self, listener: Callable[[], None]) -> None:
        """Call it no more."""
        with self._lock:
            if listener in self._listeners:
                self._listeners.remove(listener)
