# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Loggers: to the console in rcl's default format, and to ``/rosout``.

Formats of RCUTILS_CONSOLE_OUTPUT_FORMAT are not supported.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

NANOSECONDS_PER_SECOND = 1_000_000_000


class LoggingSeverity(IntEnum):
    """How serious a message is."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


@dataclass(frozen=True, slots=True)
class Record:
    """A logged message."""

    stamp_ns: int  # since the epoch
    severity: LoggingSeverity
    name: str
    message: str
    file: str
    function: str
    line: int


@dataclass(slots=True)
class _CallSite:
    """What ``once``, ``skip_first`` and ``throttle_duration_sec`` remember of a line of code."""

    count: int = 0
    last_ns: int | None = None


@dataclass(slots=True)
class _State:
    default_level: LoggingSeverity = LoggingSeverity.INFO
    levels: dict[str, LoggingSeverity] = field(default_factory=dict)
    sites: dict[tuple[str, int, str], _CallSite] = field(default_factory=dict)
    sinks: dict[str, Callable[[Record], None]] = field(default_factory=dict)  # by logger name
    lock: threading.Lock = field(default_factory=threading.Lock)


_state = _State()


class RcutilsLogger:
    """A named logger."""

    def __init__(self, name: str = "") -> None:
        self.name = name

    def get_child(self, name: str) -> RcutilsLogger:
        """The logger below this one; raises ValueError for an empty name."""
        if not name:
            raise ValueError("Need to provide a non-empty name.")
        return RcutilsLogger(f"{self.name}.{name}" if self.name else name)

    def set_level(self, level: LoggingSeverity | int) -> None:
        """Log this severity and above, here and below where nothing else is set."""
        set_logger_level(self.name, level)

    def get_effective_level(self) -> LoggingSeverity:
        """The severity from which on messages are logged."""
        return get_logger_effective_level(self.name)

    def is_enabled_for(self, severity: LoggingSeverity | int) -> bool:
        """Whether a message of this severity would be logged."""
        return severity >= self.get_effective_level()

    def log(self, message: object, severity: LoggingSeverity | int, **kwargs: Any) -> bool:
        """Log a message.

        Args:
            message: The message; anything but a string is converted.
            severity: How serious it is.
            **kwargs: ``once=True``, ``skip_first=True``, ``throttle_duration_sec=seconds`` with
                optionally ``throttle_time_source_type=clock``; remembered by line of code.

        Returns:
            Whether it was logged.

        Raises:
            TypeError: A keyword is unknown.
        """
        severity = LoggingSeverity(severity)
        name = kwargs.pop("name", self.name)
        if severity < get_logger_effective_level(name):
            return False
        frame = sys._getframe(1)
        while frame.f_back is not None and frame.f_code.co_filename == __file__:
            frame = frame.f_back
        code = frame.f_code
        if kwargs and not _passes(
            _site(code.co_filename, frame.f_lineno, name), **_checked(kwargs)
        ):
            return False
        _emit(
            Record(
                time.time_ns(),
                severity,
                name,
                str(message),
                code.co_filename,
                code.co_name,
                frame.f_lineno,
            )
        )
        return True

    def debug(self, message: object, **kwargs: Any) -> bool:
        """Log at DEBUG; arguments as for :meth:`log`."""
        return self.log(message, LoggingSeverity.DEBUG, **kwargs)

    def info(self, message: object, **kwargs: Any) -> bool:
        """Log at INFO; arguments as for :meth:`log`."""
        return self.log(message, LoggingSeverity.INFO, **kwargs)

    def warning(self, message: object, **kwargs: Any) -> bool:
        """Log at WARN; arguments as for :meth:`log`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def warn(self, message: object, **kwargs: Any) -> bool:
        """Log at WARN; arguments as for :meth:`log`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def error(self, message: object, **kwargs: Any) -> bool:
        """Log at ERROR; arguments as for :meth:`log`."""
        return self.log(message, LoggingSeverity.ERROR, **kwargs)

    def fatal(self, message: object, **kwargs: Any) -> bool:
        """Log at FATAL; arguments as for :meth:`log`."""
        return self.log(message, LoggingSeverity.FATAL, **kwargs)


def get_logger(name: str) -> RcutilsLogger:
    """The logger of a name."""
    return RcutilsLogger(name)


def set_logger_level(name: str, level: LoggingSeverity | int, detailed_error: bool = False) -> None:
    """Log this severity and above under a name; "" sets the default."""
    with _state.lock:
        if name:
            _state.levels[name] = LoggingSeverity(level)
        else:
            _state.default_level = LoggingSeverity(level)


def get_logger_level(name: str) -> LoggingSeverity:
    """The level set for exactly this name, UNSET for none."""
    return _state.levels.get(name, LoggingSeverity.UNSET) if name else _state.default_level


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """The level of a name, its own or its closest ancestor's."""
    levels = _state.levels
    while name and levels:
        level = levels.get(name)
        if level:
            return level
        name = name.rpartition(".")[0]
    return _state.default_level


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """The severity of a name, in any case; raises ValueError for an unknown one."""
    name = log_severity.upper()
    name = "WARN" if name == "WARNING" else name
    if name not in LoggingSeverity.__members__:
        raise ValueError(
            f"log level {log_severity!r} is not one of DEBUG, INFO, WARN, ERROR, FATAL"
        )
    return LoggingSeverity[name]


def get_logging_directory() -> str:
    """Not provided: there are no log files."""
    raise NotImplementedError("embedded_ros writes no log files")


def initialize() -> None:
    """Nothing to prepare."""


def shutdown() -> None:
    """Nothing to clean up."""


def clear_config() -> None:
    """Forget every level that was set."""
    with _state.lock:
        _state.levels.clear()
        _state.default_level = LoggingSeverity.INFO


def apply_levels(levels: Iterable[tuple[str, str]]) -> None:
    """Apply ``--log-level`` arguments: logger (or "") and level.

    Raises:
        ValueError: A level is unknown.
    """
    for name, level in levels:
        set_logger_level(name, get_logging_severity_from_string(level))


def add_sink(name: str, sink: Callable[[Record], None]) -> None:
    """Hand records of this logger, and of those below it, to a function as well."""
    with _state.lock:
        _state.sinks[name] = sink


def remove_sink(name: str) -> None:
    """End what :meth:`add_sink` began."""
    with _state.lock:
        _state.sinks.pop(name, None)


_FILTER_KEYWORDS = frozenset(
    {"once", "skip_first", "throttle_duration_sec", "throttle_time_source_type"}
)


def _checked(kwargs: dict[str, Any]) -> dict[str, Any]:
    unknown = kwargs.keys() - _FILTER_KEYWORDS
    if unknown:
        raise TypeError(f"unknown keyword(s) for logging: {', '.join(sorted(unknown))}")
    return kwargs


def _site(file: str, line: int, name: str) -> _CallSite:
    with _state.lock:
        return _state.sites.setdefault((file, line, name), _CallSite())


def _passes(
    site: _CallSite,
    *,
    once: bool = False,
    skip_first: bool = False,
    throttle_duration_sec: float | None = None,
    throttle_time_source_type: Any = None,
) -> bool:
    site.count += 1
    if once and site.count > 1:
        return False
    if skip_first and site.count == 1:
        return False
    if throttle_duration_sec is not None:
        clock = throttle_time_source_type
        now = clock.now().nanoseconds if clock is not None else time.monotonic_ns()
        period = throttle_duration_sec * NANOSECONDS_PER_SECOND
        if site.last_ns is not None and 0 <= now - site.last_ns < period:
            return False
        site.last_ns = now
    return True


def _emit(record: Record) -> None:
    seconds, nanoseconds = divmod(record.stamp_ns, NANOSECONDS_PER_SECOND)
    stream = sys.stdout if os.environ.get("RCUTILS_LOGGING_USE_STDOUT") == "1" else sys.stderr
    stream.write(
        f"[{record.severity.name}] [{seconds}.{nanoseconds:09d}] [{record.name}]: "
        f"{record.message}\n"
    )
    stream.flush()
    name = record.name
    sinks = _state.sinks
    while name and sinks:
        sink = sinks.get(name)
        if sink is not None:
            sink(record)
            return
        name = name.rpartition(".")[0]
