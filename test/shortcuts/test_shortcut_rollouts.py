# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rollouts in a batch of worlds are those that one world alone would have made."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.dynamics import Obstacle2DVectorWorld
from slap_ros.planning.problem import Problem
from slap_ros.relational import Target
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.sampling import DEFAULT, Sampling
from slap_ros.shortcuts.shooting import RandomActions
from slap_ros.shortcuts.shortcut_library import (
    ShortcutLibrary,
    load_library,
    load_shortcut,
    save_library,
    save_shortcut,
)
from slap_ros.shortcuts.shortcut_rollouts import MAX_NET_FAILURES, ShortcutRollouts
from slap_ros.shortcuts.signature import Change

DOMAIN = get_domain("obstacle2d")
(SHORTCUT,) = load_library(Path(__file__).parent / "data" / "obstacle2d", DOMAIN).shortcuts
SAMPLING = Sampling(samples=4, batch=8)


class NothingDone(RandomActions):
    """A policy that stands still, with noise as well."""

    def sampler(self, rng, temperature=1.0):
        return lambda step, observations: self.mean(observations)


def situations(count=6):
    """Holding the target block, about to push the obstacle aside: encoder and state."""
    for index in range(count):
        task = DOMAIN.task(21, index)
        problem = Problem.of(DOMAIN, task.initial_state)
        space = problem.model.space
        ((ground, pick),) = [
            pair for pair in problem.operators if str(pair[0]) == "Pick(robot, block1, table)"
        ]
        target = Target.exactly(ground.apply(space.abstract(task.initial_state)))
        state = problem.model.roll_out(pick, task.initial_state, target).final
        add = space.mask([space.atom("Clear", ["target"]), space.atom("On", ["block2", "table"])])
        change = Change(add, space.mask([space.atom("Overlap", ["block2", "target"])]))
        yield ObservationEncoder(DOMAIN, space, SHORTCUT.signature, change), state


def successes(domain, sampling, encoder, state):
    return ShortcutRollouts(domain, state, sampling).successes(SHORTCUT, encoder, state)


def test_each_rollout_does_in_a_world_of_its_own_what_it_says():
    seen = 0
    for encoder, state in situations():
        for rollout in successes(DOMAIN, SAMPLING, encoder, state):
            world = DOMAIN.make_world(state)
            for action, predicted in zip(rollout.actions, rollout.states, strict=True):
                assert np.array_equal(world.state.data, predicted.data)
                world.step(encoder.action_map(action.astype(np.float64)))
            assert np.array_equal(world.state.data, rollout.final.data)
            goal = encoder.change.apply(encoder.space.abstract(state))
            assert encoder.space.abstract(world.state) == goal
            seen += 1
    assert seen > 6


def test_a_beginning_is_encoded_once_however_many_rollouts_begin_in_it(monkeypatch):
    encoder, state = next(situations())
    encoded, encode = [], ObservationEncoder.encode

    def remembered(encoder, states):
        encoded.append(states.data)
        return encode(encoder, states)

    monkeypatch.setattr(ObservationEncoder, "encode", remembered)
    apart = replace(DOMAIN, learning=replace(DOMAIN.learning, make_vector_world=None))
    assert successes(apart, SAMPLING, encoder, state)
    assert sum(np.array_equal(data[0], state.data) for data in encoded) == 1
    assert len(encoded) > 10


def same(one, other):
    """Whether successes are the same to the bit."""
    pairs = list(zip(one, other, strict=True))
    return all(
        [s.key for s in (*a.states, a.final)] == [s.key for s in (*b.states, b.final)]
        for a, b in pairs
    )


def test_what_is_tried_bit_by_bit_ends_as_what_is_tried_at_once():
    """States take turns, and each is asked about more and more steps."""
    every = list(situations(4))
    whole = [successes(DOMAIN, SAMPLING, encoder, state) for encoder, state in every]
    rollouts = ShortcutRollouts(DOMAIN, every[0][1], SAMPLING)
    raised = 0
    for steps in range(1, 6):
        for encoder, state in every:
            raised += rollouts.raised_bound(SHORTCUT, encoder, state, steps) - steps
    assert raised > 4
    for (encoder, state), found in zip(every, whole, strict=True):
        assert same(rollouts.successes(SHORTCUT, encoder, state), found)
    assert any(whole)


def test_what_was_begun_counts_among_failures_where_that_decides():
    """A policy that does nothing fails wherever it is tried."""
    rollouts = ShortcutRollouts(DOMAIN, next(situations(1))[1], SAMPLING)
    still = replace(SHORTCUT, policy=NothingDone(2))
    for number, (encoder, state) in enumerate(situations(MAX_NET_FAILURES)):
        assert not rollouts.given_up(still), number
        assert rollouts.raised_bound(still, encoder, state, 1) == 2
    assert rollouts.given_up(still)


def test_a_rollout_that_is_kept_keeps_no_other():
    ((encoder, state),) = situations(1)
    for rollout in successes(DOMAIN, DEFAULT, encoder, state):
        for array in (*rollout.actions, *(one.data for one in rollout.states)):
            assert array.base is None  # else all that were tried together


def test_worlds_that_cannot_be_stepped_together_try_one_after_the_other():
    """Without noise a batch has nothing to add: both find the same."""
    apart = replace(DOMAIN, learning=replace(DOMAIN.learning, make_vector_world=None))
    for encoder, state in situations():
        alone = Sampling(samples=1, refinements=0)
        one, many = (successes(domain, alone, encoder, state) for domain in (apart, DOMAIN))
        assert [a.steps for a in one] == [a.steps for a in many]
        assert len(one) <= 1


def test_a_shortcut_is_tried_as_often_as_the_results_say():
    begun = []

    class Counted(Obstacle2DVectorWorld):
        def __init__(self, states, **settings):
            begun.extend(states)
            super().__init__(states, **settings)

    counting = replace(DOMAIN, learning=replace(DOMAIN.learning, make_vector_world=Counted))
    encoder, state = next(situations())
    assert successes(counting, DEFAULT, encoder, state)
    assert len(begun) == 482 + 481
    page = Path(__file__).parents[2] / "docs" / "results" / "README.md"
    assert "482 rollouts from a state, and 481 random variations" in " ".join(
        page.read_text(encoding="utf-8").split()
    )


@pytest.mark.parametrize("batch", [1, 8])
def test_the_shortest_come_first_and_no_more_than_wanted(batch):
    sampling = replace(SAMPLING, batch=batch)
    for encoder, state in situations():
        steps = [rollout.steps for rollout in successes(DOMAIN, sampling, encoder, state)]
        assert steps == sorted(steps)
        assert len(steps) <= sampling.alternatives + 1


@pytest.mark.slow
def test_a_batch_finds_a_way_at_least_as_short():
    few, many = (replace(SAMPLING, batch=batch) for batch in (1, 64))
    sums = [
        sum(
            found[0].steps if (found := successes(DOMAIN, sampling, encoder, state)) else 40
            for encoder, state in situations()
        )
        for sampling in (few, many)
    ]
    assert sums[1] < sums[0]


def test_a_library_keeps_how_a_policy_is_run(tmp_path):
    """SAC's are, otherwise than PPO's: as PPO's, the same weights would do something else."""
    squashed = replace(SHORTCUT.policy, activation="relu", squashed=True)
    learned = {"sac": replace(SHORTCUT, policy=squashed), "ppo": SHORTCUT}
    libraries = {name: ShortcutLibrary(DOMAIN.name, (one,)) for name, one in learned.items()}
    for name, library in libraries.items():
        save_library(tmp_path / name, library)
        (read,) = load_library(tmp_path / name, DOMAIN).shortcuts
        seen = np.linspace(-1.0, 1.0, read.policy.normalisation.mean.size, dtype=np.float32)[None]
        assert np.array_equal(read.policy.mean(seen), learned[name].policy.mean(seen))
        text = (tmp_path / name / SHORTCUT.name / "shortcut.json").read_text()
        assert ('"squashed"' in text) == (name == "sac")
    assert libraries["sac"].digest != libraries["ppo"].digest


def test_a_shortcut_that_takes_longer_is_tried_out_for_longer(tmp_path):
    encoder, state = next(situations())
    short = replace(DEFAULT, horizon=1)
    assert not successes(DOMAIN, short, encoder, state)
    longer = replace(SHORTCUT, horizon=DEFAULT.horizon)
    found = ShortcutRollouts(DOMAIN, state, short).successes(longer, encoder, state)
    assert [rollout.steps for rollout in found] == [
        rollout.steps for rollout in successes(DOMAIN, DEFAULT, encoder, state)
    ]
    assert longer.step_limit(replace(DEFAULT, horizon=100)) == 100
    for shortcut in (SHORTCUT, longer):
        save_shortcut(tmp_path / shortcut.name, shortcut)
        assert load_shortcut(tmp_path / shortcut.name).horizon == shortcut.horizon
        text = (tmp_path / shortcut.name / "shortcut.json").read_text()
        assert ('"horizon"' in text) == (shortcut is longer)
