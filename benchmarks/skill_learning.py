# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Environment steps that a skill learns for in a second of the processor, judgements included.

    python -m benchmarks.skill_learning [--domain stack_at_target] [--steps 4000] [--set NAME=VALUE]

The first skill of a domain's plans, on one thread, with the settings that skills are learned with.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import torch

from slap_ros.acquisition import jobs
from slap_ros.acquisition.initiation_states import InitiationStates
from slap_ros.acquisition.rollouts import PlanRollout
from slap_ros.acquisition.settings import AcquisitionSettings
from slap_ros.acquisition.task_source import VALIDATION, TaskSource
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
    """Plans without any skill.

    Args:
        source: Of tasks.
        first: Index of the first task.
    """
    return [PlanRollout.from_json(jobs.carry_out(source, first + i, {})) for i in range(STARTS)]


def main() -> None:
    """Print environment steps, seconds of the processor, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--domain", default="stack_at_target")
    parser.add_argument("--steps", type=int, default=4_000)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    source = source_of(get_domain(arguments.domain))
    rollouts, fresh = rollouts_from(source, 0), rollouts_from(source, VALIDATION)
    operator = rollouts[0].stages[0].operator
    settings = changed(AcquisitionSettings(), parse_changes(arguments.set, AcquisitionSettings))
    settings = replace(settings, skill_steps=arguments.steps, enough=NEVER)
    states = InitiationStates.of(operator, rollouts), InitiationStates.of(operator, fresh)
    began = process_time()
    with TemporaryDirectory() as folder:
        job = jobs.LearningJob(source, operator, 0, *states, settings, Path(folder) / operator)
        learned = jobs.learn(job)
    seconds = process_time() - began
    horizon = jobs.horizon_of(source.make_domain())
    steps = len(learned["segments"]) * settings.segment_steps(horizon)
    print(
        f"{operator} of {arguments.domain}: {steps} environment steps in {seconds:.1f} s of the "
        f"processor, {steps / seconds:.0f} per second"
    )


if __name__ == "__main__":
    main()
