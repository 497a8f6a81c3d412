# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's hidden object (SLAP D.4): a block of the tower that nobody sees."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from slap_ros.domains import get_domain
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach
from slap_ros.perception import NoisyPerceiver, Quality
from slap_ros.planning.execution import Executor
from slap_ros.planning.partial import PartialPlanner
from slap_ros.shortcuts.shipped import chosen_library

DOMAIN = get_domain("obstacle_tower")
HIDDEN = Quality(hidden=frozenset({"block4"}))


def solve(approach, seed):
    task = DOMAIN.task(seed)
    initial = task.initial_state
    space, world = DOMAIN.atom_space(initial), DOMAIN.make_world(initial)
    goal = space.mask(task.goal)
    episode = Executor(
        DOMAIN,
        PartialPlanner(
            space, DOMAIN.atom_space, lambda known: approach.planner("lazy", DOMAIN, known)
        ),
        world,
        space,
        goal,
        task.step_limit,
        perceiver=NoisyPerceiver.of(DOMAIN, space, initial, HIDDEN, np.random.default_rng(0)),
    ).run()
    return episode, space.abstract(world.state) & goal == goal


@pytest.mark.slow
def test_a_shortcut_moves_a_tower_of_which_a_block_is_hidden_and_planning_alone_fails_at_first():
    """One slap moves the tower whoever sees it; taken apart it must be seen block by block."""
    shortcuts = chosen_library(None, DOMAIN, "lazy").shortcuts
    with_shortcuts, holds = solve(Approach("slap", shortcuts), 1)
    assert with_shortcuts.success, with_shortcuts.error.reason
    assert holds
    assert with_shortcuts.shortcut_steps > 0 and with_shortcuts.replans == 0
    alone, _ = solve(PURE_PLANNING, 1)
    assert not alone.edges[0].reached  # it holds to the block that it sees as the topmost
    assert not alone.success or alone.plan_length > with_shortcuts.plan_length
