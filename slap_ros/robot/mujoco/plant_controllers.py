# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The controllers of arm and gripper of a plant, in one process: time is the plant's."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from slap_ros.errors import ControllerAbortedError, ControllerTimeoutError
from slap_ros.robot.finger_tracking import FingerTracker
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.limits import JointMotion, Workspace
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.trajectory_tracking import (
    TrajectoryCode,
    TrajectoryTolerances,
    TrajectoryTracker,
)
from slap_ros.worlds.panda import JOINTS

REACH = Workspace((-0.9, -0.9, -0.4), (0.9, 0.9, 1.2))  # m: all that the arm reaches
TOLERANCES = TrajectoryTolerances((0.2,) * JOINTS, (0.05,) * JOINTS, goal_time_s=1.0)
UNCHECKED = TrajectoryTolerances(
    (0.0,) * JOINTS, (0.0,) * JOINTS, stopped=0.0
)  # replaced on the way
STILL = (0.0,) * JOINTS
GRIPPER_TIMEOUT_S = 5.0  # that the fingers may take, as long as the bridge waits


class PlantControllers:
    """Controllers that answer once a motion has ended.

    Args:
        plant: What they move.
        tolerances: Tolerances of the arm's controller.
        finger_force: Largest force of each finger, N.
        watch: Called after each period.
    """

    def __init__(
        self,
        plant: MujocoPlant,
        tolerances: TrajectoryTolerances,
        finger_force: float,
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        self._plant, self._tolerances = plant, tolerances
        self._force, self._watch = finger_force, watch
        self._arm, self._fingers = TrajectoryTracker(plant.joints), FingerTracker()

    @property
    def arm_moves(self) -> bool:
        """Whether a motion of the arm is under way."""
        return self._arm.busy

    def move(self, motion: JointMotion) -> None:
        """Move the arm.

        Raises:
            ControllerAbortedError: The arm is too far from where it should be.
        """
        plant = self._plant
        self._start([TrajectoryPoint(motion.duration_s, motion.target, STILL, STILL)])
        while True:
            self.pass_period()
            outcome = self._arm.check(plant.time_s, plant.joints, plant.joint_velocities)
            if outcome is not None and outcome.code is not TrajectoryCode.SUCCESSFUL:
                raise ControllerAbortedError(f"a motion: {outcome.code.name}, {outcome.reason}")
            if outcome is not None:
                return

    def replace_motion(self, points: Sequence[TrajectoryPoint]) -> None:
        """Begin a motion of the arm in place of the one under way; no time passes.

        Args:
            points: Points of the trajectory, which the arm's control follows in its own way.
        """
        self._start(self._plant.control.replacing(points))

    def _start(self, points: Sequence[TrajectoryPoint]) -> None:
        plant = self._plant
        velocities = plant.joint_velocities
        self._arm.start(points, self._tolerances, plant.time_s, plant.joints, velocities)

    def command_fingers(self, gap: float) -> None:
        """Begin a motion of the fingers; no time passes.

        Args:
            gap: Distance between them to go to, m.
        """
        self._plant.command_fingers(0.5 * gap, self._force)

    def move_fingers(self, gap: float) -> None:
        """Move the fingers until they are there, or stopped.

        Args:
            gap: Distance between them to go to, m.

        Raises:
            ControllerTimeoutError: They do not come to rest.
        """
        plant = self._plant
        self.command_fingers(gap)
        self._fingers.start(gap, plant.time_s)
        until_s = plant.time_s + GRIPPER_TIMEOUT_S
        while self._fingers.check(plant.time_s, plant.gap, plant.gap_velocity) is None:
            if plant.time_s > until_s:
                raise ControllerTimeoutError(f"the fingers still move after {GRIPPER_TIMEOUT_S} s")
            self.pass_period()

    def pass_period(self) -> None:
        """Let a period pass."""
        plant = self._plant
        plant.command(self._arm.command(plant.time_s))
        plant.step()
        self._watch()
