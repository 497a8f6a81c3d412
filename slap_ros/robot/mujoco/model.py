# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A task's state as a model for MuJoCo: the arm, and a body for each body of the domain's scene.

Masses, friction, sizes and places are those of the state; a fixture of several parts, such as a
plate with a hole, is these parts. A drawer or a lid is a joint with the scene's range, damping and
dry friction; as in our own physics, the part that moves does not touch its frame. Of two bodies
that touch, the rougher one counts: MuJoCo's own rule, while in our own physics coefficients
multiply.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, InvalidSceneError
from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import State
from slap_ros.robot.mujoco.arm import (
    BODY_CONTACTS,
    JOINT_POSITIONS,
    SOLIMP,
    SOLREF,
    ArmControl,
    arm_spec,
)
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.robot.mujoco.placed_scene import (
    PandaScene,
    PlacedBody,
    PlacedJointedBody,
    PlacedScene,
)
from slap_ros.worlds.bodies import Colour, RigidBody
from slap_ros.worlds.contact.links import MOVING
from slap_ros.worlds.contact.scene import BoxPart, Compound, JointKind, Part, inertia
from slap_ros.worlds.contact.simulation import ROLLING
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.joint_space.scene import Box, Mesh
from slap_ros.worlds.joint_space.world import PandaWorld

TORSION = 0.005  # m, friction against turning about the contact's normal
JOINT_TYPES = {
    JointKind.SLIDE: mujoco.mjtJoint.mjJNT_SLIDE,
    JointKind.TURN: mujoco.mjtJoint.mjJNT_HINGE,
}


class BodySurface(NamedTuple):
    """What the parts of a body have in common."""

    friction: float  # 1
    colour: Colour  # of parts that have none of their own
    solid: bool = True  # whether others collide with it


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


def scene_spec(scene: PandaScene, state: State, control: ArmControl = JOINT_POSITIONS) -> Any:
    """The model as a ``mujoco.MjSpec`` that is not compiled yet: cameras, say, can be added.

    Each body of the scene is a body of its name in the model; of a jointed body, that is the frame,
    and the joint has its name too.

    Args:
        scene: Bodies of the scene, and their shapes.
        state: Where they are, and what they are made of.
        control: How the arm goes to joint positions.

    Raises:
        InvalidSceneError: MuJoCo cannot express a body; says which, and why.
        InvalidStateError: The state does not have the scene's bodies.
    """
    spec, begun = arm_spec(control), PlacedScene.of(scene, state)
    for placed in begun.bodies:
        _add(spec, placed)
    for jointed in begun.jointed:
        _add_jointed(spec, jointed)
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
    surface = BodySurface(material.friction, body.colour, body.solid)
    if body.mass_kg > 0.0:
        made.add_freejoint(name=body.name)
        _weigh(made, material.mass_kg, [material.mass_kg * k for k in _inertia(body)], ORIGIN)
    if isinstance(body, Box):
        box = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": body.half_extents_m}
        _add_geom(made, body.name, surface, **box)
    elif isinstance(body, Mesh):
        _add_pieces(spec, made, body, surface)
    elif isinstance(body, Compound):
        _add_parts(made, body.parts, surface)
    else:
        raise InvalidSceneError(
            f"MuJoCo cannot express {body.name}: a {type(body).__name__} is neither a box nor "
            "made of convex pieces"
        )


def _add_jointed(spec: Any, placed: PlacedJointedBody) -> None:
    """A frame that stands, and in it a body that slides or turns; opening 0 is the model's own."""
    body, pose, _ = placed
    joint, centre = body.joint, body.moving_box.pose.position
    frame = spec.worldbody.add_body(name=body.name, **_placed_at(pose))
    _add_parts(frame, body.frame, BodySurface(body.friction, body.colour))
    moving = frame.add_body(name=f"{body.name}{MOVING}", **_placed_at(joint.mount))
    _add_parts(moving, body.moving, BodySurface(body.friction, body.moving_colour))
    _weigh(moving, body.mass_kg, inertia(body.moving, body.mass_kg, centre), centre)
    made = moving.add_joint(name=body.name, type=JOINT_TYPES[joint.kind], axis=joint.axis)
    made.limited, made.range = mujoco.mjtLimited.mjLIMITED_TRUE, [0.0, joint.high]
    made.damping, made.frictionloss = [joint.damping, 0.0, 0.0], joint.dry_friction
    made.solref_limit = made.solref_friction = SOLREF
    made.solimp_limit = made.solimp_friction = SOLIMP
    spec.add_exclude(bodyname1=frame.name, bodyname2=moving.name)


def _weigh(made: Any, mass_kg: float, moments: Iterable[float], centre: Vector) -> None:
    """Give a body its mass, its moments of inertia (kg m²) and its centre of mass."""
    made.explicitinertial = True
    made.mass, made.ipos, made.inertia = mass_kg, centre, list(moments)


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


def _add_parts(made: Any, parts: Iterable[Part], surface: BodySurface) -> None:
    for i, part in enumerate(parts):
        own = surface._replace(colour=part.colour or surface.colour)
        _add_geom(made, f"{made.name}_{i}", own, **_part(part))


def _add_pieces(spec: Any, made: Any, body: Mesh, surface: BodySurface) -> None:
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
        _add_geom(made, f"{body.name}_{i}", surface, **mesh_geom)


def _add_geom(made: Any, name: str, surface: BodySurface, **shape: Any) -> None:
    geom = made.add_geom(name=name, rgba=list(surface.colour), **shape)
    rolls = geom.type == mujoco.mjtGeom.mjGEOM_CYLINDER
    geom.mass, geom.condim = 0.0, 6 if rolls else 4
    geom.friction = [surface.friction, TORSION, ROLLING]
    geom.solref, geom.solimp = SOLREF, SOLIMP
    contacts = BODY_CONTACTS if surface.solid else {"contype": 0, "conaffinity": 0}
    geom.contype, geom.conaffinity = contacts["contype"], contacts["conaffinity"]


def _inertia(body: RigidBody) -> Vector:
    """Moments about the body's own axes for a mass of 1 kg, m²."""
    if isinstance(body, Mesh):
        return body.shape.inertia
    if isinstance(body, Compound):
        return inertia(body.parts, 1.0, ORIGIN)
    assert isinstance(body, Box)
    x, y, z = body.half_extents_m
    return ((y * y + z * z) / 3.0, (x * x + z * z) / 3.0, (x * x + y * y) / 3.0)
