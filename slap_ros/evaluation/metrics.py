# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The metrics of runs, from the messages of an ensemble: the same code for live runs and bags.

A run begins with an episode's first PLANNING_STARTED, or with the first after a run has ended,
and ends with SOLVED or FAILED. Plan length is the number of environment steps in between.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from slap_ros.errors import ErrorCode
from slap_ros.messages.decode import NANOSECONDS, stamp_ns
from slap_ros.messages.events import PlanEventKind, SkillEventKind
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
    GroundAtomMessage,
    PlanEventMessage,
    PlanMessage,
    SkillEventMessage,
    StateMessage,
    TaskMessage,
)
from slap_ros.planning.options import OptionKind

AtomNames = frozenset[tuple[str, tuple[str, ...]]]  # (predicate, objects)

RUN_ENDS = (PlanEventKind.SOLVED, PlanEventKind.FAILED)
PLANNING_ENDS = (PlanEventKind.PLANNED, PlanEventKind.FAILED)
OUTCOMES: Mapping[int, str] = {
    SkillEventKind.REACHED: "reached",
    SkillEventKind.FAILED: "failed",
    SkillEventKind.CANCELED: "canceled",
}
UNFINISHED = "unfinished"
OPERATOR, SHORTCUT = "operator", "shortcut"  # kinds of options


@dataclass(frozen=True)
class OptionMetrics:
    """One option as it was executed."""

    name: str  # of the operator or shortcut
    kind: str  # operator or shortcut
    objects: tuple[str, ...]
    steps: int  # environment steps
    outcome: str  # reached, failed, canceled or unfinished


@dataclass(frozen=True)
class RunMetrics:
    """One run. The order of the fields is that of reports and of ``--json``."""

    domain: str
    preset: str
    seed: int  # -1: the initial state was given explicitly, or no task is known
    index: int  # which of the seed's tasks
    success: bool  # the run was SOLVED and the goal atoms hold in its last state, as perceived
    plan_length: int  # environment steps
    shortcut_steps: int  # of them, those that shortcuts took
    planning_seconds: float  # s, all plans together
    replans: int
    edges_rolled_out: int  # options simulated while planning
    error_code: ErrorCode
    error_msg: str
    options: tuple[OptionMetrics, ...]
    planner: str  # of the first plan, like what follows; empty: there was no plan
    library: str  # digest of the shortcuts that it knew
    samples: int  # attempts of a shortcut in its model

    def as_json(self) -> dict[str, Any]:
        """Plain data, keys in the order of the fields."""
        return asdict(self) | {
            "error_code": int(self.error_code),
            "options": [
                asdict(option) | {"objects": list(option.objects)} for option in self.options
            ],
        }


@dataclass(frozen=True)
class RunTrace:
    """A run together with the messages that tell when what happened in it."""

    metrics: RunMetrics
    episode: int
    first_step: int
    last_step: int
    starts: tuple[int, ...]  # the step at which each of the metrics' options began
    goal: AtomNames | None  # None: neither a plan nor the task is known
    plans: tuple[PlanMessage, ...]  # in order
    events: tuple[PlanEventMessage, ...]  # in order


@dataclass(frozen=True)
class _Run:
    """The plan events of a run, in order."""

    events: Sequence[PlanEventMessage]

    @property
    def start(self) -> PlanEventMessage:
        return self.events[0]

    @property
    def episode(self) -> int:
        return self.start.episode

    @property
    def end(self) -> PlanEventMessage | None:
        return self.events[-1] if self.events[-1].kind in RUN_ENDS else None

    def planning_ns(self) -> int:
        total, started = 0, None
        for event in self.events:
            if event.kind == PlanEventKind.PLANNING_STARTED:
                started = stamp_ns(event.header)
            elif event.kind in PLANNING_ENDS and started is not None:
                total += stamp_ns(event.header) - started
                started = None
        return total

    def count(self, kind: PlanEventKind) -> int:
        return sum(event.kind == kind for event in self.events)

    def edges_rolled_out(self) -> int:
        return sum(event.edges_rolled_out for event in self.events if event.kind in PLANNING_ENDS)


@dataclass
class _Execution:
    """An option from its STARTED on."""

    start: SkillEventMessage
    end: SkillEventMessage | None = None


class RunLog:
    """Collects the messages of an ensemble and tells what its runs were like.

    Messages of one topic are added in order; how the topics interleave does not matter.
    """

    def __init__(self) -> None:
        self._presets: dict[str, str] = {}  # by domain
        self._tasks: dict[int, TaskMessage] = {}  # by episode, like all that follows
        self._steps: dict[int, set[int]] = {}
        self._atoms: dict[tuple[int, int], AtomNames] = {}  # by episode and step
        self._same: dict[AtomNames, AtomNames] = {}  # abstract states recur: keep each once
        self._plans: dict[int, list[PlanMessage]] = {}
        self._plan_events: list[PlanEventMessage] = []
        self._skill_events: list[SkillEventMessage] = []
        self._add: Mapping[str, Callable[[Any], None]] = {
            DOMAIN_INFO: self._add_domain,
            TASK: self._add_task,
            STATE: self._add_state,
            ATOMS: self._add_atoms,
            PLAN: self._add_plan,
            PLAN_EVENT: self._plan_events.append,
            SKILL_EVENT: self._skill_events.append,
        }

    def add(self, type_name: str, message: object) -> None:
        """Take a message, such as one of type ``slap_msgs/msg/Task``. Other types do not count."""
        if type_name in self._add:
            self._add[type_name](message)

    def _add_domain(self, msg: DomainInfoMessage) -> None:
        self._presets[msg.name] = msg.preset

    def _add_task(self, msg: TaskMessage) -> None:
        self._tasks[msg.episode] = msg

    def _add_state(self, msg: StateMessage) -> None:
        self._steps.setdefault(msg.episode, set()).add(msg.step)

    def _add_atoms(self, msg: AtomsMessage) -> None:
        atoms = atom_names(msg.atoms)
        self._atoms[msg.episode, msg.step] = self._same.setdefault(atoms, atoms)

    def _add_plan(self, msg: PlanMessage) -> None:
        self._plans.setdefault(msg.episode, []).append(msg)

    def runs(self) -> list[RunMetrics]:
        """The metrics of every run so far, in order."""
        return [trace.metrics for trace in self.traces()]

    def traces(self) -> list[RunTrace]:
        """Every run so far, in order."""
        runs = _split(self._plan_events)
        executions: list[list[_Execution]] = [[] for _ in runs]
        for execution in _pair(self._skill_events):
            position = _position(execution.start, runs, self._last_step)
            if position is not None:
                executions[position].append(execution)
        return [self._trace(run, own) for run, own in zip(runs, executions, strict=True)]

    @property
    def complete(self) -> bool:
        """Whether the newest run has ended and all that its events refer to is here as well."""
        runs = _split(self._plan_events)
        if not runs or runs[-1].end is None:
            return False
        run, end = runs[-1], runs[-1].end
        own = [e for e in _pair(self._skill_events) if e.start.episode == run.episode]
        reached = sum(e.end is not None and e.end.kind == SkillEventKind.REACHED for e in own)
        return (
            (end.step == run.start.step or end.step in self._steps.get(run.episode, ()))
            and (run.episode, end.step) in self._atoms
            and reached >= run.count(PlanEventKind.EDGE_REACHED)
            and self._has_plan(run)
        )

    def _has_plan(self, run: _Run) -> bool:
        """Whether the newest plan is here, if there is one: it tells shortcuts from options."""
        planned = [stamp_ns(e.header) for e in run.events if e.kind == PlanEventKind.PLANNED]
        plans = self._plans.get(run.episode, ())
        return not planned or any(stamp_ns(plan.header) >= planned[-1] for plan in plans)

    def _trace(self, run: _Run, executions: Sequence[_Execution]) -> RunTrace:
        return RunTrace(
            metrics=self._measure(run, executions),
            episode=run.episode,
            first_step=run.start.step,
            last_step=self._last_step(run),
            starts=tuple(execution.start.step for execution in executions),
            goal=self._goal(run),
            plans=tuple(self._plans_of(run)),
            events=tuple(run.events),
        )

    def _measure(self, run: _Run, executions: Iterable[_Execution]) -> RunMetrics:
        task = self._tasks.get(run.episode)
        domain = task.domain if task is not None else next(iter(self._presets), "")
        success, error_code, error_msg = self._verdict(run)
        options = tuple(self._measure_option(run, execution) for execution in executions)
        first = next(iter(self._plans_of(run)), None)
        return RunMetrics(
            domain=domain,
            preset=self._presets.get(domain, ""),
            seed=task.seed if task is not None else -1,
            index=task.index if task is not None else 0,
            success=success,
            plan_length=self._plan_length(run),
            shortcut_steps=sum(option.steps for option in options if option.kind == SHORTCUT),
            planning_seconds=run.planning_ns() / NANOSECONDS,
            replans=run.count(PlanEventKind.PLANNING_STARTED) - 1,
            edges_rolled_out=run.edges_rolled_out(),
            error_code=error_code,
            error_msg=error_msg,
            options=options,
            planner=first.planner if first is not None else "",
            library=first.library if first is not None else "",
            samples=first.samples if first is not None else 0,
        )

    def _verdict(self, run: _Run) -> tuple[bool, ErrorCode, str]:
        end = run.end
        if end is None:
            return False, ErrorCode.NODE_DIED, "the recording ends before the run does"
        if end.kind == PlanEventKind.FAILED:
            return False, _error_code(end.error_code), end.error_msg
        goal = self._goal(run)
        if goal is None:
            return False, ErrorCode.UNKNOWN, "solved, but the recording lacks the task"
        perceived = self._atoms.get((run.episode, end.step))
        if perceived is None:
            return False, ErrorCode.UNKNOWN, f"solved, but no atoms of step {end.step} are known"
        if missing := goal - perceived:
            return False, ErrorCode.UNKNOWN, f"solved, but {describe(missing)} does not hold"
        return True, ErrorCode.NONE, ""

    def _goal(self, run: _Run) -> AtomNames | None:
        """What the run was to reach: the goal of its plans, or else the task's own."""
        for plan in reversed(self._plans_of(run)):
            if len(plan.goal):
                return atom_names(plan.goal)
        task = self._tasks.get(run.episode)
        return atom_names(task.goal) if task is not None else None

    def _plans_of(self, run: _Run) -> list[PlanMessage]:
        """The plans made in a run, in order."""
        first, last = stamp_ns(run.start.header), stamp_ns(run.events[-1].header)
        plans = self._plans.get(run.episode, ())
        return [plan for plan in plans if first <= stamp_ns(plan.header) <= last]

    def _plan_length(self, run: _Run) -> int:
        first, last = run.start.step, self._last_step(run)
        return sum(first < step <= last for step in self._steps.get(run.episode, ()))

    def _last_step(self, run: _Run) -> int:
        if run.end is not None:
            return run.end.step
        return max(self._steps.get(run.episode, {run.start.step}))

    def _measure_option(self, run: _Run, execution: _Execution) -> OptionMetrics:
        start, end = execution.start, execution.end
        learned = any(
            edge.kind == OptionKind.SHORTCUT.value and edge.name == start.skill
            for plan in self._plans.get(start.episode, ())
            for edge in plan.edges
        )
        last = end.step if end is not None else self._last_step(run)
        return OptionMetrics(
            name=start.skill,
            kind=SHORTCUT if learned else OPERATOR,
            objects=tuple(start.objects),
            steps=max(0, last - start.step),
            outcome=OUTCOMES[end.kind] if end is not None else UNFINISHED,
        )


def atom_names(msgs: Iterable[GroundAtomMessage]) -> AtomNames:
    """The atoms by their names alone."""
    return frozenset((msg.predicate, tuple(msg.objects)) for msg in msgs)


def describe(atoms: Iterable[tuple[str, tuple[str, ...]]]) -> str:
    """Atoms by their names, for people."""
    return ", ".join(f"{predicate}({', '.join(objs)})" for predicate, objs in sorted(atoms))


def _error_code(value: int) -> ErrorCode:
    """The code of that value; UNKNOWN for one of another version."""
    return ErrorCode(value) if value in set(ErrorCode) else ErrorCode.UNKNOWN


def _split(events: Iterable[PlanEventMessage]) -> list[_Run]:
    """The runs among plan events. What precedes the first start belongs to none."""
    runs: list[list[PlanEventMessage]] = []
    under_way = False
    for event in events:
        if under_way and event.episode != runs[-1][0].episode:
            under_way = False  # the simulator was reset in the middle of a run
        if not under_way:
            if event.kind != PlanEventKind.PLANNING_STARTED:
                continue
            runs.append([])
            under_way = True
        runs[-1].append(event)
        under_way = event.kind not in RUN_ENDS
    return [_Run(run) for run in runs]


def _pair(events: Iterable[SkillEventMessage]) -> list[_Execution]:
    """Each option's STARTED with the event that ended it."""
    executions: list[_Execution] = []
    under_way: dict[tuple[int, str, tuple[str, ...]], _Execution] = {}
    for event in events:
        key = (event.episode, event.skill, tuple(event.objects))
        if event.kind == SkillEventKind.STARTED:
            executions.append(_Execution(event))
            under_way[key] = executions[-1]
        elif event.kind in OUTCOMES and key in under_way:
            under_way.pop(key).end = event
    return executions


def _position(
    start: SkillEventMessage, runs: Sequence[_Run], last_step: Callable[[_Run], int]
) -> int | None:
    """The run in which an option started; None for one that was requested by hand.

    One run may end at the step at which the next begins: then the stamps decide.
    """
    fitting = [
        i
        for i, run in enumerate(runs)
        if run.episode == start.episode and run.start.step <= start.step <= last_step(run)
    ]
    begun = [i for i in fitting if stamp_ns(runs[i].start.header) <= stamp_ns(start.header)]
    if begun:
        return begun[-1]
    return fitting[0] if fitting else None
