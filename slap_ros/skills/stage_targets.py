# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a skill has done its stage of a plan: its effects, and nothing else disturbed.

LG-SAIL's reward pays for an operator's effects alone (Eq. 4), but its Algorithm 1 asks for all that
is expected, T(x, ω) ⊆ x'. Paid for effects alone, a hammer is put into its drawer by pushing that
shut, and the plan fails. So a skill is paid its 1 where the stage is done.
"""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain
from slap_ros.relational import (
    AtomSpace,
    Layout,
    LiftedOperator,
    Object,
    State,
    Target,
    ground_operator,
)
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.skills.groundings import GroundedStates


class StageTargets:
    """The targets of one operator's stages, from wherever they begin."""

    def __init__(self, domain: Domain, operator: LiftedOperator) -> None:
        self._domain, self._operator = domain, operator
        self._spaces: dict[Layout, AtomSpace] = {}
        self._targets: dict[tuple[Layout, tuple[Object, ...], bytes], Target] = {}

    def reached(self, states: GroundedStates, begun: Array, where: Bools) -> Bools:
        """Whether stages are done.

        Args:
            states: Present states, n of them.
            begun: States in which the stages began, shape (n, layout.size).
            where: Whether each stage is asked for, shape (n,).

        Returns:
            Shape (n,); not done where it is not asked for.
        """
        reached, layout = np.zeros(len(where), dtype=bool), states.state.layout
        asked = np.flatnonzero(where)
        if not asked.size:
            return reached
        space = self._space(layout, begun[asked[0]])
        abstract = space.abstract_each(State(layout, states.state.data[asked]))
        for i, now in zip(map(int, asked), abstract, strict=True):
            objects = tuple(column.objects[states.choice[i]] for column in states.columns)
            reached[i] = self._target(space, layout, objects, begun[i]).reached(now)
        return reached

    def _space(self, layout: Layout, row: Array) -> AtomSpace:
        """The atoms over the objects of a layout; no target requires static ones."""
        if layout not in self._spaces:
            self._spaces[layout] = self._domain.atom_space(State(layout, row))
        return self._spaces[layout]

    def _target(
        self, space: AtomSpace, layout: Layout, objects: tuple[Object, ...], row: Array
    ) -> Target:
        """The target of a stage.

        Args:
            space: Atoms of the task.
            layout: Layout of the objects that there are.
            objects: Objects that the operator is applied to.
            row: State in which the stage began, shape (layout.size,).
        """
        key = layout, objects, row.tobytes()
        if key not in self._targets:
            operator = ground_operator(self._operator, objects, space)
            self._targets[key] = Target.after(operator, space.abstract(State(layout, row)))
        return self._targets[key]
