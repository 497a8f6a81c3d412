# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded motion in the parts that the arm executes without a stop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from slap_ros.robot.blending import STANDS, BlendedMotion, MotionLimits, blend
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.limits import JointMotion, Joints
from slap_ros.robot.recorded_motion import RecordedWaypoint


@dataclass(frozen=True)
class Stretch:
    """A part of a recording from rest to rest, after the gripper acted.

    Args:
        waypoints: Waypoints of the recording. Only at the first one does the gripper act.
        start: Where the arm begins, rad.
        points: Points of the trajectory; none where the arm stands still.
        steps: Steps of the recording at whose ends these points are reached.
    """

    waypoints: tuple[RecordedWaypoint, ...]
    start: Joints
    points: tuple[TrajectoryPoint, ...]
    steps: tuple[int, ...]

    @property
    def duration_s(self) -> float:
        """How long the arm moves, s."""
        return self.points[-1].time_s if self.points else 0.0

    @classmethod
    def of(cls, waypoint: RecordedWaypoint, motion: JointMotion) -> Stretch:
        """The stretch of a single waypoint."""
        still = (0.0,) * len(motion.target)
        point = TrajectoryPoint(motion.duration_s, motion.target, still, still)
        return cls((waypoint,), motion.start, (point,), (waypoint.step,))


def blended_stretches(
    start: Joints, waypoints: Sequence[RecordedWaypoint], limits: MotionLimits, least_s: float
) -> list[tuple[Stretch, BlendedMotion | None]]:
    """A recording in stretches that end only where the gripper acts.

    Args:
        start: Where the arm begins, rad.
        waypoints: Waypoints of the recording.
        limits: What its motions must keep to.
        least_s: Least duration of a step, s.

    Returns:
        Stretches, each with its motion; None for one in which the arm stands still.
    """
    found: list[tuple[Stretch, BlendedMotion | None]] = []
    at = start
    for part in _parts(waypoints):
        places, steps = [at], []
        for waypoint in part:
            if max(abs(a - b) for a, b in zip(places[-1], waypoint.joints, strict=True)) > STANDS:
                places.append(waypoint.joints)
                steps.append(waypoint.step)
        motion = blend(places, limits, least_s) if steps else None
        points = motion.points if motion else ()
        found.append((Stretch(tuple(part), at, points, tuple(steps)), motion))
        at = part[-1].joints
    return found


def _parts(waypoints: Sequence[RecordedWaypoint]) -> Iterator[list[RecordedWaypoint]]:
    """Waypoints up to the next action of the gripper."""
    part: list[RecordedWaypoint] = []
    for waypoint in waypoints:
        if part and waypoint.gripper is not GripperAction.KEEP:
            yield part
            part = []
        part.append(waypoint)
    if part:
        yield part
