# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills that go one of several ways, then grip or let go, then lift."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from slap_ros.core import Action, Policy
from slap_ros.domains.tabletop.state_access import joints_of
from slap_ros.domains.tabletop.timing import ROUNDING, Timing
from slap_ros.domains.tabletop.transit import Transit
from slap_ros.errors import SkillNotApplicableError
from slap_ros.motion import Joints, linear_motion, shifted
from slap_ros.physics.panda import grasp_pose
from slap_ros.relational import Object, State

STEP_LIMIT = 100  # environment steps
GRIP, RELEASE = 1.0, -1.0  # gripper commands
LAG = 0.005  # rad, by which an arm may be late without being waited for
TRIES = 3  # for a position

# To where it may go from a state, in the order in which it is tried.
Transits = Callable[[State, tuple[Object, ...]], Iterable[Transit]]


class TrajectoryFollower:
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
        missing = position - joints_of(state)
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


@dataclass(frozen=True)
class TransitSkill:
    """Go the first way that can be gone; then grip or let go; then lift.

    Args:
        name: The operator's.
        timing: How fast.
        ways: Where to; see :data:`Transits`.
        gripper: The gripper command at the end of the way.
        lift: How far to go up after it, m.
        step_limit: Environment steps.
    """

    name: str
    timing: Timing
    ways: Transits
    gripper: float
    lift: float = 0.0
    step_limit: int = STEP_LIMIT

    @property
    def least_steps(self) -> int:
        """There, grip, up."""
        return 1 + self._after

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """The shortest of the ways that it may be, and what comes after it."""
        least, before = math.inf, None
        for way in self.ways(state, objects):
            if before is not None and before.is_open:
                break
            least, before = min(least, way.least_steps(self.timing)), way
        # What cannot be gone is never too short.
        return self.step_limit if math.isinf(least) else int(least) + self._after

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: None of the ways can be gone.
        """
        for way in self.ways(state, objects):
            try:
                return TrajectoryFollower(self._script(way), self.timing.step)
            except SkillNotApplicableError:
                continue
        raise _no_way(self.name, objects)

    @property
    def _after(self) -> int:
        return 2 if self.lift > 0.0 else 1

    def _script(self, way: Transit) -> list[tuple[Joints, float]]:
        pieces = way.pieces()
        end = pieces[-1][-1]
        script = [(position, 0.0) for position in self.timing.positions(pieces, way.touching)]
        script.append((end, self.gripper))
        if self.lift > 0.0:
            up = linear_motion(end, shifted(grasp_pose(end), (0.0, 0.0, self.lift)))
            if up is None:
                raise SkillNotApplicableError("the arm cannot lift from the grasp")
            script += [(position, 0.0) for position in self.timing.positions([up], way.touching)]
        return script


@dataclass(frozen=True)
class ReachSkill:
    """Go over what could be grasped, and stay there.

    Where none of its ways can be gone to the end, it goes over the ends of the last one: there the
    domain says how to look at what cannot be grasped.

    It is at its end as soon as it is over it as far as the domain cares, which may be some steps
    before the end of its way: so that bounds its steps by little.
    """

    name: str
    timing: Timing
    ways: Transits
    step_limit: int = STEP_LIMIT
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """A step."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Plan the motion.

        Raises:
            SkillNotApplicableError: There is no way over it.
        """
        ways = list(self.ways(state, objects))
        for way, can_end in [*((way, True) for way in ways), (ways[-1], False)]:
            try:
                positions = self.timing.positions(way.pieces_over(can_end), way.free)
            except SkillNotApplicableError:
                continue
            return TrajectoryFollower([(position, 0.0) for position in positions], self.timing.step)
        raise _no_way(self.name, objects)


def _no_way(name: str, objects: tuple[Object, ...]) -> SkillNotApplicableError:
    named = ", ".join(obj.name for obj in objects)
    return SkillNotApplicableError(f"{name}({named}): there is no way for the arm")
