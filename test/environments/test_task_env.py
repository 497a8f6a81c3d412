# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains as Gymnasium environments: the tasks of evaluations, for any learner."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from slap_ros.acquisition.training.skill_env import SkillMdp
from slap_ros.baselines.reverse_curriculum import demonstrated_tasks
from slap_ros.domains import get_domain
from slap_ros.environments.episode import TaskEpisode
from slap_ros.environments.observations import ViewObservation
from slap_ros.environments.registration import TASKS, make_task_env, tasks_of_others
from slap_ros.environments.slots import ObjectSlots
from slap_ros.environments.task_rewards import STAGE, StagedReward
from slap_ros.errors import (
    InvalidCommandError,
    InvalidDomainError,
    InvalidParameterError,
    InvalidStateError,
)
from slap_ros.planning.planner import make_planner
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.skills.groundings import Grounding, Groundings
from slap_ros.skills.reward import SkillReward
from support.marks import slow

ROOT = Path(__file__).parents[2]
OURS = ("obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table")


def test_every_domain_of_ours_has_a_name():
    assert set(OURS) <= set(TASKS.values())
    assert len(set(TASKS.values())) == len(TASKS) == 10


def test_names_are_registered_and_nothing_else_is_imported():
    code = (
        "import sys, gymnasium, slap_ros.environments\n"
        "spec = gymnasium.spec('slap_ros/Obstacle2D-v0')\n"
        "heavy = {'torch', 'pybullet', 'rclpy', 'numba'} & set(sys.modules)\n"
        "print(spec.kwargs, sorted(heavy))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert ran.stdout.strip() == "{'domain': 'obstacle2d'} []", ran.stderr


def test_domains_of_others_have_names_that_gymnasium_takes():
    names = [
        "obstacle2d",
        "marbles",
        "kinder_obstruction",
        "my pegs!",
        "obstacle-tower",
        "ünder",
        "_",
    ]
    assert tasks_of_others([*names, "my_pegs"]) == {
        "Marbles-v0": "marbles",
        "KinderObstruction-v0": "kinder_obstruction",
        "MyPegs-v0": "my pegs!",
        "Nder-v0": "ünder",
    }


@pytest.mark.filterwarnings("ignore:.*alternative render modes")
@pytest.mark.parametrize(
    "options",
    [
        {"domain": "obstacle2d", "obs": "view", "reward": "stages"},
        {"domain": "obstacle2d", "obs": "dict", "control": "both"},
        {"domain": "stack_at_target", "control": "skills"},
        {"domain": "stack_at_target", "control": "primitives", "reward": "stages"},
        *slow({"domain": "obstacle_tower", "preset": "fair", "reward": "dense"}),
        *slow(*({"domain": name} for name in sorted(set(TASKS.values())))),
    ],
)
def test_both_checkers_find_nothing(options):
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    env = make_task_env(**options, render_mode="rgb_array")
    check_env(env)
    check_for_sb3(env)
    env.close()


@pytest.mark.parametrize("name", ["obstacle2d", *slow("obstacle_tower")])
def test_tasks_are_those_of_an_evaluation_and_follow_one_another(name):
    env, domain = make_task_env(name, "fair"), get_domain(name, "fair")
    for index in (4, None, None):
        options = None if index is None else {"index": index}
        env.reset(seed=None if index is None else 500, options=options)
        task = env.unwrapped._episode.task
        assert task == domain.task(500, task.index)
    assert task.index == 6


def names_of(env):
    """The skills that actions run, by number."""
    return [str(option) for _, option in env._control.options]


def ways_to_the_goal(env):
    """Perform a plan with actions that run skills; the rewards, and the last info."""
    _, info = env.reset(seed=7)
    episode, domain = env._episode, env.domain
    planner = make_planner("lazy", domain, episode.state, None)
    plan = planner.plan(episode.state, episode.goal).plan
    names, rewards = names_of(env), []
    for edge in plan.edges:
        number = names.index(str(edge.option))
        assert info["action_mask"][number]
        _, reward, solved, cut, info = env.step(number)
        rewards.append(reward)
    assert solved and not cut
    return plan, rewards, info


def test_a_plan_of_skills_solves_a_task_in_as_many_steps_as_predicted():
    plan, rewards, info = ways_to_the_goal(make_task_env("obstacle2d", control="skills"))
    assert info["steps"] == plan.predicted_steps
    assert sum(rewards) == 1 - plan.predicted_steps  # -1 for each but the last
    assert info["success"] and set(info["goal"]) <= set(info["atoms"])


def test_each_stage_of_a_plan_is_rewarded():
    env = make_task_env("obstacle2d", control="skills", reward="stages")
    plan, rewards, done = ways_to_the_goal(env)
    assert len(rewards) == len(plan.edges)
    assert min(rewards) > 4.0  # of each stage: 4.3 for its end, and what its potential rose by
    assert done["progress"] == 1.0
    env.reset(seed=7)
    *_, info = env.step(names_of(env).index(str(plan.edges[0].option)))
    assert info["progress"] == 1 / len(plan.edges)
    env.reset(seed=7)
    _, idle, *_, info = env.step(int(np.flatnonzero(~env.action_masks())[0]))
    assert abs(idle) < 0.1  # holding still for a step
    assert info["progress"] == 0.0


def as_skills_are_paid(domain, name, state, objects):
    """The dense part of a skill's reward in a state."""
    (operator,) = (one for one in domain.acquisition.operators if one.name == name)
    reward = SkillReward(operator, domain.acquisition.rewards[name], learner_interface(domain))
    mdp = SkillMdp(domain, reward, Groundings([Grounding(state.layout, objects)]))
    rows = np.array(state.data)[None]
    rewards, success = mdp.rewards(rows, np.zeros(1, dtype=int), rows)
    assert not success.any()
    return rewards[0]


def test_a_stage_at_a_bench_is_worth_its_metrics_and_as_much_again_at_its_end():
    """The metrics are those of the hand-written rewards, which skills are acquired with."""
    env = make_task_env("stack_at_target", "fair", reward="stages", goal="training")
    shown = demonstrated_tasks(env, 1_000_000, 1)[0]
    episode = TaskEpisode.of(env.domain, shown.task)
    reward = StagedReward()
    reward.begin(episode)
    objects, rewards = episode.stage, []
    for state in shown.states[1:]:
        if state is not None and reward.progress == 0.0:
            episode.state = state
            rewards.append(reward.of(episode))
    assert reward.progress == 0.25
    first = as_skills_are_paid(env.domain, "Pick", shown.task.initial_state, objects)
    assert sum(rewards) == pytest.approx(STAGE * (1.0 - first) + STAGE)
    assert sum(one > 0.0 for one in rewards) > 20  # on the way as well, from the first steps on
    assert rewards[0] > 0.0


def test_goals_of_hindsight_have_the_rewards_of_steps():
    env = make_task_env("obstacle2d", obs="dict")
    env.action_space.seed(0)
    seen, _ = env.reset(seed=3)
    achieved, rewards = [], []
    for _ in range(20):
        seen, reward, *_ = env.step(env.action_space.sample())
        achieved.append(seen["achieved_goal"])
        rewards.append(reward)
    desired = np.stack([seen["desired_goal"]] * 20)
    assert np.array_equal(env.compute_reward(np.stack(achieved), desired, {}), rewards)
    assert env.compute_reward(achieved[3], achieved[3], {}) == 0.0


def test_with_more_objects_than_there_is_room_for_a_task_is_refused_or_passed_over():
    env = make_task_env("groceries", obs="dict")  # each task has other things
    first = env._first.layout
    with pytest.raises(InvalidStateError, match="other objects"):
        env.reset(seed=1, options={"index": 1})
    small = make_task_env("obstacle_tower", "fair:obstacles=1")
    tall = get_domain("obstacle_tower", "fair:obstacles=4").task(1).initial_state
    with pytest.raises(InvalidStateError, match="observations have room for"):
        small.reset(options={"state": tall})
    assert env._first.layout is first


@pytest.mark.parametrize(
    ("option", "value", "kind"), [("state", 5, "State"), ("goal", [1], "str"), ("index", "3", "")]
)
def test_options_of_another_type_are_refused(option, value, kind):
    env = make_task_env("obstacle2d", "fair")
    with pytest.raises(InvalidParameterError, match=f"option '{option}' is .* of type {kind}"):
        env.reset(seed=1, options={option: value})


def test_it_begins_in_a_state_that_is_given():
    env = make_task_env("obstacle2d")
    env.reset(seed=1)
    env.action_space.seed(1)
    for _ in range(5):
        seen, *_ = env.step(env.action_space.sample())
    again, info = env.reset(options={"state": env._episode.state})
    assert np.array_equal(again, seen)
    assert info["steps"] == 0


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"obs": "pixels"}, InvalidParameterError, "there are state, view, dict"),
        ({"reward": "shaped"}, InvalidParameterError, "there are sparse, dense, stages"),
        ({"control": "torque"}, InvalidParameterError, "there are joints, skills, both"),
        ({"render_mode": "human"}, InvalidParameterError, "there are rgb_array"),
        ({"preset": "easy"}, InvalidParameterError, "easy"),
    ],
)
def test_what_there_is_not_is_refused_by_name(options, error, words):
    with pytest.raises(error, match=words):
        make_task_env("obstacle2d", **options)


def test_actions_that_are_none_are_refused_and_nothing_moves():
    env = make_task_env("obstacle2d")
    with pytest.raises(InvalidParameterError, match="call reset"):
        env.step(env.action_space.sample())
    env.reset(seed=1)
    before = env._episode.state
    for action in (np.full(3, np.nan), np.zeros(2)):
        with pytest.raises(InvalidCommandError):
            env.step(action)
    assert env._world.state == before
    with pytest.raises(InvalidParameterError, match="joints"):
        env.action_masks()


def test_a_domain_without_a_learners_interface_says_so():
    domain = replace(get_domain("obstacle2d"), learning=None)
    state = domain.task(0).initial_state
    space = domain.atom_space(state)
    with pytest.raises(InvalidDomainError, match="obstacle2d"):
        ViewObservation(domain, ObjectSlots.of([space]), space, state)


@pytest.mark.slow
def test_the_examples_of_the_page_run():
    page = (ROOT / "docs" / "learners.md").read_text(encoding="utf-8")
    first, learned, ours, masked = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(first, {})
    exec(ours, {})
    short = learned.replace("learn(6_000)", "learn(1)").replace("range(50)", "range(2)")
    found: dict[str, object] = {}
    exec(short, found)
    assert 0 <= found["solved"] <= 2
    known: dict[str, object] = {}
    exec(masked.replace("range(300)", "range(2)"), known)
    assert known["steps"] < 0.0


def test_gymnasium_makes_them():
    name = "slap_ros.environments:slap_ros/Obstacle2D-v0"  # imports it, wherever that was not done
    env = gymnasium.make(name, preset="fair", render_mode="rgb_array")
    env.reset(seed=0)
    assert env.render().shape == (360, 480, 3)
    env.close()
