# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Actions on a hand as short motions of the arm's joints, each of which replaces the one before.

The contact world pulls its hand to a target by a force. A robot pulls its joints there instead: to
the configuration in which the hand would be at the target, as far as the joints can go in a control
period. The arm is still on its way when the next action comes.
"""

from __future__ import annotations

from typing import NamedTuple

from slap_ros.core import Action
from slap_ros.relational import State
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.robot_world import GripperAction
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S, arm_joints
from slap_ros.worlds.contact.command import HandCommand, commanded
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.contact.world import ACTION_SPACE


class ServoCommand(NamedTuple):
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
    """

    def __init__(self, index: ContactIndex, state: State) -> None:
        self._index = index
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
        """
        ACTION_SPACE.check(action)
        now = self._index.read(measured)
        moved = commanded(now.hand, now.joints, action)
        gripper = GripperAction.KEEP
        if moved.hand.closing != self._command.closing:
            gripper = GripperAction.CLOSE if moved.hand.closing else GripperAction.OPEN
        before, self._command = self._joints, HandCommand.of(moved.hand)
        self._joints = arm_joints(moved.pull()) or before  # on a way around what is out of reach
        points = TrajectoryPoint(0.0, before), TrajectoryPoint(CONTROL_PERIOD_S, self._joints)
        return ServoCommand(gripper, points)
