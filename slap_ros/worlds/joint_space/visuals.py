# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a camera sees of the joint-space world: the shapes of all bodies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from slap_ros.meshes.solid import Solid
from slap_ros.relational import State
from slap_ros.worlds.joint_space.scene import Body, Scene
from slap_ros.worlds.joint_space.snapshot import SceneIndex
from slap_ros.worlds.visuals import Configuration, VisualShape


class SceneVisuals:
    """The bodies of a scene, as :class:`~slap_ros.worlds.visuals.Visuals`."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._looks = [tuple(_looks(body)) for body in (*scene.free, *scene.fixed)]

    @property
    def shapes(self) -> Sequence[VisualShape]:
        """See :class:`~slap_ros.worlds.visuals.Visuals`."""
        return [shape for look in self._looks for shape in look]

    def configuration(self, state: State) -> Configuration:
        """See :class:`~slap_ros.worlds.visuals.Visuals`."""
        codec = SceneIndex.of(self._scene, state.layout)
        snapshot = codec.read(state)
        poses = [motion.pose for motion in snapshot.bodies]
        poses += codec.fixed_poses(self._scene.fixed, state)
        return Configuration(
            snapshot.joints,
            (snapshot.finger, snapshot.finger),
            [pose for look, pose in zip(self._looks, poses, strict=True) for _ in look],
        )


def _looks(body: Body) -> Iterator[VisualShape]:
    """What a body looks like: one shape, or its pieces."""
    if isinstance(body.shape, Solid):
        for piece in body.shape.pieces:
            yield VisualShape(piece, body.colour)
    else:
        yield VisualShape(body.shape, body.colour)
