# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The curriculum on a toy domain, to its end; interrupted, resumed, and spread over processes."""

import json
import shutil
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.acquisition.curriculum import curriculum
from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState, SkillProgress
from slap_ros.acquisition.curriculum.dead_ends import MOST_ATTEMPTS, DeadEnd, find_dead_ends
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, Stage
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.acquisition.curriculum.skill_selection import failing_often, select_skills
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.proposals.proposal_request import Demonstrations, ProposalRequest
from slap_ros.acquisition.training import skill_training
from slap_ros.acquisition.training.retrieval import nearest
from slap_ros.acquisition.training.sac_settings import SacSettings
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_training import ENOUGH_IN_A_ROW
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import InvalidLibraryError, InvalidParameterError, UnsolvableError
from slap_ros.learning.workers import SequentialWorkers, local_workers
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.skills.acquired_domain import acquired_domain
from slap_ros.skills.demonstrator import record_traces
from slap_ros.skills.scripted_skill import with_scripts
from slap_ros.skills.skill_library import (
    AcquiredSkill,
    load_skill_library,
    save_skill,
    save_skill_library,
)
from slap_ros.skills.skill_signature import signature_of
from support.points import HORIZON, PICK, POINTS, PUT, REWARDS, begin
from support.steady_skills import PICKING, PUTTING, towards, write_library

pytestmark = pytest.mark.usefixtures("points_installed")
SAC = SacSettings(
    net_arch=(32, 32), batch_size=64, learning_rate=2e-3, gamma=0.9, tau=0.02, learning_starts=192
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
        self.progress, self.judged, self.computed, self.begun = [], [], [], []
        self.dead_ends = []

    def on_progress(self, what, done, total):
        if done == 0:
            self.computed.append(what)

    def on_rollouts(self, iteration, rollouts):
        failures = Counter(one.failure.operator for one in rollouts if one.failure)
        self.progress.append((np.mean([one.progress for one in rollouts]), dict(failures)))

    def on_dead_end(self, iteration, dead_end):
        self.dead_ends.append(dead_end)

    def on_learning(self, iteration, rounds, steps_left):
        self.begun.append((rounds, steps_left))

    def on_judged(self, iteration, skill, outcome):
        self.judged.append((skill, outcome))


def acquire(
    folder, settings, seed=1, workers=None, goal="train", made=(OPERATORS, REWARDS), **more
):
    source = TaskSource.of(POINTS, goal, seed, *made)
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


@pytest.mark.training
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
    at, progress = library.record["progress_steps"], library.record["progress"]
    assert len(at) == len(progress) and at == sorted(at)
    assert (at[0], at[-1]) == (0, library.record["steps"])


@pytest.mark.training
def test_no_task_is_used_twice(whole, finished):
    """Neither to train on and to judge, nor in two iterations, nor for the progress in the end."""
    folders = sorted((finished / "work").glob("iteration*"))
    assert len(folders) >= 3
    names = Counter(path.stem for folder in folders for path in folder.glob("*.json"))
    assert names == {"rollouts": len(folders), "fresh": len(folders) - 1, "final": 1} | {
        "rounds": len(folders) - 1
    }
    used = Counter(
        rollout["task"]
        for folder in folders
        for name in ("rollouts", "fresh", "final")
        if (folder / f"{name}.json").exists()
        for rollout in json.loads((folder / f"{name}.json").read_text())
    )
    assert set(used.values()) == {1}
    assert len(used) == 2 * WHOLE.rollouts * len(folders)  # as many to judge on


@pytest.mark.training
@pytest.mark.slow
def test_skills_are_acquired_without_anything_written_by_hand(tmp_path):
    """Operators from demonstrations, rewards from metrics."""
    shown = Demonstrations(tuple(record_traces(with_scripts(POINTS), 3)), "the demonstrator")
    task = task_with_goal(POINTS, 1, 0, "train")
    proposal = ProposalRequest.of_task(POINTS, task, "induced", "composed", shown).propose()
    made = (proposal.operators, proposal.rewards)
    library, _ = acquire(tmp_path, WHOLE, made=made)
    assert library.record["ended"] == "nothing fails"
    assert {skill.operator for skill in library.skills} == set(proposal.operators)
    assert library.record["progress_on_fresh_tasks"] >= 0.95


@pytest.mark.training
@pytest.mark.slow
@pytest.mark.timeout(300)  # learns two skills, several times each
def test_a_skill_that_never_succeeds_is_learned_from_scratch_and_so_is_what_comes_before(tmp_path):
    """What is put down is to be still in the hand: no policy does that."""
    impossible = replace(PUT, delete_effects=frozenset())
    impatient = replace(WHOLE, patience=1, skill_steps=1_200, rollouts=6, validation=6)
    made = ((PICK, impossible), REWARDS)
    library, events = acquire(tmp_path, impatient, made=made)
    assert events.dead_ends == [DeadEnd(skill="Put", before="Pick")] * (MOST_ATTEMPTS - 1)
    assert [name for name, _ in events.judged] == ["Pick", "Put"] * MOST_ATTEMPTS
    picks = [outcome for name, outcome in events.judged if name == "Pick"]
    assert all(outcome.initial < 0.5 < outcome.success for outcome in picks)
    assert len({outcome.segments for outcome in picks}) > 1  # other weights, other episodes
    assert library.record["ended"] == "no progress"
    assert {skill.record["attempts"] for skill in library.skills} == {MOST_ATTEMPTS}
    learned = sum(len(outcome.segments) for _, outcome in events.judged)
    assert library.record["steps"] == learned * impatient.segment_steps(HORIZON)
    read, others = acquire(tmp_path, impatient, made=made)
    assert read.digest == library.digest
    assert not others.computed


def test_a_replay_buffer_without_room_for_a_segment_is_refused(tmp_path):
    steps = WHOLE.segment_steps(HORIZON)
    small = replace(WHOLE, sac=replace(WHOLE.sac, buffer_size=steps - 1))
    with pytest.raises(InvalidParameterError, match=f"a segment has {steps} environment steps"):
        acquire(tmp_path, small)
    assert not any(tmp_path.iterdir())


def test_dead_ends_are_behind_skills_that_were_learned_and_not_too_often():
    def rolled_out(*operators):
        ends = ["done"] * (len(operators) - 1) + ["effect not reached"]
        stages = [Stage(o, (), (0.0,), end, 1) for o, end in zip(operators, ends, strict=True)]
        return PlanRollout(0, operators, tuple(stages))

    rollouts = [rolled_out("Pick", "Put")]
    found = DeadEnd(skill="Put", before="Pick")
    tried = SkillProgress(rounds=2, success=0.0)
    for pick, put, expected in (
        (replace(tried, success=1.0), tried, [found]),
        (SkillProgress(), tried, []),  # a skill that was given
        (tried, replace(tried, success=0.1), []),  # it does succeed
        (replace(tried, attempt=MOST_ATTEMPTS - 1), tried, []),
    ):
        state = CurriculumState({"Pick": pick, "Put": put})
        assert find_dead_ends(["Put"], rollouts, state) == expected
    state = CurriculumState({"Pick": tried, "Put": tried})
    assert not find_dead_ends(["Pick"], [rolled_out("Pick")], state)  # nothing comes before


@pytest.mark.training
def test_a_finished_curriculum_is_read(whole, finished):
    again, events = acquire(finished / "work", WHOLE)
    assert not events.computed
    assert again.digest == whole[0].digest
    with pytest.raises(InvalidParameterError, match="training with other settings"):
        acquire(finished / "work", WHOLE, seed=2)


@pytest.mark.training
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
    from support.points import _make

    three = acquired_domain(_make("three"), whole[0])
    skills = {skill.operator.name: skill.in_domain(three) for skill in whole[0].skills}
    done = [
        roll_out(three, three.task(9, i), i, three.operators, skills).progress for i in range(8)
    ]
    assert np.mean(done) >= 0.9


@pytest.mark.slow
@pytest.mark.training
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


@pytest.mark.training
@pytest.mark.slow
def test_the_library_is_the_same_with_two_processes(tmp_path):
    brief = replace(SHORT, total_steps=800)
    one = saved(acquire(tmp_path / "one", brief)[0], tmp_path / "first")
    with local_workers(2) as workers:
        two = saved(acquire(tmp_path / "two", brief, workers=workers)[0], tmp_path / "second")
    assert one == two


def test_a_curriculum_without_budget_or_need_says_so(tmp_path):
    library, events = acquire(tmp_path / "none", replace(SHORT, total_steps=0))
    assert (library.record["ended"], library.skills) == ("the budget is spent", ())
    assert library.record["progress_on_fresh_tasks"] == 0.0
    library, events = acquire(tmp_path / "holds", SHORT, goal="(Loose thing0)")
    assert library.record["ended"] == "the goal holds at the start of every task"
    assert (library.record["progress_on_fresh_tasks"], library.skills) == (1.0, ())
    assert not events.judged


@pytest.mark.slow
@pytest.mark.training
def test_a_skill_that_is_not_learned_is_given_up_and_the_record_says_how_it_failed(tmp_path):
    """Weights that hardly change make no progress, and there is no other skill to go on with."""
    stuck = replace(SHORT, patience=2, total_steps=30_000, sac=replace(SAC, learning_rate=1e-12))
    library, events = acquire(tmp_path, stuck)
    assert library.record["ended"] == "no progress"
    assert [name for name, _ in events.judged] == ["Pick", "Pick"]
    left = library.record["left"]["Pick"]
    assert left["why"] == "no progress"
    assert left["states"] == sum(left["ends"].values()) == stuck.rollouts
    assert set(left["ends"]) <= {"effect not reached", "something else disturbed"}
    assert any(atom.startswith("Holding(") for atom in left["atoms"])


@pytest.mark.training
def test_a_skill_that_was_left_once_is_not_said_to_be_left_in_the_end(tmp_path, monkeypatch):
    """Put is left besides in the first iteration; in the last one Pick alone is."""
    iterations = []

    def with_put_left_first(*given):
        selection = select_skills(*given)
        left = {} if iterations else {"Put": {"why": "no progress"}}
        iterations.append({**selection.not_trained, **left})
        return replace(selection, not_trained=iterations[-1])

    monkeypatch.setattr(curriculum, "select_skills", with_put_left_first)
    stuck = replace(SHORT, patience=1, total_steps=30_000, sac=replace(SAC, learning_rate=1e-12))
    library, _ = acquire(tmp_path, stuck)
    assert [sorted(left) for left in iterations] == [["Put"], ["Pick"]]
    assert library.record["ended"] == "no progress"
    assert sorted(library.record["left"]) == ["Pick"]


@pytest.mark.parametrize(
    ("failures", "chosen"),
    [
        ({"Open": 4, "Pick": 36}, ["Pick"]),
        ({"Open": 12, "Pick": 20}, ["Pick", "Open"]),
        ({"Open": 1, "Pick": 2}, ["Pick", "Open"]),  # nothing is worse
        ({}, []),
    ],
)
def test_what_fails_rarely_waits_for_what_fails_often(failures, chosen):
    assert failing_often(Counter(failures), Counter(Open=40, Pick=40), 0.95) == chosen


def test_a_goal_out_of_reach_is_refused(tmp_path):
    with pytest.raises(UnsolvableError, match="none of 3 tasks of points has a plan"):
        acquire(tmp_path, SHORT, goal="(and (Holding thing0) (Holding thing1))")


def random_policy(seed=0):
    rng = np.random.default_rng(seed)
    from slap_ros.acquisition.training.sac import AS_OBSERVED
    from slap_ros.skills.observations import SIZE

    shapes = ((32, SIZE), (32, 32), (3, 32))
    layers = tuple(
        (rng.normal(0, 0.2, shape).astype(np.float32), np.zeros(shape[0], dtype=np.float32))
        for shape in shapes
    )
    return MlpPolicy(AS_OBSERVED, layers, np.zeros(3, dtype=np.float32), "relu", squashed=True)


def kept(path, *skills):
    """The skills of a library, by folder."""
    write_library(path, *skills)
    return {str(path / skill.folder_name): skill for skill in skills}


def files(path):
    return {str(p.relative_to(path)): p.read_bytes() for p in path.rglob("*") if p.is_file()}


@pytest.mark.slow
@pytest.mark.training
def test_skills_that_are_there_are_kept_and_what_is_missing_is_learned(tmp_path):
    there = kept(tmp_path / "some", PICKING)
    library, events = acquire(tmp_path / "work", SHORT, kept=there)
    assert events.progress[0][1] == {"Put": 3}
    assert {name for name, _ in events.judged} == {"Put"}
    followed = [(one.skill, one.so_far()) for rounds, _ in events.begun for one in rounds]
    assert followed == events.judged
    assert events.begun[0][1] == SHORT.total_steps
    made = saved(library, tmp_path / "library")
    before = files(tmp_path / "some")
    assert {name: made[name] for name in before if "Pick" in name} == {
        name: data for name, data in before.items() if "Pick" in name
    }
    assert [skill.operator.name for skill in library.skills] == ["Pick", "Put"]
    with pytest.raises(InvalidParameterError, match="training with other settings"):
        slower = replace(PICKING, horizon=PICKING.horizon - 1)
        acquire(tmp_path / "work", SHORT, kept=kept(tmp_path / "slower", slower))


def test_where_all_skills_are_there_nothing_is_learned(tmp_path):
    there = kept(tmp_path / "both", PICKING, PUTTING)
    library, events = acquire(tmp_path / "work", SHORT, kept=there)
    assert (library.record["ended"], library.record["steps"]) == ("nothing fails", 0)
    assert not events.judged
    assert library.digest == load_skill_library(tmp_path / "both", POINTS).digest


def test_where_enough_tasks_are_solved_they_are_judged_again_and_nothing_is_learned(tmp_path):
    """A round from the few states that still fail would cost steps, and spoil a good skill."""
    there = kept(tmp_path / "weak", weak_picking(), PUTTING)
    settings = replace(SHORT, rollouts=20, solved=0.1)
    library, events = acquire(tmp_path / "work", settings, kept=there)
    assert library.record["ended"] == "enough tasks are solved"
    assert len(events.progress) == ENOUGH_IN_A_ROW
    assert all(failures for _, failures in events.progress)
    assert not events.judged


def weak_picking():
    """A skill that never goes to the left."""
    weak = replace(PICKING, policy=towards(0, False))
    weak.policy.layers[1][0][0, 1] = 0.0
    return weak


@pytest.mark.slow
@pytest.mark.training
def test_a_skill_that_fails_again_is_learned_further(tmp_path):
    """From its own weights; what it was worth stays a candidate."""
    weak = weak_picking()
    there = kept(tmp_path / "weak", weak, PUTTING)
    settings = replace(SHORT, rollouts=8, sac=replace(SAC, net_arch=(4,)))
    library, events = acquire(tmp_path / "work", settings, kept=there)
    assert {name for name, _ in events.judged} == {"Pick"}
    first = events.judged[0][1]
    assert 0.0 < first.initial < 1.0
    assert first.success >= first.initial
    (pick,) = (skill for skill in library.skills if skill.operator.name == "Pick")
    assert pick.record["began_with"] == {
        "skill": weak.folder_name, "similarity": 1.0, "success": first.initial
    }  # fmt: skip


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
