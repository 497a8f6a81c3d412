# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run whose plan events were not recorded: its plans show that there was one, and little more.

When it began and ended, how long planning took and whether it was solved, only its events say.
"""

from __future__ import annotations

from collections.abc import Sequence

from slap_ros.errors import ErrorCode
from slap_ros.evaluation.atom_names import atom_names
from slap_ros.evaluation.executed_options import ExecutedOption
from slap_ros.evaluation.measurement import measure_option
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.evaluation.recorded_run import EpisodeLog
from slap_ros.evaluation.run_trace import RunTrace
from slap_ros.messages.decode import plan_bound

REASON = "the plan events are missing"
OF_EVENTS = (
    *("success", "plan_length", "shortcut_steps"),
    *("planning_seconds", "replans", "edges_rolled_out"),
)


def unrecorded_run(
    number: int,
    domain: str,
    preset: str | None,
    episode: EpisodeLog,
    options: Sequence[ExecutedOption],
) -> RunTrace:
    """What is known of a run without plan events.

    Args:
        number: Number of its episode.
        domain: Name of the domain; empty where it is not known.
        preset: Preset of the domain; None where it is not known.
        episode: What was recorded of the episode, at least one plan.
        options: Options that were executed in the episode, in order.
    """
    first, last = min(episode.steps, default=0), max(episode.steps, default=0)
    newest = episode.plans[-1]
    return RunTrace(
        metrics=_metrics(domain, preset, episode, options, last),
        episode=number,
        first_step=first,
        last_step=last,
        starts=tuple(option.start.step for option in options),
        goal=atom_names(newest.goal) if len(newest.goal) else None,
        plans=tuple(episode.plans),
        events=(),
    )


def _metrics(
    domain: str,
    preset: str | None,
    episode: EpisodeLog,
    options: Sequence[ExecutedOption],
    last_step: int,
) -> RunMetrics:
    task, plan = episode.task, episode.plans[0]
    unknown = dict.fromkeys(OF_EVENTS, REASON)
    if task is None:
        unknown |= dict.fromkeys(("seed", "index"), "the task is missing")
    if preset is None:
        unknown["preset"] = "the domain is missing"
    return RunMetrics(
        domain=domain,
        preset=preset,
        seed=task.seed if task is not None else None,
        index=task.index if task is not None else None,
        success=None,
        plan_length=None,
        shortcut_steps=None,
        planning_seconds=None,
        replans=None,
        edges_rolled_out=None,
        error_code=ErrorCode.UNKNOWN,
        error_msg=REASON,
        options=tuple(measure_option(episode, option, last_step) for option in options),
        planner=plan.planner,
        library=plan.library,
        samples=plan.samples,
        bound=plan_bound(plan),
        unknown=unknown,
    )
