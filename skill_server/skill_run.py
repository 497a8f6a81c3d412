# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the skill server: what was asked for, how far it is, how it ended."""

from __future__ import annotations

from dataclasses import dataclass, field

from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from slap_msgs.action import ExecuteSkill

from ensemble.observation import Observation
from slap_ros.errors import EpisodeChangedError, ErrorCode, UnknownSkillError
from slap_ros.messages.decode import decode_atoms
from slap_ros.planning.options import Option, OptionExecution, OptionKind, Stopped, given_option


@dataclass
class SkillRun:
    """A skill under way."""

    goal: ServerGoalHandle
    execution: OptionExecution
    start: Observation
    step_budget: int  # environment steps
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


def requested_option(request: ExecuteSkill.Goal, start: Observation) -> tuple[Option, int]:
    """The option that a goal asks for and the abstract state in which it shall end.

    Raises:
        EpisodeChangedError: The goal is for another episode.
        UnknownSkillError: There is no such option.
        UnknownObjectError: The task has no such object.
    """
    episode, edge = start.episode, request.edge
    if request.episode != episode.number:
        raise EpisodeChangedError(
            f"goal for episode {request.episode}, but episode {episode.number} is under way"
        )
    if edge.kind != OptionKind.OPERATOR.value:
        raise UnknownSkillError(f"unknown shortcut {edge.name!r}: no shortcut library is loaded")
    objects = [episode.space.layout.object(name) for name in edge.objects]
    target = decode_atoms(edge.expected_atoms, episode.space)
    return given_option(episode.domain, edge.name, objects), target


def result(stopped: Stopped, steps: int) -> ExecuteSkill.Result:
    """The action's result."""
    return ExecuteSkill.Result(steps=steps, error_code=int(stopped.code), error_msg=stopped.reason)
