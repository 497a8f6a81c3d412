# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of states, drawn in software: no screen, no GPU."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.solid import ConvexPiece, prism
from slap_ros.relational import State
from slap_ros.worlds.animation import Picture, write_pictures
from slap_ros.worlds.bodies import GREY, Colour
from slap_ros.worlds.bullet import PANDA, pybullet
from slap_ros.worlds.viewpoint import Viewpoint
from slap_ros.worlds.visuals import Cylinder, Visuals, VisualShape

ARM_JOINTS = range(7)  # indices in the URDF
FINGER_JOINTS = (9, 10)
STAND = VisualShape((0.1, 0.1, 0.2125), GREY)  # what the base is on
STAND_AT = Pose((0.0, 0.0, -0.2125))
UP: Vector = (0.0, 0.0, 1.0)
SIDES = 32  # of what cylinders are drawn as
NEAR, FAR = 0.05, 5.0  # m, what is closer or further is not drawn

Corners = NDArray[np.float64]


class Camera:
    """Draws states, in a client of its own; to be closed."""

    def __init__(self, visuals: Visuals, view: Viewpoint | None = None) -> None:
        """Look at an arm and what is around it.

        Args:
            visuals: Shapes around the arm, and where they are.
            view: Viewpoint; by default from the front right, from above the arm.
        """
        view = view or Viewpoint()
        self._visuals = visuals
        self._size = (view.width, view.height)
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self._view = pybullet.computeViewMatrix(view.eye, view.target, UP)
        self._projection = pybullet.computeProjectionMatrixFOV(
            view.field_of_view, view.width / view.height, NEAR, FAR
        )
        self._robot: int = pybullet.loadURDF(
            str(PANDA / "panda.urdf"), useFixedBase=True, physicsClientId=self.client
        )
        pybullet.resetBasePositionAndOrientation(self._add(STAND), *STAND_AT, self.client)
        self._shapes = [self._add(shape) for shape in visuals.shapes]

    def __enter__(self) -> Camera:
        return self

    def __exit__(self, *_: object) -> None:
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
        joints, fingers, poses = self._visuals.configuration(state)
        for joint, q in zip(ARM_JOINTS, joints, strict=True):
            pybullet.resetJointState(self._robot, joint, q, 0.0, self.client)
        for joint, q in zip(FINGER_JOINTS, fingers, strict=True):
            pybullet.resetJointState(self._robot, joint, q, 0.0, self.client)
        for shape, pose in zip(self._shapes, poses, strict=True):
            pybullet.resetBasePositionAndOrientation(shape, *pose, self.client)

    def _add(self, shape: VisualShape) -> int:
        geometry = shape.geometry
        if isinstance(geometry, ConvexPiece):
            look = self._piece(geometry, shape.colour)
        elif isinstance(geometry, Cylinder):
            look = self._cylinder(geometry, shape.colour)
        else:
            look = self._visual(shape.colour, pybullet.GEOM_BOX, halfExtents=geometry)
        added: int = pybullet.createMultiBody(0.0, -1, look, physicsClientId=self.client)
        return added

    def _piece(self, piece: ConvexPiece, colour: Colour) -> int:
        """A piece with corners of their own for each triangle, so that faces look flat."""
        corners, normals = _faces(piece)
        return self._mesh(corners, np.repeat(normals[:, None], 3, axis=1), colour)

    def _cylinder(self, cylinder: Cylinder, colour: Colour) -> int:
        """A cylinder, smooth all around and flat at its ends, which PyBullet's own ones are not."""
        corners, normals = _faces(prism(*cylinder, SIDES))
        around = np.abs(normals[:, None, 2:]) < 0.5
        outwards = corners * (1.0, 1.0, 0.0) / cylinder.radius_m
        return self._mesh(corners, np.where(around, outwards, normals[:, None]), colour)

    def _mesh(self, corners: Corners, normals: Corners, colour: Colour) -> int:
        """Triangles with corners of their own, and the normals there, shapes (n, 3, 3)."""
        return self._visual(
            colour,
            pybullet.GEOM_MESH,
            vertices=corners.reshape(-1, 3).tolist(),
            indices=list(range(3 * len(corners))),
            normals=normals.reshape(-1, 3).tolist(),
        )

    def _visual(self, colour: Colour, kind: int, **geometry: object) -> int:
        shape: int = pybullet.createVisualShape(
            kind, rgbaColor=colour, physicsClientId=self.client, **geometry
        )
        return shape


def _faces(piece: ConvexPiece) -> tuple[Corners, Corners]:
    """The corners of each triangle, shape (n, 3, 3), and its normal, shape (n, 3)."""
    corners = np.array(piece.vertices)[np.array(piece.triangles)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def write_animation(
    path: Path,
    camera: Camera,
    states: Iterable[State],
    period_s: float,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Write an animation in real time, one frame per control step.

    Args:
        path: Path of the file; its ending says the format, see ``slap_ros.worlds.animation``.
        camera: Camera that draws the frames.
        states: States, one per control step; not empty.
        period_s: Duration of a control step, s.
        progress: Function that receives the number of frames drawn so far, after each.
    """

    def pictures() -> Iterator[Picture]:
        for done, state in enumerate(states, start=1):
            yield camera.picture(state)
            if progress is not None:
                progress(done)

    write_pictures(path, pictures(), period_s)
