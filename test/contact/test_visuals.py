# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the contact world show what the state says."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.workbench import BENCH, CUBE_AT, HAND, LEFT_DRAWER, Setting, start
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.links import link_poses, links
from slap_ros.worlds.contact.visuals import ContactVisuals
from slap_ros.worlds.panda import grasp_pose
from slap_ros.worlds.rendering import Camera
from slap_ros.worlds.viewpoint import Viewpoint

VISUALS = ContactVisuals(BENCH)
DRAWERS_AHEAD = Viewpoint(eye=(0.1, 0.0, 0.6), target=(0.6, 0.0, 0.0), width=160, height=120)
DIFFERENT = 30  # of 255


def drawn_at(name: str, setting: Setting) -> list[tuple[float, ...]]:
    """Where the parts of a link are drawn."""
    placed = zip(links(BENCH), link_poses(BENCH, start(setting)), strict=True)
    (found,) = (
        [pose.compose(part.pose).position for part in link.parts]
        for link, pose in placed
        if link.name == name
    )
    return found


def test_there_is_a_pose_for_every_shape():
    shown = VISUALS.configuration(start())
    assert len(shown.poses) == len(VISUALS.shapes)
    assert grasp_pose(shown.joints).position == pytest.approx(HAND.pose.position)
    assert shown.fingers == HAND.fingers


def test_bodies_frames_and_moving_parts_are_where_they_are():
    assert drawn_at("cube", Setting()) == [CUBE_AT.position]
    shut, opened = Setting(), Setting(openings=(0.1, 0.0, 0.5))
    assert drawn_at("left", shut) == drawn_at("left", opened)
    for before, after in zip(
        drawn_at("left_moving", shut), drawn_at("left_moving", opened), strict=True
    ):
        assert np.subtract(after, before) == pytest.approx((-0.1, 0.0, 0.0))
    ((x, _, z),) = drawn_at("lid_moving", Setting(openings=(0.0, 0.0, 0.0)))
    ((_, _, higher),) = drawn_at("lid_moving", Setting(openings=(0.0, 0.0, 0.5)))
    assert x < 0.72 + 0.035 and higher > z


def test_an_open_drawer_is_drawn_open():
    away = hand_at((0.5, 0.0, 0.5))
    with Camera(VISUALS, DRAWERS_AHEAD) as camera:
        shut = camera.picture(start(Setting(hand=away)))
        opened = camera.picture(start(Setting(hand=away, openings=(0.14, 0.14, 1.2))))
        again = camera.picture(start(Setting(hand=away)))
    assert np.array_equal(shut, again)  # it remembers nothing
    assert (np.abs(shut.astype(int) - opened).max(axis=2) > DIFFERENT).sum() > 300


def test_every_part_has_a_colour():
    colours = {shape.colour for shape in VISUALS.shapes}
    assert {LEFT_DRAWER.colour, LEFT_DRAWER.moving_colour} <= colours
