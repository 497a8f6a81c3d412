# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: the given skills. Depart upwards, cross on a planned path, come down, grip.

Grasps are from above, fingers along the faces of the block. Where a skill ends, the next begins:
with the fingers still around a block that was let go, or a block just lifted off.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
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
    linear_motion,
    nearest_configurations,
    path_configurations,
    path_steps,
    retime,
    retime_in_tens,
    shifted,
)
from slap_ros.physics.features import GRASP_FEATURES, JOINT_FEATURES, POSE_FEATURES, ROBOT
from slap_ros.physics.panda import GRASP_POINT, JOINTS, MAX_STEP, grasp_pose
from slap_ros.physics.pose import ORIGIN, Pose, Vector, conjugate, rotate
from slap_ros.relational import Object, State

STEP_LIMIT = 100  # environment steps
CLEARANCE = 0.05  # m, over a place before coming down to it and after leaving it
LIFT = 0.02  # m, of a block that counts as picked; the fingers go as far in a control step
# Distances in m that a held block keeps from others: so far away it may be turned as one likes,
# on its way across, and when it is set down between others.
AT_EASE, CARRYING, SETTING_DOWN = 0.02, 0.005, -0.001
DROP = 0.001  # m, height over its place at which a block is let go
PLACES = 40  # on the table, tried in order of distance
PLACE_SPACING = 0.05  # m, of the grid of these places
TABLE_MARGIN = 0.05  # m, of these places from the table's edges
SEED = 0  # of motion plans: a plan is a function of the state alone
GRIP, RELEASE = 1.0, -1.0  # gripper commands
ATTEMPTS = 2  # random paths for a motion that needs them; more shorten it by little
PLANS = PlanCache(attempts=ATTEMPTS)
REMEMBERED = 1024  # ways: bounded first, planned later
ROUNDING = 1e-6  # control steps
LAG = 0.005  # rad, by which an arm may be late without being waited for
TRIES = 3  # for a position

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


@dataclass(frozen=True, eq=False)
class Way:
    """How the grasp point gets to one of several poses: up, across, down.

    What it takes to bound its length serves to plan it, too, and is computed once.

    Args:
        state: Where it begins.
        ends: Poses of the grasp point, any of which will do.
        touched: What the arm or its block may touch when it comes down.
    """

    state: State
    ends: Sequence[Pose]
    touched: tuple[Object, ...]

    def pieces(self) -> list[Joints]:
        """Up, across and down: paths in rad, shape (k, 7), each from where the last one ends.

        Raises:
            SkillNotApplicableError: None of the ends can be reached.
        """
        for descent in self.descents:
            if descent.down is None:
                continue
            try:
                start, above = descent.straight
                across = PLANS.plan_path(start, above, _free(self.state), seed=SEED)
            except MotionPlanningError:
                continue
            return [descent.up, across, descent.down]
        raise SkillNotApplicableError(f"none of {len(self.ends)} grasps can be reached from here")

    def least_steps(self, timing: Timing) -> float:
        """Control steps that it takes at least: across it may have to go round something.

        Infinite where none of the ends can be reached.
        """
        least = math.inf
        for descent in self.descents:
            towards = [descent.up, descent.straight]
            if timing.least_steps(towards) >= least:
                break  # nor are those that are further away any nearer
            if descent.down is not None:
                least = min(least, timing.least_steps([*towards, descent.down]))
        return least

    @property
    def is_open(self) -> bool:
        """Whether one of the ends is reached straight across, and so surely."""
        free = _free(self.state)
        return any(
            descent.down is not None and free(path_configurations(descent.straight)).all()
            for descent in self.descents
        )

    @cached_property
    def touching(self) -> CollisionChecker:
        """What is free on the way down, and where corners may be cut."""
        return _checker(self.state, self.touched)

    @cached_property
    def descents(self) -> list[Descent]:
        """To the ends that have something over them, the nearest first; none if it cannot begin."""
        up, found = _departure(self.state), []
        if up is None:
            return []
        over = [shifted(end, (0.0, 0.0, CLEARANCE)) for end in self.ends]
        nearest = nearest_configurations(over, up[-1], free=_free(self.state))
        for end, above in zip(self.ends, nearest, strict=True):
            if above is not None:
                found.append(Descent(up, np.stack([up[-1], above]), end, self.touching))
        return sorted(found, key=lambda descent: path_steps(descent.straight))


@dataclass(frozen=True, eq=False)
class Descent:
    """A way to one of the ends, but for what may be between."""

    up: Joints  # rad, shape (k, 7)
    straight: Joints  # across, if nothing were in between: rad, shape (2, 7)
    end: Pose  # of the grasp point
    free: Free  # on the way down

    @cached_property
    def down(self) -> Joints | None:
        """The path in rad, shape (k, 7), if there is one."""
        return linear_motion(self.straight[-1], self.end, free=self.free)


@lru_cache(maxsize=REMEMBERED)
def _departure(state: State) -> Joints | None:
    """Straight up, where the fingers or the block in them are still close to something."""
    q = _joints(state)
    if _checker(state, (), AT_EASE)(q[None])[0]:
        return q[None]
    return linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, CLEARANCE)))


@lru_cache(maxsize=REMEMBERED)
def _free(state: State) -> CollisionChecker:
    """What is free on the way across."""
    return _checker(state, (), CARRYING)


def forget() -> None:
    """Forget every motion, for fair measurements; nothing else changes."""
    PLANS.clear()
    for remembered in (_departure, _free, _way_to_grasp, _way_to_place):
        remembered.cache_clear()


def _checker(
    state: State, touched: tuple[Object, ...], held_margin: float = SETTING_DOWN
) -> CollisionChecker:
    held = _held(state)
    things = (*state.layout.of_type(BLOCK), *state.layout.of_type(SURFACE))
    solid = [
        _box(state, thing)
        for thing in things
        if thing != held and thing not in touched and state.get(thing, "is_target") < 0.5
    ]
    block = None if held is None else Box(_grasp(state), _box(state, held).half)
    (robot,) = state.layout.of_type(ROBOT)
    finger = float(state.get(robot, "finger"))
    return CollisionChecker(solid, held=block, finger=finger, held_margin=held_margin)


class Follow:
    """Go to positions one after the other, giving a gripper command with each.

    Closed loop: each step is what is missing from where the arm is. A real arm lags behind: what is
    missing may then be more than a step may be, and is gone as far as one may, in a straight line.
    Where that leaves a good deal, the same position is tried again, a few times at most, as an arm
    that is held up never gets there.
    """

    def __init__(self, script: Sequence[tuple[Joints, float]], step: Sequence[float]) -> None:
        """``script``: positions in rad with gripper commands; ``step``: rad, the most in a step."""
        self._script = deque(script)
        self._step = np.array(step)
        self._tries = TRIES

    def __call__(self, state: State) -> Action | None:
        """The next action; None at the end of the script."""
        if not self._script:
            return None
        position, gripper = self._script[0]
        missing = position - _joints(state)
        excess = float((np.abs(missing) / self._step).max())
        if excess <= 1.0 + ROUNDING:
            self._next()
            return np.array([*missing, gripper])
        self._tries -= 1
        if self._tries == 0 or float(np.abs(missing).max()) * (1.0 - 1.0 / excess) <= LAG:
            self._next()
        else:
            gripper = 0.0  # not yet
        return np.array([*(missing / excess), gripper])

    def _next(self) -> None:
        self._script.popleft()
        self._tries = TRIES


class Timing(Protocol):
    """How paths become positions, one a control step."""

    @property
    def step(self) -> Sequence[float]:
        """How far joints may go in a step, rad."""
        ...

    def positions(self, pieces: Sequence[Joints], free: Free) -> Joints:
        """Positions in rad, shape (n, 7), without the start; corners may be cut where free."""
        ...

    def least_steps(self, pieces: Sequence[Joints]) -> int:
        """Positions that pieces take at least, be they straight or bent between the same ends."""
        ...


class AtSpeedLimit:
    """As fast as the joints may move, without stopping in between."""

    step: Sequence[float] = MAX_STEP

    def positions(self, pieces: Sequence[Joints], free: Free) -> Joints:
        """See :class:`Timing`."""
        path = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
        return retime(path, free=free)

    def least_steps(self, pieces: Sequence[Joints]) -> int:
        """See :class:`Timing`. What is bent is longer, and a stop at a corner costs more."""
        return math.ceil(sum(path_steps(piece) for piece in pieces) - ROUNDING)


class InTens:
    """The paper's timing: ten steps up, ten down, ten for each straight piece across."""

    step: Sequence[float] = (math.pi,) * JOINTS

    def positions(self, pieces: Sequence[Joints], free: Free) -> Joints:
        """See :class:`Timing`."""
        del free  # corners are not cut
        up, *across, down = (*pieces, pieces[-1][-1:]) if len(pieces) == 1 else pieces
        return np.concatenate([retime_in_tens(p) for p in (_ends(up), *across, _ends(down))])

    def least_steps(self, pieces: Sequence[Joints]) -> int:
        """See :class:`Timing`."""
        return sum(len(retime_in_tens(_ends(piece))) for piece in pieces)


def _bound(least: float, after: int, step_limit: int) -> int:
    """A way, and so many steps after it; a way that cannot be gone is never too short."""
    return step_limit if math.isinf(least) else int(least) + after


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
        """The way to the grasp; grip; lift."""
        least = self._way(state, objects).least_steps(self.timing)
        return _bound(least, 2, self.step_limit)

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: The block cannot be reached.
        """
        script = _script(self._way(state, objects), self.timing, GRIP, LIFT)
        return Follow(script, self.timing.step)

    def _way(self, state: State, objects: tuple[Object, ...]) -> Way:
        _, block, _ = objects
        return _way_to_grasp(state, block)


@dataclass(frozen=True)
class PlaceOnSkill:
    """Put the held block onto the middle of the target or of another block."""

    name: str
    timing: Timing
    step_limit: int = STEP_LIMIT
    least_steps: int = 2  # down, release

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The way to the place, and the release."""
        least = self._way(state, objects).least_steps(self.timing)
        return _bound(least, 1, self.step_limit)

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: The place cannot be reached.
        """
        script = _script(self._way(state, objects), self.timing, RELEASE, 0.0)
        return Follow(script, self.timing.step)

    def _way(self, state: State, objects: tuple[Object, ...]) -> Way:
        _, _, thing = objects
        x, y, _ = _pose(state, thing).position
        return _way_to_place(state, (x, y), _yaw(_pose(state, thing)), thing)


@dataclass(frozen=True)
class PlaceSkill:
    """Put the held block down on the nearest place of the table that can be reached."""

    name: str
    timing: Timing
    step_limit: int = STEP_LIMIT
    least_steps: int = 2  # down, release

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The way to the nearest of the places that it may be, and the release."""
        _, block, table = objects
        least = math.inf
        for way in _ways_to_table(state, block, table):
            least = min(least, way.least_steps(self.timing))
            if way.is_open:
                break
        return _bound(least, 1, self.step_limit)

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: No place can be reached.
        """
        _, block, table = objects
        for way in _ways_to_table(state, block, table):
            try:
                return Follow(_script(way, self.timing, RELEASE, 0.0), self.timing.step)
            except SkillNotApplicableError:
                continue
        raise SkillNotApplicableError(f"no place on the table can be reached with {block}")


@lru_cache(maxsize=REMEMBERED)
def _way_to_grasp(state: State, block: Object) -> Way:
    """The way to a grasp from above, fingers along the faces of the block."""
    pose = _pose(state, block)
    grasps = [_from_above(pose.position, yaw) for yaw in _quarter_turns(_yaw(pose))]
    return Way(state, grasps, touched=(block,))


def _ways_to_table(state: State, block: Object, table: Object) -> Iterator[Way]:
    """The ways to free places on the table, in the order in which they are tried."""
    yaw = _yaw(_pose(state, block))
    for place in _places(state, block, table):
        yield _way_to_place(state, place, yaw, table)


@lru_cache(maxsize=REMEMBERED)
def _way_to_place(state: State, place: tuple[float, float], yaw: float, thing: Object) -> Way:
    """The way on which the held block comes to stand on a thing at a place.

    However the hand is tilted now, it points down there: so the block was grasped.
    """
    block, grasp = _held(state), _grasp(state)
    if block is None:
        raise SkillNotApplicableError("nothing is held")
    height = _top(state, thing) + _box(state, block).half[2] + DROP
    in_hand = _yaw(_from_above(ORIGIN, 0.0).compose(grasp))
    ends = []
    for turned_yaw in _quarter_turns(yaw):
        upright = _from_above(ORIGIN, turned_yaw - in_hand).compose(grasp).quaternion
        ends.append(Pose((*place, height), upright).compose(grasp.inverse()))
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
