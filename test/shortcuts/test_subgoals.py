# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One policy for several shortcuts: what it observes, what it learns, and what comes out of it."""

from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import SequentialWorkers
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.hindsight_vec_env import HindsightEnvSpec
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.shortcut_library import load_library, save_library
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.subgoal_vec_env import SubgoalEnvSpec
from slap_ros.shortcuts.subgoals import SubgoalAttempt, SubgoalTraining, learn_together
from slap_ros.skills.domain_choice import DomainChoice
from support.pushing import DOMAIN, SIGNATURE, STARTS

SEED = 21  # of the tasks of STARTS
PLACE = TaskDistribution(DomainChoice("obstacle2d", "fair"), 0)
OURS = training_settings("subgoals", DOMAIN)


def put_back(start):
    """From the same state: to put the block in the hand back on the table, with the gripper."""
    space = start.space
    add = [("On", ["block1", "table"]), ("GripperEmpty", ["robot"])]
    delete = [("Holding", ["robot", "block1"])]
    masks = [space.mask([space.atom(*atom) for atom in atoms]) for atoms in (add, delete)]
    return Change(*masks)


BACK = Signature.of(put_back(STARTS[0]), STARTS[0].space)


def records(change_of):
    changes = [change_of(start) for start in STARTS]
    return tuple(
        StartRecord(SEED, i, tuple(start.state.data), change.add, change.delete)
        for i, (start, change) in enumerate(zip(STARTS, changes, strict=True))
    )


POOLS = (records(lambda start: start.change), records(put_back))


def attempt(folder, **changes):
    settings = replace(OURS, **changes)
    return SubgoalAttempt(PLACE, (SIGNATURE, BACK), POOLS, settings, str(folder))


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    ppo = replace(OURS.ppo, n_envs=8)
    return attempt(tmp_path_factory.mktemp("spec"), ppo=ppo).parts(0)[0]


def random_policy(rng, inputs, outputs):
    def layer(rows, columns):
        scale = columns**-0.5
        return (
            rng.normal(0.0, scale, (rows, columns)).astype(np.float32),
            rng.normal(0.0, 0.1, rows).astype(np.float32),
        )

    normalisation = ObservationNormalisation(
        rng.normal(0.0, 0.3, inputs).astype(np.float32),
        rng.uniform(0.3, 1.5, inputs).astype(np.float32),
    )
    layers = (layer(16, inputs), layer(16, 16), layer(outputs, 16))
    return MlpPolicy(normalisation, layers, np.arange(outputs, dtype=np.float32))


def test_a_policy_for_all_is_for_each_shortcut_one_of_its_own(spec):
    """The bits of its target, and slots of objects that only others have, become a bias."""
    observation, axes, rng = spec.observation(), spec.action_map, np.random.default_rng(0)
    shared = random_policy(rng, observation.size, axes.size)
    for part in spec.parts:
        env = part.make()
        own = axes.places_of(env.action_map)
        policy = observation.policy_of(part.signature, shared, own)
        embedded = observation.embed(part.signature, env.observations)
        assert policy.normalisation.mean.size == env.observations.shape[1] < observation.size
        expected = shared.mean(embedded)[:, own]
        assert policy.mean(env.observations) == pytest.approx(expected, abs=1e-4)
        assert list(policy.log_std) == own
    assert [axes.places_of(part.action_map) for part in spec.parts] == [[0, 1], [0, 1, 2]]


def test_each_shortcut_is_told_by_its_bits(spec):
    env = spec.make()
    observation = spec.observation()
    bits = env.observations[:, observation.layout.size :]
    own, other = bits[: env.num_envs // 2], bits[env.num_envs // 2 :]
    assert (own == own[0]).all() and (other == other[0]).all()
    assert not np.array_equal(own[0], other[0])


def test_steps_are_those_of_each_shortcut_alone(spec):
    together, alone = spec.make(), [part.make() for part in spec.parts]
    observation, rng = spec.observation(), np.random.default_rng(1)
    for _ in range(40):
        actions = rng.uniform(-1.0, 1.0, (together.num_envs, 3))
        step = together.step(actions)
        shares = np.split(actions, [alone[0].num_envs])
        steps = [
            env.step(share[:, : env.action_map.size])
            for env, share in zip(alone, shares, strict=True)
        ]
        assert np.array_equal(step.rewards, np.concatenate([one.rewards for one in steps]))
        assert np.array_equal(step.dones, np.concatenate([one.dones for one in steps]))
        seen = [
            observation.embed(part.signature, one.final_observations)
            for part, one in zip(spec.parts, steps, strict=True)
        ]
        assert np.array_equal(step.final_observations, np.concatenate(seen))


def test_a_relabelled_step_is_what_the_other_shortcut_would_have_seen(spec):
    """Both begin in the same states; what is relabelled is observed and rewarded as the other."""
    hindsight = HindsightEnvSpec(spec.parts)
    env, observation = hindsight.make(), spec.observation()
    half = env.num_envs // 2
    bits = env.observations[:, observation.layout.size :]
    rng, relabelled, done = np.random.default_rng(2), 0, 0
    for number in range(60):
        if number % 4 == 0:
            actions = rng.uniform(-1.0, 1.0, (env.num_envs, 3))
        step = env.step(actions)
        chosen = step.relabelled
        relabelled, done = relabelled + chosen.sum(), done + (step.other_dones & chosen).sum()
        swapped = np.concatenate([bits[half:], bits[:half]])
        for seen in (step.before, step.after):
            assert np.array_equal(seen[chosen, observation.layout.size :], swapped[chosen])
        rewards = step.other_rewards[chosen & ~step.other_dones]
        assert np.abs(rewards).max() < 1.0  # shaping alone
    assert relabelled > 0.5 * 60 * env.num_envs
    assert done > 0
    assert isinstance(SubgoalEnvSpec(spec.parts).make().step(actions), type(step).__base__)


@pytest.mark.slow
@pytest.mark.training
def test_one_policy_learns_two_shortcuts(tmp_path):
    """Pushing a block away with another one held, and putting the held one back."""
    ppo = replace(OURS.ppo, n_envs=32, n_steps=32, total_steps=12_000)
    begun = attempt(tmp_path, ppo=ppo, polish=None)
    push, back = learn_together(begun, 1)
    assert push.signature == SIGNATURE and back.signature == BACK
    assert min(one.record["success"] for one in (push, back)) > 0.5
    assert push.shortest < OURS.horizon and back.shortest < OURS.horizon
    assert push.record["environment_steps"] == back.record["environment_steps"] >= 12_000
    again = learn_together(begun, 1)  # read, not learned again
    assert [one.policy.mean(one.policy.normalisation.mean[None]).tobytes() for one in again] == [
        one.policy.mean(one.policy.normalisation.mean[None]).tobytes() for one in (push, back)
    ]


@pytest.mark.slow  # 600 updates of actor and critics
@pytest.mark.training
@pytest.mark.timeout(180)
def test_sac_learns_two_shortcuts_from_each_others_steps(tmp_path):
    settings = training_settings("abstract_her", DOMAIN)
    sac = replace(settings.sac, n_envs=8, buffer_size=2_000, learning_starts=500, total_steps=3_000)
    shortcuts = learn_together(attempt(tmp_path, sac=sac), 1)
    assert min(one.record["success"] for one in shortcuts) > 0.5


class Silent:
    def on_progress(self, *_): ...
    def on_left_out(self, *_): ...
    def on_ranked(self, *_): ...
    def on_learning(self, *_): ...
    def on_validated(self, *_): ...


SMALL = replace(
    OURS,
    exploration=ExplorationSettings(tasks=2, rollouts=60, length=30, action_repeat=4),
    ppo=replace(OURS.ppo, n_envs=32, total_steps=8_000),
    polish=None,
    starts=24,
    validation=3,
    shortcuts=2,
    least_saving=0.001,
)


@pytest.mark.slow
@pytest.mark.training
def test_from_exploration_to_a_library_like_any_other(tmp_path):
    tasks = TaskDistribution(DomainChoice("obstacle2d", "fair"), 5)

    def run():
        place = tmp_path / "work"
        return SubgoalTraining(tasks, SMALL, place, SequentialWorkers(), Silent()).run()

    library = run()
    assert library.record["settings"]["together"] == 4
    save_library(tmp_path / "library", library)
    loaded = load_library(tmp_path / "library", get_domain("obstacle2d"))
    assert loaded.shortcuts and not loaded.refused
    assert {one.name for one in loaded.shortcuts} == {one.name for one in library.shortcuts}
    assert run().digest == library.digest  # goes on where all is done


def test_what_is_about_a_policy_each_is_refused(tmp_path):
    tasks = TaskDistribution(DomainChoice("obstacle2d", "fair"), 5)
    several = replace(SMALL, attempts=2)
    with pytest.raises(InvalidParameterError, match="give attempts=1"):
        SubgoalTraining(tasks, several, tmp_path / "x", SequentialWorkers(), Silent()).run()
    assert not (tmp_path / "x").exists()
