# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Each part of acquiring skills is left out alone, and what is learned without it is counted."""

import json
from dataclasses import asdict

import pytest

from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.learning_curves import PLAN
from slap_ros.learning.task_distribution import TRAINING_SEED
from slap_ros.skills.skill import approach_of
from slap_ros.studies.lg_sail import acquisition_ablation as ablation
from slap_ros.studies.lg_sail.learning_curves import AcquisitionSetup, LearningCurves
from support.slap_command import slap

OURS = AcquisitionSetup("stack_at_target", "fair", "training", AcquisitionSettings())


def left_out(part):
    """What is otherwise without a part: settings, rewards, and whether skills are approached."""
    setup = ablation.AblatedSetup.of(OURS, part)
    ours, source = OURS.source(3), setup.source(3)
    found = {
        name
        for name, value in {**asdict(setup.settings), **asdict(setup.settings.sac)}.items()
        if value != {**asdict(OURS.settings), **asdict(OURS.settings.sac)}[name]
    } - {"sac"}
    if source.rewards() != ours.rewards():
        found.add("rewards")
    task = source.task(0)
    assert task.initial_state == ours.task(0).initial_state
    assert source.operators() == ours.operators()
    (pick,) = (one for one in source.operators() if one.name == "Pick")
    objects = tuple(
        next(one for one in task.initial_state.layout.objects if one.type.is_a(variable.type))
        for variable in pick.parameters
    )
    if approach_of(source.make_domain())(task.initial_state, objects)(task.initial_state) is None:
        found.add("approach")
    return found


@pytest.mark.parametrize(
    ("part", "changed"),
    [
        (ablation.NOTHING, set()),
        (ablation.REWARDS, {"rewards"}),
        (ablation.APPROACH, {"approach"}),
        ("dense reward", {"dense_share"}),
        ("rehearsal", {"rehearsal"}),
        ("held noise", {"longest_hold"}),
        ("normalised critics", {"critic_layer_norm"}),
    ],
)
def test_a_part_is_left_out_and_nothing_else(part, changed):
    assert OURS.source(3).task(0).seed == TRAINING_SEED + 3
    assert left_out(part) == changed


def test_every_part_is_told_apart_above():
    (mark,) = test_a_part_is_left_out_and_nothing_else.pytestmark
    assert tuple(part for part, _ in mark.args[1]) == ablation.PARTS


def study(*arguments):
    pytest.importorskip("matplotlib")
    command = ["study", "acquisition_ablation", *arguments]
    return slap(*command)


@pytest.mark.training
@pytest.mark.usefixtures("points_installed")
def test_the_study_learns_without_each_part_and_is_read_again(tmp_path):
    settings = (
        "sac.net_arch=4", "sac.learning_starts=96", "segment_episodes=4", "rollouts=3",
        "validation=3",
    )  # fmt: skip
    arguments = [
        *("points", "--without", ablation.NOTHING, "--without", "dense reward"),
        *("--seeds", 1, "--steps", 400, "--output", tmp_path),
        *(word for one in settings for word in ("--set", one)),
    ]
    ran = study(*arguments)
    assert ran.exit_code == 0, ran.output
    path = tmp_path / "acquisition_ablation_points.json"
    before = json.loads(path.read_text())
    ours, without = before["found"]["parts"]
    assert (ours["without"], without["without"]) == (ablation.NOTHING, "dense reward")
    assert ours["steps"] == without["steps"] == [384]  # four segments of 96 steps
    assert not list(tmp_path.glob(".acquisition_ablation_points-*/"))
    assert study(*arguments).exit_code == 0
    assert json.loads(path.read_text())["found"] == before["found"]


def test_steps_of_a_training_that_never_came_there_are_a_bound():
    trainings = tuple(
        LearningCurves({PLAN: (Point(0, 0.0), Point(800, last))}, {}, "", last)
        for last in (0.9, 0.5)
    )
    row = list(ablation._row(ablation.PartResult("rehearsal", trainings)))
    assert row == ["rehearsal", "0.70 ± 0.28", "≥ 800 ± 0 (1 of 2 came there)", "800 ± 0"]


def test_what_cannot_be_studied_is_refused(tmp_path):
    for wrong, said in (
        (("stack_at_target", "--without", "luck"), "no such part"),
        (("obstacle2d",), "obstacle2d"),
        (("stack_at_target", "--steps", 1), "--steps"),
    ):
        ran = study(*wrong, "--output", tmp_path)
        assert ran.exit_code != 0
        assert said in " ".join(ran.stderr.split())
    assert not list(tmp_path.iterdir())
