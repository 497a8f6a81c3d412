# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: the given skills. Each moves along waypoints at full speed, then grips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slap_ros.core import Action, Policy
from slap_ros.domains.obstacle2d.dynamics import CONTACT, MAX_STEP
from slap_ros.domains.obstacle2d.model import BLOCK, BLOCK_SIZE, SURFACE
from slap_ros.errors import SkillNotApplicableError
from slap_ros.relational import Object, State

STEP_LIMIT = 50  # environment steps
CARRY_HEIGHT = 0.1  # m, of a carried block's centre where nothing is in its way
ARRIVED = 1e-9  # m
GRIP, RELEASE = 1.0, -1.0  # gripper commands

Point = tuple[float, float]  # m


class WaypointPolicy:
    """Visit points with the gripper, then give a gripper command once."""

    def __init__(self, robot: Object, waypoints: Sequence[Point], gripper: float) -> None:
        """Begin at the first waypoint.

        Args:
            robot: Robot that has the gripper.
            waypoints: Positions that the gripper visits, m.
            gripper: The gripper command after the last waypoint.
        """
        self._robot = robot
        self._waypoints = list(waypoints)
        self._gripper = gripper
        self._done = False

    def __call__(self, state: State) -> Action | None:
        """The next action; None once the gripper command was given."""
        while self._waypoints:
            error = np.array(self._waypoints[0]) - state[self._robot]
            if np.abs(error).max() > ARRIVED:
                return np.array([*np.clip(error, -MAX_STEP, MAX_STEP), 0.0])
            self._waypoints.pop(0)
        if self._done:
            return None
        self._done = True
        return np.array([0.0, 0.0, self._gripper])


def _steps_between(start: Point, end: Point) -> int:
    """Fewest steps from one point to another: both axes move at once."""
    distance = max(abs(end[0] - start[0]), abs(end[1] - start[1]))
    return max(0, int(np.ceil((distance - ARRIVED) / MAX_STEP)))


def _position(state: State, obj: Object) -> Point:
    return float(state.get(obj, "x")), float(state.get(obj, "y"))


@dataclass(frozen=True)
class PickSkill:
    """Come down onto a block from above and grasp it."""

    name: str
    step_limit: int = STEP_LIMIT
    least_steps: int = 1  # the gripper may already be in place

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The straight way to the grasp, and the grasp."""
        robot, block, _ = objects
        return _steps_between(_position(state, robot), _grasp(state, block)) + 1

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Move up over the blocks if need be, cross, grasp."""
        robot, block, _ = objects
        x, y = _position(state, robot)
        grasp = _grasp(state, block)
        up = [(x, grasp[1])] if y < grasp[1] - CONTACT else []
        return WaypointPolicy(robot, [*up, grasp], GRIP)


def _grasp(state: State, block: Object) -> Point:
    x, y = _position(state, block)
    return x, y + BLOCK_SIZE


@dataclass(frozen=True)
class PlaceSkill:
    """Carry the held block to the nearest free place off the target areas."""

    name: str = "Place"
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The straight way to the place, and the release."""
        _, block, _ = objects
        place = nearest_free_place(state, block)
        if place is None:
            return self.least_steps
        return _steps_between(_position(state, block), (place, 0.0)) + 1

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Go to the nearest free place.

        Raises:
            SkillNotApplicableError: The table is full.
        """
        robot, block, _ = objects
        place = nearest_free_place(state, block)
        if place is None:
            raise SkillNotApplicableError(f"Place: no free place on the table for {block}")
        return _carry(state, robot, block, place)


@dataclass(frozen=True)
class PlaceInTargetSkill:
    """Carry the held block to the middle of the target area."""

    name: str = "PlaceInTarget"
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The straight way to the target, and the release."""
        _, block, target = objects
        place = (float(state.get(target, "x")), 0.0)
        return _steps_between(_position(state, block), place) + 1

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Go to the target's middle."""
        robot, block, target = objects
        return _carry(state, robot, block, float(state.get(target, "x")))


def _carry(state: State, robot: Object, block: Object, place: float) -> Policy:
    """Lift as high as the way needs, cross, set down, release."""
    (robot_x, robot_y), (x, y) = _position(state, robot), _position(state, block)
    height = max(y, BLOCK_SIZE if _in_the_way(state, block, place) else CARRY_HEIGHT)
    offset_x, offset_y = robot_x - x, robot_y - y
    points = [(x, height), (place, height), (place, 0.0)]
    return WaypointPolicy(robot, [(px + offset_x, py + offset_y) for px, py in points], RELEASE)


def _in_the_way(state: State, block: Object, place: float) -> bool:
    x = float(state.get(block, "x"))
    low, high = min(x, place) - BLOCK_SIZE + CONTACT, max(x, place) + BLOCK_SIZE - CONTACT
    return any(low < float(state.get(other, "x")) < high for other in _others(state, block))


def _others(state: State, block: Object) -> list[Object]:
    return [other for other in state.layout.of_type(BLOCK) if other != block]


def nearest_free_place(state: State, block: Object) -> float | None:
    """The x nearest to the block where it touches no other block and no target area, or None."""
    x = float(state.get(block, "x"))
    taken = [(float(state.get(b, "x")), BLOCK_SIZE) for b in _others(state, block)]
    for surface in state.layout.of_type(SURFACE):
        if state.get(surface, "is_target") > 0.5:
            reach = (BLOCK_SIZE + float(state.get(surface, "width"))) / 2
            taken.append((float(state.get(surface, "x")), reach))
    # The nearest free place is here, at a wall, or right beside something.
    candidates = [x, 0.0, 1.0]
    candidates += [middle + side * reach for middle, reach in taken for side in (-1, 1)]
    free = [
        place
        for place in candidates
        if 0.0 <= place <= 1.0
        and all(abs(place - middle) >= reach - CONTACT for middle, reach in taken)
    ]
    return min(free, key=lambda place: (abs(place - x), place), default=None)


SKILLS = (PickSkill("Pick"), PickSkill("PickFromTarget"), PlaceSkill(), PlaceInTargetSkill())
