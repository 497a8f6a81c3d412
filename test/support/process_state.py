# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the kernel says of a process that a test has started, and waiting for it."""

import re
import signal
import time
from pathlib import Path

LIMIT = 120.0  # s, far more than anything here takes


def wait_until(condition):
    end = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def handles_signals(pid):
    """Whether a process has begun to handle SIGTERM: before, it is the interpreter that starts."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    caught = int(re.search(r"SigCgt:\s*(\w+)", status)[1], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)
