# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MDPs that our own learners learn in, for any learner that knows Gymnasium."""

import json

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import slap_ros.environments  # noqa: F401 -- registers
from slap_ros.environments.registration import MADE_BY, SHORTCUTS, SKILLS
from slap_ros.errors import (
    InvalidCommandError,
    InvalidDomainError,
    InvalidLibraryError,
    InvalidParameterError,
    InvalidStateError,
)
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_candidate import ShortcutCandidate
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from support.marks import slow


@pytest.fixture(scope="module")
def pushing():
    return gymnasium.make("slap_ros/Obstacle2D-shortcut-v0", preset="fair").unwrapped


@pytest.fixture(scope="module")
def stowing():
    return gymnasium.make("slap_ros/StowHammer-skill-v0").unwrapped


def library(domain):
    return load_library(shipped_library(domain.name), domain)


@pytest.mark.filterwarnings("ignore:.*(precision lowered|infinity|render)")
@pytest.mark.parametrize("name", ["pushing", *slow("stowing")])
def test_both_checkers_find_nothing(name, request):
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    env = request.getfixturevalue(name)
    check_env(env, skip_render_check=True)
    check_for_sb3(env)


def test_a_policy_of_the_library_succeeds_as_in_training(pushing):
    """The same observations and actions: what was learned in our environment acts in this one."""
    shortcut = max(library(pushing.domain).shortcuts, key=lambda one: one.record["success"])
    name = "slap_ros/Obstacle2D-shortcut-v0"
    env = gymnasium.make(name, preset="fair", shortcut=shortcut.name).unwrapped
    assert env.signature == shortcut.signature
    reached = 0
    for index in range(5):
        seen, info = env.reset(seed=500 if index == 0 else None)
        ended = cut = False
        while not (ended or cut):
            seen, reward, ended, cut, info = env.step(shortcut.policy.mean(seen[None])[0])
        reached += info["success"]
        assert info["steps"] <= env._horizon
        assert (reward > 1.0) == info["success"]
    assert reached >= 3  # .95 in training, with noise


def test_episodes_are_those_of_our_own_environment(pushing):
    seen, _ = pushing.reset(seed=7)
    start = pushing._starts[7, pushing._index]
    rng = np.random.default_rng(0)
    ours = ShortcutVecEnv(
        pushing.domain, pushing.signature, [start], 1, pushing._horizon, pushing._rewards, rng
    )
    assert np.array_equal(seen, ours.observations[0])
    for _ in range(pushing._horizon + 3):
        action = rng.uniform(-1.0, 1.0, pushing.action_space.shape)
        seen, reward, ended, cut, _ = pushing.step(action)
        step = ours.step(action[None])
        assert np.array_equal(seen, step.final_observations[0])
        assert (reward, ended, cut) == (step.rewards[0], step.dones[0] and not cut, step.truncated)
        if ended or cut:
            pushing.reset(options={"index": pushing._index})  # the same, as ours begins it again
    again, _ = pushing.reset(seed=7)
    assert np.array_equal(again, pushing.reset(options={"index": pushing._index})[0])


def test_a_skill_lasts_as_long_as_it_is_learned_for_and_success_does_not_end_it(stowing):
    seen, info = stowing.reset(seed=500)
    assert seen.shape == stowing.observation_space.shape
    policy = stowing._learned[stowing.operator.name].policy
    steps, ended, cut = 0, False, False
    while not (ended or cut):
        assert not info["success"]
        seen, _, ended, cut, info = stowing.step(policy.mean(seen[None])[0].clip(-1.0, 1.0))
        steps += 1
    assert (steps, ended, cut) == (stowing.domain.acquisition.horizon, False, True)
    assert info["success"]  # the shipped policy, in the environment that it was learned in


def test_candidates_of_a_work_folder_can_be_learned(tmp_path, pushing):
    candidate = ShortcutCandidate(pushing.signature, ("Pick",), 1, 3, 20, 5.0)
    found = ExplorationResult((candidate,), 1, 1, {"Pick": 7.0})
    (tmp_path / "explored.json").write_text(json.dumps([found.as_json()]))
    name = "slap_ros/Obstacle2D-shortcut-v0"
    env = gymnasium.make(name, preset="fair", shortcuts=str(tmp_path)).unwrapped
    assert env.signature == pushing.signature
    (tmp_path / "explored.json").write_text('[{"candidates": 3}]')
    with pytest.raises(InvalidParameterError, match=r"explored\.json: damaged"):
        gymnasium.make(name, preset="fair", shortcuts=str(tmp_path))


@pytest.mark.parametrize(
    ("name", "given", "error", "words"),
    [
        ("Obstacle2D-shortcut", {"shortcut": "Fly"}, InvalidParameterError, "unknown shortcut"),
        ("Obstacle2D-shortcut", {"settings": "best"}, InvalidParameterError, "there are ours"),
        ("StowHammer-skill", {"operator": "Fly"}, InvalidParameterError, "unknown operator 'Fly'"),
        ("StowHammer-skill", {"domain": "obstacle2d"}, InvalidDomainError, "does not say what"),
        ("Obstacle2D-shortcut", {"domain": "bowls"}, InvalidParameterError, "no shortcuts ship"),
    ],
)
def test_what_there_is_not_is_refused(name, given, error, words):
    with pytest.raises(error, match=words):
        gymnasium.make(f"slap_ros/{name}-v0", **given)


def test_a_library_without_a_usable_shortcut_is_named(tmp_path):
    (tmp_path / "library.json").write_text('{"format": 1, "domain": "obstacle2d"}')
    with pytest.raises(InvalidLibraryError, match=f"{tmp_path}: no shortcut of it can be used"):
        gymnasium.make("slap_ros/Obstacle2D-shortcut-v0", shortcuts=str(tmp_path))


def test_bad_actions_options_and_tasks_are_refused(pushing):
    pushing.reset(seed=1)
    with pytest.raises(InvalidCommandError, match="finite numbers"):
        pushing.step(np.full(pushing.action_space.shape, np.nan))
    with pytest.raises(InvalidCommandError, match="finite numbers"):
        pushing.step(np.zeros(7))
    with pytest.raises(InvalidParameterError, match="unknown option 'goal'"):
        pushing.reset(options={"goal": "nirvana"})
    fresh = gymnasium.make("slap_ros/Obstacle2D-shortcut-v0", preset="fair").unwrapped
    with pytest.raises(InvalidParameterError, match=r"call reset\(\) first"):
        fresh.step(np.zeros(fresh.action_space.shape))


def test_a_task_without_what_is_to_be_learned_is_refused_or_passed_over(pushing):
    find, without = pushing._find, {(3, 0), (3, 1)}
    pushing._find = lambda *task: None if task in without else find(*task)
    pushing.reset(seed=3)
    assert pushing._index == 2
    with pytest.raises(InvalidStateError, match="does not begin in task 1 of seed 3"):
        pushing.reset(options={"index": 1})
    del pushing._find


@pytest.mark.parametrize("name", slow(*sorted({**SHORTCUTS, **SKILLS})))
def test_every_name_makes_an_environment(name):
    env = gymnasium.make(f"slap_ros/{name}")
    env.action_space.seed(0)
    env.reset(seed=500)
    seen, reward, *_ = env.step(env.action_space.sample())
    assert np.isfinite(seen).all() and np.isfinite(reward)


def test_names_are_of_one_maker_each():
    names = [name for group in MADE_BY.values() for name in group]
    assert len(set(names)) == len(names) == 20
