# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import random
from types import SimpleNamespace
from typing import Any

import pytest

from slap_ros.errors import ErrorCode
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.run_log import RunLog
from slap_ros.messages.events import PlanEventKind, SkillEventKind
from slap_ros.messages.interfaces import (
    ATOMS,
    DOMAIN_INFO,
    PLAN,
    PLAN_EVENT,
    SKILL_EVENT,
    STATE,
    TASK,
)

Message = tuple[str, Any]
GOAL = [SimpleNamespace(predicate="On", objects=["block1", "target"])]
OTHER = [SimpleNamespace(predicate="Clear", objects=["table"])]


class Story:
    """Messages, each a millisecond after the one before."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self.plan_number = -1
        self.now_ns = 1_700_000_000_999_000_000

    def tell(self, type_name: str, **values: Any) -> None:
        self.now_ns += 1_000_000
        sec, nanosec = divmod(self.now_ns, 10**9)
        header = SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec))
        self.messages.append((type_name, SimpleNamespace(header=header, **values)))

    def task(self, episode: int = 1, seed: int = 5, index: int = 3) -> None:
        self.tell(DOMAIN_INFO, name="obstacle2d", preset="paper", types=[])
        self.tell(TASK, episode=episode, domain="obstacle2d", seed=seed, index=index, goal=GOAL)

    def states(self, first: int, last: int, episode: int = 1, atoms: Any = OTHER) -> None:
        for step in range(first, last + 1):
            self.tell(STATE, episode=episode, step=step)
            self.tell(ATOMS, episode=episode, step=step, atoms=atoms)

    def plan_event(self, kind: PlanEventKind, step: int, episode: int = 1, **values: Any) -> None:
        self.plan_number += kind == PlanEventKind.PLANNING_STARTED
        rest = {"edges_rolled_out": 0, "edge": 0, "error_code": 0, "error_msg": ""} | values
        number = self.plan_number
        self.tell(
            PLAN_EVENT, kind=int(kind), step=step, episode=episode, plan_number=number, **rest
        )
        if kind in (PlanEventKind.SOLVED, PlanEventKind.FAILED):
            self.plan_number = -1

    def planning(self, step: int, rolled: int = 0, episode: int = 1) -> None:
        self.plan_event(PlanEventKind.PLANNING_STARTED, step, episode)
        self.plan_event(PlanEventKind.PLANNED, step, episode, edges_rolled_out=rolled)

    def plan(
        self, *edges: tuple[int, str], episode: int = 1, goal: Any = (), bound: float = 0.0
    ) -> None:
        named = [SimpleNamespace(kind=kind, name=name) for kind, name in edges]
        origin = {"planner": "lazy", "library": "0123456789abcdef", "samples": 16, "bound": bound}
        number = self.plan_number
        self.tell(PLAN, episode=episode, number=number, edges=named, goal=goal, **origin)

    def skill(self, kind: SkillEventKind, step: int, name: str = "Pick", episode: int = 1) -> None:
        self.tell(
            SKILL_EVENT, kind=int(kind), step=step, skill=name, objects=["block1"], episode=episode
        )

    def runs(self) -> list[RunMetrics]:
        log = RunLog()
        for type_name, message in self.messages:
            log.add(type_name, message)
        return log.runs()

    def run(self) -> RunMetrics:
        (run,) = self.runs()
        return run


def solved() -> Story:
    """A run with a divergence, a shortcut and one replan."""
    story = Story()
    story.task()
    story.states(0, 0)
    story.planning(0, rolled=10)
    story.plan((1, "Push"), (0, "Pick"), bound=1.25)
    story.skill(SkillEventKind.STARTED, 0, "Push")
    story.states(1, 4)
    story.skill(SkillEventKind.FAILED, 4, "Push")
    story.plan_event(PlanEventKind.DIVERGED, 4)
    story.planning(4, rolled=7)
    story.plan((0, "Pick"), bound=1.0)
    story.skill(SkillEventKind.STARTED, 4)
    story.states(5, 8)
    story.states(9, 9, atoms=[*OTHER, *GOAL])
    story.skill(SkillEventKind.REACHED, 9)
    story.plan_event(PlanEventKind.SOLVED, 9)
    return story


def test_a_solved_run() -> None:
    expected = {
        "domain": "obstacle2d",
        "preset": "paper",
        "seed": 5,
        "index": 3,
        "success": True,
        "plan_length": 9,
        "shortcut_steps": 4,
        "planning_seconds": 0.002,
        "replans": 1,
        "edges_rolled_out": 17,
        "error_code": 0,
        "error_msg": "",
        "options": [
            {
                "name": "Push",
                "kind": "shortcut",
                "objects": ["block1"],
                "steps": 4,
                "outcome": "failed",
            },
            {
                "name": "Pick",
                "kind": "operator",
                "objects": ["block1"],
                "steps": 5,
                "outcome": "reached",
            },
        ],
        "planner": "lazy",
        "library": "0123456789abcdef",
        "samples": 16,
        "bound": 1.25,
        "unknown": {},
    }
    plain = solved().run().as_json()
    assert plain == expected
    assert list(plain) == list(expected)
    assert list(plain["options"][0]) == ["name", "kind", "objects", "steps", "outcome"]
    assert type(plain["error_code"]) is int


@pytest.mark.parametrize("seed", range(20))
def test_how_topics_interleave_does_not_matter(seed: int) -> None:
    story, rng = solved(), random.Random(seed)
    expected = story.runs()
    topics: dict[str, list[Message]] = {}
    for message in story.messages:
        topics.setdefault(message[0], []).append(message)
    story.messages = []
    while topics:
        chosen = rng.choice(sorted(topics))
        story.messages.append(topics[chosen].pop(0))
        topics = {name: rest for name, rest in topics.items() if rest}
    assert story.runs() == expected


def test_states_seen_twice_count_once() -> None:
    story = solved()
    story.messages += [m for m in story.messages if m[0] == STATE]
    assert story.run().plan_length == 9


def test_states_before_and_after_the_run_do_not_count() -> None:
    story = Story()
    story.task()
    story.states(0, 5)  # somebody drives the robot by hand
    story.planning(5)
    story.states(6, 8, atoms=GOAL)
    story.plan_event(PlanEventKind.SOLVED, 8)
    story.states(9, 12)
    run = story.run()
    assert run.success
    assert run.plan_length == 3


def test_planning_that_fails_is_planning_time_too() -> None:
    story = Story()
    story.task()
    story.states(0, 0)
    story.plan_event(PlanEventKind.PLANNING_STARTED, 0)
    story.now_ns += 2_500_000_000
    story.plan_event(PlanEventKind.FAILED, 0, edges_rolled_out=4, error_code=30, error_msg="no way")
    run = story.run()
    assert run.planning_seconds == 2.501
    assert run.edges_rolled_out == 4
    assert run.plan_length == 0
    assert (run.success, run.error_code, run.error_msg) == (False, ErrorCode.UNSOLVABLE, "no way")


def test_failing_in_execution_is_no_planning_time() -> None:
    story = Story()
    story.task()
    story.states(0, 0)
    story.planning(0)
    story.states(1, 2)
    story.plan_event(PlanEventKind.FAILED, 2, error_code=33, error_msg="enough")
    run = story.run()
    assert run.planning_seconds == 0.001
    assert run.error_code is ErrorCode.STEP_LIMIT
    assert run.plan_length == 2


def test_solved_means_that_the_goal_is_perceived() -> None:
    story = solved()
    last = next(m for t, m in story.messages if t == ATOMS and m.step == 9)
    last.atoms = OTHER
    run = story.run()
    assert not run.success
    assert run.error_code is ErrorCode.UNKNOWN
    assert "On(block1, target)" in run.error_msg


def test_without_a_plan_there_is_no_bound() -> None:
    story = Story()
    story.task()
    story.states(0, 0)
    story.plan_event(PlanEventKind.PLANNING_STARTED, 0)
    story.plan_event(PlanEventKind.FAILED, 0, error_code=30, error_msg="no way")
    run = story.run()
    assert run.bound is None
    assert not run.unknown


def test_a_goal_of_the_users_own_is_what_counts() -> None:
    story = Story()
    story.task()
    story.states(0, 0)
    story.planning(0)
    story.plan((0, "Pick"), goal=OTHER)
    story.states(1, 2)
    story.plan_event(PlanEventKind.SOLVED, 2)
    story.planning(2)
    story.plan(goal=GOAL)
    story.plan_event(PlanEventKind.SOLVED, 2)
    assert [run.success for run in story.runs()] == [True, False]


def test_without_a_goal_nobody_knows_what_is_a_success() -> None:
    story = solved()
    story.messages = [m for m in story.messages if m[0] != TASK]
    run = story.run()
    assert (run.success, run.seed, run.index, run.domain) == (None, None, None, "obstacle2d")
    missing = dict.fromkeys(("seed", "index"), "the task is missing")
    assert run.unknown == missing | {"success": run.error_msg}
    assert "lacks the task" in run.error_msg


@pytest.mark.parametrize("last", [5, 6, 12, 20])
def test_a_recording_that_ends_early(last: int) -> None:
    story = solved()
    story.messages = story.messages[:last]
    run = story.run()
    steps = [m.step for t, m in story.messages if t == STATE]
    assert run.error_code is ErrorCode.NODE_DIED
    assert "ends before" in run.error_msg
    assert not run.success
    assert run.plan_length == max(steps)
    assert sum(option.steps for option in run.options) == max(steps)


def test_several_runs_in_one_episode_and_in_several() -> None:
    story = Story()
    story.task(episode=1, seed=1)
    story.states(0, 0)
    story.planning(0)
    story.skill(SkillEventKind.STARTED, 0, "A")
    story.states(1, 3)
    story.skill(SkillEventKind.CANCELED, 3, "A")
    story.plan_event(PlanEventKind.FAILED, 3, error_code=34, error_msg="canceled")
    story.planning(3)  # at the very step at which the run before has ended
    story.skill(SkillEventKind.STARTED, 3, "B")
    story.states(4, 5)
    story.skill(SkillEventKind.REACHED, 5, "B")
    story.task(episode=2, seed=2)  # reset in the middle of the run
    story.states(0, 0, episode=2)
    story.planning(0, episode=2)
    story.skill(SkillEventKind.STARTED, 0, "C", episode=2)
    story.states(1, 1, episode=2, atoms=GOAL)
    story.skill(SkillEventKind.REACHED, 1, "C", episode=2)
    story.plan_event(PlanEventKind.SOLVED, 1, episode=2)
    runs = story.runs()
    assert [run.seed for run in runs] == [1, 1, 2]
    assert [run.plan_length for run in runs] == [3, 2, 1]
    assert [run.success for run in runs] == [False, False, True]
    assert [run.error_code for run in runs] == [
        ErrorCode.GOAL_CANCELED,
        ErrorCode.NODE_DIED,
        ErrorCode.NONE,
    ]
    options = [[(o.name, o.steps, o.outcome) for o in run.options] for run in runs]
    assert options == [[("A", 3, "canceled")], [("B", 2, "reached")], [("C", 1, "reached")]]


def test_an_option_is_of_the_run_that_began_it_whatever_the_clock_says() -> None:
    """One run ends at the step at which the next begins; its last option takes no step."""
    story = Story()
    story.task()
    story.states(0, 0)
    story.planning(0)
    story.plan_event(PlanEventKind.EDGE_STARTED, 0)
    story.skill(SkillEventKind.STARTED, 0, "A")
    story.skill(SkillEventKind.FAILED, 0, "A")
    story.plan_event(PlanEventKind.FAILED, 0, error_code=53)
    story.now_ns -= 10**12  # the clock is set back
    story.planning(0)
    story.plan_event(PlanEventKind.EDGE_STARTED, 0)
    story.skill(SkillEventKind.STARTED, 0, "B")
    story.states(1, 2, atoms=GOAL)
    story.skill(SkillEventKind.REACHED, 2, "B")
    story.plan_event(PlanEventKind.SOLVED, 2)
    assert [[option.name for option in run.options] for run in story.runs()] == [["A"], ["B"]]


def test_what_began_before_the_recording_is_no_run() -> None:
    story = Story()
    story.task()
    story.states(3, 5)
    story.skill(SkillEventKind.REACHED, 5)
    story.plan_event(PlanEventKind.SOLVED, 5)
    assert story.runs() == []


def test_codes_of_other_versions_are_unknown() -> None:
    story = Story()
    story.task()
    story.states(0, 0)
    story.plan_event(PlanEventKind.PLANNING_STARTED, 0)
    story.plan_event(PlanEventKind.FAILED, 0, error_code=999, error_msg="odd")
    assert story.run().error_code is ErrorCode.UNKNOWN


def test_nothing_at_all() -> None:
    assert Story().runs() == []
    log = RunLog()
    log.add("sensor_msgs/msg/JointState", object())
    assert log.runs() == []
