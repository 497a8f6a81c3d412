# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the shortcuts begin that random rollouts find."""

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.shortcuts.explore import Explorer
from slap_ros.shortcuts.settings import ExplorationSettings


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
