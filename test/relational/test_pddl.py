# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""PDDL out and in: what is written is read back, others accept it, and errors have positions."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.core import Task
from slap_ros.domains.registry import get_domain
from slap_ros.errors import (
    InvalidDomainError,
    MalformedPddlError,
    MismatchedAtomError,
    SlapError,
    UnknownObjectError,
    UnknownPredicateError,
)
from slap_ros.relational import (
    AtomSpace,
    GroundAtom,
    GroundOperator,
    Layout,
    LiftedAtom,
    LiftedOperator,
    Object,
    Predicate,
    State,
    Type,
    Variable,
    ground_operators,
)
from slap_ros.relational.pddl import (
    PddlDomain,
    parse_domain,
    parse_goal,
    parse_problem,
    write_domain,
    write_problem,
)

OBSTACLE2D = get_domain("obstacle2d")
TASK = OBSTACLE2D.task(seed=0)
SPACE = OBSTACLE2D.atom_space(TASK.initial_state)


def no_classifier(*_: Any) -> Any:
    raise AssertionError("predicates are compared by name and types")


def obstacle2d_text() -> str:
    parts = (OBSTACLE2D.types, OBSTACLE2D.predicates, OBSTACLE2D.operators)
    return write_domain(OBSTACLE2D.name, *parts)


def task_text(task: Task) -> str:
    space = OBSTACLE2D.atom_space(task.initial_state)
    init = frozenset(space.decode(space.abstract(task.initial_state)))
    objects = task.initial_state.objects
    return write_problem("task", OBSTACLE2D.name, objects, init, task.goal)


@dataclass(frozen=True)
class StripsDomain:
    """What is written of a domain, and can be read back."""

    name: str
    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    operators: tuple[LiftedOperator, ...]

    @classmethod
    def of(cls, domain: PddlDomain) -> StripsDomain:
        return cls(domain.name, domain.types, domain.predicates, domain.operators)


def rewritten(domain: PddlDomain | StripsDomain) -> str:
    return write_domain(domain.name, domain.types, domain.predicates, domain.operators)


# -- round trips --------------------------------------------------------------------------------


def names(first: str) -> st.SearchStrategy[str]:
    """Names of one kind, with letters of both cases; unlike those of other kinds."""
    return st.from_regex(rf"{first}[A-Za-z0-9_-]{{0,6}}", fullmatch=True)


def distinct(first: str, min_size: int, max_size: int) -> st.SearchStrategy[list[str]]:
    return st.lists(names(first), min_size=min_size, max_size=max_size, unique_by=str.lower)


@st.composite
def hierarchies(draw: st.DrawFn) -> tuple[Type, ...]:
    """Types, each below an earlier one or none."""
    types: list[Type] = []
    for name in draw(distinct("[tT]", 1, 4)):
        types.append(Type(name, parent=draw(st.sampled_from([None, *types]))))
    return tuple(types)


@st.composite
def operators(draw: st.DrawFn, name: str, domain: StripsDomain) -> LiftedOperator:
    kinds = st.sampled_from(domain.types)
    parameters = [Variable(f"?{n}", draw(kinds)) for n in draw(distinct("[vV]", 0, 4))]
    atoms = [
        LiftedAtom(predicate, chosen)
        for predicate in domain.predicates
        for chosen in product(parameters, repeat=len(predicate.types))
        if all(v.type.is_a(kind) for v, kind in zip(chosen, predicate.types, strict=True))
    ]
    pairs = list(combinations(parameters, 2))
    differ = draw(st.sets(st.sampled_from(pairs), max_size=2)) if pairs else set()
    subsets = st.sets(st.sampled_from(atoms), max_size=4) if atoms else st.just(set())
    added, deleted = draw(subsets), draw(subsets)
    preconditions = frozenset(draw(subsets))
    return LiftedOperator(
        name,
        tuple(parameters),
        preconditions,
        frozenset(added),
        frozenset(deleted - added),
        tuple(pair for pair in pairs if pair in differ),
    )


@st.composite
def domains(draw: st.DrawFn) -> StripsDomain:
    types = draw(hierarchies())
    signatures = st.lists(st.sampled_from(types), max_size=3).map(tuple)
    predicates = tuple(
        Predicate(name, draw(signatures), no_classifier) for name in draw(distinct("[pP]", 0, 4))
    )
    symbolic = StripsDomain(draw(names("d")), types, predicates, ())
    found = tuple(draw(operators(name, symbolic)) for name in draw(distinct("[qQ]", 0, 3)))
    return replace(symbolic, operators=found)


@st.composite
def problems(
    draw: st.DrawFn,
) -> tuple[StripsDomain, Layout, frozenset[GroundAtom], frozenset[GroundAtom]]:
    domain = draw(domains())
    kinds = st.sampled_from(domain.types)
    objects = [draw(kinds)(name) for name in draw(distinct("[xX]", 0, 5))]
    atoms = all_atoms(domain, objects)
    subsets = st.frozensets(st.sampled_from(atoms), max_size=6) if atoms else st.just(frozenset())
    layout = State.build({obj: {} for obj in objects}).layout
    return domain, layout, draw(subsets), draw(subsets)


def all_atoms(domain: StripsDomain, objects: list[Object]) -> list[GroundAtom]:
    return [
        predicate(*chosen)
        for predicate in domain.predicates
        for chosen in product(objects, repeat=len(predicate.types))
        if all(o.type.is_a(kind) for o, kind in zip(chosen, predicate.types, strict=True))
    ]


@given(domains())
@settings(max_examples=50, deadline=None)
def test_domains_are_read_back(domain: StripsDomain) -> None:
    text = rewritten(domain)
    assert StripsDomain.of(parse_domain(text)) == domain
    assert rewritten(parse_domain(text)) == text


@given(problems())
@settings(max_examples=50, deadline=None)
def test_problems_are_read_back(
    stated: tuple[StripsDomain, Layout, frozenset[GroundAtom], frozenset[GroundAtom]],
) -> None:
    domain, layout, init, goal = stated
    parsed = parse_domain(rewritten(domain))
    read = parse_problem(write_problem("p", domain.name, layout.objects, init, goal), parsed)
    assert (read.objects, read.init, read.goal) == (layout, init, goal)
    space = read.atom_space(parsed)
    assert set(space.decode(space.mask(read.init))) == init
    assert set(space.decode(space.mask(read.goal))) == goal
    assert space.static_truth == space.mask(read.init) & space.static


def test_obstacle2d_is_read_back() -> None:
    """All but the features of types, which PDDL does not know."""
    bare = {kind: Type(kind.name) for kind in OBSTACLE2D.types}

    def predicate(ours: Predicate) -> Predicate:
        return Predicate(ours.name, tuple(bare[kind] for kind in ours.types), no_classifier)

    def atoms(ours: frozenset[LiftedAtom]) -> frozenset[LiftedAtom]:
        return frozenset(
            LiftedAtom(predicate(a.predicate), tuple(map(variable, a.variables))) for a in ours
        )

    def variable(ours: Variable) -> Variable:
        return Variable(ours.name, bare[ours.type])

    read = parse_domain(obstacle2d_text())
    assert read.types == tuple(bare.values())
    assert read.predicates == tuple(map(predicate, OBSTACLE2D.predicates))
    assert read.operators == tuple(
        LiftedOperator(
            ours.name,
            tuple(map(variable, ours.parameters)),
            atoms(ours.preconditions),
            atoms(ours.add_effects),
            atoms(ours.delete_effects),
        )
        for ours in OBSTACLE2D.operators
    )


def test_problem_of_obstacle2d_grounds_as_the_domain_itself() -> None:
    domain = parse_domain(obstacle2d_text())
    problem = parse_problem(task_text(TASK), domain)
    space = problem.atom_space(domain)
    ours = OBSTACLE2D.ground(SPACE)
    theirs = ground_operators(domain.operators, space)
    assert space.mask(problem.init) == SPACE.abstract(TASK.initial_state)
    assert space.mask(problem.goal) == SPACE.mask(TASK.goal)
    assert list(map(masks, theirs)) == list(map(masks, ours))


def masks(operator: GroundOperator) -> tuple[int, int, int]:
    return operator.preconditions, operator.add_effects, operator.delete_effects


def test_text_does_not_depend_on_the_order_of_sets() -> None:
    lines = obstacle2d_text().splitlines()
    action = lines.index("  (:action Pick")
    assert lines[action + 1 : action + 12] == [
        "    :parameters (?r - robot ?b - block ?s - surface)",
        "    :precondition (and",
        "      (GripperEmpty ?r)",
        "      (IsBlock ?b)",
        "      (IsRobot ?r)",
        "      (IsSurface ?s)",
        "      (NotIsTarget ?s)",
        "      (On ?b ?s))",
        "    :effect (and",
        "      (Holding ?r ?b)",
        "      (not (GripperEmpty ?r))",
    ]


# -- what others write --------------------------------------------------------------------------

UNTYPED = """
; the gripper moves balls one by one
(DEFINE (DOMAIN Gripper)
  (:Requirements :STRIPS)
  (:predicates (ball ?b) (room ?r) (at ?b ?r) (here ?r) (carry ?b) (free))
  (:action pick
    :parameters (?b ?r)   ; no types at all
    :precondition (AND (ball ?b) (and (room ?r) (at ?b ?r)) (here ?r) (free))
    :effect (and (carry ?b) (NOT (at ?b ?r)) (not (free))))
  (:action wait :parameters () :effect ()))
"""


def test_untyped_text() -> None:
    domain = parse_domain(UNTYPED)
    anything = Type("object")
    assert domain.types == (anything,)
    assert domain.predicates[2] == Predicate("at", (anything, anything), no_classifier)
    assert [len(op.preconditions) for op in domain.operators] == [5, 0]
    assert StripsDomain.of(parse_domain(rewritten(domain))) == StripsDomain.of(domain)
    problem = parse_problem(
        """(define (problem one) (:domain GRIPPER) (:objects b r)
        (:init (ball b) (room r) (at b r) (here r) (free)) (:goal (carry B)))""",
        domain,
    )
    space = problem.atom_space(domain)
    ground = ground_operators(domain.operators, space)
    assert [str(op) for op in ground] == ["pick(b, r)", "wait()"]
    assert ground[0].apply(space.mask(problem.init)) & space.mask(problem.goal)


def test_types_descend_from_object_where_it_is_used() -> None:
    domain = parse_domain(
        """(define (domain d) (:types cup - item box item)
        (:predicates (seen ?x - object) (full ?c - cup)))"""
    )
    anything = Type("object")
    item = Type("item", parent=anything)
    expected = (anything, Type("cup", parent=item), Type("box", parent=anything), item)
    assert domain.types == expected
    assert parse_domain(rewritten(domain)).predicates == domain.predicates


def test_predicates_that_were_read_belong_to_no_world() -> None:
    predicate = parse_domain(UNTYPED).predicates[-1]
    with pytest.raises(InvalidDomainError, match="free was read from PDDL and cannot be evaluated"):
        predicate().holds(TASK.initial_state)


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ("(On block1 target)", ["On(block1, target)"]),
        ("(and (On block1 target))", ["On(block1, target)"]),
        (
            "(AND (on BLOCK1 Target) (gripperempty robot))",
            ["GripperEmpty(robot)", "On(block1, target)"],
        ),
        ("(and) ; nothing", []),
    ],
)
def test_goals(text: str, goal: list[str]) -> None:
    assert sorted(map(str, parse_goal(text, SPACE))) == goal


def test_names_that_differ_in_case_alone_are_told_apart_where_written_exactly() -> None:
    thing = Type("thing")
    layout = State.build({thing("a"): {}, thing("A"): {}}).layout
    space = AtomSpace([Predicate("Seen", (thing,), no_classifier)], [], layout, no_classifier)
    assert [str(atom) for atom in parse_goal("(seen A)", space)] == ["Seen(A)"]


# -- other planners -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("preset", "seed"), [("fair", 0), ("fair", 1), ("fair", 2), ("paper", 0), ("paper", 1)]
)
def test_an_independent_planner_solves_obstacle2d(preset: str, seed: int) -> None:
    task = get_domain("obstacle2d", preset).task(seed)
    plan = solve_with_aries(obstacle2d_text(), task_text(task))
    space = OBSTACLE2D.atom_space(task.initial_state)
    ground = {str(op).lower(): op for op in OBSTACLE2D.ground(space)}
    abstract, goal = space.abstract(task.initial_state), space.mask(task.goal)
    assert abstract & goal != goal
    for step in plan:
        assert ground[step].applicable(abstract)
        abstract = ground[step].apply(abstract)
    assert abstract & goal == goal


def solve_with_aries(domain: str, problem: str) -> Iterator[str]:
    """The plan's operators, in lower case, as ``pick(robot, block1, table)``."""
    from unified_planning.environment import Environment
    from unified_planning.io import PDDLReader

    environment = Environment()
    environment.error_used_name = False  # PDDL lets an object and its type share a name
    environment.credits_stream = None
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Name .* already defined")
        task = PDDLReader(environment).parse_problem_string(domain, problem)
        with environment.factory.OneshotPlanner(name="aries") as planner:
            result = planner.solve(task)
    assert result.plan is not None, result
    return (str(step).lower() for step in result.plan.actions)


# -- refusals: text -----------------------------------------------------------------------------

FRAME = """(define (domain d)
  (:requirements :strips :typing)
  (:types robot block)
  (:predicates (Held ?r - robot ?b - block) (Free ?r - robot))
  (:action Grasp
    :parameters (?r - robot ?b - block)
    :precondition (and (Free ?r))
    :effect (and (Held ?r ?b) (not (Free ?r)))))
"""
EFFECT = "(and (Held ?r ?b) (not (Free ?r)))"
PROBLEM = """(define (problem p)
  (:domain d)
  (:objects r - robot b c - block)
  (:init (Free r))
  (:goal (and (Held r b))))
"""

DOMAIN_ERRORS = [
    # what to replace, by what, the error, its message
    (FRAME, "", MalformedPddlError, "1:1: there is nothing but blanks and comments"),
    ("(define", "define", MalformedPddlError, "8:48: ')' closes nothing"),
    ("(Free ?r)))))", "(Free ?r))))", MalformedPddlError, "1:1: '(' is never closed"),
    (FRAME, FRAME + "(and)", MalformedPddlError, "9:1: the text should end before a list"),
    (FRAME, "(" * 200, MalformedPddlError, "1:101: more than 100 lists nested"),
    ("domain d", "problem d", MalformedPddlError, "1:1: expected (define (domain NAME) ...)"),
    ("domain d", "domain 2d", MalformedPddlError, "1:17: '2d' cannot name a domain in PDDL"),
    (":typing", ":tying", MalformedPddlError, "2:26: requirement :tying is not supported"),
    (
        "(:types robot block)",
        "(:types robot block) (:constants r - rover)",
        MalformedPddlError,
        "3:40: unknown type 'rover'; known here: block, robot",
    ),
    (
        "(:types robot block)",
        "(:types robot block) (:derived (Free ?r) (Held ?r ?r))",
        MalformedPddlError,
        "3:24: derived predicates (:derived) are not supported",
    ),
    (
        "(:types robot block)",
        "(:types robot block) (:durative-action wait)",
        MalformedPddlError,
        "3:24: durative actions (:durative-action) are not supported",
    ),
    (
        "(:types robot block)",
        "(:types robot block) (:constraints (and))",
        MalformedPddlError,
        "3:24: constraints (:constraints) are not supported",
    ),
    ("(:types", "(:kinds", MalformedPddlError, "3:3: unknown section ':kinds'; there are"),
    (
        "(:types robot block)",
        "(:types robot) (:types block)",
        MalformedPddlError,
        "3:18: a second :types",
    ),
    (
        "robot block)",
        "robot Robot)",
        MalformedPddlError,
        "3:17: two types named 'Robot': PDDL does not tell upper from lower case",
    ),
    (
        "robot block)",
        "robot - block block - robot)",
        MalformedPddlError,
        "3:11: type robot descends from itself",
    ),
    ("robot block)", "robot block -)", MalformedPddlError, "3:23: the name of a type is missing"),
    ("(Free ?r - robot)", "(Free - robot)", MalformedPddlError, "4:51: nothing stands before '-'"),
    (
        "(Free ?r - robot)",
        "(Free ?r - (either robot cup))",
        MalformedPddlError,
        "4:70: unknown type 'cup'; known here: block, robot",
    ),
    ("(Free ?r - robot)", "(Free r)", MalformedPddlError, "4:51: 'r' cannot name a variable"),
    (
        "(Free ?r - robot)",
        "(not ?r - robot)",
        MalformedPddlError,
        "4:46: 'not' cannot name a predicate: PDDL reserves the word",
    ),
    (
        "(?r - robot ?b - block)",
        "(?r - robot ?b - cup)",
        MalformedPddlError,
        "6:34: unknown type 'cup'; known here: block, robot",
    ),
    (
        "(?r - robot ?b - block)",
        "(?r - robot ?R - block)",
        MalformedPddlError,
        "6:29: two variables named 'R'",
    ),
    (":parameters", ":things", MalformedPddlError, "6:5: action Grasp has ':things'; there are"),
    (":precondition", ":effect", MalformedPddlError, "8:5: a second :effect"),
    (":effect " + EFFECT, ":effect", MalformedPddlError, "8:5: nothing follows :effect"),
    (
        "    :parameters (?r - robot ?b - block)\n",
        "",
        MalformedPddlError,
        "6:30: unknown parameter '?r'; known here: none",
    ),
    ("(and (Free ?r))", "(not)", MalformedPddlError, "7:19: 'not' takes one condition"),
    (
        "(and (Free ?r))",
        "(forall (?x - robot))",
        MalformedPddlError,
        "7:19: 'forall' takes 2 parts",
    ),
    (
        "(and (Free ?r))",
        "(exists (?x - robot) (Free ?y))",
        MalformedPddlError,
        "7:46: unknown parameter '?y'; known here: ?b, ?r, ?x",
    ),
    (
        "(and (Free ?r))",
        "(>= (fuel ?r) 1)",
        MalformedPddlError,
        "7:19: numeric fluents (>=) are not supported",
    ),
    (
        "(and (Free ?r))",
        "(= (fuel ?r) 1)",
        MalformedPddlError,
        "7:19: numeric fluents (=) are not supported",
    ),
    (
        "(and (Free ?r))",
        "(preference one (Free ?r))",
        MalformedPddlError,
        "7:19: preferences are not supported",
    ),
    (
        EFFECT,
        "(and (increase (cost) 1))",
        MalformedPddlError,
        "8:18: numeric fluents other than (total-cost) are not supported",
    ),
    (
        EFFECT,
        "(when (Free ?r) (increase (total-cost) 1))",
        MalformedPddlError,
        "8:29: numeric fluents (increase) are not supported",
    ),
    (
        EFFECT,
        "(increase (total-cost) (distance ?r))",
        MalformedPddlError,
        "8:37: unknown function 'distance'; known here: none",
    ),
    (
        EFFECT,
        "(when (Free ?r))",
        MalformedPddlError,
        "8:13: 'when' takes a condition and an effect",
    ),
    (
        EFFECT,
        "(or (Free ?r) (Free ?r))",
        MalformedPddlError,
        "8:13: 'or' is a condition, not something that comes true",
    ),
    (EFFECT, "(not (Free ?r) (Free ?r))", MalformedPddlError, "8:13: 'not' takes one atom"),
    (
        "(Held ?r ?b) (not",
        "(Hold ?r ?b) (not",
        UnknownPredicateError,
        "8:19: unknown predicate 'Hold'; known here: Free, Held",
    ),
    (
        "(Held ?r ?b) (not",
        "(Held ?r ?c) (not",
        MalformedPddlError,
        "8:27: unknown parameter '?c'; known here: ?b, ?r",
    ),
    (
        "(Held ?r ?b) (not",
        "(Held ?r) (not",
        InvalidDomainError,
        "8:19: operator Grasp: Held(?r) has 1 arguments, Held takes 2",
    ),
    (
        "(Held ?r ?b) (not",
        "(Held ?b ?r) (not",
        InvalidDomainError,
        "8:19: operator Grasp: ?b in Held(?b, ?r) is a block, Held wants a robot",
    ),
]

PROBLEM_ERRORS = [
    ("problem p", "domain p", MalformedPddlError, "1:1: expected (define (problem NAME) ...)"),
    (
        "(:domain d)",
        "(:domain e)",
        MalformedPddlError,
        "2:12: a problem of domain 'e', not of 'd'",
    ),
    ("(:domain d)", "", MalformedPddlError, "1:18: p needs one entry in :domain, found 0"),
    ("b c - block", "b c - cup", MalformedPddlError, "3:29: unknown type 'cup'; known here: block"),
    ("b c - block", "b B - block", MalformedPddlError, "3:25: two objects named 'B'"),
    ("b c - block", "b ! - block", MalformedPddlError, "3:25: '!' cannot name an object in PDDL"),
    (
        "(:init (Free r))",
        "(:init (= (cost) 3))",
        MalformedPddlError,
        "4:10: equality and numeric fluents are not supported",
    ),
    (
        "(:init (Free r))",
        "(:init Free)",
        MalformedPddlError,
        "4:10: expected an atom, found 'Free'",
    ),
    ("(Free r)", "(Free s)", UnknownObjectError, "4:16: unknown object 's'; known here: b, c, r"),
    ("(Held r b)", "(Held r b c)", MismatchedAtomError, "5:16: Held takes 2 objects, got 3"),
    ("(Held r b)", "(Held c b)", MismatchedAtomError, "5:16: Held wants a robot, but c is a block"),
    ("(and (Held r b))", "(imply (Held r b))", MalformedPddlError, "5:10: 'imply' takes 2 parts"),
    (
        "(and (Held r b))",
        "(always (Held r b))",
        MalformedPddlError,
        "5:10: constraints (always) are not supported",
    ),
    (
        "(:init (Free r))",
        "(:init (at 5 (Free r)))",
        MalformedPddlError,
        "4:10: timed literals (as of durative actions) are not",
    ),
    ("(:goal (and (Held r b)))", "", MalformedPddlError, "1:18: p needs one entry in :goal"),
    (
        "(:goal",
        "(:metric maximize (total-cost)) (:goal",
        MalformedPddlError,
        "5:3: numeric fluents in a metric other than minimize (total-cost) are not supported",
    ),
]

GOAL_ERRORS = [
    ("", MalformedPddlError, "1:1: there is nothing"),
    ("On", MalformedPddlError, "1:1: expected '(', found 'On'"),
    ("On(block1, target)", MalformedPddlError, "1:1: On(block1, target) is not PDDL: write (On b"),
    ("(and\n  (On block1 moon))", UnknownObjectError, "2:14: unknown object 'moon'; known here: b"),
    ("(and\n  (Onn block1 target))", UnknownPredicateError, "2:4: unknown predicate 'Onn'"),
    ("(On block1)", MismatchedAtomError, "1:2: On takes 2 objects, got 1"),
    ("(On target block1)", MismatchedAtomError, "1:2: On wants a block, but target is a surface"),
    ("(not (On block1 target))", MalformedPddlError, "1:1: negative conditions are not supported"),
    ("(exists (?b - block) (On ?b target))", MalformedPddlError, "1:1: quantifiers are not"),
    ("(On (block1) target)", MalformedPddlError, "1:5: expected an argument, found a list"),
    ("(On block1 target))", MalformedPddlError, "1:19: ')' closes nothing"),
    ("(On block1\n target", MalformedPddlError, "1:1: '(' is never closed"),
]


@pytest.mark.parametrize(("old", "new", "error", "message"), DOMAIN_ERRORS)
def test_malformed_domains(old: str, new: str, error: type[SlapError], message: str) -> None:
    assert FRAME.count(old) == 1
    with pytest.raises(error) as raised:
        parse_domain(FRAME.replace(old, new), "d.pddl")
    assert str(raised.value).startswith(f"d.pddl:{message}")


@pytest.mark.parametrize(("old", "new", "error", "message"), PROBLEM_ERRORS)
def test_malformed_problems(old: str, new: str, error: type[SlapError], message: str) -> None:
    assert PROBLEM.count(old) == 1
    with pytest.raises(error) as raised:
        parse_problem(PROBLEM.replace(old, new), parse_domain(FRAME), "p.pddl")
    assert str(raised.value).startswith(f"p.pddl:{message}")


@pytest.mark.parametrize(("text", "error", "message"), GOAL_ERRORS)
def test_malformed_goals(text: str, error: type[SlapError], message: str) -> None:
    with pytest.raises(error) as raised:
        parse_goal(text, SPACE)
    assert str(raised.value).startswith(f"<goal>:{message}")


def test_an_atom_of_pddl_may_relate_an_object_to_itself() -> None:
    domain = parse_domain(UNTYPED)
    text = "(define (problem p) (:domain gripper) (:objects a) (:init (at a a)) (:goal (and)))"
    problem = parse_problem(text, domain)
    assert [str(atom) for atom in problem.init] == ["at(a, a)"]
    space = problem.atom_space(domain)
    assert list(space.decode(space.mask(problem.init))) == list(problem.init)


def test_an_atom_of_a_world_relates_different_objects() -> None:
    with pytest.raises(MismatchedAtomError, match=r"^<goal>:1:2: Overlap relates different"):
        parse_goal("(Overlap block1 block1)", SPACE)


def test_hierarchies_have_a_limit() -> None:
    """Types are compared by recursion."""
    chain = " ".join(f"t{i} - t{i + 1}" for i in range(2000))
    with pytest.raises(MalformedPddlError, match="more than 100 types below t101"):
        parse_domain(f"(define (domain d) (:types {chain} t2000))")


@st.composite
def garbled(draw: st.DrawFn, text: str) -> str:
    """A text with some stretches replaced by others, or cut off."""
    pieces = st.one_of(
        st.text(max_size=4),
        st.sampled_from(["(", ")", "-", "?", ";", "\n", " and ", "(not ", " object ", "(either"]),
        st.tuples(st.integers(0, len(text)), st.integers(1, 30)).map(
            lambda span: text[span[0] : span[0] + span[1]]
        ),
    )
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        stop = start + draw(st.integers(0, 12))
        text = text[:start] + draw(pieces) + text[stop:]
    return text[: draw(st.integers(0, len(text)))] if draw(st.booleans()) else text


def read_or_refuse(read: Callable[[], object]) -> None:
    try:
        read()
    except SlapError as error:
        assert str(error).startswith("<")  # begins with a position
        assert ":" in str(error)


@given(garbled(FRAME))
@settings(max_examples=200, deadline=None)
def test_garbled_domains_are_refused_or_read(text: str) -> None:
    read_or_refuse(lambda: parse_domain(text))


@given(garbled(PROBLEM))
@settings(max_examples=200, deadline=None)
def test_garbled_problems_are_refused_or_read(text: str) -> None:
    domain = parse_domain(FRAME)
    read_or_refuse(lambda: parse_problem(text, domain))


@given(st.one_of(garbled("(and (On block1 target) (GripperEmpty robot))"), st.text()))
@settings(max_examples=200, deadline=None)
def test_garbled_goals_are_refused_or_read(text: str) -> None:
    read_or_refuse(lambda: parse_goal(text, SPACE))


@pytest.mark.parametrize("end", range(len(FRAME.rstrip())))
def test_truncated_domains_are_refused(end: int) -> None:
    with pytest.raises(MalformedPddlError):
        parse_domain(FRAME[:end])


# -- refusals: names and parts --------------------------------------------------------------------

THING = Type("thing")


@pytest.mark.parametrize("name", ["", "a b", "a(b", "1st", "-a", "?a", "a;b", "äh", "a\n", "Not"])
def test_names_that_pddl_cannot_hold(name: str) -> None:
    predicate = Predicate(name, (), no_classifier)
    operator = LiftedOperator(name, (), frozenset(), frozenset(), frozenset())
    variable = Variable(f"?{name}", THING)
    of_variable = LiftedOperator("o", (variable,), frozenset(), frozenset(), frozenset())
    for write in (
        lambda: write_domain(name, [], [], []),
        lambda: write_domain("d", [Type(name)], [], []),
        lambda: write_domain("d", [], [predicate], []),
        lambda: write_domain("d", [], [], [operator]),
        lambda: write_domain("d", [THING], [], [of_variable]),
        lambda: write_problem(name, "d", [], [], []),
        lambda: write_problem("p", name, [], [], []),
        lambda: write_problem("p", "d", [THING(name)], [], []),
        lambda: write_problem("p", "d", [Type(name)("a")], [], []),
        lambda: write_problem("p", "d", [], [], [predicate()]),
    ):
        with pytest.raises(MalformedPddlError, match="cannot name a"):
            write()


def test_variables_begin_with_a_question_mark() -> None:
    operator = LiftedOperator("o", (Variable("a", THING),), frozenset(), frozenset(), frozenset())
    with pytest.raises(MalformedPddlError, match="'a' cannot name a variable"):
        write_domain("d", [THING], [], [operator])


def test_names_that_differ_in_case_alone() -> None:
    with pytest.raises(MalformedPddlError, match="two objects named 'A'"):
        write_problem("p", "d", [THING("a"), THING("A")], [], [])
    with pytest.raises(MalformedPddlError, match="two types named 'Thing'"):
        write_domain("d", [THING, Type("Thing")], [], [])


def test_parts_that_are_missing() -> None:
    seen = Predicate("Seen", (THING,), no_classifier)
    variable = Variable("?x", THING)
    look = LiftedOperator(
        "Look", (variable,), frozenset(), frozenset({LiftedAtom(seen, (variable,))}), frozenset()
    )
    with pytest.raises(InvalidDomainError, match="type small uses thing"):
        write_domain("d", [Type("small", parent=THING)], [], [])
    with pytest.raises(InvalidDomainError, match="predicate Seen uses thing"):
        write_domain("d", [], [seen], [])
    with pytest.raises(InvalidDomainError, match=r"operator Look\(\?x\) uses thing"):
        write_domain("d", [], [], [look])
    with pytest.raises(InvalidDomainError, match=r"operator Look\(\?x\) uses Seen"):
        write_domain("d", [THING], [], [look])
    with pytest.raises(InvalidDomainError, match="type thing: PDDL has a type 'object'"):
        write_domain("d", [Type("object"), THING], [], [])
    with pytest.raises(InvalidDomainError, match="type Object: PDDL has a type 'object'"):
        write_domain("d", [Type("Object")], [], [])
    with pytest.raises(UnknownObjectError, match=r"a in Seen\(a\) is not among"):
        write_problem("p", "d", [], [seen(THING("a"))], [])
