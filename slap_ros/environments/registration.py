# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names for ``gymnasium.make``, from the moment that ``slap_ros.environments`` is imported.

Gymnasium 1.0 looks for no plug-ins any more: whoever wants environments imports their package.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slap_ros.environments.task_env import TaskEnv

OBSERVATIONS = ("state", "view", "dict")
NAMESPACE = "slap_ros"
TASKS: Mapping[str, str] = {  # names within the namespace, and their domains
    "Obstacle2D-v0": "obstacle2d",
    "ObstacleTower-v0": "obstacle_tower",
    "ClutteredDrawer-v0": "cluttered_drawer",
    "CleanupTable-v0": "cleanup_table",
    "StackAtTarget-v0": "stack_at_target",
    "StowHammer-v0": "stow_hammer",
    "PegInHole-v0": "peg_in_hole",
    "MakeCoffee-v0": "make_coffee",
    "Groceries-v0": "groceries",
    "Bowls-v0": "bowls",
}


def register() -> None:
    """Register an environment for each of our domains."""
    import gymnasium

    for name, domain in TASKS.items():
        gymnasium.register(
            f"{NAMESPACE}/{name}",
            entry_point="slap_ros.environments.registration:make_task_env",
            kwargs={"domain": domain},
        )


def make_task_env(domain: str, preset: str = "", *, obs: str = "state", **options: Any) -> TaskEnv:
    """Make the environment of a domain's tasks.

    Args:
        domain: Name of the domain.
        preset: Name of a preset, maybe with settings; empty for the domain's first.
        obs: Observation: ``state``, ``view``, or ``dict`` for one with goals.
        options: Further arguments of :class:`~slap_ros.environments.task_env.TaskEnv`.

    Returns:
        The environment.

    Raises:
        InvalidParameterError: An argument has a value that it cannot have.
    """
    from slap_ros.environments.goal_task_env import GoalTaskEnv
    from slap_ros.environments.task_env import TaskEnv
    from slap_ros.errors import InvalidParameterError

    if obs not in OBSERVATIONS:
        raise InvalidParameterError(f"unknown obs {obs!r}; there are {', '.join(OBSERVATIONS)}")
    if obs == "dict":
        return GoalTaskEnv(domain, preset, **options)
    return TaskEnv(domain, preset, obs=obs, **options)
