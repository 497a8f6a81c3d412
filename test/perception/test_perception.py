# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Noise is what it is said to be, what is lost is told, and plans go on in spite of both."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.model import BLOCK
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.perception import ExactPerceiver, NoisyPerceiver, Quality
from slap_ros.perception.debounce import Debouncer
from slap_ros.planning.execution import Executor
from slap_ros.planning.partial import PartialPlanner
from slap_ros.planning.planner import make_planner

DOMAIN = get_domain("obstacle2d")
TASK = DOMAIN.task(3)
SPACE = DOMAIN.atom_space(TASK.initial_state)


def perceiver(quality, domain=DOMAIN, task=TASK, seed=0):
    space = domain.atom_space(task.initial_state)
    rng = np.random.default_rng(seed)
    return NoisyPerceiver.of(domain, space, task.initial_state, quality, rng)


def solve(quality, seed, max_replans=10, task=TASK):
    space, world = DOMAIN.atom_space(task.initial_state), DOMAIN.make_world(task.initial_state)
    goal = space.mask(task.goal)
    episode = Executor(
        DOMAIN,
        PartialPlanner(space, DOMAIN.atom_space, partial(make_planner, "lazy", DOMAIN)),
        world,
        space,
        goal,
        task.step_limit,
        max_replans,
        perceiver(quality, task=task, seed=seed),
        quality.debounce_delay_steps,
    ).run()
    return episode, space.abstract(world.state) & goal == goal


def positions(state, names=("x", "y", "z")):
    blocks = state.layout.of_type(next(t for t in state.layout.objects if "block" in t.name).type)
    return {
        block.name: np.array([state.get(block, n) for n in names if n in block.type.column])
        for block in blocks
    }


def test_without_noise_it_is_exact_perception():
    quality = Quality()
    assert quality.exact
    noisy, exact = perceiver(quality), ExactPerceiver(SPACE)
    episode, _ = solve(quality, 0)
    for state in episode.states:
        assert noisy.perceive(state) == exact.perceive(state)


def test_the_same_seed_errs_in_the_same_way_and_another_in_another():
    quality = Quality(position_noise_m=0.003, threshold_noise=0.002, dropout=0.2, debounce=2)
    states = solve(Quality(), 0)[0].states

    def seen(seed):
        one = perceiver(quality, seed=seed)
        return [one.perceive(state) for state in states]

    assert seen(1) == seen(1)
    assert seen(1) != seen(2)


def test_noise_has_the_standard_deviation_that_it_is_said_to_have():
    tower = get_domain("obstacle_tower")
    task = tower.task(1)
    # As measured, before it is settled: settling takes most of the noise in height away.
    raw = replace(tower, execution=replace(tower.execution, settle=lambda state: state))
    one = perceiver(Quality(position_noise_m=0.002, turn_noise_rad=0.01), raw, task)
    truth = positions(task.initial_state)
    errors = np.array(
        [
            [seen - truth[name] for name, seen in positions(percept.state).items()]
            for percept in (one.perceive(task.initial_state) for _ in range(300))
        ]
    ).reshape(-1, 3)
    assert np.abs(errors.mean(axis=0)).max() < 0.0003
    np.testing.assert_allclose(errors.std(axis=0), 0.002, rtol=0.1)


def test_what_lies_still_is_seen_to_lie_on_something():
    tower = get_domain("obstacle_tower")
    task = tower.task(1)
    one = perceiver(Quality(position_noise_m=0.003, turn_noise_rad=0.01), tower, task)
    world = tower.make_world(task.initial_state)
    heights = {name: place[2] for name, place in positions(task.initial_state).items()}
    for _ in range(20):
        seen = one.perceive(task.initial_state).state
        world.reset(seen)  # which can be
        for name, place in positions(seen).items():
            assert place[2] == pytest.approx(heights[name], abs=1e-4)
    assert positions(seen)["block1"][0] != positions(task.initial_state)["block1"][0]


def test_toys_whose_centre_of_mass_is_not_in_their_middle_are_seen_to_lie_where_they_lie():
    table = get_domain("cleanup_table")
    state = table.task(1).initial_state
    np.testing.assert_allclose(table.execution.settle(state).data, state.data, atol=1e-9)


def test_poses_that_do_not_err_are_not_corrected():
    tower = get_domain("obstacle_tower")
    task = tower.task(1)
    block = task.initial_state.layout.by_name["block1"]
    leaning = {(block, "qx"): np.sin(0.05), (block, "qw"): np.cos(0.05)}
    state = task.initial_state.replace(leaning)
    assert tower.execution.settle(state) != state
    late = perceiver(Quality(threshold_noise=0.001, debounce=2), tower, task)
    assert late.perceive(state).state == state


def test_blocks_of_a_row_are_not_seen_inside_one_another():
    one = perceiver(Quality(position_noise_m=0.02))
    for _ in range(200):
        seen = one.perceive(TASK.initial_state).state
        DOMAIN.make_world(seen)  # refuses what cannot be


def test_an_atom_changes_once_it_was_seen_changed_so_many_times_in_a_row():
    debouncer = Debouncer(3)
    flickering = [0b01, 0b11, 0b01, 0b11, 0b11, 0b11, 0b10, 0b01, 0b10, 0b10, 0b10]
    assert [debouncer.add(seen) for seen in flickering] == [
        *(0b01, 0b01, 0b01, 0b01, 0b01),
        *(0b11, 0b11, 0b11, 0b11, 0b11, 0b10),
    ]
    assert [Debouncer(1).add(seen) for seen in flickering] == flickering


def test_threshold_noise_flips_what_is_near_its_threshold_and_nothing_else():
    one = perceiver(Quality(threshold_noise=0.002))
    truth = SPACE.abstract(TASK.initial_state)
    flipped = 0
    for _ in range(200):
        flipped |= one.perceive(TASK.initial_state).abstract ^ truth
    margins = {
        str(atom): abs(float(atom.predicate.margin(TASK.initial_state, *_columns(atom))[0]))
        for atom in SPACE.atoms
        if atom.predicate.margin is not None
    }
    near = {name for name, margin in margins.items() if margin < 0.004}
    far = {name for name, margin in margins.items() if margin > 0.012}
    seen = {str(atom) for atom in SPACE.decode(flipped)}
    assert near <= seen
    assert not far & seen
    assert all("On" in name or "Overlap" in name or "Clear" in name for name in seen)


def _columns(atom):
    from slap_ros.relational import Column

    return [Column((obj,)) for obj in atom.objects]


def test_what_is_hidden_is_known_while_it_is_felt_and_a_while_after():
    episode, _ = solve(Quality(), 0)
    block = "block2"  # carried, so known from where it is picked
    one = perceiver(Quality(hidden=frozenset({block}), memory_steps=4))
    obj = TASK.initial_state.layout.object(block)
    unseen, last = 5, None
    for state in episode.states:
        percept = one.perceive(state)
        held = state.get(obj, "held") > 0.5
        unseen = 0 if held else unseen + 1
        missing = unseen > 4
        assert percept.missing == ({block} if missing else set())
        assert (obj in percept.state.objects) == (not missing)
        about = [atom for atom in SPACE.decode(percept.abstract) if obj in atom.objects]
        assert bool(about) == (not missing)
        if held:  # felt
            np.testing.assert_array_equal(percept.state[obj], state[obj])
            last = state[obj][:2]
        elif not missing:
            assert percept.state.get(obj, "x") == last[0]
    assert last is not None
    assert unseen > 4


def test_what_the_goal_is_about_must_be_detected():
    episode, _ = solve(Quality(hidden=frozenset({"block1"}), memory_steps=100), 0)
    assert not episode.success
    assert episode.error.code is ErrorCode.NO_DETECTION
    assert episode.error.reason == "the goal is about what is not detected: block1"
    assert episode.plan_length == episode.replans == 0


def test_where_nothing_of_a_kind_is_detected_skills_about_it_end():
    every = frozenset(name for name in TASK.initial_state.layout.by_name if "block" in name)
    episode, _ = solve(Quality(hidden=every), 0)
    assert episode.error.code is ErrorCode.NO_DETECTION


def test_what_nothing_is_about_stops_nothing_when_it_is_hidden():
    """The robot may bump into a bystander that it does not see; that is not detected either."""
    ended = []
    for seed in range(6):
        task = get_domain("obstacle2d", "fair:bystanders=2").task(seed)
        blocks = task.initial_state.layout.of_type(BLOCK)
        bystander = blocks[-1]
        hidden, _ = solve(Quality(hidden=frozenset({bystander.name})), 0, task=task)
        ended.append(hidden.error.code)
    assert ErrorCode.NO_DETECTION not in ended
    assert ended.count(ErrorCode.NONE) >= 3


@pytest.mark.slow
def test_with_noise_it_replans_and_goes_on():
    episodes = [solve(Quality(position_noise_m=0.002), s, task=DOMAIN.task(s)) for s in range(10)]
    solved = [(episode, holds) for episode, holds in episodes if episode.success]
    assert len(solved) >= 7
    assert all(holds for _, holds in solved)  # solved is solved in the world
    assert any(episode.replans for episode, _ in solved)


def test_too_many_replans_end_with_their_own_code():
    noisy = Quality(threshold_noise=0.2)
    episode, _ = solve(noisy, 0, max_replans=2)
    assert episode.error.code is ErrorCode.REPLANS_EXHAUSTED
    assert episode.replans == 2


def test_what_is_debounced_is_waited_for():
    """Exact but for being late: without holding, every edge would seem to have failed."""
    quality = Quality(debounce=3)
    episode, holds = solve(quality, 0)
    assert episode.success
    assert holds
    assert episode.replans == 0
    edges = 4
    assert (
        episode.plan_length
        == solve(Quality(), 0)[0].plan_length + edges * quality.debounce_delay_steps
    )


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"position_noise_m": -0.001}, "position_noise_m"),
        ({"turn_noise_rad": float("nan")}, "turn_noise_rad"),
        ({"dropout": 1.0}, "dropout"),
        ({"memory_steps": -1}, "memory"),
        ({"debounce": 0}, "debounce"),
    ],
)
def test_what_is_no_quality_is_refused(wrong, what):
    with pytest.raises(InvalidParameterError, match=what):
        Quality(**wrong)


def test_only_what_there_is_can_be_hidden():
    with pytest.raises(InvalidParameterError, match="block9 cannot be hidden"):
        perceiver(Quality(hidden=frozenset({"block9"})))
