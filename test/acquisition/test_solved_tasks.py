# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Steps until tasks are solved: from judgements of skills, and of whole plans between rounds."""

import pytest

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, Stage, StageEnd
from slap_ros.acquisition.curriculum.solved_shares import Point, SolvedShares
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.api.acquisition import UnwatchedCurriculum
from slap_ros.api.learning_curves import CurveCallback, steps_to

PLAN = ("Pick(a)", "Put(a)", "Pick(b)", "Put(b)")


def rollout(index, done):
    """A plan whose first stages were done, and the next one failed."""
    ends = [StageEnd.DONE] * done + [StageEnd.NO_EFFECT] * (done < len(PLAN))
    names = [text.partition("(")[0] for text in PLAN]
    stages = [Stage(name, (), (), end.value, 1) for name, end in zip(names, ends, strict=False)]
    return PlanRollout(index, PLAN, tuple(stages))


def test_the_success_of_plans_is_the_product_of_that_of_their_stages():
    measured = CurveCallback(UnwatchedCurriculum(), 100)
    measured.on_rollouts(0, [rollout(0, 0), rollout(1, 0)])
    measured.on_judged(0, "Pick", Round(0.0, (0.5, 1.0, 0.5), best=2, over=True))
    measured.on_rollouts(1, [rollout(0, 1), rollout(1, 3)])
    measured.on_judged(1, "Put", Round(0.5, (0.8, 1.0), best=2, over=True))
    measured.on_rollouts(2, [rollout(0, 4), rollout(1, 3)])
    assert measured.solved.points == [
        Point(0, 0.0),
        *(Point(steps, 0.0) for steps in (100, 200, 300)),  # nothing puts yet
        Point(300, 0.0),
        Point(400, pytest.approx(0.8**2)),  # both plans of two came to Put with every Pick done
        Point(500, 1.0),
        Point(500, 0.5),
    ]


def test_the_checkpoint_that_stays_counts_and_not_the_last_one():
    measured = CurveCallback(UnwatchedCurriculum(), 100)
    measured.on_rollouts(0, [rollout(0, 1), rollout(1, 4)])
    measured.on_judged(0, "Put", Round(0.5, (1.0, 0.1), best=1, over=True))
    measured.on_judged(0, "Pick", Round(1.0, (1.0,), best=0, over=True))
    assert measured.solved.points[-1] == Point(300, 1.0)


@pytest.mark.parametrize(
    ("success", "steps"),
    [
        ((0.0, 0.9, 0.7, 0.8, 0.9, 0.8, 0.0), (3, True)),
        ((0.0, 0.9, 0.7, 0.9, 0.9), (3, True)),  # after the last, nothing is learned
        ((0.0, 0.9, 0.9, 0.7), (3, False)),
        ((0.8,), (0, True)),
    ],
)
def test_a_level_is_reached_once_three_judgements_in_a_row_have_it(success, steps):
    points = [Point(number, one) for number, one in enumerate(success)]
    assert steps_to(points, 0.8, in_a_row=3) == steps


def test_one_judgement_is_enough_where_no_more_are_asked_for():
    assert steps_to([Point(0, 0.0), Point(5, 0.9), Point(9, 0.1)], 0.8) == (5, True)


def judged(*shares):
    return SolvedShares([Point(number, share) for number, share in enumerate(shares)])


def test_a_goal_is_done_after_three_judgements_in_a_row_and_not_before():
    assert judged(0.1, 0.8, 0.9, 0.8).done(0.8)
    assert not judged(0.9, 0.9).done(0.8)
    assert not judged(0.9, 0.9, 0.7).done(0.8)
    assert not judged(0.9, 0.7, 0.9, 0.9).done(0.8)


def test_a_skill_needs_what_the_others_of_its_plan_leave_to_it():
    """The stages of all that are learned share it evenly; others stay as they are."""
    solved = SolvedShares()
    solved.carried_out(0, [rollout(0, 4), rollout(1, 4), rollout(2, 4), rollout(3, 1)])
    # every Pick is done, and of seven Puts six
    assert solved.needed(0.81, ["Put"]) == pytest.approx(0.9)
    assert solved.needed(0.81, ["Pick"]) == pytest.approx((0.81 / (6 / 7) ** 2) ** 0.5)
    assert solved.needed(0.81, ["Pick", "Put"]) == pytest.approx(0.81**0.25)
    solved.carried_out(0, [rollout(0, 0)])
    assert solved.needed(0.81, ["Pick"]) == pytest.approx(0.81**0.25)  # Put was never tried
    solved.carried_out(0, [rollout(0, 1)])
    assert solved.needed(0.81, ["Pick"]) > 1.0  # Put never succeeds
