# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slap_ros.cli.console import console, print_json
from slap_ros.cli.options import Goal, Index, Json, Planner, Preset, Seed
from slap_ros.cli.shortcuts import SAMPLES, Samples, Shortcuts, choose, sampling
from slap_ros.core import Domain, Task
from slap_ros.domains import get_domain
from slap_ros.drawing import draw_abstract_graph
from slap_ros.errors import InvalidParameterError, PlanningLimitError, StorageFullError
from slap_ros.evaluation.approaches import approaches
from slap_ros.files import read_text, require_writable, write_whole
from slap_ros.planning.abstract_graph import AbstractGraph, build_abstract_graph
from slap_ros.planning.ff import MAX_EXPANSIONS, MAX_TESTS, find_operator_sequence
from slap_ros.planning.plan import PlanningResult
from slap_ros.planning.planner import Problem
from slap_ros.relational import AtomSpace, GroundAtom, ground_operators
from slap_ros.relational.grounding import MAX_BINDINGS
from slap_ros.relational.pddl import (
    PddlDomain,
    PddlProblem,
    parse_domain,
    parse_goal,
    parse_problem,
    write_domain,
    write_problem,
)
from slap_ros.versions import versions


def plan(
    domain: Annotated[str, typer.Argument(help="One of `slap domains`, or a PDDL domain file.")],
    problem: Annotated[
        Path | None, typer.Argument(help="With a PDDL domain file: the PDDL problem file.")
    ] = None,
    seed: Seed = 0,
    index: Index = 0,
    preset: Preset = None,
    goal: Goal = None,
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    planner: Planner = "lazy",
    output: Annotated[
        Path | None, typer.Option(help="Folder for domain.pddl, problem.pddl and graph.svg.")
    ] = None,
    effort: Annotated[
        int,
        typer.Option(
            min=1, max=10**6, help="With PDDL files: multiplies the limits of planning, time too."
        ),
    ] = 1,
    json: Json = False,
) -> None:
    """Plan one task without executing it; write its PDDL and draw its abstract graph.

    With two PDDL files: plan symbolically, with the FF heuristic.
    """
    if problem is not None:
        _plan_pddl(Path(domain), problem, effort, json)
        return
    if output is not None:
        require_writable(output)
    chosen = get_domain(domain, preset)
    task = chosen.task(seed, index)
    space = chosen.atom_space(task.initial_state)
    atoms = parse_goal(goal, space) if goal else task.goal
    approach = approaches(choose(shortcuts, chosen, planner), sampling(samples))[-1]
    result = approach.planner(planner, chosen, task.initial_state).plan(
        task.initial_state, space.mask(atoms)
    )
    _show(result, json)
    if output is not None:
        _write(output, chosen, task, atoms, result)


def _show(result: PlanningResult, json: bool) -> None:
    edges = [(str(edge), edge.predicted_steps) for edge in result.plan.edges]
    if json:
        print_json(
            {
                "plan": [{"option": option, "predicted_steps": steps} for option, steps in edges],
                "predicted_steps": result.plan.predicted_steps,
                "graph_nodes": result.graph_nodes,
                "graph_edges": result.graph_edges,
                "edges_rolled_out": result.edges_rolled_out,
                "versions": versions(),
            }
        )
        return
    for option, steps in edges:
        console.print(f"{steps:5d}  {option}")
    console.print(
        f"{result.plan.predicted_steps:5d}  steps predicted; {result.graph_nodes} abstract states, "
        f"{result.graph_edges} edges, {result.edges_rolled_out} rolled out",
    )


def _write(
    folder: Path, domain: Domain, task: Task, goal: frozenset[GroundAtom], result: PlanningResult
) -> None:
    space = domain.atom_space(task.initial_state)
    start = space.abstract(task.initial_state)
    graph = _graph(domain, task, space, goal)
    files = {
        "domain.pddl": write_domain(domain.name, domain.types, domain.predicates, domain.operators),
        "problem.pddl": write_problem(
            "task", domain.name, space.layout.objects, tuple(space.decode(start)), goal
        ),
        "graph.svg": draw_abstract_graph(graph, space, result.plan, f"{domain.name}: plan"),
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            write_whole(folder / name, text)
            console.print(f"wrote {folder / name}")
    except OSError as error:
        raise StorageFullError(f"cannot write to {folder}: {error.strerror}") from error


def _graph(
    domain: Domain, task: Task, space: AtomSpace, goal: frozenset[GroundAtom]
) -> AbstractGraph:
    operators = Problem.of(domain, task.initial_state).operators
    return build_abstract_graph(space.abstract(task.initial_state), space.mask(goal), operators)


def _plan_pddl(domain_file: Path, problem_file: Path, effort: int, json: bool) -> None:
    domain = parse_domain(_read(domain_file), str(domain_file))
    problem = parse_problem(_read(problem_file), domain, str(problem_file))
    space = problem.atom_space(domain)
    try:
        names = _plan_symbolically(domain, problem, space, effort)
    except PlanningLimitError as error:
        raise PlanningLimitError(
            f"{error}; --effort {10 * effort} allows ten times as much"
        ) from error
    if json:
        print_json({"plan": names})
        return
    for name in names:
        console.print(name)
    console.print(f"{len(names)} operators")


def _plan_symbolically(
    domain: PddlDomain, problem: PddlProblem, space: AtomSpace, effort: int
) -> list[str]:
    """The names of operators that lead to the goal.

    Args:
        domain: Types, predicates and operators.
        problem: Objects, start and goal.
        space: The atoms over the objects.
        effort: What the limits are multiplied with.

    Returns:
        Operators with their objects, in order.

    Raises:
        UnsolvableError: The goal cannot be reached.
        PlanningLimitError: A limit was reached first.
    """
    operators = ground_operators(domain.operators, space, effort * MAX_BINDINGS)
    sequence = find_operator_sequence(
        problem.initial_mask(space),
        problem.goal_mask(space),
        operators,
        max_expansions=effort * MAX_EXPANSIONS,
        max_tests=effort * MAX_TESTS,
    )
    return [str(operators[number]) for number in sequence]


def _read(path: Path) -> str:
    try:
        return read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidParameterError(f"cannot read {path}: {error}") from error
