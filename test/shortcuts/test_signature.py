# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lifting of changes, and substitution of objects."""

import gc
import weakref
from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.obstacle_tower import make
from slap_ros.domains.obstacle_tower.tasks import RandomTowerTasks
from slap_ros.evaluation.approaches import Approach
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.shortcuts.signature import Change, Signature, concerned, context_of
from slap_ros.shortcuts.signature_grounder import SignatureGrounder
from slap_ros.shortcuts.signature_matcher import SignatureMatcher


def initial_state(obstacles, seed=0, distractors=0):
    counts = (obstacles, obstacles), (distractors, distractors)
    return RandomTowerTasks(*counts).sample(np.random.default_rng(seed)).initial_state


def tower(obstacles, seed=0, distractors=0):
    """The atoms of a tower task, and the change of knocking the whole tower over."""
    space = make("fair").atom_space(initial_state(obstacles, seed, distractors))
    blocks = [f"block{i}" for i in range(2, obstacles + 2)]
    add = [space.atom("On", [b, "table"]) for b in blocks] + [space.atom("NothingOn", ["target"])]
    add += [space.atom("NothingOn", [b]) for b in blocks[:-1]]
    delete = [
        space.atom("On", [b, under]) for b, under in zip(blocks, ["target", *blocks], strict=False)
    ]
    return space, Change(space.mask(add), space.mask(delete))


def test_a_change_leads_from_source_to_target():
    _, change = tower(3)
    source = change.delete | 1
    assert Change.between(source, change.apply(source)) == change


def test_the_same_change_of_other_objects_has_the_same_signature():
    space, change = tower(3, seed=1)
    other_space, other = tower(3, seed=2, distractors=2)
    assert Signature.of(change, space) == Signature.of(other, other_space)
    assert Signature.of(change, space).name == Signature.of(other, other_space).name


def test_roles_follow_the_tower_and_not_the_names():
    space, change = tower(4)
    towers = [obj.name for obj in concerned(change, space) if obj.name.startswith("block")]
    assert towers == ["block2", "block3", "block4", "block5"]
    # The same tower built the other way round.
    on = lambda block, under: space.atom("On", [block, under])  # noqa: E731
    upside_down = Change(
        change.add,
        space.mask(
            on(*pair)
            for pair in (
                ("block5", "target"),
                ("block4", "block5"),
                ("block3", "block4"),
                ("block2", "block3"),
            )
        ),
    )
    towers = [obj.name for obj in concerned(upside_down, space) if obj.name.startswith("block")]
    assert towers == ["block5", "block4", "block3", "block2"]


def test_a_table_and_a_target_are_different_roles():
    space, change = tower(2)
    kinds = Signature.of(change, space).slots
    assert sorted(kinds.values()) == [1, 1, 2]


def standing(space, change):
    """The abstract state in which a tower stands, with nothing on its top."""
    below = {atom.objects[1] for atom in space.decode(change.delete) if len(atom.objects) == 2}
    top = {o for atom in space.decode(change.delete) for o in atom.objects} - below
    return change.delete | space.mask(
        atom
        for atom in space.atoms
        if atom.predicate.name == "NothingOn" and set(atom.objects) <= top
    )


@pytest.mark.parametrize("obstacles", [1, 2, 3, 4, 6])
def test_what_was_learned_on_three_matches_other_towers(obstacles):
    learned = Signature.of(*reversed(tower(3)))
    space, change = tower(obstacles)
    assert learned.matches(change, standing(space, change), space)


def test_what_is_missing_of_a_change_must_be_so_already():
    space, change = tower(1)
    learned, source = Signature.of(*reversed(tower(3))), standing(space, change)
    assert learned.matches(change, source, space)
    covered = source & ~space.mask([space.atom("NothingOn", ["block2"])])
    assert not learned.matches(change, covered, space)


def test_it_does_not_match_another_change():
    space, change = tower(3)
    learned = Signature.of(change, space)
    half, source = Change(change.add & -change.add, 0), standing(space, change)
    assert not learned.matches(half, source, space)
    assert not learned.matches(Change(change.delete, change.add), source, space)


def test_it_may_delete_more_about_the_same_objects_but_add_nothing_else():
    space, change = tower(3, distractors=1)
    learned = Signature.of(change, space)
    holding = space.mask([space.atom("Holding", ["robot", "block1"])])
    turned = space.mask([space.atom("On", ["block2", "block4"])])
    source = standing(space, change)
    assert not learned.matches(Change(change.add, change.delete | holding), source, space)
    assert learned.matches(Change(change.add, change.delete | turned), source, space)
    assert not learned.matches(Change(change.add | turned, change.delete), source, space)


def test_what_is_held_is_part_of_what_was_learned():
    space, change = tower(3)
    grasping = make("fair").learning.interface.grasping
    empty = space.mask([space.atom("GripperEmpty", ["robot"])])
    holding = space.mask([space.atom("Holding", ["robot", "block1"])])
    before = change.delete & ~change.add
    nodes = [before | empty, before | holding]
    nodes += [change.apply(node) for node in nodes]
    signature = Signature.of(change, space, context_of(nodes[1], grasping, space))
    assert list(SignatureMatcher(signature, space, grasping).pairs(nodes)) == [(1, 3)]
    assert signature.name != Signature.of(change, space).name


def test_all_of_it_or_nothing():
    """Of a higher tower, a part falling over is also a change that matches: it is left out."""
    space, change = tower(3)
    grasping = make("fair").learning.interface.grasping
    source = change.delete
    part = space.mask([space.atom("On", ["block4", "block3"])])  # carried along
    carried = space.mask(
        [space.atom("On", ["block4", "table"]), space.atom("NothingOn", ["block3"])]
    )
    partly = (change.apply(source) | part) & ~carried
    learned = Signature.of(change, space)
    assert learned.matches(Change.between(source, partly), source, space)
    nodes = [source, partly, change.apply(source)]
    assert list(SignatureMatcher(learned, space, grasping).pairs(nodes)) == [(0, 2)]


def grounded(learned, obstacles, extra=(), distractors=0):
    """The changes that a signature makes at the start of a tower task."""
    state = initial_state(obstacles, distractors=distractors)
    space = make("fair").atom_space(state)
    start = space.abstract(state) | space.mask(extra)
    return list(SignatureGrounder(learned, space, ()).changes(start))


def test_algorithm_3_wants_every_atom_of_training():
    learned = Signature.of(*reversed(tower(3)))
    found = grounded(learned, 3, distractors=2)
    assert found == [tower(3, distractors=2)[1]]  # of the tower, whatever else there is
    assert not grounded(learned, 2)
    # Of a higher tower, the lower three fit, but would not fall without what they carry.
    assert not grounded(learned, 4)


def test_what_holds_already_is_not_added():
    space, _ = tower(3)
    there = [space.atom("NothingOn", ["block2"])]
    assert not grounded(Signature.of(*reversed(tower(3))), 3, there)


def test_changes_are_made_only_where_the_same_is_held():
    space, change = tower(3)
    learned = Signature.of(change, space, frozenset({"Holding"}))
    grasping = make("fair").learning.interface.grasping
    grounder = SignatureGrounder(learned, space, grasping)
    holding = space.mask([space.atom("Holding", ["robot", "block1"])])
    assert not list(grounder.changes(change.delete))
    assert list(grounder.changes(change.delete | holding)) == [change]


def test_a_signature_survives_json():
    learned = Signature.of(*reversed(tower(3)))
    assert Signature.from_json(learned.as_json()) == learned
    broken = learned.as_json()
    broken["add"][0][1] = [99]
    with pytest.raises(ValueError, match="role"):
        Signature.from_json(broken)


def test_the_matcher_finds_exactly_the_pairs_that_match():
    domain = get_domain("obstacle2d", "fair")
    from slap_ros.planning.abstract_graph import build_abstract_graph
    from slap_ros.planning.problem import Problem

    for index in range(5):
        task = domain.task(11, index)
        problem = Problem.of(domain, task.initial_state)
        space = problem.model.space
        graph = build_abstract_graph(
            space.abstract(task.initial_state), space.mask(task.goal), problem.operators
        )
        pairs = graph.candidates()
        changes = {pair: Change.between(*(graph.nodes[i] for i in pair)) for pair in pairs}
        grasping = domain.learning.interface.grasping
        signatures = {
            Signature.of(change, space, context_of(graph.nodes[i], grasping, space))
            for (i, _), change in changes.items()
        }
        assert len(signatures) > 3
        for signature in signatures:
            slowly = {
                pair
                for pair, change in changes.items()
                if signature.matches(change, graph.nodes[pair[0]], space)
            }
            matcher = SignatureMatcher(signature, space, grasping)
            quickly = {(i, j) for i, js in matcher._by_source(graph.nodes) for j in js}
            begins = {i for i in range(len(graph.nodes)) if matcher.may_begin(graph.nodes[i])}
            assert {(i, j) for i, j in slowly if i in begins} == quickly & set(pairs)


def test_a_task_that_is_over_is_forgotten():
    """What was worked out of its objects must not keep it, with every state that it perceived."""
    domain = get_domain("obstacle2d")
    library = load_library(Path(__file__).parent / "data" / "obstacle2d", domain)
    task = domain.task(3)
    planner = Approach("slap", library.shortcuts).planner("lazy", domain, task.initial_state)
    space = planner.problem.model.space
    assert planner.plan(task.initial_state, space.mask(task.goal)).plan.edges
    forgotten = weakref.ref(space)
    del planner, space
    gc.collect()
    assert forgotten() is None
