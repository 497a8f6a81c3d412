# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node's process does first: a second goes by until everything is imported.

Nothing is imported here that takes time.
"""

from __future__ import annotations

import os
import signal
from importlib import import_module


def main_of(package: str) -> int:
    """Import a node and run it. Ctrl-C ends the process without a word until the node takes over.

    Args:
        package: Such as ``sim_node``.

    Returns:
        The exit code of its ``main``.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not in the background
        signal.signal(signal.SIGINT, leave_quietly)
    code: int = import_module(f"{package}.node").main()
    return code


def leave_quietly(_number: int, _frame: object) -> None:
    """End the process at once."""
    os._exit(0)  # nothing is open yet; SystemExit might end up in somebody's import
