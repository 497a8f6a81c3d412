# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The skill MDP: its reward, what is observed, and why no episode ends by success."""

import math

import numpy as np
import pytest

from slap_ros.acquisition.training.skill_env import Initiation, SkillMdp, SkillVecEnv
from slap_ros.errors import InvalidRewardError
from slap_ros.relational import RewardTemplate, RewardTerm, State
from slap_ros.relational.operators import Variable
from slap_ros.skills.groundings import Grounding, Groundings
from slap_ros.skills.observations import SIZE
from slap_ros.skills.reward import SkillReward
from support.points import (
    AT,
    DIS_TO_OBJ,
    HOLDING,
    HORIZON,
    INTERFACE,
    PICK,
    POINTS,
    PUT,
    REWARDS,
    STEP,
    P,
    T,
    hand_xy,
    sample_task,
)


def scattered(count, things=2, seed=0):
    """States of one task in which everything lies anywhere, and maybe in the hand."""
    rng = np.random.default_rng(seed)
    state = sample_task(rng).initial_state
    states = []
    for _ in range(count):
        data = state.data + rng.normal(0.0, 0.05, state.data.size)
        now = State(state.layout, data)
        held = rng.integers(things + 1)
        for i in range(things):
            now = now.replace({(state.layout.by_name[f"thing{i}"], "held"): float(i == held)})
        if rng.random() < 0.3:  # often enough at its place
            place = now[state.layout.by_name["place1"]]
            thing = state.layout.by_name["thing1"]
            now = now.replace({(thing, "x"): place[0] + 0.004, (thing, "y"): place[1]})
        states.append(now)
    return states


def groundings_of(state, operator):
    names = state.layout.by_name
    if operator is PICK:
        chosen = [(names["thing0"],), (names["thing1"],)]
    else:
        chosen = [(names[a], names[b]) for a in ("thing0", "thing1") for b in ("place0", "place1")]
    return [Grounding(state.layout, objects) for objects in chosen]


def one_by_one(operator, template, state, objects):
    """The reward as the paper writes it, atom by atom and metric by metric."""
    binding = dict(zip(operator.parameters, objects, strict=True))
    dense = sum(
        term.weight
        * float(
            term.metric.form.apply(
                np.array(term.metric.scalar(state, *(binding[v] for v in term.arguments)))
            )
        )
        for term in template.terms
    )
    added = all(atom.ground(binding).holds(state) for atom in operator.add_effects)
    deleted = any(atom.ground(binding).holds(state) for atom in operator.delete_effects)
    return max(dense, 1.0 if added and not deleted else 0.0)


@pytest.mark.parametrize("operator", [PICK, PUT], ids=str)
def test_rewards_of_a_batch_are_those_of_each_state(operator):
    states, template = scattered(200), REWARDS[operator.name]
    groundings = Groundings(groundings_of(states[0], operator))
    mdp = SkillMdp(POINTS, SkillReward(operator, template, INTERFACE), groundings)
    numbers = np.arange(len(states)) % len(groundings.groundings)
    rewards, success = mdp.rewards(State.batch(states).data, numbers, State.batch(states).data)
    for state, number, reward in zip(states, numbers, rewards, strict=True):
        objects = groundings.groundings[number].objects
        assert reward == pytest.approx(one_by_one(operator, template, state, objects))
    assert 5 < success.sum() < 195
    assert (rewards[success] == 1.0).all()


def test_states_of_different_objects_are_rows_of_one_array():
    small, large = scattered(1)[0], make_three()
    groundings = Groundings([*groundings_of(small, PUT), *groundings_of(large, PUT)])
    mdp = SkillMdp(POINTS, SkillReward(PUT, REWARDS["Put"], INTERFACE), groundings)
    rows = np.concatenate([groundings.rows(s.data[None]) for s in (small, large, small)])
    numbers = np.array([1, 6, 3])
    rewards, _ = mdp.rewards(rows, numbers, rows)
    for state, number, reward in zip((small, large, small), numbers, rewards, strict=True):
        alone = SkillMdp(POINTS, mdp.reward, Groundings([groundings.groundings[number]]))
        expected, _ = alone.rewards(state.data[None], np.zeros(1, dtype=np.intp), state.data[None])
        assert reward == expected[0]
    assert mdp.observe(rows, numbers).shape == (3, SIZE)


def make_three():
    return sample_task(np.random.default_rng(4), 3).initial_state


def test_observations_are_of_the_operators_objects_alone():
    state = scattered(1)[0]
    mdp = SkillMdp(
        POINTS,
        SkillReward(PICK, REWARDS["Pick"], INTERFACE),
        Groundings(groundings_of(state, PICK)),
    )
    other = state.replace({(state.layout.by_name["thing1"], "x"): 0.7})
    rows, numbers = State.batch([state, other]).data, np.zeros(2, dtype=np.intp)
    first, second = mdp.observe(rows, numbers)
    assert np.array_equal(first, second)  # Pick(thing0) sees nothing of thing1
    third, fourth = mdp.observe(rows, np.ones(2, dtype=np.intp))
    assert not np.array_equal(third, fourth)


@pytest.mark.parametrize(
    ("terms", "reason"),
    [
        ((RewardTerm(DIS_TO_OBJ, (T,), 2.0),), "its weight is 2.0"),
        ((RewardTerm(DIS_TO_OBJ, (T,), math.nan),), "its weight is nan"),
        ((RewardTerm(DIS_TO_OBJ, (P,), 0.5),), r"\?place is not among the operator's parameters"),
        ((RewardTerm(DIS_TO_OBJ, (T, T), 0.5),), "2 arguments, but it is dis_to_obj"),
    ],
)
def test_templates_that_cannot_be_weighed_are_refused(terms, reason):
    with pytest.raises(InvalidRewardError, match=reason):
        SkillReward(PICK, RewardTemplate("Pick", terms), INTERFACE)
    with pytest.raises(InvalidRewardError, match="the reward of Put is given for Pick"):
        SkillReward(PICK, REWARDS["Put"], INTERFACE)


def test_a_parameter_of_a_foreign_type_is_refused():
    hand = Variable("?thing", POINTS.types_by_name["hand"])
    with pytest.raises(InvalidRewardError):
        SkillReward(
            PICK, RewardTemplate("Pick", (RewardTerm(DIS_TO_OBJ, (hand,), 0.5),)), INTERFACE
        )


def pick_env(num_envs=2, **changes):
    state = POINTS.task(1).initial_state
    near = state.replace(
        {
            (state.layout.by_name["hand"], "x"): state.get(state.layout.by_name["thing0"], "x"),
            (state.layout.by_name["hand"], "y"): state.get(state.layout.by_name["thing0"], "y")
            + 0.04,
        }
    )
    initiations = [Initiation(near, (state.layout.by_name[name],)) for name in ("thing0", "thing1")]
    groundings = Groundings([initiation.grounding for initiation in initiations])
    mdp = SkillMdp(POINTS, SkillReward(PICK, REWARDS["Pick"], INTERFACE), groundings)
    kept = initiations[: changes.pop("initiations", 1)]
    return SkillVecEnv(mdp, kept, num_envs, HORIZON, (3,), **changes)


def towards_the_thing(env, close):
    """The shortest way to the thing; then grasps it, or hovers right above it."""
    part = next(env.mdp.groundings.split(env._rows, env._numbers))
    thing = part.pick(part.state.gather(part.columns[0], ("x", "y")))
    way = (thing - hand_xy(part.state)) / STEP
    arrived = np.linalg.norm(way, axis=-1, keepdims=True) < 0.5
    return np.concatenate([way, np.where(arrived & close, 1.0, 0.0)], axis=-1)


def returns(close, ends_by_success, discount=0.95):
    """The discounted return of an episode, that of what follows included.

    Where success ends an episode nothing follows; where it does not, the last state's value is
    bootstrapped, here by staying there for ever.
    """
    env, total, weight = pick_env(), np.zeros(2), 1.0
    for _ in range(HORIZON):
        actions = towards_the_thing(env, close)
        step = env.step(actions)
        total += weight * step.rewards
        weight *= discount
        if ends_by_success and (step.rewards == 1.0).all():
            return total[0]
    return (total + weight * step.rewards / (1.0 - discount))[0]


def test_the_trap():
    """Where success ends an episode, the best return is had by hovering; so it must not."""
    hovering, grasping = (returns(close, ends_by_success=True) for close in (False, True))
    assert hovering > 2 * grasping
    hovering, grasping = (returns(close, ends_by_success=False) for close in (False, True))
    assert grasping > hovering


def test_episodes_go_on_after_success_and_are_truncated_together():
    env = pick_env()
    for step in range(1, 2 * HORIZON + 1):
        outcome = env.step(towards_the_thing(env, True))
        assert not outcome.success.any() and not outcome.failure.any()
        assert outcome.truncated.all() == (step % HORIZON == 0)
    assert env.succeeded.all()
    episodes = env.take_episodes()
    assert episodes.states.shape == (4, HORIZON + 1, env.mdp.groundings.width)
    assert env.take_episodes() is None
    rewards, _ = env.mdp.rewards(episodes.states[:, -1], episodes.numbers, episodes.states[:, 0])
    assert (rewards == 1.0).all()


def test_drawing_starts_can_be_resumed_at_any_round():
    env = pick_env(num_envs=4, initiations=2)
    drawn = []
    for _ in range(4):
        drawn.append(env._numbers.copy())
        for _ in range(HORIZON):
            env.step(np.zeros((4, 3)))
    assert len({tuple(numbers) for numbers in drawn}) > 1
    for i, numbers in enumerate(drawn):
        resumed = pick_env(num_envs=4, initiations=2, first_round=i)
        assert np.array_equal(resumed._numbers, numbers)


def varied_env(first_round=0):
    """Five states, each of other objects, and two environments."""
    states = [sample_task(np.random.default_rng(i), 2 + i).initial_state for i in range(5)]
    begun = [Initiation(state, (state.layout.by_name["thing0"],)) for state in states]
    groundings = Groundings([one.grounding for one in begun])
    mdp = SkillMdp(POINTS, SkillReward(PICK, REWARDS["Pick"], INTERFACE), groundings)
    return SkillVecEnv(mdp, begun, 2, HORIZON, (3,), first_round), begun


def test_with_more_kinds_of_scenes_than_environments_episodes_begin_in_all():
    """And they are the same where training was resumed, and in worlds that were used before."""
    env, begun = varied_env()
    for number in range(12):
        assert np.array_equal(varied_env(number)[0]._rows, env._rows)
        for _ in range(HORIZON):
            env.step(np.full((2, 3), 0.5))
    episodes = env.take_episodes()
    assert set(episodes.numbers) == set(range(len(begun)))
    fresh = varied_env(11)[0]
    for _ in range(HORIZON):
        fresh.step(np.full((2, 3), 0.5))
    assert np.array_equal(fresh.take_episodes().states, episodes.states[-2:])
    for number, states in zip(episodes.numbers, episodes.states, strict=True):
        start = begun[number].state.data
        assert np.array_equal(states[0, : start.size], start)


def test_the_toy_is_as_its_operators_say():
    state = POINTS.task(0).initial_state
    space = POINTS.atom_space(state)
    assert HOLDING in POINTS.predicates and AT in POINTS.predicates
    assert "HandEmpty()" in space.describe(space.abstract(state))
