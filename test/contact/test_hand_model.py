# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hands of the contact world: the quick one, and one like a Panda's."""

import math

import numpy as np
import pytest

pytest.importorskip("pybullet")

import pybullet

from slap_ros.domains import domain_names, get_domain
from slap_ros.errors import InvalidDomainError, InvalidParameterError
from slap_ros.worlds.contact.contacts import Side
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand import SUBSTEP_S
from slap_ros.worlds.contact.hand_model import PANDA, QUICK, HandModel
from slap_ros.worlds.contact.snapshot import ContactIndex

BENCHES = [name for name in domain_names() if ROBOT in get_domain(name).types]


@pytest.mark.parametrize("name", BENCHES)
def test_every_bench_has_both_hands(name):
    """The tasks are the same, and the hand is in the settings that bags record."""
    quick, panda = get_domain(name), get_domain(name, "fair:hand=panda")
    assert quick.configuration["hand"] == "quick" and panda.configuration["hand"] == "panda"
    task = panda.task(3)
    assert task == quick.task(3)
    for domain, hand in ((quick, QUICK), (panda, PANDA)):
        with domain.make_world(task.initial_state) as world:
            assert world.scene.hand == hand
            simulation = world._dynamics._simulation
            for part, surface in simulation._sides.items():
                if surface.side in (Side.LEFT_FINGER, Side.RIGHT_FINGER):
                    dynamics = pybullet.getDynamicsInfo(*part, simulation.client)
                    assert dynamics[1] == hand.friction


@pytest.mark.parametrize("wrong", [{"share": 1.0}, {"friction": 0.0}, {"grip_n": math.inf}])
def test_a_hand_that_cannot_be_is_refused(wrong):
    with pytest.raises(InvalidDomainError, match=f"hand's {next(iter(wrong))} must be"):
        HandModel(**wrong)


def test_a_hand_that_there_is_not_is_refused_by_name():
    with pytest.raises(InvalidParameterError, match="must be quick or panda"):
        get_domain("stack_at_target", "fair:hand=robotiq")


def test_a_pandas_hand_lags_and_its_fingers_are_slower():
    """Where nothing is near, a formula says where it is; PyBullet agrees elsewhere."""
    domain = get_domain("stack_at_target", "fair:hand=panda")
    with domain.make_world(domain.task(3).initial_state) as world:
        index = ContactIndex.of(world.scene, world.state.layout)
        for _ in range(12):
            state = world.step(np.array([0.01, 0.0, 0.0, 0.0, 1.0]))
        hand = index.read(state).hand
    lag_s = SUBSTEP_S / PANDA.share
    behind = hand.target[0] - hand.pose.position[0]
    assert behind == pytest.approx(hand.velocity[0] * lag_s, rel=0.15)
    assert hand.fingers[0] == pytest.approx(0.04 - 12 * 0.05 * 0.05, abs=2e-3)
