# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the skill server: what was asked for, how far it is, how it ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from slap_msgs.action import ExecuteSkill
from slap_msgs.msg import PlanEdge

from ensemble.node_liveness import NodeLiveness
from ensemble.observation import Observation
from ensemble.shortcuts import ShortcutProvider
from slap_ros.errors import EpisodeChangedError, ErrorCode, UnknownSkillError
from slap_ros.messages.decode import decode_atoms
from slap_ros.planning.options import (
    HOLD,
    Option,
    OptionExecution,
    OptionKind,
    Stopped,
    given_option,
    hold_option,
)
from slap_ros.relational import Object


@dataclass
class SkillExecution:
    """A skill under way."""

    goal: ServerGoalHandle
    execution: OptionExecution
    start: Observation
    step_budget: int  # environment steps
    planner: NodeLiveness  # nobody watches the plan when it is gone
    heard_s: float  # node time of the newest observation
    latest: Observation = field(init=False)
    ended: Future = field(default_factory=Future)  # of Stopped

    def __post_init__(self) -> None:
        self.latest = self.start

    @property
    def steps(self) -> int:
        """Environment steps taken so far."""
        return self.latest.step - self.start.step

    def stop(self, code: ErrorCode, reason: str) -> None:
        """End with an error."""
        self.ended.set_result(Stopped(code, f"{self.execution.option}: {reason}"))


def requested_option(
    request: ExecuteSkill.Goal, start: Observation, repertoires: ShortcutProvider
) -> tuple[Option, int]:
    """The option that a goal asks for and the abstract state in which it shall end.

    Raises:
        EpisodeChangedError: The goal is for another episode.
        UnknownSkillError: There is no such option, or it does not lead there from here.
        UnknownObjectError: The task has no such object.
    """
    episode, edge = start.episode, request.edge
    if request.episode != episode.number:
        raise EpisodeChangedError(
            f"goal for episode {request.episode}, but episode {episode.number} is under way"
        )
    if edge.name == HOLD:
        return hold_option(episode.domain.action_space), 0
    objects = [episode.space.layout.object(name) for name in edge.objects]
    target = decode_atoms(edge.expected_atoms, episode.space)
    if edge.kind == OptionKind.SHORTCUT.value:
        return _shortcut(edge, objects, start, target, repertoires), target
    return given_option(episode.domain, edge.name, objects), target


def _shortcut(
    edge: PlanEdge,
    objects: Sequence[Object],
    start: Observation,
    target: int,
    repertoires: ShortcutProvider,
) -> Option:
    """A shortcut from where the robot is."""
    episode, name = start.episode, edge.name
    known = [shortcut.name for shortcut in repertoires.shortcuts(episode.domain)]
    repertoire = repertoires.of(episode)
    if repertoire is None or name not in known:
        loaded = f"there are {', '.join(known)}" if known else "no shortcut library is loaded"
        raise UnknownSkillError(f"unknown shortcut {name!r}: {loaded}")
    option = repertoire.option(name, start.abstract, target, edge.attempt)
    if option is None:
        raise UnknownSkillError(
            f"{name} does not lead from here to the expected atoms: what they change is not what "
            "it was learned for"
        )
    if tuple(objects) != option.objects:
        about, got = (", ".join(map(str, names)) for names in (option.objects, objects))
        raise UnknownSkillError(
            f"{name} from here to the expected atoms is about ({about}), not ({got})"
        )
    return option


def result(stopped: Stopped, steps: int) -> ExecuteSkill.Result:
    """The action's result."""
    return ExecuteSkill.Result(steps=steps, error_code=int(stopped.code), error_msg=stopped.reason)
