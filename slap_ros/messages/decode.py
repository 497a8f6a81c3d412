# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From slap_msgs messages to the objects of the core."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from slap_ros.core import Action, ActionSpace
from slap_ros.errors import ErrorCode, InvalidStateError, SlapError, error_from
from slap_ros.messages.protocols import (
    CommandMessage,
    EpisodeFaultMessage,
    GroundAtomMessage,
    Header,
    ObjectStateMessage,
    PlanEdgeMessage,
    PlanMessage,
    StateMessage,
)
from slap_ros.relational import AtomSpace, GroundAtom, Layout, Object, State, Target, Type
from slap_ros.relational.articles import a_or_an

NANOSECONDS = 1_000_000_000  # in a second
MORE_STEPS = 2.0**32  # than a message can say that a plan has


def stamp_ns(header: Header) -> int:
    """The header's stamp in ns since the epoch."""
    return header.stamp.sec * NANOSECONDS + header.stamp.nanosec


def decode_state(msg: StateMessage, types: Mapping[str, Type]) -> State:
    """The state that a message describes.

    Args:
        msg: An ``ObjectCentricState``.
        types: The domain's types by name.

    Raises:
        InvalidStateError: An object of unknown type or named twice, a wrong number of features,
            or a feature that is not finite.
    """
    layout = Layout.of(tuple(_decode_object(obj, types) for obj in msg.objects))
    features = [np.asarray(obj.features, dtype=np.float64) for obj in msg.objects]
    state = State(layout, np.concatenate(features) if features else np.empty(0))
    state.require_finite()
    return state


def _decode_object(msg: ObjectStateMessage, types: Mapping[str, Type]) -> Object:
    if msg.type not in types:
        raise InvalidStateError(
            f"{msg.name} is of unknown type {msg.type!r}; the domain has {', '.join(types)}"
        )
    obj = types[msg.type](msg.name)
    if len(msg.features) != len(obj.type.features):
        raise InvalidStateError(
            f"{msg.name} is {a_or_an(msg.type)} with {len(obj.type.features)} features, "
            f"got {len(msg.features)}"
        )
    return obj


def decode_fault(msg: EpisodeFaultMessage) -> SlapError:
    """The error that ended an episode; UNKNOWN for a code of another version, or none."""
    known = msg.error_code in set(ErrorCode) - {ErrorCode.NONE}
    return error_from(msg.error_code if known else ErrorCode.UNKNOWN, str(msg.error_msg))


def decode_seen(msgs: Iterable[ObjectStateMessage], state: State) -> State:
    """A state in which some objects are as they were seen.

    Raises:
        InvalidStateError: An object that the state does not have, or not of that type or with such
            features; or an object that was seen twice.
    """
    seen_otherwise = list(msgs)
    if not seen_otherwise:
        return state
    data, named = state.data.copy(), set[str]()
    for msg in seen_otherwise:
        obj = state.layout.by_name.get(msg.name)
        if obj is None or (msg.type, len(msg.features)) != (obj.type.name, len(obj.type.features)):
            raise InvalidStateError(
                f"{msg.name} was seen as {a_or_an(msg.type)} with {len(msg.features)} features, "
                "which the state has not"
            )
        if msg.name in named:
            raise InvalidStateError(f"{msg.name} was seen twice in one state")
        named.add(msg.name)
        data[state.layout.slices[obj]] = msg.features
    seen = State(state.layout, data)
    seen.require_finite()
    return seen


def decode_missing(names: Iterable[str], state: State) -> frozenset[str]:
    """Names of the objects whose place is not known.

    Raises:
        InvalidStateError: The state has no such object.
    """
    missing = frozenset(map(str, names))
    if unknown := sorted(missing - set(state.layout.by_name)):
        raise InvalidStateError(f"{', '.join(unknown)} missing, which the state has not")
    return missing


def decode_atoms(msgs: Iterable[GroundAtomMessage], space: AtomSpace) -> int:
    """The abstract state, a mask, in which these atoms hold and no others.

    Raises:
        UnknownPredicateError: The domain has no such predicate.
        UnknownObjectError: The task has no such object.
        MismatchedAtomError: Number or types of the objects do not fit.
    """
    return space.mask(space.atom(msg.predicate, msg.objects) for msg in msgs)


def decode_target(msg: PlanEdgeMessage, space: AtomSpace) -> Target:
    """Where an edge of a plan shall end.

    Raises:
        UnknownPredicateError: The domain has no such predicate.
        UnknownObjectError: The task has no such object.
        MismatchedAtomError: Number or types of the objects do not fit.
    """
    expected = decode_atoms(msg.expected_atoms, space)
    if not msg.others_may_appear:
        return Target.exactly(expected)
    return Target(expected, decode_atoms(msg.forbidden_atoms, space))


def plan_bound(msg: PlanMessage) -> float | None:
    """How many times as long as the shortest a plan is at most; None where nothing is known.

    Earlier versions recorded plans without a bound, and some messages have one that cannot be.
    """
    bound = float(getattr(msg, "bound", 0.0))
    return bound if 1.0 <= bound < MORE_STEPS else None


def decode_goal(msgs: Iterable[GroundAtomMessage], space: AtomSpace) -> frozenset[GroundAtom]:
    """The goal of these atoms.

    Raises:
        UnknownPredicateError: The domain has no such predicate.
        UnknownObjectError: The task has no such object.
        MismatchedAtomError: Number or types of the objects do not fit.
    """
    return frozenset(space.atom(msg.predicate, msg.objects) for msg in msgs)


def decode_command(msg: CommandMessage, actions: ActionSpace) -> Action:
    """The action that a command asks for. Its range is not checked: a world does that.

    Raises:
        InvalidCommandError: It commands a gripper, and there is none.
    """
    return actions.join(np.asarray(msg.deltas, dtype=np.float64), float(msg.gripper))
