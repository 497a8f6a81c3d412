# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""KinDER's object-centric environments as worlds, with KinDER itself, where it is installed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "kinder_obstruction"
pytest.importorskip("kinder", reason="KinDER is not installed: see docs/new-domain.md")

import kinder_obstruction  # noqa: E402
from kinder_obstruction.environment import BRIDGE, make_environment  # noqa: E402

from slap_ros.core.kinder_world import KinderBridge  # noqa: E402
from slap_ros.domain_check import Experience, markov  # noqa: E402
from slap_ros.domain_check.experience import Transition  # noqa: E402
from slap_ros.errors import InvalidDomainError, InvalidStateError  # noqa: E402
from slap_ros.evaluation.approaches import PURE_PLANNING, approaches  # noqa: E402
from slap_ros.evaluation.experiment import solve  # noqa: E402
from slap_ros.relational import Feature  # noqa: E402
from slap_ros.shortcuts.sampling import Sampling  # noqa: E402
from slap_ros.shortcuts.shortcut_library import load_library  # noqa: E402

DOMAIN = kinder_obstruction.make()
TASK = DOMAIN.task(7)  # evaluation begins at seed 0
REST = np.zeros(5)
pytestmark = pytest.mark.filterwarnings("ignore:Resetting dynamic2d")  # KinDER's own


@pytest.fixture(scope="module")
def episode():
    """Both blocks are taken and put down: free motion, contacts, grasps, releases."""
    return solve(DOMAIN, TASK, PURE_PLANNING)


@pytest.fixture(scope="module")
def experience(episode):
    steps = zip(episode.states, episode.actions, episode.states[1:], strict=False)
    return Experience(tuple(Transition(*step) for step in list(steps)[::2]))


class RunsOn:
    """The same environment without being rebuilt: what a bridge alone would give."""

    def __init__(self, state):
        self.reset(state)

    def reset(self, state):
        self.state, self._simulator = state, BRIDGE.simulator(state)

    def step(self, action):
        self.state = self._simulator.step(action)
        return self.state


def test_types_are_kinders_with_units_and_roles_below_them():
    types = {t.name: t for t in DOMAIN.types}
    assert types["target_block"].parent is types["dyn_rectangle"] is types["obstruction"].parent
    assert types["dyn_rectangle"].parent is types["dynamic2d"]
    assert types["kin_robot"].parent is None  # its features are not those of KinDER's parent
    units = {f.name: f.unit for f in types["kin_robot"].features}
    assert units["omega_gripper_l"] == "rad/s"
    assert units["finger_gap"] == "m"
    assert units["static"] == "1"


def test_states_go_there_and_back_to_the_bit(episode):
    for state in episode.states[::10]:
        assert BRIDGE.state_of(BRIDGE.kinder_state(state)).key == state.key


def test_table_and_walls_are_there_after_a_reset_to_a_state():
    """KinDER makes them at the first sampled reset only; without them everything falls."""
    after = DOMAIN.make_world(TASK.initial_state).step(REST)
    for block in after.layout.of_type(kinder_obstruction.model.BLOCK):
        assert after.get(block, "y") == pytest.approx(TASK.initial_state.get(block, "y"), abs=1e-3)


def test_planning_solves_a_task_and_kinder_agrees_that_it_is_solved(episode):
    assert episode.success
    assert episode.replans == 0
    kinder = make_environment()
    (goal,) = TASK.goal
    for state in (*episode.states[::20], *episode.states[-2:]):
        kinder.reset(options={"init_state": BRIDGE.kinder_state(state)})
        *_, terminated, _, _ = kinder.step(REST)
        assert not goal.holds(state) or terminated
    assert goal.holds(episode.states[-1])


def test_every_step_of_a_plan_comes_out_the_same_from_a_reset(experience):
    found = markov.repeat(DOMAIN, experience, np.random.default_rng(0))
    assert found.status == "ok", found.found


def test_without_rebuilding_hardly_any_step_does(experience):
    """What the engine keeps from step to step is not in KinDER's state."""
    world, transitions = RunsOn(TASK.initial_state), []
    for action in [transition.action for transition in experience.transitions][:30]:
        state = world.state
        transitions.append(Transition(state, action, world.step(action)))
    domain = replace(DOMAIN, make_world=RunsOn)
    found = markov.repeat(domain, Experience(tuple(transitions)), np.random.default_rng(0))
    assert found.status == "problem", found.found


def test_actions_at_the_limits_are_accepted_with_their_rounding():
    limits = np.array(DOMAIN.action_space.high) + 5e-10
    DOMAIN.make_world(TASK.initial_state).step(limits)


def test_what_does_not_fit_is_refused():
    two = KinderBridge(lambda: type(make_environment())(num_obstructions=2))
    with pytest.raises(InvalidStateError, match="obstruction1"):
        two.simulator(TASK.initial_state)
    with pytest.raises(InvalidDomainError, match="obstruction1"):
        BRIDGE.state_of(two.kinder_state(two.sample(1)))
    with pytest.raises(InvalidDomainError, match="no type 'gear'"):
        BRIDGE.type("gear")
    with pytest.raises(InvalidDomainError, match="1 axes are named; there are 5"):
        BRIDGE.action_space([Feature("x", "m")])


def test_the_shortcut_of_the_example_makes_a_plan_shorter():
    library = load_library(EXAMPLE / "models", DOMAIN)
    task = next(task for task in map(DOMAIN.task, range(7, 50)) if obstruction_comes_first(task))
    space = DOMAIN.atom_space(task.initial_state)
    pure, *_, slap = (
        approach.planner("lazy", DOMAIN, task.initial_state)
        .plan(task.initial_state, space.mask(task.goal))
        .plan.predicted_steps
        for approach in approaches(library, Sampling(samples=4))
    )
    assert slap < 0.85 * pure


def obstruction_comes_first(task):
    """It is in the way, and the target is far behind it."""
    state, objects = task.initial_state, task.initial_state.layout.object
    obstruction, surface = objects("obstruction0"), objects("target_surface")
    first, second = (state.get(o, "x") for o in (obstruction, objects("target_block")))
    blocked = not kinder_obstruction.model.CLEAR(obstruction, surface).holds(state)
    return blocked and state.get(objects("robot"), "x") < first < second - 0.8  # m
