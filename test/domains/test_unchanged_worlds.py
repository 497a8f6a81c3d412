# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shipped shortcuts and old bags rest on these worlds: the same commands lead to the same states.

The commands are the first 60 of plans for task 3 of each domain. To the bit, these were the states
before there was a world with contact forces; here they are compared to 1e-6, since other processors
may round the last bits differently.
"""

import hashlib
import json
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain

COMMANDS = json.loads((Path(__file__).parent / "data" / "recorded_commands.json").read_text())
PYBULLET = "3.2.7"  # another version simulates something else
DIGESTS = {
    "obstacle2d": "6b4362fd807b6a57",
    "obstacle_tower": "f9abd2f3cd85a722",
    "cluttered_drawer": "f0faa56259b441fb",
    "cleanup_table": "90d50a72359e36c6",
}


def is_simulated_as_recorded(name):
    try:
        return name == "obstacle2d" or version("pybullet") == PYBULLET
    except PackageNotFoundError:
        return False


@pytest.mark.parametrize("name", DIGESTS)
def test_recorded_commands_lead_to_the_states_that_they_did(name):
    if not is_simulated_as_recorded(name):
        pytest.skip(f"recorded with PyBullet {PYBULLET}")
    domain = get_domain(name)
    start = domain.task(3).initial_state
    world = domain.make_world(start)
    states = np.array([world.step(np.array(command)).data for command in COMMANDS[name]])
    moved = [obj.name for obj in start.objects if (world.state[obj] != start[obj]).any()]
    assert len(moved) > 1  # things, not the robot alone
    rounded = np.round(states, 6) + 0.0  # without negative zeros
    assert hashlib.sha256(rounded.tobytes()).hexdigest()[:16] == DIGESTS[name]
