# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot and its objects in MuJoCo, where time passes a period at a time.

All that a period depends on is in :meth:`MujocoPlant.save`: restored there, or in another plant of
the same model, the next periods are the same, bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.relational import State
from slap_ros.robot.mujoco.arm import (
    ARM_JOINTS,
    FINGER_FORCE,
    FINGER_JOINTS,
    FINGER_SPEED,
    JOINT_POSITIONS,
    LARGEST_FINGER_FORCE,
    PERIOD_S,
    ArmControl,
)
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec
from slap_ros.robot.mujoco.placed_scene import PandaScene, PlacedScene
from slap_ros.worlds.contact.contacts import ContactPoint, Side, Surface, grasped
from slap_ros.worlds.contact.links import MOVING
from slap_ros.worlds.contact.snapshot import Opening
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN, JOINTS, grasp_pose

SETTLING_S = 0.3  # s, at least, before anything is measured
LONGEST_SETTLING_S = 3.0  # s
STOPPED = 3e-3  # m, by which fingers are behind that something stops; in the air, it is 1e-3
RESTING = 1e-3  # m/s, rad/s: what is slower stands still
FINGERS = {  # by the names of their links
    "panda_leftfinger": Surface(Side.LEFT_FINGER),
    "panda_rightfinger": Surface(Side.RIGHT_FINGER),
}

Array = NDArray[np.float64]


class MujocoPlant:
    """An arm, its fingers, free bodies, and drawers and lids.

    Args:
        model: Compiled ``mujoco.MjModel`` of a scene.
        scene: Bodies of the scene.
        state: State to begin in; what moves there comes to rest first.
        control: How the arm goes to joint positions, as the model has it.
    """

    def __init__(
        self,
        model: Any,
        scene: PandaScene,
        state: State,
        control: ArmControl = JOINT_POSITIONS,
    ) -> None:
        self._model, self._data, self.control = model, mujoco.MjData(model), control
        self._names = [body.name for body in scene.free]
        self._bodies = [model.body(name).id for name in self._names]
        self._arm_at = [model.joint(name).qposadr[0] for name in ARM_JOINTS]
        self._arm_speeds = [model.joint(name).dofadr[0] for name in ARM_JOINTS]
        self._fingers_at = [model.joint(name).qposadr[0] for name in FINGER_JOINTS]
        self._finger_speeds = [model.joint(name).dofadr[0] for name in FINGER_JOINTS]
        free = {name: Surface(Side.FREE, i) for i, name in enumerate(self._names)}
        self._surfaces = {model.body(name).id: one for name, one in (FINGERS | free).items()}
        begun = PlacedScene.of(scene, state)
        self._openings = [model.joint(jointed.body.name) for jointed in begun.jointed]
        moving = [f"{jointed.body.name}{MOVING}" for jointed in begun.jointed]
        self._parts = dict(zip(self._names, self._bodies, strict=True))
        self._parts |= {name: model.body(name).id for name in moving}
        self._data.qpos[self._arm_at] = begun.joints
        self._data.qpos[self._fingers_at] = begun.fingers
        for joint, jointed in zip(self._openings, begun.jointed, strict=True):
            self._data.qpos[joint.qposadr] = jointed.opening
        self.command(begun.joints)
        self.command_fingers(FINGER_CLOSED if begun.closing else FINGER_OPEN)
        self._settle()

    @classmethod
    def of(cls, domain: Domain, state: State, control: ArmControl = JOINT_POSITIONS) -> MujocoPlant:
        """The plant of a domain's state.

        Args:
            domain: Domain with a Panda.
            state: State to begin in.
            control: How the arm goes to joint positions.

        Raises:
            InvalidSceneError: MuJoCo cannot express a body.
            InvalidParameterError: The domain has no Panda.
        """
        scene = scene_around(domain, state)
        return cls(compiled(scene_spec(scene, state, control)), scene, state, control)

    # -- what is measured -----------------------------------------------------------------------

    @property
    def time_s(self) -> float:
        """Time of the plant since it was made, s."""
        return float(self._data.time)

    @property
    def joints(self) -> list[float]:
        """Joint positions, rad."""
        return [float(q) for q in self._data.qpos[self._arm_at]]

    @property
    def joint_velocities(self) -> list[float]:
        """Joint velocities, rad/s."""
        return [float(v) for v in self._data.qvel[self._arm_speeds]]

    @property
    def fingers(self) -> tuple[float, float]:
        """Distance of the left and of the right finger from the middle, m."""
        left, right = self._data.qpos[self._fingers_at].tolist()
        return (left, right)

    @property
    def finger_velocities(self) -> tuple[float, float]:
        """How fast the left and the right finger open, m/s."""
        left, right = self._data.qvel[self._finger_speeds].tolist()
        return (left, right)

    @property
    def gap(self) -> float:
        """Distance between the fingers, m."""
        return float(sum(self._data.qpos[self._fingers_at]))

    @property
    def gap_velocity(self) -> float:
        """How fast the fingers part, m/s."""
        return float(sum(self._data.qvel[self._finger_speeds]))

    @property
    def closing(self) -> bool:
        """Whether the fingers were last told to shut."""
        return self._fingers_to <= FINGER_CLOSED

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves."""
        return bool(np.abs(self._data.qvel).max() < RESTING)

    def poses(self) -> dict[str, Pose]:
        """Where what can move is, by name: free bodies, then what slides or turns of others."""
        return {name: self._pose_of(body) for name, body in self._parts.items()}

    def motions(self) -> dict[str, BodyState]:
        """Where free bodies are, and how fast, by name."""
        found, velocity = {}, np.zeros(6)
        for name, body in zip(self._names, self._bodies, strict=True):
            kind = mujoco.mjtObj.mjOBJ_BODY
            mujoco.mj_objectVelocity(self._model, self._data, kind, body, velocity, 0)
            spin, speed = _vector(velocity[:3]), _vector(velocity[3:])
            found[name] = BodyState(self._pose_of(body), speed, spin)
        return found

    def _pose_of(self, body: int) -> Pose:
        return _pose(self._data.xpos[body], self._data.xquat[body])

    def openings(self) -> dict[str, Opening]:
        """How far jointed bodies are open, and how fast they open, by name."""
        qpos, qvel = self._data.qpos, self._data.qvel
        return {
            joint.name: Opening(float(qpos[joint.qposadr[0]]), float(qvel[joint.dofadr[0]]))
            for joint in self._openings
        }

    def grasped(self) -> str | None:
        """What both fingers press on from opposite sides, by name; None where that is nothing."""
        held = grasped(self._contact_points(), grasp_pose(self.joints))
        return None if held is None else self._names[held]

    def _contact_points(self) -> Iterator[ContactPoint]:
        """Where fingers and what can move touch one another."""
        force = np.zeros(6)
        for i in range(self._data.ncon):
            contact = self._data.contact[i]
            first, second = (self._surfaces.get(b) for b in self._model.geom_bodyid[contact.geom])
            if first is None or second is None:
                continue
            mujoco.mj_contactForce(self._model, self._data, i, force)
            normal = _vector(-contact.frame[:3])  # MuJoCo's is towards the second one
            position, distance = _vector(contact.pos), float(contact.dist)
            yield ContactPoint(first, second, position, normal, distance, float(force[0]))

    @property
    def positions(self) -> Array:
        """All positions, ``qpos`` of the model: for pictures, not for whoever plans."""
        copied: Array = self._data.qpos.copy()
        return copied

    # -- what is commanded ----------------------------------------------------------------------

    def command(self, joints: Sequence[float] | Array) -> None:
        """Have the arm pulled to joint positions, rad, from now on."""
        self._told = joints

    def command_fingers(self, finger: float, force: float = FINGER_FORCE) -> None:
        """Have the fingers move from now on, no faster than a real gripper's.

        Args:
            finger: Distance of each finger from the middle, m.
            force: Largest force of each finger, N.
        """
        limit = min(force, LARGEST_FINGER_FORCE)
        self._fingers_to = finger
        # Fingers that open do so from where they are, and let go of what they press at once.
        at = np.minimum(self._data.qpos[self._fingers_at], finger)
        self._data.ctrl[JOINTS:] = np.maximum(self._data.ctrl[JOINTS:], at)
        self._model.actuator_forcerange[JOINTS:] = (-limit, limit)

    def step(self) -> None:
        """Let a period pass."""
        self._data.ctrl[:JOINTS] = self.control.commands(
            self._told, self._data.qpos[self._arm_at], self._data.qvel[self._arm_speeds]
        )
        self._command_fingers_on()
        mujoco.mj_step(self._model, self._data)

    def _command_fingers_on(self) -> None:
        """Move the fingers' command on: by a period's way, or at once where they are stopped."""
        at, way = self._data.ctrl[JOINTS:], FINGER_SPEED * PERIOD_S
        stopped = np.abs(self._data.qpos[self._fingers_at] - at) > STOPPED
        at += np.where(stopped, self._fingers_to - at, np.clip(self._fingers_to - at, -way, way))

    # -- all of it ------------------------------------------------------------------------------

    def save(self) -> Array:
        """All that the next periods depend on, besides what is commanded."""
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        saved = np.zeros(mujoco.mj_stateSize(self._model, kind))
        mujoco.mj_getState(self._model, self._data, saved, kind)
        return saved

    def restore(self, saved: Array) -> None:
        """Go on from what was saved."""
        mujoco.mj_setState(self._model, self._data, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_forward(self._model, self._data)

    def _settle(self) -> None:
        """Let bodies come to rest upon one another, for our physics and MuJoCo's differ."""
        while self.time_s < SETTLING_S or not (self.at_rest or self.time_s > LONGEST_SETTLING_S):
            self.step()
        mujoco.mj_forward(self._model, self._data)


def _pose(position: Array, quaternion: Array) -> Pose:
    w, qx, qy, qz = quaternion.tolist()
    return Pose(_vector(position), (qx, qy, qz, w))


def _vector(values: Array) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


__all__ = ["PERIOD_S", "MujocoPlant"]
