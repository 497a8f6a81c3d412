# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a real arm may do, checked again right before it is commanded to move.

A motion goes straight from joint positions at rest to others at rest: when nothing more is sent,
the arm stands. Its time course is the quintic with no velocity or acceleration at
either end; it takes as long as velocity and acceleration limits ask for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from slap_ros.errors import InvalidParameterError, UnsafeCommandError
from slap_ros.geometry.pose import Vector
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, JOINTS, MAX_STEP, grasp_pose

# Of the quintic 10 s^3 - 15 s^4 + 6 s^5: its largest first and second derivative.
PEAK_VELOCITY = 1.875
PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)

WORKSPACE_CHECKS = 4  # places on the way at which the workspace is checked
STEP_TOLERANCE = 1e-6  # rad, rounding of a displacement computed as a difference

Joints = tuple[float, ...]


@dataclass(frozen=True)
class Workspace:
    """The box that the point between the fingertips must not leave; m, frame of the base."""

    low: Vector = (0.2, -0.5, 0.08)
    high: Vector = (0.8, 0.5, 0.9)

    def __post_init__(self) -> None:
        if not all(low < high for low, high in zip(self.low, self.high, strict=True)):
            raise InvalidParameterError(f"a workspace from {self.low} to {self.high} m is empty")

    def require(self, q: Joints) -> None:
        """Refuse a configuration outside.

        Raises:
            UnsafeCommandError: Names the axis.
        """
        point = grasp_pose(q).position
        for axis, low, x, high in zip("xyz", self.low, point, self.high, strict=True):
            if not low <= x <= high:
                raise UnsafeCommandError(
                    f"the fingertips would be at {axis} = {x:.4f} m, outside the workspace "
                    f"[{low}, {high}]"
                )


@dataclass(frozen=True)
class JointMotion:
    """A safe motion, from rest to rest. Made by :meth:`Limits.motion` only."""

    start: Joints  # rad
    target: Joints  # rad
    duration_s: float


@dataclass(frozen=True)
class Limits:
    """Limits of an arm; joint by joint.

    Args:
        low: Lower limits of the joint positions, rad.
        high: Upper limits of the joint positions, rad.
        velocity: Largest joint velocities, rad/s.
        acceleration: Largest joint accelerations, rad/s^2.
        step: Largest change of each joint in one command, either way, rad.
        workspace: Space in which the fingertips may be.
    """

    low: Joints
    high: Joints
    velocity: Joints
    acceleration: Joints
    step: Joints = MAX_STEP
    workspace: Workspace = Workspace()

    def motion(
        self, start: Sequence[float], target: Sequence[float], least_s: float
    ) -> JointMotion:
        """The motion to a target.

        Args:
            start: Present joint positions, rad, shape (7,).
            target: Joint positions to go to, rad, shape (7,).
            least_s: Least duration of the motion, s.

        Returns:
            The motion, as long as velocity and acceleration limits ask for.

        Raises:
            UnsafeCommandError: Not finite, beyond a limit, too far for one command, or out of the
                workspace, at the end or on the way; says which.
        """
        at, to = tuple(map(float, start)), tuple(map(float, target))
        self._require_joints(at, to)
        for k in range(1, WORKSPACE_CHECKS + 1):
            part = k / WORKSPACE_CHECKS
            self.workspace.require(tuple(a + part * (b - a) for a, b in zip(at, to, strict=True)))
        return JointMotion(at, to, max(least_s, self._least_duration_s(at, to)))

    def _require_joints(self, start: Joints, target: Joints) -> None:
        if len(start) != JOINTS or len(target) != JOINTS:
            raise UnsafeCommandError(
                f"an arm has {JOINTS} joints, not {len(start)} to {len(target)}"
            )
        for i, (a, b) in enumerate(zip(start, target, strict=True)):
            if not (math.isfinite(a) and math.isfinite(b)):
                raise UnsafeCommandError(f"joint {i + 1} would go from {a} to {b} rad")
            if not self.low[i] <= b <= self.high[i]:
                raise UnsafeCommandError(
                    f"joint {i + 1} would go to {b:.4f} rad, beyond [{self.low[i]}, {self.high[i]}]"
                )
            if abs(b - a) > self.step[i] + STEP_TOLERANCE:
                raise UnsafeCommandError(
                    f"joint {i + 1} would move by {b - a:.4f} rad in one command, which may be "
                    f"{self.step[i]} either way"
                )

    def _least_duration_s(self, start: Joints, target: Joints) -> float:
        way = [abs(b - a) for a, b in zip(start, target, strict=True)]
        by_velocity = (PEAK_VELOCITY * d / v for d, v in zip(way, self.velocity, strict=True))
        by_acceleration = (
            math.sqrt(PEAK_ACCELERATION * d / a)
            for d, a in zip(way, self.acceleration, strict=True)
        )
        return max(*by_velocity, *by_acceleration)

    def scaled(self, fraction: float, workspace: Workspace) -> Limits:
        """The limits at a fraction of the speed, in another workspace.

        Raises:
            InvalidParameterError: The fraction is not within (0, 1].
        """
        if not 0.0 < fraction <= 1.0:
            raise InvalidParameterError(
                f"a fraction of the speed limits is in (0, 1], not {fraction}"
            )
        return Limits(
            self.low,
            self.high,
            tuple(fraction * v for v in self.velocity),
            tuple(fraction * a for a in self.acceleration),
            self.step,
            workspace,
        )


# Franka's data sheets, https://frankaemika.github.io/docs/control_parameters.html
PANDA = Limits(
    low=JOINT_LOW,
    high=JOINT_HIGH,
    velocity=(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    acceleration=(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
)
# Near its limits the FR3 allows less than these velocities: the fraction leaves room for that.
FR3 = Limits(
    low=(-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159),
    high=(2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159),
    velocity=(2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26),
    acceleration=(10.0,) * JOINTS,
)
ARMS: Mapping[str, Limits] = MappingProxyType({"fr3": FR3, "panda": PANDA})  # by joint prefix


def arm_limits(name: str) -> Limits:
    """The limits of an arm.

    Raises:
        InvalidParameterError: It is not known.
    """
    if name not in ARMS:
        raise InvalidParameterError(f"unknown arm {name!r}; there are {', '.join(ARMS)}")
    return ARMS[name]
