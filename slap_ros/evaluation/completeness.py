# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the log of a run lacks: states, plans and events that others presuppose."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise

from slap_ros.evaluation.executed_options import ExecutedOption
from slap_ros.evaluation.recorded_run import RecordedRun
from slap_ros.messages.events import ANNOUNCING
from slap_ros.messages.events import PlanEventKind as Kind
from slap_ros.messages.protocols import PlanEventMessage

# What may follow upon an event of a run. A planner that was started again begins with plan 0.
FOLLOWERS: Mapping[int, Collection[Kind]] = {
    Kind.PLANNING_STARTED: (Kind.PLANNED, Kind.PLANNING_STARTED, Kind.FAILED),
    Kind.PLANNED: (Kind.EDGE_STARTED, Kind.SOLVED, Kind.FAILED),
    Kind.EDGE_STARTED: (Kind.EDGE_REACHED, Kind.DIVERGED, Kind.FAILED),
    Kind.EDGE_REACHED: (Kind.EDGE_STARTED, Kind.IMPROVED, Kind.SOLVED, Kind.FAILED),
    Kind.IMPROVED: (Kind.EDGE_STARTED, Kind.FAILED),
    Kind.DIVERGED: (Kind.PLANNING_STARTED, Kind.FAILED),
}


def is_complete(run: RecordedRun, executed: Iterable[ExecutedOption]) -> bool:
    """Whether a run has ended and all that its events refer to is here as well.

    Args:
        run: Record of the run.
        executed: Options that were executed in the run's episode, all of them.
    """
    end = run.events.end
    if end is None:
        return False
    # The newest plan tells shortcuts from operators.
    planned = not run.announced or run.announced[-1] is not None
    reached = sum(option.reached for option in executed)
    return (
        (end.step == run.first_step or end.step in run.episode.steps)
        and end.step in run.episode.atoms
        and reached >= run.events.count(Kind.EDGE_REACHED)
        and planned
    )


def gaps_of(run: RecordedRun, executed: Iterable[ExecutedOption]) -> Iterator[str]:
    """Yield what is missing of a run, in words; a missing end is not reported.

    Args:
        run: Record of the run.
        executed: Options that were executed in the run's episode, all of them.
    """
    if states := missing_states(run.first_step, run.last_step, run.episode.steps):
        yield states
    if atoms := missing_atoms(run):
        yield atoms
    if _is_solved(run) and run.goal is None:
        yield "neither the task nor a plan names the goal"
    yield from missing_events(run.events.messages)
    if lost := len(run.announced) - len(run.plans):
        yield f"{lost} of {len(run.announced)} plans are missing"
    if lost := lost_options(run, executed):
        yield f"skill events of {lost} executed options are missing"


def lost_options(run: RecordedRun, executed: Iterable[ExecutedOption]) -> int:
    """How many options reached their targets of which no skill event says so."""
    steps = range(run.first_step, run.last_step + 1)
    reached = sum(option.reached for option in executed if option.start.step in steps)
    return max(0, run.events.count(Kind.EDGE_REACHED) - reached)


def missing_atoms(run: RecordedRun) -> str | None:
    """Which atoms of a run are missing: those of its end tell whether it was solved.

    Steps between may have none, since perception may be slower than the world.
    """
    if not (_is_solved(run) or run.announced):
        return None  # nothing was planned, so that nothing need have been perceived
    if not any(run.first_step <= step <= run.last_step for step in run.episode.atoms):
        return "all perceived atoms are missing"
    if _is_solved(run) and run.last_step not in run.episode.atoms:
        return f"the perceived atoms of step {run.last_step}, the last, are missing"
    return None


def _is_solved(run: RecordedRun) -> bool:
    """Whether the run ended in success, as its planner saw it."""
    return run.events.end is not None and run.events.end.kind == Kind.SOLVED


def missing_states(first: int, last: int, recorded: Collection[int]) -> str | None:
    """Say which states of a run are missing.

    Args:
        first: First environment step of the run.
        last: Last environment step of the run.
        recorded: Steps of the states that were recorded, of the whole episode.

    Returns:
        How many of how many, and which is the first; None if all are there.
    """
    missing = [step for step in range(first, last + 1) if step not in recorded]
    if not missing:
        return None
    total = last - first + 1
    if len(missing) == total:
        return f"all {total} states are missing"
    return f"{len(missing)} of {total} states are missing, the first that of step {missing[0]}"


def missing_events(events: Sequence[PlanEventMessage]) -> Iterator[str]:
    """Yield each place of a run at which a plan event is missing, in order.

    Args:
        events: Plan events of the run, in order; the first is PLANNING_STARTED.
    """
    for before, after in pairwise(events):
        if not _may_follow(before, after):
            yield (f"a plan event is missing between {_told(before)} and {_told(after)}")


def planning_is_whole(events: Sequence[PlanEventMessage]) -> bool:
    """Whether a run's plan events have the start and the end of planning for each plan."""
    for before, after in pairwise(events):
        begins = after.kind == Kind.PLANNING_STARTED
        if (after.kind == Kind.PLANNED) > (before.kind == Kind.PLANNING_STARTED):
            return False
        if before.kind == Kind.PLANNING_STARTED and after.kind not in FOLLOWERS[before.kind]:
            return False
        if begins and after.plan_number not in (0, before.plan_number + 1):
            return False
        improves = after.kind == Kind.IMPROVED
        if not begins and after.plan_number != before.plan_number + improves:
            return False
    return True


def _may_follow(before: PlanEventMessage, after: PlanEventMessage) -> bool:
    restarted = after.kind == Kind.PLANNING_STARTED and after.plan_number == 0
    if restarted:
        return True
    if after.kind not in FOLLOWERS.get(before.kind, ()):
        return False
    if after.kind in (Kind.PLANNING_STARTED, Kind.IMPROVED):
        return after.plan_number == before.plan_number + 1
    if after.kind == Kind.EDGE_STARTED:
        return after.edge == (0 if before.kind in ANNOUNCING else before.edge + 1)
    if after.kind in (Kind.EDGE_REACHED, Kind.DIVERGED):
        return after.edge == before.edge
    return True


def _told(event: PlanEventMessage) -> str:
    kind = Kind(event.kind)
    edge = f" {event.edge}" if kind in (Kind.EDGE_STARTED, Kind.EDGE_REACHED) else ""
    return f"{kind.name}{edge} at step {event.step}"
