# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shortcut MDP, against the domain's own worlds and atoms."""

import numpy as np
import pytest

from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from slap_ros.shortcuts.signature import Change, Signature
from support.pushing import DOMAIN, SIGNATURE, STARTS, overlap

OURS = Rewards()


def make_env(num_envs=24, horizon=25, rewards=OURS, seed=3):
    rng = np.random.default_rng(seed)
    return ShortcutVecEnv(DOMAIN, SIGNATURE, STARTS, num_envs, horizon, rewards, rng)


def random_steps(env, count, seed=5):
    rng = np.random.default_rng(seed)
    for step in range(count):
        if step % 4 == 0:
            actions = rng.uniform(-1, 1, (env.num_envs, env.action_map.size))
        yield env.step(actions)


def test_tasks_with_different_objects_are_stepped_together():
    assert len({len(start.state.objects) for start in STARTS}) > 1
    env = make_env()
    assert env.num_envs == 24
    assert env.observations.shape[0] == 24


def test_it_succeeds_exactly_where_the_target_abstract_state_is_reached():
    env = make_env(num_envs=16)
    done = 0
    for _ in range(200):
        targets = [list(group._targets) for group in env._groups]
        (steps,) = random_steps(env, 1, seed=_)
        first = 0
        for group, wanted in zip(env._groups, targets, strict=True):
            ended = steps.dones[first : first + group.size]
            states = group._worlds.states
            for i in range(group.size):
                if not ended[i]:  # else the world was reset
                    state = State(states.layout, states.data[i])
                    assert group.encoder.space.abstract(state) != wanted[i]
            first += group.size
        done += int(steps.success.sum())
    assert done > 0


def test_the_horizon_is_told_apart_from_an_end():
    env = make_env(horizon=3)
    ends = list(random_steps(env, 6))
    assert not ends[1].truncated.any()
    assert (
        ends[2].truncated.sum() + ends[2].success.sum()
        == 24 - ends[0].success.sum() - ends[1].success.sum()
    )
    assert not (ends[2].truncated & ends[2].success).any()


def test_shaping_telescopes():
    """Undiscounted, the rewards of a success differ by the potential at the start alone."""
    plain, shaped = Rewards(shaping=0.0), Rewards(shaping=1.0)
    envs = [make_env(rewards=rewards) for rewards in (plain, shaped)]
    potential = np.concatenate([group._potential for group in envs[1]._groups])
    sums = np.zeros((2, 24))
    alive = np.ones(24, dtype=bool)
    ended = np.zeros(24, dtype=bool)
    for pair in zip(*(random_steps(env, 25) for env in envs), strict=True):
        for i, steps in enumerate(pair):
            sums[i] += np.where(alive, steps.rewards, 0.0)
        ended |= alive & pair[0].success
        alive &= ~pair[0].dones
    assert ended.any()
    assert sums[1][ended] == pytest.approx(sums[0][ended] - plain.scale * potential[ended])


def test_standing_still_is_worth_the_same_everywhere():
    """Else a critic that has learned the potential would find nothing worth while."""
    rewards, env = Rewards(), make_env(horizon=50)
    random_steps(env, 10)
    still = [env.step(np.zeros((24, env.action_map.size))) for _ in range(5)]
    for steps in still:
        going = ~steps.dones
        assert going.any()
        assert steps.rewards[going] == pytest.approx(rewards.scale * rewards.step)


def test_the_gripper_acts_only_where_what_is_held_is_to_change():
    assert ActionMap(DOMAIN, gripper=False)(np.ones((5, 2))).shape == (5, 3)
    start = STARTS[0]
    assert ObservationEncoder(DOMAIN, start.space, SIGNATURE, start.change).action_map.size == 2
    release = Change(start.space.mask([start.space.atom("GripperEmpty", ["robot"])]), 0)
    signature = Signature.of(release, start.space)
    assert ObservationEncoder(DOMAIN, start.space, signature, release).action_map.size == 3


def test_what_is_let_go_of_elsewhere_is_out_of_hand():
    start = STARTS[0]
    names = [("On", ["block1", "target"]), ("Overlap", ["block1", "target"])]
    names += [("GripperEmpty", ["robot"]), ("On", ["block2", "table"])]
    add = start.space.mask([start.space.atom(*name) for name in names])
    held = start.space.atom("Holding", ["robot", "block1"])
    change = Change(add, start.space.mask([held, overlap(start.space)]))
    encoder = ObservationEncoder(DOMAIN, start.space, Signature.of(change, start.space), change)
    world = DOMAIN.make_world(start.state)
    encodings = [encoder.encode(start.state.alone())]
    encodings += [encoder.encode(world.step(np.array([0.0, 0.0, -1.0])).alone())]
    assert [bool(encode.failure[0]) for encode in encodings] == [False, True]
    assert not encodings[1].achieved[0]
    there = moved_there(start.state, world.state)
    assert not encoder.encode(there.alone()).failure[0]
    assert encoder.encode(there.alone()).achieved[0]


def moved_there(initial, released):
    """The target block released where it should be, and the obstacle beside it."""
    layout, data = initial.layout, released.data.copy()
    target = initial.get(layout.object("target"), "x")
    side = 0.25 if target < 0.5 else -0.25
    for name, x in (("block1", target), ("block2", target + side)):
        data[layout.column(layout.object(name), "x")] = x
    return State(layout, data)


def test_the_way_to_the_target_counts_while_a_block_is_held():
    start = STARTS[0]
    on = start.space.mask([start.space.atom("On", ["block1", "target"])])
    change = Change(on, 0)
    encoder = ObservationEncoder(DOMAIN, start.space, Signature.of(change, start.space), change)
    layout, block = start.state.layout, start.state.layout.object("block1")
    target = start.state.get(layout.object("target"), "x")
    data = np.repeat(start.state.data[None], 5, axis=0)
    data[:, layout.column(block, "x")] = target + np.array([0.4, 0.3, 0.2, 0.1, 0.0])
    data[:, layout.column(layout.object("robot"), "x")] = data[:, layout.column(block, "x")]
    assert (np.diff(encoder.encode(State(layout, data)).potential) > 0.0).all()


def test_same_seed_same_episodes():
    first, second = (list(random_steps(make_env(), 40)) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert a.observations.tobytes() == b.observations.tobytes()
        assert a.rewards.tobytes() == b.rewards.tobytes()


def test_what_is_seen_does_not_depend_on_how_many_are_looked_at():
    start = STARTS[0]
    encoder = ObservationEncoder(DOMAIN, start.space, SIGNATURE, start.change)
    world = DOMAIN.make_world(start.state)
    rng = np.random.default_rng(0)
    states = [world.step(np.array([*rng.uniform(-0.1, 0.1, 2), 0.0])) for _ in range(20)]
    together = encoder.encode(State.batch(states))
    for i, state in enumerate(states):
        alone = encoder.encode(State.batch([state]))
        assert alone.observations[0].tobytes() == together.observations[i].tobytes()
        assert alone.potential[0] == together.potential[i]
