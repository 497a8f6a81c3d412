# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans that a language model wrote, carried out without a search and without a check.

A model knows no skill of the robot. It names actions of its own and says what each of them adds. A
step of its plan is carried out by the skill that adds most of that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, Stage
from slap_ros.acquisition.curriculum.rollouts import carry_out_stage
from slap_ros.core import Domain, Task
from slap_ros.language.formats import AtomDraft
from slap_ros.relational import AtomSpace, GroundOperator, LiftedOperator, ground_operators
from slap_ros.skills.skill import LearnedSkill

# Reasons why a plan does not lead to the goal, before a colon and what exactly is wrong.
UNREAD, NO_SKILL, NO_GOAL = "answer not read", "no such skill", "goal not reached"


@dataclass(frozen=True)
class UncheckedStep:
    """A step of a plan, as a model wrote it.

    Args:
        action: Name of the model's action.
        objects: Names of the objects that the action is applied to.
        adds: Ground atoms that the model's operator adds for these objects, as text; none where
            it described no such operator of so many objects.
    """

    action: str
    objects: tuple[str, ...]
    adds: tuple[str, ...]

    @classmethod
    def of(cls, draft: AtomDraft, operators: Sequence[LiftedOperator]) -> UncheckedStep:
        """The step of a draft.

        Args:
            draft: Draft of the step, as it is written.
            operators: Operators that the model described, each of another name.
        """
        adds: set[str] = set()
        operator = {one.name: one for one in operators}.get(draft.name)
        if operator is not None and len(operator.parameters) == len(draft.arguments):
            names = dict(zip(operator.parameters, draft.arguments, strict=True))
            adds = {
                f"{atom.predicate.name}({', '.join(names[one] for one in atom.variables)})"
                for atom in operator.add_effects
            }
        return cls(draft.name, draft.arguments, tuple(sorted(adds)))

    def __str__(self) -> str:
        return f"{self.action}({', '.join(self.objects)})"


@dataclass(frozen=True)
class UncheckedPlan:
    """A plan of a model.

    Args:
        steps: Steps of the plan, in order.
        unread: Reason why there is no plan, in words; empty where there is one.
    """

    steps: tuple[UncheckedStep, ...] = ()
    unread: str = ""

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> UncheckedPlan:
        """The plan that :func:`dataclasses.asdict` made such data of.

        Raises:
            LookupError, TypeError: The data is no plan.
        """
        steps = (
            UncheckedStep(str(one["action"]), tuple(one["objects"]), tuple(one["adds"]))
            for one in data["steps"]
        )
        return cls(tuple(steps), str(data["unread"]))


def carry_out_unchecked(
    domain: Domain,
    task: Task,
    index: int,
    plan: UncheckedPlan,
    skills: Mapping[str, LearnedSkill],
) -> PlanRollout:
    """Carry out a model's plan until a stage fails, and see whether the goal holds then.

    Args:
        domain: Domain with the operators of the skills.
        task: Task that the plan is for.
        index: Index of the task.
        plan: Plan of the model.
        skills: Skills by operator name.

    Returns:
        How far it went. A plan that cannot be carried out, or that ends without the goal, counts
        as none: its task progress is 0.
    """
    written = tuple(map(str, plan.steps))
    if plan.unread:
        return PlanRollout(index, written, (), f"{UNREAD}: {plan.unread}")
    space = domain.atom_space(task.initial_state)
    known = ground_operators(domain.operators, space)
    world = domain.make_world(task.initial_state)
    stages: list[Stage] = []
    for step in plan.steps:
        operator = operator_for(step, known, space)
        if operator is None:
            return PlanRollout(index, written, tuple(stages), f"{NO_SKILL}: {step}")
        skill = skills.get(operator.operator.name)
        stages.append(carry_out_stage(domain, world, space, operator, skill))
        if not stages[-1].done:
            return PlanRollout(index, written, tuple(stages))
    missing = space.mask(task.goal) & ~space.abstract(world.state)
    atoms = ", ".join(map(str, space.decode(missing)))
    return PlanRollout(index, written, tuple(stages), f"{NO_GOAL}: {atoms}" if missing else "")


def operator_for(
    step: UncheckedStep, known: Sequence[GroundOperator], space: AtomSpace
) -> GroundOperator | None:
    """The operator whose skill carries out a step.

    Args:
        step: Step of a model's plan.
        known: Operators of the skills, for all objects of the task.
        space: Atoms of the task.

    Returns:
        The operator that adds most of what the step adds, of those about none but its objects, and
        the first of several; None where all add nothing of it.
    """

    def shared(operator: GroundOperator) -> int:
        return len(set(step.adds) & set(map(str, space.decode(operator.add_effects))))

    fitting = (one for one in known if {obj.name for obj in one.objects} <= set(step.objects))
    best = max(fitting, key=shared, default=None)
    return best if best is not None and shared(best) else None
