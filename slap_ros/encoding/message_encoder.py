# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Core objects into messages, of whichever classes they are sent or stored in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slap_ros.core import Action, ActionSpace, Domain, Skill, Task
from slap_ros.errors import SlapError
from slap_ros.messages.decode import NANOSECONDS
from slap_ros.messages.interfaces import (
    ATOMS,
    COMMAND,
    DOMAIN_INFO,
    FAULT,
    PLAN,
    PLAN_EVENT,
    SKILL_EVENT,
    STATE,
    TASK,
)
from slap_ros.perception import Percept
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.plan import PlanEdge, PlanningResult
from slap_ros.relational import AtomSpace, GroundAtom, LiftedOperator, State
from slap_ros.relational.pddl import write_domain
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.versions import versions

FRAME = "world"


@dataclass(frozen=True)
class MessageEncoder:
    """Makes messages of core objects.

    Messages have the type ``Any``: their classes are those of rclpy, of ``embedded_ros`` or of
    rosbags, which have nothing in common but their fields.

    Args:
        make: Function that makes a message, given its type, as ``slap_msgs/msg/Task``, and fields
            by name; fields that are not given are zero or empty.
    """

    make: Callable[..., Any]

    def time(self, ns: int) -> Any:
        """Nanoseconds since the epoch as a stamp."""
        seconds, rest = divmod(ns, NANOSECONDS)
        return self.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)

    def header(self, stamp: Any) -> Any:
        """A header in the world frame."""
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=FRAME)

    def domain_info(self, domain: Domain, stamp: Any) -> Any:
        """The message of the domain: world, skills, and the versions of all that runs it."""
        moved = domain.action_space.displacement_axes
        return self.make(
            DOMAIN_INFO,
            header=self.header(stamp),
            name=domain.name,
            preset=domain.preset,
            types=[
                self.make(
                    "slap_msgs/msg/TypeInfo",
                    name=t.name,
                    parent=t.parent.name if t.parent else "",
                    feature_names=[feature.name for feature in t.features],
                    feature_units=[feature.unit for feature in t.features],
                )
                for t in domain.types
            ],
            predicates=[
                self.make(
                    "slap_msgs/msg/PredicateInfo", name=p.name, parameters=[t.name for t in p.types]
                )
                for p in domain.predicates
            ],
            operators_pddl=write_domain(
                domain.name,
                domain.types,
                domain.predicates,
                # The text of format 1: which parameters must differ is left out, as it always was.
                [replace(operator, inequalities=()) for operator in domain.operators],
            ),
            action_names=[axis.name for axis in moved],
            action_units=[axis.unit for axis in moved],
            control_period=float(domain.execution.control_period_s),
            configuration=self.key_values(domain.configuration),
            versions=self.key_values(versions()),
        )

    def key_values(self, values: Mapping[str, object]) -> list[Any]:
        """A mapping as key-value pairs."""
        return [
            self.make("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
            for key, value in values.items()
        ]

    def state(self, value: State, episode: int, step: int, stamp: Any) -> Any:
        """The message of a state.

        Args:
            value: State to encode.
            episode: Number of the state's episode.
            step: Number of environment steps taken before the state.
            stamp: Time of the state.

        Returns:
            The message, objects in the state's own order.
        """
        return self.make(
            STATE,
            header=self.header(stamp),
            episode=episode,
            step=step,
            objects=[
                self.make(
                    "slap_msgs/msg/ObjectState",
                    name=obj.name,
                    type=obj.type.name,
                    features=value[obj].tolist(),
                )
                for obj in value.objects
            ],
        )

    def atoms(self, ground_atoms: Iterable[GroundAtom]) -> list[Any]:
        """Ground atoms, in the order given."""
        return [
            self.make(
                "slap_msgs/msg/GroundAtom",
                predicate=atom.predicate.name,
                objects=[obj.name for obj in atom.objects],
            )
            for atom in ground_atoms
        ]

    def percept(self, value: Percept, of: Any, space: AtomSpace, known: State) -> Any:
        """The message of what is perceived of a state.

        Args:
            value: Percept to encode.
            of: Message that was perceived; header, episode and step are taken from it.
            space: Atom space of the episode.
            known: ``of``, decoded: only objects that are perceived otherwise go into the message.

        Returns:
            The message; missing objects are sorted by name.
        """
        return self.make(
            ATOMS,
            header=of.header,
            episode=of.episode,
            step=of.step,
            atoms=self.atoms(space.decode(value.abstract)),
            exact=value.exact,
            seen=[
                self.make(
                    "slap_msgs/msg/ObjectState",
                    name=obj.name,
                    type=obj.type.name,
                    features=value.state[obj].tolist(),
                )
                for obj in (value.state.objects if value.state is not known else ())
                if not np.array_equal(value.state[obj], known[obj])
            ],
            missing=sorted(value.missing),
        )

    def goal(self, ground_atoms: Iterable[GroundAtom]) -> list[Any]:
        """The message of a goal, in a stable order."""
        return self.atoms(sorted(ground_atoms, key=str))

    def task(self, value: Task, domain: Domain, episode: int, stamp: Any) -> Any:
        """The task that opens an episode.

        Args:
            value: Task to encode.
            domain: Domain of the task.
            episode: Number of the episode.
            stamp: Time at which the episode was opened.

        Returns:
            The message; its initial state is step 0 of the episode.
        """
        return self.make(
            TASK,
            header=self.header(stamp),
            episode=episode,
            domain=domain.name,
            seed=value.seed,
            index=value.index,
            initial_state=self.state(value.initial_state, episode, 0, stamp),
            goal=self.goal(value.goal),
            step_limit=value.step_limit,
        )

    def command(
        self, action: Action, actions: ActionSpace, episode: int, step: int, stamp: Any
    ) -> Any:
        """The message of the robot's next action.

        Args:
            action: Action, one entry per axis.
            actions: Action space of the domain, which says which axis is the gripper.
            episode: Number of the episode.
            step: Step of the state that the command answers.
            stamp: Time of the decision.

        Returns:
            The message.
        """
        deltas, gripper = actions.split(action)
        return self.make(
            COMMAND,
            header=self.header(stamp),
            episode=episode,
            step=step,
            deltas=deltas.tolist(),
            gripper=gripper,
        )

    def fault(self, error: SlapError, episode: int, opened_ns: int, step: int) -> Any:
        """The message of why an episode cannot go on.

        Args:
            error: Error that stopped the episode.
            episode: Number of the episode.
            opened_ns: Stamp of the episode's task, ns since the epoch.
            step: Number of the last step taken.

        Returns:
            The message.
        """
        return self.make(
            FAULT,
            header=self.header(self.time(opened_ns)),
            episode=episode,
            step=step,
            error_code=int(error.code),
            error_msg=str(error),
        )

    def plan_edge(self, edge: PlanEdge, space: AtomSpace) -> Any:
        """The message of one edge of a plan, with the atoms that are expected at its end."""
        target = edge.target
        return self.make(
            "slap_msgs/msg/PlanEdge",
            kind=edge.option.kind.value,
            name=edge.option.skill.name,
            attempt=edge.option.attempt,
            objects=[obj.name for obj in edge.option.objects],
            expected_atoms=self.atoms(space.decode(target.required)),
            others_may_appear=not target.exact,
            forbidden_atoms=[] if target.exact else self.atoms(space.decode(target.forbidden)),
            predicted_steps=edge.predicted_steps,
        )

    def plan(
        self,
        planned: PlanningResult,
        goal_mask: int,
        space: AtomSpace,
        episode: int,
        number: int,
        stamp: Any,
        provenance: Mapping[str, str | int],
    ) -> Any:
        """The message of a plan.

        Args:
            planned: Plan to encode, with what is proven of it.
            goal_mask: Goal of the plan, as a mask over ``space``.
            space: Atom space of the episode.
            episode: Number of the episode.
            number: Number of the plan in the run, from 0 on.
            stamp: Time at which the plan was made.
            provenance: Fields ``planner``, ``library`` and ``samples`` of what made the plan.

        Returns:
            The message.
        """
        return self.make(
            PLAN,
            **provenance,
            header=self.header(stamp),
            episode=episode,
            number=number,
            goal=self.atoms(space.decode(goal_mask)),
            edges=[self.plan_edge(edge, space) for edge in planned.plan.edges],
            predicted_steps=planned.steps,
            bound=planned.bound or 0.0,
        )

    def skill_info(self, operator: LiftedOperator, skill: Skill) -> Any:
        """The message of a given option."""
        return self.make(
            "slap_msgs/msg/SkillInfo",
            kind=OptionKind.OPERATOR.value,
            name=operator.name,
            parameters=[variable.type.name for variable in operator.parameters],
            step_limit=skill.step_limit,
        )

    def shortcut_info(self, shortcut: Shortcut, sampling: Sampling) -> Any:
        """The message of a learned option, with the types of its roles."""
        return self.make(
            "slap_msgs/msg/SkillInfo",
            kind=OptionKind.SHORTCUT.value,
            name=shortcut.name,
            parameters=[kind.partition("(")[0] for kind in shortcut.signature.roles],
            step_limit=shortcut.step_limit(sampling),
            training=self.key_values(shortcut.record),
        )

    def plan_event(self, kind: int, episode: int, step: int, stamp: Any, **details: object) -> Any:
        """The message of an event of a plan.

        Args:
            kind: Kind of the event, one of :class:`~slap_ros.messages.events.PlanEventKind`.
            episode: Number of the episode.
            step: Step of the newest state.
            stamp: Time of the event.
            details: Further fields of the message.
        """
        header = self.header(stamp)
        return self.make(
            PLAN_EVENT, header=header, episode=episode, step=step, kind=kind, **details
        )

    def skill_event(
        self, kind: int, option: Option, outcome: OptionResult, episode: int, step: int, stamp: Any
    ) -> Any:
        """The message of an event of an option under execution.

        Args:
            kind: Kind of the event, one of :class:`~slap_ros.messages.events.SkillEventKind`.
            option: Option that the event is about.
            outcome: Result of the option; its error code is NONE unless the option has failed.
            episode: Number of the episode.
            step: Step of the newest state.
            stamp: Time of the event.
        """
        return self.make(
            SKILL_EVENT,
            header=self.header(stamp),
            episode=episode,
            step=step,
            kind=kind,
            skill=option.skill.name,
            objects=[obj.name for obj in option.objects],
            error_code=int(outcome.code),
            error_msg=outcome.reason,
        )
