# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot as a node moves it: the world it stands in, its sensors and its controllers."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from rclpy.task import Future

from ensemble.futures import wait_for_first
from ensemble.robot_parameters import PointToPointParameters, action_name, arm_joints
from ensemble.steady_time import JumpFreeClock
from robot_bridge.controllers import Controllers
from robot_bridge.sensors import Sensors
from slap_ros.core import Domain
from slap_ros.errors import ControllerAbortedError, NoDetectionError, NoJointStateError
from slap_ros.relational import State
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.robot_world import RobotWorld
from slap_ros.robot.scene_config import chosen_scene_config

HELD_GAP = 0.002  # m between fingers that closed, above which there is something between them
GAP_AGE = 0.1  # s, by which finger positions may be older than their stamp: drivers merge them


class Robot:
    """A robot: its world as far as it is measured, and its controllers."""

    def __init__(
        self,
        node: Node,
        domain: Domain,
        sampled: Callable[[], State],
        settings: PointToPointParameters,
    ) -> None:
        """Subscribe to its sensors and connect to its controllers.

        Args:
            node: Node that subscribes and connects.
            domain: What the robot is to do.
            sampled: The state whose objects there are, where no scene says which.
            settings: Parameters of the robot.

        Raises:
            InvalidParameterError: An unknown arm, or a speed or workspace that there is not.
            InvalidSceneError: The scene file is missing or malformed.
        """
        self._node, self._settings = node, settings
        self.clock = JumpFreeClock(node)
        scene_config = chosen_scene_config(settings.scene, domain, sampled)
        self.world = RobotWorld(domain, scene_config, settings.limits, settings.tracking)
        self.sensors = Sensors(node, self.world, settings, self.clock)
        self.controllers = Controllers(
            node,
            action_name(settings.trajectory_action, settings.arm),
            action_name(settings.gripper_action, settings.arm),
            arm_joints(settings.arm),
            settings.controller_timeout,
        )

    def destroy(self) -> None:
        """Hold, and release clients and world."""
        self.controllers.hold()
        self.controllers.destroy()
        self.world.close()

    def no_detection(self, since_s: float, when: str) -> NoDetectionError:
        """The error that names what was not detected since then."""
        missing = self.world.what_is_missing(since_s)
        seldom = ", ".join(self.world.seldom_detected(since_s))
        too_few = f"; too few times: {seldom}" if seldom else ""
        return NoDetectionError(f"not detected {when}: {missing}{too_few}")

    async def actuate_gripper(self, action: GripperAction) -> None:
        """Close the fingers around what the world expects there, or open them.

        Raises:
            SlapError: As :meth:`move_fingers`.
        """
        if action.gap is None:
            return
        gap = await self.move_fingers(action.gap)
        if action is GripperAction.OPEN:
            self.world.confirm_release()
        elif not self.world.confirm_grasp(gap):  # closed around nothing
            await self.actuate_gripper(GripperAction.OPEN)

    async def move_fingers(self, gap: float) -> float:
        """Move the fingers to ``gap`` m, or until they stall; the gap in m at which they stand.

        Raises:
            ControllerRejectedError, ControllerTimeoutError: Of the gripper.
            ControllerAbortedError: Of the gripper; also if it aborted and the fingers, which
                stalled, hold nothing.
            NoJointStateError: No joint state has their positions.
        """
        settings = self._settings
        reached = await self.controllers.move_gripper(
            gap * settings.gripper_scale, settings.gripper_effort, settings.gripper_timeout
        )
        found = await self._measured_gap()
        if not reached and found <= gap + HELD_GAP:
            raise ControllerAbortedError(
                f"the gripper gave up a goal of {gap:.3f} m: the fingers stalled {found:.3f} m "
                "apart and hold nothing"
            )
        return found

    async def _measured_gap(self) -> float:
        """The gap in m that joint states have from now on.

        Raises:
            NoJointStateError: None has it in time.
        """
        settings, sensors = self._settings, self.sensors
        done_s = self.clock.now_s() + GAP_AGE
        late_s = done_s + settings.joint_timeout
        await wait_for_first(
            self._node,
            Future(),
            lambda: sensors.gap_s > done_s or self.clock.now_s() > late_s,
        )
        if sensors.gap is None or sensors.gap_s <= done_s:
            raise NoJointStateError(
                f"no positions of the fingers within {settings.joint_timeout} s"
                f"{sensors.joint_advice or ': are they among joint_states?'}"
            )
        return sensors.gap
