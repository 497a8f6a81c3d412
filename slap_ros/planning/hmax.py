# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An admissible estimate of how many operators it takes to reach a goal."""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.relational import GroundOperator


class HMaxHeuristic:
    """h_max with unit costs (Bonet and Geffner: Planning as heuristic search, AIJ 129, 2001).

    It is the number of layers until the goal holds if operators deleted nothing and all operators
    of a layer were applied at once: never more than the operators of a plan. Each abstract state
    is evaluated once.
    """

    def __init__(self, goal: int, operators: Sequence[GroundOperator]) -> None:
        """Start with an empty cache; ``goal`` is a mask of the atoms that must hold."""
        self._goal = goal
        self._operators = [(op.preconditions, op.add_effects) for op in operators]
        self._cache: dict[int, int | None] = {}

    def __call__(self, abstract: int) -> int | None:
        """At least so many operators from an abstract state; None where there is no plan."""
        if abstract not in self._cache:
            self._cache[abstract] = self._layers(abstract)
        return self._cache[abstract]

    def _layers(self, reached: int) -> int | None:
        layers, waiting = 0, self._operators
        while self._goal & ~reached:
            following, later = reached, []
            for preconditions, add_effects in waiting:
                if preconditions & ~reached:
                    later.append((preconditions, add_effects))
                else:
                    following |= add_effects
            if following == reached:
                return None
            reached, waiting, layers = following, later, layers + 1
        return layers
