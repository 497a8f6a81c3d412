# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Core objects into slap_msgs messages. The way back is ``slap_ros.messages.decode``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import slap_msgs.msg as msgs
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import KeyValue
from std_msgs.msg import Header

from slap_ros.core import Action, ActionSpace, Domain, Skill, Task
from slap_ros.errors import SlapError
from slap_ros.messages.decode import NANOSECONDS
from slap_ros.perception import Percept
from slap_ros.planning.options import OptionKind
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.relational import AtomSpace, GroundAtom, LiftedOperator, State
from slap_ros.relational.pddl import write_domain
from slap_ros.shortcuts.shortcut import Sampling, Shortcut
from slap_ros.versions import versions

FRAME = "world"


def time(ns: int) -> Time:
    """Nanoseconds since the epoch as a stamp."""
    seconds, rest = divmod(ns, NANOSECONDS)
    return Time(sec=seconds, nanosec=rest)


def header(stamp: Time) -> Header:
    """A header in the world frame."""
    return Header(stamp=stamp, frame_id=FRAME)


def domain_info(domain: Domain, stamp: Time) -> msgs.DomainInfo:
    """Which world runs, whose skills it has, and the versions of all that runs it."""
    moved = domain.action_space.displacement_axes
    return msgs.DomainInfo(
        header=header(stamp),
        name=domain.name,
        preset=domain.preset,
        types=[
            msgs.TypeInfo(
                name=t.name,
                parent=t.parent.name if t.parent else "",
                feature_names=[feature.name for feature in t.features],
                feature_units=[feature.unit for feature in t.features],
            )
            for t in domain.types
        ],
        predicates=[
            msgs.PredicateInfo(name=p.name, parameters=[t.name for t in p.types])
            for p in domain.predicates
        ],
        operators_pddl=write_domain(domain.name, domain.types, domain.predicates, domain.operators),
        action_names=[axis.name for axis in moved],
        action_units=[axis.unit for axis in moved],
        control_period=domain.execution.control_period_s,
        configuration=key_values(domain.configuration),
        versions=key_values(versions()),
    )


def key_values(values: Mapping[str, object]) -> list[KeyValue]:
    """A mapping as key-value pairs."""
    return [KeyValue(key=key, value=str(value)) for key, value in values.items()]


def state(value: State, episode: int, step: int, stamp: Time) -> msgs.ObjectCentricState:
    """The message of a state.

    Args:
        value: The state.
        episode: Its episode's number.
        step: Environment steps taken before it.
        stamp: When it came to be.

    Returns:
        The message, objects in the state's own order.
    """
    return msgs.ObjectCentricState(
        header=header(stamp),
        episode=episode,
        step=step,
        objects=[
            msgs.ObjectState(name=obj.name, type=obj.type.name, features=value[obj].tolist())
            for obj in value.objects
        ],
    )


def atoms(ground_atoms: Iterable[GroundAtom]) -> list[msgs.GroundAtom]:
    """Ground atoms, in the order given."""
    return [
        msgs.GroundAtom(predicate=atom.predicate.name, objects=[obj.name for obj in atom.objects])
        for atom in ground_atoms
    ]


def percept(
    value: Percept, of: msgs.ObjectCentricState, space: AtomSpace, known: State
) -> msgs.AbstractState:
    """What is perceived of a state.

    Args:
        value: The percept.
        of: The message that was perceived; header, episode and step are taken from it.
        space: Atom space of the episode.
        known: ``of``, decoded: only objects that are perceived otherwise go into the message.

    Returns:
        The message; missing objects are sorted by name.
    """
    return msgs.AbstractState(
        header=of.header,
        episode=of.episode,
        step=of.step,
        atoms=atoms(space.decode(value.abstract)),
        exact=value.exact,
        seen=[
            msgs.ObjectState(name=obj.name, type=obj.type.name, features=value.state[obj].tolist())
            for obj in (value.state.objects if value.state is not known else ())
            if not np.array_equal(value.state[obj], known[obj])
        ],
        missing=sorted(value.missing),
    )


def goal(ground_atoms: Iterable[GroundAtom]) -> list[msgs.GroundAtom]:
    """A goal, in a stable order."""
    return atoms(sorted(ground_atoms, key=str))


def task(
    value: Task, domain: Domain, episode: int, seed: int, index: int, stamp: Time
) -> msgs.Task:
    """The task that opens an episode.

    Args:
        value: The task.
        domain: What it is a task of.
        episode: Number of the episode.
        seed: What sampled it; -1 where it was given or measured.
        index: Which of the seed's tasks.
        stamp: When the episode was opened.

    Returns:
        The message; its initial state is step 0 of the episode.
    """
    return msgs.Task(
        header=header(stamp),
        episode=episode,
        domain=domain.name,
        seed=seed,
        index=index,
        initial_state=state(value.initial_state, episode, 0, stamp),
        goal=goal(value.goal),
        step_limit=value.step_limit,
    )


def command(
    action: Action, actions: ActionSpace, episode: int, step: int, stamp: Time
) -> msgs.RobotCommand:
    """What the robot is to do next.

    Args:
        action: One entry per axis.
        actions: The domain's: which axis is the gripper.
        episode: Number of the episode.
        step: The step of the state that it answers.
        stamp: When it was decided.

    Returns:
        The message.
    """
    deltas, gripper = actions.split(action)
    return msgs.RobotCommand(
        header=header(stamp), episode=episode, step=step, deltas=deltas.tolist(), gripper=gripper
    )


def fault(error: SlapError, episode: int, opened_ns: int, step: int) -> msgs.EpisodeFault:
    """Why an episode cannot go on.

    Args:
        error: What has failed.
        episode: Number of the episode.
        opened_ns: Stamp of its task, ns since the epoch.
        step: The last that was taken.

    Returns:
        The message.
    """
    return msgs.EpisodeFault(
        header=header(time(opened_ns)),
        episode=episode,
        step=step,
        error_code=int(error.code),
        error_msg=str(error),
    )


def plan_edge(edge: PlanEdge, space: AtomSpace) -> msgs.PlanEdge:
    """One edge of a plan, with the atoms that are expected at its end."""
    target = edge.target
    return msgs.PlanEdge(
        kind=edge.option.kind.value,
        name=edge.option.skill.name,
        attempt=edge.option.attempt,
        objects=[obj.name for obj in edge.option.objects],
        expected_atoms=atoms(space.decode(target.required)),
        others_may_appear=not target.exact,
        forbidden_atoms=[] if target.exact else atoms(space.decode(target.forbidden)),
        predicted_steps=edge.predicted_steps,
    )


def plan(
    value: Plan,
    goal_mask: int,
    space: AtomSpace,
    episode: int,
    number: int,
    stamp: Time,
    provenance: Mapping[str, str | int],
) -> msgs.Plan:
    """The message of a plan.

    Args:
        value: The plan.
        goal_mask: What it is to reach, as a mask over ``space``.
        space: Atom space of the episode.
        episode: Number of the episode.
        number: Which plan of the run, from 0 on.
        stamp: When it was made.
        provenance: What made it: fields ``planner``, ``library`` and ``samples`` of the message.

    Returns:
        The message.
    """
    return msgs.Plan(
        **provenance,
        header=header(stamp),
        episode=episode,
        number=number,
        goal=atoms(space.decode(goal_mask)),
        edges=[plan_edge(edge, space) for edge in value.edges],
        predicted_steps=value.predicted_steps,
    )


def skill_info(operator: LiftedOperator, skill: Skill) -> msgs.SkillInfo:
    """A given option."""
    return msgs.SkillInfo(
        kind=OptionKind.OPERATOR.value,
        name=operator.name,
        parameters=[variable.type.name for variable in operator.parameters],
        step_limit=skill.step_limit,
    )


def shortcut_info(shortcut: Shortcut, sampling: Sampling) -> msgs.SkillInfo:
    """A learned option, with the types of its roles."""
    return msgs.SkillInfo(
        kind=OptionKind.SHORTCUT.value,
        name=shortcut.name,
        parameters=[kind.partition("(")[0] for kind in shortcut.signature.roles],
        step_limit=sampling.horizon,
        training=key_values(shortcut.record),
    )
