# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans carried out with the skills at hand, stage by stage, until one fails.

A stage of a plan is done once T(x, ω) ⊆ x' and nothing that ω deletes holds (LG-SAIL Alg. 1,
Eq. 4). Nothing is planned again, and the stages after a failed one are not run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, Stage, StageEnd
from slap_ros.core import Domain, Task, World
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.relational import (
    AtomSpace,
    GroundOperator,
    LiftedOperator,
    RewardTemplate,
    State,
    Target,
    ground_operators,
)
from slap_ros.skills.skill import APPROACH_STEPS, LearnedSkill, approach_of


def plan_operators(
    domain: Domain, task: Task, operators: Sequence[LiftedOperator]
) -> tuple[AtomSpace, list[GroundOperator]]:
    """A shortest plan of operators, the same every time.

    Args:
        domain: Domain of the task.
        task: Task to plan for: where to start, and what to reach.
        operators: Operators to plan with.

    Returns:
        The task's atoms, and the plan.

    Raises:
        UnsolvableError: There is no plan.
        PlanningLimitError: None was found within the limits.
    """
    space = domain.atom_space(task.initial_state)
    ground = ground_operators(operators, space)
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    return space, [ground[i] for i in find_shortest_sequence(start, goal, ground)]


def roll_out(
    domain: Domain,
    task: Task,
    index: int,
    operators: Sequence[LiftedOperator],
    skills: Mapping[str, LearnedSkill],
    rewards: Mapping[str, RewardTemplate] | None = None,
) -> PlanRollout:
    """Plan for a task, and carry the plan out until a stage fails.

    Args:
        domain: Domain of the task.
        task: Task to plan for: where to start, and what to reach.
        index: Index of the task.
        operators: Operators to plan with.
        skills: Skills that were learned, by operator name.
        rewards: Rewards by operator name, whose metrics are told of a failed stage.

    Returns:
        How far it went.
    """
    try:
        space, plan = plan_operators(domain, task, operators)
    except (UnsolvableError, PlanningLimitError) as error:
        return PlanRollout(index, (), (), str(error))
    world, stages = domain.make_world(task.initial_state), []
    for operator in plan:
        skill = skills.get(operator.operator.name)
        stage = carry_out_stage(domain, world, space, operator, skill, rewards)
        stages.append(stage)
        if not stage.done:
            break
    return PlanRollout(index, tuple(map(str, plan)), tuple(stages))


def carry_out_stage(
    domain: Domain,
    world: World,
    space: AtomSpace,
    operator: GroundOperator,
    skill: LearnedSkill | None,
    rewards: Mapping[str, RewardTemplate] | None = None,
) -> Stage:
    """Carry out one stage of a plan.

    Args:
        domain: Domain of the world.
        world: World in which the stage begins.
        space: Atoms of the task.
        operator: Operator of the stage.
        skill: Skill of the operator; None where there is none.
        rewards: Rewards by operator name, whose metrics are told of a failed stage.

    Returns:
        How it went.
    """
    stage = _carry_out(domain, world, space, operator, skill)
    if stage.done or not rewards:
        return stage
    metrics = _metrics(rewards[operator.operator.name], operator, world.state)
    return replace(stage, metrics=metrics)


def _carry_out(
    domain: Domain,
    world: World,
    space: AtomSpace,
    operator: GroundOperator,
    skill: LearnedSkill | None,
) -> Stage:
    """Carry out one stage.

    Args:
        domain: Domain of the world.
        world: World in which the stage begins.
        space: Atoms of the task.
        operator: Operator of the stage.
        skill: Skill of the operator; None where there is none.

    Returns:
        How it went.
    """
    name, objects = operator.operator.name, operator.objects
    names = tuple(obj.name for obj in objects)
    target = Target.after(operator, space.abstract(world.state))
    if not _approach(domain, world, operator):
        return Stage(name, names, (), StageEnd.NOT_APPROACHED.value, 0)
    began = tuple(map(float, world.state.data))
    if skill is None:
        return Stage(name, names, began, StageEnd.NOT_LEARNED.value, 0)
    policy, effects = skill.act(objects), False
    for step in range(1, skill.horizon + 1):
        action = policy(world.state)
        assert action is not None
        abstract = space.abstract(world.step(action))
        if target.reached(abstract) and skill.accepts(world.state, objects):
            return Stage(name, names, began, StageEnd.DONE.value, step)
        effects |= not (operator.add_effects & ~abstract or operator.delete_effects & abstract)
    end = StageEnd.DISTURBED if effects else StageEnd.NO_EFFECT
    wrong = tuple(map(str, space.decode(target.difference(abstract))))
    return Stage(name, names, began, end.value, skill.horizon, wrong)


def _metrics(template: RewardTemplate, operator: GroundOperator, state: State) -> dict[str, float]:
    """The normalised metrics of a reward in a state, by their text."""
    objects = dict(zip(operator.operator.parameters, operator.objects, strict=True))
    return {
        f"{term.metric}({', '.join(v.name for v in term.arguments)})": term.value(state, objects)
        for term in template.terms
    }


def _approach(domain: Domain, world: World, operator: GroundOperator) -> bool:
    """Bring the hand to where the operator's skill begins; whether it arrived."""
    policy = approach_of(domain)(world.state, operator.objects)
    for _ in range(APPROACH_STEPS):
        action = policy(world.state)
        if action is None:
            return True
        world.step(action)
    return False
