# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A body that goes with the hand, since fingers that were told to close stand around it.

Detections are older than encoders, and none come while the hand covers the body: it is where the
hand has it, as far as the last of them said. A camera says where in the hand it is but for the
distance along the line of sight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, cross, rotate
from slap_ros.robot.line_of_sight import across
from slap_ros.robot.tracking import Detection, mean_pose
from slap_ros.worlds.contact.hand import PAD, HandState
from slap_ros.worlds.contact.scene import Part
from slap_ros.worlds.contact.validation import GRASP_GAP
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.settling import AXES
from slap_ros.worlds.validation import share_space

EMPTY = 0.002  # m, from the middle, of each of two fingers that have met


def is_between(hand: HandState, parts: Sequence[Part], pose: Pose) -> bool:
    """Whether both pads of a hand are at a body, or nearly so.

    Args:
        hand: The hand, its fingers where they are.
        parts: Parts of the body.
        pose: Pose of the body.
    """
    if max(hand.fingers) < EMPTY:
        return False
    boxes = [part.bounding_box.at(pose) for part in parts]
    return all(share_space([pad], boxes) for pad in _pads(hand))


def _pads(hand: HandState) -> list[OrientedBox]:
    """The pads of a hand, with a layer in which what they touch may be."""
    return [box.grown(GRASP_GAP) for box in hand.boxes() if box.half == PAD.half_extents_m]


@dataclass(frozen=True)
class CarriedBody:
    """Where in the hand a body is.

    Args:
        index: Index among the free bodies of the scene.
        pose: Pose of the body in the hand's frame.
        since_s: Time since which it goes with the hand; of detections, those that are newer count.
        seen_s: Time of the last detection that was taken into account, s.
    """

    index: int
    pose: Pose
    since_s: float
    seen_s: float

    def seen(self, detection: Detection, hand: Pose) -> CarriedBody:
        """The same body where a detection has it.

        Args:
            detection: Detection, newer than the last one.
            hand: Pose of the hand when it was detected.
        """
        found = detection.pose
        if detection.eye is not None:
            expected = hand.compose(self.pose)
            (x, y, z), p = expected.position, found.position
            off = across((p[0] - x, p[1] - y, p[2] - z), p, detection.eye)
            lateral = Pose((x + off[0], y + off[1], z + off[2]), found.quaternion)
            found = mean_pose([expected, lateral])
        return replace(self, pose=hand.inverse().compose(found), seen_s=detection.stamp_s)

    def centred(self, hand: HandState, parts: Sequence[Part]) -> CarriedBody:
        """The same body in the middle between the fingers, which close alike and have met it.

        Where it was seen last, before the hand covered it, the fingers had not pushed it yet.

        Args:
            hand: The hand now, its fingers where they are.
            parts: Parts of the body.
        """
        pose = hand.pose.compose(self.pose)
        for part in parts:
            box = part.bounding_box.at(pose)
            if all(share_space([pad], [box]) for pad in _pads(hand)):
                aside = _beside_middle(OrientedBox(hand.pose.inverse().compose(box.pose), box.half))
                moved = Pose((0.0, -aside, 0.0)).compose(self.pose)
                return replace(self, pose=moved)
        return self

    def motion(self, hand: HandState) -> BodyState:
        """Where the hand has it, and how it moves.

        Args:
            hand: The hand now.
        """
        pose = hand.pose.compose(self.pose)
        (x, y, z), (px, py, pz) = hand.pose.position, pose.position
        turned = cross(hand.angular_velocity, (px - x, py - y, pz - z))
        vx, vy, vz = (a + b for a, b in zip(hand.velocity, turned, strict=True))
        return BodyState(pose, (vx, vy, vz), hand.angular_velocity)


def _beside_middle(box: OrientedBox) -> float:
    """How far from the middle between the fingers a box is where they have it, m.

    Args:
        box: Box in the hand's frame, whose y is from one finger to the other.
    """
    x, y, z = box.pose.position
    axes = [rotate(box.pose.quaternion, axis) for axis in AXES]
    across = max(range(3), key=lambda i: abs(axes[i][1]))
    for i, (ax, ay, az) in enumerate(axes):
        if i != across:
            along = -(ax * x + ay * y + az * z)
            y += min(max(along, -box.half[i]), box.half[i]) * ay
    return y
