# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the shortcuts begin that random rollouts find."""

import numpy as np

from slap_ros.domains import get_domain
from slap_ros.shortcuts.explore import Explorer
from slap_ros.shortcuts.settings import Exploration


def explore(nodes):
    settings = Exploration(rollouts=16, length=30, nodes=nodes)
    rng = np.random.default_rng(0)
    return Explorer(get_domain("cluttered_drawer"), 1_000_000, 0, settings, rng).explore().finds


def test_what_is_found_where_the_hand_was_sent_is_tried_from_before_it_was():
    # At random the hand never gets from home to the blocks; over them it pushes some aside.
    assert not explore(nodes=1)
    finds = explore(nodes=3)
    assert finds
    assert {find.origin for find in finds} == {()}  # such are worth more than those after Reach
    assert all(find.steps > 10 for find in finds)  # the way there counts
