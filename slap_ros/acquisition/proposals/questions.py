# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The questions to a model about a problem, and how answers are judged (LG-SAIL B, C)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass
from slap_ros.acquisition.proposals.drafts import DECOMPOSITION, check_decomposition, check_operator
from slap_ros.acquisition.proposals.inquiry import Question
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.reward_templates import check_rewards
from slap_ros.language.formats import (
    ActionDraft,
    AtomDraft,
    OperatorDraft,
    RewardDraft,
    parse_decomposition,
    parse_operator,
    parse_plan,
    parse_rewards,
    shown,
)
from slap_ros.language.prompts import (
    decomposition_question,
    operator_question,
    plan_question,
    reward_question,
)
from slap_ros.language.schema import (
    decomposition_schema,
    operator_schema,
    plan_schema,
    reward_schema,
)
from slap_ros.relational import (
    GroundOperator,
    LiftedOperator,
    RewardTemplate,
    ground_operators,
)

PLAN = "plan"

Actions = tuple[str, ...]
Plan = tuple[GroundOperator, ...]


def about_decomposition(
    problem: AcquisitionProblem,
) -> Question[tuple[ActionDraft, ...], Actions]:
    """The question which actions a task is made of."""
    text = decomposition_question(
        problem.usable_types, problem.predicates, problem.init, problem.goal
    )
    return Question(
        DECOMPOSITION,
        "decomposition",
        DECOMPOSITION,
        text,
        decomposition_schema(problem.usable_types),
        parse_decomposition,
        partial(check_decomposition, problem=problem),
    )


def about_operator(
    action: str,
    actions: Actions,
    problem: AcquisitionProblem,
    described: Sequence[LiftedOperator] = (),
) -> Question[OperatorDraft, LiftedOperator]:
    """The question what an action needs and changes.

    Args:
        action: Action in question, as in ``Insert(?peg: peg, ?hole: hole)``.
        actions: All actions of the decomposition.
        problem: Problem that the actions are for.
        described: Operators of other actions, as far as they are described.
    """
    name = action_name(action)
    text = operator_question(
        action,
        actions,
        problem.usable_types,
        problem.predicates,
        problem.init,
        problem.goal,
        described,
    )
    return Question(
        f"operator {name}",
        "operator",
        name,
        text,
        operator_schema(name, problem.usable_types, problem.predicates),
        parse_operator,
        partial(check_operator, name=name, problem=problem),
    )


def about_reward(
    operator: LiftedOperator, problem: AcquisitionProblem, with_definitions: bool = True
) -> Question[RewardDraft, RewardTemplate]:
    """The question which metrics lead to an operator's effects.

    Args:
        operator: Operator whose reward is asked for.
        problem: Problem with the metrics to choose among.
        with_definitions: Whether the question quotes the metrics' source, or has their signatures
            alone.
    """
    text = reward_question(operator, problem.metrics, problem.predicates, with_definitions)
    return Question(
        f"reward of {operator.name}",
        "reward",
        operator.name,
        text,
        reward_schema(problem.metrics, operator),
        parse_rewards,
        partial(check_rewards, operator=operator, problem=problem),
    )


def about_plan(
    operators: Sequence[LiftedOperator], problem: AcquisitionProblem
) -> Question[tuple[AtomDraft, ...], Plan]:
    """The question for a plan by the model itself, for comparison with the planner's.

    Args:
        operators: Operators that the plan may use.
        problem: Problem to solve: where to start, and what to reach.
    """
    objects = problem.layout.objects
    text = plan_question(operators, objects, problem.init, problem.goal)
    return Question(
        PLAN,
        "plan",
        PLAN,
        text,
        plan_schema([op.name for op in operators], [obj.name for obj in objects]),
        parse_plan,
        partial(check_plan, operators=operators, problem=problem),
    )


def check_plan(
    draft: Sequence[AtomDraft],
    operators: Sequence[LiftedOperator],
    problem: AcquisitionProblem,
) -> tuple[Plan | None, list[Complaint]]:
    """Check a plan by carrying it out in the abstract.

    Args:
        draft: Steps of the plan, as they are written.
        operators: Operators that the plan may use.
        problem: Problem to solve: where the plan starts, and what it shall reach.

    Returns:
        The plan, None where a step cannot be taken or the goal is not reached, and why.
    """
    known = {str(step): step for step in ground_operators(operators, problem.space)}
    abstract = problem.start_mask
    plan: list[GroundOperator] = []
    for number, written in enumerate(draft, start=1):
        step = known.get(str(written))
        if step is None or not step.applicable(abstract):
            why = "is no operator of these objects" if step is None else "is not possible there"
            fact = f"step {number}, {shown(str(written))}, {why}"
            return None, [Complaint(ComplaintClass.IMPOSSIBLE_STEP, PLAN, fact)]
        plan.append(step)
        abstract = step.apply(abstract)
    if missing := problem.goal_mask & ~abstract:
        atoms = ", ".join(sorted(map(str, problem.space.decode(missing))))
        fact = f"after the plan, {atoms} does not hold"
        return None, [Complaint(ComplaintClass.GOAL_NOT_REACHED, PLAN, fact)]
    return tuple(plan), []


def action_name(action: str) -> str:
    """The name of an action: ``Insert`` of ``Insert(?peg: peg, ?hole: hole)``."""
    return action.partition("(")[0]
