# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From the frame in which something is seen to the robot's base: chains of static transforms."""

from __future__ import annotations

from slap_ros.geometry.pose import IDENTITY, Pose


class StaticTransforms:
    """The static transforms of ``/tf_static``."""

    def __init__(self, base: str) -> None:
        """``base``: the frame of the robot's base."""
        self._base = base
        self._parents: dict[str, tuple[str, Pose]] = {}

    def add(self, parent: str, child: str, pose: Pose) -> None:
        """Take a static transform; a later one of the same child replaces it.

        Args:
            parent: Name of the frame in which the pose is given.
            child: Name of the frame that has that pose.
            pose: Pose of the child in its parent, position in m.
        """
        self._parents[child] = (parent, pose)

    def in_base(self, frame: str) -> Pose | None:
        """The pose of a frame in the base's; None where no chain leads there."""
        pose, visited = IDENTITY, {frame}
        while frame != self._base:
            if frame not in self._parents:
                return None
            frame, step = self._parents[frame]
            if frame in visited:
                return None  # a loop
            visited.add(frame)
            pose = step.compose(pose)
        return pose
