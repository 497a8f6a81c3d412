# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A known skill stays where what was learned from it does no better on the same tasks."""

from dataclasses import replace

import pytest

from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.curriculum_folder import CurriculumFolder
from slap_ros.acquisition.curriculum.known_or_learned import KnownOrLearned
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.sac_settings import SMALL
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.acquisition import UnwatchedCurriculum
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.skills.skill_library import SkillLibrary, load_skill_library
from support.points import POINTS, REWARDS
from support.steady_skills import PICKING, PUTTING, towards, write_library

pytestmark = pytest.mark.usefixtures("points_installed")
SETTINGS = AcquisitionSettings(
    replace(SMALL, net_arch=(4,), learning_starts=192),
    rollouts=6,
    validation=6,
    segment_episodes=2,
    skill_steps=200,
    total_steps=200,
)


def weak():
    """The skill that picks, but never goes to the left."""
    skill = replace(PICKING, policy=towards(0, False))
    skill.policy.layers[1][0][0, 1] = 0.0
    return skill


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Skills to keep, by the path of their folders."""
    path = write_library(tmp_path_factory.mktemp("kept") / "weak", weak(), PUTTING)
    skills = load_skill_library(path, POINTS).skills
    return {str(path / skill.folder_name): skill for skill in skills}


def acquire(folder, **skills):
    source = TaskSource.of(POINTS, "train", 1, POINTS.acquisition.operators, REWARDS)
    workers, callback = SequentialWorkers(), UnwatchedCurriculum()
    return Curriculum(source, SETTINGS, folder, workers, callback, **skills).run()


def outcome(folder, found):
    """Say how both did, in the place of the trials, before a curriculum reads it."""
    CurriculumFolder(folder).compared(lambda: [found.as_json()])


@pytest.mark.training
def test_a_skill_that_was_kept_stays_unless_what_was_learned_does_better(tmp_path, kept):
    before = SkillLibrary(POINTS.name, tuple(sorted(kept.values(), key=lambda s: s.folder_name)))
    outcome(tmp_path / "as well", KnownOrLearned(6, 0.5, 0.5))
    assert acquire(tmp_path / "as well", kept=kept).digest == before.digest
    outcome(tmp_path / "better", KnownOrLearned(6, 0.5, 0.75))
    library = acquire(tmp_path / "better", kept=kept)
    assert library.skills[0].record["beside_its_beginning"] == {
        "states": 6, "known": 0.5, "learned": 0.75
    }  # fmt: skip
    assert library.skills[0].record["success"] != 0.5


@pytest.mark.training
def test_a_skill_of_another_library_stays_as_well_and_the_record_says_so(tmp_path):
    """Nearly nothing can be learned in so few steps, so that neither does better."""
    library = acquire(tmp_path / "work", known={"other/Pick": weak()})
    (pick,) = (skill for skill in library.skills if skill.operator.name == "Pick")
    found = KnownOrLearned(**pick.record["beside_its_beginning"])
    assert found.states == 6
    assert pick.record["began_with"]["skill"] == weak().folder_name
    assert found.known_stays
    assert pick.record["success"] == found.known
    ours, theirs = (SkillLibrary("", (one,)).digest for one in (pick, weak()))
    assert ours == theirs
    assert acquire(tmp_path / "work", known={"other/Pick": weak()}).digest == library.digest


@pytest.mark.parametrize(
    ("found", "stays"),
    [((9, 0.8, 0.7), True), ((9, 0.8, 0.8), True), ((9, 0.7, 0.8), False), ((0, 0.0, 0.0), False)],
)
def test_the_known_skill_stays_where_the_other_does_no_better(found, stays):
    assert KnownOrLearned(*found).known_stays is stays
