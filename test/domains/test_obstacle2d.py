# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: the world's physics, its tasks, and operators that tell the truth."""

from itertools import pairwise, product

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.dynamics import GRASP_TOLERANCE, STEP_OF_MANY, step
from slap_ros.domains.obstacle2d.model import (
    BLOCK,
    BLOCK_SIZE,
    ON_MARGIN_OF_MANY,
    RELATIONS_OF_MANY,
    ROBOT,
    SURFACE,
    on_margin_by_numpy,
    relations_by_numpy,
)
from slap_ros.domains.obstacle2d.tasks import make_task
from slap_ros.errors import (
    InvalidCommandError,
    InvalidParameterError,
    InvalidStateError,
    UnknownDomainError,
)
from slap_ros.relational import Column, State

FAIR = get_domain("obstacle2d")
TOUCH = 1e-5  # m, overlap that counts as touching


def random_walk(seed, steps=200):
    """States of an episode of random actions, biased downwards so that much is pushed."""
    rng = np.random.default_rng(seed)
    state = FAIR.task(seed).initial_state
    world = FAIR.make_world(state)
    states, actions = [state], []
    for _ in range(steps):
        action = rng.uniform(-1, 1, 3) * [0.1, 0.1, 1.0] - [0, 0.02, 0]
        action[1] = max(action[1], -0.1)
        actions.append(action)
        states.append(world.step(action))
    return states, actions


@pytest.mark.slow
def test_nothing_ever_interpenetrates_leaves_or_floats():
    touched = 0
    for seed in range(40):
        for state in random_walk(seed)[0]:
            blocks = state.layout.of_type(BLOCK)
            (robot,) = state.layout.of_type(ROBOT)
            bodies = [(b, *state[b][:2]) for b in blocks]
            held = [b for b in blocks if state.get(b, "held") > 0.5]
            assert len(held) <= 1
            bodies.append((robot, *state[robot]))
            for i, (a, ax, ay) in enumerate(bodies):
                assert -TOUCH <= ax <= 1 + TOUCH
                assert -TOUCH <= ay <= 1 + TOUCH
                if a != robot and a not in held:
                    assert ay == 0.0
                for _, bx, by in bodies[i + 1 :]:
                    overlap = BLOCK_SIZE - max(abs(ax - bx), abs(ay - by))
                    assert overlap <= TOUCH
                    touched += overlap > -TOUCH
    assert touched > 500  # the walk really pushes


def test_blocks_move_only_when_pushed_or_carried():
    for seed in range(20):
        states, _ = random_walk(seed)
        for before, after in pairwise(states):
            for block in before.layout.of_type(BLOCK):
                if after.get(block, "held") < 0.5:
                    # Not even by a rounding error: otherwise states at rest would drift.
                    moved = abs(after[block][0] - before[block][0])
                    assert moved == 0.0 or moved > 1e-10


def test_a_robot_that_stands_still_changes_nothing():
    for seed in range(20):
        for state in random_walk(seed)[0]:
            assert FAIR.make_world(state).step(np.zeros(3)) == state


def test_a_carried_block_keeps_its_place_in_the_gripper():
    carried = 0
    for seed in range(40):
        states, _ = random_walk(seed)
        for before, after in pairwise(states):
            (robot,) = before.layout.of_type(ROBOT)
            for block in before.layout.of_type(BLOCK):
                if before.get(block, "held") > 0.5 and after.get(block, "held") > 0.5:
                    carried += 1
                    offset = after[block][:2] - after[robot]
                    assert offset == pytest.approx(before[block][:2] - before[robot], abs=1e-12)
    assert carried > 100


def test_replaying_any_state_gives_the_next_bit_for_bit():
    """Markov: in a fresh world, after any history, in any order."""
    pairs = []
    for seed in range(10):
        states, actions = random_walk(seed)
        pairs += zip(states, actions, states[1:], strict=False)
    order = np.random.default_rng(0).permutation(len(pairs))
    world = FAIR.make_world(pairs[0][0])
    for i in order:
        state, action, after = pairs[i]
        world.reset(state)
        assert world.step(action).key == after.key
        assert FAIR.make_world(state).step(action).key == after.key


@pytest.mark.parametrize("together", [step, STEP_OF_MANY.compiled()])
def test_a_batch_steps_like_its_worlds_one_by_one(together):
    for seed in range(3, 8):  # in which blocks are pushed, grasped, carried and let go
        states, actions = random_walk(seed)
        layout, before = states[0].layout, np.stack([s.data for s in states[:-1]])
        batch = together(layout, before, np.stack(actions), GRASP_TOLERANCE)
        for row, after in zip(batch, states[1:], strict=True):
            assert row.tobytes() == after.key


def test_relations_of_many_states_have_the_bits_of_each():
    for seed in range(3):
        states, _ = random_walk(seed)
        together = RELATIONS_OF_MANY.compiled()(State.batch(states))
        for i, state in enumerate(states):
            for of_all, of_one in zip(together, relations_by_numpy(state), strict=True):
                assert of_all[i].tobytes() == of_one.tobytes()
        pairs = states[0].layout.of_type(BLOCK), states[0].layout.of_type(SURFACE)
        columns = [Column(objects) for objects in zip(*product(*pairs), strict=True)]
        margins = ON_MARGIN_OF_MANY.compiled()(0.01, State.batch(states), *columns)
        for i, state in enumerate(states):
            assert margins[i].tobytes() == on_margin_by_numpy(0.01, state, *columns).tobytes()


def test_a_push_moves_a_chain_up_to_the_wall():
    task = make_task((0.1, 0.0), 0.5, [0.4, 0.7])
    world = FAIR.make_world(task.initial_state)
    for _ in range(20):
        state = world.step(np.array([0.1, 0.0, 0.0]))
    first, second = state.layout.of_type(BLOCK)
    assert state.get(second, "x") == pytest.approx(1.0)
    assert state.get(first, "x") == pytest.approx(0.8)
    assert state.get(state.layout.object("robot"), "x") == pytest.approx(0.6)


def test_a_block_is_not_let_go_over_another():
    task = make_task((0.4, 0.2), 0.8, [0.4, 0.7])
    world = FAIR.make_world(task.initial_state)
    block = task.initial_state.layout.object("block1")
    world.step(np.array([0.0, 0.1, 1.0]))
    for _ in range(3):
        state = world.step(np.array([0.1, 0.1, 0.0]))
    assert state.get(block, "held") == 1.0
    assert world.step(np.array([0.0, 0.0, -1.0])).get(block, "held") == 1.0
    for _ in range(4):
        world.step(np.array([-0.1, 0.0, 0.0]))
    assert world.step(np.array([0.0, 0.0, -1.0])).get(block, "held") == 0.0


@pytest.mark.parametrize(
    ("action", "words"),
    [
        ([np.nan, 0, 0], "command x = nan m is not within"),
        ([0, 0.2, 0], "command y = 0.2 m is not within"),
        ([0, 0, -np.inf], "command gripper = -inf 1 is not within"),
        ([0, 0], "a command has 3 entries"),
    ],
)
def test_a_bad_command_moves_nothing(action, words):
    world = FAIR.make_world(FAIR.task(0).initial_state)
    before = world.state
    with pytest.raises(InvalidCommandError, match=words):
        world.step(np.array(action, dtype=float))
    assert world.state is before


def test_no_two_tasks_are_equal_and_seeds_are_streams_of_their_own():
    keys = {FAIR.task(seed, index).initial_state.key for seed in range(50) for index in range(10)}
    assert len(keys) == 500
    assert FAIR.task(3, 1).initial_state == FAIR.task(3, 1).initial_state


def test_paper_preset_has_the_three_start_states_of_the_reference():
    paper = get_domain("obstacle2d", "paper")
    obstacles = {
        float(task.initial_state.get(task.initial_state.layout.object("block2"), "x"))
        for task in (paper.task(seed) for seed in range(40))
    }
    assert obstacles == {0.4, 0.5, 0.6}


@pytest.mark.parametrize(("preset", "reach", "gap"), [("fair", 0.05, 0.02), ("paper", 0.02, 0.001)])
@pytest.mark.parametrize("past", [-1e-6, 1e-6])
def test_a_block_is_grasped_as_far_away_as_the_preset_says(preset, reach, gap, past):
    domain = get_domain("obstacle2d", preset)
    for sideways, above in [(reach + past, 0.0), (0.0, gap + past)]:
        task = make_task((0.8 + sideways, BLOCK_SIZE + above), 0.4, [0.8, 0.45])
        close = np.array([0.0, 0.0, 1.0])
        block = task.initial_state.layout.object("block1")
        grasped = past < 0.0
        alone = domain.make_world(task.initial_state).step(close)
        assert (alone.get(block, "held") > 0.5) == grasped
        (together,) = domain.make_vector_world([task.initial_state]).step(close[None]).data
        assert np.array_equal(together, alone.data)


@pytest.mark.parametrize(("preset", "tolerance"), [("fair", 0.01), ("paper", 1e-4)])
def test_a_block_is_in_the_target_area_as_exactly_as_the_preset_says(preset, tolerance):
    domain = get_domain("obstacle2d", preset)
    for off, inside in [(0.999 * tolerance, True), (1.001 * tolerance, False)]:
        state = make_task((0.5, 1.0), 0.4, [0.4 + off, 0.8]).initial_state
        space = domain.atom_space(state)
        held = {str(atom) for atom in space.decode(space.abstract(state))}
        assert ("On(block1, target)" in held) == inside


def test_every_task_starts_with_an_overlapped_target_and_room():
    counts = set()
    for seed in range(200):
        task = FAIR.task(seed)
        space = FAIR.atom_space(task.initial_state)
        held = {str(a) for a in space.decode(space.abstract(task.initial_state))}
        assert "Overlap(block2, target)" in held
        assert "Clear(target)" not in held
        assert "On(block1, table)" in held
        counts.add(len(task.initial_state.layout.of_type(BLOCK)))
    assert counts == {2, 3, 4}


def test_clear_and_overlap_exclude_each_other_everywhere():
    rng = np.random.default_rng(0)
    initial = FAIR.task(0).initial_state
    space = FAIR.atom_space(initial)
    data = np.repeat(initial.data[None], 5000, axis=0)
    columns = [initial.layout.column(b, "x") for b in initial.layout.of_type(BLOCK)]
    data[:, columns] = np.round(rng.uniform(0, 1, (5000, len(columns))), 2)
    truth = space.truth(State(initial.layout, data))
    number = {str(atom): i for i, atom in enumerate(space.atoms)}
    overlapped = np.zeros(5000, bool)
    for block in initial.layout.of_type(BLOCK):
        overlap = truth[:, number[f"Overlap({block}, target)"]]
        assert not (overlap & truth[:, number[f"On({block}, table)"]]).any()
        overlapped |= overlap
    assert (truth[:, number["Clear(target)"]] == ~overlapped).all()


def test_unknown_domain_and_preset():
    with pytest.raises(UnknownDomainError, match="unknown domain 'moon'; there are obstacle2d"):
        get_domain("moon")
    with pytest.raises(InvalidParameterError, match="unknown preset 'easy'"):
        get_domain("obstacle2d", "easy")


@pytest.mark.parametrize(
    ("blocks", "robot", "words"),
    [
        ([], (0.5, 1.0), "a block and a target area|at least one block"),
        ([0.4, 0.5], (0.5, 1.0), "block2 and block1 are inside one another"),
        ([0.4, 1.3], (0.5, 1.0), "within the unit square"),
        ([0.4], (0.5, -0.5), "within the unit square"),
    ],
)
def test_impossible_scenes_are_refused(blocks, robot, words):
    with pytest.raises(InvalidStateError, match=words):
        FAIR.make_world(make_task(robot, 0.8, blocks).initial_state)


def test_a_block_in_the_air_is_refused():
    state = make_task((0.5, 1.0), 0.8, [0.4]).initial_state
    block = state.layout.object("block1")
    with pytest.raises(InvalidStateError, match="neither held nor on the table"):
        FAIR.make_world(state.replace({(block, "y"): 0.5}))
