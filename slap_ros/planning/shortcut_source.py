# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where planners get shortcuts from."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Protocol

from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.graph_beyond import EdgeBeyond
from slap_ros.planning.landmark_cut import RelaxedOperator

# From an abstract state, what may be added and what is left alone, all masks, to where all has
# changed that may; None where that is not known (LargestChange).
Largest = Callable[[int, int, int], int | None]


class ShortcutSource(Protocol):
    """Gives shortcut edges for an abstract graph."""

    def edges(self, graph: AbstractGraph) -> Sequence[Edge]:
        """Edges to be added to a graph."""
        ...

    def beyond(self, graph: AbstractGraph, within: Collection[str]) -> Sequence[EdgeBeyond]:
        """Edges to abstract states that a graph may not have.

        Args:
            graph: Where they begin.
            within: Names of the shortcuts that stay in it.
        """
        ...

    def relaxed(self) -> Sequence[RelaxedOperator]:
        """Each shortcut with all that it might add for any objects, as if it needed nothing."""
        ...

    def may_begin(self, abstract: int) -> bool:
        """Whether one of the shortcuts may begin in an abstract state, a mask."""
        ...

    def whole_changes(self, abstract: int, largest: Largest) -> Sequence[EdgeBeyond] | None:
        """The edges out of an abstract state in a graph that has the largest changes.

        Args:
            abstract: Abstract state in which shortcuts begin, a mask.
            largest: Function that gives the largest change of a shortcut; see :data:`Largest`.

        Returns:
            An edge at most for each shortcut, with the source 0; None where other changes may be
            edges as well.
        """
        ...

    def forget_failures_since_now(self) -> Callable[[], None]:
        """What makes later failures count no more, by which a shortcut is given up.

        Where one search has failed with a shortcut, another may try it elsewhere, and succeed.
        """
        ...
