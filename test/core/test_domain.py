# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain whose parts do not fit is refused when it is made."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rclpy.serialization import deserialize_message, serialize_message
from slap_msgs.msg import DomainInfo

from ensemble import encode
from slap_ros.core import Acquisition, Execution
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidDomainError, UnknownGoalError, UnknownObjectError
from slap_ros.relational import LiftedAtom, LiftedOperator, Predicate, State, Type, Variable

DOMAIN = get_domain("obstacle2d")


def operator_with(predicate, kind):
    variable = Variable("?x", kind)
    return LiftedOperator(
        "Shine", (variable,), frozenset({LiftedAtom(predicate, (variable,))}), frozenset(),
        frozenset(),
    )  # fmt: skip


def test_an_operator_with_an_unknown_predicate():
    block = DOMAIN.types[1]
    shiny = Predicate("Shiny", (block,), lambda state, column: None)
    with pytest.raises(InvalidDomainError, match=r"operator Shine: unknown predicate 'Shiny'"):
        replace(DOMAIN, operators=(*DOMAIN.operators, operator_with(shiny, block)))


def test_an_operator_with_an_unknown_type():
    with pytest.raises(InvalidDomainError, match="unknown type 'ghost'"):
        ghost = Type("ghost", parent=DOMAIN.types[1])
        is_block = next(p for p in DOMAIN.predicates if p.name == "IsBlock")
        replace(DOMAIN, operators=(*DOMAIN.operators, operator_with(is_block, ghost)))


def test_an_operator_without_a_skill():
    with pytest.raises(InvalidDomainError, match="operator Pick: no skill"):
        replace(DOMAIN, skills={})


def test_names_that_occur_twice():
    with pytest.raises(InvalidDomainError, match="two operators named Pick"):
        replace(DOMAIN, operators=(*DOMAIN.operators, DOMAIN.operators[0]))


def test_a_type_whose_parent_is_missing():
    with pytest.raises(InvalidDomainError, match="type cup descends from vessel"):
        replace(DOMAIN, types=(*DOMAIN.types, Type("cup", parent=Type("vessel"))))


@pytest.mark.parametrize("name", ["obstacle2d", "obstacle_tower", "cluttered_drawer"])
def test_what_is_said_to_be_unread_changes_no_atom(name):
    domain = get_domain(name)
    initial = domain.task(0).initial_state
    space = domain.atom_space(initial)
    rng = np.random.default_rng(0)
    data = np.repeat(initial.data[None], 200, axis=0)
    for obj in initial.objects:
        if obj.type in domain.robot_types:
            part = initial.layout.slices[obj]
            data[:, part] = rng.uniform(-3, 3, data[:, part].shape)
    truth = space.truth(State(initial.layout, data))
    read = [atom.predicate in domain.robot_predicates for atom in space.atoms]
    assert (truth == truth[0])[:, ~np.array(read)].all()
    assert space.abstract_each(State(initial.layout, data)) == [
        space.abstract(State(initial.layout, row)) for row in data
    ]


def test_robot_types_are_types_of_the_domain():
    with pytest.raises(InvalidDomainError, match="robot_types has 'robot', which is not among"):
        replace(DOMAIN, robot_types=frozenset({"robot"}))


@pytest.mark.parametrize("period", [0, -0.1, math.nan, math.inf, "0.1", None])
def test_a_control_period_is_a_number_of_seconds_above_0(period):
    with pytest.raises(InvalidDomainError, match=f"control_period_s is {period!r}, expected"):
        Execution(control_period_s=period)


def test_a_control_period_may_be_a_whole_number():
    domain = replace(DOMAIN, execution=Execution(control_period_s=1))
    info = encode.domain_info(domain, Time())
    assert deserialize_message(serialize_message(info), DomainInfo).control_period == 1.0


def test_without_operators_static_predicates_are_named():
    with pytest.raises(InvalidDomainError, match="without operators nothing tells"):
        replace(DOMAIN, operators=(), skills={})
    bare = replace(DOMAIN, operators=(), skills={}, static=DOMAIN.static_predicates)
    assert bare.static_predicates == DOMAIN.static_predicates
    start = DOMAIN.task(0).initial_state
    assert list(map(str, bare.atom_space(start).atoms)) == list(
        map(str, DOMAIN.atom_space(start).atoms)
    )


def test_nothing_static_is_changed_by_an_operator():
    changed = DOMAIN.operators[0]
    predicate = next(iter(changed.add_effects)).predicate
    with pytest.raises(InvalidDomainError, match=f"{predicate} cannot be static"):
        replace(DOMAIN, static=frozenset({predicate}))
    written = Acquisition(approach=lambda state, objects: lambda _: None, operators=(changed,))
    with pytest.raises(InvalidDomainError, match=f"{predicate} cannot be static"):
        replace(DOMAIN, operators=(), skills={}, static=frozenset({predicate}), acquisition=written)


def on_the_ground(block):
    """A goal about one block, which some tasks lack."""
    on = next(p for p in DOMAIN.predicates if p.name == "On")

    def goal(state):
        return frozenset({on(state.layout.object(block), state.layout.object("table"))})

    return goal


def test_tasks_of_a_named_goal_have_its_objects():
    goals = {"few": on_the_ground("block1"), "many": on_the_ground("block4")}
    domain = replace(get_domain("obstacle2d", "fair:bystanders=0..2"), goals=goals)
    own = [domain.task(seed) for seed in range(20)]
    assert [domain.task(s, goal="few").initial_state for s in range(20)] == [
        task.initial_state for task in own
    ]
    lacking = [s for s in range(20) if "block4" not in own[s].initial_state.layout.by_name]
    assert 0 < len(lacking) < 20
    for seed in lacking:
        task = domain.task(seed, goal="many")
        assert {str(atom) for atom in task.goal} == {"On(block4, table)"}
        assert task == domain.task(seed, goal="many")


def test_a_goal_that_no_task_can_have():
    domain = replace(DOMAIN, goals={"ghost": on_the_ground("ghost")})
    with pytest.raises(UnknownObjectError, match="unknown object 'ghost'"):
        domain.task(0, goal="ghost")
    with pytest.raises(UnknownGoalError, match="no goal 'host'; there are ghost"):
        domain.task(0, goal="host")
