# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Exploration that comes near objects, and that sees what operators never lead to."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from slap_ros.core import SyncVectorWorld
from slap_ros.domains import get_domain
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.model import Model
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import Vertex
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import Column, State
from slap_ros.shortcuts import way_on
from slap_ros.shortcuts.exploration_policies import PUSH, PushAim
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.rollout_origins import OptionRetracer
from slap_ros.shortcuts.shortcut_candidate import ShortcutCandidate
from slap_ros.shortcuts.shortcut_vec_env import ShortcutVecEnv
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.starts import find_start, restore_starts
from slap_ros.shortcuts.way_on import NO_WAY, WayOn
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.scripted_skill import ScriptedSkill

SEED = 1_000_000  # of tasks for training
GOAL = 1  # a mask
FEW = ExplorationSettings(rollouts=4, length=30, nodes=1)
NEAR = replace(FEW, pushes=1, beyond=True)


@pytest.fixture(scope="module")
def blocked():
    """The target is blocked. Picking and placing were learned, unstacking is a script."""
    domain = open_domain(DomainChoice("stack_at_target", "fair:blocked=1"))
    script = ScriptedSkill("Unstack", domain.acquisition.scripts["Unstack"])
    return replace(
        domain,
        operators=(*domain.operators, *domain.unskilled),
        unskilled=(),
        skills={**domain.skills, "Unstack": script},
    )


def explore(domain, settings):
    explorer = Explorer.of_task(domain, SEED, 0, settings, np.random.default_rng(0))
    return explorer.explore().candidates


@pytest.fixture(scope="module")
def found(blocked):
    return explore(blocked, NEAR)


def pushed_aside(candidates):
    """Those in which a cube is pushed off its target: no operator puts a cube on the table."""
    return [c for c in candidates if ("OnTable", (0,)) in c.signature.add]


@pytest.mark.slow
def test_no_operator_leads_where_a_push_does_so_the_graph_alone_finds_nothing(blocked, found):
    assert not explore(blocked, replace(NEAR, beyond=False))
    candidates = pushed_aside(found)
    assert candidates
    for candidate in candidates:
        assert candidate.beyond and PUSH in candidate.found_by
        assert 0 < candidate.expected_saving < candidate.plan_steps


def test_a_training_starts_where_a_shortcut_leads_beyond_what_operators_reach(blocked, found):
    signature = pushed_aside(found)[0].signature
    steps = dict.fromkeys(blocked.skills, 20.0)
    assert find_start(blocked, SEED, 10_000, signature, (), steps) is None
    start = find_start(blocked, SEED, 10_000, signature, (), steps, beyond=True)
    space = blocked.atom_space(blocked.task(SEED, 10_000).initial_state)
    assert "OnTable(cube2)" in map(str, space.decode(start.add))
    assert "On(cube2, target0)" in map(str, space.decode(start.delete))


def test_what_found_a_candidate_is_in_its_record_and_old_records_are_read(found):
    for candidate in found:
        assert ShortcutCandidate.from_json(candidate.as_json()) == candidate
    plain = replace(found[0], beyond=False, found_by=("random actions",))
    assert not {"beyond", "found_by"} & plain.as_json().keys()
    assert ShortcutCandidate.from_json(plain.as_json()) == plain


def test_settings_of_old_trainings_are_written_as_they_were():
    assert list(ExplorationSettings().as_json()) == [
        "tasks", "rollouts", "length", "hits", "hold", "nodes",
    ]  # fmt: skip
    near = replace(NEAR, inside=8, also_repeat=4)
    assert ExplorationSettings.from_json(near.as_json()) == near


@pytest.mark.parametrize("name", ["stack_at_target", "cluttered_drawer", "obstacle2d"])
def test_a_push_goes_towards_each_object_whatever_the_robots_axes_are(name):
    domain = get_domain(name)
    state = domain.task(0).initial_state
    worlds = SyncVectorWorld(domain.make_world, [state] * 2)
    interface, rng = learner_interface(domain), np.random.default_rng(0)
    objects = [obj for obj in state.layout.objects if obj.type not in domain.robot_types]

    def distances(states):
        hand = interface.hand(states)
        each = [interface.distance(states, hand, Column((obj,)))[0, 0] for obj in objects]
        return np.array([distance for distance in each if np.isfinite(distance)])

    pushes = list(PushAim(domain, worlds, 2, rng).pushes(state))
    before = distances(state.alone())
    assert len(pushes) == len(before)
    for number, push in enumerate(pushes):
        for world in range(2):
            worlds.reset(world, state)
        for step in range(2):
            states = worlds.step(push.actions(step))
        assert distances(State(states.layout, states.data[:1]))[number] < before[number]
        assert (push.actions(0)[0] != push.actions(0)[1]).any()  # the second one is tilted


def test_rollouts_begin_along_the_way_of_an_option_in_the_states_that_it_passes(blocked):
    state = blocked.task(SEED, 0).initial_state
    problem = Problem.of(blocked, state)
    space, abstract = problem.model.space, problem.model.space.abstract(state)
    ground, option = next(o for o in problem.operators if str(o[1]) == "Pick(cube0)")
    target = option.target(ground.apply(abstract))
    rollout = Model.of(blocked, state).roll_out(option, state, target)
    vertex = Vertex(1, rollout.final, rollout.steps, Vertex(0, state, 0), Edge(0, 1, option))
    retracer = OptionRetracer(blocked.make_world(state), space, blocked.action_space)
    origins = list(retracer.inside(vertex, target, 8))
    assert [origin.steps for origin in origins] == list(range(8, rollout.steps, 8))
    world, policy = blocked.make_world(state), option.skill.start(state, option.objects)
    for step in range(1, origins[-1].steps + 1):
        state = world.step(policy(state))
        if step % 8 == 0:
            assert origins[step // 8 - 1].state.key == state.key


def test_a_thing_in_a_hand_that_moves_is_at_rest_and_one_that_is_pushed_is_not(blocked):
    state = blocked.task(SEED, 0).initial_state
    things = {obj.name: obj for obj in state.layout.objects}
    at_rest = learner_interface(blocked).at_rest
    moving = state.replace({(things["cube0"], "vx"): 0.3})
    assert at_rest(state.alone()) and not at_rest(moving.alone())
    assert at_rest(moving.replace({(things["cube0"], "held"): 1.0}).alone())
    assert not at_rest(moving.replace({(things["cube1"], "held"): 1.0}).alone())


def test_the_way_on_is_executed_and_there_is_none_where_operators_lead_nowhere(blocked):
    task = blocked.task(SEED, 0)
    state, problem = task.initial_state, Problem.of(blocked, task.initial_state)
    space, steps = problem.model.space, dict.fromkeys(blocked.skills, 20.0)
    way = WayOn(problem, space.mask(task.goal))
    start = space.abstract(state)
    measured = way.measure(state, start, steps)
    plan = GraphPlanner(problem).plan(state, space.mask(task.goal)).plan
    assert plan.predicted_steps <= measured == way.steps < NO_WAY
    assert way.measure(state, 0, steps) == NO_WAY  # nothing holds, so no operator applies
    # Where the skill that comes next fails, there is no way: here its cube is out of reach.
    cube = state.layout.object("cube2")
    elsewhere = state.replace({(cube, "x"): 1.1, (cube, "z"): 0.02})
    assert way.measure(elsewhere, start, steps) == NO_WAY
    # Nor where two cubes are inside one another, as after a push that was too strong.
    other = state.layout.object("cube0")
    inside = state.replace({(cube, axis): float(state.get(other, axis)) for axis in "xyz"})
    assert way.measure(inside, start, steps) == NO_WAY


@pytest.mark.parametrize(("steps", "taken"), [(5.0, "known"), (9.0, "rare")])
def test_an_operator_that_was_never_executed_looks_as_cheap_as_the_others(
    monkeypatch, steps, taken
):
    """Two operators lead to the goal; the mean of all that were executed is 7 steps."""
    skills = (SimpleNamespace(name=name, step_limit=20) for name in ("known", "rare"))
    options = (SimpleNamespace(skill=skill, target=lambda node: node) for skill in skills)
    graph = AbstractGraph(GOAL, [0, GOAL], [0, 1], [Edge(0, 1, option) for option in options])
    monkeypatch.setattr(way_on, "build_abstract_graph", lambda *_, **__: graph)
    begun = []

    def roll_out(option, state, target):
        begun.append(option.skill.name)
        return SimpleNamespace(steps=3, reached=True, final=state)

    problem = SimpleNamespace(model=SimpleNamespace(roll_out=roll_out), operators=())
    costs = {"known": steps, "elsewhere": 14.0 - steps}
    assert WayOn(problem, GOAL).measure(None, 0, costs) == 3.0
    assert begun == [taken]


def test_more_atoms_may_hold_where_a_shortcut_over_acquired_skills_ends(blocked):
    """As where an operator's skill ends, and not where given skills say exactly what changes."""
    state = blocked.task(SEED, 0).initial_state
    space = blocked.atom_space(state)
    atoms = {str(atom): space.mask([atom]) for atom in space.atoms}
    change = Change(atoms["IsClear(target0)"], atoms["On(cube2, target0)"])
    cube = state.layout.object("cube2")
    aside = state.replace({(cube, "x"): 0.3, (cube, "y"): 0.3, (cube, "z"): 0.02}).alone()
    target = change.apply(space.abstract(state))
    assert space.abstract_each(aside)[0] == target | atoms["OnTable(cube2)"]
    for exact in (False, True):
        domain = replace(blocked, exact=exact)
        encoder = ObservationEncoder(domain, space, Signature.of(change, space), change)
        assert encoder.success(aside, encoder.encode(aside), [target]).tolist() == [not exact]


@pytest.mark.parametrize(("path", "context"), [((), ()), (("Pick",), ("Holding",))])
def test_pushes_succeed_where_a_policy_is_to_learn_them_and_standing_still_does_not(
    blocked, path, context
):
    """With the hand empty, and with a cube in it that moves all the while."""
    space = blocked.atom_space(blocked.task(SEED, 0).initial_state)
    atoms = {str(atom): space.mask([atom]) for atom in space.atoms}
    change = Change(atoms["IsClear(target0)"], atoms["On(cube2, target0)"])
    signature = Signature.of(change, space, frozenset(context))
    steps = dict.fromkeys(blocked.skills, 20.0)
    record = find_start(blocked, SEED, 10_001, signature, path, steps, beyond=True)
    starts = restore_starts(blocked, [record])
    rng, count = np.random.default_rng(0), 4
    worlds = SyncVectorWorld(blocked.make_world, [starts[0].state] * count)
    limits = np.array(blocked.action_space.high)

    def succeeded(actions):
        env = ShortcutVecEnv(blocked, signature, starts, count, 30, Rewards(), rng)
        return any(env.step(actions).success.any() for _ in range(29))

    pushes = PushAim(blocked, worlds, count, rng).pushes(starts[0].state)
    tried = [(push.directions / limits)[:, : env_axes(blocked)] for push in pushes]
    assert any(succeeded(actions) for actions in tried)
    assert not succeeded(np.zeros_like(tried[0]))


def env_axes(domain):
    """The number of axes of a policy that leaves the gripper alone, which is the last one."""
    return len(domain.action_space.displacement_indices)
