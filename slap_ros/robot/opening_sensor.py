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
from slap_ros.geometry.pose import Pose, dot, rotate
from slap_ros.robot.tracking import PoseEstimate
from slap_ros.worlds.contact.scene import JointedBody, JointKind
from slap_ros.worlds.contact.snapshot import Opening, stopped_at_ends

# By how much a moving part may be seen beside its joint's path, or beyond the end of it. Furniture
# that a person has put in its place is a few millimetres off.
PATH_TOLERANCE_M = 0.02
PATH_TOLERANCE_RAD = 0.1


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
        joint = self.body.joint
        nearest = self.body.moving_pose(
            self.pose, min(max(self._opening_at(seen), 0.0), joint.high)
        )
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
        slides = joint.kind is JointKind.SLIDE
        velocity = dot(axis, estimate.velocity if slides else estimate.spin)
        position = self._opening_at(estimate.pose)
        return Opening(*stopped_at_ends(position, velocity, joint.high))

    def _opening_at(self, seen: Pose) -> float:
        return self.body.joint.opening_at(self.pose.inverse().compose(seen))
