# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning one task, with or without shortcuts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter

from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.left_out import Tell, warn_caller
from slap_ros.api.shortcut_choice import SAMPLES, Shortcuts, choose_library, sampling
from slap_ros.core import Domain, Task
from slap_ros.evaluation.approaches import approaches
from slap_ros.planning.plan import PlanningResult, PlanOrigin
from slap_ros.planning.planner import Planner
from slap_ros.planning.planner_choice import DEFAULT_PLANNER
from slap_ros.relational import State


@checks_arguments
def plan(
    domain: Domain,
    task: Task,
    shortcuts: Shortcuts = "shipped",
    *,
    planner: str = DEFAULT_PLANNER,
    samples: int = SAMPLES,
) -> PlanningResult:
    """Plan one task without executing it.

    Args:
        domain: Domain of the task, as :func:`make` makes it.
        task: Task to solve, as ``domain.task(seed=1)``.
        shortcuts: Learned shortcuts to plan with: ``shipped`` for the library that ships, if
            there is one; None for pure planning; a folder that :func:`train` made; or a library.
        planner: Planner: anytime, lazy, exhaustive, ff or astar; anytime may have settings, as in
            ``anytime:within=1.25,effort=4``.
        samples: Attempts of a shortcut in the model; the shortest is used.

    Returns:
        The plan with the effort of finding it. ``print`` shows a line per edge; ``.steps`` is the
        number of environment steps that the model predicts.

    Raises:
        UnsolvableError: There is no plan.
        PlanningLimitError: A limit was reached first.
        NoSkillsError: The domain has no skills yet.
        InvalidLibraryError: The library cannot be used as a whole.
        InvalidParameterError: There is no such planner, or it cannot use shortcuts.
    """
    return plan_task(domain, task, shortcuts, planner, samples, warn_caller)


def plan_task(
    domain: Domain, task: Task, shortcuts: Shortcuts, planner: str, samples: int, tell: Tell
) -> PlanningResult:
    """Plan one task; see :func:`plan`.

    Args:
        domain: Domain of the task.
        task: Task to solve.
        shortcuts: Shortcuts to plan with.
        planner: Name of the planner.
        samples: Attempts of a shortcut in the model.
        tell: Function that receives warnings about shortcuts that are left out.

    Returns:
        The plan and its measurements.
    """
    maker = planner_for(domain, task, shortcuts, planner, samples, tell)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    return maker.plan(task.initial_state, goal)


@dataclass(frozen=True)
class NamedPlanner:
    """A planner whose plans say what made them, and how long that took.

    Args:
        planner: Planner that makes the plans.
        origin: Record, kept in each plan, of what made it.
    """

    planner: Planner
    origin: PlanOrigin

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`."""
        began = perf_counter()
        result = self.planner.plan(state, goal)
        seconds = perf_counter() - began
        return replace(result, seconds=seconds, origin=self.origin, planner=self)


def planner_for(
    domain: Domain,
    task: Task,
    shortcuts: Shortcuts = "shipped",
    planner: str = DEFAULT_PLANNER,
    samples: int = SAMPLES,
    tell: Tell = warn_caller,
) -> NamedPlanner:
    """A planner for the objects of a task.

    Args:
        domain: Domain of the task.
        task: Task to solve, or another one of the same objects.
        shortcuts: Shortcuts to plan with.
        planner: Name of the planner.
        samples: Attempts of a shortcut in the model.
        tell: Function that receives warnings about shortcuts that are left out.
    """
    library = choose_library(shortcuts, domain, planner, tell)
    approach = approaches(library, sampling(samples))[-1]
    maker = approach.planner(planner, domain, task.initial_state)
    digest = library.digest if library is not None else ""
    return NamedPlanner(maker, PlanOrigin(planner, digest, samples))
