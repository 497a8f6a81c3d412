# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Environment steps that a skill learns for in a second of the processor, judgements included.

    python -m benchmarks.skill_learning [--domain stack_at_target] [--steps 4000]

The first skill of a domain's plans, with the settings that skills are learned with, on one thread.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import torch

from slap_ros.acquisition import jobs
from slap_ros.acquisition.rollouts import PlanRollout
from slap_ros.acquisition.settings import AcquisitionSettings
from slap_ros.acquisition.task_source import VALIDATION, TaskSource
from slap_ros.core import Domain
from slap_ros.domains import get_domain

STARTS = 40  # tasks that it learns from, and as many that it is judged on


def source_of(domain: Domain) -> TaskSource:
    """Tasks of the domain's first goal, with the operators and rewards written by hand."""
    written = domain.acquisition
    assert written is not None
    goal = next(iter(domain.goals))
    return TaskSource.of(domain, goal, 0, written.operators, written.rewards)


def first_stages(source: TaskSource, first: int) -> tuple[str, list[jobs.InitiationRecord]]:
    """The first operator of the plans, and where its skill begins.

    Args:
        source: Of tasks.
        first: Index of the first task.
    """
    rollouts = [PlanRollout.from_json(jobs.carry_out(source, first + i, {})) for i in range(STARTS)]
    stages = [(rollout, rollout.stages[0]) for rollout in rollouts]
    operator = stages[0][1].operator
    return operator, [jobs.initiation_record(*pair) for pair in stages if pair[1].state]


def main() -> None:
    """Print environment steps, seconds of the processor, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--domain", default="stack_at_target")
    parser.add_argument("--steps", type=int, default=4_000)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    source = source_of(get_domain(arguments.domain))
    operator, starts = first_stages(source, 0)
    _, fresh = first_stages(source, VALIDATION)
    settings = replace(AcquisitionSettings(), skill_steps=arguments.steps, enough=2.0)
    began = process_time()
    with TemporaryDirectory() as folder:
        learned = jobs.learn(
            source, operator, 0, starts, fresh, settings, str(Path(folder) / operator), None
        )
    seconds = process_time() - began
    horizon = jobs.horizon_of(source.make_domain())
    steps = len(learned["segments"]) * settings.segment_steps(horizon)
    print(
        f"{operator} of {arguments.domain}: {steps} environment steps in {seconds:.1f} s of the "
        f"processor, {steps / seconds:.0f} per second"
    )


if __name__ == "__main__":
    main()
