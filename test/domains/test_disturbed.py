# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds that differ from the planner's model: Markov all the same, and planned without secrets."""

import numpy as np
import pytest

from slap_ros.core import Learning
from slap_ros.domains import get_domain
from slap_ros.domains.disturbed import Disturbances
from slap_ros.domains.disturbed.generator import GENERATOR
from slap_ros.domains.obstacle_tower.features import BLOCK
from slap_ros.errors import InvalidCommandError, InvalidParameterError, InvalidStateError
from slap_ros.planning.model import Model
from slap_ros.planning.option_execution import OptionExecution
from slap_ros.planning.options import given_option
from slap_ros.relational import State
from slap_ros.robot.usable_domains import require_robot

FAIR = get_domain("obstacle_tower")
STOCHASTIC = get_domain("obstacle_tower", "stochastic")
PERTURBED = get_domain("obstacle_tower", "perturbed")
NOTHING = (
    "action_noise=0,drop_probability=0,size_variation=0,mass_variation=0,friction_variation=0,"
    "stacking_noise=0,stacking_turn_noise=0"
)
CALM = get_domain("obstacle_tower", f"stochastic:{NOTHING}")
ACTIONS = STOCHASTIC.action_space


def random_actions(count, seed=0):
    """Actions that throw the arm about, some of which grip or let go."""
    rng = np.random.default_rng(seed)
    low, high = np.array(ACTIONS.low), np.array(ACTIONS.high)
    return [rng.uniform(low, high) for _ in range(count)]


def generator_of(state):
    (generator,) = state.layout.of_type(GENERATOR)
    return generator


def seeded(state, seed):
    return state.replace({(generator_of(state), "seed"): seed})


def known(state):
    """What the planner may use of a state: not the generator, no masses, no friction."""
    hidden = [(generator_of(state), "seed"), (generator_of(state), "step")]
    hidden += [(b, name) for b in state.layout.of_type(BLOCK) for name in ("mass", "friction")]
    return state.replace(dict.fromkeys(hidden, 0.0)).key


def follow(world, actions):
    return [world.step(action) for action in actions]


@pytest.fixture(scope="module")
def with_block():
    """A state in which the hand holds a block above the table, reached without disturbances."""
    state = CALM.task(0).initial_state
    space, world = CALM.atom_space(state), CALM.make_world(state)
    names = ("robot", "block1", "table")
    option = given_option(CALM, "Pick", [state.layout.object(name) for name in names])
    holding = space.bit(space.atom("Holding", ("robot", "block1")))
    execution = OptionExecution(
        option, option.target(holding), space, CALM.action_space, world.state
    )
    while not space.abstract(world.state) & holding:
        world.step(execution.advance(world.state, space.abstract(world.state)))
    higher = world.state  # lifted by one more step
    action = execution.advance(higher, 0)
    return world.step(action if isinstance(action, np.ndarray) else CALM.action_space.hold)


# -- the world ------------------------------------------------------------------------------------


def test_same_state_and_action_same_next_state_to_the_bit():
    state, actions = PERTURBED.task(1).initial_state, random_actions(30)
    states = [state, *follow(PERTURBED.make_world(state), actions)]
    other = PERTURBED.make_world(PERTURBED.task(2).initial_state.over(state.layout, state))
    for before, action, after in reversed(list(zip(states, actions, states[1:], strict=False))):
        other.reset(before)
        assert other.step(action).key == after.key
    generator = generator_of(state)
    assert [float(one.get(generator, "step")) for one in states] == [float(i) for i in range(31)]


def test_the_seed_decides_what_happens():
    state, actions = STOCHASTIC.task(1).initial_state, random_actions(3)
    ends = {known(follow(STOCHASTIC.make_world(seeded(state, s)), actions)[-1]) for s in (1, 2, 3)}
    assert len(ends) == 3


def test_without_disturbances_tasks_and_states_are_those_of_the_world_that_has_none():
    for seed in (0, 1):
        calm, fair = CALM.task(seed).initial_state, FAIR.task(seed).initial_state
        assert calm.over(fair.layout) == fair
        actions = random_actions(15, seed)
        for ours, theirs in zip(
            follow(CALM.make_world(calm), actions),
            follow(FAIR.make_world(fair), actions),
            strict=True,
        ):
            assert ours.over(fair.layout) == theirs


def test_what_is_held_is_dropped_at_once_where_it_always_is(with_block):
    dropping = get_domain("obstacle_tower", f"stochastic:{NOTHING.replace('y=0', 'y=1', 1)}")
    assert dropping.configuration["drop_probability"] == "1.0"
    (block, *_) = with_block.layout.of_type(BLOCK)
    hold = ACTIONS.hold
    assert CALM.make_world(with_block).step(hold).get(block, "held") == 1.0
    world = dropping.make_world(with_block)
    after = world.step(hold)
    assert after.get(block, "held") == 0.0
    assert after.get(block, "z") < with_block.get(block, "z")
    # The next grasp lasts a step as well.
    assert world.step(hold).get(block, "held") == 0.0


def test_drops_do_not_keep_an_empty_hand_from_gripping():
    always = Disturbances(drop_probability=1.0)
    closes = ACTIONS.join(np.zeros(7), 1.0)
    random = np.random.default_rng(0)
    assert np.array_equal(always.disturbed(closes, ACTIONS, False, random), closes)
    assert always.disturbed(closes, ACTIONS, True, random)[-1] == ACTIONS.gripper.opens


def test_noise_is_as_large_as_it_says_and_stays_within_limits():
    noisy = Disturbances(action_noise=0.01)
    random, hold = np.random.default_rng(0), ACTIONS.hold
    still = np.array([noisy.disturbed(hold, ACTIONS, False, random) for _ in range(3000)])
    assert still[:, :7].std() == pytest.approx(0.01, rel=0.03)
    assert abs(still[:, :7].mean()) < 3e-4
    assert not still[:, 7].any()
    fast = np.array(ACTIONS.high)
    for _ in range(100):
        ACTIONS.check(noisy.disturbed(fast, ACTIONS, False, random))


def test_noise_does_not_depend_on_what_is_held():
    both = Disturbances(0.01, 1.0)
    free, full = (
        both.disturbed(ACTIONS.hold, ACTIONS, holds, np.random.default_rng(4))
        for holds in (False, True)
    )
    assert np.array_equal(free[:7], full[:7])


def test_a_command_beyond_its_limits_moves_nothing_and_draws_nothing():
    world = STOCHASTIC.make_world(STOCHASTIC.task(0).initial_state)
    before = world.state
    with pytest.raises(InvalidCommandError):
        world.step(2.0 * np.array(ACTIONS.high))
    assert world.state is before


@pytest.mark.parametrize("values", [{"seed": -1.0}, {"step": 0.5}, {"seed": 2.0**53}])
def test_a_generator_that_cannot_be_is_refused_and_the_world_stays(values):
    state = STOCHASTIC.task(0).initial_state
    world = STOCHASTIC.make_world(state)
    with pytest.raises(InvalidStateError, match="must be a whole number"):
        world.reset(state.replace({(generator_of(state), n): v for n, v in values.items()}))
    assert world.state is state


def test_a_state_without_generator_is_refused():
    with pytest.raises(InvalidStateError, match="one object of type generator"):
        STOCHASTIC.make_world(FAIR.task(0).initial_state)


def test_a_block_without_size_is_refused():
    state = STOCHASTIC.task(0).initial_state
    (block, *_) = state.layout.of_type(BLOCK)
    with pytest.raises(InvalidStateError, match="half edges"):
        STOCHASTIC.make_world(state.replace({(block, "half_x"): 0.0}))


# -- what differs from task to task ---------------------------------------------------------------


def test_blocks_differ_within_their_shares_and_each_from_the_others():
    found = {name: [] for name in ("half_x", "mass", "friction")}
    for seed in range(30):
        state = PERTURBED.task(seed).initial_state
        for block in state.layout.of_type(BLOCK):
            assert state.get(block, "half_x") == state.get(block, "half_z")
            for name, values in found.items():
                values.append(float(state.get(block, name)))
    for name, nominal, share in (
        ("half_x", 0.025, 0.1),
        ("mass", 0.5, 0.3),
        ("friction", 0.9, 0.3),
    ):
        values = np.array(found[name]) / nominal
        assert len(set(values)) == len(values)
        assert 1.0 - share <= values.min() < 1.0 - 0.8 * share
        assert 1.0 + 0.8 * share < values.max() <= 1.0 + share


def test_towers_stand_on_their_targets_and_stay():
    for seed in range(8):
        state = PERTURBED.task(seed).initial_state
        atoms = STOCHASTIC.atom_space(state)
        on = {str(a) for a in atoms.decode(atoms.abstract(state)) if str(a).startswith("On(")}
        fair = FAIR.task(seed).initial_state
        usual = FAIR.atom_space(fair)
        wanted = usual.decode(usual.abstract(fair))
        assert on == {str(atom) for atom in wanted if str(atom).startswith("On(")}
        after = follow(CALM.make_world(state), [ACTIONS.hold] * 8)[-1]
        for block in state.layout.of_type(BLOCK):
            assert np.allclose(after[block][:7], state[block][:7], atol=0.01), (seed, block)


def test_a_world_has_blocks_of_the_sizes_that_a_state_has():
    first, other = (STOCHASTIC.task(seed).initial_state for seed in (4, 5))
    other = other.over(first.layout, first)  # as many things
    actions = random_actions(6)
    world = STOCHASTIC.make_world(first)
    follow(world, actions)
    world.reset(other)
    again = [one.key for one in follow(world, actions)]
    assert again == [one.key for one in follow(STOCHASTIC.make_world(other), actions)]


def test_a_tower_that_can_hardly_stand_is_refused():
    hopeless = get_domain("obstacle_tower", "stochastic:stacking_noise=0.05,obstacles=20")
    with pytest.raises(InvalidParameterError, match="hardly any tower"):
        hopeless.task(0)


# -- the planner's model --------------------------------------------------------------------------


def rolled_out(domain, state, actions):
    world = domain.model_world(state)
    return [known(one) for one in follow(world, actions)]


def test_planners_know_neither_noise_nor_drops_nor_materials(with_block):
    actions = random_actions(25, seed=7)
    blocks = with_block.layout.of_type(BLOCK)
    heavy = with_block.replace(
        {(b, "mass"): 5.0 for b in blocks} | {(b, "friction"): 0.1 for b in blocks}
    )
    expected = [known(one) for one in follow(CALM.make_world(with_block), actions)]
    for state in (with_block, heavy, seeded(with_block, 99)):
        assert rolled_out(PERTURBED, state, actions) == expected
    assert [known(one) for one in follow(PERTURBED.make_world(with_block), actions)] != expected


def test_what_a_model_predicts_goes_on_in_the_world_as_what_it_was(with_block):
    state = with_block.replace({(b, "mass"): 0.6 for b in with_block.layout.of_type(BLOCK)})
    after = follow(PERTURBED.model_world(state), random_actions(3))[-1]
    generator = generator_of(state)
    assert {float(after.get(b, "mass")) for b in state.layout.of_type(BLOCK)} == {0.6}
    assert after.get(generator, "seed") == state.get(generator, "seed")
    assert after.get(generator, "step") == state.get(generator, "step") + 3


def test_planners_see_sizes():
    first = STOCHASTIC.task(4).initial_state
    model = STOCHASTIC.model_world(first)
    tower = max(first.layout.of_type(BLOCK), key=lambda block: float(first.get(block, "z")))
    after = follow(model, [ACTIONS.hold] * 3)[-1]
    assert after.get(tower, "z") == pytest.approx(float(first.get(tower, "z")), abs=1e-3)


def test_what_planners_roll_out_in_is_their_model():
    state = PERTURBED.task(0).initial_state
    assert type(Model.of(PERTURBED, state)._world) is type(PERTURBED.model_world(state))
    assert type(PERTURBED.model_worlds([state])._worlds[0]) is type(PERTURBED.model_world(state))
    assert type(FAIR.model_world(FAIR.task(0).initial_state)) is type(
        FAIR.make_world(FAIR.task(0).initial_state)
    )


def test_a_model_needs_no_generator():
    """What is perceived of a world, or hidden, may lack it."""
    fair = FAIR.task(0).initial_state
    actions = random_actions(3)
    ours = follow(STOCHASTIC.model_world(fair), actions)
    assert [one.key for one in ours] == [one.key for one in follow(FAIR.make_world(fair), actions)]


def test_robots_have_no_such_world():
    state = STOCHASTIC.task(0).initial_state
    with pytest.raises(InvalidParameterError, match="preset stochastic has disturbances"):
        require_robot(STOCHASTIC, state)
    require_robot(FAIR, FAIR.task(0).initial_state)


def test_shortcuts_are_trained_in_the_disturbed_world():
    assert isinstance(PERTURBED.learning, Learning)
    state = PERTURBED.task(0).initial_state
    together = PERTURBED.make_vector_world([state, state])
    action = random_actions(1)[0]
    alone = PERTURBED.make_world(state).step(action)
    stepped = together.step(np.stack([action, action]))
    assert State(state.layout, stepped.data[0]).key == alone.key
