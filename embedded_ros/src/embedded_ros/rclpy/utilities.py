# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The default context and the command line."""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence

from ._arguments import remove_ros_args as _remove_ros_args
from .context import Context

_lock = threading.Lock()
_default_context: Context | None = None


def get_default_context(*, shutting_down: bool = False) -> Context:
    """The context used where none is given."""
    global _default_context
    with _lock:
        if _default_context is None:
            _default_context = Context()
        return _default_context


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """The command line without what is between ``--ros-args`` and ``--``."""
    return _remove_ros_args(sys.argv if args is None else args)


def ok(*, context: Context | None = None) -> bool:
    """Whether the context is started and not shut down."""
    return (context or get_default_context()).ok()


def shutdown(*, context: Context | None = None) -> None:
    """Shut the context down; raises RuntimeError where it is not started."""
    (context or get_default_context()).shutdown()


def try_shutdown(*, context: Context | None = None) -> None:
    """Shut the context down, where not done yet."""
    (context or get_default_context()).try_shutdown()


def get_rmw_implementation_identifier() -> str:
    """The middleware whose wire conventions are spoken."""
    return "rmw_cyclonedds_cpp"


def timeout_sec_to_nsec(timeout_sec: float | None) -> int:
    """Seconds to nanoseconds; None and negative mean forever (-1)."""
    if timeout_sec is None or timeout_sec < 0:
        return -1
    return int(float(timeout_sec) * 1_000_000_000)
