# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a policy wants: planning is never the worse for it."""

from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.evaluation.approaches import PURE_PLANNING, Approach
from slap_ros.evaluation.experiment import Experiment
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.problem import Problem
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.shortcut_rollouts import MAX_NET_FAILURES
from slap_ros.shortcuts.signature import Change, Signature, context_of
from support.marks import slow

DATA = Path(__file__).parent / "data" / "obstacle2d"
HASTY = Sampling(samples=3, patience=2, horizon=15)


def always(domain, space, signature, change, initial, value):
    """A shortcut whose policy gives the same number for every axis, whatever it sees."""
    encoder = ObservationEncoder(domain, space, signature, change)
    seen = encoder.encode(initial.alone()).observations.shape[1]
    axes = encoder.action_map.size
    zeros, ones = np.zeros(seen, np.float32), np.ones(seen, np.float32)
    layer = np.zeros((axes, seen), np.float32), np.full(axes, value, np.float32)
    quiet = np.full(axes, -30.0, np.float32)
    return Shortcut(
        signature, MlpPolicy(ObservationNormalisation(zeros, ones), (layer,), quiet), shortest=1
    )


def hostile(domain, seed, value, count):
    """Shortcuts for the first ``count`` different changes of a task's graph."""
    task = domain.task(seed)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    graph = build_abstract_graph(start, goal, problem.operators)
    changes = {}
    for i, j in graph.candidates():
        change = Change.between(graph.nodes[i], graph.nodes[j])
        context = context_of(graph.nodes[i], domain.learning.interface.grasping, space)
        changes.setdefault(Signature.of(change, space, context), change)
        if len(changes) == count:
            break
    return tuple(
        always(domain, space, signature, change, task.initial_state, value)
        for signature, change in changes.items()
    )


def plan(domain, seed, approach, planner="lazy"):
    task = domain.task(seed)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    return approach.planner(planner, domain, task.initial_state).plan(task.initial_state, goal)


def as_told(result):
    return [(str(edge), edge.target, edge.predicted_steps) for edge in result.plan.edges]


@pytest.mark.parametrize("value", [float("nan"), 0.0], ids=["nan", "nothing"])
@pytest.mark.parametrize("seed", range(3))
def test_what_never_succeeds_changes_nothing(value, seed):
    domain = get_domain("obstacle2d")
    approach = Approach("hostile", hostile(domain, seed, value, count=4), HASTY)
    pure, with_it = plan(domain, seed, PURE_PLANNING), plan(domain, seed, approach)
    assert with_it.edges_rolled_out > pure.edges_rolled_out  # they were tried
    assert as_told(with_it) == as_told(pure)
    experiment = Experiment(domain, tasks=1, seeds=1)
    ours, theirs = experiment.run(seed, 0, PURE_PLANNING), experiment.run(seed, 0, approach)
    assert theirs.success
    assert theirs.shortcut_steps == 0
    assert np.array_equal(theirs.actions, ours.actions)


@pytest.mark.parametrize("seed", range(3))
def test_what_was_given_up_does_not_mislead_the_search(seed):
    """Bounds of edges that were given up are forgotten, with all that hoped for them."""
    domain = get_domain("obstacle2d")
    shortcuts = hostile(domain, seed, 0.0, count=4)
    pure = plan(domain, seed, PURE_PLANNING)
    with_it = plan(domain, seed, Approach("hostile", shortcuts, HASTY))
    assert with_it.edges_rolled_out <= pure.edges_rolled_out + 4 * (
        MAX_NET_FAILURES + len(shortcuts)
    )


@pytest.mark.parametrize("value", [1.0, -1.0])
@pytest.mark.parametrize("seed", range(3))
def test_all_the_might_is_never_longer(value, seed):
    domain = get_domain("obstacle2d")
    approach = Approach("hostile", hostile(domain, seed, value, count=6), HASTY)
    experiment = Experiment(domain, tasks=1, seeds=1)
    ours, theirs = experiment.run(seed, 0, PURE_PLANNING), experiment.run(seed, 0, approach)
    assert theirs.success
    assert theirs.plan_length <= ours.plan_length


@pytest.mark.slow
def test_a_tower_is_taken_apart_all_the_same():
    domain, seed = get_domain("obstacle_tower", "paper"), 0
    brief = Sampling(samples=1, horizon=6)
    pure = plan(domain, seed, PURE_PLANNING)
    for value in (float("nan"), 0.0, 1.0):
        approach = Approach("hostile", hostile(domain, seed, value, count=6), brief)
        with_it = plan(domain, seed, approach)
        assert with_it.edges_rolled_out > pure.edges_rolled_out
        assert with_it.plan.predicted_steps <= pure.plan.predicted_steps
        if value != 1.0:
            assert as_told(with_it) == as_told(pure)
    episode = Experiment(domain, tasks=1, seeds=1).run(seed, 0, approach)
    assert episode.success
    assert episode.plan_length <= pure.plan.predicted_steps


@pytest.mark.parametrize("seed", [0, *slow(1, 2, 3, 4, 5)])
def test_lazy_and_exhaustive_search_agree_with_shortcuts_there(seed):
    domain = get_domain("obstacle2d")
    learned = load_library(DATA, domain).shortcuts
    learned += tuple(s for s in hostile(domain, seed, 1.0, count=3) if s.name != learned[0].name)
    approach = Approach("both", learned, HASTY)
    lazy = plan(domain, seed, approach)
    exhaustive = plan(domain, seed, approach, planner="exhaustive")
    assert lazy.plan.predicted_steps == exhaustive.plan.predicted_steps
    assert lazy.edges_rolled_out <= exhaustive.edges_rolled_out
