# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures show what the state says."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, ImageSequence

from benchmarks.physics_step import NAMES, tower
from slap_ros.relational import State
from slap_ros.worlds.animation import WRITERS
from slap_ros.worlds.bullet import pybullet
from slap_ros.worlds.joint_space.scene import TABLE, Scene, cube
from slap_ros.worlds.joint_space.visuals import SceneVisuals
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.rendering import Camera, Viewpoint, write_animation
from support.transitions import holding

RED, BLUE = (0.9, 0.1, 0.1, 1.0), (0.1, 0.1, 0.9, 1.0)
SCENE = Scene((TABLE, *(cube(n, RED if n == "T" else BLUE) for n in NAMES)))
VIEW = Viewpoint(width=160, height=120)


@pytest.fixture
def camera():
    with Camera(SceneVisuals(SCENE), VIEW) as camera:
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


def falling() -> list[State]:
    state = tower()
    block = state.layout.object("T")
    return [state.replace({(block, "z"): 0.3 - 0.05 * k}) for k in range(4)]


def frames_of(path: Path) -> list[np.ndarray]:
    if path.suffix == ".gif":
        with Image.open(path) as image:
            return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(image)]
    video, frames = cv2.VideoCapture(str(path)), []
    while True:
        found, frame = video.read()
        if not found:
            return frames
        frames.append(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB))


@pytest.mark.parametrize("ending", WRITERS)
def test_an_animation_has_a_frame_a_step_that_shows_it(camera, tmp_path, ending):
    states, told = falling(), []
    path = tmp_path / f"fall{ending}"
    write_animation(path, camera, states, CONTROL_PERIOD_S, told.append)
    assert told == [1, 2, 3, 4]
    assert list(tmp_path.iterdir()) == [path]  # nothing else is left
    frames = frames_of(path)
    assert len(frames) == 4
    for frame, state in zip(frames, states, strict=True):
        assert frame.shape == (120, 160, 3)
        assert np.abs(middle_of(frame, 0) - middle_of(camera.picture(state), 0)).max() < 2


def test_animations_play_in_real_time(camera, tmp_path):
    write_animation(tmp_path / "fall.gif", camera, falling(), CONTROL_PERIOD_S)
    write_animation(tmp_path / "fall.mp4", camera, falling(), CONTROL_PERIOD_S)
    with Image.open(tmp_path / "fall.gif") as image:
        assert image.info["duration"] in (120, 130)  # ms, in hundredths of a second
    assert cv2.VideoCapture(str(tmp_path / "fall.mp4")).get(cv2.CAP_PROP_FPS) == 8.0


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_animation_leaves_what_was_there(camera, tmp_path, ending, error):
    path = tmp_path / f"fall{ending}"
    path.write_text("the last one")

    def interrupt(done: int) -> None:
        if done == 3:
            raise error

    with pytest.raises(error):
        write_animation(path, camera, falling(), CONTROL_PERIOD_S, interrupt)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "the last one"


@pytest.mark.parametrize("ending", WRITERS)
def test_a_folder_that_is_not_there_is_an_error(camera, tmp_path, ending):
    with pytest.raises(OSError, match=r"folder|No such file"):
        write_animation(tmp_path / "nowhere" / f"fall{ending}", camera, falling(), CONTROL_PERIOD_S)


def test_a_closed_camera_leaks_no_client():
    before = sum(bool(pybullet.isConnected(client)) for client in range(64))
    for _ in range(3):
        with Camera(SceneVisuals(SCENE), VIEW) as camera:
            camera.picture(tower())
    assert sum(bool(pybullet.isConnected(client)) for client in range(64)) == before
