# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: the given skills. Over a block, down and grip, up, over the bin and let go."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slap_ros.core import Action, Policy, Skill
from slap_ros.domains.cleanup_table.features import BLOCK, SURFACE, VELOCITY, WALL
from slap_ros.domains.cleanup_table.predicates import ON
from slap_ros.domains.cleanup_table.relations import HAND_CLEAR, OVER, SLOW, TIP, cleanup_relations
from slap_ros.domains.cleanup_table.scene import PLANNING_SCENE, carried
from slap_ros.domains.tabletop import observation
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.domains.tabletop.memory import memoized
from slap_ros.domains.tabletop.placements import Placement, free_placements
from slap_ros.domains.tabletop.planning_scene import CARRYING
from slap_ros.domains.tabletop.skills import (
    GRIP,
    RELEASE,
    STEP_LIMIT,
    Trajectory,
    TrajectoryFollower,
)
from slap_ros.domains.tabletop.state_access import JOINT_NAMES, box_of, grasp_of, joints_of
from slap_ros.domains.tabletop.timing import Timing
from slap_ros.domains.tabletop.transit import CLEARANCE, PLANS, SEED
from slap_ros.errors import SkillNotApplicableError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, rotate
from slap_ros.motion import (
    Free,
    Joints,
    MotionPlanningError,
    Path,
    linear_motion,
    nearest_configurations,
    path_steps,
    shifted,
)
from slap_ros.relational import Object, State
from slap_ros.relational.predicates import Bools
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.gripper import GRASP_REACH
from slap_ros.worlds.panda import FINGER_OPEN, JOINTS, grasp_pose

YAWS = 16  # of the hand, evenly round
FINGER_AXIS = (0.0, 1.0, 0.0)  # the way the fingers move, seen from the grasp point
FINGER_ROOM = 0.005  # m, on each side of a block between the open fingers
UNDER = 0.016  # m, from the table to the grasp point at least, for the fingers' ends
HIGHER = 0.008  # m, of a grasp whose palm stays above what stands beside a block
PALM = 0.036  # m, from the grasp point to a block's top at most
LIFT_MARGIN = 0.02  # m, by which a lifted block is higher than it need be
OFF_TABLE = 0.01  # m, by which a block is lifted before the hand may turn
READY_MARGIN = 0.005  # m, the same of the hand where it lets go
INSIDE = 0.02  # m, between a block and the walls of the bin it is dropped into
PLACES = 3  # in the bin, the nearest, that are looked at together
ROUNDING = 1e-9  # m
GAP = 0.1  # m, between what is dropped and what lies there, where there is room


# -- motions --------------------------------------------------------------------------------------


class MotionPaths(NamedTuple):
    """Paths of the arm one after the other, in rad, shape (k, 7)."""

    paths: Sequence[Path]
    free: Free  # where corners may be cut


def _across(
    state: State,
    goals: Sequence[Pose],
    accepts: Callable[[Pose, Joints], bool],
    start: Joints | None = None,
) -> MotionPaths:
    """The motion, on a planned path, to the nearest pose of the grasp point that is accepted.

    Args:
        state: State in which the motion begins.
        goals: Poses of the grasp point to choose among.
        accepts: Function that says whether a pose is accepted in a configuration of the joints.
        start: Joint positions in which the motion begins, rad; None: those of the state.

    Raises:
        SkillNotApplicableError: None of them can be reached.
    """
    q = joints_of(state) if start is None else start
    free = PLANNING_SCENE.checker(state, held_margin=CARRYING)
    nearest = nearest_configurations(goals, q, free=free) if goals else []
    candidates = [
        (np.stack([q, end]), goal)
        for goal, end in zip(goals, nearest, strict=True)
        if end is not None
    ]
    for (_, end), goal in sorted(candidates, key=lambda candidate: path_steps(candidate[0])):
        if not accepts(goal, end):
            continue
        try:
            return MotionPaths([q[None], PLANS.plan_path(q, end, free, seed=SEED), end[None]], free)
        except MotionPlanningError:
            continue
    raise SkillNotApplicableError(f"none of {len(goals)} poses can be reached from here")


# -- grasps and places ----------------------------------------------------------------------------


def grasps(state: State, block: Object, table: Object) -> list[Pose]:
    """Poses of the grasp point from above, where the fingers fit around a block.

    Args:
        state: Current state.
        block: Block that is to be grasped.
        table: Table that the block stands on.

    Returns:
        Poses in the base's frame, the deepest grasps first.
    """
    frame, half = carried(state, block)
    box = OrientedBox(pose_of(state, block).compose(frame), half)
    x, y, z = pose_of(state, block).position
    lowest = max(z, box_of(state, table).top + UNDER, box.top - PALM)
    yaw = _yaw(pose_of(state, block))
    yaws = [2.0 * math.pi * k / YAWS for k in range(YAWS)]
    yaws += [yaw + k * math.pi / 2 for k in range(4)]
    poses = [
        from_above((x, y, height), yaw)
        for height in (lowest, lowest + HIGHER)
        for yaw in yaws
        if height - z < GRASP_REACH
    ]
    fitting = [pose for pose in poses if _fits(box, pose)]
    if fitting:
        return fitting
    # What was pushed over may be heavy on one side: the hand grasps it in the middle.
    poses = [_in_middle(box, pose) for pose in poses]
    near = [pose for pose in poses if math.dist(pose.position, (x, y, z)) < GRASP_REACH]
    return [pose for pose in near if _fits(box, pose)]


def _yaw(pose: Pose) -> float:
    x, y, _ = rotate(pose.quaternion, (1.0, 0.0, 0.0))
    return math.atan2(y, x)


def _fits(box: OrientedBox, grasp: Pose) -> bool:
    """Whether the fingers, opened wide, go down at both sides of a box."""
    along = rotate(grasp.quaternion, FINGER_AXIS)
    return abs(_off_middle(box, grasp)) + box.half_extent(along) <= FINGER_OPEN - FINGER_ROOM


def _off_middle(box: OrientedBox, grasp: Pose) -> float:
    """How far the middle of a box is from a grasp, the way the fingers move, m."""
    along = rotate(grasp.quaternion, FINGER_AXIS)
    return sum(
        a * (b - c) for a, b, c in zip(along, box.pose.position, grasp.position, strict=True)
    )


def _in_middle(box: OrientedBox, grasp: Pose) -> Pose:
    """A grasp moved the way the fingers move, so that a box is in the middle between them."""
    off, (x, y, z) = _off_middle(box, grasp), rotate(grasp.quaternion, FINGER_AXIS)
    return shifted(grasp, (off * x, off * y, off * z))


def _drops(state: State, block: Object, drawer: Object) -> Iterator[list[Pose]]:
    """Poses of the grasp point over the bin, hand pointing down; those of some places at a time."""
    x, y, _ = pose_of(state, block).position
    hand, space = grasp_pose(joints_of(state)), box_of(state, drawer)
    height = max(
        hand.position[2], float(cleanup_relations(state).highest) + HAND_CLEAR + TIP + READY_MARGIN
    )
    (mx, my, _), (half_x, half_y, _) = space.pose.position, space.half
    others = [other for other in state.layout.of_type(BLOCK) if other != block]
    lying = [pose_of(state, o).position for o in others if ON(o, drawer).holds(state)]
    taken = [((px, py), GAP) for px, py, _ in lying]
    rectangle = (mx, my), (half_x - WALL - INSIDE, half_y - WALL - INSIDE)
    places = free_placements((x, y), *rectangle, taken)
    places += [place for place in free_placements((x, y), *rectangle, []) if place not in places]
    found: list[Pose] = []
    for number, place in enumerate(places, start=1):
        found += _over(state, block, space, place, height)
        if number % PLACES == 0 and found:
            yield found
            found = []
    yield found


def _over(
    state: State, block: Object, space: OrientedBox, place: Placement, height: float
) -> list[Pose]:
    """Poses from which the held block falls into the bin between its walls."""
    grasp, (frame, half) = grasp_of(state), carried(state, block)
    yaw = _yaw(grasp_pose(joints_of(state)))
    poses = []
    for k in range(YAWS):
        hand = from_above((*place, height), yaw + 2.0 * math.pi * k / YAWS)
        box = OrientedBox(hand.compose(grasp).compose(frame), half)
        if all(
            abs(box.pose.position[i] - space.pose.position[i]) + box.half_extent(axis)
            <= space.half[i] - WALL - INSIDE
            for i, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        ):
            poses.append(hand)
    return poses


# -- ways -----------------------------------------------------------------------------------------


def _to_over(state: State, block: Object, table: Object) -> MotionPaths:
    """Over a block, where the hand can go straight down to grasp it."""
    touching = PLANNING_SCENE.checker(state, (block,))
    height = pose_of(state, block).position[2] + OVER
    below: dict[Pose, list[Pose]] = {}
    for grasp in grasps(state, block, table):
        below.setdefault(shifted(grasp, (0.0, 0.0, height - grasp.position[2])), []).append(grasp)

    def comes_down(over: Pose, q: Joints) -> bool:
        return any(linear_motion(q, grasp, free=touching) is not None for grasp in below[over])

    return _across(state, list(below), comes_down)


def _down(state: State, block: Object, table: Object) -> MotionPaths:
    """Down to the grasp that takes the least turning."""
    q, touching = joints_of(state), PLANNING_SCENE.checker(state, (block,))
    for grasp in sorted(grasps(state, block, table), key=grasp_pose(q).angle_to):
        down = linear_motion(q, grasp, free=touching)
        if down is not None:
            return MotionPaths([q[None], down], touching)
    raise SkillNotApplicableError(f"the hand cannot go straight down to {block}")


def _up(state: State, block: Object, table: Object) -> MotionPaths:
    """Up until what is held is above everything, 5 cm after 5 cm."""
    touching = PLANNING_SCENE.checker(state, (table, *_touched(state, block)))
    height = LIFT_MARGIN - _above(state, block)
    stages = max(1, math.ceil(height / CLEARANCE))
    q, paths = joints_of(state), []
    for _ in range(stages):
        up = linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, height / stages)), free=touching)
        if up is None:
            return _up_turning(state, block, height, touching)
        paths.append(up[[0, -1]])
        q = up[-1]
    return MotionPaths(paths, touching)


def _up_turning(state: State, block: Object, height: float, touching: Free) -> MotionPaths:
    """Up with a hand that turns, where a joint's limit is in the way of the straight motion."""
    q = joints_of(state)
    x, y, z = grasp_pose(q).position
    off = linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, OFF_TABLE)), free=touching)
    if off is None:
        raise SkillNotApplicableError(f"the arm cannot lift {block}")
    yaw = _yaw(grasp_pose(q))
    turned = [from_above((x, y, z + height), yaw + 2.0 * math.pi * k / YAWS) for k in range(YAWS)]
    paths, free = _across(state, turned, lambda *_: True, start=off[-1])
    return MotionPaths([off[[0, -1]], *paths], free)


def _touched(state: State, block: Object) -> list[Object]:
    """The blocks that the arm, or the block that it holds, touches already: it pushed them."""
    blocks = state.layout.of_type(BLOCK)
    surfaces, q = state.layout.of_type(SURFACE), joints_of(state)

    def is_touched(other: Object) -> bool:
        rest = (*surfaces, *(one for one in blocks if one != other))
        return not bool(PLANNING_SCENE.checker(state, rest)(q[None])[0])

    return [other for other in blocks if other != block and is_touched(other)]


def _to_bin(state: State, block: Object, drawer: Object) -> MotionPaths:
    """Over one of the nearest places in the bin that can be reached."""
    for goals in _drops(state, block, drawer):
        try:
            return _across(state, goals, lambda *_: True)
        except SkillNotApplicableError:
            continue
    raise SkillNotApplicableError(f"there is no place in {drawer} over which {block} can be held")


def _above(state: State, block: Object) -> float:
    """Margin of a block over everything else, m."""
    return float(cleanup_relations(state).above[state.layout.of_type(BLOCK).index(block)])


# -- where a skill has done its work --------------------------------------------------------------

# Whether it has, at each of some positions of the joints, shape (n, 7) to (n,).
Until = Callable[[State, Object, Joints], Bools]


def _is_over(state: State, block: Object, positions: Joints) -> Bools:
    """Whether the hand is ready to pick a block, and no more above everything."""
    seen = cleanup_relations(_with_joints(state, positions))
    number = state.layout.of_type(BLOCK).index(block)
    over: Bools = (seen.ready[..., number] >= 0.0) & (seen.hand_ready < 0.0)
    return over


def _is_lifted(state: State, block: Object, positions: Joints) -> Bools:
    """Whether a block that is lifted without being turned is above everything."""
    before = observation.grasp_points(joints_of(state))[..., 2]
    lift = observation.grasp_points(positions)[:, 2] - before
    lifted: Bools = lift + _above(state, block) > ROUNDING
    return lifted


def _with_joints(state: State, positions: Joints) -> State:
    """States that differ in the arm alone."""
    data = np.repeat(state.data[None], len(positions), axis=0)
    columns = state.layout.grid(state.layout.column_of(ROBOT), JOINT_NAMES)[0]
    data[:, columns] = positions
    return State(state.layout, data)


# -- skills ---------------------------------------------------------------------------------------


def _is_decided(state: State, block: Object, drawer: Object) -> bool:
    """Whether a block lies in the bin, and what it fell on lies still; or never will.

    Where nothing moves, nothing more happens: it fell out of the hand, say, on the way.
    """
    velocities = state.gather(state.layout.column_of(BLOCK), VELOCITY)
    if not velocities.any():
        return True
    slow = (np.square(velocities).sum(axis=-1) < SLOW**2).all()
    return bool(slow) and ON(block, drawer).holds(state)


class WaitForOutcome:
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
    """Move; then grip or let go, if need be. How long that takes is known once it is planned.

    Args:
        name: Name of the operator.
        timing: Timing of the paths.
        motion: Function from a state, a block and a surface to the paths of the arm.
        until: Condition in which its work is done, maybe on the way; None: it is at its goal.
        grip: Gripper commands after the motion.
        step_limit: Environment steps after which the skill fails.
    """

    name: str
    timing: Timing
    motion: Callable[[State, Object, Object], MotionPaths]
    until: Until | None = None
    grip: tuple[float, ...] = ()
    step_limit: int = STEP_LIMIT

    @property
    def least_steps(self) -> int:
        """One step to get there, and one for each gripper command."""
        return 1 + len(self.grip)

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """As many as it takes; where it cannot be planned, any bound is admissible."""
        try:
            return max(1, _planned(self, state, objects).least_steps)
        except SkillNotApplicableError:
            return self.step_limit

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        It is planned beyond where its work is done: a robot is not there yet by a hair where the
        model is, and goes on.

        Raises:
            SkillNotApplicableError: There is no way for the arm.
        """
        trajectory = _planned(self, state, objects).trajectory
        return TrajectoryFollower(trajectory, self.timing.max_step)


class PlannedMotion(NamedTuple):
    """A skill's motion from a state."""

    trajectory: Trajectory
    least_steps: int  # after which its work is done, if the arm is where it should be


@memoized
def _planned(skill: MotionSkill, state: State, objects: tuple[Object, ...]) -> PlannedMotion:
    """Positions with gripper commands.

    Raises:
        SkillNotApplicableError: There is no way for the arm.
    """
    _, block, surface = objects
    paths, free = skill.motion(state, block, surface)
    positions = skill.timing.positions(paths, free)
    end = positions[-1] if len(positions) else joints_of(state)
    trajectory = [*((q, 0.0) for q in positions), *((end, command) for command in skill.grip)]
    if skill.until is None:
        return PlannedMotion(trajectory, len(trajectory))
    there = skill.until(state, block, positions)
    if not there.any():
        raise SkillNotApplicableError(f"{skill.name} of {block} does not get where it should")
    return PlannedMotion(trajectory, int(there.argmax()) + 1)


@dataclass(frozen=True)
class DropSkill(MotionSkill):
    """Let go over the bin, and wait for what falls."""

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion, and wait after it; see :class:`MotionSkill`."""
        _, block, drawer = objects
        policy = super().start(state, objects)
        return WaitForOutcome(policy, lambda now: _is_decided(now, block, drawer))


def skills(timing: Timing) -> dict[str, Skill]:
    """A skill for each operator."""
    return {
        "Reach": MotionSkill("Reach", timing, _to_over, _is_over),
        "Grasp": MotionSkill("Grasp", timing, _down, grip=(GRIP,)),
        "Lift": MotionSkill("Lift", timing, _up, _is_lifted),
        "Drop": DropSkill("Drop", timing, _to_bin, grip=(RELEASE,)),
    }
