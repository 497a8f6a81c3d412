# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The metrics of LG-SAIL (Table 4), and ours beside them.

Each is defined twice: a readable function of one state and its objects, whose source prompts
quote, and one for many at once, whose name begins with an underscore. The paper uses some of its
names for several things; here each means one. ``radial_dis``, ``axial_dis``, ``lift``, ``at_rest``,
``joint_dis`` and ``closure`` are ours.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.domains.benchtop.features import PLACE, THING
from slap_ros.domains.benchtop.state_access import (
    ANGULAR,
    LINEAR,
    axes,
    axis_of,
    hand_position,
    hand_positions,
    position_of,
    positions,
)
from slap_ros.relational import Column, Metric, NormalisedForm, Object, State, Type
from slap_ros.relational.metrics import TRUTH
from slap_ros.relational.state import Array
from slap_ros.worlds.features import pose_of

REST_SPEED = 0.05  # m/s: slower is at rest
REST_SPIN = 0.5  # rad/s
FULL_LIFT = 0.1  # m, from which on a thing is lifted as high as is rewarded
NEAR_METRES = NormalisedForm.closeness(10.0)  # the paper's
NEAR_RADIANS = NormalisedForm.closeness(4.0)  # the paper's
TRUE = NormalisedForm.truth()


# -- the hand and an object -----------------------------------------------------------------------


def is_grasped(state: State, thing: Object) -> float:
    """1 while both fingers press on the thing from opposite sides."""
    return float(state.get(thing, "held"))


def _is_grasped(state: State, things: Column) -> Array:
    return state.stack(things, "held")


def dis_to_obj(state: State, place: Object) -> float:
    """The distance from the point between the fingertips to an object's origin."""
    return math.dist(hand_position(state), position_of(state, place))


def _dis_to_obj(state: State, places: Column) -> Array:
    return _length(positions(state, places) - hand_positions(state))


def xy_dis(state: State, place: Object) -> float:
    """The distance from the point between the fingertips to an object's origin, seen from above."""
    return math.dist(hand_position(state)[:2], position_of(state, place)[:2])


def _xy_dis(state: State, places: Column) -> Array:
    return _length((positions(state, places) - hand_positions(state))[..., :2])


def z_dis(state: State, place: Object) -> float:
    """The vertical distance from the point between the fingertips to an object's origin."""
    return abs(hand_position(state)[2] - position_of(state, place)[2])


def _z_dis(state: State, places: Column) -> Array:
    heights: Array = np.abs((positions(state, places) - hand_positions(state))[..., 2])
    return heights


# -- two objects ----------------------------------------------------------------------------------


def parallel_dis(state: State, thing: Object, place: Object) -> float:
    """The distance between two origins, seen from above.

    Args:
        state: A single state.
        thing: Thing that is put on or into the place.
        place: Place that the thing is put on or into.

    Returns:
        m, at least 0.
    """
    return math.dist(position_of(state, thing)[:2], position_of(state, place)[:2])


def _parallel_dis(state: State, things: Column, places: Column) -> Array:
    return _length((positions(state, things) - positions(state, places))[..., :2])


def perpendicular_dis(state: State, thing: Object, place: Object) -> float:
    """The height of a thing's underside over where things stand on a place.

    Args:
        state: A single state.
        thing: Thing that is put on the place.
        place: Place that the thing is to stand on.

    Returns:
        m, 0 where it stands there, below 0 where it would be inside.
    """
    underside = state.get(thing, "z") - state.get(thing, "rest_height")
    return float(underside - (state.get(place, "z") + state.get(place, "support_height")))


def _perpendicular_dis(state: State, things: Column, places: Column) -> Array:
    underside = state.stack(things, "z") - state.stack(things, "rest_height")
    gap: Array = underside - (state.stack(places, "z") + state.stack(places, "support_height"))
    return gap


def norm_angle(state: State, thing: Object, place: Object) -> float:
    """The angle between the axes of two objects; either end of an axis may come first.

    Args:
        state: A single state.
        thing: Object with an axis.
        place: Another object with an axis.

    Returns:
        rad, from 0 to a right angle.
    """
    cosine = sum(a * b for a, b in zip(axis_of(state, thing), axis_of(state, place), strict=True))
    return math.acos(min(abs(cosine), 1.0))


def _norm_angle(state: State, things: Column, places: Column) -> Array:
    cosines = (axes(state, things) * axes(state, places)).sum(axis=-1)
    angles: Array = np.arccos(np.minimum(np.abs(cosines), 1.0))
    return angles


def radial_dis(state: State, peg: Object, hole: Object) -> float:
    """The distance from a peg's origin to a hole's axis.

    Args:
        state: A single state.
        peg: Peg that is pushed in.
        hole: Hole that the peg is pushed into.

    Returns:
        m, at least 0.
    """
    _, y, z = pose_of(state, hole).inverse().apply(position_of(state, peg))
    return math.hypot(y, z)


def _radial_dis(state: State, pegs: Column, holes: Column) -> Array:
    apart, axis = positions(state, pegs) - positions(state, holes), axes(state, holes)
    return _length(apart - (apart * axis).sum(axis=-1, keepdims=True) * axis)


def axial_dis(state: State, peg: Object, hole: Object) -> float:
    """The signed distance from a hole's origin to a peg's, along the hole's axis.

    Args:
        state: A single state.
        peg: Peg that is pushed in.
        hole: Hole that the peg is pushed into.

    Returns:
        m, 0 where the middle of the one is in the middle of the other, of either sign elsewhere.
    """
    x, _, _ = pose_of(state, hole).inverse().apply(position_of(state, peg))
    return x


def _axial_dis(state: State, pegs: Column, holes: Column) -> Array:
    apart = positions(state, pegs) - positions(state, holes)
    along: Array = (apart * axes(state, holes)).sum(axis=-1)
    return along


# -- one object -----------------------------------------------------------------------------------


def lift(state: State, thing: Object) -> float:
    """The height of the thing's underside over the table, whose top is at z = 0."""
    return float(state.get(thing, "z") - state.get(thing, "rest_height"))


def _lift(state: State, things: Column) -> Array:
    height: Array = state.stack(things, "z") - state.stack(things, "rest_height")
    return height


def at_rest(state: State, thing: Object) -> float:
    """1 where the thing hardly moves."""
    speed = math.hypot(*(state.get(thing, axis) for axis in ("vx", "vy", "vz")))
    spin = math.hypot(*(state.get(thing, axis) for axis in ("wx", "wy", "wz")))
    return float(speed <= REST_SPEED and spin <= REST_SPIN)


def _at_rest(state: State, things: Column) -> Array:
    speeds = _length(state.gather(things, LINEAR))
    spins = _length(state.gather(things, ANGULAR))
    return ((speeds <= REST_SPEED) & (spins <= REST_SPIN)).astype(np.float64)


def joint_dis(state: State, jointed: Object) -> float:
    """How far a drawer or a lid is open."""
    return float(state.get(jointed, "opening"))


def _joint_dis(state: State, jointed: Column) -> Array:
    return state.stack(jointed, "opening")


def _length(vectors: Array) -> Array:
    lengths: Array = np.linalg.norm(vectors, axis=-1)
    return lengths


ONE_PLACE, ONE_THING, THING_AND_PLACE = (PLACE,), (THING,), (THING, PLACE)
IS_GRASPED = Metric(
    "is_grasped",
    ONE_THING,
    TRUTH,
    "Whether both fingers press on the thing.",
    _is_grasped,
    is_grasped,
    TRUE,
    of_hand=True,
)
DIS_TO_OBJ = Metric(
    "dis_to_obj",
    ONE_PLACE,
    "m",
    "Distance from the hand to the object.",
    _dis_to_obj,
    dis_to_obj,
    NEAR_METRES,
    of_hand=True,
)
XY_DIS = Metric(
    "xy_dis",
    ONE_PLACE,
    "m",
    "Horizontal distance from the hand to the object.",
    _xy_dis,
    xy_dis,
    NEAR_METRES,
    of_hand=True,
)
Z_DIS = Metric(
    "z_dis",
    ONE_PLACE,
    "m",
    "Vertical distance from the hand to the object.",
    _z_dis,
    z_dis,
    NEAR_METRES,
    of_hand=True,
)
PARALLEL_DIS = Metric(
    "parallel_dis",
    THING_AND_PLACE,
    "m",
    "Horizontal distance between two objects.",
    _parallel_dis,
    parallel_dis,
    NEAR_METRES,
)
PERPENDICULAR_DIS = Metric(
    "perpendicular_dis",
    THING_AND_PLACE,
    "m",
    "Height of the thing's underside over where it is to stand.",
    _perpendicular_dis,
    perpendicular_dis,
    NEAR_METRES,
)
NORM_ANGLE = Metric(  # the paper's orientation_diff as well
    "norm_angle",
    THING_AND_PLACE,
    "rad",
    "Angle between the axes of two objects.",
    _norm_angle,
    norm_angle,
    NEAR_RADIANS,
)
RADIAL_DIS = Metric(  # parallel_dis in the paper's In of a hole
    "radial_dis",
    THING_AND_PLACE,
    "m",
    "Distance from a peg to the axis of a hole.",
    _radial_dis,
    radial_dis,
    NEAR_METRES,
)
AXIAL_DIS = Metric(  # perpendicular_dis in the paper's In of a hole
    "axial_dis",
    THING_AND_PLACE,
    "m",
    "Distance from a peg to the middle of a hole, along the hole's axis.",
    _axial_dis,
    axial_dis,
    NEAR_METRES,
)
LIFT = Metric(
    "lift",
    ONE_THING,
    "m",
    "Height of the thing's underside over the table.",
    _lift,
    lift,
    NormalisedForm.fraction(FULL_LIFT),
)
AT_REST = Metric(
    "at_rest",
    ONE_THING,
    TRUTH,
    "Whether the thing hardly moves.",
    _at_rest,
    at_rest,
    TRUE,
)
OF_HAND = (IS_GRASPED, DIS_TO_OBJ, XY_DIS, Z_DIS)
COMMON = (*OF_HAND, PARALLEL_DIS, PERPENDICULAR_DIS, LIFT, AT_REST)  # of every domain


def opening_metric(kind: Type, full: float, name: str = "joint_dis") -> Metric:
    """The metric of how far a drawer or a lid is open; its normalised form grows as it opens.

    Args:
        kind: Type of the drawers or the lids.
        full: The opening from which on the normalised form is 1, m or rad.
        name: Name of the metric; to be given where a domain has both drawers and lids.

    Returns:
        The metric, in the unit of the opening.
    """
    unit = kind.features[kind.column["opening"]].unit
    form = NormalisedForm.fraction(full)
    return Metric(name, (kind,), unit, f"How far the {kind} is open.", _joint_dis, joint_dis, form)


def closure_metric(kind: Type, name: str = "closure") -> Metric:
    """The metric of how far a drawer or a lid is open; its normalised form grows as it closes.

    Args:
        kind: Type of the drawers or the lids.
        name: Name of the metric; to be given where a domain has both drawers and lids.
    """
    unit = kind.features[kind.column["opening"]].unit
    form = NEAR_METRES if unit == "m" else NEAR_RADIANS
    said = f"How far the {kind} is from being closed."
    return Metric(name, (kind,), unit, said, _joint_dis, joint_dis, form)
