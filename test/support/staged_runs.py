# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs with what a plain one lacks: shortcuts, a plan that breaks, markers, an arm, bad names."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slap_ros.domains import get_domain
from slap_ros.messages import interfaces
from slap_ros.messages.decode import decode_state
from slap_ros.messages.events import PlanEventKind
from support.truthful_run import Published, Script, make

HOSTILE = [
    "</script><script>window.pwned = 1</script>",
    "\"><img src=x onerror='window.pwned = 1'>",
    "<!-- <style> & {{ 7 * 7 }} {% raw %} ]]>",
    "' onfocus='window.pwned = 1' autofocus='",
    "\u202egnirts a \u2066\x07\x1b[31m",
    "javascript:window.pwned=1//" + "x" * 300,
]


def with_markers(script: Script) -> list[Published]:
    """The run as a pure planner made it, with what RViz was shown of each state."""
    types = script.domain.types_by_name
    published = []
    for item in copy.deepcopy(script.messages):
        published.append(item)
        if item.type_name == interfaces.PLAN:
            item.message.library, item.message.samples = "", 0
        if item.type_name == interfaces.STATE:
            bodies = script.domain.display.bodies(decode_state(item.message, types))
            markers = make(
                "visualization_msgs/msg/MarkerArray",
                markers=[_marker(body, item.message.header) for body in bodies],
            )
            published.append(
                Published("/slap/markers", interfaces.MARKERS, item.stamp_ns + 1, markers)
            )
    return published


def with_a_shortcut(script: Script) -> list[Published]:
    """The run as if its second option were learned, and the plan had broken just before it."""
    messages = copy.deepcopy(script.messages)
    first = next(item for item in messages if item.type_name == interfaces.PLAN)
    first.message.edges[1].kind = 1
    at = next(
        i
        for i, item in enumerate(messages)
        if item.type_name == interfaces.PLAN_EVENT
        and (item.message.kind, item.message.edge) == (PlanEventKind.EDGE_STARTED, 1)
    )
    started = messages[at]
    second = replace(first, message=copy.deepcopy(first.message))
    second.message.header, second.message.number = started.message.header, 1
    del second.message.edges[0]
    broken = []
    for kind, plan, error, text in (
        (PlanEventKind.EDGE_STARTED, 0, 0, ""),
        (PlanEventKind.DIVERGED, 0, 53, "it ended elsewhere"),
        (PlanEventKind.PLANNING_STARTED, 1, 0, ""),
        (PlanEventKind.PLANNED, 1, 0, ""),
    ):
        event = copy.deepcopy(started)
        event.message.kind, event.message.plan_number = int(kind), plan
        event.message.error_code, event.message.error_msg = error, text
        broken.append(event)
    for item in messages[at:]:
        if item.type_name == interfaces.PLAN_EVENT:
            item.message.plan_number = 1
            item.message.edge = max(0, item.message.edge - 1)
    return [*messages[:at], *broken, second, *messages[at:]]


def tower() -> list[Published]:
    """A Panda that turns about its first joint for some steps, and is given up then."""
    stage = Script(seed=1)
    stage.domain = get_domain("obstacle_tower")
    task = stage.domain.task(1)
    stage.space = stage.domain.atom_space(task.initial_state)
    stage.publish_domain()
    stage.publish(
        "/slap/task",
        interfaces.TASK,
        episode=1,
        domain=stage.domain.name,
        seed=1,
        index=0,
        initial_state=make(
            interfaces.STATE, header=stage.header(), **stage.state_fields(task.initial_state, 0)
        ),
        goal=stage.atoms_of(task.goal),
        step_limit=task.step_limit,
    )
    stage.publish_state(task.initial_state, 0)
    stage.plan_event(PlanEventKind.PLANNING_STARTED, 0)
    robot = next(obj for obj in task.initial_state.objects if obj.type.name == "robot")
    for step in range(1, 13):
        state = task.initial_state.replace({(robot, "joint1"): 0.08 * step})
        stage.publish_state(state, step)
    stage.plan_event(PlanEventKind.FAILED, 12)
    return stage.messages


def hostile(messages: Iterable[Published], words: Sequence[str]) -> list[Published]:
    """The messages with other names for whatever is named by whoever recorded them."""
    names: dict[str, str] = {}
    fresh = itertools.cycle(words)

    def renamed(name: str) -> str:
        if name not in names:
            names[name] = f"{next(fresh)} {len(names)}"
        return names[name]

    changed = copy.deepcopy(list(messages))
    for item in changed:
        _rename(item.message, renamed)
    return changed


def _rename(message: Any, renamed: Any) -> None:
    """Objects, options and settings, but not what ties a bag to its domain."""
    for field in ("skill", "planner", "library", "error_msg", "key", "value"):
        if getattr(message, field, ""):
            setattr(message, field, renamed(getattr(message, field)))
    kind = type(message).__name__
    if kind.endswith(("ObjectState", "PlanEdge")):
        message.name = renamed(message.name)
    if kind.endswith(("GroundAtom", "PlanEdge", "SkillEvent")):
        message.objects = [renamed(name) for name in message.objects]
    inner = ("objects", "atoms", "goal", "edges", "expected_atoms", "configuration", "versions")
    for field in inner:
        for part in getattr(message, field, ()):
            if not isinstance(part, str):
                _rename(part, renamed)
    if hasattr(message, "initial_state"):
        _rename(message.initial_state, renamed)


def _marker(body: Any, header: Any) -> Any:
    def point(name: str, values: Iterable[float], letters: str = "xyz") -> Any:
        return make(name, **dict(zip(letters, map(float, values), strict=True)))

    zero = make("builtin_interfaces/msg/Duration", sec=0, nanosec=0)
    return make(
        "visualization_msgs/msg/Marker",
        header=header,
        ns="bodies",
        id=0,
        type=1,
        action=0,
        pose=make(
            "geometry_msgs/msg/Pose",
            position=point("geometry_msgs/msg/Point", body.position),
            orientation=point("geometry_msgs/msg/Quaternion", body.quaternion, "xyzw"),
        ),
        scale=point("geometry_msgs/msg/Vector3", body.size),
        color=point("std_msgs/msg/ColorRGBA", body.colour, "rgba"),
        lifetime=zero,
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=make(
            "sensor_msgs/msg/CompressedImage", header=header, format="", data=np.empty(0, np.uint8)
        ),
        uv_coordinates=[],
        text=body.name,
        mesh_resource="",
        mesh_file=make("visualization_msgs/msg/MeshFile", filename="", data=np.empty(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )
