# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The URDF of hand and jointed bodies, made of the scene's data.

The centres of mass of hand and fingers are at the grasp point: then the hand's way depends on
where it is pulled alone, and not on what its fingers do.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, tostring

from slap_ros.geometry.pose import IDENTITY, ORIGIN, Pose, Quaternion, Vector
from slap_ros.worlds.contact.hand import (
    FINGER_INERTIA,
    FINGER_MASS,
    HALF_TURN,
    HAND_INERTIA,
    HAND_MASS,
    PAD,
    PALM,
    STEM,
)
from slap_ros.worlds.contact.scene import (
    BoxPart,
    CylinderPart,
    JointedBody,
    JointKind,
    Part,
    bounding_box,
    inertia,
)
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN

LEFT, RIGHT = 0, 1  # the fingers' links in the hand
MOVING = 0  # the moving part's link in a jointed body
NO_EFFORT_LIMIT = 1e3  # N or N m; the motors have limits of their own
NO_SPEED_LIMIT = 1e2  # m/s or rad/s


def hand_urdf() -> str:
    """The hand: a palm and two fingers that slide."""
    robot = Element("robot", name="hand")
    _link(robot, "palm", (PALM,), HAND_MASS, (HAND_INERTIA,) * 3)
    turned = Pose(quaternion=HALF_TURN)
    fingers = (PAD, STEM)
    mirrored = tuple(
        BoxPart(part.half_extents_m, turned.compose(part.pose)) for part in (PAD, STEM)
    )
    for name, parts, side in (("left", fingers, 1.0), ("right", mirrored, -1.0)):
        _link(robot, name, parts, FINGER_MASS, (FINGER_INERTIA,) * 3)
        _joint(
            robot, (f"{name}_finger", JointKind.SLIDE, "palm", name), (0.0, side, 0.0), FINGER_OPEN
        )
    return tostring(robot, encoding="unicode")


def jointed_urdf(body: JointedBody) -> str:
    """A frame, and what moves in it."""
    robot = Element("robot", name="jointed")
    _link(robot, "frame", body.frame, 0.0, ORIGIN)
    centre = bounding_box(body.moving).pose.position
    weights = inertia(body.moving, body.mass_kg, centre)
    _link(robot, "moving", body.moving, body.mass_kg, weights, centre)
    joint = _joint(
        robot,
        ("joint", body.joint.kind, "frame", "moving"),
        body.joint.axis,
        body.joint.high,
        body.joint.mount,
    )
    SubElement(joint, "dynamics", damping=repr(body.joint.damping), friction="0")
    return tostring(robot, encoding="unicode")


def _link(
    robot: Element,
    name: str,
    parts: Iterable[Part],
    mass_kg: float,
    inertia_diagonal: Vector,
    centre: Vector = ORIGIN,
) -> None:
    """Add a link.

    Args:
        robot: Element that the link is added to.
        name: Name of the link.
        parts: Parts of the link, in its frame.
        mass_kg: Mass of the link, kg; 0 for a link that does not move.
        inertia_diagonal: Diagonal of the inertia about the centre of mass, kg m².
        centre: Position of the centre of mass in the link's frame, m.
    """
    link = SubElement(robot, "link", name=name)
    weight = SubElement(link, "inertial")
    SubElement(weight, "origin", xyz=_numbers(centre))
    SubElement(weight, "mass", value=repr(mass_kg))
    x, y, z = (repr(value) for value in inertia_diagonal)
    SubElement(weight, "inertia", ixx=x, iyy=y, izz=z, ixy="0", ixz="0", iyz="0")
    for part in parts:
        collision = SubElement(link, "collision")
        _origin(collision, part.pose)
        geometry = SubElement(collision, "geometry")
        if isinstance(part, CylinderPart):
            sizes = {"radius": repr(part.radius_m), "length": repr(part.length_m)}
            SubElement(geometry, "cylinder", sizes)
        else:
            size = _numbers(2.0 * half for half in part.half_extents_m)
            SubElement(geometry, "box", size=size)


def _joint(
    robot: Element,
    called: tuple[str, JointKind, str, str],
    axis: Vector,
    high: float,
    mount: Pose = IDENTITY,
) -> Element:
    """Add a joint that goes from 0 on.

    Args:
        robot: Element that the joint is added to.
        called: Name and kind of the joint, and the names of its parent and child.
        axis: Axis in the joint's own frame.
        high: Largest position of the joint, m or rad.
        mount: Pose of the joint's frame in the parent's.
    """
    name, kind, parent, child = called
    joint = SubElement(robot, "joint", name=name, type=kind.value)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    _origin(joint, mount)
    SubElement(joint, "axis", xyz=_numbers(axis))
    SubElement(
        joint,
        "limit",
        lower=repr(FINGER_CLOSED),
        upper=repr(high),
        effort=repr(NO_EFFORT_LIMIT),
        velocity=repr(NO_SPEED_LIMIT),
    )
    return joint


def _origin(element: Element, pose: Pose) -> None:
    angles = roll_pitch_yaw(pose.quaternion)
    SubElement(element, "origin", xyz=_numbers(pose.position), rpy=_numbers(angles))


def roll_pitch_yaw(q: Quaternion) -> Vector:
    """URDF's angles of an orientation: about the fixed axes x, then y, then z; rad."""
    x, y, z, w = q
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    if abs(sine) > 1.0 - 1e-12:  # roll and yaw turn about the same axis
        return (
            0.0,
            math.copysign(0.5 * math.pi, sine),
            -math.copysign(2.0, sine) * math.atan2(x, w),
        )
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return (roll, math.asin(sine), yaw)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
