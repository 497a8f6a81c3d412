# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The camera before the robot in MuJoCo, without nodes: what a picture says, and what none says."""

from dataclasses import replace

import pytest

from slap_ros.domains import get_domain
from slap_ros.vision.image_noise import ImageNoise

pytest.importorskip("mujoco")
pytest.importorskip("pupil_apriltags")

from slap_ros.robot.mujoco.detectors import TagCameraDetector, camera_beside

DOMAIN = get_domain("obstacle_tower", "fair:obstacles=1,distractors=0")


def test_a_lost_picture_says_nothing_of_what_is_hidden_and_the_next_one_is_searched():
    """Nothing moves meanwhile: a picture that was searched counts again, a lost one does not."""
    settings = replace(camera_beside(), noise=ImageNoise(2.0, lost=0.6), seed=2)
    detector = TagCameraDetector(DOMAIN, DOMAIN.task(1).initial_state, settings)
    try:
        found = [detector.detect() for _ in range(12)]
    finally:
        detector.close()
    lost = found.index(next(seen for seen in found if seen is not None))
    assert lost > 0
    assert found[:lost] == [None] * lost
    assert all(seen is found[lost] and seen for seen in found[lost:])
