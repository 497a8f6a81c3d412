# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where shortcuts lead in an abstract graph that is never made, as far as that can be proven."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.graph_beyond import EdgeBeyond
from slap_ros.planning.graph_depth import Depth, GraphDepth
from slap_ros.planning.largest_change import LargestChange
from slap_ros.planning.options import Option
from slap_ros.planning.problem import Problem
from slap_ros.planning.shortcut_source import ShortcutSource

ANY_DEPTH = 1 << 30  # of a node of which it is not known how deep it is


@dataclass(frozen=True)
class ShortcutEnd:
    """Where a shortcut leads.

    Args:
        abstract: Abstract state, a mask.
        depth: Number of operators after which the graph has that state, at most.
        option: The shortcut that leads there.
    """

    abstract: int
    depth: int
    option: Option


class ShortcutEnds:
    """The ends of shortcuts in the graph of one start and one goal."""

    def __init__(
        self, problem: Problem, shortcuts: ShortcutSource, start: int, depths: GraphDepth
    ) -> None:
        """Prove nothing yet.

        Args:
            problem: Model and operators.
            shortcuts: Where shortcut edges come from.
            start: Abstract state of the first node, a mask.
            depths: How deep nodes are.
        """
        self._shortcuts, self._start, self._depths = shortcuts, start, depths
        self._exact = problem.exact  # else more atoms may hold than those of a node
        self._largest = LargestChange(start, problem.grounds)

    def of(self, abstract: int, depth: int) -> Sequence[ShortcutEnd] | None:
        """All ends of shortcuts that begin in a node and may be on a way to the goal.

        Args:
            abstract: Abstract state of the node, a mask.
            depth: Number of operators after which the graph has it, at most.

        Returns:
            The ends, and maybe more; None where there may be others that are not known.
        """
        if not self._shortcuts.may_begin(abstract):
            return ()
        whole = self._whole(abstract, depth)
        if whole is None:
            return None
        ends = [end for end in whole if not self._leads_nowhere(end.abstract)]
        beyond = self._beyond(abstract)
        return [*ends, *(ShortcutEnd(e.abstract, ANY_DEPTH, e.make_option()) for e in beyond)]

    def _whole(self, abstract: int, depth: int) -> Sequence[ShortcutEnd] | None:
        """The ends in the graph; None where there may be others that are not known."""
        edges = self._shortcuts.whole_changes(abstract, self._largest) if self._exact else None
        if edges is None:
            return None
        ends = []
        for edge in edges:
            found = self._depths.of(edge.abstract)
            if found is None or not self._is_later_node(found, depth):
                return None  # others may be edges then
            ends.append(ShortcutEnd(edge.abstract, found.at_most, edge.make_option()))
        return ends

    def _is_later_node(self, found: Depth, depth: int) -> bool:
        """Whether the graph has a node for certain, and after another one.

        Args:
            found: Depth of the node.
            depth: Depth of the other one, at most.
        """
        return depth < found.at_least and found.at_most <= self._depths.goal_at_least

    def _beyond(self, abstract: int) -> Iterable[EdgeBeyond]:
        """Edges beyond the graph, but those of shortcuts that stay in it."""
        return self._shortcuts.beyond(AbstractGraph(0, [abstract], [0]), self._within)

    @cached_property
    def _within(self) -> frozenset[str]:
        """Shortcuts of which an edge of the graph is on a way to the goal: those found soon."""
        depths = self._depths
        if depths.layers is None:
            return frozenset()
        found: set[str] = set()
        for abstract, depth in [(self._start, 0), *((s, 1) for s in self._after(self._start))]:
            joined = depths.successors(abstract)  # by operators, so that no shortcut is an edge
            for end in self._whole(abstract, depth) or ():
                if end.abstract in joined or end.option.skill.name in found:
                    continue
                if depths.is_before_goal(end.abstract, end.depth):
                    found.add(end.option.skill.name)
        return frozenset(found)

    def _after(self, abstract: int) -> list[int]:
        """The abstract states after one operator in which shortcuts may begin, in order."""
        return sorted(filter(self._shortcuts.may_begin, self._depths.successors(abstract)))

    def _leads_nowhere(self, abstract: int) -> bool:
        """Whether no way from a node leads to the goal: it is deep, and there is still much to do.

        No shortcut may begin in it, nor after one operator more, which leads to the last layer.
        """
        depths, found = self._depths, self._depths.of(abstract)
        if depths.layers is None or found is None or found.at_least < depths.layers - 1:
            return False
        fewest = depths.fewest(abstract)
        if fewest is not None and found.at_least + fewest <= depths.layers:
            return False
        return not any(map(self._begins, (abstract, *self._after(abstract))))

    def _begins(self, abstract: int) -> bool:
        """Whether an edge of a shortcut may begin in an abstract state."""
        if not self._shortcuts.may_begin(abstract):
            return False
        whole = self._shortcuts.whole_changes(abstract, self._largest)
        return whole is None or bool(whole) or any(True for _ in self._beyond(abstract))
