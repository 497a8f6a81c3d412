# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: the given skills. Over a block, down and grip, up, over the bin and let go."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from slap_ros.domains.cleanup_table.model import (
    BLOCK,
    HAND_CLEAR,
    ON,
    OVER,
    SLOW,
    TIP,
    VELOCITY,
    WALL,
    scenery,
)
from slap_ros.domains.cleanup_table.scenery import SURROUNDINGS, carried
from slap_ros.domains.domain import Action, Policy, Skill
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.domains.tabletop.places import Place, free_places
from slap_ros.domains.tabletop.reading import box_of, grasp_of, joints_of, pose_of, top_of
from slap_ros.domains.tabletop.skills import GRIP, RELEASE, STEP_LIMIT, Follow
from slap_ros.domains.tabletop.surroundings import CARRYING
from slap_ros.domains.tabletop.timing import Timing
from slap_ros.domains.tabletop.ways import CLEARANCE, PLANS, SEED, remembered
from slap_ros.errors import SkillNotApplicableError
from slap_ros.motion import (
    Box,
    CollisionChecker,
    Free,
    Joints,
    MotionPlanningError,
    Path,
    linear_motion,
    nearest_configurations,
    path_steps,
    shifted,
)
from slap_ros.physics.gripper import GRASP_REACH
from slap_ros.physics.panda import FINGER_OPEN, JOINTS, grasp_pose
from slap_ros.physics.pose import Pose, Vector, conjugate, rotate
from slap_ros.relational import Object, State

YAWS = 16  # of the hand, evenly round
FINGER_ROOM = 0.005  # m, on each side of a block between the open fingers
UNDER = 0.016  # m, from the table to the grasp point at least, for the fingers' ends
HIGHER = 0.008  # m, of a grasp whose palm stays above what stands beside a block
PALM = 0.036  # m, from the grasp point to a block's top at most
LIFT_SLACK = 0.02  # m, by which a lifted block is higher than it need be
READY_SLACK = 0.005  # m, the same of the hand where it lets go
INSIDE = 0.02  # m, between a block and the walls of the bin it is dropped into
PLACES = 3  # in the bin, the nearest, that are looked at together
GAP = 0.1  # m, between what is dropped and what lies there, where there is room


# -- motions --------------------------------------------------------------------------------------


class Motion(Protocol):
    """Paths of the arm one after the other, bounded before they are planned."""

    @property
    def touching(self) -> Free:
        """Where corners may be cut."""
        ...

    def least_steps(self, timing: Timing) -> float:
        """Control steps that it takes at least; infinite where there is none."""
        ...

    def pieces(self) -> list[Path]:
        """Paths in rad, shape (k, 7), each from where the last one ends.

        Raises:
            SkillNotApplicableError: There is none.
        """
        ...


@dataclass(frozen=True, eq=False)
class Crossing:
    """To the nearest of some poses of the grasp point, on a planned path.

    Args:
        state: Where it begins.
        ends: Poses, any of which will do.
        accepts: Whether an end will do in a configuration.
    """

    state: State
    ends: Sequence[Pose]
    accepts: Callable[[Pose, Joints], bool]

    @cached_property
    def touching(self) -> CollisionChecker:
        """See :class:`Motion`; nothing may be touched."""
        return SURROUNDINGS.checker(self.state, held_margin=CARRYING)

    @property
    def is_possible(self) -> bool:
        """Whether one of the ends can be reached, if nothing is in between."""
        return bool(self._goals)

    @cached_property
    def _goals(self) -> list[tuple[Path, Pose]]:
        """Straight ways to the ends, the nearest first."""
        if not self.ends:
            return []
        q = joints_of(self.state)
        found = nearest_configurations(self.ends, q, free=self.touching)
        ways = [
            (np.stack([q, goal]), end)
            for end, goal in zip(self.ends, found, strict=True)
            if goal is not None
        ]
        return sorted(ways, key=lambda way: path_steps(way[0]))

    def least_steps(self, timing: Timing) -> float:
        """See :class:`Motion`."""
        return min(
            (timing.least_steps([straight]) for straight, _ in self._goals), default=math.inf
        )

    def pieces(self) -> list[Path]:
        """See :class:`Motion`."""
        for (start, goal), end in self._goals:
            if not self.accepts(end, goal):
                continue
            try:
                across = PLANS.plan_path(start, goal, self.touching, seed=SEED)
            except MotionPlanningError:
                continue
            return [start[None], across, goal[None]]
        raise SkillNotApplicableError(f"none of {len(self.ends)} poses can be reached from here")


@dataclass(frozen=True, eq=False)
class Straight:
    """Straight ways of the grasp point, known from the beginning."""

    found: list[Path] | None
    touching: Free

    def least_steps(self, timing: Timing) -> float:
        """See :class:`Motion`."""
        return math.inf if self.found is None else timing.least_steps(self.found)

    def pieces(self) -> list[Path]:
        """See :class:`Motion`."""
        if self.found is None:
            raise SkillNotApplicableError("the arm cannot go straight there")
        return self.found


# -- grasps and places ----------------------------------------------------------------------------


def grasps(state: State, block: Object, table: Object) -> list[Pose]:
    """Poses of the grasp point from above, where the fingers fit around a block."""
    frame, half = carried(state, block)
    box = Box(pose_of(state, block).compose(frame), half)
    x, y, z = pose_of(state, block).position
    lowest = max(z, top_of(box_of(state, table)) + UNDER, top_of(box) - PALM)
    yaw = _yaw(pose_of(state, block))
    yaws = [2.0 * math.pi * k / YAWS for k in range(YAWS)]
    yaws += [yaw + k * math.pi / 2 for k in range(4)]
    poses = [
        from_above((x, y, height), yaw)
        for height in (lowest, lowest + HIGHER)
        for yaw in yaws
        if height - z < GRASP_REACH
    ]
    return [pose for pose in poses if _fits(box, pose)]


def _yaw(pose: Pose) -> float:
    x, y, _ = rotate(pose.quaternion, (1.0, 0.0, 0.0))
    return math.atan2(y, x)


def _fits(box: Box, grasp: Pose) -> bool:
    """Whether the fingers, opened wide, go down at both sides of a box."""
    along = rotate(grasp.quaternion, (0.0, 1.0, 0.0))  # the way the fingers move
    off = sum(a * (b - c) for a, b, c in zip(along, box.pose.position, grasp.position, strict=True))
    return abs(off) + _reach(box, along) <= FINGER_OPEN - FINGER_ROOM


def _reach(box: Box, axis: Vector) -> float:
    """How far a box reaches from its middle along an axis, m."""
    seen = rotate(conjugate(box.pose.quaternion), axis)
    return sum(abs(a) * half for a, half in zip(seen, box.half, strict=True))


def _drops(state: State, block: Object, drawer: Object) -> Iterator[list[Pose]]:
    """Poses of the grasp point over the bin, hand pointing down; those of some places at a time."""
    x, y, _ = pose_of(state, block).position
    hand, space = grasp_pose(joints_of(state)), box_of(state, drawer)
    height = max(hand.position[2], float(scenery(state).highest) + HAND_CLEAR + TIP + READY_SLACK)
    (mx, my, _), (half_x, half_y, _) = space.pose.position, space.half
    taken = [
        pose_of(state, other).position
        for other in state.layout.of_type(BLOCK)
        if other != block and ON(other, drawer).holds(state)
    ]
    lying = [(px, py) for px, py, _ in taken]
    rectangle = (mx, my), (half_x - WALL - INSIDE, half_y - WALL - INSIDE)
    places = free_places((x, y), *rectangle, [(place, GAP) for place in lying])
    places += [place for place in free_places((x, y), *rectangle, []) if place not in places]
    found: list[Pose] = []
    for number, place in enumerate(places, start=1):
        found += _over(state, block, space, place, height)
        if number % PLACES == 0 and found:
            yield found
            found = []
    yield found


def _over(state: State, block: Object, space: Box, place: Place, height: float) -> list[Pose]:
    """Poses from which the held block falls into the bin between its walls."""
    grasp, (frame, half) = grasp_of(state), carried(state, block)
    yaw = _yaw(grasp_pose(joints_of(state)))
    poses = []
    for k in range(YAWS):
        hand = from_above((*place, height), yaw + 2.0 * math.pi * k / YAWS)
        box = Box(hand.compose(grasp).compose(frame), half)
        if all(
            abs(box.pose.position[i] - space.pose.position[i]) + _reach(box, axis)
            <= space.half[i] - WALL - INSIDE
            for i, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        ):
            poses.append(hand)
    return poses


# -- skills ---------------------------------------------------------------------------------------


@remembered
def _to_over(state: State, block: Object, table: Object) -> Crossing:
    """Over a block, where the hand can go straight down to grasp it."""
    touching = SURROUNDINGS.checker(state, (block,))
    height = pose_of(state, block).position[2] + OVER

    below: dict[Pose, list[Pose]] = {}
    for grasp in grasps(state, block, table):
        below.setdefault(shifted(grasp, (0.0, 0.0, height - grasp.position[2])), []).append(grasp)

    def comes_down(over: Pose, q: Joints) -> bool:
        return any(linear_motion(q, grasp, free=touching) is not None for grasp in below[over])

    return Crossing(state, list(below), comes_down)


@remembered
def _down(state: State, block: Object, table: Object) -> Straight:
    """Down to the grasp that takes the least turning."""
    q, touching = joints_of(state), SURROUNDINGS.checker(state, (block,))
    for grasp in sorted(grasps(state, block, table), key=grasp_pose(q).angle_to):
        down = linear_motion(q, grasp, free=touching)
        if down is not None:
            return Straight([q[None], down], touching)
    return Straight(None, touching)


@remembered
def _up(state: State, block: Object, table: Object) -> Straight:
    """Up until what is held is above everything, 5 cm after 5 cm."""
    touching = SURROUNDINGS.checker(state, (table,))
    number = state.layout.of_type(BLOCK).index(block)
    rise = max(LIFT_SLACK - float(scenery(state).above[number]), 0.0)
    stages = max(1, math.ceil(rise / CLEARANCE))
    q, pieces = joints_of(state), []
    for _ in range(stages):
        up = linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, rise / stages)), free=touching)
        if up is None:
            return Straight(None, touching)
        pieces.append(up[[0, -1]])
        q = up[-1]
    return Straight(pieces, touching)


@remembered
def _to_bin(state: State, block: Object, drawer: Object) -> Crossing:
    """Over the nearest places in the bin that can be reached."""
    for ends in _drops(state, block, drawer):
        crossing = Crossing(state, ends, _any)
        if crossing.is_possible:
            return crossing
    return Crossing(state, [], _any)


def _any(end: Pose, q: Joints) -> bool:
    del end, q
    return True


def _landed(state: State, block: Object, drawer: Object) -> bool:
    """Whether a block lies in the bin, and what it fell on lies still again."""
    moving = state.gather(state.layout.column_of(BLOCK), VELOCITY)
    return bool((np.square(moving).sum(axis=-1) < SLOW**2).all()) and ON(block, drawer).holds(state)


class ThenWait:
    """Stay where a policy ended, until something has happened."""

    def __init__(self, policy: Policy, happened: Callable[[State], bool]) -> None:
        self._policy, self._happened = policy, happened

    def __call__(self, state: State) -> Action | None:
        """The next action; None once it has happened."""
        action = self._policy(state)
        if action is None and not self._happened(state):
            return np.zeros(JOINTS + 1)
        return action


@dataclass(frozen=True)
class MotionSkill:
    """Go; then grip or let go, if need be.

    Args:
        name: The operator's.
        timing: How fast.
        motion: Where to: of a state, a block and a surface.
        grip: Gripper commands at the end of the motion.
        step_limit: Environment steps.
    """

    name: str
    timing: Timing
    motion: Callable[[State, Object, Object], Motion]
    grip: tuple[float, ...] = ()
    step_limit: int = STEP_LIMIT

    @property
    def least_steps(self) -> int:
        """There, and the gripper."""
        return 1 + len(self.grip)

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The straight way, and the gripper; what cannot be gone is never too short."""
        _, block, surface = objects
        least = self.motion(state, block, surface).least_steps(self.timing)
        return self.step_limit if math.isinf(least) else max(1, int(least)) + len(self.grip)

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: There is no way for the arm.
        """
        _, block, surface = objects
        motion = self.motion(state, block, surface)
        pieces = motion.pieces()
        script = [(q, 0.0) for q in self.timing.positions(pieces, motion.touching)]
        return Follow([*script, *((pieces[-1][-1], command) for command in self.grip)])


@dataclass(frozen=True)
class DropSkill(MotionSkill):
    """Let go over the bin, and wait for what falls."""

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """See :class:`MotionSkill`."""
        _, block, drawer = objects
        policy = super().start(state, objects)
        return ThenWait(policy, lambda now: _landed(now, block, drawer))


def skills(timing: Timing) -> dict[str, Skill]:
    """A skill for each operator."""
    return {
        "Reach": MotionSkill("Reach", timing, _to_over),
        "Grasp": MotionSkill("Grasp", timing, _down, (GRIP,)),
        "Lift": MotionSkill("Lift", timing, _up),
        "Drop": DropSkill("Drop", timing, _to_bin, (RELEASE,)),
    }
