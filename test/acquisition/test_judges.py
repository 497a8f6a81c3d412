# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Checkpoints judged in another process, while the next segment is learned."""

from dataclasses import replace
from multiprocessing import active_children

import pytest

from slap_ros.acquisition.curriculum import jobs
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.task_source import VALIDATION, TaskSource
from slap_ros.acquisition.training.judges import JudgeElsewhere
from slap_ros.acquisition.training.sac import SkillLearner
from slap_ros.acquisition.training.sac_settings import SacSettings
from slap_ros.acquisition.training.settings import AcquisitionSettings
from support.marks import slow
from support.points import POINTS, REWARDS

pytestmark = pytest.mark.usefixtures("points_installed")

SOURCE = TaskSource.of(POINTS, "train", 1, POINTS.acquisition.operators, REWARDS)
SAC = SacSettings(net_arch=(16, 16), batch_size=32, learning_starts=96)
SEGMENTS = 4
SETTINGS = AcquisitionSettings(SAC, segment_episodes=2, skill_steps=SEGMENTS * 192)


def starts(first):
    rollouts = [PlanRollout.from_json(jobs.carry_out(SOURCE, first + i, {})) for i in range(8)]
    return InitiationStates.of("Pick", rollouts)


def job(folder, settings=SETTINGS):
    return jobs.LearningJob(
        SOURCE, "Pick", 0, starts(0), starts(VALIDATION.first), settings, folder
    )


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.training
@pytest.mark.parametrize(("enough", "segments"), [(0.0, 1), *slow((2.0, SEGMENTS))])
def test_a_round_is_the_same_whoever_judges_it(tmp_path, enough, segments):
    """Also where two good judgements in a row end it."""
    settings = replace(SETTINGS, enough=enough)
    here = jobs.learn(job(tmp_path / "here", settings))
    elsewhere = jobs.learn(job(tmp_path / "elsewhere", settings), cores=2)
    assert len(here["segments"]) == segments
    assert here == elsewhere
    assert files(tmp_path / "here") == files(tmp_path / "elsewhere")
    assert not active_children()


@pytest.mark.training
def test_three_judgements_that_are_as_good_as_the_goal_needs_end_a_round(tmp_path):
    """The first of them is made before anything is learned."""
    unreachable = replace(SETTINGS, enough=2.0)
    learned = jobs.learn(replace(job(tmp_path, unreachable), needed=0.0))
    assert len(learned["segments"]) == 2


@pytest.mark.slow
@pytest.mark.training
def test_the_next_segment_is_learned_before_the_verdict(tmp_path, monkeypatch):
    """But for the last one, whose verdict ends the round."""
    order = []

    def noted(kind, name):
        original = getattr(kind, name)

        def method(self, *arguments):
            order.append(name)
            return original(self, *arguments)

        monkeypatch.setattr(kind, name, method)

    noted(SkillLearner, "learn")
    noted(JudgeElsewhere, "begin")
    noted(JudgeElsewhere, "verdict")
    jobs.learn(job(tmp_path, SETTINGS), cores=2)
    assert order == [*["begin", "learn", "verdict"] * SEGMENTS, "begin", "verdict"]


@pytest.mark.slow
@pytest.mark.training
def test_a_judge_that_is_killed_is_noticed_and_the_same_job_goes_on(tmp_path, monkeypatch):
    undisturbed = jobs.learn(job(tmp_path / "undisturbed"))
    begin, left = JudgeElsewhere.begin, [2]

    def killed(self, policy):
        left[0] -= 1
        if left[0] == 0:
            active_children()[-1].kill()
        begin(self, policy)

    monkeypatch.setattr(JudgeElsewhere, "begin", killed)
    with pytest.raises(ChildProcessError, match="a process that stepped worlds ended"):
        jobs.learn(job(tmp_path / "disturbed"), cores=2)
    assert jobs.learn(job(tmp_path / "disturbed"), cores=2) == undisturbed
    assert files(tmp_path / "disturbed") == files(tmp_path / "undisturbed")
