# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills that follow one of several transits, then grip or let go, then lift."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from slap_ros.core import Action, Policy
from slap_ros.domains.tabletop.memory import memoized
from slap_ros.domains.tabletop.state_access import joints_of
from slap_ros.domains.tabletop.timing import ROUNDING, Timing
from slap_ros.domains.tabletop.transit import Transit
from slap_ros.errors import SkillNotApplicableError
from slap_ros.geometry.pose import Pose
from slap_ros.motion import Joints, linear_motion, shifted
from slap_ros.portable_math import on_grid
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.panda import grasp_pose

STEP_LIMIT = 100  # environment steps
GRIP, RELEASE = 1.0, -1.0  # gripper commands
LAG = 0.005  # rad, by which an arm may be late without being waited for
TRIES = 3  # for a position
AIM = 0.009  # m, between the fingers' middle and that of what they close around
AIM_STEPS = 40  # environment steps, at most, to bring the fingers there
# Steps of the arm's fastest way to a goal, counted in whole ones. Coming down on it by CLEARANCE
# takes 1.05 or more, and together with the way to over it, from where the hand pointed down TRAVEL
# away, 2.05 or more: the least of all configurations (python -m benchmarks.travel).
APPROACH_STEPS, TRAVEL_STEPS = 2, 3
TRAVEL = 0.09  # m


def _nowhere(_: State) -> bool:
    return False


# The transits of a skill from a state, in the order in which they are tried.
Transits = Callable[[State, tuple[Object, ...]], Iterable[Transit]]
Trajectory = Sequence[tuple[Joints, float]]  # joint positions, rad, each with a gripper command


@dataclass(frozen=True)
class Aim:
    """What fingers are to close around, which may be moved while the arm comes near.

    Args:
        thing: What is to be grasped.
        planned: Pose of it for which the motion was planned, base's frame.
    """

    thing: Object
    planned: Pose

    @classmethod
    def at(cls, thing: Object, state: State) -> Aim:
        """At a thing where it is now."""
        return cls(thing, pose_of(state, thing))

    def corrected(self, grasp: Joints, state: State) -> Joints | None:
        """Joint positions to go to before the fingers close; None where they are around it.

        Args:
            grasp: Joint positions of the planned grasp, rad, shape (7,).
            state: State in which the fingers would close.
        """
        (x, y, z), (x0, y0, z0) = pose_of(state, self.thing).position, self.planned.position
        wanted = shifted(grasp_pose(grasp), (x - x0, y - y0, z - z0))
        if math.dist(grasp_pose(joints_of(state)).position, wanted.position) <= AIM:
            return None
        way = linear_motion(grasp, wanted)
        return grasp if way is None else on_grid(way[-1])


class TrajectoryFollower:
    """A policy that goes to waypoints one after the other, with a gripper command at each.

    Closed loop: each action is the difference from where the arm is. A real arm lags behind; where
    the difference is more than a step may be, the action is as far in that direction as it may be.
    If that leaves more than LAG, the same waypoint is tried again, a few times at most, as an arm
    that is blocked never gets there. Fingers close once they are around what is aimed at, or the
    arm does not move any more: an arm that shakes, or has pushed it, would close them beside it.
    """

    def __init__(
        self, trajectory: Trajectory, max_step: Sequence[float], aim: Aim | None = None
    ) -> None:
        """Begin with the first waypoint.

        Args:
            trajectory: See :data:`Trajectory`.
            max_step: Largest displacement of each joint in a step, rad.
            aim: What the fingers are to close around; None where they close wherever they are.
        """
        # Motion planning rounds its last bit as the processor does. Contact amplifies that.
        self._trajectory = deque((on_grid(position), grip) for position, grip in trajectory)
        self._max_step = np.array(max_step)
        self._tries = TRIES
        self._aim, self._aim_steps = aim, AIM_STEPS
        self._aimed_from: Joints | None = None  # where the arm was when it was last sent there

    def __call__(self, state: State) -> Action | None:
        """The next action; None at the end of the trajectory."""
        if not self._trajectory:
            return None
        position, gripper = self._trajectory[0]
        if gripper == GRIP and (better := self._corrected(position, state)) is not None:
            self._aim_steps -= 1
            missing = better - joints_of(state)
            return np.array([*(missing / max(1.0, self._excess(missing))), 0.0])
        missing = position - joints_of(state)
        excess = self._excess(missing)
        if excess <= 1.0 + ROUNDING:
            self._next()
            return np.array([*missing, gripper])
        self._tries -= 1
        if self._tries == 0 or float(np.abs(missing).max()) * (1.0 - 1.0 / excess) <= LAG:
            self._next()
        else:
            gripper = 0.0  # not yet
        return np.array([*(missing / excess), gripper])

    def _corrected(self, grasp: Joints, state: State) -> Joints | None:
        """Where the arm goes before the fingers close; None where they are to close now."""
        if self._aim is None or self._aim_steps == 0:
            return None
        before, self._aimed_from = self._aimed_from, joints_of(state)
        if before is not None and float(np.abs(self._aimed_from - before).max()) <= LAG:
            return None  # something is in its way
        return self._aim.corrected(grasp, state)

    def _excess(self, missing: Joints) -> float:
        """A displacement in steps of the arm."""
        return float((np.abs(missing) / self._max_step).max())

    def _next(self) -> None:
        self._trajectory.popleft()
        self._tries = TRIES


@dataclass(frozen=True)
class TransitSkill:
    """Follow the first transit that can be planned; then grip or let go; then lift.

    Where none has a goal that can be reached, they are tried with a higher approach: a shortcut may
    leave a block so close to a place that another, held over it, would touch the top of the first.

    Args:
        name: Name of the operator.
        timing: Timing of the paths.
        transits: Function that gives the transits to try; see :data:`Transits`.
        gripper: The gripper command at the goal; it grips the second of the skill's objects.
        lift: Height to which the hand is lifted after the gripper command, m.
        travels: Function that says of a state whether, in plans that begin in it, the hand goes to
            another place than where it was left, at least TRAVEL away, unless the skill undoes what
            the one before did.
        step_limit: Environment steps after which the skill fails.
    """

    name: str
    timing: Timing
    transits: Transits
    gripper: float
    lift: float = 0.0
    travels: Callable[[State], bool] = _nowhere
    step_limit: int = STEP_LIMIT

    @property
    def least_steps(self) -> int:
        """One step to the goal, one for the gripper, one to lift."""
        return 1 + self._after

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The bound of the shortest transit that may be followed, and what comes after it."""
        least = _least_steps(self, state, objects)
        # Without a transit there is no roll-out, so that any bound is admissible.
        return self.step_limit if math.isinf(least) else int(least) + self._after

    def least_steps_in_plans(self, initial: State, follows: bool) -> int:
        """See :class:`~slap_ros.core.ProvingSkill`."""
        is_far = follows and self.travels(initial)
        return (TRAVEL_STEPS if is_far else APPROACH_STEPS) + self._after

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: None of the transits can be planned.
        """
        for transit in self.ways(state, objects):
            try:
                trajectory = self._trajectory(transit)
            except SkillNotApplicableError:
                continue
            aim = Aim.at(objects[1], state) if self.gripper == GRIP else None
            return TrajectoryFollower(trajectory, self.timing.max_step, aim)
        raise _no_transit(self.name, objects)

    @property
    def _after(self) -> int:
        return 2 if self.lift > 0.0 else 1

    def ways(self, state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
        """The transits, in the order in which they are tried."""
        tried = []
        for transit in self.transits(state, objects):
            tried.append(transit)
            yield transit
        if not any(transit.is_reachable for transit in tried):
            for transit in tried:
                yield transit.from_higher()

    def _trajectory(self, transit: Transit) -> Trajectory:
        paths = transit.paths()
        end = paths[-1][-1]
        positions = self.timing.positions(paths, transit.touching)
        trajectory = [*((position, 0.0) for position in positions), (end, self.gripper)]
        if self.lift > 0.0:
            up = linear_motion(end, shifted(grasp_pose(end), (0.0, 0.0, self.lift)))
            if up is None:
                raise SkillNotApplicableError("the arm cannot lift from the grasp")
            lift = self.timing.positions([up], transit.touching)
            trajectory += [(position, 0.0) for position in lift]
        return trajectory


@memoized
def _least_steps(skill: TransitSkill, state: State, objects: tuple[Object, ...]) -> float:
    """The bound of the shortest transit: every search in a graph asks for it again."""
    least, before = math.inf, None
    for transit in skill.ways(state, objects):
        if before is not None and before.is_open:
            break
        least, before = min(least, transit.least_steps(skill.timing)), transit
    return least


@dataclass(frozen=True)
class ReachSkill:
    """Go over what could be grasped, and stay there.

    Where no transit has an approach, it goes over the goals of the last one: there the domain says
    where the hand is to be over something that cannot be grasped.

    It ends as soon as the domain's predicate holds, which may be some steps before the end of its
    path: so it has no better lower bound than one step.
    """

    name: str
    timing: Timing
    transits: Transits
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """One step, whatever the state; see the class."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: No transit leads over it.
        """
        transits = list(self.transits(state, objects))
        for transit, approachable in [*((t, True) for t in transits), (transits[-1], False)]:
            try:
                positions = self.timing.positions(transit.paths_over(approachable), transit.free)
            except SkillNotApplicableError:
                continue
            trajectory = [(position, 0.0) for position in positions]
            return TrajectoryFollower(trajectory, self.timing.max_step)
        raise _no_transit(self.name, objects)


def _no_transit(name: str, objects: tuple[Object, ...]) -> SkillNotApplicableError:
    named = ", ".join(obj.name for obj in objects)
    return SkillNotApplicableError(f"{name}({named}): there is no way for the arm")
