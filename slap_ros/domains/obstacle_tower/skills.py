# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: the given skills. Depart upwards, cross on a planned path, come down, grip.

Grasps are from above, fingers along the faces of the block. Where a skill ends, the next begins:
with the fingers still around a block that was let go, or a block just lifted off.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.domains.domain import Action, Policy, Skill
from slap_ros.domains.obstacle_tower.model import BLOCK, SURFACE
from slap_ros.domains.obstacle_tower.tasks import GAP
from slap_ros.errors import SkillNotApplicableError
from slap_ros.motion import (
    Box,
    CollisionChecker,
    Free,
    MotionPlanningError,
    PlanCache,
    control_steps,
    inverse_kinematics,
    linear_motion,
    retime,
    retime_in_tens,
    shifted,
)
from slap_ros.physics.features import GRASP_FEATURES, JOINT_FEATURES, POSE_FEATURES, ROBOT
from slap_ros.physics.panda import GRASP_POINT, grasp_pose
from slap_ros.physics.pose import Pose, Vector, conjugate, multiply, rotate
from slap_ros.relational import Object, State

STEP_LIMIT = 100  # environment steps
CLEARANCE = 0.05  # m, over a place before coming down to it and after leaving it
LIFT = 0.01  # m, by which a block is lifted before it counts as picked
# Distances in m that a held block keeps from others: so far away it may be turned as one likes,
# on its way across, and when it is set down between others.
AT_EASE, CARRYING, SETTING_DOWN = 0.02, 0.005, -0.001
DROP = 0.001  # m, height over its place at which a block is let go
PLACES = 40  # on the table, tried in order of distance
PLACE_SPACING = 0.05  # m, of the grid of these places
TABLE_MARGIN = 0.05  # m, of these places from the table's edges
SEED = 0  # of motion plans: a plan is a function of the state alone
GRIP, RELEASE = 1.0, -1.0  # gripper commands
ATTEMPTS = 2  # random paths for a motion; more shorten plans by little and cost much
PLANS = PlanCache(attempts=ATTEMPTS)

JOINT_NAMES = tuple(feature.name for feature in JOINT_FEATURES)
POSE_NAMES = tuple(feature.name for feature in POSE_FEATURES)
GRASP_NAMES = tuple(feature.name for feature in GRASP_FEATURES)
HALF_NAMES = ("half_x", "half_y", "half_z")

Joints = NDArray[np.float64]


# -- reading the state ----------------------------------------------------------------------------


def _features(state: State, obj: Object, names: Sequence[str]) -> list[float]:
    return [float(state.get(obj, name)) for name in names]


def _joints(state: State) -> Joints:
    (robot,) = state.layout.of_type(ROBOT)
    return np.array(_features(state, robot, JOINT_NAMES))


def _pose(state: State, obj: Object) -> Pose:
    x, y, z, qx, qy, qz, qw = _features(state, obj, POSE_NAMES)
    return Pose((x, y, z), (qx, qy, qz, qw))


def _box(state: State, thing: Object) -> Box:
    half_x, half_y, half_z = _features(state, thing, HALF_NAMES)
    return Box(_pose(state, thing), (half_x, half_y, half_z))


def _top(state: State, thing: Object) -> float:
    """Height of the highest point of a thing that lies on one of its faces, m."""
    box = _box(state, thing)
    up = rotate(conjugate(box.pose.quaternion), (0.0, 0.0, 1.0))
    return box.pose.position[2] + sum(abs(u) * h for u, h in zip(up, box.half, strict=True))


def _grasp(state: State) -> Pose:
    """The held block's pose seen from the grasp point."""
    (robot,) = state.layout.of_type(ROBOT)
    x, y, z, qx, qy, qz, qw = _features(state, robot, GRASP_NAMES)
    return Pose((x, y, z - GRASP_POINT), (qx, qy, qz, qw))


def _held(state: State) -> Object | None:
    held = [b for b in state.layout.of_type(BLOCK) if state.get(b, "held") > 0.5]
    return held[0] if held else None


def _yaw(pose: Pose) -> float:
    """The turn about the vertical of a block that lies on a face, up to quarter turns, rad."""
    axes = [rotate(pose.quaternion, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
    x, y, _ = min(axes, key=lambda axis: abs(axis[2]))  # one that lies flat
    return math.atan2(y, x)


def _from_above(position: Vector, yaw: float) -> Pose:
    """The grasp point at a position, hand pointing down, fingers moving along the yaw's y."""
    return Pose(position, (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0))


def _quarter_turns(yaw: float) -> list[float]:
    return [yaw + k * math.pi / 2 for k in range(4)]


# -- ways -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """How the grasp point gets to one of several poses.

    Args:
        state: Where it begins.
        ends: Poses of the grasp point, any of which will do.
        touched: What the arm or its block may touch when it comes down.
    """

    state: State
    ends: Sequence[Pose]
    touched: tuple[Object, ...]

    def shortest(self) -> float:
        """Control steps that no way to any of the ends can take fewer of."""
        q = _joints(self.state)
        steps = [_steps(q, inverse_kinematics(end, q)) for end in self.ends]
        return min(steps)

    def pieces(self) -> list[Joints]:
        """Up, across and down: paths in rad, shape (k, 7), each from where the last one ends.

        Raises:
            SkillNotApplicableError: None of the ends can be reached.
        """
        start = self._depart()
        free = self._free((), CARRYING)
        for above, end in self._nearest_first(start[-1], free):
            try:
                across = PLANS.plan_path(start[-1], above, free, seed=SEED)
            except MotionPlanningError:
                continue
            down = linear_motion(above, end, free=self.touching)
            if down is not None:
                return [start, across, down]
        raise SkillNotApplicableError(f"none of {len(self.ends)} grasps can be reached from here")

    @cached_property
    def touching(self) -> CollisionChecker:
        """What is free on the way down, and where corners may be cut."""
        return self._free(self.touched)

    def _depart(self) -> Joints:
        """Straight up, where the fingers or the block in them are still close to something."""
        q = _joints(self.state)
        if self._free((), AT_EASE)(q[None])[0]:
            return q[None]
        up = linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, CLEARANCE)))
        if up is None:
            raise SkillNotApplicableError("the arm cannot move up from here")
        return up

    def _nearest_first(self, q: Joints, free: CollisionChecker) -> list[tuple[Joints, Pose]]:
        """Configurations over the ends, by control steps from ``q``."""
        found = []
        for end in self.ends:
            above = inverse_kinematics(shifted(end, (0.0, 0.0, CLEARANCE)), q, free=free)
            if above is not None:
                found.append((_steps(q, above), above, end))
        return [(above, end) for _, above, end in sorted(found, key=lambda item: item[0])]

    def _free(
        self, touched: tuple[Object, ...], held_margin: float = SETTING_DOWN
    ) -> CollisionChecker:
        held = _held(self.state)
        things = (*self.state.layout.of_type(BLOCK), *self.state.layout.of_type(SURFACE))
        solid = [
            _box(self.state, thing)
            for thing in things
            if thing != held and thing not in touched and self.state.get(thing, "is_target") < 0.5
        ]
        block = None if held is None else Box(_grasp(self.state), _box(self.state, held).half)
        (robot,) = self.state.layout.of_type(ROBOT)
        finger = float(self.state.get(robot, "finger"))
        return CollisionChecker(solid, held=block, finger=finger, held_margin=held_margin)


def _steps(start: Joints, goal: Joints | None) -> float:
    return math.inf if goal is None else float(control_steps(start, goal))


class Follow:
    """Go to positions one after the other, giving a gripper command with each.

    Closed loop: each step is what is missing from where the arm is.
    """

    def __init__(self, script: Sequence[tuple[Joints, float]]) -> None:
        """``script``: positions in rad with gripper commands."""
        self._script = deque(script)

    def __call__(self, state: State) -> Action | None:
        """The next action; None at the end of the script."""
        if not self._script:
            return None
        position, gripper = self._script.popleft()
        return np.array([*(position - _joints(state)), gripper])


class Timing(Protocol):
    """How paths become positions, one a control step."""

    def positions(self, pieces: Sequence[Joints], free: Free) -> Joints:
        """Positions in rad, shape (n, 7), without the start; corners may be cut where free."""
        ...

    def least_steps(self, straight: float) -> int:
        """Control steps to a place to which the joints need so many at their limits."""
        ...


class AtSpeedLimit:
    """As fast as the joints may move, without stopping in between."""

    def positions(self, pieces: Sequence[Joints], free: Free) -> Joints:
        """See :class:`Timing`."""
        path = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
        return retime(path, free=free)

    def least_steps(self, straight: float) -> int:
        """See :class:`Timing`. Less one: the redundancy is searched on a grid."""
        return 1 if math.isinf(straight) else max(1, math.floor(straight) - 1)


class InTens:
    """The paper's timing: ten steps up, ten down, ten for each straight piece across."""

    def positions(self, pieces: Sequence[Joints], free: Free) -> Joints:
        """See :class:`Timing`."""
        del free  # corners are not cut
        up, *across, down = (*pieces, pieces[-1][-1:]) if len(pieces) == 1 else pieces
        return np.concatenate([retime_in_tens(p) for p in (_ends(up), *across, _ends(down))])

    def least_steps(self, straight: float) -> int:
        """See :class:`Timing`: across and down."""
        del straight
        return 20


def _ends(path: Joints) -> Joints:
    return path[[0, -1]] if len(path) > 1 else path


def _script(way: Way, timing: Timing, gripper: float, lift: float) -> list[tuple[Joints, float]]:
    """Along a way, then grip, then lift by so many m."""
    pieces = way.pieces()
    end = pieces[-1][-1]
    script = [(position, 0.0) for position in timing.positions(pieces, way.touching)]
    script.append((end, gripper))
    if lift > 0.0:
        up = linear_motion(end, shifted(grasp_pose(end), (0.0, 0.0, lift)))
        if up is None:
            raise SkillNotApplicableError("the arm cannot lift from the grasp")
        script += [(position, 0.0) for position in timing.positions([up], way.touching)]
    return script


# -- skills ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PickSkill:
    """Come down onto a block, grasp it, lift it off what it stands on."""

    name: str
    timing: Timing
    step_limit: int = STEP_LIMIT
    least_steps: int = 3  # down, grip, up

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """Straight to the grasp; grip; lift."""
        return 2 + self.timing.least_steps(self._way(state, objects).shortest())

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: The block cannot be reached.
        """
        return Follow(_script(self._way(state, objects), self.timing, GRIP, LIFT))

    def _way(self, state: State, objects: tuple[Object, ...]) -> Way:
        _, block, _ = objects
        pose = _pose(state, block)
        grasps = [_from_above(pose.position, yaw) for yaw in _quarter_turns(_yaw(pose))]
        return Way(state, grasps, touched=(block,))


@dataclass(frozen=True)
class PlaceOnSkill:
    """Put the held block onto the middle of the target or of another block."""

    name: str
    timing: Timing
    step_limit: int = STEP_LIMIT
    least_steps: int = 2  # down, release

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """Straight to the place, and the release."""
        return 1 + self.timing.least_steps(self._way(state, objects).shortest())

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: The place cannot be reached.
        """
        return Follow(_script(self._way(state, objects), self.timing, RELEASE, 0.0))

    def _way(self, state: State, objects: tuple[Object, ...]) -> Way:
        _, _, thing = objects
        x, y, _ = _pose(state, thing).position
        yaws = _quarter_turns(_yaw(_pose(state, thing)))
        return _way_to_place(state, (x, y), yaws, thing)


@dataclass(frozen=True)
class PlaceSkill:
    """Put the held block down on the nearest place of the table that can be reached."""

    name: str
    timing: Timing
    step_limit: int = STEP_LIMIT
    least_steps: int = 2  # down, release

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """Which place it will be is not known without planning."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: No place can be reached.
        """
        _, block, table = objects
        yaw = _yaw(_pose(state, block))
        for place in _places(state, block, table):
            way = _way_to_place(state, place, _quarter_turns(yaw), table)
            try:
                return Follow(_script(way, self.timing, RELEASE, 0.0))
            except SkillNotApplicableError:
                continue
        raise SkillNotApplicableError(f"no place on the table can be reached with {block}")


def _way_to_place(
    state: State, place: tuple[float, float], yaws: Sequence[float], thing: Object
) -> Way:
    """The way on which the held block comes to stand on a thing at a place."""
    block, grasp = _held(state), _grasp(state)
    if block is None:
        raise SkillNotApplicableError("nothing is held")
    pose, size = _pose(state, block), _box(state, block).half[2]
    height = _top(state, thing) + size + DROP
    ends = []
    for yaw in yaws:
        turn = yaw - _yaw(pose)
        turned = multiply((0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)), pose.quaternion)
        ends.append(Pose((*place, height), turned).compose(grasp.inverse()))
    return Way(state, ends, touched=(thing,))


def _places(state: State, block: Object, table: Object) -> list[tuple[float, float]]:
    """Free places on the table, nearest to the block first."""
    x, y, _ = _pose(state, block).position
    middle, (half_x, half_y, _) = _pose(state, table).position, _box(state, table).half
    others = [b for b in state.layout.of_type(BLOCK) if b != block]
    others += [s for s in state.layout.of_type(SURFACE) if s != table]
    taken = [_pose(state, thing).position for thing in others]
    places = [
        (px, py)
        for px in _grid(middle[0], half_x - TABLE_MARGIN)
        for py in _grid(middle[1], half_y - TABLE_MARGIN)
        if all(math.hypot(px - tx, py - ty) >= GAP for tx, ty, _ in taken)
    ]
    return sorted(places, key=lambda place: (math.hypot(place[0] - x, place[1] - y), place))[
        :PLACES
    ]


def _grid(middle: float, half: float) -> list[float]:
    count = math.floor(half / PLACE_SPACING)
    return [middle + i * PLACE_SPACING for i in range(-count, count + 1)]


def skills(timing: Timing) -> dict[str, Skill]:
    """A skill for each operator."""
    return {
        "Pick": PickSkill("Pick", timing),
        "PickFromTarget": PickSkill("PickFromTarget", timing),
        "Unstack": PickSkill("Unstack", timing),
        "Place": PlaceSkill("Place", timing),
        "PlaceInTarget": PlaceOnSkill("PlaceInTarget", timing),
        "Stack": PlaceOnSkill("Stack", timing),
    }
