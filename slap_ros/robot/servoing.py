# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Actions on a hand as short motions of the arm's joints, each of which replaces the one before.

The contact world pulls its hand to a target by a force. A robot pulls its joints there instead: to
the configuration in which the hand would be at the target, as far as the joints can go in a control
period. The arm is still on its way when the next action comes.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass

from slap_ros.core import Action
from slap_ros.relational import State
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.limits import Workspace
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S, arm_joints
from slap_ros.worlds.contact.command import HandCommand, commanded
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.contact.world import ACTION_SPACE
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN, GraspKinematics


@dataclass(frozen=True)
class ServoCommand:
    """What a robot is told for a control period.

    Args:
        gripper: What the gripper begins to do; nothing waits for it.
        points: Motion of the joints from where they were told to be to where they are to be at the
            period's end, straight. Where they are by then is another matter: an arm lags.
    """

    gripper: GripperAction
    points: tuple[TrajectoryPoint, TrajectoryPoint]


class HandServo:
    """Turns actions of the contact world into commands of a robot, and knows the last one.

    Args:
        index: Places of the scene's features in a state.
        state: State in which the arm stands where it was told to be.
        workspace: Space in which the fingertips may be told to be.
    """

    def __init__(self, index: ContactIndex, state: State, workspace: Workspace) -> None:
        self._index, self._workspace = index, workspace
        snapshot = index.read(state)
        self._command, self._joints = HandCommand.of(snapshot.hand), snapshot.joints

    @property
    def command(self) -> HandCommand:
        """The part of a state that nothing measures: what the hand was told last."""
        return self._command

    def act(self, measured: State, action: Action) -> ServoCommand:
        """The command of an action.

        Args:
            measured: State that the action answers, with :attr:`command` in it.
            action: Action of the contact world.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing is commanded.
            UnsafeCommandError: The fingertips would leave the workspace; nothing is commanded.
        """
        ACTION_SPACE.check(action)
        now = self._index.read(measured)
        moved = commanded(now.hand, now.joints, action)
        joints = arm_joints(moved.pull()) or self._joints  # on the way around what is out of reach
        self._workspace.require(joints)
        gripper = GripperAction.KEEP
        if moved.hand.closing != self._command.closing:
            gripper = GripperAction.CLOSE if moved.hand.closing else GripperAction.OPEN
        points = TrajectoryPoint(0.0, self._joints), TrajectoryPoint(CONTROL_PERIOD_S, joints)
        self._command, self._joints = HandCommand.of(moved.hand), joints
        return ServoCommand(gripper, points)


def moving_hand(
    joints: Sequence[float],
    joint_velocities: Sequence[float],
    fingers: tuple[float, float],
    finger_velocities: tuple[float, float],
    command: HandCommand,
) -> HandState:
    """The hand as encoders have it, with what it was told.

    Args:
        joints: Joint positions, rad, shape (7,).
        joint_velocities: Joint velocities, rad/s, shape (7,).
        fingers: Distance of the left and of the right finger from the middle, m.
        finger_velocities: How fast the left and the right finger open, m/s.
        command: What the hand was told last.
    """
    kinematics = GraspKinematics(joints)
    rows = kinematics.jacobian().tolist()
    vx, vy, vz, wx, wy, wz = (sum(map(operator.mul, row, joint_velocities)) for row in rows)
    left, right = (min(max(at, FINGER_CLOSED), FINGER_OPEN) for at in fingers)
    return HandState(
        kinematics.grasp,
        (vx, vy, vz),
        (wx, wy, wz),
        command.target,
        command.target_yaw,
        (left, right),
        finger_velocities,
        command.closing,
    )
