# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Engines of unified-planning as planners of PDDL files: the field's own, to compare ours with.

unified-planning is an extra (``pip install 'slap_ros[up]'``), which brings the engine aries. Others
are found once their packages are installed.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from slap_ros.cli.plan_pddl import PddlPlan
from slap_ros.errors import InvalidParameterError, PlanningLimitError, UnsolvableError

if TYPE_CHECKING:
    from unified_planning.environment import Environment

INSTALL = "pip install 'slap_ros[up]'"


def plan_with_engine(domain: str, problem: str, engine: str) -> PddlPlan:
    """The plan of an engine, read by unified-planning from the files' own text.

    Args:
        domain: PDDL.
        problem: PDDL.
        engine: Name of the engine, such as ``aries``.

    Raises:
        InvalidParameterError: unified-planning or the engine is missing, or cannot read the files,
            or the plan is no sequence.
        UnsolvableError: The engine says that there is no plan.
        PlanningLimitError: The engine ended without a plan.
    """
    with _environment() as environment:
        _require_engine(environment, engine)
        try:
            task = _read(environment, domain, problem)
            with environment.factory.OneshotPlanner(name=engine) as planner:
                result = planner.solve(task)
        except Exception as error:  # whatever a library of many authors may raise
            raise InvalidParameterError(f"unified-planning's {engine} failed: {error}") from error
        status = result.status.name
        if result.plan is None:
            failure = UnsolvableError if status.startswith("UNSOLVABLE") else PlanningLimitError
            reasons = "; ".join(entry.message for entry in result.log_messages or ())
            raise failure(f"unified-planning's {engine} found no plan: {status} {reasons}".rstrip())
        if not hasattr(result.plan, "actions"):
            raise InvalidParameterError(
                f"unified-planning's {engine} found a plan that is no sequence of operators, as of "
                "durative actions; that is not read here"
            )
        steps = tuple(map(_as_step, result.plan.actions))
        return PddlPlan(steps, _cost(task, result.plan), status == "SOLVED_OPTIMALLY")


@contextmanager
def _environment() -> Iterator[Environment]:
    """The one environment in which unified-planning can read costs, set up for PDDL meanwhile."""
    try:
        from unified_planning.environment import get_environment
    except ImportError as error:
        raise InvalidParameterError(
            f"engines of unified-planning need an extra that is not installed: {INSTALL}"
        ) from error
    environment = get_environment()
    before = environment.error_used_name, environment.credits_stream
    environment.error_used_name = False  # PDDL lets an object and its type share a name
    environment.credits_stream = None
    try:
        yield environment
    finally:
        environment.error_used_name, environment.credits_stream = before


def _require_engine(environment: Environment, engine: str) -> None:
    factory = environment.factory
    found = sorted(name for name in factory.engines if factory.engine(name).is_oneshot_planner())
    if engine not in found:
        raise InvalidParameterError(
            f"unified-planning has no engine {engine!r} here; there are {', '.join(found)}"
        )


def _read(environment: Environment, domain: str, problem: str) -> Any:
    from unified_planning.io import PDDLReader

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Name .* already defined")
        return PDDLReader(environment).parse_problem_string(domain, problem)


def _as_step(action: Any) -> str:
    """An operator and its objects, as plans list them: ``(drive truck depot shop)``."""
    return f"({' '.join((action.action.name, *map(str, action.actual_parameters)))})"


def _cost(task: Any, plan: Any) -> float | None:
    """What a plan costs by the problem's metric, computed by unified-planning; None without one."""
    from unified_planning.engines import sequential_simulator as simulation
    from unified_planning.model.metrics import MinimizeActionCosts

    if not task.quality_metrics or not isinstance(task.quality_metrics[0], MinimizeActionCosts):
        return None
    (metric,) = task.quality_metrics
    simulator = simulation.UPSequentialSimulator(task)
    state = simulator.get_initial_state()
    cost = simulation.evaluate_quality_metric_in_initial_state(simulator, metric)
    for step in plan.actions:
        following = simulator.apply(state, step)
        cost = simulation.evaluate_quality_metric(
            simulator, metric, cost, state, step.action, step.actual_parameters, following
        )
        state = following
    return float(cost)
