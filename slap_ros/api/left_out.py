# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is said of parts of a library that cannot be used, and are left out."""

from __future__ import annotations

import sys
from collections.abc import Callable
from warnings import warn

Tell = Callable[[str], None]  # takes a sentence for people


def warn_caller(text: str) -> None:
    """Issue a Python warning, at the line that called something of slap_ros."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("slap_ros."):
        level, frame = level + 1, frame.f_back
    warn(text, stacklevel=level)
