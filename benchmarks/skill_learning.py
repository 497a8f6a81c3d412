# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Environment steps that a skill learns for in a second of the processor, judgements included.

    python -m benchmarks.skill_learning [--domain stack_at_target] [--steps 4000] [--set NAME=VALUE]

The first skill of a domain's plans, with the settings that skills are learned with: with one core,
and then with two, of which the second judges, steps half of the worlds and computes one critic.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import torch

from slap_ros.acquisition.curriculum import jobs
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.task_source import VALIDATION, TaskSource
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.learning.setting_changes import changed, parse_changes

STARTS = 40  # tasks that it learns from, and as many that it is judged on
NEVER = 2.0  # a share that is never reached, so that all steps are learned for


def source_of(domain: Domain) -> TaskSource:
    """Tasks of the domain's first goal, with the operators and rewards written by hand."""
    written = domain.acquisition
    assert written is not None
    goal = next(iter(domain.goals))
    return TaskSource.of(domain, goal, 0, written.operators, written.rewards)


def rollouts_from(source: TaskSource, first: int) -> list[PlanRollout]:
    """Rollouts of plans without any skill.

    Args:
        source: Source of tasks.
        first: Index of the first task.
    """
    return [PlanRollout.from_json(jobs.carry_out(source, first + i, {})) for i in range(STARTS)]


def measured(function: Callable[[], object]) -> tuple[float, float]:
    """Seconds of the clock, and of the processor, processes that ended included."""
    began, before = perf_counter(), os.times()[:4]
    function()
    return perf_counter() - began, sum(os.times()[:4]) - sum(before)


def main() -> None:
    """Print environment steps, seconds, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--domain", default="stack_at_target")
    parser.add_argument("--steps", type=int, default=4_000)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    source = source_of(get_domain(arguments.domain))
    rollouts, fresh = rollouts_from(source, 0), rollouts_from(source, VALIDATION.first)
    operator = rollouts[0].stages[0].operator
    settings = changed(AcquisitionSettings(), parse_changes(arguments.set, AcquisitionSettings))
    settings = replace(settings, skill_steps=arguments.steps, enough=NEVER)
    states = InitiationStates.of(operator, rollouts), InitiationStates.of(operator, fresh)
    horizon = jobs.horizon_of(source.make_domain())
    steps = settings.segments(horizon) * settings.segment_steps(horizon)
    print(f"{operator} of {arguments.domain}: {steps} environment steps")
    for cores in (1, 2):
        with TemporaryDirectory() as folder:
            job = jobs.LearningJob(source, operator, 0, *states, settings, Path(folder) / operator)
            seconds, of_processor = measured(partial(jobs.learn, job, cores))
        print(
            f"cores: {cores}; {seconds:.1f} s, {steps / seconds:.0f} steps a second; "
            f"{of_processor:.1f} s of the processor, {steps / of_processor:.0f} steps a second"
        )


if __name__ == "__main__":
    main()
