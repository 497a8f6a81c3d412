# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A function by numpy that gives way to compiled code once that pays.

To load numba takes about a second, as long as two plans of Obstacle 2D by numpy. A command that
makes one plan is better off without it, an evaluation or a training is not. Both kinds of code give
the same bits, so that nothing but time depends on which one computes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Generic, TypeVar

Function = TypeVar("Function")

MANY_ROWS = 250_000  # that numpy computes before numba is loaded


class TieredFunction(Generic[Function]):
    """A function by numpy, and the same compiled, of which one is chosen for each call."""

    def __init__(self, plain: Function, load: Callable[[], Function]) -> None:
        """Begin with numpy.

        Args:
            plain: The function by numpy.
            load: Function that imports the compiled one; it may raise ImportError.
        """
        self._chosen, self._load = plain, load
        self._rows_left = MANY_ROWS

    def of(self, rows: int) -> Function:
        """The function to call now: compiled after many rows, or as soon as numba is loaded.

        Args:
            rows: Number of rows of the call, each of which takes some microseconds by numpy.
        """
        if self._rows_left > 0:
            self._rows_left -= rows
            if self._rows_left <= 0 or "numba" in sys.modules:
                self._rows_left = 0
                self._chosen = self.compiled()
        return self._chosen

    def compiled(self) -> Function:
        """The compiled function; the one by numpy where numba cannot be imported."""
        try:
            return self._load()
        except ImportError:
            return self._chosen
