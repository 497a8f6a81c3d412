# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The streams of a process that was started without them."""

from __future__ import annotations

import os
import sys


def open_closed_streams() -> None:
    """Give a process that was started without stdout or stderr something in their place.

    Python has None there, which every library trips over. What is written to a closed stdout
    fails as on a full disk; what is said to a closed stderr is for nobody.
    """
    if sys.stdout is None:
        sys.stdout = os.fdopen(os.open("/dev/full", os.O_WRONLY), "w", encoding="utf-8")
    if sys.stderr is None:
        sys.stderr = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
