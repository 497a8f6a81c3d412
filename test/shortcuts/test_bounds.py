# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bound that search assumes for a shortcut, half of its shortest success in training.

``python -m benchmarks.shortcut_bounds`` measures it on many tasks.
"""

import pytest

from benchmarks.shortcut_bounds import measure
from support.marks import slow


@pytest.mark.parametrize(
    ("domain", "tasks"),
    [
        ("obstacle2d", 2),
        *slow(("obstacle_tower", 2), ("cleanup_table", 2), ("cluttered_drawer", 1)),
    ],
)
def test_no_rollout_of_a_shipped_shortcut_is_shorter_than_its_bound(domain, tasks):
    figures = measure(domain, tasks)
    assert figures["states"] >= tasks  # else nothing was measured
    assert figures["below_bound"] == 0
    # Far from it: every rollout takes at least three quarters of the shortest success.
    assert figures["least_ratio"] >= 0.75
