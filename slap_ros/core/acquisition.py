# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a domain offers to those who acquire its skills, and to those who show how it is solved."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from slap_ros.core.skill import Policy
from slap_ros.geometry.pose import Vector
from slap_ros.relational import LiftedOperator, Object, RewardTemplate, State
from slap_ros.relational.state import Array

# (state, an operator's objects) to what brings the hand to where its skill begins: 0.04 m from
# the object or placement that the last of the objects names (LG-SAIL §5.1). The policy gives None
# once the hand is there.
Approach = Callable[[State, tuple[Object, ...]], Policy]

# (state, an operator's objects) to a closed loop that does what the operator says, knowing all of
# the state. It shows that a task can be solved; no plan ever uses it as a skill.
Script = Callable[[State, tuple[Object, ...]], Policy]

# (state, parameters) to a closed loop that ends by itself and knows nothing of objects.
Primitive = Callable[[State, Array], Policy]


@dataclass(frozen=True)
class Primitives:
    """Movements with parameters, which some learners of whole tasks choose from instead of skills.

    Each takes as many parameters as it has of the same ones, the first three of which are a
    position in the base's frame, m. A learner says where it is relative to what the plan's present
    operator acts on.

    Args:
        policies: Movements by name.
        sizes: How many of the parameters each movement takes, by name: none, or three at least.
        low: Least value of each parameter, shape (parameters,).
        high: Largest value of each parameter, shape (parameters,).
        target_of: Function from a state and an operator's objects to the position of the one that
            is acted on, m.
    """

    policies: Mapping[str, Primitive]
    sizes: Mapping[str, int]
    low: Array
    high: Array
    target_of: Callable[[State, tuple[Object, ...]], Vector]


@dataclass(frozen=True)
class SideApproach:
    """A way of going near an object, from one side.

    Args:
        policy: Policy that brings the hand to 0.04 m before the object; None once it is there, or
            gives up.
        onwards: Robot's action that moves the hand on towards the object at full speed, shape
            (axes,).
        side: Name of the side, in the object's own frame where it has one; empty for none.
    """

    policy: Policy
    onwards: Array
    side: str = ""


# (state, object) to ways of going near it, from each side that the hand can be at.
Sides = Callable[[State, Object], tuple[SideApproach, ...]]


def no_sides(state: State, obj: Object) -> tuple[SideApproach, ...]:
    """No way of going near an object is known."""
    del state, obj
    return ()


@dataclass(frozen=True)
class Acquisition:
    """What skills are acquired with, where none are given.

    Args:
        approach: Brings the hand to where a skill begins; a function of its arguments.
        operators: Written by hand, what LEAGUE starts from.
        rewards: Written by hand, by operator name.
        scripts: Scripts of the demonstrator, by operator name.
        horizon: Environment steps of a skill, approach not counted.
        primitives: Movements with parameters, for learners that choose from these; None for none.
        sides: Ways of going near an object, for those who look for shortcuts.
    """

    approach: Approach
    operators: tuple[LiftedOperator, ...] = ()
    rewards: Mapping[str, RewardTemplate] = field(default_factory=dict)
    scripts: Mapping[str, Script] = field(default_factory=dict)
    horizon: int = 50
    primitives: Primitives | None = None
    sides: Sides = no_sides
