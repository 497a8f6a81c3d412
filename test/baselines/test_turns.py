# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A controller and its options in one rollout: who is judged by what."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from gymnasium import spaces

from slap_ros.baselines.sol import METHOD, SolLearner
from slap_ros.baselines.training_envs import separate_envs
from slap_ros.baselines.turns import TurnBuffer, Turns
from slap_ros.environments.option_task_env import LENGTHS
from slap_ros.environments.registration import make_task_env
from slap_ros.errors import InvalidParameterError

GAMMA = 0.9
STEPS = (  # controller, intrinsic, over, controller_next, duration, reward, value
    (1, 0.0, 0, 0, 0, 0.0, 0.5),  # chooses an option
    (0, 0.2, 0, 0, 1, 0.0, 0.3),
    (0, 0.4, 1, 1, 1, 0.0, 0.1),  # which ends
    (1, 0.0, 0, 1, 3, 1.0, 0.7),  # a skill of three steps, to the goal
)


def filled(steps, last_value, done, next_turn=None, gae_lambda=1.0):
    """The advantages of a rollout of these steps in one environment."""
    newest = {}
    buffer = TurnBuffer(
        len(steps), spaces.Box(0, 1, (1,)), spaces.Box(-1, 1, (1,)), "cpu",
        gae_lambda, GAMMA, 1,
        durations=lambda: [newest["duration"]], turns=lambda: newest["turns"],
    )  # fmt: skip
    zero = np.zeros((1, 1), np.float32)
    for *turns, duration, reward, value in steps:
        newest |= {"duration": duration, "turns": Turns(*(np.array([t]) for t in turns))}
        buffer.add(
            zero, zero, np.array([reward]), np.zeros(1), torch.tensor([value]), torch.zeros(1)
        )
    buffer.compute_returns_and_advantage(torch.tensor([[last_value]]), np.array([done]))
    return buffer.advantages[:, 0]


def test_a_choice_is_judged_at_the_next_turn_and_an_option_by_its_own_reward():
    found = filled(STEPS, last_value=9.0, done=True)
    skill = 1.0 - 0.7
    choice = GAMMA**2 * 0.7 - 0.5 + GAMMA**2 * skill  # two steps of the option lie between
    second = 0.4 - 0.1
    first = 0.2 + GAMMA * 0.1 - 0.3 + GAMMA * second
    assert found == pytest.approx([choice, first, second, skill], abs=1e-6)


def test_a_choice_whose_option_is_under_way_is_not_judged():
    found = filled(STEPS[:2], last_value=0.6, done=False)
    assert found[0] == 0.0
    assert found[1] == pytest.approx(0.2 + GAMMA * 0.6 - 0.3)


def test_what_follows_a_skill_is_discounted_by_its_steps():
    skill = (1, 0.0, 0, 1, 3, 0.0, 0.5)
    (found,) = filled((skill,), last_value=0.8, done=False)
    assert found == pytest.approx(GAMMA**3 * 0.8 - 0.5)


def test_the_end_of_an_episode_is_the_end_of_its_option():
    found = filled(STEPS[:2], last_value=7.0, done=True)
    assert found == pytest.approx([-0.5, 0.2 - 0.3])


def test_a_policy_in_numpy_chooses_about_as_often_as_it_has_learned():
    env = make_task_env("obstacle2d", "paper", obs="options")
    envs = separate_envs(lambda: env, 0, 1)
    learner = SolLearner(replace(METHOD.settings["ours"], n_steps=8, batch_size=8), envs, seed=0)
    net = learner._ppo.policy.action_net
    first, end = env._axes, env.action_space.shape[0] - len(LENGTHS)
    with torch.no_grad():
        net.bias[first : first + 3] = torch.tensor([0.5, 0.3, -0.9])
    observation, _ = env.reset(seed=0)
    rows = np.repeat(observation[None], 4_000, axis=0)
    scores = learner.policy().sample(rows, np.random.default_rng(0), 1.0)[:, first:end]
    found = np.bincount(scores.argmax(-1), minlength=end - first) / len(rows)
    _, (choice, _) = learner._ppo.policy._both(torch.as_tensor(observation[None]))
    learned = choice.probs[0].detach().numpy()
    assert learned.max() > 0.2
    assert np.abs(found - learned).max() < 0.12  # its noise is Gaussian, with lighter tails


# -- the environment ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def env():
    return make_task_env("obstacle2d", "paper", obs="options")


def choose(env, number, joints=0.0, length=0):
    """An action that moves the joints alike and chooses, an option for the shortest time."""
    action = np.full(env.action_space.shape, -1.0)
    action[: env._axes] = joints
    action[env._axes + number] = action[length - len(LENGTHS)] = 1.0
    return action


def test_an_option_begins_without_a_step_and_ends_after_so_many(env):
    seen, info = env.reset(seed=1)
    first = len(env._options.skills.options)
    turn = env.encode.size
    assert seen[turn] == 1.0 and seen[turn:].sum() == 1.0
    seen, reward, *_, info = env.step(choose(env, first + env.option_count - 1))
    assert (info["steps"], reward, info["controller"]) == (0, 0.0, True)
    assert not info["controller_next"]
    assert seen[turn] == 0.0 and seen[-1] == 1.0
    count = cut = 0
    while not info["controller_next"] and not cut:
        seen, reward, _, cut, info = env.step(choose(env, 0))
        count += 1
        assert (info["steps"], reward, info["controller"]) == (count, -1.0, False)
    assert count == LENGTHS[0]


def test_an_option_ends_where_its_target_is_reached(env):
    """A target that holds already is reached for a step; a skill takes what it takes."""
    env.reset(seed=1)
    first = len(env._options.skills.options)
    here = env._nodes.index(env._under_way.abstract & env._changing)
    *_, info = env.step(choose(env, first + here))
    assert (info["steps"], info["controller_next"]) == (1, True)
    pick = int(np.flatnonzero(info["action_mask"])[0])
    *_, info = env.step(choose(env, pick))
    assert info["steps"] > 2 and info["controller"] and info["controller_next"]
    assert env._under_way.abstract & env._changing != env._nodes[here]


def test_options_need_both_controls():
    with pytest.raises(InvalidParameterError, match="control='both', and no other"):
        make_task_env("obstacle2d", obs="options", control="joints")
