# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.acquisition.domain_choice import SHIPPED
from slap_ros.cli.console import console, print_json
from slap_ros.cli.options import Goal, Index, Json, Planner, Preset, Seed
from slap_ros.cli.shortcuts import SAMPLES, Samples, Shortcuts, choose, sampling
from slap_ros.cli.skill_choice import Skills, open_chosen
from slap_ros.core import Domain, Task, task_with_goal
from slap_ros.drawing import draw_abstract_graph
from slap_ros.errors import InvalidParameterError, PlanningLimitError, StorageFullError
from slap_ros.evaluation.approaches import approaches
from slap_ros.files import read_text, require_writable, write_whole
from slap_ros.planning.abstract_graph import AbstractGraph, build_abstract_graph
from slap_ros.planning.ff import MAX_EXPANSIONS, MAX_TESTS, find_operator_sequence
from slap_ros.planning.plan import PlanningResult
from slap_ros.planning.planner import Problem, plan_symbolically
from slap_ros.relational import AtomSpace, LiftedOperator, ground_operators
from slap_ros.relational.grounding import MAX_BINDINGS
from slap_ros.relational.pddl import (
    PddlDomain,
    PddlProblem,
    parse_domain,
    parse_problem,
    write_domain,
    write_problem,
)
from slap_ros.versions import versions


def plan(
    domain: Annotated[
        str,
        typer.Argument(help="Name of a domain (`slap domains` lists them), or a PDDL domain file."),
    ],
    problem: Annotated[
        Path | None, typer.Argument(help="PDDL problem file. Give it with a PDDL domain file.")
    ] = None,
    seed: Seed = 0,
    index: Index = 0,
    preset: Preset = None,
    goal: Goal = None,
    skills: Skills = SHIPPED,
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    planner: Planner = "lazy",
    output: Annotated[
        Path | None, typer.Option(help="Folder for domain.pddl, problem.pddl and graph.svg.")
    ] = None,
    effort: Annotated[
        int,
        typer.Option(
            min=1,
            max=10**6,
            help="With PDDL files: factor of all limits of planning, and so of its time.",
        ),
    ] = 1,
    json: Json = False,
) -> None:
    """Plan one task without executing it; write its PDDL and draw its abstract graph.

    A domain without skills is planned with its hand-written operators alone. Two PDDL files are
    planned symbolically, with the FF heuristic.
    """
    if problem is not None:
        _plan_pddl(Path(domain), problem, effort, json)
        return
    if output is not None:
        require_writable(output)
    chosen = open_chosen(domain, preset, skills)
    task = task_with_goal(chosen, seed, index, goal)
    if not chosen.operators and chosen.acquisition and chosen.acquisition.operators:
        _plan_by_hand(chosen, chosen.acquisition.operators, task, output, json)
        return
    space = chosen.atom_space(task.initial_state)
    approach = approaches(choose(shortcuts, chosen, planner), sampling(samples))[-1]
    result = approach.planner(planner, chosen, task.initial_state).plan(
        task.initial_state, space.mask(task.goal)
    )
    _show(result, json)
    if output is not None:
        graph = draw_abstract_graph(
            _graph(chosen, task, space), space, result.plan, f"{chosen.name}: plan"
        )
        _write(output, _pddl(chosen, chosen.operators, task) | {"graph.svg": graph})


def _plan_by_hand(
    domain: Domain,
    operators: Sequence[LiftedOperator],
    task: Task,
    output: Path | None,
    json: bool,
) -> None:
    """Plan without skills: a shortest sequence of operators that people wrote.

    Args:
        domain: Without operators of its own.
        operators: Written by hand.
        task: What to plan.
        output: Folder for domain.pddl and problem.pddl, if they are wanted.
        json: Whether stdout gets JSON.
    """
    space = domain.atom_space(task.initial_state)
    grounds = ground_operators(operators, space)
    start = space.abstract(task.initial_state)
    sequence = plan_symbolically(space, start, space.mask(task.goal), grounds)
    names = [str(grounds[number]) for number in sequence]
    if json:
        print_json(
            {
                "plan": [{"operator": name} for name in names],
                "operators": "hand-written",
                "versions": versions(),
            }
        )
    else:
        for name in names:
            console.print(name)
        console.print(
            f"{len(names)} operators, the fewest; they are the domain's hand-written ones, as "
            f"{domain.name} has no skills yet: steps are not predicted"
        )
    if output is not None:
        _write(output, _pddl(domain, operators, task))


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
            | ({"fails": result.fails} if result.fails else {})
        )
        return
    for option, steps in edges:
        console.print(f"{steps:5d}  {option}")
    if result.fails:
        console.print(f"this plan fails in the model, near the goal: {result.fails}")
    console.print(
        f"{result.plan.predicted_steps:5d}  steps predicted; {result.graph_nodes} abstract states, "
        f"{result.graph_edges} edges, {result.edges_rolled_out} rolled out",
    )


def _pddl(domain: Domain, operators: Sequence[LiftedOperator], task: Task) -> dict[str, str]:
    """Domain and problem as files."""
    space = domain.atom_space(task.initial_state)
    init = tuple(space.decode(space.abstract(task.initial_state)))
    objects = space.layout.objects
    return {
        "domain.pddl": write_domain(domain.name, domain.types, domain.predicates, operators),
        "problem.pddl": write_problem("task", domain.name, objects, init, task.goal),
    }


def _write(folder: Path, files: Mapping[str, str]) -> None:
    """Write texts by file name."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            write_whole(folder / name, text)
            console.print(f"wrote {folder / name}")
    except OSError as error:
        raise StorageFullError(f"cannot write to {folder}: {error.strerror}") from error


def _graph(domain: Domain, task: Task, space: AtomSpace) -> AbstractGraph:
    operators = Problem.of(domain, task.initial_state).operators
    start = space.abstract(task.initial_state)
    return build_abstract_graph(start, space.mask(task.goal), operators)


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
