# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node's process does first: a second goes by until everything is imported.

Nothing is imported here that takes time.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from importlib import import_module
from time import monotonic

PATIENCE_S = 1.0  # for threads that are told to end


def main_of(package: str) -> int:
    """Import a node and run it. Ctrl-C ends the process without a word until the node takes over.

    A thread that still works when the node has ended, as in the middle of a plan, ends with it.

    Args:
        package: Such as ``sim_node``.

    Returns:
        The exit code of its ``main``, or of an error that keeps it from being imported.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not in the background
        signal.signal(signal.SIGINT, leave_quietly)
    try:
        node = import_module(f"{package}.node")
    except Exception as error:
        return _refused(package, error)
    code: int = node.main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left that it could end sooner
    _leave_threads_behind(code)
    return code


def _refused(package: str, error: Exception) -> int:
    """Say why a node cannot be imported, such as for want of an extra; raise any other error."""
    from slap_ros.errors import SlapError

    if not isinstance(error, SlapError):
        raise error
    sys.stderr.write(f"{package}: {error}\n")
    return int(error.code)


def _leave_threads_behind(code: int) -> None:
    """End the process if threads still work that were told to end: Python would wait for them."""
    until_s = monotonic() + PATIENCE_S
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join(max(0.0, until_s - monotonic()))
            if thread.is_alive():
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)


def leave_quietly(_number: int, _frame: object) -> None:
    """End the process at once."""
    os._exit(0)  # nothing is open yet; SystemExit might end up in somebody's import
