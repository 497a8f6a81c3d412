# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The curriculum on a toy domain, to its end; interrupted, resumed, and spread over processes."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from points import PICK, POINTS, REWARDS, begin

from slap_ros.acquisition import skill_training
from slap_ros.acquisition.curriculum import Curriculum
from slap_ros.acquisition.retrieval import nearest, signature_of
from slap_ros.acquisition.rollouts import roll_out
from slap_ros.acquisition.sac_settings import SacSettings
from slap_ros.acquisition.settings import AcquisitionSettings
from slap_ros.acquisition.skill_library import (
    AcquiredSkill,
    acquired_domain,
    load_skill_library,
    save_skill,
    save_skill_library,
)
from slap_ros.acquisition.task_source import TaskSource
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import InvalidLibraryError, InvalidParameterError, UnsolvableError
from slap_ros.learning.mlp_policy import MlpPolicy
from slap_ros.learning.workers import SequentialWorkers, local_workers
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner

pytestmark = pytest.mark.usefixtures("points_installed")
SAC = SacSettings(
    hidden=(32, 32), batch_size=64, learning_rate=2e-3, discount=0.9, tau=0.02, random_steps=192
)
WHOLE = AcquisitionSettings(
    SAC,
    rollouts=12,
    validation=12,
    judged=24,
    segment_episodes=4,
    skill_steps=4_000,
    total_steps=30_000,
)
SHORT = replace(WHOLE, rollouts=3, validation=3, skill_steps=800, total_steps=1_600)
OPERATORS = POINTS.acquisition.operators


class Events:
    """Notes what happens."""

    def __init__(self):
        self.progress, self.judged, self.computed = [], [], []

    def on_progress(self, what, done, total):
        if done == 0:
            self.computed.append(what)

    def on_rollouts(self, iteration, progress, failures):
        self.progress.append((progress, failures))

    def on_judged(self, iteration, skill, outcome):
        self.judged.append((skill, outcome))


def acquire(folder, settings, seed=1, workers=None, goal="train", **more):
    source = TaskSource.of(POINTS, goal, seed, OPERATORS, REWARDS)
    events = Events()
    workers = workers or SequentialWorkers()
    library = Curriculum(source, settings, folder, workers, events, **more).run()
    return library, events


def saved(library, path):
    """What a library is on disk, byte for byte."""
    save_skill_library(path, library)
    files = sorted(file for file in path.rglob("*") if file.is_file())
    return {str(file.relative_to(path)): file.read_bytes() for file in files}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A curriculum that was run to its end, once for several tests."""
    return tmp_path_factory.mktemp("finished")


@pytest.fixture
def whole(finished):
    """Its library and its events."""
    library, events = acquire(finished / "work", WHOLE)
    if not (finished / "library").exists():
        save_skill_library(finished / "library", library)
    return library, events


def test_both_skills_are_acquired(whole):
    library, events = whole
    assert library.record["ended"] == "nothing fails"
    assert events.progress[0] == (0.0, {"Pick": 12})
    assert events.progress[1][1] == {"Put": 12}  # what does not fail is not trained
    assert {name for name, _ in events.judged[1:]} == {"Put"}
    assert events.progress[-1] == (1.0, {})
    assert library.record["progress_on_fresh_tasks"] >= 0.95
    for skill in library.skills:
        assert skill.record["success"] >= 0.95
        assert skill.record["vacuity"]["success"] <= 0.25  # of 12 steps, all within 40 mm
    assert library.record["steps"] == sum(s.record["steps"] for s in library.skills)
    assert library.record["steps"] <= WHOLE.total_steps


def test_a_finished_curriculum_is_read(whole, finished):
    again, events = acquire(finished / "work", WHOLE)
    assert not events.computed
    assert again.digest == whole[0].digest
    with pytest.raises(InvalidParameterError, match="has another training"):
        acquire(finished / "work", WHOLE, seed=2)


def test_acquired_skills_solve_what_training_never_saw(whole, finished):
    """Other tasks, another goal and more objects, planned and executed like any domain."""
    domain = acquired_domain(POINTS, load_skill_library(finished / "library", POINTS))
    for seed in range(5):
        task = task_with_goal(POINTS, 70 + seed, 0, "swapped")
        space = domain.atom_space(task.initial_state)
        goal = space.mask(task.goal)
        planner = make_planner("astar", domain, task.initial_state)
        world = domain.make_world(task.initial_state)
        episode = Executor(domain, planner, world, space, goal, task.step_limit).run()
        assert episode.success, episode.error
    from points import _make

    three = acquired_domain(_make("three"), whole[0])
    skills = {skill.operator.name: skill.in_domain(three) for skill in whole[0].skills}
    done = [
        roll_out(three, three.task(9, i), i, three.operators, skills).progress for i in range(8)
    ]
    assert np.mean(done) >= 0.9


def test_the_library_is_the_same_after_interruptions(tmp_path, monkeypatch):
    """At every write of a training in turn, before and after it."""
    uninterrupted = saved(acquire(tmp_path / "once", SHORT)[0], tmp_path / "library")
    writes, original = 0, skill_training.write_whole
    stops = iter((1, 2, 4, 5, 7))
    stop = next(stops)

    def interrupted(path, text):
        nonlocal writes, stop
        writes += 1
        if writes == stop:
            stop = next(stops, 0)
            if stop % 2:
                original(path, text)
            raise KeyboardInterrupt
        original(path, text)

    monkeypatch.setattr(skill_training, "write_whole", interrupted)
    interruptions = 0
    while True:
        try:
            library, _ = acquire(tmp_path / "often", SHORT)
            break
        except KeyboardInterrupt:
            interruptions += 1
    assert interruptions == 5
    assert saved(library, tmp_path / "again") == uninterrupted


def test_the_library_is_the_same_with_two_processes(tmp_path):
    one = saved(acquire(tmp_path / "one", SHORT)[0], tmp_path / "first")
    with local_workers(2) as workers:
        two = saved(acquire(tmp_path / "two", SHORT, workers=workers)[0], tmp_path / "second")
    assert one == two


def test_a_curriculum_without_budget_or_need_says_so(tmp_path):
    library, events = acquire(tmp_path / "none", replace(SHORT, total_steps=0))
    assert (library.record["ended"], library.skills) == ("the budget is spent", ())
    library, events = acquire(tmp_path / "holds", SHORT, goal="(Loose thing0)")
    assert (library.record["ended"], library.skills) == ("nothing fails", ())
    assert not events.judged


def test_a_goal_out_of_reach_is_refused(tmp_path):
    with pytest.raises(UnsolvableError, match="none of 3 tasks of points has a plan"):
        acquire(tmp_path, SHORT, goal="(and (Holding thing0) (Holding thing1))")


def random_policy(seed=0):
    rng = np.random.default_rng(seed)
    from slap_ros.acquisition.observations import SIZE
    from slap_ros.acquisition.sac import AS_OBSERVED

    shapes = ((32, SIZE), (32, 32), (3, 32))
    layers = tuple(
        (rng.normal(0, 0.2, shape).astype(np.float32), np.zeros(shape[0], dtype=np.float32))
        for shape in shapes
    )
    return MlpPolicy(AS_OBSERVED, layers, np.zeros(3, dtype=np.float32), "relu", squashed=True)


def test_a_skill_begins_with_the_nearest_known_one(tmp_path):
    known = AcquiredSkill(PICK, REWARDS["Pick"], random_policy(), 12)
    folder = tmp_path / known.folder_name
    save_skill(folder, known)
    library, _ = acquire(tmp_path / "work", SHORT, known={str(folder): known})
    pick = library.skills[0]
    assert pick.record["began_with"]["skill"] == known.folder_name


def rename(about):
    about["operator"]["name"] = about["reward"]["operator"] = "Other"


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda about: about.update(sha256="0"), "its checksum is not the one in skill.json"),
        (lambda about: about.update(horizon=0), "its horizon is 0 steps"),
        (lambda about: about.update(activation="eval"), "its activation is 'eval'"),
        (rename, "the folder was renamed"),
        (lambda about: about["reward"]["terms"][0].update(weight=2.0), "its weight is 2.0"),
        (lambda about: about["reward"]["terms"][0].update(metric="magic"), "magic"),
        (lambda about: about.pop("key") and about.pop("operator"), "operator"),
    ],
)
def test_damaged_skills_are_left_out_with_a_reason(tmp_path, damage, reason):
    skill = AcquiredSkill(PICK, REWARDS["Pick"], random_policy(), 12)
    path = tmp_path / skill.folder_name
    save_skill(path, skill)
    (tmp_path / "library.json").write_text('{"format": 1, "domain": "points"}')
    assert [one.operator for one in load_skill_library(tmp_path, POINTS).skills] == [PICK]
    about = json.loads((path / "skill.json").read_text())
    damage(about)
    (path / "skill.json").write_text(json.dumps(about))
    library = load_skill_library(tmp_path, POINTS)
    assert not library.skills
    (refused,) = library.refused
    assert reason in str(refused)


def test_foreign_and_newer_libraries_are_refused(tmp_path):
    (tmp_path / "library.json").write_text('{"format": 1, "domain": "other"}')
    with pytest.raises(InvalidLibraryError, match="skills of domain 'other'"):
        load_skill_library(tmp_path, POINTS)
    (tmp_path / "library.json").write_text('{"format": 2, "domain": "points"}')
    with pytest.raises(InvalidLibraryError, match="format 2"):
        load_skill_library(tmp_path, POINTS)
    shutil.rmtree(tmp_path)
    with pytest.raises(InvalidLibraryError, match="no such folder"):
        load_skill_library(tmp_path, POINTS)


def test_nearest_is_by_what_skills_bring_about():
    pick, put = (signature_of(operator) for operator in OPERATORS)
    assert pick.similarity(pick) == pytest.approx(1.0)
    assert pick.similarity(put) < 0.5
    assert nearest(pick, {"a": put, "b": pick}) == ("b", pytest.approx(1.0))
    assert nearest(pick, {}) is None


def test_a_skill_is_a_function_of_the_state():
    skill = AcquiredSkill(PICK, REWARDS["Pick"], random_policy(), 12).in_domain(POINTS)
    (one,) = begin(PICK, [0])
    assert skill.lower_bound(one.state, one.objects) <= 1
    runs = []
    for _ in range(2):
        world, policy = POINTS.make_world(one.state), skill.start(one.state, one.objects)
        actions = []
        while (action := policy(world.state)) is not None:
            actions.append(action.tobytes())
            world.step(action)
        runs.append(actions)
    assert runs[0] == runs[1]
    assert 12 <= len(runs[0]) <= skill.step_limit
