# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many operators it takes at least to reach a goal."""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.relational import GroundOperator


class HMax:
    """Layers until the goal holds if operators deleted nothing, and all of a layer ran at once.

    That is h_max with unit costs (Bonet, Geffner: Planning as heuristic search, AIJ 129, 2001): it
    never exceeds the operators that a plan has. Each abstract state is looked at once.
    """

    def __init__(self, goal: int, operators: Sequence[GroundOperator]) -> None:
        """``goal``: mask of atoms that must hold."""
        self._goal = goal
        self._operators = [(op.preconditions, op.add_effects) for op in operators]
        self._known: dict[int, int | None] = {}

    def __call__(self, abstract: int) -> int | None:
        """Operators from an abstract state at least; None where no plan leads to the goal."""
        if abstract not in self._known:
            self._known[abstract] = self._layers(abstract)
        return self._known[abstract]

    def _layers(self, reached: int) -> int | None:
        layers, waiting = 0, self._operators
        while self._goal & ~reached:
            following, later = reached, []
            for operator in waiting:
                if operator[0] & ~reached:
                    later.append(operator)
                else:
                    following |= operator[1]
            if following == reached:
                return None
            reached, waiting, layers = following, later, layers + 1
        return layers
