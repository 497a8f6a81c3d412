# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tasks with the goals that people give: a name of the domain's, or atoms in PDDL."""

from __future__ import annotations

import re
from dataclasses import replace

from slap_ros.core.domain import Domain
from slap_ros.core.task import Task
from slap_ros.relational.pddl import parse_goal

_NAME = re.compile(r"\s*([\w.-]+)\s*")  # atoms have parentheses


def task_with_goal(domain: Domain, seed: int, index: int = 0, goal: str | None = None) -> Task:
    """A task of a seed, with a goal as people give it.

    Args:
        domain: Domain of the task.
        seed: Seed of the task, at least 0.
        index: Index of the task among those of its seed, at least 0.
        goal: Goal: a name of the domain, as ``test1``, for the first task of the stream that has
            its objects; or an atom or a conjunction of atoms, as ``(and (On block2 target)
            (GripperEmpty robot))``. None or empty: the task's own.

    Returns:
        The task.

    Raises:
        InvalidParameterError: A negative seed or index.
        UnknownGoalError: The domain has no goal of that name.
        MalformedPddlError: Neither a name nor a conjunction of atoms.
        UnknownPredicateError: A predicate that the domain does not have.
        UnknownObjectError: An object that the task does not have.
        MismatchedAtomError: An atom with the wrong number or types of objects, or with one
            object twice.
    """
    if not goal:
        return domain.task(seed, index)
    if name := _NAME.fullmatch(goal):
        return domain.task(seed, index, name[1])
    task = domain.task(seed, index)
    return replace(task, goal=parse_goal(goal, domain.atom_space(task.initial_state)))
