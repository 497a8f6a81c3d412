# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The metrics of runs, from the messages of an ensemble: the same code for live runs and bags.

A run begins with an episode's first PLANNING_STARTED, or with the first after a run has ended,
and ends with SOLVED or FAILED. Plan length is the number of environment steps in between, by the
step numbers of its first and last event: states that were lost on the way do not make it shorter.
A metric that the messages do not give is None, with the reason in ``RunMetrics.unknown``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from slap_ros.errors import ErrorCode
from slap_ros.evaluation.completeness import missing_events, missing_states, planning_is_whole
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
OPERATOR, SHORTCUT, UNKNOWN = "operator", "shortcut", "unknown"  # kinds of options


@dataclass(frozen=True)
class OptionMetrics:
    """One option as it was executed."""

    name: str  # of the operator or shortcut
    kind: str  # operator or shortcut; unknown without the plan
    objects: tuple[str, ...]
    steps: int  # environment steps
    outcome: str  # reached, failed, canceled or unfinished


@dataclass(frozen=True)
class RunMetrics:
    """One run. The order of the fields is that of reports and of ``--json``."""

    domain: str
    preset: str
    seed: int | None  # -1: the initial state was given explicitly
    index: int | None  # which of the seed's tasks
    success: bool  # the run was SOLVED and the goal atoms hold in its last state, as perceived
    plan_length: int  # environment steps
    shortcut_steps: int | None  # of them, those that shortcuts took
    planning_seconds: float | None  # s, all plans together
    replans: int | None
    edges_rolled_out: int | None  # options simulated while planning
    error_code: ErrorCode
    error_msg: str
    options: tuple[OptionMetrics, ...]
    planner: str | None  # of the first plan, like what follows; empty: there was no plan
    library: str | None  # digest of the shortcuts that it knew
    samples: int | None  # attempts of a shortcut in its model
    unknown: Mapping[str, str] = field(default_factory=dict)  # by metric: why it is None

    def as_json(self) -> dict[str, Any]:
        """The JSON object of ``--json``, keys in the order of the fields."""
        return asdict(self) | {
            "error_code": int(self.error_code),
            "unknown": dict(self.unknown),
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

    @property
    def planned(self) -> list[PlanEventMessage]:
        """The events that announce a plan, in order."""
        return [event for event in self.events if event.kind == PlanEventKind.PLANNED]

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

    def edges_begun(self) -> Counter[int]:
        """How many edges of its plans began at each step."""
        started = (event for event in self.events if event.kind == PlanEventKind.EDGE_STARTED)
        return Counter(event.step for event in started)

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
        self._seen_events: set[tuple[object, ...]] = set()
        self._repeated_events = 0
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

    def _add_plan_event(self, msg: PlanEventMessage) -> None:
        if self._is_new(msg, msg.plan_number, msg.edge):
            self._plan_events.append(msg)

    def _add_skill_event(self, msg: SkillEventMessage) -> None:
        if self._is_new(msg, msg.skill, *msg.objects):
            self._skill_events.append(msg)

    def _is_new(self, msg: PlanEventMessage | SkillEventMessage, *about: object) -> bool:
        """No event happens twice at one time: then it was recorded, or read, twice."""
        key = (type(msg), stamp_ns(msg.header), msg.episode, msg.step, msg.kind, *about)
        if key in self._seen_events:
            self._repeated_events += 1
            return False
        self._seen_events.add(key)
        return True

    def runs(self) -> list[RunMetrics]:
        """The metrics of every run so far, in order."""
        return [trace.metrics for trace in self.traces()]

    def traces(self) -> list[RunTrace]:
        """Every run so far, in order."""
        runs = _split(self._plan_events)
        executions = _by_run(_pair(self._skill_events), runs, self._last_step)
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

    def gaps(self) -> list[str]:
        """What is missing of the runs so far, or there twice, in words; empty for a whole log.

        A run that is still under way, or breaks off, lacks nothing for that reason alone.
        """
        found = []
        runs = _split(self._plan_events)
        for run in runs:
            where = f"episode {run.episode}: " if len(runs) > 1 else ""
            found += [where + gap for gap in self._gaps_of(run)]
        if before := _without_start(self._plan_events):
            found.append(f"{before} plan events belong to a run whose start is missing")
        if self._repeated_events:
            found.append(f"{self._repeated_events} events are there twice")
        return found

    def _gaps_of(self, run: _Run) -> Iterator[str]:
        recorded = self._steps.get(run.episode, set())
        if states := missing_states(run.start.step, self._last_step(run), recorded):
            yield states
        yield from missing_events(run.events)
        if lost := len(run.planned) - len(self._plans_of(run)):
            yield f"{lost} of {len(run.planned)} plans are missing"
        first, last = run.start.step, self._last_step(run)
        reached = sum(
            e.end is not None and e.end.kind == SkillEventKind.REACHED
            for e in _pair(self._skill_events)
            if e.start.episode == run.episode and first <= e.start.step <= last
        )
        if (lost := run.count(PlanEventKind.EDGE_REACHED) - reached) > 0:
            yield f"skill events of {lost} executed options are missing"

    def _has_plan(self, run: _Run) -> bool:
        """Whether the newest plan is here, if there is one: it tells shortcuts from options."""
        return not run.planned or self._plan_of(run.planned[-1]) is not None

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
        unknown = self._unknown(run)
        known = RunMetrics(
            domain=domain,
            preset=self._presets.get(domain, ""),
            seed=task.seed if task is not None else None,
            index=task.index if task is not None else None,
            success=success,
            plan_length=self._last_step(run) - run.start.step,
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
        blanks: dict[str, Any] = dict.fromkeys(unknown)
        return replace(known, **blanks, unknown=unknown)

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
        """The plans made in a run, in order, as far as they are here."""
        plans = (self._plan_of(event) for event in run.planned)
        return [plan for plan in plans if plan is not None]

    def _plan_of(self, planned: PlanEventMessage) -> PlanMessage | None:
        """The plan that an event announced.

        By number and order, not by stamps: clocks are set back, and each run counts from 0.
        """
        plans = list(self._plans.get(planned.episode, ()))
        for event in self._plan_events:
            if event.episode == planned.episode and event.kind == PlanEventKind.PLANNED:
                numbers = [plan.number for plan in plans]
                found = numbers.index(event.plan_number) if event.plan_number in numbers else None
                if event is planned:
                    return None if found is None else plans[found]
                del plans[: 0 if found is None else found + 1]
        return None

    def _last_step(self, run: _Run) -> int:
        """The step of the run's last event, or of the last state where it has not ended."""
        if run.end is not None:
            return run.end.step
        return max(run.events[-1].step, *self._steps.get(run.episode, ()), run.start.step)

    def _unknown(self, run: _Run) -> dict[str, str]:
        """The metrics that cannot be had, and why."""
        reasons: dict[str, str] = {}
        if run.episode not in self._tasks:
            reasons |= dict.fromkeys(("seed", "index"), "the task is missing")
        if len(self._plans_of(run)) < len(run.planned):
            reasons["shortcut_steps"] = "a plan is missing, which tells shortcuts from operators"
        if run.planned and self._plan_of(run.planned[0]) is None:
            reasons |= dict.fromkeys(("planner", "library", "samples"), "the plan is missing")
        if not planning_is_whole(run.events):
            planning = ("planning_seconds", "replans", "edges_rolled_out")
            reasons |= dict.fromkeys(planning, "an event of planning is missing")
        if run.planning_ns() < 0:
            reasons["planning_seconds"] = "the clock was set back while planning"
        return reasons

    def _measure_option(self, run: _Run, execution: _Execution) -> OptionMetrics:
        start, end = execution.start, execution.end
        learned = any(
            edge.kind == OptionKind.SHORTCUT.value and edge.name == start.skill
            for plan in self._plans.get(start.episode, ())
            for edge in plan.edges
        )
        last = end.step if end is not None else self._last_step(run)
        known = learned or len(self._plans.get(start.episode, ())) > 0
        return OptionMetrics(
            name=start.skill,
            kind=(SHORTCUT if learned else OPERATOR) if known else UNKNOWN,
            objects=tuple(start.objects),
            steps=max(0, last - start.step),
            outcome=OUTCOMES[end.kind] if end is not None else UNFINISHED,
        )


def known(value: float | str | None, form: str = "") -> str:
    """A metric for people: by a format specification, or ``unknown``."""
    return "unknown" if value is None else format(value, form)


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


def _without_start(events: Iterable[PlanEventMessage]) -> int:
    """How many plan events precede the start of the run that they belong to."""
    count, under_way, episode = 0, False, None
    for event in events:
        under_way = event.kind == PlanEventKind.PLANNING_STARTED or (
            under_way and event.episode == episode
        )
        count += not under_way
        episode = event.episode
        under_way = under_way and event.kind not in RUN_ENDS
    return count


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


def _by_run(
    executions: Iterable[_Execution], runs: Sequence[_Run], last_step: Callable[[_Run], int]
) -> list[list[_Execution]]:
    """The options of each run, in order; one that was requested by hand may belong to none.

    One run may end at the step at which the next begins. Each has as many options that begin
    there as it began edges.
    """
    begun = [run.edges_begun() for run in runs]
    found: list[list[_Execution]] = [[] for _ in runs]
    for execution in executions:
        episode, step = execution.start.episode, execution.start.step
        fitting = [
            i
            for i, run in enumerate(runs)
            if run.episode == episode and run.start.step <= step <= last_step(run)
        ]
        if fitting:
            chosen = next((i for i in fitting if begun[i][step] > 0), fitting[-1])
            begun[chosen][step] -= 1
            found[chosen].append(execution)
    return found
