# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the shortcuts begin that random rollouts find."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidStateError
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer


def explore(nodes):
    settings = ExplorationSettings(rollouts=16, length=30, nodes=nodes)
    rng = np.random.default_rng(0)
    explorer = Explorer.of_task(get_domain("cluttered_drawer"), 1_000_000, 0, settings, rng)
    return explorer.explore().candidates


@pytest.mark.slow
def test_what_is_found_where_the_hand_was_sent_is_tried_from_before_it_was():
    # At random the hand never gets from home to the blocks; over them it pushes some aside.
    assert not explore(nodes=1)
    candidates = explore(nodes=3)
    assert candidates
    paths = {candidate.operator_path for candidate in candidates}
    assert paths == {()}  # such save more than those after Reach
    assert all(candidate.steps > 10 for candidate in candidates)  # the way there counts


def test_where_the_world_can_begin_nothing_nothing_is_explored(monkeypatch):
    """A skill that presses may end in a state that its own world refuses."""
    settings = ExplorationSettings(rollouts=4, length=5, nodes=4)
    rng = np.random.default_rng(0)
    explorer = Explorer.of_task(get_domain("obstacle2d"), 1_000_000, 0, settings, rng)
    first, begun, refused = explorer.task.initial_state.key, [], []
    reset = explorer._rollouts._worlds.reset

    def picky(world, state):
        if state.key != first:
            refused.append(state.key)
            raise InvalidStateError("the hand is pressed in")
        begun.append(world)
        reset(world, state)

    monkeypatch.setattr(explorer._rollouts._worlds, "reset", picky)
    explorer.explore()
    assert begun
    assert len(set(refused)) == len(refused) == settings.nodes - 1
