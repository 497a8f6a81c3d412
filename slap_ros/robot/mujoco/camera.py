# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera in MuJoCo: the picture that it takes of the plant, with the tags of a scene file.

Tags are thin plates on the objects, without mass and contact. Pictures are rendered without a
screen: by EGL, on a processor alone by Mesa, or by OSMesa where ``MUJOCO_GL`` says so.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, InvalidSceneError
from slap_ros.geometry.pose import Pose, Quaternion, multiply
from slap_ros.relational import State
from slap_ros.robot.mujoco.arm import JOINT_POSITIONS, ArmControl
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.tagged_scene import PlacedTag
from slap_ros.vision.pinhole_camera import PinholeCamera
from slap_ros.vision.tags import CELLS, MARGIN, tag_image

CAMERA = "camera"  # its name in the model
CELL = 32  # pixels of a tag's cell in a texture
PLATE = 1e-4  # m, half the thickness of a tag
NEAREST = 0.15  # m, from the camera, of what is in the picture
SAMPLES = 8  # of each pixel, against stairs along edges
LIGHT = 0.5  # of what is white, from everywhere, and as much again from the camera
OPENGL_CAMERA: Quaternion = (
    1.0,
    0.0,
    0.0,
    0.0,
)  # MuJoCo's frame in the optical one
NO_GL = (
    "no OpenGL for the camera ({error}): install Debian's packages libegl1 and libgl1-mesa-dri, or "
    "libosmesa6 and set MUJOCO_GL=osmesa"
)


def tagged_plant(
    domain: Domain,
    initial: State,
    tags: Sequence[PlacedTag],
    camera: PinholeCamera,
    pose: Pose,
    control: ArmControl = JOINT_POSITIONS,
) -> tuple[MujocoPlant, Any]:
    """A plant whose objects have tags, and its model with a camera.

    Args:
        domain: Domain of the state.
        initial: State to begin in.
        tags: Tags, and where they are.
        camera: Intrinsics of the camera.
        pose: Pose of its optical frame in the robot's base.
        control: How the arm goes to joint positions.

    Raises:
        InvalidSceneError: MuJoCo cannot express the scene, or a tag is on no object of it.
    """
    scene = scene_around(domain, initial)
    spec = scene_spec(scene, initial, control)
    add_camera(spec, camera, pose)
    add_tags(spec, tags)
    model = compiled(spec)
    return MujocoPlant(model, scene, initial, control), model


def add_camera(spec: Any, camera: PinholeCamera, pose: Pose) -> None:
    """Add a camera to a model that is not compiled yet.

    Args:
        spec: The ``mujoco.MjSpec``.
        camera: Intrinsics of the camera.
        pose: Pose of its optical frame (x right, y down, z ahead) in the robot's base.
    """
    x, y, z, w = multiply(pose.quaternion, OPENGL_CAMERA)
    spec.worldbody.add_camera(
        name=CAMERA,
        pos=pose.position,
        quat=[w, x, y, z],
        resolution=[camera.width, camera.height],
        sensor_size=[camera.width * 1e-6, camera.height * 1e-6],  # m, of pixels of 1 µm
        focal_pixel=[camera.fx, camera.fy],
        principal_pixel=[
            camera.cx - 0.5 * (camera.width - 1),
            camera.cy - 0.5 * (camera.height - 1),
        ],
    )
    view = spec.visual
    view.global_.offwidth, view.global_.offheight = camera.width, camera.height
    view.quality.offsamples = SAMPLES
    view.headlight.ambient = view.headlight.diffuse = [LIGHT] * 3
    view.headlight.specular = [0.0] * 3


def add_tags(spec: Any, tags: Sequence[PlacedTag]) -> None:
    """Put tags on the bodies of a model that is not compiled yet.

    Args:
        spec: The ``mujoco.MjSpec``; each object is a body of its name.
        tags: Tags, and where they are.

    Raises:
        InvalidSceneError: A tag is on an object that the model does not have.
    """
    spec.compiler.discardvisual = False  # else what touches nothing is left out, as tags are
    for tag in tags:
        name = f"tag{tag.tag}"
        picture = np.repeat(tag_image(tag.tag, CELL)[:, :, np.newaxis], 3, axis=2)
        texture = spec.add_texture(
            name=name,
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            width=picture.shape[1],
            height=picture.shape[0],
            nchannel=3,
        )
        texture.data = np.ascontiguousarray(picture).tobytes()
        material = spec.add_material(name=name, specular=0.0, shininess=0.0)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
        body = spec.body(tag.body)
        if body is None:
            raise InvalidSceneError(f"tag {tag.tag} is on {tag.obj.name}, which the task has not")
        _add_plate(body, name, tag)


def _add_plate(body: Any, name: str, tag: PlacedTag) -> None:
    half = 0.5 * tag.size * (CELLS + 2 * MARGIN) / CELLS
    x, y, z, w = tag.pose.quaternion
    plate = body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half, half, PLATE],
        pos=tag.pose.position,
        quat=[w, x, y, z],
        material=name,
    )
    plate.mass, plate.contype, plate.conaffinity = 0.0, 0, 0


class MujocoCamera:
    """Renders what the camera of a model sees; to be used by one thread, and closed there.

    Args:
        model: Compiled ``mujoco.MjModel`` with a camera.

    Raises:
        InvalidParameterError: There is no OpenGL; says what to install.
    """

    def __init__(self, model: Any) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        # A share of the scene's extent: with a floor of 80 m, what is within 1.1 m would lack.
        model.vis.map.znear = min(model.vis.map.znear, NEAREST / model.stat.extent)
        width, height = (int(n) for n in model.cam_resolution[model.cam(CAMERA).id])
        self._view = mujoco.MjrRect(0, 0, width, height)
        self._context = _gl_context(width, height)
        self._scene = mujoco.MjvScene(model, maxgeom=2000)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = False
        self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._renderer)
        self._from = mujoco.MjvCamera()
        self._from.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._from.fixedcamid = model.cam(CAMERA).id

    def picture(self, positions: NDArray[np.float64]) -> NDArray[np.uint8]:
        """The picture at generalised positions.

        Args:
            positions: ``qpos`` of the model.

        Returns:
            Red, green and blue: height × width × 3.
        """
        self._data.qpos[:] = positions
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._model, self._data, mujoco.MjvOption(), None, self._from, every, self._scene
        )
        mujoco.mjr_render(self._view, self._scene, self._renderer)
        seen = np.empty((self._view.height, self._view.width, 3), np.uint8)
        mujoco.mjr_readPixels(seen, None, self._view, self._renderer)
        return np.ascontiguousarray(seen[::-1])  # OpenGL begins at the bottom

    def close(self) -> None:
        """Release what OpenGL holds."""
        self._renderer.free()
        self._context.free()


def _gl_context(width: int, height: int) -> Any:
    """A current OpenGL context without a screen."""
    way = os.environ.get("MUJOCO_GL", "egl").lower()
    try:
        library = import_module("mujoco.osmesa" if way == "osmesa" else "mujoco.egl")
        context = library.GLContext(width, height)
        context.make_current()
    except Exception as error:  # each library has its own, and PyOpenGL raises AttributeError
        raise InvalidParameterError(NO_GL.format(error=error)) from error
    return context
