# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What computes motions: machine code where numba can be imported, else numpy.

Both give the same bits, but for straight motions of the hand, which differ by 1e-13 rad. numba is
imported with the first question, for that takes half a second.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Protocol

from slap_ros.geometry.pose import Pose
from slap_ros.motion.joints import Array, Joints, Path

if TYPE_CHECKING:
    from slap_ros.motion.collision_scene import CollisionScene
    from slap_ros.motion.free_space import FreeSpace


class Backend(Protocol):
    """What everything that moves the arm is computed from."""

    def arm_frames(self, q: Joints) -> Array:
        """Forward kinematics; see :func:`slap_ros.motion.kinematics.arm_frames`."""
        ...

    def free_space(self, scene: CollisionScene) -> FreeSpace:
        """The configurations that are free in a scene."""
        ...

    def linear_rows(self, q: Joints, start: Pose, target: Pose, count: int) -> Path | None:
        """See :func:`slap_ros.motion.linear.linear_rows`."""
        ...


@cache
def backend() -> Backend:
    """The faster one that can be had here."""
    try:
        from slap_ros.motion.kernels.compiled_backend import compiled_backend
    except ImportError:
        from slap_ros.motion.numpy_backend import NumpyBackend

        return NumpyBackend()
    return compiled_backend()
