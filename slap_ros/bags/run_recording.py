# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run without nodes as the bag that an ensemble would have recorded of it.

Topics, messages and their order on each topic are the ensemble's, so that its digest is the same.
Time in it is the task's own: a control period per step, and what planning took.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from slap_ros.bags.writer import BagWriter
from slap_ros.core import Domain, Task
from slap_ros.encoding import MessageEncoder, SceneEncoder
from slap_ros.errors import ErrorCode
from slap_ros.messages.building import make_message, serialised
from slap_ros.messages.decode import NANOSECONDS
from slap_ros.messages.events import PlanEventKind, SkillEventKind
from slap_ros.perception import ExactPerceiver
from slap_ros.planning.execution import DIVERGENCES, EpisodeResult, PlanExecution
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.plan import PlanningResult
from slap_ros.versions import versions

EPISODE = 1  # number of the only episode
BEGUN = OptionResult(ErrorCode.NONE)


def bag_metadata(domain: Domain, task: Task) -> dict[str, str]:
    """What a bag says of how its run was made, but for the software's versions."""
    configuration = {f"configuration.{k}": str(v) for k, v in domain.configuration.items()}
    of_domain = {"domain": domain.name, "preset": domain.preset, **configuration}
    return of_domain | {"seed": str(task.seed), "index": str(task.index)}


def record_run(
    path: Path | str, domain: Domain, task: Task, episode: EpisodeResult, began_ns: int
) -> None:
    """Write a run as a bag.

    Args:
        path: Folder of the bag, which must not exist.
        domain: Domain of the task.
        task: What was to be solved.
        episode: What happened.
        began_ns: Time at which it began, ns since the epoch.

    Raises:
        BagExistsError: There is something at ``path``; it is left alone.
        StorageFullError: There is no room.
    """
    with BagWriter(path, bag_metadata(domain, task) | versions()) as writer:
        _RunRecording(writer, domain, task, episode, began_ns).write()


@dataclass
class _RunRecording:
    """A run on its way into a bag; ``now_ns`` goes on with what happens."""

    writer: BagWriter
    domain: Domain
    task: Task
    episode: EpisodeResult
    now_ns: int

    def __post_init__(self) -> None:
        self._encoder = MessageEncoder(make_message)
        self._scene = SceneEncoder(self._encoder)
        self._space = self.domain.atom_space(self.task.initial_state)
        self._perceiver = ExactPerceiver(self._space)
        self._step = 0
        self._number = 0  # of the plan under execution

    def write(self) -> None:
        """Write everything, in the order in which it happened."""
        stamp = self._stamp
        self._put("slap/domain", self._encoder.domain_info(self.domain, stamp))
        task = self._encoder.task(self.task, self.domain, EPISODE, stamp)
        self._put("slap/task", task)
        self._write_state(task.initial_state)
        for number, execution in enumerate(self.episode.plans):
            self._number = number
            self._write_execution(execution)
        if self.episode.success:
            self._plan_event(PlanEventKind.SOLVED)
        else:
            self._plan_event(PlanEventKind.FAILED, **_why(self.episode.error))

    @property
    def _stamp(self) -> Any:
        return self._encoder.time(self.now_ns)

    def _put(self, topic: str, message: Any) -> None:
        kind = message.__msgtype__
        self.writer.write(f"/{topic}", kind, self.now_ns, serialised(kind, message))

    def _write_state(self, message: Any) -> None:
        """The newest state, what is shown of it, and what is perceived."""
        state, stamp = self.episode.states[self._step], message.header.stamp
        self._put("slap/state", message)
        shown = self._scene.shown(self.domain.display, state, stamp)
        self._put("slap/markers", shown.markers)
        self._put("tf", shown.frames)
        if shown.joints.name:
            self._put("joint_states", shown.joints)
        percept = self._perceiver.perceive(state)
        self._put("slap/atoms", self._encoder.percept(percept, message, self._space, state))

    def _write_execution(self, execution: PlanExecution) -> None:
        """A plan, and what was executed of it."""
        announcing = PlanEventKind.IMPROVED
        if not execution.improves:
            announcing = PlanEventKind.PLANNED
            self._plan_event(PlanEventKind.PLANNING_STARTED)
            self.now_ns += round(execution.seconds * NANOSECONDS)
        if execution.planned is None:
            return
        self._write_plan(execution.planned, announcing)
        edges = zip(execution.outcomes, execution.steps, strict=True)
        for number, (outcome, steps) in enumerate(edges):
            self._write_edge(execution.planned, number, outcome, steps)

    def _write_plan(self, planned: PlanningResult, announcing: PlanEventKind) -> None:
        self._plan_event(announcing, edges_rolled_out=planned.edges_rolled_out)
        goal = self._space.mask(self.task.goal)
        at = EPISODE, self._number, self._stamp
        made = asdict(planned.origin)
        self._put("slap/plan", self._encoder.plan(planned, goal, self._space, *at, made))

    def _write_edge(
        self, planned: PlanningResult, number: int, outcome: OptionResult, steps: int
    ) -> None:
        """An edge of a plan, from its start to its end.

        Args:
            planned: The plan.
            number: Index of the edge.
            outcome: How its execution ended.
            steps: Environment steps that it took.
        """
        option = planned.plan.edges[number].option
        begins = outcome.code is not ErrorCode.SKILL_NOT_APPLICABLE

        def skill_event(kind: SkillEventKind, how: OptionResult) -> None:
            if begins:
                at = EPISODE, self._step, self._stamp
                self._put("slap/skill_events", self._encoder.skill_event(kind, option, how, *at))

        self._plan_event(PlanEventKind.EDGE_STARTED, edge=number)
        skill_event(SkillEventKind.STARTED, BEGUN)
        for _ in range(steps):
            self._write_step()
        if outcome.reached:
            skill_event(SkillEventKind.REACHED, outcome)
            self._plan_event(PlanEventKind.EDGE_REACHED, edge=number)
            return
        skill_event(SkillEventKind.FAILED, outcome)
        if outcome.code in DIVERGENCES:
            self._plan_event(PlanEventKind.DIVERGED, edge=number, **_why(outcome))

    def _write_step(self) -> None:
        """A command and the state that it leads to."""
        action, actions = self.episode.actions[self._step], self.domain.action_space
        command = self._encoder.command(action, actions, EPISODE, self._step, self._stamp)
        self._put("slap/command", command)
        self.now_ns += round(self.domain.execution.control_period_s * NANOSECONDS)
        self._step += 1
        state = self.episode.states[self._step]
        self._write_state(self._encoder.state(state, EPISODE, self._step, self._stamp))

    def _plan_event(self, kind: PlanEventKind, **details: Any) -> None:
        about = {"plan_number": self._number, **details}
        event = self._encoder.plan_event(int(kind), EPISODE, self._step, self._stamp, **about)
        self._put("slap/plan_events", event)


def _why(outcome: OptionResult) -> dict[str, Any]:
    """Why something failed, as fields of an event."""
    return {"error_code": int(outcome.code), "error_msg": outcome.reason}
