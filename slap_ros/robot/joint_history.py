# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint positions of the last seconds, and what they say of the hand."""

from __future__ import annotations

import math
from collections import deque

from slap_ros.errors import InvalidMeasurementError, NoJointStateError
from slap_ros.geometry.pose import Pose
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import Joints
from slap_ros.robot.servoing import moving_hand
from slap_ros.robot.state_assembly import possible_joints
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.panda import grasp_pose

REMEMBERED = 256  # readings, for where the hand was when something was detected
RATE_S = 0.02  # s, over which the fingers' velocity is taken


class JointHistory:
    """Readings in the order of their stamps."""

    def __init__(self) -> None:
        self._readings: deque[JointReading] = deque(maxlen=REMEMBERED)

    def __len__(self) -> int:
        """The number of readings that are remembered."""
        return len(self._readings)

    def add(self, reading: JointReading) -> None:
        """Take a reading.

        Raises:
            InvalidMeasurementError: It is older than the last one.
        """
        if reading.stamp_s <= self.newest_s:
            raise InvalidMeasurementError("joint positions are not newer than those before")
        self._readings.append(reading)

    @property
    def newest(self) -> JointReading:
        """The newest reading, of which there must be one."""
        return self._readings[-1]

    @property
    def newest_s(self) -> float:
        """Stamp of the newest reading, s; minus infinity without any."""
        return self._readings[-1].stamp_s if self._readings else -math.inf

    @property
    def newest_hand(self) -> Pose:
        """Where the hand was in the newest reading."""
        return grasp_pose(self.newest.joints)

    @property
    def arm_moves(self) -> bool:
        """Whether the arm moved in the newest reading."""
        return bool(self._readings) and not self.newest.at_rest

    def before(self, stamp_s: float) -> JointReading:
        """The last reading before a time, or else the first that is known, never the newest.

        Args:
            stamp_s: The time, s.
        """
        earlier = [one for one in list(self._readings)[:-1] if one.stamp_s <= stamp_s]
        return earlier[-1] if earlier else self._readings[0]

    def hand_before(self, stamp_s: float) -> Pose:
        """Where the hand was in that reading.

        Args:
            stamp_s: The time, s.
        """
        return grasp_pose(self.before(stamp_s).joints)

    def measured_hand(self, told: HandCommand) -> tuple[HandState, Joints]:
        """The hand and the joints of the newest reading, of which there must be two.

        Args:
            told: What the hand was told last.

        Raises:
            NoJointStateError: Fingers are not measured.
        """
        newest, earlier = self.newest, self.before(self.newest_s - RATE_S)
        if newest.gap is None or earlier.gap is None:
            raise NoJointStateError("joint states have no positions of the fingers")
        joints = tuple(possible_joints(newest.joints))
        passed_s, finger = newest.stamp_s - earlier.stamp_s, 0.5 * newest.gap
        opening = 0.5 * (newest.gap - earlier.gap) / passed_s
        rates = newest.velocities or tuple(
            (b - a) / passed_s for a, b in zip(earlier.joints, newest.joints, strict=True)
        )
        hand = moving_hand(joints, rates, (finger, finger), (opening, opening), told)
        return hand, joints
