# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is proven of plans with shortcuts: where these lead, and that no search finds less."""

import random
from dataclasses import dataclass, replace
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slap_ros.domains import get_domain
from slap_ros.planning.abstract_graph import Edge
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.effort import Effort
from slap_ros.planning.graph_beyond import EdgeBeyond
from slap_ros.planning.graph_depth import GraphDepth
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.landmark_cut import RelaxedOperator
from slap_ros.planning.largest_change import LargestChange
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.potential import LeastSteps
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
from slap_ros.planning.shortcut_ends import ShortcutEnds
from slap_ros.relational import GroundOperator, State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import chosen_library
from support.marks import slow
from test.planning.test_anytime_made_up import LIFTED, WORLD, MadeUpModel, Skill, made_up, plan
from test.planning.test_proofs import made_up_hand

ATOMS = 6
MASKS = st.sets(st.integers(0, ATOMS - 1), max_size=3).map(
    lambda bits: sum(1 << bit for bit in bits)
)


@st.composite
def operators(draw):
    """Ground operators which often move something from one of two places to another."""
    made = []
    for _ in range(draw(st.integers(1, 8))):
        needed, added = draw(MASKS), draw(MASKS) or 1
        deleted = (needed if draw(st.booleans()) else draw(MASKS)) & ~added
        made.append(GroundOperator(LIFTED, (), needed, added, deleted))
    return made


def depths_from(start, grounds):
    """The abstract states that operators reach, with the least number of operators."""
    found, layer = {start: 0}, [start]
    while layer:
        after = {one.apply(s) for s in layer for one in grounds if one.applicable(s)} - set(found)
        found.update(dict.fromkeys(after, found[layer[0]] + 1))
        layer = sorted(after)
    return found


@settings(max_examples=400, deadline=None)
@given(MASKS, operators(), MASKS, MASKS)
def test_the_largest_change_has_all_that_operators_reach(start, grounds, may_be_added, alone):
    reached = depths_from(start, grounds)
    largest = LargestChange(start, grounds)
    for source in reached:
        target = largest(source, may_be_added, alone)
        if target is None:
            continue
        for other in reached:
            added, deleted = other & ~source, source & ~other
            if not (added | deleted) & alone and not added & ~may_be_added:
                assert not added & ~(target & ~source)
                assert not deleted & ~(source & ~target)


class BlockAtoms:
    """The atoms of a table with blocks and a target, numbered; and the operators of a hand.

    Args:
        blocks: Number of blocks. The last one is to stand on the target.
    """

    def __init__(self, blocks):
        self.blocks, self.table, self.target = range(blocks), blocks, blocks + 1
        self.empty, self._bits = 1, {}

    def atom(self, *name):
        return 2 << self._bits.setdefault(name, len(self._bits))

    def on(self, block, thing):
        return self.atom("on", block, thing)

    def held(self, block):
        return self.atom("held", block)

    def clear(self, thing):
        return 0 if thing == self.table else self.atom("clear", thing)

    def start(self, stacks):
        """An abstract state: stacks from the bottom, each of what stands on what."""
        covered = {below for stack in stacks for below in stack[:-1]}
        things = [*self.blocks, self.target]
        clear = sum(self.clear(thing) for thing in things if thing not in covered)
        pairs = [pair for stack in stacks for pair in pairwise(stack)]
        return self.empty | clear | sum(self.on(block, below) for below, block in pairs)

    def operators(self):
        """Pick each block from each thing, and place it there."""
        made = []
        for block in self.blocks:
            for thing in [*self.blocks, self.table, self.target]:
                if thing != block:
                    full, room = self.held(block), self.clear(thing)
                    lies = self.on(block, thing) | self.empty
                    before = lies | self.clear(block)
                    made.append(GroundOperator(LIFTED, (), before, full | room, lies))
                    made.append(GroundOperator(LIFTED, (), full | room, lies, full | room))
        return made

    def fallen(self):
        """What a slap may add: all but the last block on the table, and room on all things."""
        obstacles = self.blocks[:-1]
        room = sum(self.clear(thing) for thing in [*obstacles, self.target])
        return room | sum(self.on(block, self.table) for block in obstacles)

    def hand(self):
        """What a slap leaves alone: the hand, and all about the last block."""
        about = [self.on(self.blocks[-1], thing) for thing in [*self.blocks[:-1], self.table]]
        about += [self.on(self.blocks[-1], self.target), self.clear(self.blocks[-1])]
        about += [self.on(block, self.blocks[-1]) for block in self.blocks[:-1]]
        return self.empty | sum(map(self.held, self.blocks)) | sum(about)


def test_the_largest_change_of_a_tower_is_that_all_of_it_falls():
    atoms = BlockAtoms(4)
    table, target = atoms.table, atoms.target
    start = atoms.start([(target, 0, 1, 2), (table, 3)])
    grounds, added, alone = atoms.operators(), atoms.fallen(), atoms.hand()
    largest = LargestChange(start, grounds)
    spread = atoms.start([(target,), *((table, block) for block in range(4))])
    assert largest(start, added, alone) == spread
    assert spread in (reached := depths_from(start, grounds))
    assert largest(start, added & ~atoms.on(1, table), alone) not in reached  # nowhere to go
    top = next(one for one in grounds if one.applicable(start) and one.add_effects & atoms.held(2))
    lies = atoms.on(2, table)
    assert largest(top.apply(start), added, alone) == spread & ~(lies | 1) | atoms.held(2)


@settings(max_examples=300, deadline=None)
@given(MASKS, MASKS, operators())
def test_depths_are_between_their_bounds(start, goal, grounds):
    assume(start & goal != goal)
    reached = depths_from(start, grounds)
    relaxed = [
        RelaxedOperator(o.preconditions, o.add_effects, 1, o.delete_effects) for o in grounds
    ]
    depths = GraphDepth(start, goal, grounds, LeastSteps(goal, relaxed), 0)
    goals = [depth for state, depth in reached.items() if state & goal == goal]
    if goals:
        assert depths.goal_at_least <= min(goals)
    for state, depth in reached.items():
        found = depths.of(state)
        assert found is None or found.at_least <= depth <= found.at_most


@dataclass
class WholeShortcuts:
    """One shortcut that makes the whole change, or, of no use within the graph, goes beyond it.

    Args:
        skill: How long it takes, and where it fails.
        added: Atoms that it may add.
        left_alone: Atoms that it does not change.
        begins: Atoms of which one must hold where it begins.
        is_given_up: Whether it failed too often to be tried.
    """

    skill: Skill
    added: int
    left_alone: int
    begins: int
    is_given_up: bool = False

    def edges(self, graph):
        joined = {(edge.source, edge.target) for edge in graph.edges}
        return [
            Edge(i, j, self.option())
            for i, source in enumerate(graph.nodes)
            for j in self.maximal(source, i, graph.nodes)
            if (i, j) not in joined
        ]

    def maximal(self, source, i, nodes):
        later = [j for j in range(i + 1, len(nodes)) if self.matches(source, nodes[j])]
        changes = {j: (nodes[j] & ~source, source & ~nodes[j]) for j in later}
        return [j for j in later if not any(part(changes[j], other) for other in changes.values())]

    def matches(self, source, target):
        added, deleted = target & ~source, source & ~target
        alone = not (added | deleted) & self.left_alone
        return self.may_begin(source) and alone and added > 0 and not added & ~self.added

    def beyond(self, graph, within):
        if self.skill.name in within:
            return []
        return [
            EdgeBeyond.of(i, node | self.added, self.option())
            for i, node in enumerate(graph.nodes)
            if self.may_begin(node) and self.added & ~node
        ]

    def relaxed(self):
        return [RelaxedOperator(0, self.added, self.skill.least_steps)]

    def may_begin(self, abstract):
        return bool(abstract & self.begins)

    def whole_changes(self, abstract, largest):
        target = largest(abstract, self.added, self.left_alone)
        if target is None:
            return None
        whole = self.matches(abstract, target)
        return [EdgeBeyond.of(0, target, self.option())] if whole else []

    def forget_failures_since_now(self):
        return lambda: None

    def option(self, attempt=0):
        def following():
            return self.option(attempt + 1) if attempt == 0 else None

        return Option(
            OptionKind.SHORTCUT,
            self.skill,
            (),
            attempt=attempt,
            next_attempt=following,
            given_up=lambda: self.is_given_up,
        )


def part(change, other):
    """Whether a change is a proper part of another."""
    return change != other and all(
        mine & ~its == 0 for mine, its in zip(change, other, strict=True)
    )


def with_shortcut(made):
    """A function from a seed to a made-up problem with a shortcut that makes the whole change."""

    def make(seed):
        rng = random.Random(seed)
        *_, start, goal = whole = made(seed)

        def mask(most):
            return sum(1 << bit for bit in rng.sample(range(7), rng.randint(1, most)))

        alone = mask(3)
        skill = Skill("x", rng.randrange(10**6), rng.randint(1, 3), rng.choice([0.0, 0.3]), 5)
        return whole[0], WholeShortcuts(skill, mask(5) & ~alone or 1, alone, mask(3)), start, goal

    return make


class AttemptsModel(MadeUpModel):
    """A model in which each attempt of a shortcut ends in another low-level state."""

    def _simulate(self, option, state, target):
        rollout = super()._simulate(option, state, target)
        abstract, detail = rollout.final.data
        return replace(rollout, final=State(WORLD, [abstract, (detail + option.attempt) % 4]))


def tower(seed):
    """A made-up tower on the target, and a slap that is faster than taking it down."""
    rng = random.Random(seed)
    atoms = BlockAtoms(rng.randint(3, 4))
    *obstacles, last = atoms.blocks
    loose = [(atoms.table, obstacles.pop())] if rng.random() < 0.5 else []
    start = atoms.start([(atoms.target, *obstacles), (atoms.table, last), *loose])
    failing = rng.choice([0.0, 0.1])
    problem = []
    for number, ground in enumerate(atoms.operators()):
        skill = Skill(f"o{number}", rng.randrange(10**6), rng.randint(2, 4), failing, spread=9)
        problem.append((ground, Option(OptionKind.OPERATOR, skill, ())))
    skill = Skill("slap", rng.randrange(10**6), rng.randint(1, 3), failing, spread=6)
    begins = sum(map(atoms.held, atoms.blocks))
    shortcuts = WholeShortcuts(skill, atoms.fallen(), atoms.hand(), begins)
    state = State(WORLD, [float(start), 0.0])
    goal = atoms.on(last, atoms.target)
    return Problem(AttemptsModel(), tuple(problem)), shortcuts, state, goal


@pytest.mark.parametrize(
    ("make", "seeds", "least"),
    [(with_shortcut(made_up), 150, 0), (with_shortcut(made_up_hand), 300, 0), (tower, 40, 15)],
)
@pytest.mark.parametrize("effort", [Effort(rollouts=4000), Effort(rollouts=80, within=1.25)])
def test_no_plan_with_shortcuts_is_shorter_than_is_proven(make, seeds, least, effort, too_large):
    sharp, helped = 0, 0
    for seed in range(seeds):
        problem, shortcuts, start, goal = make(seed)
        whole = GraphPlanner(problem, search=search_exhaustively, shortcuts=shortcuts)
        exhaustive = plan(whole, start, goal)
        found = plan(AnytimePlanner(make(seed)[0], shortcuts, effort), start, goal)
        if exhaustive is None or found is None or not exhaustive.plan.edges:
            continue
        assert found.at_least <= exhaustive.steps
        used = any(one.option.kind is OptionKind.SHORTCUT for one in exhaustive.plan.edges)
        sharp += used and found.at_least >= exhaustive.steps / effort.within
        helped += used
    assert helped >= max(5, least)
    assert sharp >= least


def test_nothing_is_proven_beyond_a_shortcut_that_was_given_up(too_large):
    lower = 0
    for seed in range(40):
        problem, shortcuts, start, goal = tower(seed)
        exhaustive = plan(GraphPlanner(problem, shortcuts=shortcuts), start, goal)
        failing = replace(shortcuts, skill=replace(shortcuts.skill, failing=1.0), is_given_up=True)
        found = plan(AnytimePlanner(tower(seed)[0], failing), start, goal)
        if exhaustive is not None and found is not None:
            assert found.at_least <= exhaustive.steps
            lower += found.at_least < exhaustive.steps
    assert lower > 20


def test_ends_are_unknown_where_the_graph_lacks_the_whole_change():
    """A shortcut adds a and b; a alone is a node, and both together are deeper than the goal."""
    a, b, half_a, half_b, goal, start = (1 << i for i in range(6))
    grounds = [
        GroundOperator(LIFTED, (), needed, added, needed & ~a)
        for needed, added in [(0, half_a), (half_a, a), (0, half_b), (half_b, b), (a, goal)]
    ]
    options = [(one, Option(OptionKind.OPERATOR, Skill("o", 0, 1, 0.0), ())) for one in grounds]
    shortcuts = WholeShortcuts(Skill("x", 0, 1, 0.0), a | b, half_a | half_b | goal, start)
    problem = Problem(MadeUpModel(), tuple(options))
    shallow, deep = (GraphDepth(start, goal, grounds, lambda _, n=n: n, 0) for n in (3, 4))
    assert ShortcutEnds(problem, shortcuts, start, shallow).of(start, 0) is None
    (whole,) = {e.abstract for e in ShortcutEnds(problem, shortcuts, start, deep).of(start, 0)}
    assert whole == start | a | b


def check_ends(problem, shortcuts, start, goal):
    """Look for each edge of the whole graph among the ends; how many are found, and how many ends.

    Only edges that forward edges lead on from to the goal need be there.
    """
    planner = GraphPlanner(problem, shortcuts=shortcuts)
    graph = planner.graph(start, goal)
    nodes, first = len(graph.nodes), graph.depth[graph.goal_nodes[0]]
    planner.add_shortcuts(graph)
    grounds, on_way = [ground for ground, _ in problem.operators], graph.on_way_to_goal()
    relaxed = [
        RelaxedOperator(o.preconditions, o.add_effects, 1, o.delete_effects) for o in grounds
    ]
    depths = GraphDepth(start, goal, grounds, LeastSteps(goal, relaxed), first)
    ends = ShortcutEnds(problem, shortcuts, start, depths)
    found = {i: ends.of(graph.nodes[i], graph.depth[i]) for i in range(nodes)}
    known = {(i, e.abstract, e.option.skill.name) for i, es in found.items() for e in es or ()}
    real = {
        (edge.source, graph.nodes[edge.target], edge.option.skill.name)
        for edge in graph.edges
        if edge.option.kind is OptionKind.SHORTCUT and edge.source < edge.target
        if edge.target in on_way and found.get(edge.source) is not None
    }
    assert real <= known
    return len(real), len(known)


def test_edges_of_made_up_towers_are_among_the_ends_of_shortcuts():
    edges, ends = 0, 0
    for seed in range(40):
        problem, shortcuts, state, goal = tower(seed)
        real, known = check_ends(problem, shortcuts, problem.model.space.abstract(state), goal)
        edges, ends = edges + real, ends + known
    assert edges > 40
    assert ends < 2 * edges  # what leads nowhere is left out


@pytest.mark.parametrize(
    ("name", "preset", "least"),
    [
        ("obstacle_tower", "fair:obstacles=3,distractors=0", 4),
        ("obstacle_tower", "fair:obstacles=2,distractors=2", 8),
        ("obstacle_tower", "fair:obstacles=1,distractors=1,towers=2", 10),
        ("cleanup_table", "fair", 1),
        ("cluttered_drawer", "fair", 1),
        ("obstacle2d", "fair", 0),
    ],
)
def test_edges_of_shipped_shortcuts_are_among_their_ends(name, preset, least):
    domain = get_domain(name, preset)
    task = domain.task(300)
    problem = Problem.of(domain, task.initial_state)
    known = GroundedShortcuts(domain, chosen_library("", domain).shortcuts, task.initial_state)
    space = problem.model.space
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    edges, _ = check_ends(problem, known, start, goal)
    assert edges >= least


@pytest.mark.timeout(180)  # the slow one searches exhaustively
@pytest.mark.parametrize(
    ("preset", "seed"),
    [("fair:obstacles=1", 300), ("fair:obstacles=2", 301), *slow(("fair", 300))],
)
def test_no_exhaustive_search_of_a_tower_finds_less_than_is_proven(preset, seed, too_large):
    domain = get_domain("obstacle_tower", preset)
    task = domain.task(seed)
    problem = Problem.of(domain, task.initial_state)
    known = GroundedShortcuts(domain, chosen_library("", domain).shortcuts, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    found = AnytimePlanner(problem, known).plan(task.initial_state, goal)
    whole = GraphPlanner(problem, search=search_exhaustively, shortcuts=known)
    exhaustive = whole.plan(task.initial_state, goal)
    assert 0.9 * exhaustive.steps <= found.at_least <= exhaustive.steps


@pytest.mark.parametrize("preset", ["fair:obstacles=8", "fair:distractors=8"])
def test_full_tables_are_planned_for_with_shortcuts_until_a_plan_is_good_enough(preset):
    domain = get_domain("obstacle_tower", preset)
    task = domain.task(300)
    problem = Problem.of(domain, task.initial_state)
    known = GroundedShortcuts(domain, chosen_library("", domain).shortcuts, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    planner = AnytimePlanner(problem, known, Effort(within=1.25))
    found = planner.plan(task.initial_state, goal)
    assert found.bound <= 1.25
    assert problem.model.executed <= 50
