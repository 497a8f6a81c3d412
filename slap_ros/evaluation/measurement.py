# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measuring a run: its metrics from all that was recorded of it.

Plan length is the number of environment steps between the run's first and last event: states that
were lost on the way do not make it shorter.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from slap_ros.errors import ErrorCode
from slap_ros.evaluation.atom_names import describe
from slap_ros.evaluation.completeness import lost_options, planning_is_whole
from slap_ros.evaluation.executed_options import ExecutedOption
from slap_ros.evaluation.metrics import OPERATOR, SHORTCUT, UNKNOWN, OptionMetrics, RunMetrics
from slap_ros.evaluation.recorded_run import EpisodeLog, RecordedRun
from slap_ros.messages.decode import NANOSECONDS, plan_bound
from slap_ros.messages.events import PlanEventKind
from slap_ros.planning.options import OptionKind

OF_FIRST_PLAN = ("planner", "library", "samples", "bound")


def measure(run: RecordedRun, options: Iterable[ExecutedOption]) -> RunMetrics:
    """The metrics of a run.

    Args:
        run: Record of the run.
        options: Options that were executed in the run, in order.
    """
    task, events = run.episode.task, run.events
    success, error_code, error_msg = _verdict(run)
    executed = list(options)
    measured = tuple(measure_option(run.episode, option, run.last_step) for option in executed)
    first = next(iter(run.plans), None)
    unknown = _unknown(run, executed)
    if success is None:
        unknown["success"] = error_msg
    known = RunMetrics(
        domain=run.domain,
        preset=run.preset,
        seed=task.seed if task is not None else None,
        index=task.index if task is not None else None,
        success=success,
        plan_length=run.last_step - run.first_step,
        shortcut_steps=sum(option.steps for option in measured if option.kind == SHORTCUT),
        planning_seconds=events.planning_ns() / NANOSECONDS,
        replans=events.count(PlanEventKind.PLANNING_STARTED) - 1,
        edges_rolled_out=events.edges_rolled_out(),
        error_code=error_code,
        error_msg=error_msg,
        options=measured,
        planner=first.planner if first is not None else "",
        library=first.library if first is not None else "",
        samples=first.samples if first is not None else 0,
        bound=plan_bound(first) if first is not None else None,
    )
    blanks: dict[str, Any] = dict.fromkeys(unknown)
    return replace(known, **blanks, unknown=unknown)


def _verdict(run: RecordedRun) -> tuple[bool | None, ErrorCode, str]:
    """Whether the run was a success, None if that is not known, and if it was not, why."""
    end = run.events.end
    if end is None:
        return False, ErrorCode.NODE_DIED, "the recording ends before the run does"
    if end.kind == PlanEventKind.FAILED:
        return False, _error_code(end.error_code), end.error_msg
    if run.goal is None:
        return None, ErrorCode.UNKNOWN, "solved, but the recording lacks the task"
    perceived = run.episode.atoms.get(end.step)
    if perceived is None:
        return None, ErrorCode.UNKNOWN, f"solved, but no atoms of step {end.step} are known"
    if missing := run.goal - perceived:
        return False, ErrorCode.UNKNOWN, f"solved, but {describe(missing)} does not hold"
    return True, ErrorCode.NONE, ""


def _error_code(value: int) -> ErrorCode:
    """The code of that value; UNKNOWN for one of another version."""
    return ErrorCode(value) if value in set(ErrorCode) else ErrorCode.UNKNOWN


def _unknown(run: RecordedRun, options: Sequence[ExecutedOption]) -> dict[str, str]:
    """The metrics that cannot be computed, and why."""
    reasons: dict[str, str] = {}
    if run.preset is None:
        reasons["preset"] = "the domain is missing"
    if run.episode.task is None:
        reasons |= dict.fromkeys(("seed", "index"), "the task is missing")
    if lost_options(run, options):
        reasons["shortcut_steps"] = "skill events are missing"
    if len(run.plans) < len(run.announced):
        reasons["shortcut_steps"] = "a plan is missing, which tells shortcuts from operators"
    if run.announced and run.announced[0] is None:
        reasons |= dict.fromkeys(OF_FIRST_PLAN, "the plan is missing")
    if not planning_is_whole(run.events.messages):
        planning = ("planning_seconds", "replans", "edges_rolled_out")
        reasons |= dict.fromkeys(planning, "an event of planning is missing")
    if run.events.planning_ns() < 0:
        reasons["planning_seconds"] = "the clock was set back while planning"
    return reasons


def measure_option(episode: EpisodeLog, option: ExecutedOption, last_step: int) -> OptionMetrics:
    """The metrics of an option.

    Args:
        episode: What was recorded of its episode.
        option: Option that was executed.
        last_step: Last step of its run, at which it is taken to end where it was not recorded.
    """
    end = option.end
    last = end.step if end is not None else last_step
    return OptionMetrics(
        name=option.start.skill,
        kind=_kind(episode, option.start.skill),
        objects=tuple(option.start.objects),
        steps=max(0, last - option.start.step),
        outcome=option.outcome,
    )


def _kind(episode: EpisodeLog, name: str) -> str:
    """Whether plans of the episode call an option a shortcut; unknown where there is no plan."""
    if not episode.plans:
        return UNKNOWN
    edges = (edge for plan in episode.plans for edge in plan.edges)
    shortcuts = {edge.name for edge in edges if edge.kind == OptionKind.SHORTCUT.value}
    return SHORTCUT if name in shortcuts else OPERATOR
