# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The planning scene: what the arm keeps clear of and what it carries, as a domain says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from slap_ros.domains.tabletop.memory import memoized
from slap_ros.domains.tabletop.state_access import finger_of, grasp_of, held_body
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.motion import CollisionChecker
from slap_ros.relational import Object, State

# Distances in m that a held body keeps from others.
RELAXED = 0.02  # so far away it may be turned as one likes
CARRYING = 0.005  # while crossing
PLACING = -0.001  # while it is set down between others


@dataclass(frozen=True)
class PlanningScene:
    """The collision geometry of a domain's states.

    Args:
        solid: The boxes that things fill in a state, base frame, each with the object that it is
            a part of; one object may have several, and the held body's are left out by whoever
            asks.
        carried: Function from a state and a body to the box around the body, in the body's own
            frame, were it in the hand.
    """

    solid: Callable[[State], Iterable[tuple[Object, OrientedBox]]]
    carried: Callable[[State, Object], OrientedBox]

    def checker(
        self, state: State, touched: tuple[Object, ...] = (), held_margin: float = PLACING
    ) -> CollisionChecker:
        """The collision checker of a state.

        Args:
            state: Current state.
            touched: Objects that the arm, or what it holds, may touch.
            held_margin: Distance that a held body keeps from the rest, m.

        Returns:
            A checker with the held body in the hand and the fingers where they are.
        """
        return _checker(self, state, touched, held_margin)


@memoized
def _checker(
    scene: PlanningScene, state: State, touched: tuple[Object, ...], held_margin: float
) -> CollisionChecker:
    """See :meth:`PlanningScene.checker`: ways to several places on a table have the same."""
    held = held_body(state)
    obstacles = [
        box for thing, box in _solid(scene, state) if thing != held and thing not in touched
    ]
    return CollisionChecker(
        obstacles,
        held=None if held is None else scene.carried(state, held).at(grasp_of(state)),
        finger=finger_of(state),
        held_margin=held_margin,
    )


@memoized
def _solid(scene: PlanningScene, state: State) -> tuple[tuple[Object, OrientedBox], ...]:
    """The boxes that things fill in a state: its retreat, crossing and approach all ask."""
    return tuple(scene.solid(state))
