# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The selection of the skills to train next: those that fail often and may still improve.

LG-SAIL's Algorithm 1 trains every skill that failed. Two rules are ours. What fails rarely waits
for what fails often. And a skill that rounds of training did not improve is left for others, until
plans get further and it begins in new states.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState
from slap_ros.acquisition.curriculum.dead_ends import DeadEnd, find_dead_ends
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, StageEnd, failed_stages
from slap_ros.acquisition.training.settings import AcquisitionSettings

NO_PROGRESS = "no progress"  # reason why a skill is not trained, and why a curriculum then ends
RARELY = 0.25  # share of the worst skill's failure rate below which a skill waits


@dataclass(frozen=True)
class SkillSelection:
    """The skills that are to be trained in an iteration.

    Args:
        operators: Names of the skills' operators, in alphabetical order; empty where nothing is
            left to be trained.
        steps: Environment steps that each skill may learn for.
        not_trained: Reasons why other skills that fail are not trained, by operator.
        dead_ends: Dead ends whose skills are to be learned from scratch: the skills before are
            among ``operators``; the skills that never succeeded follow once these were learned.
    """

    operators: tuple[str, ...]
    steps: int
    not_trained: Mapping[str, Any]
    dead_ends: Sequence[DeadEnd] = ()


def select_skills(
    rollouts: Sequence[PlanRollout], state: CurriculumState, settings: AcquisitionSettings
) -> SkillSelection:
    """Choose the skills to train next, as many as the budget has whole rounds for.

    Args:
        rollouts: Rollouts of this iteration.
        state: State of the curriculum.
        settings: All hyper-parameters of the curriculum.

    Returns:
        The skills, and how long each may learn.
    """
    failures = Counter(stage.operator for stage in failed_stages(rollouts))
    tried = Counter(stage.operator for rollout in rollouts for stage in rollout.stages)
    often = failing_often(failures, tried, settings.enough)
    reasons = {name: _why_not(name, rollouts, state, settings.patience) for name in often}
    not_trained = {name: reason for name, reason in reasons.items() if reason is not None}
    hopeless = [name for name in not_trained if not_trained[name]["why"] == NO_PROGRESS]
    dead_ends = find_dead_ends(hopeless, rollouts, state)
    again = list(dict.fromkeys(end.before for end in dead_ends))  # several may fail after one
    hopeful = again + [name for name in often if name not in {*not_trained, *again}]
    if not hopeful:
        return SkillSelection((), 0, not_trained)
    left = settings.total_steps - state.steps
    chosen = hopeful[: max(1, left // settings.skill_steps)]
    steps = min(settings.skill_steps, left // len(chosen))
    dead_ends = [end for end in dead_ends if end.before in chosen]
    return SkillSelection(tuple(sorted(chosen)), steps, not_trained, dead_ends)


def failing_often(failures: Counter[str], tried: Counter[str], enough: float) -> list[str]:
    """The skills that fail often, most often first; those that fail rarely wait for these.

    Else a few failures of many would cost a whole round, and more training can make good skills
    worse.

    Args:
        failures: Number of failures of each skill that failed.
        tried: Number of tries of each skill.
        enough: Success rate from which on a skill is good.
    """
    shares = {name: count / tried[name] for name, count in failures.most_common()}
    rare = max(1.0 - enough, RARELY * max(shares.values(), default=0.0))
    return [name for name, share in shares.items() if share > rare] or list(shares)


def _why_not(
    name: str, rollouts: Sequence[PlanRollout], state: CurriculumState, patience: int
) -> dict[str, Any] | None:
    """The reason why a skill that fails is not trained, as JSON; None where it is trained.

    A skill is trained if there are states to learn from, and fewer stale rounds than ``patience``
    or new states.
    """
    initiations = InitiationStates.of(name, rollouts)
    if not initiations.failed:
        return {"why": StageEnd.NOT_APPROACHED.value}
    skill = state.skills[name]
    new_states = state.improved and skill.learned_from != initiations.digest
    if skill.stale < patience or new_states:
        return None
    failed = [stage for stage in failed_stages(rollouts) if stage.operator == name]
    atoms = Counter(atom for stage in failed for atom in stage.atoms)
    metrics = {name: fmean(s.metrics[name] for s in failed) for name in failed[0].metrics}
    return {
        "why": NO_PROGRESS,
        "states": len(initiations.failed),
        "ends": dict(Counter(stage.end for stage in failed)),
        "atoms": dict(atoms.most_common(3)),
        "metrics": {name: round(value, 3) for name, value in metrics.items()},
    }
