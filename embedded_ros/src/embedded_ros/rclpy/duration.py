# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A difference between times."""

from __future__ import annotations

from typing import Any

from embedded_ros.types import message_class

NANOSECONDS_PER_SECOND = 1_000_000_000
_MAX_NANOSECONDS = 2**63


class Duration:
    """A signed difference between times, to the nanosecond."""

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        total = int(seconds * NANOSECONDS_PER_SECOND) + int(nanoseconds)
        if not -_MAX_NANOSECONDS <= total < _MAX_NANOSECONDS:
            raise OverflowError("total nanoseconds value does not fit into a signed 64 bit integer")
        self._nanoseconds = total

    @property
    def nanoseconds(self) -> int:
        """The duration in nanoseconds."""
        return self._nanoseconds

    def to_msg(self) -> Any:
        """As a builtin_interfaces/msg/Duration."""
        seconds, nanoseconds = divmod(self._nanoseconds, NANOSECONDS_PER_SECOND)
        cls: Any = message_class("builtin_interfaces/msg/Duration")
        return cls(sec=seconds, nanosec=nanoseconds)

    @classmethod
    def from_msg(cls, msg: Any) -> Duration:
        """Of a builtin_interfaces/msg/Duration; raises TypeError for anything else."""
        expected: Any = message_class("builtin_interfaces/msg/Duration")
        if not isinstance(msg, expected):
            raise TypeError("Must pass a builtin_interfaces.msg.Duration object")
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec)

    def __add__(self, other: Duration) -> Duration:
        if not isinstance(other, Duration):
            return NotImplemented
        return Duration(nanoseconds=self._nanoseconds + other._nanoseconds)

    def __sub__(self, other: Duration) -> Duration:
        if not isinstance(other, Duration):
            return NotImplemented
        return Duration(nanoseconds=self._nanoseconds - other._nanoseconds)

    def __mul__(self, factor: float) -> Duration:
        if not isinstance(factor, int | float):
            return NotImplemented
        return Duration(nanoseconds=int(self._nanoseconds * factor))

    def __neg__(self) -> Duration:
        return Duration(nanoseconds=-self._nanoseconds)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds == other._nanoseconds

    def __lt__(self, other: Duration) -> bool:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds < other._nanoseconds

    def __le__(self, other: Duration) -> bool:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds <= other._nanoseconds

    def __gt__(self, other: Duration) -> bool:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds > other._nanoseconds

    def __ge__(self, other: Duration) -> bool:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._nanoseconds >= other._nanoseconds

    def __hash__(self) -> int:
        return hash(self._nanoseconds)

    def __repr__(self) -> str:
        return f"Duration(nanoseconds={self._nanoseconds})"


class _Infinite(Duration):
    """Longer than any other duration: DDS's infinity."""


Infinite = _Infinite(nanoseconds=_MAX_NANOSECONDS - 1)
