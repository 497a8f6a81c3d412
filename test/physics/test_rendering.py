# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures show what the state says."""

from __future__ import annotations

import numpy as np
import pybullet
import pytest
from pairs import holding
from PIL import Image

from benchmarks.physics_step import NAMES, tower
from slap_ros.physics.rendering import Camera, View, write_gif
from slap_ros.physics.scene import TABLE, Scene, cube

RED, BLUE = (0.9, 0.1, 0.1, 1.0), (0.1, 0.1, 0.9, 1.0)
SCENE = Scene((TABLE, *(cube(n, RED if n == "T" else BLUE) for n in NAMES)))
VIEW = View(width=160, height=120)


@pytest.fixture
def camera():
    with Camera(SCENE, VIEW) as camera:
        yield camera


def middle_of(picture: np.ndarray, channel: int) -> np.ndarray:
    """Mean row and column of the pixels in which one colour stands out."""
    colours = picture.astype(int)
    others = np.delete(colours, channel, axis=2).max(axis=2)
    found = np.argwhere(colours[..., channel] > others + 60)
    assert len(found) > 10
    return found.mean(axis=0)


def test_a_block_is_drawn_where_it_is(camera):
    state = tower()
    block = state.layout.object("T")
    first = middle_of(camera.picture(state), 0)
    higher = middle_of(camera.picture(state.replace({(block, "z"): 0.3})), 0)
    assert higher[0] < first[0] - 10  # rows count downwards
    assert abs(higher[1] - first[1]) < 4
    # The camera is at the front right: what moves ahead, comes nearer and lower in the picture.
    nearer = middle_of(camera.picture(state.replace({(block, "x"): 0.65})), 0)
    assert nearer[0] > first[0] + 4


def test_a_held_block_is_drawn_in_the_hand(camera):
    on_table, in_hand = camera.picture(tower()), camera.picture(holding(tower(), "T"))
    assert middle_of(in_hand, 0)[0] < middle_of(on_table, 0)[0] - 20


def test_the_arm_is_drawn_where_it_is(camera):
    state = tower()
    turned = state.replace({(state.layout.object("robot"), "joint1"): 1.5})
    a, b = camera.picture(state), camera.picture(turned)
    assert (np.abs(a.astype(int) - b).max(axis=2) > 40).sum() > 200
    assert np.array_equal(camera.picture(state), a)  # it remembers nothing


def test_an_animation_has_a_frame_a_step(camera, tmp_path):
    state = tower()
    block = state.layout.object("T")
    states = [state.replace({(block, "z"): 0.1 + 0.05 * k}) for k in range(4)]
    told = []
    write_gif(tmp_path / "fall.gif", camera, states, told.append)
    assert told == [1, 2, 3, 4]
    with Image.open(tmp_path / "fall.gif") as image:
        assert image.n_frames == 4
        assert image.size == (160, 120)
        assert image.info["duration"] in (120, 130)  # ms, in hundredths of a second


def test_a_closed_camera_leaks_no_client():
    before = sum(bool(pybullet.isConnected(client)) for client in range(64))
    for _ in range(3):
        with Camera(SCENE, VIEW) as camera:
            camera.picture(tower())
    assert sum(bool(pybullet.isConnected(client)) for client in range(64)) == before
