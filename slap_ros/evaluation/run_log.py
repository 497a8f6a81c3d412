# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The log of runs, from the messages of an ensemble: the same code for live runs and bags."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from typing import Any

from slap_ros.evaluation.atom_names import AtomNames, atom_names
from slap_ros.evaluation.completeness import gaps_of, is_complete
from slap_ros.evaluation.distinct_events import DistinctEvents
from slap_ros.evaluation.executed_options import ExecutedOption, executed_options, options_by_run
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.recorded_run import EpisodeLog, RecordedRun, announced_plans
from slap_ros.evaluation.run_events import RunEvents, count_without_start, split_into_runs
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.evaluation.unrecorded_run import unrecorded_run
from slap_ros.messages.interfaces import (
    ATOMS,
    DOMAIN_INFO,
    PLAN,
    PLAN_EVENT,
    SKILL_EVENT,
    STATE,
    TASK,
)
from slap_ros.messages.protocols import (
    AtomsMessage,
    DomainInfoMessage,
    PlanEventMessage,
    PlanMessage,
    SkillEventMessage,
    StateMessage,
    TaskMessage,
)


class RunLog:
    """Collects the messages of an ensemble, and gives the metrics of its runs.

    Messages of one topic are added in order; how the topics interleave does not matter.
    """

    def __init__(self) -> None:
        self._presets: dict[str, str] = {}  # preset by domain
        self._episodes: defaultdict[int, EpisodeLog] = defaultdict(EpisodeLog)
        self._same: dict[AtomNames, AtomNames] = {}  # abstract states recur: keep each once
        self._plan_events = DistinctEvents[PlanEventMessage]()
        self._skill_events = DistinctEvents[SkillEventMessage]()
        self._add: Mapping[str, Callable[[Any], None]] = {
            DOMAIN_INFO: self._add_domain,
            TASK: self._add_task,
            STATE: self._add_state,
            ATOMS: self._add_atoms,
            PLAN: self._add_plan,
            PLAN_EVENT: self._add_plan_event,
            SKILL_EVENT: self._add_skill_event,
        }

    def add(self, type_name: str, message: object) -> None:
        """Add a message, such as one of type ``slap_msgs/msg/Task``; unknown types are ignored."""
        if type_name in self._add:
            self._add[type_name](message)

    def runs(self) -> list[RunMetrics]:
        """The metrics of every run so far, in order."""
        return [trace.metrics for trace in self.traces()]

    def traces(self) -> list[RunTrace]:
        """Every run so far, in order; those whose events are missing go last."""
        runs = self._recorded()
        options = options_by_run(executed_options(self._skill_events.messages), runs)
        found = [RunTrace.of(run, own) for run, own in zip(runs, options, strict=True)]
        return found + [self._unrecorded(number) for number in self._without_events()]

    def executed_in(self, episode: int) -> list[ExecutedOption]:
        """Every option that was executed in an episode, in order, those of no run among them."""
        options = executed_options(self._skill_events.messages)
        return [option for option in options if option.start.episode == episode]

    @property
    def complete(self) -> bool:
        """Whether the newest run has ended and all that its events refer to is here as well."""
        runs = self._recorded()
        return bool(runs) and is_complete(runs[-1], self.executed_in(runs[-1].events.episode))

    def gaps(self) -> list[str]:
        """What is missing or repeated in the runs so far, in words; empty for a whole log.

        A run that is still under way, or breaks off, lacks nothing for that reason alone.
        """
        found = []
        runs = self._recorded()
        for run in runs:
            episode = run.events.episode
            where = f"episode {episode}: " if len(runs) > 1 else ""
            found += [where + gap for gap in gaps_of(run, self.executed_in(episode))]
        found += [
            f"the plan events of episode {number} are missing" for number in self._without_events()
        ]
        if (runs or self._without_events()) and not self._presets:
            found.append("nothing names its domain")
        if before := count_without_start(self._plan_events.messages):
            found.append(f"{before} plan events belong to a run whose start is missing")
        if repeated := self._plan_events.repeated + self._skill_events.repeated:
            found.append(f"{repeated} events are there twice")
        return found

    def _recorded(self) -> list[RecordedRun]:
        """The record of each run so far."""
        by_episode: defaultdict[int, list[PlanEventMessage]] = defaultdict(list)
        for event in self._plan_events.messages:
            by_episode[event.episode].append(event)
        plans: dict[int, PlanMessage] = {}
        for number, events in by_episode.items():
            plans |= announced_plans(events, self._episode(number).plans)
        return [self._run(run, plans) for run in split_into_runs(self._plan_events.messages)]

    def _run(self, events: RunEvents, plans: Mapping[int, PlanMessage]) -> RecordedRun:
        episode = self._episode(events.episode)
        announced = [plans.get(id(event)) for event in events.planned]
        return RecordedRun(*self._domain(episode), events, episode, announced)

    def _without_events(self) -> list[int]:
        """The episodes that have plans and no plan event: something was run in them."""
        told = {event.episode for event in self._plan_events.messages}
        return [n for n, one in sorted(self._episodes.items()) if one.plans and n not in told]

    def _unrecorded(self, number: int) -> RunTrace:
        episode = self._episode(number)
        return unrecorded_run(number, *self._domain(episode), episode, self.executed_in(number))

    def _domain(self, episode: EpisodeLog) -> tuple[str, str | None]:
        """Name and preset of an episode's domain, as far as they are known."""
        task = episode.task
        domain = task.domain if task is not None else next(iter(self._presets), "")
        return domain, self._presets.get(domain)

    def _episode(self, number: int) -> EpisodeLog:
        return self._episodes.get(number, EpisodeLog())

    def _add_domain(self, msg: DomainInfoMessage) -> None:
        self._presets[msg.name] = msg.preset

    def _add_task(self, msg: TaskMessage) -> None:
        self._episodes[msg.episode].task = msg

    def _add_state(self, msg: StateMessage) -> None:
        self._episodes[msg.episode].steps.add(msg.step)

    def _add_atoms(self, msg: AtomsMessage) -> None:
        atoms = atom_names(msg.atoms)
        self._episodes[msg.episode].atoms[msg.step] = self._same.setdefault(atoms, atoms)

    def _add_plan(self, msg: PlanMessage) -> None:
        self._episodes[msg.episode].plans.append(msg)

    def _add_plan_event(self, msg: PlanEventMessage) -> None:
        self._plan_events.add(msg, msg.plan_number, msg.edge)

    def _add_skill_event(self, msg: SkillEventMessage) -> None:
        self._skill_events.add(msg, msg.skill, *msg.objects)
