# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From the frame in which something is seen to the robot's base: chains of static transforms.

The base may hang from another frame itself: many robots have one of the room, ``world``.
"""

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
        seen, base = self._in_ancestors(frame), self._in_ancestors(self._base)
        common = next((name for name in seen if name in base), None)
        if common is None:
            return None
        return (
            seen[common] if common == self._base else base[common].inverse().compose(seen[common])
        )

    def _in_ancestors(self, frame: str) -> dict[str, Pose]:
        """The pose of a frame in itself and in each frame that it hangs from, the nearest first."""
        found, at = {frame: IDENTITY}, frame
        while at in self._parents:
            parent, step = self._parents[at]
            if parent in found:
                break  # a loop
            found[parent] = step.compose(found[at])
            at = parent
        return found
