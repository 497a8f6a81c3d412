# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far a drawer or a lid is open, from where its moving part is detected.

A tag on a drawer's front or on a lid has one way to go, that of the joint. Where along it the tag
is seen says how far the joint is open. What is seen beside it is no measurement: the tag is on
something else, or the frame of the furniture stands elsewhere than the scene has it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from slap_ros.errors import InvalidMeasurementError
from slap_ros.geometry.pose import Pose, Vector, dot, rotate
from slap_ros.robot.tracking import PoseEstimate
from slap_ros.worlds.contact.scene import JointedBody, JointKind
from slap_ros.worlds.contact.snapshot import Opening, stopped_at_ends

# By how much a moving part may be seen beside its joint's path, or beyond the end of it. Furniture
# that a person has put in its place is a few millimetres off.
PATH_TOLERANCE_M = 0.02
PATH_TOLERANCE_RAD = 0.1
# Squared sine of the angle between a way and a line of sight, below which the way is seen head-on.
HEAD_ON = 0.1


@dataclass(frozen=True)
class OpeningSensor:
    """Measures the joint of a drawer or a lid.

    Args:
        body: Frame, moving part, and the joint between them.
        pose: Pose of the frame in the robot's base.
    """

    body: JointedBody
    pose: Pose

    def require_on_path(self, seen: Pose) -> None:
        """Refuse a pose that the joint cannot give its moving part.

        Args:
            seen: Pose of the moving part's frame in the robot's base, as detected.

        Raises:
            InvalidMeasurementError: It is too far from the joint's path; says how far.
        """
        nearest = self._nearest(seen)
        off, turned = math.dist(seen.position, nearest.position), seen.angle_to(nearest)
        if off > PATH_TOLERANCE_M or turned > PATH_TOLERANCE_RAD:
            raise InvalidMeasurementError(
                f"what opens of {self.body.name} is detected {off:.3f} m and {turned:.2f} rad away "
                f"from where its joint can have it, at most {PATH_TOLERANCE_M} m and "
                f"{PATH_TOLERANCE_RAD} rad: is the tag on another thing, or does "
                f"{self.body.name} stand elsewhere?"
            )

    def opening(self, estimate: PoseEstimate) -> Opening:
        """How far the joint is open, and how fast it opens.

        Args:
            estimate: What is known of the moving part's motion in the robot's base.

        Returns:
            Within the joint's range; at an end of it, it does not go further.
        """
        joint = self.body.joint
        axis = rotate(self.pose.compose(joint.mount).quaternion, joint.axis)
        if joint.kind is JointKind.TURN:
            position, velocity = self._opening_at(estimate.pose), dot(axis, estimate.spin)
        else:
            measured = _in_sight(axis, estimate)
            shut = self.body.moving_pose(self.pose, 0.0).position
            position = dot(measured, estimate.pose.position) - dot(measured, shut)
            velocity = dot(measured, estimate.velocity)
        return Opening(*stopped_at_ends(position, velocity, joint.high))

    def likelier(self, first: Pose, second: Pose) -> Pose:
        """The one of two poses of the moving part that is turned as its joint can have it.

        Args:
            first: Pose in the robot's base; taken where both are as likely.
            second: Another one.
        """
        return min(first, second, key=lambda pose: pose.angle_to(self._nearest(pose)))

    def _nearest(self, seen: Pose) -> Pose:
        opening = min(max(self._opening_at(seen), 0.0), self.body.joint.high)
        return self.body.moving_pose(self.pose, opening)

    def _opening_at(self, seen: Pose) -> float:
        return self.body.joint.opening_at(self.pose.inverse().compose(seen))


def _in_sight(axis: Vector, estimate: PoseEstimate) -> Vector:
    """What measures how far something is along an axis: its product with an offset.

    It is the axis itself, where no camera saw the thing. Else it is at a right angle to the line of
    sight, because along that, places are off by a centimetre.

    Args:
        axis: Unit vector in the robot's base.
        estimate: What is known of the thing's motion.
    """
    if estimate.eye is None:
        return axis
    offset = [a - b for a, b in zip(estimate.pose.position, estimate.eye, strict=True)]
    sight = [part / math.hypot(*offset) for part in offset]
    along = sum(a * b for a, b in zip(axis, sight, strict=True))
    x, y, z = (a - along * s for a, s in zip(axis, sight, strict=True))
    across = 1.0 - along * along
    return (x / across, y / across, z / across) if across > HEAD_ON else axis
