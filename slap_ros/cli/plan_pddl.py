# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan`` with two PDDL files; needs no domain, no shortcuts and no pictures."""

from __future__ import annotations

from pathlib import Path

from slap_ros.cli.console import console, print_json
from slap_ros.errors import InvalidParameterError, PlanningLimitError
from slap_ros.files import read_text
from slap_ros.planning.ff import MAX_EXPANSIONS, MAX_TESTS, find_operator_sequence
from slap_ros.relational import AtomSpace, ground_operators
from slap_ros.relational.grounding import MAX_BINDINGS
from slap_ros.relational.pddl import PddlDomain, PddlProblem, parse_domain, parse_problem


def plan_pddl(domain_file: Path, problem_file: Path, effort: int, json: bool) -> None:
    """Plan with the FF heuristic and print the operators.

    Args:
        domain_file: PDDL domain.
        problem_file: PDDL problem of that domain.
        effort: Factor of the limits of planning.
        json: Whether stdout gets JSON.

    Raises:
        InvalidParameterError: A file cannot be read.
        InvalidDomainError: What is in it is not understood.
        UnsolvableError: The goal cannot be reached.
        PlanningLimitError: A limit was reached first.
    """
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
        effort: Factor of the limits of planning.

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
