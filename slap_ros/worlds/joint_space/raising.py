# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An arm that would be inside a fixed body, raised until it is not."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from slap_ros.worlds.joint_space.arm import (
    HELD_DEPTH,
    Obstacle,
    Penetration,
    Posture,
    Surroundings,
)
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, MAX_STEP, vertical_jacobian

Configuration = tuple[float, ...]  # joint positions, rad

MAX_RAISES = 8  # times that the arm is raised so that it does not enter a fixed body
RAISE_CLEARANCE = 1e-4  # m, over where it just does not


def off_fixed_bodies(
    start: Configuration,
    goal: Configuration,
    arm_at: Callable[[Configuration], Posture],
    obstacles: Surroundings[Obstacle],
    highest: float,
    held_depth: float = HELD_DEPTH,
) -> Configuration:
    """A configuration, raised where the arm would stand in a fixed body.

    Args:
        start: Joint positions before, rad.
        goal: Joint positions to raise, rad.
        arm_at: Function that gives the arm in a configuration, with what it holds.
        obstacles: Fixed bodies.
        highest: How far it may be raised, m; a wall beside it is no reason to climb over it.
        held_depth: How far what is held may reach into a fixed body, m.

    Returns:
        Joint positions within a step of the start; ``goal`` where raising it would not help.
    """
    joints = goal
    for _ in range(MAX_RAISES):
        arm = arm_at(joints)
        penetration = arm.to(arm).deepest_penetration(obstacles, held_depth)
        if penetration is None:
            return joints
        if penetration.depth > highest:
            break
        joints = raised(start, joints, penetration)
    return goal


def raised(start: Configuration, goal: Configuration, penetration: Penetration) -> Configuration:
    """The goal with a point raised, fast joints first.

    Args:
        start: Joint positions before, rad.
        goal: Joint positions to raise, rad.
        penetration: Point that has to be raised, and by how much.

    Returns:
        Joint positions within a step of the start.
    """
    rates = vertical_jacobian(goal, penetration.link, penetration.point)
    weights = [rate * step * step for rate, step in zip(rates, MAX_STEP, strict=True)]
    yielding = sum(rate * weight for rate, weight in zip(rates, weights, strict=True))
    if yielding <= 0.0:
        return start
    lift = (penetration.depth + RAISE_CLEARANCE) / yielding
    displacement = [
        min(max(g + lift * weight - s, -step), step)
        for g, s, weight, step in zip(goal, start, weights, MAX_STEP, strict=True)
    ]
    return within_limits(start, displacement)


def within_limits(joints: Configuration, displacement: Sequence[float]) -> Configuration:
    """Where joints are once they moved, at most up to their limits.

    Args:
        joints: Joint positions, rad.
        displacement: How far each is to move, rad.
    """
    moved = zip(joints, displacement, JOINT_LOW, JOINT_HIGH, strict=True)
    return tuple([min(max(q + d, low), high) for q, d, low, high in moved])
