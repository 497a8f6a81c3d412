# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan`` for a task of a domain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from slap_ros.api.planning import plan_task as make_plan
from slap_ros.api.shortcut_choice import shortcuts_of_option
from slap_ros.cli.console import console, print_json, print_result, warn
from slap_ros.cli.outputs import write_files
from slap_ros.core import Domain, Task
from slap_ros.drawing import draw_abstract_graph
from slap_ros.planning.abstract_graph import AbstractGraph, build_abstract_graph
from slap_ros.planning.anytime import PlanningInterrupted
from slap_ros.planning.plan import PlanningResult, bound_as_text
from slap_ros.planning.problem import Problem
from slap_ros.planning.symbolic_planner import plan_symbolically
from slap_ros.relational import AtomSpace, LiftedOperator, ground_operators
from slap_ros.relational.articles import counted
from slap_ros.relational.pddl import with_different_objects, write_domain, write_problem
from slap_ros.versions import versions


def plan_task(
    domain: Domain,
    task: Task,
    planner: str,
    shortcuts: str | None,
    samples: int,
    output: Path | None,
    json: bool,
) -> None:
    """Plan a task and print the plan; write its PDDL and draw its abstract graph.

    Args:
        domain: Domain of the task. Without skills, its hand-written operators are planned with.
        task: Start and goal.
        planner: Name of the planner.
        shortcuts: Folder of a shortcut library, or none; None for the shipped one.
        samples: Attempts of a shortcut in the model.
        output: Folder for domain.pddl, problem.pddl and graph.svg, if they are wanted.
        json: Whether stdout gets JSON.

    Raises:
        SlapError: There is no plan, or it cannot be written.
    """
    if not domain.operators and domain.acquisition and domain.acquisition.operators:
        _plan_by_hand(domain, domain.acquisition.operators, task, output, json)
        return
    try:
        result = make_plan(domain, task, shortcuts_of_option(shortcuts), planner, samples, warn)
    except PlanningInterrupted as interrupted:
        console.print("interrupted; the best plan so far:")
        _show(interrupted.best, json)
        raise interrupted.interrupt from None
    _show(result, json)
    if output is not None:
        space = domain.atom_space(task.initial_state)
        graph = draw_abstract_graph(
            _graph(domain, task, space), space, result.plan, f"{domain.name}: plan"
        )
        _write(output, _pddl(domain, domain.operators, task) | {"graph.svg": graph})


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
            print_result(name)
        console.print(
            f"{counted(len(names), 'operator')}, the fewest; they are the domain's hand-written "
            f"ones, as {domain.name} has no skills yet: steps are not predicted"
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
                "bound": result.bound,
                "versions": versions(),
            }
            | ({"fails": result.fails} if result.fails else {})
        )
        return
    for option, steps in edges:
        print_result(f"{steps:5d}  {option}")
    if result.fails:
        console.print(f"this plan fails in the model, near the goal: {result.fails}")
    bound = "" if result.bound is None else f"; bound {bound_as_text(result.bound)}"
    console.print(
        f"{result.plan.predicted_steps:5d}  steps predicted; {result.graph_nodes} abstract states, "
        f"{result.graph_edges} edges, {result.edges_rolled_out} rolled out{bound}",
    )


def _pddl(domain: Domain, operators: Sequence[LiftedOperator], task: Task) -> dict[str, str]:
    """Domain and problem as files."""
    space = domain.atom_space(task.initial_state)
    init = tuple(space.decode(space.abstract(task.initial_state)))
    objects = space.layout.objects
    return {
        "domain.pddl": write_domain(
            domain.name, domain.types, domain.predicates, with_different_objects(operators)
        ),
        "problem.pddl": write_problem("task", domain.name, objects, init, task.goal),
    }


def _write(folder: Path, files: Mapping[str, str]) -> None:
    """Write texts by file name, and say where."""
    for path in write_files(folder, files):
        console.print(f"wrote {path}")


def _graph(domain: Domain, task: Task, space: AtomSpace) -> AbstractGraph:
    operators = Problem.of(domain, task.initial_state).operators
    start = space.abstract(task.initial_state)
    return build_abstract_graph(start, space.mask(task.goal), operators)
