# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a search over abstract states remembers the way to each of them."""

from __future__ import annotations

from collections.abc import Mapping

Arrivals = Mapping[int, tuple[int, int]]  # by state: the state before it, and the operator's index


def trace(arrivals: Arrivals, start: int, state: int) -> list[int]:
    """The operators on the way from the start to a state, by index.

    Args:
        arrivals: Latest step to each state that was reached.
        start: Abstract state to start from, a mask.
        state: Abstract state where the way ends, a mask.
    """
    sequence = []
    while state != start:
        state, index = arrivals[state]
        sequence.append(index)
    return sequence[::-1]
