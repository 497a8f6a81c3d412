# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A tower of three on a table, a fourth block beside it, and a Panda."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent.parent)]  # the helpers of these tests; benchmarks


@pytest.fixture
def world():
    """The tower, the arm at home."""
    from benchmarks.physics_step import SCENE, tower
    from slap_ros.worlds.joint_space.world import PandaWorld

    with PandaWorld(SCENE, tower()) as world:
        yield world
