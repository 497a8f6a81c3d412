# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is said of parts of a library that cannot be used, and are left out."""

from __future__ import annotations

from collections.abc import Callable
from warnings import warn

Tell = Callable[[str], None]  # takes a sentence for people


def warn_caller(text: str) -> None:
    """Issue a Python warning."""
    warn(text, stacklevel=3)
