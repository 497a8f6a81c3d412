# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Types that the domains derive theirs from: ``CUBE = Type("cube", THING.features, THING)``.

A body's own frame has its axis, where it has one (of a peg, a hole, a handle), along x.
"""

from __future__ import annotations

from collections.abc import Mapping

from slap_ros.geometry.pose import Pose
from slap_ros.relational import Feature, Type
from slap_ros.worlds.contact.features import DRAWER_FEATURES, LID_FEATURES, opening_features
from slap_ros.worlds.features import BODY_FEATURES, POSE_FEATURES, body_features, pose_features

SUPPORT_HEIGHT = Feature("support_height", "m")  # from its origin up to where things stand on it
REST_HEIGHT = Feature("rest_height", "m")  # from where it stands up to its origin

PLACE = Type("place", (*POSE_FEATURES, SUPPORT_HEIGHT))  # anything with a pose
THING = Type("thing", (*BODY_FEATURES, SUPPORT_HEIGHT, REST_HEIGHT), PLACE)  # a free body
DRAWER = Type("drawer", (*PLACE.features, *DRAWER_FEATURES), PLACE)
LID = Type("lid", (*PLACE.features, *LID_FEATURES), PLACE)


def place_features(pose: Pose, support_height: float = 0.0) -> Mapping[str, float]:
    """A place's features, for ``State.build``.

    Args:
        pose: Pose of the place in the base's frame.
        support_height: Height of the surface that things stand on above the place's origin, m;
            below 0 for a basket.

    Returns:
        A value for each feature of :data:`PLACE`, by name.
    """
    return {**pose_features(pose), SUPPORT_HEIGHT.name: support_height}


def thing_features(pose: Pose, rest_height: float, support_height: float) -> Mapping[str, float]:
    """The features of a thing at rest, for ``State.build``.

    Args:
        pose: Pose of the thing in the base's frame.
        rest_height: Height of the thing's origin above what it stands on, m.
        support_height: Height of the surface that other things stand on above the thing's origin,
            m.

    Returns:
        A value for each feature of :data:`THING`, by name.
    """
    sizes = {SUPPORT_HEIGHT.name: support_height, REST_HEIGHT.name: rest_height}
    return {**body_features(*pose), **sizes}


def jointed_features(pose: Pose, opening: float, support_height: float) -> Mapping[str, float]:
    """The features of a drawer or a lid that does not move, for ``State.build``.

    Args:
        pose: Pose of the drawer's or lid's frame, in the base's frame.
        opening: How far the drawer (m) or the lid (rad) is open.
        support_height: Height of the surface that things stand on above the frame's origin, m; see
            :func:`place_features`.

    Returns:
        A value for each feature of :data:`DRAWER` or :data:`LID`, by name.
    """
    return {**place_features(pose, support_height), **opening_features(opening)}
