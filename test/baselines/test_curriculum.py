# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where episodes of the rival called curriculum begin, and when its progress is measured."""

from dataclasses import replace

import numpy as np
import pytest

from slap_ros.baselines.progress_curve import CURVE, ProgressCurve
from slap_ros.baselines.reverse_curriculum import (
    EPISODES,
    SLACK,
    SPARE,
    WIDTH,
    ReverseCurriculum,
    StartingPoints,
)
from slap_ros.baselines.training_tasks import TrainingTally
from slap_ros.environments.registration import make_task_env
from slap_ros.errors import InvalidParameterError
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain


@pytest.fixture(scope="module")
def shown():
    domain = open_domain(DomainChoice("stack_at_target", "fair", DEMONSTRATOR))
    return StartingPoints.of(domain, domain.task(3, 0))


def test_late_starts_have_fewer_stages_to_go_and_fewer_steps(shown):
    env = make_task_env("stack_at_target", "fair", obs="dict", reward="stages")
    done = []
    for share in np.linspace(1.0, 0.0, 21):  # of the demonstration, to the end
        begun = shown.from_share(share)
        _, info = env.reset(options={"task": begun})
        assert not info["success"]
        done.append(env._reward._stages)
        assert begun.step_limit <= SLACK * (len(shown.states) + 1) + SPARE
    assert done == sorted(done, reverse=True)
    assert (done[0], done[-1]) == (4, 1)
    assert shown.from_share(1.0).initial_state == shown.task.initial_state
    assert shown.from_share(0.0).step_limit < shown.from_share(1.0).step_limit


def test_what_is_solved_already_is_nothing_to_begin_from(shown):
    domain = open_domain(DomainChoice("stack_at_target", "fair", DEMONSTRATOR))
    assert StartingPoints.of(domain, replace(shown.task, goal=frozenset())) is None


def test_starts_move_back_with_success_until_tasks_are_whole(shown):
    tally = TrainingTally()
    curriculum, rng = ReverseCurriculum([shown], tally), np.random.default_rng(0)

    def after(episodes, success):
        for _ in range(episodes):
            tally.ended(success)
        return curriculum.start(shown.task, rng), curriculum.reach

    assert after(EPISODES, False)[1] == WIDTH  # failing moves nothing
    assert after(EPISODES - 7, True)[1] == WIDTH  # 13 of the last 20
    assert after(1, True)[1] == 2 * WIDTH
    assert after(EPISODES - 1, True)[1] == 2 * WIDTH  # counted anew since it moved
    for number in range(8):
        begun, reach = after(EPISODES, True)
        assert reach == pytest.approx((number + 3) * WIDTH)
        assert begun.initial_state != shown.task.initial_state or reach == 1.0
    assert after(EPISODES, True) == (shown.task, pytest.approx(1.1))


def test_progress_is_measured_ten_times_and_not_again_after_an_interruption(tmp_path):
    measured = iter(range(100))
    curve = ProgressCurve(tmp_path, lambda: next(measured) / 100, 1000)
    curve.go_on(0)
    for steps in range(10, 660, 10):
        curve.advance(steps)
    assert curve.points == [(100 * i, i / 100) for i in range(7)]
    again = ProgressCurve(tmp_path, lambda: next(measured) / 100, 1000)
    again.go_on(440)  # the checkpoint is older than the last measurements
    for steps in range(450, 1010, 10):
        again.advance(steps)
    assert again.points[:5] == curve.points[:5]
    assert [steps for steps, _ in again.points] == list(range(0, 1001, 100))
    (tmp_path / CURVE).write_text("[[0, 0.0], [100")
    with pytest.raises(InvalidParameterError, match=r"curve\.json: damaged"):
        again.go_on(1000)
