# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No task of a training has two uses, however many tasks its settings want."""

from itertools import pairwise

import pytest

from slap_ros.acquisition.curriculum import task_source
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.task_range import TaskRange
from slap_ros.shortcuts import jobs

OF_SHORTCUTS = (jobs.EXPLORATION, jobs.STARTS, jobs.VALIDATION)
OF_SKILLS = (task_source.ROLLOUTS, task_source.VALIDATION)


@pytest.mark.parametrize("ranges", [OF_SHORTCUTS, OF_SKILLS])
def test_ranges_of_a_training_have_no_task_in_common(ranges):
    assert ranges[0].first == 0
    assert all(one.end == other.first for one, other in pairwise(ranges))


def test_batches_follow_one_another():
    tasks = TaskRange("trying", 10, 16)
    assert [list(tasks.batch(i, 2)) for i in range(3)] == [[10, 11], [12, 13], [14, 15]]
    assert [tasks.index(i) for i in range(6)] == list(range(10, 16))
    assert list(tasks.batch(1, 0)) == []


@pytest.mark.parametrize(("number", "size"), [(3, 2), (0, 7), (6, 1), (-1, 1)])
def test_a_range_has_no_more_tasks_than_it_has(number, size):
    with pytest.raises(InvalidParameterError, match="6 tasks for trying"):
        TaskRange("trying", 10, 16).batch(number, size)
