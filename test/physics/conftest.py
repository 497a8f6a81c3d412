# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A tower of three on a table, a fourth block beside it, and a Panda."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.fixture
def world():
    """The tower, the arm at home."""
    from benchmarks.physics_step import SCENE, tower
    from slap_ros.worlds.joint_space.world import PandaWorld

    with PandaWorld(SCENE, tower()) as world:
        yield world
