# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Jobs that explore a task each, or say why it has no plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from slap_ros.errors import UnsolvableError
from slap_ros.studies.job_runner import Job, JobRunner

Explored = TypeVar("Explored")


def explore_tasks(
    runner: JobRunner,
    domain: str,
    function: Callable[..., Any],
    decode: Callable[[Any], Explored],
    jobs: Mapping[str, Job],
) -> dict[str, Explored]:
    """Explore tasks, without those that have no plan.

    Args:
        runner: Runner of the jobs; it reports what has no plan.
        domain: Name of the domain, for the progress bar.
        function: Function that explores a task, or returns why it has no plan, in words.
        decode: Function that makes a result of its JSON.
        jobs: Arguments of the function, by the job's name.

    Returns:
        The results by the job's name.

    Raises:
        UnsolvableError: No task has a plan.
    """
    results = runner.run(
        f"exploring {domain}",
        function,
        lambda data: data if isinstance(data, str) else decode(data),
        jobs,
        failure=lambda one: f"has no plan: {one}" if isinstance(one, str) else None,
    )
    found = {name: one for name, one in results.items() if not isinstance(one, str)}
    if not found:
        first = next(iter(results.values()))
        raise UnsolvableError(f"none of the {len(jobs)} tasks has a plan: {first}")
    return found
