# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What PDDL means: plans are checked by an interpreter that shares no code with the planner."""

from __future__ import annotations

from collections import deque
from itertools import product
from random import Random

import pytest

from slap_ros.cli.plan_pddl import PddlPlan, find_pddl_plan
from slap_ros.errors import MalformedPddlError, UnsolvableError
from slap_ros.relational.pddl import parse_domain, parse_problem
from slap_ros.relational.pddl.grounder import ground_task
from slap_ros.relational.pddl.tokens import decode
from tools.check_plan import Change, InvalidPlanError, World, check, read_steps, typed


def plan(domain: str, problem: str, planner: str = "astar") -> PddlPlan:
    """A plan that the interpreter accepts, with the cost that the interpreter finds."""
    stated = parse_domain(domain)
    found = find_pddl_plan(stated, parse_problem(problem, stated), planner)
    cost = check(World.read(domain, problem), read_steps("\n".join(found.steps)))
    assert found.cost in (None, cost)
    return found


def domain(actions: str, predicates: str = "(p ?x) (q ?x) (r ?x ?y) (done)", more: str = "") -> str:
    return f"(define (domain d) {more} (:predicates {predicates}) {actions})"


def problem(init: str, goal: str, objects: str = "a b c", more: str = "") -> str:
    return (
        f"(define (problem e) (:domain d) (:objects {objects}) (:init {init}) "
        f"(:goal {goal}) {more})"
    )


def act(effect: str, precondition: str = "()", parameters: str = "") -> str:
    return f"(:action act :parameters ({parameters}) :precondition {precondition} :effect {effect})"


# -- each construct by itself: domain, problem, the shortest plan ----------------------------------

CONSTRUCTS = {
    "one object for two parameters": (
        domain(act("(q ?x)", "(and (p ?x) (p ?y))", "?x ?y")),
        problem("(p a)", "(q a)"),
        ["(act a a)"],
    ),
    "parameters that differ": (
        domain(act("(q ?x)", "(and (p ?x) (p ?y) (not (= ?x ?y)))", "?x ?y")),
        problem("(p a) (p b)", "(q a)"),
        ["(act a b)"],
    ),
    "parameters that are equal": (
        domain(act("(q ?x)", "(and (p ?x) (= ?x ?y))", "?x ?y")),
        problem("(p b)", "(q b)"),
        ["(act b b)"],
    ),
    "an atom with one object twice": (
        domain(act("(q ?x)", "(r ?x ?x)", "?x")),
        problem("(r a a) (r a b)", "(q a)"),
        ["(act a)"],
    ),
    "a predicate declared with one variable twice": (
        domain(act("(q ?x)", "(r ?x ?y)", "?x ?y"), "(q ?x) (r ?x ?x)"),
        problem("(r a b)", "(q a)"),
        ["(act a b)"],
    ),
    "variables without a blank between them": (
        domain(act("(q ?x)", "(r ?x?y)", "?x?y")),
        problem("(r a b)", "(q a)"),
        ["(act a b)"],
    ),
    "constants after predicates, untyped": (
        domain("(:constants k)" + act("(q k)", "(p k)")),
        problem("(p k)", "(q k)"),
        ["(act)"],
    ),
    "constants with types, listed again": (
        domain(act("(q k)", "(p ?x)", "?x - t"), more="(:types t) (:constants k - t)"),
        problem("(p k)", "(q k)", "k - t a - t"),
        ["(act k)"],
    ),
    "negative preconditions": (
        domain(
            act("(q ?x)", "(not (p ?x))", "?x")
            + "(:action clear :parameters (?x) :precondition (p ?x) :effect (not (p ?x)))"
        ),
        problem("(p a)", "(q a)"),
        ["(clear a)", "(act a)"],
    ),
    "negative goals": (
        domain(act("(not (p ?x))", "()", "?x")),
        problem("(p a) (p b)", "(and (not (p a)) (not (p c)))"),
        ["(act a)"],
    ),
    "an operator that only does what should not hold": (
        domain(
            act("(not (p ?x))", "()", "?x")
            + "(:action spoil :parameters (?x) :precondition (q ?x) :effect (p ?x))"
            + "(:action stop :parameters (?x) :precondition (q ?x) :effect (not (q ?x)))"
        ),
        problem("(p a) (q a)", "(not (p a))"),
        ["(act a)"],
    ),
    "disjunctions": (
        domain(
            act("(q ?x)", "(or (p ?x) (r ?x ?x) (and (p b) (p c)))", "?x"),
            more="(:constants b c)",
        ),
        problem("(p b) (p c)", "(and (q a) (or (q c) (q b)))"),
        ["(act a)", "(act b)"],
    ),
    "implications": (
        domain(
            act("(q ?x)", "(imply (p ?x) (r ?x ?x))", "?x") + "(:action add "
            ":parameters (?x) :effect (r ?x ?x))"
        ),
        problem("(p a)", "(and (q a) (q b))"),
        ["(act b)", "(add a)", "(act a)"],
    ),
    "universal preconditions": (
        domain(
            act("(done)", "(forall (?x) (or (p ?x) (q ?x)))") + "(:action add "
            ":parameters (?x) :effect (q ?x))"
        ),
        problem("(p a) (p b)", "(done)"),
        ["(add c)", "(act)"],
    ),
    "existential preconditions": (
        domain(
            act("(done)", "(exists (?x ?y) (and (r ?x ?y) (not (= ?x ?y)) (p ?y)))")
            + "(:action add :parameters (?x) :precondition (r ?x ?x) :effect (p ?x))"
        ),
        problem("(r a b) (r b b)", "(done)"),
        ["(add b)", "(act)"],
    ),
    "quantified goals": (
        domain(act("(p ?x)", "()", "?x")),
        problem("(p a)", "(and (forall (?x) (p ?x)) (exists (?x) (p ?x)))"),
        ["(act b)", "(act c)"],
    ),
    "conditional effects, judged before anything changes": (
        domain(act("(and (when (p ?x) (not (p ?x))) (when (not (p ?x)) (p ?x)))", "()", "?x")),
        problem("(p a)", "(and (not (p a)) (p b))"),
        ["(act a)", "(act b)"],
    ),
    "effects on all objects": (
        domain(act("(forall (?y) (when (r ?x ?y) (and (p ?y) (not (r ?x ?y)))))", "(q ?x)", "?x")),
        problem("(q a) (r a b) (r a c)", "(and (p b) (p c) (not (r a b)))"),
        ["(act a)"],
    ),
    "delete, then add": (
        domain(act("(and (not (p ?x)) (p ?y) (q ?x))", "(p ?x)", "?x ?y")),
        problem("(p a)", "(and (p a) (q a))"),
        ["(act a a)"],
    ),
    "(not ...) and repeated atoms in :init": (
        domain(act("(q ?x)", "(p ?x)", "?x")),
        problem("(p a) (not (q a)) (p a) (not (p b))", "(q a)"),
        ["(act a)"],
    ),
    "no :parameters, no :precondition": (
        domain("(:action act :effect (done))"),
        problem("", "(done)", ""),
        ["(act)"],
    ),
    "alternative types": (
        domain(
            act("(q ?x)", "(p ?x)", "?x - (either s u)"),
            "(p ?x - (either s t u)) (q ?x - (either s t u))",
            "(:requirements:typing:adl) (:types s t u)",
        ),
        problem("(p a) (p b)", "(exists (?x - s) (q ?x))", "a - t b - s"),
        ["(act b)"],
    ),
    "several parents, and a type listed twice": (
        domain(
            act("(done)", "(and (p ?x) (q ?x))", "?x - s"),
            "(p ?x - t) (q ?x - u) (done)",
            "(:types s - t s - u t u - thing)",
        ),
        problem("(p a) (q a)", "(done)", "a - s"),
        ["(act a)"],
    ),
    "an object of several types": (
        domain(
            act("(done)", "(and (p ?x) (q ?y))", "?x - s ?y - t"),
            "(p ?x - s) (q ?x - t) (done)",
            "(:types s t)",
        ),
        problem("(p a) (q a)", "(done)", "a - (either s t)"),
        ["(act a a)"],
    ),
    "the :vars of 1998": (
        domain("(:action act :parameters (?x) :vars (?y) :precondition (r ?x ?y) :effect (q ?y))"),
        problem("(r a b)", "(q b)"),
        ["(act a b)"],
    ),
    ":length, :timeless and total-time": (
        domain("(:constants k) (:timeless (p k))" + act("(done)", "(p k)")),
        problem(
            "", "(done)", "", "(:length (:serial 3) (:parallel 3)) (:metric minimize (total-time))"
        ),
        ["(act)"],
    ),
    "least cost rather than fewest operators": (
        domain(
            "(:action fly :parameters (?x ?y) :precondition (p ?x) :effect (and (p ?y) "
            "(not (p ?x)) (increase (total-cost) (+ 1 (* 2 (far ?x ?y))))))"
            "(:action rest :effect (and (done) (increase (total-cost) 0.5)))",
            more="(:functions (total-cost) - number (far ?x ?y) - number)",
        ),
        problem(
            "(p a) (= (total-cost) 0) (= (far a c) 9) (= (far a b) 1) (= (far b c) 2)",
            "(and (p c) (done))",
            more="(:metric minimize (total-cost))",
        ),
        ["(fly a b)", "(fly b c)", "(rest)"],
    ),
}


@pytest.mark.parametrize("name", CONSTRUCTS)
def test_constructs(name: str) -> None:
    domain_text, problem_text, shortest = CONSTRUCTS[name]
    assert sorted(plan(domain_text, problem_text).steps) == sorted(shortest)
    for planner in ("lazy", "ff"):
        assert plan(domain_text, problem_text, planner).steps


def test_least_cost_is_proven() -> None:
    domain_text, problem_text, _ = CONSTRUCTS["least cost rather than fewest operators"]
    found = plan(domain_text, problem_text, "lazy")
    assert (found.cost, found.is_cheapest) == (8.5, True)  # 1 + 2 * 1, 1 + 2 * 2, 0.5


def test_both_definitions_in_one_file() -> None:
    domain_text, problem_text, shortest = CONSTRUCTS["disjunctions"]
    for text in (domain_text + problem_text, problem_text + "\n; domain:\n" + domain_text):
        assert sorted(plan(text, text).steps) == shortest


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings(encoding: str) -> None:
    text = "; für alle\r\n" + CONSTRUCTS["disjunctions"][0]
    assert decode(text.encode(encoding)) == text.replace("\r\n", "\n")
    assert parse_domain(decode(text.encode(encoding))).name == "d"


def test_a_byte_order_mark_is_no_word() -> None:
    assert parse_domain("\ufeff" + domain("")).name == "d"


def test_what_no_problem_can_reach_is_unsolvable() -> None:
    text = domain(act("(and (p ?x) (not (q ?x)))", "(q ?x)", "?x"))
    for goal in ("(p b)", "(and (p a) (q a))", "(not (= a a))"):
        with pytest.raises(UnsolvableError):
            plan(text, problem("(q a)", goal))
        with pytest.raises(UnsolvableError):
            plan(text, problem("(q a)", goal), "ff")


def test_a_negative_cost_is_refused_with_its_place() -> None:
    text = domain(act("(and (done) (increase (total-cost) -1))"), more="(:functions (total-cost))")
    stated = parse_domain(text, "d.pddl")
    task = parse_problem(problem("", "(done)", more="(:metric minimize (total-cost))"), stated)
    with pytest.raises(MalformedPddlError, match=r"d.pddl:1:\d+: operator act has a cost of -1"):
        ground_task(stated, task)


def test_a_second_value_is_refused_with_its_place_unless_it_is_the_same() -> None:
    text = domain(act("(and (done) (increase (total-cost) (toll)))"), more="(:functions (toll))")
    stated, metric = parse_domain(text), "(:metric minimize (total-cost))"
    twice = parse_problem(problem("(= (toll) 2) (= (toll) 2.0)", "(done)", more=metric), stated)
    assert twice.values == {("toll", ()): 2.0}
    with pytest.raises(MalformedPddlError, match=r":\d+:\d+: \(toll\) is 3 here and 2 before"):
        parse_problem(problem("(= (toll) 2) (= (toll) 3)", "(done)", more=metric), stated)


def test_only_what_leads_to_the_goal_gets_bits() -> None:
    text = domain(
        act("(and (done) (not (q ?x)))", "(p ?x)", "?x")
        + "(:action waste :parameters (?x ?y) :effect (r ?x ?y))"
    )
    stated = parse_domain(text)
    task = ground_task(stated, parse_problem(problem("(p a)", "(done)"), stated))
    assert [action.name for action in task.actions] == ["(act a)"]
    assert task.size == 1


# -- random domains, against exhaustive search by the interpreter ---------------------------------


def random_condition(rng: Random, variables: list[str], depth: int = 2) -> str:
    kind = rng.choice(["atom"] * 3 + ["not", "and", "or", "imply", "forall", "exists", "="])
    if depth == 0 or kind == "atom":
        return random_atom(rng, variables)
    if kind == "=":
        return f"(= {rng.choice(variables)} {rng.choice(variables)})"
    if kind in ("forall", "exists"):
        name = f"?v{depth}"
        body = random_condition(rng, [*variables, name], depth - 1)
        return f"({kind} ({name}{rng.choice(['', ' - t'])}) {body})"
    count = {"not": 1, "imply": 2}.get(kind, rng.randint(0, 3))
    parts = " ".join(random_condition(rng, variables, depth - 1) for _ in range(count))
    return f"({kind} {parts})"


def random_atom(rng: Random, variables: list[str]) -> str:
    name, arity = rng.choice([("p", 1), ("q", 1), ("r", 2), ("s", 1), ("done", 0)])
    return f"({' '.join([name, *(rng.choice(variables) for _ in range(arity))])})"


def random_effect(rng: Random, variables: list[str], depth: int = 2) -> str:
    kind = rng.choice(["add"] * 2 + ["not", "and", "and", "when", "forall"])
    if depth == 0 or kind in ("add", "not"):
        atom = random_atom(rng, variables).replace("(s ", "(p ")  # s is static
        return f"(not {atom})" if kind == "not" else atom
    if kind == "when":
        condition = random_condition(rng, variables, 1)
        return f"(when {condition} {random_effect(rng, variables, depth - 1)})"
    if kind == "forall":
        name = f"?w{depth}"
        return f"(forall ({name}) {random_effect(rng, [*variables, name], depth - 1)})"
    parts = [random_effect(rng, variables, depth - 1) for _ in range(rng.randint(1, 3))]
    return f"(and {' '.join(parts)})"


def random_domain(rng: Random) -> str:
    """Operators of any kind over a few predicates."""
    actions = []
    for number in range(rng.randint(1, 3)):
        names = [f"?x{i}" for i in range(rng.randint(0, 2))]
        parameters = " ".join(name + rng.choice(["", " - t"]) for name in names)
        condition = " ".join(random_condition(rng, [*names, "k"]) for _ in range(rng.randint(0, 2)))
        effect = random_effect(rng, [*names, "k"])
        actions.append(
            f"(:action a{number} :parameters ({parameters}) :precondition (and {condition}) "
            f":effect {effect})"
        )
    predicates = "(p ?x) (q ?x) (r ?x ?y) (s ?x) (done)"
    return domain(" ".join(actions), predicates, "(:types t) (:constants k)")


def whole(state: frozenset[tuple[str, ...]]) -> str:
    """The condition that a state and no other fulfils."""
    atoms = [*product("pq", "ak"), *product("r", "ak", "ak"), ("done",)]
    parts = (f"({' '.join(a)})" if a in state else f"(not ({' '.join(a)}))" for a in atoms)
    return f"(and {' '.join(parts)})"


def shortest_lengths(world: World) -> dict[frozenset[tuple[str, ...]], int]:
    """How many steps lead to each state, by breadth-first search over sets of atoms."""
    steps = [
        (action, {name: obj for (name, _), obj in zip(entries, chosen, strict=True)})
        for action in world.actions.values()
        for entries in [list(typed(action.get(":parameters", [])))]
        for chosen in product(
            *([o for o, has in world.objects.items() if has & set(kinds)] for _, kinds in entries)
        )
    ]
    start = frozenset(world.start)
    lengths, queue = {start: 0}, deque([start])
    while queue:
        state = queue.popleft()
        for action, binding in steps:
            if world.holds(action[":precondition"], set(state), binding):
                change = Change()
                world.change(action[":effect"], set(state), binding, change)
                following = frozenset((state - change.deleted) | change.added)
                if following not in lengths:
                    lengths[following] = lengths[state] + 1
                    queue.append(following)
    return lengths


@pytest.mark.parametrize("block", range(8))
def test_random_domains_mean_what_the_interpreter_says(block: int) -> None:
    """Goals are a state that is farthest away, whole, and any condition."""
    for seed in range(block * 20, block * 20 + 20):
        rng = Random(seed)
        text = random_domain(rng)
        init = {random_atom(rng, ["a", "k"]) for _ in range(rng.randint(0, 5))}
        atoms = " ".join(sorted(init))
        world = World.read(text, problem(atoms, "()", "a - t"))
        lengths = shortest_lengths(world)
        for goal in (
            whole(max(lengths, key=lengths.__getitem__)),
            random_condition(rng, ["a", "k"]),
        ):
            texts = text, problem(atoms, goal, "a - t")
            condition = World.read(*texts).goal
            reached = [n for s, n in lengths.items() if world.holds(condition, set(s), {})]
            if not reached:
                for planner in ("astar", "ff"):
                    with pytest.raises(UnsolvableError):
                        plan(*texts, planner)
            else:
                assert len(plan(*texts).steps) == min(reached), texts
                assert len(plan(*texts, "ff").steps) >= min(reached)


# -- the interpreter itself ------------------------------------------------------------------------


def test_the_interpreter_refuses_wrong_plans() -> None:
    domain_text, problem_text, _ = CONSTRUCTS["negative preconditions"]
    world = World.read(domain_text, problem_text)
    for steps, reason in (
        ("(act a)", r"step 1: \(act a\) is not possible"),
        ("(clear a)", "the goal does not hold after 1 steps"),
        ("(clear a b)", "takes 1 objects"),
        ("(jump a)", "there is no operator jump"),
        ("(clear d)", "d cannot be"),
    ):
        with pytest.raises(InvalidPlanError, match=reason):
            check(world, read_steps(steps))
