# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""In every domain with contact, state and action are all that decides the next state."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.registry import OURS
from slap_ros.worlds.contact.features import ROBOT
from support.domain_transitions import differing, orders, record, save
from support.marks import slow
from support.programs import environment, program

DOMAINS = [name for name in OURS if get_domain(name).acquisition is not None]
COUNT = 120  # steps; ``domain_transitions`` is a command for more
ALONE = 10  # of them, of which one is taken in a world of its own


@pytest.fixture(scope="module", params=[*DOMAINS[:1], *slow(*DOMAINS[1:])])
def recorded(request):
    return request.param, record(request.param, COUNT)


def test_the_steps_are_taken_in_contact(recorded):
    _, steps = recorded
    things = [obj for obj in steps[0].state.objects if not obj.type.is_a(ROBOT)]
    bodies = [obj for obj in things if "held" in obj.type.column]
    held = [any(step.following.get(body, "held") > 0.5 for body in bodies) for step in steps]
    moved = [any((s.state[thing] != s.following[thing]).any() for thing in things) for s in steps]
    assert np.mean(held) > 0.02
    assert np.mean(moved) > 0.2


@pytest.mark.parametrize("order", ["forwards", "backwards", "shuffle 1", "in worlds of their own"])
def test_the_same_in_any_order(recorded, order):
    name, steps = recorded
    worlds = orders(steps)[order]
    for world in worlds if len(worlds) == 1 else worlds[::ALONE]:
        assert differing(name, world) == 0


def test_the_same_in_another_process(recorded, tmp_path):
    name, steps = recorded
    save(steps, tmp_path / "steps.npz")
    command = [*program("domain_transitions"), name, "--file", tmp_path / "steps.npz"]
    answer = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    assert answer.stdout == f"0 of {COUNT} differ\n"
