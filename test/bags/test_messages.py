# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import (
    ErrorCode,
    InvalidStateError,
    UnknownObjectError,
    UnknownPredicateError,
)
from slap_ros.messages.decode import (
    decode_atoms,
    decode_command,
    decode_goal,
    decode_missing,
    decode_seen,
    decode_state,
    stamp_ns,
)
from slap_ros.messages.events import PlanEventKind, SkillEventKind
from slap_ros.messages.interfaces import COMMAND, STATE, TASK
from slap_ros.messages.typestore import message_texts, typestore
from slap_ros.planning.options import OptionKind
from support.truthful_run import Script


def constants(type_name: str) -> dict[str, int]:
    return {name: value for name, _, value in typestore().fielddefs[type_name][0]}  # type: ignore[misc]


def members(kind: type[PlanEventKind | SkillEventKind | ErrorCode | OptionKind]) -> dict[str, int]:
    return {member.name: int(member.value) for member in kind}


def test_every_definition_is_in_the_typestore() -> None:
    assert len(message_texts()) >= 15
    assert set(message_texts()) <= set(typestore().types)


def test_enumerations_are_those_of_the_messages() -> None:
    assert constants("slap_msgs/msg/ErrorCode") == members(ErrorCode)
    assert constants("slap_msgs/msg/PlanEvent") == members(PlanEventKind)
    assert constants("slap_msgs/msg/SkillEvent") == members(SkillEventKind)
    assert constants("slap_msgs/msg/PlanEdge") == members(OptionKind)


def test_states_come_back_bit_for_bit(script: Script) -> None:
    types = {t.name: t for t in script.domain.types}
    task = script.domain.task(script.seed)
    item = next(m for m in script.messages if m.type_name == STATE)
    read = typestore().deserialize_cdr(item.cdr, STATE)
    for message in (item.message, read):
        state = decode_state(message, types)  # type: ignore[arg-type]
        assert state == task.initial_state
        assert state.layout is task.initial_state.layout


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"type": "ghost"}, "unknown type 'ghost'"),
        ({"features": [0.5]}, "2 features, got 1"),
        ({"features": [0.5, float("nan")]}, "not finite"),
        ({"features": [0.5, float("inf")]}, "not finite"),
        ({"name": "block1"}, "unique"),
    ],
)
def test_impossible_states_are_refused(
    script: Script, change: dict[str, object], complaint: str
) -> None:
    types = {t.name: t for t in script.domain.types}
    robot = {"name": "robot", "type": "robot", "features": [0.5, 0.5]} | change
    block = {"name": "block1", "type": "block", "features": [0.5, 0.0, 0.0]}
    message = SimpleNamespace(objects=[SimpleNamespace(**robot), SimpleNamespace(**block)])
    with pytest.raises(InvalidStateError, match=complaint):
        decode_state(message, types)  # type: ignore[arg-type]


def test_atoms_and_goals(script: Script) -> None:
    task = script.domain.task(script.seed)
    space = script.domain.atom_space(task.initial_state)
    message = next(m.message for m in script.messages if m.type_name == TASK)
    assert decode_goal(message.goal, space) == task.goal
    assert decode_atoms(message.goal, space) == space.mask(task.goal)
    with pytest.raises(UnknownPredicateError):
        decode_goal([SimpleNamespace(predicate="Flies", objects=["robot"])], space)  # type: ignore[list-item]
    with pytest.raises(UnknownObjectError):
        decode_atoms([SimpleNamespace(predicate="IsRobot", objects=["r2d2"])], space)  # type: ignore[list-item]


def test_commands_and_stamps(script: Script) -> None:
    message = next(m.message for m in script.messages if m.type_name == COMMAND)
    action = decode_command(message, get_domain("obstacle2d").action_space)
    assert action.dtype == np.float64
    assert action.tolist() == [*message.deltas, message.gripper]
    stamp = SimpleNamespace(stamp=SimpleNamespace(sec=1_700_000_000, nanosec=999_999_999))
    assert stamp_ns(stamp) == 1_700_000_000_999_999_999  # type: ignore[arg-type]


def seen(name: str, kind: str, *features: float) -> SimpleNamespace:
    return SimpleNamespace(name=name, type=kind, features=features)


def test_what_is_seen_otherwise_is_one_of_the_state_s_objects_once() -> None:
    state = get_domain("obstacle2d").task(0).initial_state
    robot = state.layout.object("robot")
    moved = [float(value) + 1.0 for value in state[robot]]
    decoded = decode_seen([seen("robot", robot.type.name, *moved)], state)
    assert decoded[robot].tolist() == moved
    for strange in (
        [seen("robot", "block", *moved)],
        [seen("nobody", robot.type.name, *moved)],
        [seen("robot", robot.type.name, *moved[:-1])],
        [seen("robot", robot.type.name, *moved), seen("robot", robot.type.name, *state[robot])],
        [seen("robot", robot.type.name, *([float("nan")] * len(moved)))],
    ):
        with pytest.raises(InvalidStateError):
            decode_seen(strange, state)  # type: ignore[arg-type]


def test_what_is_missing_is_one_of_the_state_s_objects() -> None:
    state = get_domain("obstacle2d").task(0).initial_state
    assert decode_missing(["robot", "robot"], state) == {"robot"}
    with pytest.raises(InvalidStateError, match="ghost missing"):
        decode_missing(["robot", "ghost"], state)
