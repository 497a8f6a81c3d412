# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether what a learner observes has the shapes that it expects, and is made of numbers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

import numpy as np

from slap_ros.core import Domain, LearnerInterface
from slap_ros.doctor.check import Check
from slap_ros.domain_check.experience import Experience
from slap_ros.relational import Column, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array

BATCH = 8  # states; as many as no state has objects, as a rule, so that axes cannot be mixed up
ADVICE = "LearnerInterface says which shape each function answers with"

# What answered, its answer, and the shape that is wanted, in which a name stands for any number.
Answer = tuple[str, Array | Bools, tuple[int | str, ...]]


def interface(domain: Domain, asked: LearnerInterface, experience: Experience) -> Check:
    """Whether a learner could learn from the interface's answers.

    Args:
        domain: Domain to check.
        asked: Interface of the domain.
        experience: States that are observed.
    """
    name, first = "learner's interface", experience.states[0]
    same = [state.data for state in experience.states if state.layout is first.layout]
    states = State(first.layout, np.resize(np.stack(same), (BATCH, first.layout.size)))
    try:
        for what, found, wanted in _answers(asked, states):
            if problem := _problem(found, wanted):
                return Check(name, "problem", f"{what} {problem}", ADVICE)
    except Exception as error:  # of the domain's own code
        said = f"raises {type(error).__name__} for {BATCH} states: {error}"
        return Check(name, "problem", said, ADVICE)
    if strangers := [str(p) for p in asked.grasping if p not in domain.predicates]:
        said = f"grasping has {', '.join(strangers)}, which the domain does not have"
        return Check(name, "problem", said, "grasping has predicates of the domain")
    return Check(name, "ok", "shapes as learners expect them, and numbers everywhere")


def _answers(asked: LearnerInterface, states: State) -> Iterator[Answer]:
    """What each function answers, and the shape that is wanted."""
    hand = asked.hand(states)
    yield "robot", asked.robot(states, hand), (BATCH, "k")
    for what, of_states in (
        ("at_rest", asked.at_rest),
        ("failed", asked.failed),
        ("joint_limit_penalty", asked.joint_limit_penalty),
        ("can_leave", asked.can_leave),
    ):
        yield what, of_states(states), (BATCH,)
    movable = []
    for column in _kinds(states):
        wanted, of = (BATCH, len(column.objects)), f"of {column.objects[0].type}s"
        yield f"objects {of}", asked.objects(states, hand, column), (*wanted, "f")
        # What there is no point in going to is infinitely far away, but not nowhere.
        distance = asked.distance(states, hand, column)
        yield f"distance {of}", np.where(np.isposinf(distance), 0.0, distance), wanted
        if not np.isposinf(distance).all():
            movable.append(column)
        if asked.frames is not None:
            positions, quaternions = asked.frames(states, column)
            yield f"frames {of}: positions", positions, (*wanted, 3)
            yield f"frames {of}: quaternions", quaternions, (*wanted, 4)
    for column in movable:
        one = column.objects[0]
        found = asked.separation(states, one, column)
        yield f"separation of {one.type}s", found, (BATCH, len(column.objects))


def _kinds(states: State) -> Iterator[Column]:
    """The objects of each type, as columns."""
    objects = sorted(states.layout.objects, key=lambda obj: obj.type.name)
    for _, alike in groupby(objects, key=lambda obj: obj.type):
        yield Column(tuple(alike))


def _problem(found: Array | Bools, wanted: tuple[int | str, ...]) -> str:
    """What is wrong with an answer; empty for nothing."""
    shape = np.shape(found)
    fits = len(shape) == len(wanted) and all(
        isinstance(want, str) or want == size for size, want in zip(shape, wanted, strict=True)
    )
    if not fits:
        return f"has the shape {shape} for {BATCH} states, wanted ({', '.join(map(str, wanted))})"
    return "" if np.isfinite(found).all() else "is not finite everywhere"
