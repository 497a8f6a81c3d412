# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shipped shortcuts and old bags rest on these worlds: the same commands lead to the same states.

The commands are the first 60 of plans for task 3 of each domain. To the bit, these were the states
before there was a world with contact forces; here they are compared to 1e-6, since other processors
may round the last bits differently. Toys are meshes that touch in many points: there, the last bit
of a start state makes up to 0.03 mm after 60 steps, and other processors end as far apart.
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
}
TOYS = {  # x, y, z in m where they are in the end; one is carried, one lies in the bin
    "duck": (0.3870, 0.2415, 0.1357),
    "toy_robot": (0.5197, 0.0779, 0.0266),
    "dinosaur": (0.4500, 0.3500, -0.3003),
}
TOY_TOLERANCE = 1e-3  # m


def is_simulated_as_recorded(name):
    try:
        return name == "obstacle2d" or version("pybullet") == PYBULLET
    except PackageNotFoundError:
        return False


def world_of(name):
    """The world of task 3, and its initial state."""
    if not is_simulated_as_recorded(name):
        pytest.skip(f"recorded with PyBullet {PYBULLET}")
    domain = get_domain(name)
    start = domain.task(3).initial_state
    return domain.make_world(start), start


@pytest.mark.parametrize("name", DIGESTS)
def test_recorded_commands_lead_to_the_states_that_they_did(name):
    world, start = world_of(name)
    states = np.array([world.step(np.array(command)).data for command in COMMANDS[name]])
    moved = [obj.name for obj in start.objects if (world.state[obj] != start[obj]).any()]
    assert len(moved) > 1  # things, not the robot alone
    rounded = np.round(states, 6) + 0.0  # without negative zeros
    assert hashlib.sha256(rounded.tobytes()).hexdigest()[:16] == DIGESTS[name]


def test_recorded_commands_take_toys_to_where_they_did():
    world, start = world_of("cleanup_table")
    for command in COMMANDS["cleanup_table"]:
        world.step(np.array(command))
    for name, place in TOYS.items():
        toy = start.layout.object(name)
        there = [world.state.get(toy, axis) for axis in ("x", "y", "z")]
        np.testing.assert_allclose(there, place, atol=TOY_TOLERANCE, err_msg=name)
