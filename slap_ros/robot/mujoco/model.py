# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A task's state as a model for MuJoCo: the arm, and a body for each body of the domain's scene.

Masses, friction, sizes and places are those of the state; a fixture of several parts, such as a
plate with a hole, is these parts. Of two bodies that touch, the rougher one counts: MuJoCo's own
rule, while in our own physics coefficients multiply.
"""

from __future__ import annotations

from typing import Any

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, InvalidSceneError
from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import State
from slap_ros.robot.mujoco.arm import BODY_CONTACTS, SOLIMP, SOLREF, ArmMotors, arm_spec
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.robot.mujoco.placed_scene import PandaScene, PlacedBody, PlacedScene
from slap_ros.worlds.bodies import Colour, Material, RigidBody
from slap_ros.worlds.contact.scene import BoxPart, Compound, Part, inertia
from slap_ros.worlds.contact.simulation import ROLLING
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.joint_space.scene import Box, Mesh
from slap_ros.worlds.joint_space.world import PandaWorld

TORSION = 0.005  # m, friction against turning about the contact's normal


def scene_around(domain: Domain, state: State) -> PandaScene:
    """The bodies that the domain has in a state.

    Raises:
        InvalidParameterError: The domain has no Panda.
    """
    world = domain.make_world(state)
    if not isinstance(world, PandaWorld | ContactWorld):
        raise InvalidParameterError(f"the world of {domain.name} has no Panda")
    with world:
        return world.scene


def scene_spec(scene: PandaScene, state: State, motors: ArmMotors | None = None) -> Any:
    """The model as a ``mujoco.MjSpec`` that is not compiled yet: cameras, say, can be added.

    Each body of the scene is a body of its name in the model.

    Args:
        scene: Bodies of the scene, and their shapes.
        state: Where they are, and what they are made of.
        motors: How hard the arm's joints are held.

    Raises:
        InvalidSceneError: MuJoCo cannot express a body; says which, and why.
        InvalidStateError: The state does not have the scene's bodies.
    """
    spec = arm_spec(motors)
    for placed in PlacedScene.of(scene, state).bodies:
        _add(spec, placed)
    return spec


def compiled(spec: Any) -> Any:
    """The ``mujoco.MjModel`` of a specification.

    Raises:
        InvalidSceneError: MuJoCo refuses it; says what of it.
    """
    try:
        return spec.compile()
    except ValueError as error:
        raise InvalidSceneError(f"MuJoCo cannot express the scene: {error}") from error


def _add(spec: Any, placed: PlacedBody) -> None:
    body, pose, material = placed
    made = spec.worldbody.add_body(name=body.name, **_placed_at(pose))
    if body.mass_kg > 0.0:
        made.add_freejoint(name=body.name)
        made.explicitinertial = True
        made.mass, made.ipos = material.mass_kg, [0.0, 0.0, 0.0]
        made.inertia = [material.mass_kg * moment for moment in _inertia(body)]
    if isinstance(body, Box):
        box = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": body.half_extents_m}
        _add_geom(made, body.name, body, material, **box)
    elif isinstance(body, Mesh):
        _add_pieces(spec, made, body, material)
    elif isinstance(body, Compound):
        for i, part in enumerate(body.parts):
            _add_geom(made, f"{body.name}_{i}", body, material, **_part(part))
    else:
        raise InvalidSceneError(
            f"MuJoCo cannot express {body.name}: a {type(body).__name__} is neither a box nor "
            "made of convex pieces"
        )


def _placed_at(pose: Pose) -> dict[str, Any]:
    x, y, z, w = pose.quaternion
    return {"pos": pose.position, "quat": [w, x, y, z]}


def _part(part: Part) -> dict[str, Any]:
    """A box or a cylinder of a body, in the body's frame."""
    if isinstance(part, BoxPart):
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": part.half_extents_m}
    else:
        size = [part.radius_m, 0.5 * part.length_m, 0.0]
        shape = {"type": mujoco.mjtGeom.mjGEOM_CYLINDER, "size": size}
    return shape | _placed_at(part.pose)


def _add_pieces(spec: Any, made: Any, body: Mesh, material: Material) -> None:
    """A mesh for each piece of the shape, which bodies of one shape share."""
    prefix = body.shape.digest.hex()[:12]
    for i, piece in enumerate(body.shape.pieces):
        name = f"{prefix}_{i}"
        if spec.mesh(name) is None:
            mesh = spec.add_mesh(name=name)
            mesh.uservert = [value for vertex in piece.vertices for value in vertex]
            mesh.userface = [corner for triangle in piece.triangles for corner in triangle]
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        mesh_geom = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name}
        _add_geom(made, f"{body.name}_{i}", body, material, **mesh_geom)


def _add_geom(made: Any, name: str, body: RigidBody, material: Material, **shape: Any) -> None:
    geom = made.add_geom(name=name, rgba=_colour(body.colour), **shape)
    rolls = geom.type == mujoco.mjtGeom.mjGEOM_CYLINDER
    geom.mass, geom.condim = 0.0, 6 if rolls else 4
    geom.friction = [material.friction, TORSION, ROLLING]
    geom.solref, geom.solimp = SOLREF, SOLIMP
    contacts = BODY_CONTACTS if body.solid else {"contype": 0, "conaffinity": 0}
    geom.contype, geom.conaffinity = contacts["contype"], contacts["conaffinity"]


def _colour(colour: Colour) -> list[float]:
    return list(colour)


def _inertia(body: RigidBody) -> Vector:
    """Moments about the body's own axes for a mass of 1 kg, m²."""
    if isinstance(body, Mesh):
        return body.shape.inertia
    if isinstance(body, Compound):
        return inertia(body.parts, 1.0, ORIGIN)
    assert isinstance(body, Box)
    x, y, z = body.half_extents_m
    return ((y * y + z * z) / 3.0, (x * x + z * z) / 3.0, (x * x + y * y) / 3.0)
