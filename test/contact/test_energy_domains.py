# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""In every domain with contact: nothing is flung, nothing goes through a table, nothing creeps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.features import THING
from slap_ros.domains.benchtop.state_access import LINEAR, position_of
from slap_ros.domains.registry import OURS
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.worlds.contact.features import ROBOT
from support.domain_transitions import demonstrator_of

DOMAINS = [name for name in OURS if get_domain(name).acquisition is not None]
STEPS = 500
SUNK = 5  # steps
LEFT_BETWEEN = 1e-4  # m
PRESSED = 50  # steps from each state that a demonstration passed
FASTEST = 3.0  # m/s
ENTERED = 0.004  # m, how far what is pressed may enter a table
TABLE_EDGES = (0.5, -0.5, 0.15, 0.95)  # m: y of two, x of two
PRESS = np.array([0.0, 0.0, -0.02, 0.0, 0.0])


def things_of(state):
    return [obj for obj in state.objects if not obj.type.is_a(ROBOT)]


def require_sane(state):
    left, right, near, far = TABLE_EDGES
    for thing in state.layout.of_type(THING):
        assert math.hypot(*(state.get(thing, axis) for axis in LINEAR)) < FASTEST
        x, y, z = position_of(state, thing)
        if near < x < far and right < y < left:
            assert z > -ENTERED


@pytest.mark.parametrize("name", DOMAINS)
def test_what_is_left_alone_stays_to_the_bit(name):
    """After it sank by what tasks leave between it and what it stands on."""
    domain = get_domain(name)
    begin = domain.task(0).initial_state
    with domain.make_world(begin) as world:
        for i in range(STEPS):
            state = world.step(np.array([0.0, 0.0, 0.004 * (-1) ** i, 0.0, 0.0]))
            if i == SUNK:
                rested = state
    for thing in things_of(begin):
        assert math.dist(position_of(rested, thing), position_of(begin, thing)) < LEFT_BETWEEN
        assert state[thing].tobytes() == rested[thing].tobytes()


@pytest.mark.parametrize("name", DOMAINS)
def test_what_is_pressed_is_not_flung(name):
    """The hand presses down, with what it holds, in states that a demonstration passed."""
    domain = demonstrator_of(name)
    passed = demonstrate(domain, domain.task(1)).episode.states
    begins = np.linspace(1, len(passed) - 1, STEPS // PRESSED).astype(int)
    with domain.make_world(passed[0]) as world:
        for begin in begins:
            world.reset(passed[begin])
            for _ in range(PRESSED):
                require_sane(world.step(PRESS))
