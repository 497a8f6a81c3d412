# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC: the same as stable-baselines3's, resumed to the same weights, and it learns."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.torch_layers import create_mlp

from slap_ros.acquisition.training.episodes import load_episodes, save_episodes
from slap_ros.acquisition.training.sac import SkillLearner
from slap_ros.acquisition.training.sac_settings import SAC_PRESETS, SMALL
from slap_ros.acquisition.training.sac_update import LeanSac
from slap_ros.acquisition.training.skill_env import SkillMdp, SkillVecEnv
from slap_ros.acquisition.training.twin_critics import NormalisedRectifier, Rectifier, TwinCritics
from slap_ros.acquisition.training.warm_start_settings import WarmStartSettings
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import RewardTemplate
from slap_ros.skills.groundings import Groundings
from slap_ros.skills.observations import SIZE
from slap_ros.skills.reward import SkillReward
from support.marks import slow
from support.points import HORIZON, INTERFACE, PICK, POINTS, REWARDS, begin

QUICK = replace(SMALL, learning_starts=192)
STARTS = begin(PICK, range(40))
FRESH = begin(PICK, range(40, 80))
MDP = SkillMdp(
    POINTS,
    SkillReward(PICK, REWARDS["Pick"], INTERFACE),
    Groundings(list(dict.fromkeys(one.grounding for one in STARTS))),
)


def learner(first_round=0, seed=1, settings=QUICK):
    return SkillLearner(SkillVecEnv(MDP, STARTS, 8, HORIZON, (seed,), first_round), settings, seed)


def weights(learner):
    return {k: v.clone() for k, v in learner._sac.policy.state_dict().items()}


def success(policy):
    env = SkillVecEnv(MDP, FRESH, len(FRESH), HORIZON, (9,))
    for _ in range(HORIZON):
        env.step(policy.mean(env.observations))
    return env.succeeded.mean()


@pytest.mark.training
@pytest.mark.parametrize("task", ["Pendulum-v1", *slow("MountainCarContinuous-v0")])
def test_an_update_is_stable_baselines3s_up_to_rounding(task):
    kwargs = {
        "learning_starts": 100,
        "buffer_size": 1000,
        "batch_size": 64,
        "policy_kwargs": {"net_arch": [16, 16]},
        "device": "cpu",
    }
    for seed in range(5):
        ours, theirs = (
            kind("MlpPolicy", gym.make(task), seed=seed, **kwargs).learn(140)
            for kind in (LeanSac, SAC)
        )
        assert ours._n_updates == theirs._n_updates == 40
        for (name, one), other in zip(
            ours.policy.state_dict().items(), theirs.policy.state_dict().values(), strict=True
        ):
            torch.testing.assert_close(one, other, rtol=1e-3, atol=1e-4, msg=name)
        torch.testing.assert_close(ours.log_ent_coef, theirs.log_ent_coef, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("activation", [Rectifier(), NormalisedRectifier()])
def test_gradients_of_critics_are_those_of_automatic_differentiation_to_the_bit(activation):
    torch.manual_seed(0)
    networks = [create_mlp(SIZE + 5, 1, [64, 64]) for _ in range(2)]
    critics = TwinCritics([torch.nn.Sequential(*layers) for layers in networks])
    critics.activation = activation
    observations, actions = torch.randn(128, SIZE), torch.randn(128, 5)
    by_values = torch.randn(2, 128, 1)
    done = critics(observations, actions)
    by_weights = critics.weight_gradients(done, by_values)
    by_actions = critics.action_gradient(done, by_values, 5)
    given = [tensor.requires_grad_() for tensor in (*critics.tensors, actions)]
    values = critics(observations, actions).values
    assert torch.equal(values, done.values)
    *expected, expected_by_actions = torch.autograd.grad(values, given, by_values)
    assert torch.equal(by_actions, expected_by_actions)
    for gradient, other in zip(by_weights, expected, strict=True):
        assert torch.equal(gradient, other)


@pytest.mark.slow
@pytest.mark.training
def test_a_second_core_changes_nothing_that_is_learned():
    """Whether it is there all the time or now and then; the layers are those it is used for."""
    settings = replace(QUICK, critic_net_arch=(256, 256), batch_size=128)
    asked = []

    def now_and_then():
        asked.append(len(asked) % 3 == 0)
        return asked[-1]

    learned = []
    for core_to_spare in (lambda: False, lambda: True, now_and_then):
        env = SkillVecEnv(MDP, STARTS, 8, HORIZON, (1,))
        one = SkillLearner(env, settings, 1, core_to_spare)
        one.learn(3)
        learned.append(weights(one))
    assert len(asked) > 50
    alone, *others = learned
    for other in others:
        assert all(torch.equal(alone[name], value) for name, value in other.items())


def test_values_of_what_is_far_from_everything_tried_are_bounded_by_normalised_layers():
    """Else the actor goes after values that nothing speaks for."""
    near, actions = torch.randn(100, SIZE), torch.zeros(100, MDP.action_map.size)

    def spread(scale, settings):
        sac = SkillLearner(SkillVecEnv(MDP, STARTS, 8, HORIZON, (1,)), settings, 1)._sac
        with torch.no_grad():
            return sac._online(scale * near, actions).values.std()

    plain = replace(QUICK, critic_layer_norm=False)
    assert spread(1e3, plain) > 100.0 * spread(1.0, plain)
    assert spread(1e3, QUICK) < 3.0 * spread(1.0, QUICK)


@pytest.mark.training
@pytest.mark.parametrize("settings", [QUICK, *slow(replace(QUICK, critic_net_arch=(24, 16)))])
def test_what_is_resumed_ends_with_the_same_weights(tmp_path, settings):
    whole = learner(settings=settings)
    for segment in range(2):
        save_episodes(tmp_path / str(segment), whole.learn(2))
    whole.save(tmp_path / "checkpoint.pt")
    whole.learn(2)
    torch.rand(7)  # whatever else draws from torch's generator meanwhile
    resumed = learner(first_round=4, settings=settings)
    episodes = [load_episodes(tmp_path / str(i), POINTS.types_by_name) for i in range(2)]
    resumed.resume(tmp_path / "checkpoint.pt", episodes)
    resumed.learn(2)
    assert resumed.steps == whole.steps == 6 * HORIZON * 8
    for one, other in zip(weights(whole).values(), weights(resumed).values(), strict=True):
        assert torch.equal(one, other)
    assert np.array_equal(whole.policy().mean(FRESH_SEEN), resumed.policy().mean(FRESH_SEEN))
    other = learner(seed=2, settings=settings)
    other.learn(6)
    assert not torch.equal(weights(other)["actor.mu.weight"], weights(whole)["actor.mu.weight"])


@pytest.mark.training
@pytest.mark.parametrize(("tau", "same"), [(1.0, True), (0.005, False)])
def test_the_policy_is_the_actors_average(tau, same):
    one = SkillLearner(SkillVecEnv(MDP, STARTS, 8, HORIZON, (1,)), replace(QUICK, tau=tau), 1)
    before = one.policy().mean(FRESH_SEEN)
    one.learn(3)
    latest = np.tanh(one._sac.distribution(torch.as_tensor(FRESH_SEEN))[0].detach().numpy())
    policy = one.policy().mean(FRESH_SEEN)
    assert np.allclose(policy, latest, atol=1e-5) == same
    assert not np.allclose(policy, before, atol=1e-5)


def test_a_damaged_checkpoint_is_refused(tmp_path):
    path = tmp_path / "checkpoint.pt"
    path.write_bytes(b"PK\x03\x04 no checkpoint")
    with pytest.raises(InvalidParameterError, match="damaged"):
        learner().resume(path, [])
    (tmp_path / "0").write_bytes(b"no episodes")
    with pytest.raises(InvalidParameterError, match="damaged"):
        load_episodes(tmp_path / "0", POINTS.types_by_name)


@pytest.mark.training
def test_rewards_are_computed_again_when_the_template_changes():
    first = learner()
    episodes = first.learn(2)
    before = first.buffer.rewards[: first.buffer.size(), 0].copy()
    halved = RewardTemplate(
        "Pick", tuple(replace(term, weight=term.weight / 2) for term in REWARDS["Pick"].terms)
    )
    mdp = SkillMdp(POINTS, SkillReward(PICK, halved, INTERFACE), MDP.groundings)
    second = SkillLearner(SkillVecEnv(mdp, STARTS, 8, HORIZON, (1,)), QUICK, 1)
    second.buffer.add_episodes(episodes)
    after = second.buffer.rewards[: second.buffer.size(), 0]
    succeeded = before == 1.0
    assert np.allclose(after[~succeeded], before[~succeeded] / 2)
    assert (after[succeeded] == 1.0).all()
    assert np.array_equal(
        second.buffer.observations[: second.buffer.size()],
        first.buffer.observations[: first.buffer.size()],
    )


@pytest.mark.training
def test_a_full_buffer_forgets_the_oldest():
    small = replace(QUICK, buffer_size=5 * HORIZON * 8)
    env = SkillVecEnv(MDP, STARTS, 8, HORIZON, (1,))
    one = SkillLearner(env, small, 1)
    for _ in range(4):
        episodes = one.learn(2)
    assert one.buffer.size() <= small.buffer_size
    count = episodes.transitions
    newest = one.buffer.actions[one.buffer.size() - count : one.buffer.size(), 0]
    assert np.array_equal(newest, episodes.actions.reshape(count, -1))


@pytest.mark.training
def test_nothing_is_terminal_for_the_critic():
    one = learner()
    one.learn(1)
    assert not one.buffer.sample(64).dones.any()


def test_a_skill_can_begin_with_another_ones_weights():
    one, other = learner(), learner(seed=2)
    policy = one.policy()
    assert not np.array_equal(other.policy().mean(FRESH_SEEN), policy.mean(FRESH_SEEN))
    other.begin_with(policy, WarmStartSettings())
    assert np.array_equal(other.policy().mean(FRESH_SEEN), policy.mean(FRESH_SEEN))
    large = SkillLearner(SkillVecEnv(MDP, STARTS, 8, HORIZON, (1,)), SAC_PRESETS["large"], 1)
    with pytest.raises(InvalidParameterError, match="same hidden layers"):
        large.begin_with(policy, WarmStartSettings())


@pytest.mark.training
def test_larger_critics_leave_the_policy_as_small_as_it_is():
    small, one = learner(), learner(settings=replace(QUICK, critic_net_arch=(24, 16)))
    one.begin_with(small.policy(), WarmStartSettings())  # has the same layers
    critics = {k: v.shape for k, v in weights(one).items() if k.startswith("critic.qf1")}
    widths = [shape[0] for name, shape in critics.items() if name.endswith("weight")]
    assert widths == [24, 16, 1]
    one.learn(1)
    shapes = [[layer.shape for layer, _ in each.policy().layers] for each in (small, one)]
    assert shapes[0] == shapes[1]


@pytest.mark.training
def test_random_actions_are_held_longer_in_each_environment():
    one = learner()
    one.learn(1)  # whole episodes of random actions, then of the policy's with noise
    random = one.buffer.actions[: HORIZON * 8, 0].reshape(8, HORIZON, -1)[
        :, : QUICK.learning_starts // 8
    ]
    for env, actions in enumerate(random):
        changes = (np.abs(np.diff(actions, axis=0)).max(axis=1) > 0).nonzero()[0] + 1
        held = 1 + env
        assert np.array_equal(changes, np.arange(held, len(actions), held)), env


FRESH_SEEN = SkillVecEnv(MDP, FRESH, 8, HORIZON, (9,)).observations


@pytest.mark.training
def test_torch_and_numpy_say_the_same():
    one = learner()
    one.learn(2)
    ours = one.policy().mean(FRESH_SEEN)
    theirs, _ = one._sac.predict(FRESH_SEEN, deterministic=True)
    assert np.allclose(ours, theirs, atol=1e-5)


@pytest.mark.slow
@pytest.mark.training
def test_pick_is_learned():
    one = learner()
    assert success(one.policy()) < 0.2
    one.learn(26)
    assert success(one.policy()) >= 0.9


def test_environments_that_no_whole_number_of_updates_follows_are_refused():
    with pytest.raises(InvalidParameterError, match="give a multiple"):
        replace(SMALL, n_envs=7)
