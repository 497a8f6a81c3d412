# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the jobs of an evaluation or a training run, and what training needs."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from importlib.util import find_spec

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.workers import SequentialWorkers, Workers, local_workers, ray_workers
from slap_ros.whole_numbers import require_whole


def some_workers(jobs: int | None, ray: str | None = None) -> AbstractContextManager[Workers]:
    """So many processes, this one for None, or the Ray cluster at an address.

    Raises:
        InvalidParameterError: No number of processes, or no such cluster.
    """
    if ray is not None:
        return ray_workers(ray)
    if jobs is None:
        return nullcontext(SequentialWorkers())
    require_whole("jobs", jobs, least=1)
    return local_workers(jobs)


def require_torch() -> None:
    """Refuse to train without what training needs.

    It is looked for and not imported: jobs import it, and this process would for seconds.

    Raises:
        InvalidParameterError: It is not installed.
    """
    missing = [name for name in ("torch", "stable_baselines3") if find_spec(name) is None]
    if missing:
        raise InvalidParameterError(
            f"training needs torch and stable-baselines3, and there is no {missing[0]}: "
            "pip install 'slap_ros[train]'"
        )
