# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files of version 0.1.0 are read as before: work folders of trainings, settings, libraries.

``data/training_of_0_1_0`` was written by that version: one training that was finished, the same
one killed after its second rollout, the record of its library, and all named settings.
"""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from slap_ros.domains import get_domain
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.named_settings import GENERAL, training_settings
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import load_library, save_library
from slap_ros.shortcuts.training import Training
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.slap.trainings import TrainingFolder

DATA = Path(__file__).parent / "data" / "training_of_0_1_0"
NAME = "Clear_On-e41568a9"
OURS = training_settings("ours", get_domain("obstacle2d"))
THEN = replace(  # as the training was started then
    OURS,
    exploration=ExplorationSettings(tasks=2, rollouts=60, length=30, action_repeat=4),
    ppo=replace(OURS.ppo, n_envs=32, net_arch=(16, 16), total_steps=3_000),
    starts=24,
    validation=3,
    shortcuts=1,
)
# They change only where a library is trained again.
SHIPPED = {
    "obstacle2d": "5fbcaeb53005ad68",
    "obstacle_tower": "7219a304729e2c92",
    "cluttered_drawer": "abc081bc0ca7a2a3",
    "cleanup_table": "2f43a9c8c75d0c79",
}


class Steps:
    """Notes what is computed rather than read."""

    def __init__(self):
        self.computed, self.learned = set(), []

    def on_progress(self, what, done, total):
        self.computed.add(what)

    def on_left_out(self, use, index, reason):
        raise AssertionError((use, index, reason))

    def on_ranked(self, ranked):
        self.ranked = ranked

    def on_learning(self, name, folder, total_steps):
        self.learned.append(name)

    def on_validated(self, name, before, after, kept):
        self.verdict = (name, before, after, kept)


@pytest.fixture
def work(tmp_path, request):
    return shutil.copytree(DATA / request.param, tmp_path / "work")


def train(work):
    steps = Steps()
    tasks = TaskDistribution(DomainChoice("obstacle2d", "fair"), 5)
    return Training(tasks, THEN, work, SequentialWorkers(), steps).run(), steps


@pytest.mark.parametrize("work", ["finished"], indirect=True)
def test_a_finished_training_is_read_with_nothing_computed_again(work, tmp_path):
    library, steps = train(work)
    assert not steps.computed
    assert steps.ranked[0].relative_saving > 0.1
    assert steps.verdict == (NAME, 28.0 + 2 / 3, 17.0, True)
    assert library.digest == "91342b8647ebf39f"
    save_library(tmp_path / "library", library)
    now, then = (json.loads((f / "library.json").read_text()) for f in (tmp_path / "library", DATA))
    assert list(now) == [*then, "processor"]
    machine = {"versions": None, "processor": None}
    assert now | machine == then | machine


@pytest.mark.training
@pytest.mark.parametrize("work", ["interrupted"], indirect=True)
def test_a_killed_training_continues_from_its_checkpoint(work):
    kept = {path: path.read_bytes() for path in work.rglob("*.json")}
    library, steps = train(work)
    assert steps.computed == {"planning"}  # with the shortcut: all before was done
    assert {path: path.read_bytes() for path in kept} == kept
    assert [shortcut.name for shortcut in library.shortcuts] == [NAME]
    lines = [json.loads(line) for line in (work / NAME / "progress.jsonl").open()]
    assert [line["steps"] for line in lines] == [1024, 2048, 3072]
    old = set(lines[0])
    assert [set(line) for line in lines] == [old, old, old | {"cpu_s"}]
    assert lines[-1]["shortest"] <= lines[0]["shortest"]


def test_studies_read_an_old_work_folder():
    folder = TrainingFolder(DATA / "finished")
    assert folder.distribution() == {"domain": "obstacle2d", "preset": "fair", "seed": 5}
    assert folder.exploration() == THEN.exploration
    stored = json.loads((DATA / "finished" / "explored.json").read_text())
    explored = folder.explored()
    assert [one.pairs for one in explored] == [task["candidates"] for task in stored]
    for one, task in zip(explored, stored, strict=True):
        assert one.as_json() == {key: value for key, value in task.items() if key != "cpu_s"}
        assert [c.expected_saving for c in one.candidates] == [f["promise"] for f in task["finds"]]
    (curve,) = folder.curves()
    assert [point.steps for point in curve.points] == [1024, 2048, 3072]


def test_all_named_settings_are_written_as_they_were():
    then = json.loads((DATA / "settings_by_name.json").read_text())
    for name, kinds in then.items():
        for domain, settings in kinds.items():
            # The general ones are those of a domain that has none of its own.
            now = training_settings(name, get_domain(domain)) if domain else GENERAL[name]
            written = json.loads(json.dumps(now.as_json()))
            assert written.pop("attempts", 1) == (3 if domain == "cleanup_table" else 1)  # is new
            assert written == settings
            assert list(written) == list(settings)  # in this order, too
            read = ExplorationSettings.from_json(settings["exploration"])
            assert read == now.exploration


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_libraries_load_as_they_were(name):
    library = load_library(shipped_library(name), get_domain(name))
    assert not library.refused
    assert library.digest == SHIPPED[name]
