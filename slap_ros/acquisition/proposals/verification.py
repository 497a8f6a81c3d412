# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators judged together: is there a plan, and if not, why not (LG-SAIL §4.1).

The paper feeds back the operators that cannot be reached. That is not enough: its own printed
operators of PegInHole can all be reached, and each goal atom too, but never both, since nothing
gives HandEmpty back. So all abstract states are enumerated where they are few enough, and what is
said is what was seen there: preconditions that are never true, cycles, goal atoms that are never
reached or never together, and what is taken away for good.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass
from slap_ros.acquisition.proposals.culprits import SUBJECT
from slap_ros.acquisition.proposals.impossible_operators import ImpossibleOperators
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.reachable_states import ReachableStates, most_states
from slap_ros.acquisition.proposals.unreachable_goal import UnreachableGoal
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.relational import GroundOperator, LiftedOperator, Variable, ground_operators

MAX_COMPARED = 6  # parameters of operators that are compared in every order


@dataclass(frozen=True)
class Verification:
    """The result of a verification.

    Args:
        plan: Shortest plan; None where there is none.
        complaints: Complaints that say why there is no plan; warnings where there is one.
        culprits: Names of operators to be asked for again, in order; none where there is a plan.
    """

    plan: tuple[GroundOperator, ...] | None
    complaints: tuple[Complaint, ...]
    culprits: tuple[str, ...]


def verify(operators: Sequence[LiftedOperator], problem: AcquisitionProblem) -> Verification:
    """Whether the operators, each sound by itself, make a plan for the problem."""
    if duplicates := _duplicates(operators):
        complaints, culprits = duplicates
        return Verification(None, complaints, culprits)
    try:
        grounded = ground_operators(operators, problem.space)
        sequence = find_shortest_sequence(
            problem.start_mask, problem.goal_mask, grounded, most_states(grounded)
        )
    except PlanningLimitError as error:
        complaint = Complaint(ComplaintClass.TOO_LARGE, SUBJECT, str(error))
        return Verification(None, (complaint,), tuple(op.name for op in operators))
    except UnsolvableError:
        return _refuted(operators, grounded, problem)
    reached = ReachableStates.of(problem.start_mask, grounded)
    unused = ImpossibleOperators(operators, grounded, problem, reached).culprits()
    warnings = tuple(replace(one.complaint, warning=True) for one in unused)
    return Verification(tuple(grounded[i] for i in sequence), warnings, ())


def _refuted(
    operators: Sequence[LiftedOperator],
    grounded: Sequence[GroundOperator],
    problem: AcquisitionProblem,
) -> Verification:
    """Why operators make no plan: all complaints, and the operators to be asked for again."""
    reached = ReachableStates.of(problem.start_mask, grounded)
    impossible = ImpossibleOperators(operators, grounded, problem, reached)
    never = impossible.culprits()
    goal = UnreachableGoal(operators, grounded, problem, reached, impossible).culprits()
    at_fault = [one.operators for one in never] or [goal.operators]
    names = [op.name for op in operators]
    chosen = frozenset().union(*at_fault) or set(names)
    ordered = tuple(name for name in names if name in chosen)
    complaints = (*(one.complaint for one in never), goal.complaint)
    return Verification(None, complaints, ordered)


def _duplicates(
    operators: Sequence[LiftedOperator],
) -> tuple[tuple[Complaint, ...], tuple[str, ...]] | None:
    """Operators of one name, or that say the same of other variables."""
    for i, one in enumerate(operators):
        for other in operators[:i]:
            if one.name.lower() == other.name.lower():
                fact = f"two operators are named {one.name}"
            elif _same(one, other):
                fact = f"{one.name} and {other.name} need and change the same"
            else:
                continue
            complaint = Complaint(ComplaintClass.DUPLICATE, f"operator {one.name}", fact)
            return (complaint,), (one.name,)
    return None


def _same(one: LiftedOperator, other: LiftedOperator) -> bool:
    """Whether two operators are the same up to their variables' names and order."""
    if len(one.parameters) != len(other.parameters) or len(one.parameters) > MAX_COMPARED:
        return False
    wanted = _parts(other, {v: i for i, v in enumerate(other.parameters)})
    return any(
        all(v.type == w.type for v, w in zip(order, other.parameters, strict=True))
        and _parts(one, {v: i for i, v in enumerate(order)}) == wanted
        for order in permutations(one.parameters)
    )


def _parts(operator: LiftedOperator, numbers: dict[Variable, int]) -> list[frozenset[object]]:
    """PRE, EFF+, EFF- and what must differ, with numbers for variables."""
    differ = (frozenset((numbers[one], numbers[other])) for one, other in operator.inequalities)
    return [
        frozenset(differ),
        *(
            frozenset((atom.predicate, tuple(numbers[v] for v in atom.variables)) for atom in atoms)
            for atoms in (operator.preconditions, operator.add_effects, operator.delete_effects)
        ),
    ]
