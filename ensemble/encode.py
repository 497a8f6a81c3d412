# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Core objects into messages of ROS. The way back is ``slap_ros.messages.decode``."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from slap_ros.encoding import FRAME, MessageEncoder, SceneEncoder

__all__ = [
    "FRAME",
    "ENCODER",
    "SCENE",
    "atoms",
    "command",
    "domain_info",
    "fault",
    "goal",
    "header",
    "key_values",
    "percept",
    "plan",
    "plan_edge",
    "plan_event",
    "shortcut_info",
    "skill_event",
    "skill_info",
    "state",
    "task",
    "time",
]


def _make(type_name: str, **fields: Any) -> Any:
    return _message_class(type_name)(**fields)


@cache
def _message_class(type_name: str) -> Any:
    package, kind, name = type_name.split("/")
    return getattr(import_module(f"{package}.{kind}"), name)


ENCODER = MessageEncoder(_make)
SCENE = SceneEncoder(ENCODER)
time = ENCODER.time
header = ENCODER.header
domain_info = ENCODER.domain_info
key_values = ENCODER.key_values
state = ENCODER.state
atoms = ENCODER.atoms
percept = ENCODER.percept
goal = ENCODER.goal
task = ENCODER.task
command = ENCODER.command
fault = ENCODER.fault
plan_edge = ENCODER.plan_edge
plan = ENCODER.plan
plan_event = ENCODER.plan_event
skill_event = ENCODER.skill_event
skill_info = ENCODER.skill_info
shortcut_info = ENCODER.shortcut_info
