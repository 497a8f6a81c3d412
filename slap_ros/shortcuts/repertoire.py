# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A library's shortcuts in one task: which pairs of abstract states they may join."""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.core import Domain
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import State
from slap_ros.shortcuts.reach import Reach
from slap_ros.shortcuts.shortcut import DEFAULT, GroundShortcut, Rehearsal, Sampling, Shortcut
from slap_ros.shortcuts.sight import Sight, learner_interface
from slap_ros.shortcuts.signature import Change, concerned


class Repertoire:
    """Shortcuts over the objects of a task. One rehearses in a world of its own."""

    def __init__(
        self,
        domain: Domain,
        shortcuts: Sequence[Shortcut],
        initial: State,
        sampling: Sampling = DEFAULT,
    ) -> None:
        self.shortcuts = tuple(shortcuts)
        self._domain = domain
        self._space = domain.atom_space(initial)
        self._rehearsal = Rehearsal(domain, initial, sampling)
        self._reach = [
            Reach(s.signature, self._space, learner_interface(domain).grasping)
            for s in self.shortcuts
        ]
        self._sights: dict[tuple[str, Change], Sight] = {}

    def edges(self, graph: AbstractGraph) -> list[Edge]:
        """An edge for each pair of nodes that no option joins and a shortcut might (Alg. 2)."""
        joined = {(edge.source, edge.target) for edge in graph.edges}
        found = []
        for shortcut, reach in zip(self.shortcuts, self._reach, strict=True):
            for i, j in reach.pairs(graph.nodes):
                if (i, j) not in joined:
                    change = Change.between(graph.nodes[i], graph.nodes[j])
                    found.append(Edge(i, j, self._option(shortcut, change)))
        return found

    def option(self, name: str, source: int, target: int, attempt: int = 0) -> Option | None:
        """The shortcut of that name from an abstract state to another; None if it does not fit.

        ``attempt``: which of its attempts, the shortest first.
        """
        change = Change.between(source, target)
        for shortcut in self.shortcuts:
            if shortcut.name == name and shortcut.signature.suits(change, self._space):
                return self._option(shortcut, change, attempt)
        return None

    def _option(self, shortcut: Shortcut, change: Change, attempt: int = 0) -> Option:
        key = (shortcut.name, change)
        if key not in self._sights:
            self._sights[key] = Sight(self._domain, self._space, shortcut.signature, change)
        sight = self._sights[key]
        return Option(
            OptionKind.SHORTCUT,
            GroundShortcut(shortcut, change, attempt, sight, self._rehearsal),
            concerned(change, self._space),
            accepts=sight.may_end,
            attempt=attempt,
            another=lambda: self._option(shortcut, change, attempt + 1),
            given_up=lambda: self._rehearsal.gave_up(shortcut),
        )
