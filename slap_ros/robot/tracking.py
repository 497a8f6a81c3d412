# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where an object is, from noisy detections.

What lies still is averaged and then stays where it is known to be for as long as detections agree
with that: a state that is measured again is the same state. What does not agree has been moved,
and is averaged again.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from slap_ros.errors import InvalidMeasurementError, InvalidParameterError
from slap_ros.geometry.pose import ORIGIN, Pose, Vector, conjugate, multiply
from slap_ros.robot.line_of_sight import across

UNIT_TOLERANCE = 1e-2  # 1, of a measured quaternion's length: further off it is none
SURPRISE = 4.5  # standard deviations beyond which a detection is not explained by noise
LONGEST = 64  # detections remembered


class Detection(NamedTuple):
    """A measured pose."""

    stamp_s: float  # when it was seen
    pose: Pose  # in the base's frame
    frame: str = ""  # in which it was seen: an object may have a tag on each face
    eye: Vector | None = None  # where the camera is; None where distances are as good as the rest


@dataclass(frozen=True)
class TrackingSettings:
    """How well detections can be trusted."""

    position_noise_m: float = 0.002  # standard deviation along each axis
    turn_noise_rad: float = 0.01  # standard deviation about each axis
    confirmations: int = 3  # detections that confirm a place that is known
    initial_detections: int = 10  # detections that make a place known
    # Pictures in a row without an object after which it is hidden: where it was at rest. 0: never.
    hidden_after: int = 0

    def __post_init__(self) -> None:
        if min(self.position_noise_m, self.turn_noise_rad) <= 0.0:
            raise InvalidParameterError("the noise of detections is above 0")
        if not 2 <= self.confirmations <= self.initial_detections <= LONGEST:
            raise InvalidParameterError(
                f"2 <= confirmations <= initial_detections <= {LONGEST}, not "
                f"{self.confirmations}, {self.initial_detections}"
            )
        if not 0 <= self.hidden_after <= LONGEST:
            raise InvalidParameterError(
                f"an object is hidden after 0 to {LONGEST} pictures, not {self.hidden_after}"
            )


class PoseEstimate(NamedTuple):
    """What is known of an object's motion."""

    pose: Pose
    velocity: Vector  # m/s
    spin: Vector  # rad/s
    at_rest: bool
    weight: int  # detections behind the pose
    eye: Vector | None = None  # where it was seen from, if by a camera


def measured_pose(position: Sequence[float], quaternion: Sequence[float]) -> Pose:
    """A pose as measured, its quaternion normalised.

    Raises:
        InvalidMeasurementError: Not finite, or a quaternion that is far from length 1.
    """
    if not all(map(math.isfinite, (*position, *quaternion))):
        raise InvalidMeasurementError(f"a pose at {position}, {quaternion} is not finite")
    length = math.hypot(*quaternion)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise InvalidMeasurementError(f"a quaternion has length {length:.3f}, not 1")
    x, y, z = position
    qx, qy, qz, qw = (part / length for part in quaternion)
    return Pose((x, y, z), (qx, qy, qz, qw))


class Track:
    """The detections of one object."""

    def __init__(self, settings: TrackingSettings) -> None:
        self._settings = settings
        self._detections: deque[Detection] = deque(maxlen=LONGEST)
        self._known: PoseEstimate | None = None  # its pose at rest
        self.last_at_rest: PoseEstimate | None = None  # where it is, as long as it is hidden
        self._together: dict[str, Pose] = {}  # of the newest picture, by frame

    def add(self, detection: Detection) -> None:
        """Take a detection; several frames that one picture shows count as their mean.

        Raises:
            InvalidMeasurementError: It is not newer than the last one: late, or sent twice.
        """
        if detection.stamp_s == self.newest_s and detection.frame not in self._together:
            self._together[detection.frame] = detection.pose
            mean = mean_pose(list(self._together.values()))
            self._detections[-1] = Detection(detection.stamp_s, mean, eye=detection.eye)
            return
        if detection.stamp_s <= self.newest_s:
            raise InvalidMeasurementError(
                f"a detection is {self._detections[-1].stamp_s - detection.stamp_s:.3f} s older "
                "than the one before"
            )
        self._detections.append(detection)
        self._together = {detection.frame: detection.pose}

    @property
    def newest_s(self) -> float:
        """Stamp of the newest detection; minus infinity without one."""
        return self._detections[-1].stamp_s if self._detections else -math.inf

    @property
    def newest(self) -> Detection:
        """The newest detection; there must be one."""
        return self._detections[-1]

    def newest_motion(self, since_s: float = -math.inf) -> PoseEstimate | None:
        """The pose and its motion from the last detections; None if they are too few since then.

        They are all there is to know, unless a pose at rest was remembered: what does not explain
        all of them has not moved as long as it explains one, for a tag that is about to be covered
        seems to be elsewhere.

        Args:
            since_s: Time before which detections do not count, s.
        """
        few = [d for d in self._detections if d.stamp_s > since_s][-self._settings.confirmations :]
        if len(few) < self._settings.confirmations:
            return None
        known = self._known
        if known is not None and any(self._near(d.pose, known.pose, 1.0, d.eye) for d in few):
            return known
        return _standing(few) if self._agree(few) else _moving(few)

    def estimate(self, since_s: float) -> PoseEstimate | None:
        """The pose and its motion from detections since then; None if they are too few."""
        fresh = [d for d in self._detections if d.stamp_s > since_s]
        few = fresh[-self._settings.confirmations :]
        if len(few) < self._settings.confirmations:
            return None
        if not self._agree(few):
            return _moving(few)
        if self._known is not None and self._explains(self._known, few):
            return self._merged(self._known, few)
        many = fresh[-self._settings.initial_detections :]
        if len(many) < self._settings.initial_detections:
            return None
        return _standing(many) if self._agree(many) else _moving(many)

    def remember(self, estimate: PoseEstimate) -> None:
        """Keep a pose at rest, against which later detections are compared."""
        self._known = self.last_at_rest = estimate if estimate.at_rest else None

    def expect(self, pose: Pose) -> None:
        """Take a pose as well known: few detections that agree with it confirm it to the bit."""
        self._known = still(pose, self._settings.initial_detections)

    def strayed(self, since_s: float) -> float:
        """How far from its last place at rest it is seen since a time, m; 0 where either lacks."""
        seen, last = self.estimate(since_s), self.last_at_rest
        if seen is None or last is None:
            return 0.0
        return math.dist(seen.pose.position, last.pose.position)

    def forget(self) -> None:
        """Drop the pose at rest: the object was moved on purpose."""
        self._known = self.last_at_rest = None

    def let_go(self, pose: Pose) -> None:
        """Drop the pose at rest: the object was moved on purpose, and let go at a pose."""
        self._known, self.last_at_rest = None, still(pose, self._settings.confirmations)

    def _agree(self, detections: Sequence[Detection]) -> bool:
        """Whether one place explains all of them."""
        middle = mean_pose([d.pose for d in detections])
        return all(self._near(d.pose, middle, 1.0, d.eye) for d in detections)

    def _explains(self, known: PoseEstimate, few: Sequence[Detection]) -> bool:
        spread = math.sqrt(1.0 / len(few) + 1.0 / known.weight)
        return self._near(mean_pose([d.pose for d in few]), known.pose, spread, few[-1].eye)

    def _near(self, pose: Pose, other: Pose, spread: float, eye: Vector | None) -> bool:
        far = SURPRISE * spread * self._settings.position_noise_m
        turned = SURPRISE * spread * self._settings.turn_noise_rad * math.sqrt(3.0)
        offset = [a - b for a, b in zip(pose.position, other.position, strict=True)]
        near = all(abs(part) <= far for part in across(offset, pose.position, eye))
        return near and pose.angle_to(other) <= turned

    def _merged(self, known: PoseEstimate, few: Sequence[Detection]) -> PoseEstimate:
        """A little better known; what is known well enough stays the same to the bit."""
        if known.weight >= self._settings.initial_detections:
            return known
        weight = known.weight + len(few)
        poses = [known.pose] * known.weight + [d.pose for d in few]
        return still(mean_pose(poses), weight, few[-1].eye)


def mean_pose(poses: Sequence[Pose]) -> Pose:
    """The mean of poses that differ by little."""
    n = len(poses)
    x, y, z = (sum(p.position[i] for p in poses) / n for i in range(3))
    first = poses[0].quaternion
    total = [0.0] * 4
    for pose in poses:
        q = pose.quaternion
        sign = math.copysign(1.0, sum(a * b for a, b in zip(first, q, strict=True)))
        total = [t + sign * part for t, part in zip(total, q, strict=True)]
    length = math.hypot(*total)
    qx, qy, qz, qw = (part / length for part in total)
    return Pose((x, y, z), (qx, qy, qz, qw))


def _standing(detections: Sequence[Detection]) -> PoseEstimate:
    return still(mean_pose([d.pose for d in detections]), len(detections), detections[-1].eye)


def still(pose: Pose, weight: int, eye: Vector | None = None) -> PoseEstimate:
    """What is known of an object that does not move.

    Args:
        pose: Pose of the object.
        weight: Number of detections behind the pose.
        eye: Where the camera is that saw it, m; None without one.
    """
    return PoseEstimate(pose, ORIGIN, ORIGIN, at_rest=True, weight=weight, eye=eye)


def _moving(detections: Sequence[Detection]) -> PoseEstimate:
    """Velocities from the first to the last of the detections."""
    first, last = detections[0], detections[-1]
    dt = last.stamp_s - first.stamp_s
    vx, vy, vz = (
        (b - a) / dt for a, b in zip(first.pose.position, last.pose.position, strict=True)
    )
    x, y, z, w = multiply(last.pose.quaternion, conjugate(first.pose.quaternion))
    sine, sign = math.hypot(x, y, z), math.copysign(1.0, w)
    rate = sign * 2.0 * math.atan2(sine, abs(w)) / (sine * dt) if sine > 0.0 else 0.0
    return PoseEstimate(last.pose, (vx, vy, vz), (x * rate, y * rate, z * rate), False, 1)
