# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training from exploration to a library on disk, small."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.finished_jobs import cached_jobs
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import SequentialWorkers, ray_workers
from slap_ros.shortcuts import training
from slap_ros.shortcuts.candidate_groups import CandidateGroup, rank
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.progress import SNAPSHOTS, latest
from slap_ros.shortcuts.settings import POLISH
from slap_ros.shortcuts.shortcut_candidate import ShortcutCandidate
from slap_ros.shortcuts.shortcut_library import load_library, load_shortcut, save_library
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.stopping import Stopping
from slap_ros.shortcuts.training import Training
from slap_ros.shortcuts.training_steps import plans_name
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder
from slap_ros.skills.domain_choice import DomainChoice
from support.programs import PATH, environment

TASKS = TaskDistribution(DomainChoice("obstacle2d", "fair"), 5)
OURS = training_settings("ours", get_domain("obstacle2d"))
SMALL = replace(
    OURS,
    exploration=ExplorationSettings(tasks=2, rollouts=60, length=30, action_repeat=4),
    ppo=replace(OURS.ppo, total_steps=6_000),
    starts=24,
    validation=3,
    shortcuts=1,
)
BRIEF = replace(SMALL, ppo=replace(SMALL.ppo, total_steps=2_048))
BRIEF_POLISH = replace(POLISH, total_steps=2_048)


class Recorder:
    """Keeps what it is called with."""

    def __init__(self, interrupt_at=None):
        self.verdicts, self.interrupt_at = [], interrupt_at

    def on_progress(self, what, done, total):
        if (what, done) == self.interrupt_at:
            raise KeyboardInterrupt

    def on_left_out(self, use, index, reason):
        raise AssertionError((use, index, reason))

    def on_ranked(self, ranked):
        self.ranked = ranked

    def on_learning(self, name, folder, total_steps):
        pass

    def on_validated(self, name, before, after, kept):
        self.verdicts.append((name, before, after, kept))


def train(folder, settings=SMALL, callback=None, workers=None):
    callback = callback or Recorder()
    run = Training(TASKS, settings, folder, workers or SequentialWorkers(), callback).run
    return run(), callback


def files(folder):
    return {
        path.relative_to(folder): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "library.json"
    }


def without_time(record):
    return {k: v for k, v in record.items() if k != "cpu_s"}


def snapshots_in(folder):
    """Weights of a shortcut's first layer, by environment steps."""
    work = ShortcutWorkFolder(folder)
    taken = {steps: load_shortcut(work.snapshot(steps)) for steps in work.snapshots}
    return {steps: one.policy.layers[0][0].tobytes() for steps, one in taken.items()}


@pytest.mark.parametrize(
    "settings",
    [
        replace(SMALL, exploration=replace(SMALL.exploration, tasks=10_001)),
        replace(SMALL, starts=80_001),
        replace(SMALL, validation=2**32),
    ],
)
def test_tasks_with_two_uses_are_refused_at_once(tmp_path, settings):
    with pytest.raises(InvalidParameterError, match="choose settings with fewer"):
        train(tmp_path / "work", settings)
    assert not (tmp_path / "work").exists()


@pytest.mark.training
def test_learning_ends_where_plans_get_no_shorter(tmp_path):
    rule = Stopping(every=1_000, patience=1, least_saving=0.9)  # nothing is 90 % shorter
    long = replace(SMALL, ppo=replace(SMALL.ppo, total_steps=20_000), stopping=rule)
    library, callback = train(tmp_path / "work", long)
    ((_, _, after, _),) = callback.verdicts
    (shortcut,) = library.shortcuts
    lengths = shortcut.record["plan_lengths"]
    assert shortcut.record["environment_steps"] == lengths[-1]["steps"] < 20_000
    assert lengths[-1]["plan_length"] == after  # the rule looks at what decides
    assert library.record["settings"]["stopping"]["every"] == 1_000


@pytest.mark.training
def test_pushing_is_discovered_learned_and_worth_it_and_twice_the_same(tmp_path):
    library, callback = train(tmp_path / "work")
    ((name, before, after, kept),) = callback.verdicts
    assert kept
    assert after < 0.9 * before
    assert name.startswith("Clear_On-")
    save_library(tmp_path / "first", library)
    again, _ = train(tmp_path / "work2")
    for one, other in zip(library.shortcuts, again.shortcuts, strict=True):
        assert one.signature == other.signature
        assert one.shortest == other.shortest
        assert without_time(one.record) == without_time(other.record)
        for mine, its in zip(one.policy.layers, other.policy.layers, strict=True):
            assert mine[0].tobytes() == its[0].tobytes()
    snapshots, same = (snapshots_in(tmp_path / work / name) for work in ("work", "work2"))
    assert 2 <= len(snapshots) <= SNAPSHOTS + 1  # a rollout may be longer than from one to the next
    assert snapshots == same
    assert len(set(snapshots.values())) == len(snapshots)
    loaded = load_library(tmp_path / "first", get_domain("obstacle2d"))
    assert [shortcut.name for shortcut in loaded.shortcuts] == [name]
    assert not loaded.refused


@pytest.mark.training
def test_a_ray_cluster_learns_the_same(tmp_path):
    """Where Ray is installed: ``pip install -e '.[ray]'``."""
    pytest.importorskip("ray")
    brief = replace(SMALL, ppo=replace(OURS.ppo, total_steps=1_024))
    here, _ = train(tmp_path / "here", brief)
    with ray_workers("local") as workers:
        there, _ = train(tmp_path / "there", brief, workers=workers)
    assert there.digest == here.digest


@pytest.mark.slow
@pytest.mark.training
def test_it_goes_on_where_it_was_interrupted(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path / "work", BRIEF, Recorder(interrupt_at=("collecting starts", 24)))
    explored = (tmp_path / "work" / "explored.json").read_bytes()
    library, _ = train(tmp_path / "work", BRIEF)
    assert (tmp_path / "work" / "explored.json").read_bytes() == explored
    whole, _ = train(tmp_path / "whole", BRIEF)
    assert (
        library.shortcuts[0]
        .policy.mean(whole.shortcuts[0].policy.normalisation.mean[None])
        .tobytes()
        == whole.shortcuts[0]
        .policy.mean(whole.shortcuts[0].policy.normalisation.mean[None])
        .tobytes()
    )


class UntilRanked(Recorder):
    """Ends when exploration is over."""

    def on_ranked(self, ranked):
        raise KeyboardInterrupt


@pytest.mark.training
def test_exploration_goes_on_after_the_last_task_that_was_explored(tmp_path):
    once_each = []
    for done, work in (("never", "whole"), (1, "work"), ("never", "work")):
        with pytest.raises(KeyboardInterrupt):
            train(tmp_path / work, BRIEF, UntilRanked(interrupt_at=("exploring tasks", done)))
        once_each.append(sorted(path.name for path in (tmp_path / work).glob("*explored*")))
    assert once_each == [["explored.json"], [".explored.jsonl"], ["explored.json"]]
    whole, resumed = (
        [without_time(task) for task in json.loads((tmp_path / work / "explored.json").read_text())]
        for work in ("whole", "work")
    )
    assert json.dumps(whole) == json.dumps(resumed)


@pytest.mark.parametrize("shortcuts", [0, 1, 4, 8, 40])
def test_plans_with_many_shortcuts_have_a_file(tmp_path, shortcuts):
    """Its name has theirs, as long as a file can have such a name."""
    names = [f"GripperEmpty_On_Overlap-{number:08x}" for number in range(shortcuts)]
    of_each = {plans_name(names[:count]) for count in range(shortcuts + 1)}
    assert len(of_each) == shortcuts + 1
    work = WorkFolder(tmp_path)
    for name in of_each:
        assert cached_jobs(work, name, lambda finished: finished.of("planning"), dict) == {}
    assert plans_name(names[:4]) == "+".join(["plans", *names[:4]])
    assert (tmp_path / f"{plans_name(names)}.json").exists()


KILLED = """
import os
from pathlib import Path
from slap_ros.shortcuts import progress as checkpoints
from slap_ros.shortcuts.work_folder import ShortcutWorkFolder
checkpoints.CHECKPOINT_S = 0.0
import test_training as t
original = ShortcutWorkFolder.append
def append(self, progress):
    original(self, progress)
    if progress["steps"] > 3000:
        os.kill(os.getpid(), 9)
ShortcutWorkFolder.append = append
t.train(Path({work!r}))
"""


@pytest.mark.training
@pytest.mark.slow
def test_a_killed_training_resumes_from_its_checkpoint(tmp_path):
    work = tmp_path / "work"
    path = os.pathsep.join([PATH, str(Path(__file__).parent)])
    killed = subprocess.run(
        [sys.executable, "-c", KILLED.format(work=str(work))],
        env=environment() | {"PYTHONPATH": path},
        check=False,
    )
    assert killed.returncode == -9
    (progress,) = work.glob("*/progress.jsonl")
    before = len(progress.read_text().splitlines())
    library, _ = train(work)
    steps = [json.loads(line)["steps"] for line in progress.read_text().splitlines()]
    assert len(steps) > before
    assert steps[before] > 1024  # not from the beginning
    assert steps[-1] >= 6000
    assert len(library.shortcuts) == 1


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(180)  # three trainings
def test_what_hardly_succeeds_is_learned_again_and_the_best_attempt_counts(tmp_path, monkeypatch):
    brief = replace(BRIEF, polish=BRIEF_POLISH)
    once, _ = train(tmp_path / "once", brief)
    monkeypatch.setattr(training, "ENOUGH_SUCCESS", 0.0)
    enough, _ = train(tmp_path / "enough", replace(brief, attempts=3))
    assert enough.digest == once.digest  # the first attempt is what a single one is
    assert not (tmp_path / "enough" / "attempt2").exists()

    monkeypatch.setattr(training, "ENOUGH_SUCCESS", 1.1)
    callback, work = Recorder(), tmp_path / "again"
    train(work, replace(brief, attempts=2, least_saving=0.0), callback)
    ((name, *_),) = callback.verdicts
    folders = [ShortcutWorkFolder(folder / name) for folder in (work, work / "attempt2")]
    first_stages = [latest(folder)[0] for folder in folders]
    assert first_stages[0] != first_stages[1]
    best = max(range(2), key=lambda attempt: first_stages[attempt].success)
    assert [folder.finished.exists() for folder in folders] == [i == best for i in range(2)]


@pytest.mark.training
@pytest.mark.slow
def test_steps_of_attempts_in_vain_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "ENOUGH_SUCCESS", 1.1)
    plain = replace(BRIEF, least_saving=0.0, polish=None)
    once, _ = train(tmp_path / "once", plain)
    twice, _ = train(tmp_path / "twice", replace(plain, attempts=2))
    (one,), (other,) = once.shortcuts, twice.shortcuts
    assert other.record["attempts"] == 2
    assert other.record["environment_steps"] == 2 * one.record["environment_steps"]
    assert twice.record["environment_steps"]["learning"] == other.record["environment_steps"]


def test_another_training_in_the_same_folder_is_refused(tmp_path):
    train(tmp_path, replace(SMALL, shortcuts=0))
    with pytest.raises(InvalidParameterError, match="other settings"):
        train(tmp_path, replace(SMALL, shortcuts=0, starts=25))


def test_other_goals_are_explored_and_validated_on(tmp_path):
    def pure_planning(share):
        settings = replace(SMALL, shortcuts=0, validation=6, random_goals=share)
        library, callback = train(tmp_path / str(share), settings)
        saved = json.loads((tmp_path / str(share) / "settings.json").read_text())
        assert saved.get("random_goals", 0.0) == share
        return library.record["validation"]["pure_planning"], callback.ranked

    (own, for_own), (other, for_other) = pure_planning(0.0), pure_planning(1.0)
    assert other < own  # their own goal is the farthest that the graph has
    assert [group.savings for group in for_own] != [group.savings for group in for_other]


def candidate(name, expected_saving, operator_path=("Pick",)):
    signature = Signature(("block",), frozenset({(name, (0,))}), frozenset())
    return ShortcutCandidate(signature, operator_path, 3, 4, 100, expected_saving)


def test_candidates_are_ranked_by_what_they_save_over_all_tasks():
    everywhere = [candidate("A", 40.0), candidate("A", 30.0)], [candidate("A", 20.0)]
    once = [candidate("B", 50.0)], []
    explored = [
        ExplorationResult((*a, *b), 10, 100, {"Pick": 5.0})
        for a, b in zip(everywhere, once, strict=True)
    ]
    first, second = rank(explored)
    assert first.signature.name.startswith("A-")
    assert first.relative_saving == pytest.approx(0.3)
    assert second.relative_saving == pytest.approx(0.25)
    assert (first.tasks, second.tasks) == (2, 1)


def test_what_serves_other_tasks_is_worth_learning_beside_what_saves_more():
    def group(name, *savings):
        return CandidateGroup(candidate(name, 0.0).signature, (), savings)

    most, same_tasks, other_tasks = (
        group("most", 0.5, 0.4, 0.0, 0.0),
        group("same", 0.4, 0.4, 0.0, 0.0),
        group("other", 0.0, 0.0, 0.1, 0.1),
    )
    assert most.saving_beside([]) == most.relative_saving == pytest.approx(0.225)
    assert most.tasks == 2
    assert same_tasks.saving_beside([most]) == 0.0
    assert other_tasks.saving_beside([most]) == pytest.approx(0.05)
    assert most.saving_beside([same_tasks, other_tasks]) == pytest.approx(0.025)


def test_what_replaces_later_skills_adds_to_what_replaces_earlier_ones():
    def group(name, operator_path, replaced=()):
        return CandidateGroup(
            candidate(name, 0.0).signature, operator_path, (0.2, 0.1), replaced=replaced
        )

    first = group("A", (), ("Open", "Pick"))
    after = group("B", ("Open", "Pick"), ("Place", "Close"))
    overlapping = group("C", ("Open",), ("Pick", "Place"))
    random = group("D", ("Open", "Pick"))
    assert after.saving_beside([first]) == first.saving_beside([after]) == pytest.approx(0.15)
    assert overlapping.saving_beside([first]) == after.saving_beside([overlapping]) == 0.0
    assert random.saving_beside([after]) == 0.0  # nobody knows what random actions replace
