# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM shut contexts down.

While the main thread waits inside CycloneDDS, Python runs no signal handler. The C part of
Python's signal handling does write to a file descriptor, though: a small thread reads it and
ends the waits, and the main thread then comes to its handler.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from enum import IntFlag
from types import FrameType
from typing import Any

from .context import live_contexts


class SignalHandlerOptions(IntFlag):
    """Which signals are handled."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


_Handler = Callable[[int, FrameType | None], Any] | int | None


class _Handlers:
    """The installed handlers, what they replaced, and the thread that wakes waits."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._replaced: dict[int, _Handler] = {}
        self._options = SignalHandlerOptions.NO
        self._pipe: tuple[int, int] | None = None
        self._replaced_fd = -1
        self._thread: threading.Thread | None = None

    @property
    def options(self) -> SignalHandlerOptions:
        return self._options

    def install(self, options: SignalHandlerOptions) -> None:
        with self._lock:
            if not options or threading.current_thread() is not threading.main_thread():
                return
            for number in (signal.SIGINT, signal.SIGTERM):
                wanted = options & SignalHandlerOptions[number.name]
                if wanted and number not in self._replaced:
                    self._replaced[number] = signal.signal(number, self._handle)
            self._options |= options
            self._start_thread()

    def uninstall(self) -> bool:
        with self._lock:
            if not self._replaced or threading.current_thread() is not threading.main_thread():
                return False
            for number, handler in self._replaced.items():
                if signal.getsignal(number) == self._handle:
                    signal.signal(number, handler if handler is not None else signal.SIG_DFL)
            self._replaced.clear()
            self._options = SignalHandlerOptions.NO
            self._stop_thread()
            return True

    def _handle(self, number: int, frame: FrameType | None) -> None:
        replaced = self._replaced.get(number)
        for context in live_contexts():
            context.shut_down_by_signal = True
            context.invalidate()
        # Python's own handler raises KeyboardInterrupt; one the application installed before
        # rclpy.init goes on being called.
        if callable(replaced):
            replaced(number, frame)

    def _start_thread(self) -> None:
        if self._pipe is not None:
            return
        read_end, write_end = os.pipe()
        os.set_blocking(write_end, False)
        self._pipe = (read_end, write_end)
        self._replaced_fd = signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
        self._thread = threading.Thread(
            target=_wake_on_signal, args=(read_end,), name="rclpy signals", daemon=True
        )
        self._thread.start()

    def _stop_thread(self) -> None:
        if self._pipe is None or self._thread is None:
            return
        read_end, write_end = self._pipe
        signal.set_wakeup_fd(self._replaced_fd)
        os.close(write_end)  # ends the thread
        self._thread.join()
        os.close(read_end)
        self._pipe = self._thread = None


def _wake_on_signal(read_end: int) -> None:
    while os.read(read_end, 1):
        for context in live_contexts():
            context.wake()


_handlers = _Handlers()


def install_signal_handlers(options: SignalHandlerOptions = SignalHandlerOptions.ALL) -> None:
    """Handle signals; does nothing in any but the main thread, where Python forbids it."""
    _handlers.install(options)


def uninstall_signal_handlers() -> bool:
    """Restore what was replaced; returns whether there was anything to restore."""
    return _handlers.uninstall()


def get_current_signal_handlers_options() -> SignalHandlerOptions:
    """Which signals are handled now."""
    return _handlers.options
