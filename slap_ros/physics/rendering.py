# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of states, drawn in software: no screen, no GPU."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import TracebackType

import numpy as np

from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.solid import ConvexPiece, Solid
from slap_ros.physics.animation import Picture, write_pictures
from slap_ros.physics.bullet import pybullet
from slap_ros.physics.panda import CONTROL_PERIOD_S
from slap_ros.physics.scene import Body, Box, Scene
from slap_ros.physics.simulation import PANDA
from slap_ros.physics.snapshot import SnapshotCodec
from slap_ros.physics.viewpoint import Viewpoint
from slap_ros.relational import State

ARM_JOINTS = range(7)  # indices in the URDF
FINGER_JOINTS = (9, 10)
STAND = Box("stand", (0.1, 0.1, 0.2125), pose=Pose((0.0, 0.0, -0.2125)))  # what the base is on
UP: Vector = (0.0, 0.0, 1.0)
NEAR, FAR = 0.05, 5.0  # m, what is closer or further is not drawn


class Camera:
    """Draws states of a scene, in a client of its own; to be closed."""

    def __init__(self, scene: Scene, view: Viewpoint | None = None) -> None:
        """Look at ``scene``; by default from the front right, from above the arm."""
        view = view or Viewpoint()
        self._scene = scene
        self._size = (view.width, view.height)
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self._view = pybullet.computeViewMatrix(view.eye, view.target, UP)
        self._projection = pybullet.computeProjectionMatrixFOV(
            view.field_of_view, view.width / view.height, NEAR, FAR
        )
        self._robot: int = pybullet.loadURDF(
            str(PANDA / "panda.urdf"), useFixedBase=True, physicsClientId=self.client
        )
        self._add(STAND)
        self._free = [self._add(body) for body in scene.free]
        self._fixed = [self._add(body) for body in scene.fixed]

    def __enter__(self) -> Camera:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give the client back."""
        pybullet.disconnect(self.client)

    def picture(self, state: State) -> Picture:
        """What the camera sees of a state."""
        self._place(state)
        width, height = self._size
        _, _, pixels, _, _ = pybullet.getCameraImage(
            width,
            height,
            self._view,
            self._projection,
            lightDirection=(1.0, -1.0, 2.0),
            shadow=True,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        return np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[..., :3]

    def _place(self, state: State) -> None:
        reader = SnapshotCodec.of(self._scene, state.layout)
        snapshot = reader.read(state)
        for joint, q in zip(ARM_JOINTS, snapshot.joints, strict=True):
            pybullet.resetJointState(self._robot, joint, q, 0.0, self.client)
        for joint in FINGER_JOINTS:
            pybullet.resetJointState(self._robot, joint, snapshot.finger, 0.0, self.client)
        poses = [motion.pose for motion in snapshot.bodies]
        poses += reader.fixed_poses(self._scene, state)
        for pieces, pose in zip([*self._free, *self._fixed], poses, strict=True):
            for piece in pieces:
                pybullet.resetBasePositionAndOrientation(piece, *pose, self.client)

    def _add(self, body: Body) -> list[int]:
        """What a body looks like: one thing, or its pieces."""
        if isinstance(body.shape, Solid):
            looks = [self._piece(piece, body) for piece in body.shape.pieces]
        else:
            looks = [self._visual(body, pybullet.GEOM_BOX, halfExtents=body.shape)]
        return [
            pybullet.createMultiBody(0.0, -1, look, *body.pose, physicsClientId=self.client)
            for look in looks
        ]

    def _piece(self, piece: ConvexPiece, body: Body) -> int:
        """A piece with corners of their own for each triangle, so that faces look flat."""
        corners = np.array(piece.vertices)[np.array(piece.triangles)]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return self._visual(
            body,
            pybullet.GEOM_MESH,
            vertices=corners.reshape(-1, 3).tolist(),
            indices=list(range(3 * len(corners))),
            normals=np.repeat(normals, 3, axis=0).tolist(),
        )

    def _visual(self, body: Body, kind: int, **geometry: object) -> int:
        shape: int = pybullet.createVisualShape(
            kind, rgbaColor=body.colour, physicsClientId=self.client, **geometry
        )
        return shape


def write_animation(
    path: Path,
    camera: Camera,
    states: Iterable[State],
    progress: Callable[[int], None] | None = None,
) -> None:
    """Write an animation in real time, one frame a control step.

    Args:
        path: The file; its ending says the format, see ``slap_ros.physics.animation``.
        camera: Draws the frames.
        states: One a control step; not empty.
        progress: Told the number of frames drawn so far, after each.
    """

    def pictures() -> Iterator[Picture]:
        for done, state in enumerate(states, start=1):
            yield camera.picture(state)
            if progress is not None:
                progress(done)

    write_pictures(path, pictures(), CONTROL_PERIOD_S)
