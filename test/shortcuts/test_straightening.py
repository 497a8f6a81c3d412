# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executions of skills that are made shorter, and shortcuts that are cloned from them."""

from dataclasses import replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.workers import SequentialWorkers, local_workers
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.problem import Problem
from slap_ros.policies.action_map import ActionMap
from slap_ros.shortcuts.demonstrations import ShortcutDemonstration, demonstrate, demonstrated
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.named_settings import CHAINS, training_settings
from slap_ros.shortcuts.shortcut_actions import uses_gripper
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.signature_matcher import SignatureMatcher
from slap_ros.shortcuts.starts import find_start
from slap_ros.shortcuts.straightened_chains import StraightenedChains
from slap_ros.shortcuts.straightening import SETTLING, STRAIGHTENED, ChainExecutor, straight
from slap_ros.shortcuts.training import Training
from slap_ros.skills.domain_choice import DomainChoice, open_domain

SEED, TASK = 1_000_000, 10_000  # of a task for training
FEW = ExplorationSettings(tasks=1, rollouts=1, length=1, nodes=3, straightened=20)


@pytest.fixture(scope="module")
def pegs():
    return open_domain(DomainChoice("peg_in_hole", "fair", "models/skills/peg_in_hole"))


@pytest.fixture(scope="module")
def candidate(pegs):
    explorer = Explorer.of_task(pegs, SEED, 0, FEW, np.random.default_rng(0))
    found, *_ = explorer.explore().candidates
    return found


@pytest.fixture(scope="module")
def start(pegs, candidate):
    return find_start(
        pegs, SEED, TASK, candidate.signature, candidate.operator_path, {"Pick": 25, "Insert": 30}
    )


def test_a_straight_motion_gets_as_far_at_full_speed():
    out_and_back = np.array([[0.9, 0.0, -1.0]] * 4 + [[-0.4, 0.5, 1.0]] * 4)
    motion = straight(out_and_back, axes=[0, 1])
    assert motion.shape == (2, 3)
    assert motion[:, :2].sum(axis=0) == pytest.approx([2.0, 2.0])
    assert np.abs(motion).max() <= 1.0
    assert motion[:, 2].tolist() == [-1.0, 1.0]  # the gripper closes on the way, as it did
    assert straight(motion, axes=[0, 1]) is None  # nothing is faster


def test_actions_are_found_again_from_the_robots(pegs):
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 5))
    to_robot = ActionMap(pegs, gripper=True)
    assert to_robot.inverse(to_robot(actions)) == pytest.approx(actions)


def test_what_takes_two_contacts_is_found_where_two_skills_show_it(candidate):
    assert candidate.found_by == (STRAIGHTENED,)
    added = {predicate for predicate, _ in candidate.signature.add}
    assert added == {"In", "Holding"}  # one peg is in its hole, and the other one in the hand
    assert candidate.steps > 0
    assert 0 < candidate.expected_saving < candidate.plan_steps


def test_without_rounds_nothing_is_straightened(pegs):
    none = replace(FEW, straightened=0)
    explorer = Explorer.of_task(pegs, SEED, 0, none, np.random.default_rng(0))
    assert not explorer.explore().candidates
    assert "straightened" not in none.as_json()


def test_a_budget_is_kept(pegs):
    explorer = Explorer.of_task(pegs, SEED, 0, replace(FEW, budget=1_000), np.random.default_rng(0))
    result = explorer.explore()
    assert not result.candidates
    assert result.environment_steps <= 1_000


def test_a_demonstration_is_shorter_than_the_skills_and_ends_in_the_target(pegs, candidate, start):
    def show():
        return demonstrate(pegs, start, candidate.signature, 60, np.random.default_rng(1)).shown

    shown = show()
    assert len(shown.actions) < 0.9 * shown.replaced
    assert shown == show()
    assert ShortcutDemonstration.from_json(shown.as_json()) == shown
    learned_from = demonstrated(pegs, candidate.signature, [shown])  # the model made it again
    # Both pegs could have the other one's name.
    assert len(learned_from.observations) == len(learned_from.actions) == 2 * len(shown.actions)
    first, second = np.split(learned_from.observations, 2)
    assert not np.array_equal(first, second)
    assert np.array_equal(np.sort(first, axis=1), np.sort(second, axis=1))
    assert learned_from.shortest == len(shown.actions)


@pytest.fixture(scope="module")
def graphed(pegs):
    """A task with pegs, its problem, and its graph."""
    task = pegs.task(SEED, 0)
    problem = Problem.of(pegs, task.initial_state)
    space = problem.model.space
    goal = space.mask(task.goal)
    graph = build_abstract_graph(space.abstract(task.initial_state), goal, problem.operators)
    return task, problem, graph


def test_a_shortcut_without_gripper_is_not_shown_by_skills_that_need_it(pegs, graphed):
    task, problem, graph = graphed
    chains = StraightenedChains(pegs, problem, graph)
    pairs = list(chains.leading_from(0))  # Pick, then Insert: afterwards the hand is empty again
    assert pairs
    rng = np.random.default_rng(0)
    assert all(chains.straighten(task.initial_state, 0, pair, 1, rng) is None for pair in pairs)


def test_a_shortcut_that_takes_and_releases_on_the_way_has_the_gripper(pegs, graphed):
    task, problem, graph = graphed
    chains = StraightenedChains(pegs, problem, graph, regrasps=True)
    pair = next(chains.leading_from(0))  # Pick, then Insert
    signature = chains.signature(0, pair)
    assert signature.regrasps
    assert uses_gripper(pegs, signature)
    assert not uses_gripper(pegs, replace(signature, regrasps=False))
    assert Signature.from_json(signature.as_json()) == signature
    assert signature.name != replace(signature, regrasps=False).name
    found = chains.straighten(task.initial_state, 0, pair, 5, np.random.default_rng(0))
    assert (
        problem.model.space.abstract(found.states[-1]) & graph.goal
    )  # one peg is in its hole, and the hand is empty


@pytest.fixture(scope="module")
def stowing():
    """A task with two hammers and two drawers, after Open and Pick."""
    hammers = open_domain(DomainChoice("stow_hammer", "fair", "models/skills/stow_hammer"))
    task = hammers.task(SEED, 0)
    problem = Problem.of(hammers, task.initial_state)
    space = problem.model.space
    graph = build_abstract_graph(
        space.abstract(task.initial_state), space.mask(task.goal), problem.operators
    )
    plan = GraphPlanner(problem).plan(task.initial_state, graph.goal).plan
    state, node, forward = task.initial_state, 0, graph.forward_edges()
    edges = []
    for planned in plan.edges[:4]:
        edges.append(next(e for e in forward[node] if str(e.option) == str(planned.option)))
        node = edges[-1].target
    for edge in edges[:2]:
        target = edge.option.target(graph.nodes[edge.target])
        state = problem.model.roll_out(edge.option, state, target).final
    chains = StraightenedChains(hammers, problem, graph)
    return hammers, space, graph, chains, state, edges


def test_an_execution_that_ends_in_motion_goes_on_until_nothing_moves(stowing):
    hammers, space, graph, chains, state, (_, pick, place, close) = stowing
    assert (place.option.skill.name, close.option.skill.name) == ("Place", "Close")
    executor = ChainExecutor(hammers, space, state)
    commands = executor.commands(state, (place, close), graph.nodes)
    world = hammers.model_world(state)
    for command in commands:
        last = world.step(command)
    at_rest = hammers.learning.interface.at_rest
    assert not at_rest(last.alone())[0]  # the drawer with the hammer still slides
    found = chains.straighten(state, pick.target, (place, close), 0, np.random.default_rng(0))
    assert len(commands) < found.steps <= len(commands) + SETTLING
    assert not found.actions[len(commands) :].any()
    assert at_rest(found.states[-1].alone())[0]


def test_what_skills_show_with_one_object_is_not_asked_for_with_all_at_once(stowing):
    hammers, space, graph, chains, _, (opening, pick, place, close) = stowing
    signature = chains.signature(pick.target, (place, close))
    assert signature.counted
    assert Signature.from_json(signature.as_json()) == signature
    at_large = replace(signature, counted=False)
    assert at_large.name != signature.name
    grasping = hammers.learning.interface.grasping

    def targets(sought):
        return SignatureMatcher(sought, space, grasping).targets(graph.nodes, pick.target)

    assert close.target in targets(signature)
    assert close.target not in targets(at_large)  # only both hammers in both drawers
    both = Change.between(graph.nodes[pick.target], graph.nodes[targets(at_large)[0]])
    assert at_large.matches(both, graph.nodes[pick.target], space)
    assert not signature.matches(both, graph.nodes[pick.target], space)
    one = chains.signature(0, (opening, pick))
    assert not one.counted  # a hand holds one hammer anyway
    assert "counted" not in one.as_json()


def test_starts_are_drawn_from_wherever_the_shortcut_leads_on(stowing):
    hammers, _, _, chains, _, (opening, pick, *_) = stowing
    signature, steps = chains.signature(0, (opening, pick)), {"Open": 40, "Pick": 40}
    records = [
        find_start(hammers, SEED, TASK, signature, None, steps, False, np.random.default_rng(i))
        for i in range(4)
    ]
    again = find_start(hammers, SEED, TASK, signature, None, steps, False, np.random.default_rng(0))
    assert again == records[0]
    assert len({record.add for record in records}) > 1  # other hammers, other drawers


class Recorder:
    """Keeps what a training reports."""

    def __init__(self, interrupt_at=None):
        self.verdicts, self._interrupt_at = [], interrupt_at

    def on_progress(self, what, done, total):
        if (what, done) == self._interrupt_at:
            raise KeyboardInterrupt

    def on_left_out(self, use, index, reason):
        raise AssertionError((use, index, reason))

    def on_ranked(self, ranked):
        pass

    def on_learning(self, name, folder, total_steps):
        pass

    def on_validated(self, name, before, after, kept):
        self.verdicts.append((name, before, after, kept))


def train(folder, workers=None, callback=None):
    """A library of shortcuts that put a block down for another one, cloned from few starts."""
    base = training_settings(CHAINS, get_domain("obstacle2d"))
    settings = replace(
        base,
        exploration=replace(FEW, tasks=3, nodes=4, straightened=20),
        cloning=replace(base.cloning, straightened=20, epochs=200, total_steps=1_600),
        starts=40,
        validation=6,
        shortcuts=1,
        least_saving=0.01,
    )
    distribution = TaskDistribution(DomainChoice("obstacle2d", "fair"), 5)
    callback = callback or Recorder()
    workers = workers or SequentialWorkers()
    return Training(distribution, settings, folder, workers, callback).run(), callback


@pytest.mark.training
def test_a_shortcut_is_cloned_and_shortens_plans_and_any_processes_learn_the_same(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path / "here", callback=Recorder(interrupt_at=("straightening skills", 5)))
    library, callback = train(tmp_path / "here")  # goes on
    ((_, before, after, kept),) = callback.verdicts
    assert kept and after < before
    (shortcut,) = library.shortcuts
    assert shortcut.record["found_by"] == [STRAIGHTENED]
    assert shortcut.record["success"] > 0.0  # of episodes with noise, without a choice of the best
    shown = shortcut.record["demonstrations"]
    assert 20 <= shown["number"] <= 40
    assert shown["straightened"] < shown["skills"]
    assert shown["environment_steps"] < shortcut.record["environment_steps"]
    with local_workers(2) as workers:
        other, _ = train(tmp_path / "there", workers=workers)
    assert other.digest == library.digest


def test_one_policy_for_several_shortcuts_cannot_be_cloned():
    from slap_ros.shortcuts.stage_learner import make_learner

    cloning = training_settings(CHAINS, get_domain("obstacle2d")).cloning
    with pytest.raises(InvalidParameterError, match="leave `together` at 1"):
        make_learner(None, None, cloning, 0)
