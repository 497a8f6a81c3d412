# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names for ``gymnasium.make``, from the moment that ``slap_ros.environments`` is imported.

Gymnasium 1.0 looks for no plug-ins any more: whoever wants environments imports their package.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from slap_ros.domains.registry import domain_names

if TYPE_CHECKING:
    from slap_ros.environments.task_env import TaskEnv

OBSERVATIONS = ("state", "view", "dict", "options")
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


# Those for which a library of shortcuts ships, and those whose skills can be acquired.
SHORTCUTS: Mapping[str, str] = {
    "Obstacle2D-shortcut-v0": "obstacle2d",
    "ObstacleTower-shortcut-v0": "obstacle_tower",
    "ClutteredDrawer-shortcut-v0": "cluttered_drawer",
    "CleanupTable-shortcut-v0": "cleanup_table",
}
SKILLS: Mapping[str, str] = {
    "StackAtTarget-skill-v0": "stack_at_target",
    "StowHammer-skill-v0": "stow_hammer",
    "PegInHole-skill-v0": "peg_in_hole",
    "MakeCoffee-skill-v0": "make_coffee",
    "Groceries-skill-v0": "groceries",
    "Bowls-skill-v0": "bowls",
}
MADE_BY: Mapping[str, Mapping[str, str]] = {  # by what in the package
    "registration:make_task_env": TASKS,
    "shortcut_env:ShortcutEnv": SHORTCUTS,
    "skill_env:SkillEnv": SKILLS,
}


def register() -> None:
    """Register the environments of each of our domains, and the tasks of each other one."""
    import gymnasium

    others = {"registration:make_task_env": tasks_of_others(domain_names())}
    for maker, names in (*MADE_BY.items(), *others.items()):
        for name, domain in names.items():
            gymnasium.register(
                f"{NAMESPACE}/{name}",
                entry_point=f"slap_ros.environments.{maker}",
                kwargs={"domain": domain},
            )


def tasks_of_others(domains: Iterable[str]) -> dict[str, str]:
    """Names for the tasks of domains of other distributions: ``Marbles-v0`` for ``marbles``.

    Args:
        domains: Names of all domains, ours among them.

    Returns:
        Domains by their names within the namespace. Of two with one name, the first has it.
    """
    found = dict(TASKS)
    for domain in domains:
        words = re.findall(r"[A-Za-z0-9]+", domain)  # a name may have any letters, Gymnasium's not
        if words and domain not in TASKS.values():
            found.setdefault("".join(word[0].upper() + word[1:] for word in words) + "-v0", domain)
    return {name: domain for name, domain in found.items() if name not in TASKS}


def make_task_env(domain: str, preset: str = "", *, obs: str = "state", **options: Any) -> TaskEnv:
    """Make the environment of a domain's tasks.

    Args:
        domain: Name of the domain.
        preset: Name of a preset, maybe with settings; empty for the domain's first.
        obs: Observation: ``state``, ``view``, ``dict`` for one with goals, or ``options`` for one
            with the option that runs.
        options: Further arguments of :class:`~slap_ros.environments.task_env.TaskEnv`.

    Returns:
        The environment.

    Raises:
        InvalidParameterError: An argument has a value that it cannot have.
    """
    from slap_ros.environments.goal_task_env import GoalTaskEnv
    from slap_ros.environments.option_task_env import OptionTaskEnv
    from slap_ros.environments.task_env import TaskEnv
    from slap_ros.errors import InvalidParameterError

    if obs not in OBSERVATIONS:
        raise InvalidParameterError(f"unknown obs {obs!r}; there are {', '.join(OBSERVATIONS)}")
    if obs == "dict":
        return GoalTaskEnv(domain, preset, **options)
    if obs == "options":
        if options.setdefault("control", "both") != "both":
            raise InvalidParameterError("obs='options' has control='both', and no other")
        return OptionTaskEnv(domain, preset, **options)
    return TaskEnv(domain, preset, obs=obs, **options)
