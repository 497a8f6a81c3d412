# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C and SIGTERM, at whatever moment they come: one line, a code, and files that are whole.

While a command starts or ends there is nothing to clean up, and it ends at once. While it runs,
the signal is raised as an error, so that what is open is closed. Imports little: it is the first
thing that a command does.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

AGAIN_S = 0.05  # s, after which a signal is sent again that fell where nothing can be raised
IMPORTING = "<frozen importlib._bootstrap>"  # the file of the frames that import a module
WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


class TerminatedError(KeyboardInterrupt):
    """SIGTERM arrived. Whatever cleans up after Ctrl-C cleans up after it too."""


def exit_code(error: KeyboardInterrupt) -> int:
    """The exit code after a signal, as shells have it: 128 and the signal's number.

    Args:
        error: What the signal raised, or what was raised from it.
    """
    first = error.__cause__ or error
    return 128 + (signal.SIGTERM if isinstance(first, TerminatedError) else signal.SIGINT)


def forget_interrupt() -> None:
    """Let the process exit with its own code after a KeyboardInterrupt that was caught.

    CPython notes one that leaves a string passed to ``exec``, as a dataclass is made by, and never
    sees it caught: at the end of ``python -m`` it kills itself with SIGINT (``Py_RunMain``). The
    note is cleared whenever another string runs.
    """
    exec("")  # noqa: S102


def exit_at_once_on_signals() -> None:
    """Let a signal end the process with a line and a code, from now on.

    A signal that is ignored, as by ``nohup``, stays so. Once the interpreter is torn down, whose
    work is done by then, signals are ignored: with no handler left they would kill it, code and
    all.
    """
    atexit.register(_ignore_from_now_on)  # the first to be registered is the last to be called
    for number in WORDS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _exit_at_once)


@contextmanager
def signals_raised() -> Iterator[None]:
    """Let a signal raise an error in between, where it would end the process.

    Raises:
        KeyboardInterrupt: SIGINT arrived.
        TerminatedError: SIGTERM arrived.
    """
    ours = [number for number in WORDS if signal.getsignal(number) is _exit_at_once]
    for number in ours:
        signal.signal(number, raise_after_imports)
    try:
        with interrupts_in_destructors(_send_again):
            yield
    finally:
        for number in ours:
            signal.signal(number, _exit_at_once)


@contextmanager
def interrupts_in_destructors(handle: Callable[[KeyboardInterrupt], None]) -> Iterator[None]:
    """Have each KeyboardInterrupt handled that falls where nothing can be raised, not printed.

    Args:
        handle: Called with it, in the destructor or weak reference's callback that it fell into.
    """
    hook = sys.unraisablehook

    def sort(unraisable: sys.UnraisableHookArgs) -> None:
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            handle(unraisable.exc_value)
        else:
            hook(unraisable)

    sys.unraisablehook = sort
    try:
        yield
    finally:
        sys.unraisablehook = hook


@contextmanager
def signals_held_back() -> Iterator[None]:
    """Raise what arrives in between at its end; SIGINT never reaches processes started meanwhile.

    An error that is raised while a lock is taken, or a process started, leaves the lock taken and
    the process unknown. The terminal sends Ctrl-C to all processes; the parent ends its workers.

    Raises:
        KeyboardInterrupt: SIGINT arrived.
        TerminatedError: SIGTERM arrived.
    """
    arrived: list[int] = []
    main = threading.current_thread() is threading.main_thread()  # no other is ever interrupted
    ours = [number for number in WORDS if main and signal.getsignal(number) is raise_after_imports]
    for number in ours:
        signal.signal(number, lambda number, _: arrived.append(number))
    # The mask is inherited. It alone holds nothing back: another thread may take the signal, and
    # Python then raises its error in the main thread all the same.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number in ours:
            signal.signal(number, raise_after_imports)
        if arrived:
            signal.raise_signal(arrived[0])


class OneInterrupt:
    """A handler of SIGINT that raises it once at most, and never after it was closed.

    Ctrl-C is pressed twice, or arrives from the terminal and from a parent that passes it on. What
    ends by the first, or by itself, ends undisturbed: a file is closed, an arm brought to rest.
    """

    def __init__(self) -> None:
        self._closed = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise it, unless it was raised before.

        Args:
            number: The signal's.
            frame: What is executed.

        Raises:
            KeyboardInterrupt: It is the first one.
        """
        if self._closed:
            return
        self._closed = not _importing(frame)
        raise_after_imports(number, frame)

    def send_again(self, error: KeyboardInterrupt) -> None:
        """Have it raised a little later: it fell where nothing can be raised.

        Args:
            error: What was raised.
        """
        self._closed = False
        _send_again(error)

    def close(self) -> None:
        """Raise none from now on."""
        self._closed = True


@contextmanager
def interrupted_once() -> Iterator[OneInterrupt]:
    """Let SIGINT raise a KeyboardInterrupt in between once at most."""
    interrupt = OneInterrupt()
    if threading.current_thread() is not threading.main_thread():  # no other is ever interrupted
        yield interrupt
        return
    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield interrupt
    finally:
        interrupt.close()
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def _ignore_from_now_on() -> None:
    for number in WORDS:
        if signal.getsignal(number) is _exit_at_once:
            signal.signal(number, signal.SIG_IGN)


def _exit_at_once(number: int, _: FrameType | None) -> None:
    with suppress(OSError):  # a closed stderr
        os.write(2, f"{WORDS[signal.Signals(number)]}\n".encode())
    os._exit(128 + number)


def raise_after_imports(number: int, frame: FrameType | None) -> None:
    """Raise a signal's error; later, where a module is being imported.

    A compiled one that imports others prints what is raised meanwhile and goes on, or drops it.

    Args:
        number: The signal's.
        frame: What is executed.

    Raises:
        KeyboardInterrupt: It is SIGINT.
        TerminatedError: It is SIGTERM.
    """
    error = TerminatedError() if number == signal.SIGTERM else KeyboardInterrupt()
    if not _importing(frame):
        raise error
    _send_again(error)


def _importing(frame: FrameType | None) -> bool:
    """Whether a module is being imported."""
    while frame is not None:
        if frame.f_code.co_filename == IMPORTING:
            return True
        frame = frame.f_back
    return False


def _send_again(error: KeyboardInterrupt) -> None:
    """Deliver a signal once more, a little later, that arrived where nothing can be raised."""
    number = signal.SIGTERM if isinstance(error, TerminatedError) else signal.SIGINT
    timer = threading.Timer(AGAIN_S, os.kill, (os.getpid(), number))
    timer.daemon = True
    timer.start()
